"""Films and the page draw the same lines: the glyphs of both, run by Python and as the page has them, stroke by stroke."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.outputs import html
from emsim.outputs.film import drawn
from emsim.outputs.glyphs import GLYPHS
from emsim.outputs.glyphs.paper import named, paper
from emsim.outputs.stage import Stage

ROOT = Path(__file__).resolve().parents[2] / "netlists"
# decks that draw every kind of shape between them
DECKS = [
    "coupled/pendulum_servo", "coupled/slider_crank_hbridge", "coupled/voice_coil", "lessons/05_gear", "lessons/06_pot",
    "mechanical/ref_andrews_squeezer", "mechanical/lead_screw", "mechanical/ref_four_bar", "mechanical/car_differential",
    "mechanical/block_and_tackle", "mechanical/peg_pendulum", "coupled/winch_crane",
    "mechanical/flexible_pendulum", "coupled/flexible_arm", "coupled/relay", "coupled/saturating_magnet", "coupled/es_switch",
]  # fmt: skip
BENCH = """what the decks leave out
.gravity 9.81
BODY arm shape=rod(0.3,0.02) m=0.2
BODY wheel shape=disc(0.05) m=0.2
BODY cart shape=box(0.1,0.05) m=1
BODY rotor m=0 j=1m
BODY ball m=1 shape=disc(0.02)
BODY follower m=0.1
BODY skate m=1 j=0.01
BODY globe m=1 look=ball(0.03)
BODY tyre m=1 j=1m look=wheel(0.05)
BODY cog m=1 j=1m look=gear(0.05,17)
BODY van m=1 look=wagon(0.1,0.04)
BODY part m=1 j=1m look=stl(nut.stl,1m)
SHAPE foot 0 polygon(0.5,-0.4,0.7,-0.4,0.6,-0.3)
JOINT ice 0 skate planar ic=(0.6,-0.3,20deg)
KNIFE blade skate 0 along=(1,0)
LATCH grip skate(0.1,0) globe hold=distance catch={time>0.1}
LATCH hook van 0(0.35,0.5) catch={time>0.1} hold=point
JOINT hinge 0 arm pin zero=-90deg ic=10deg
JOINT axle 0(0.4,0) wheel pin
JOINT rail 0(0,-0.4) cart slide
JOINT shaft 0(-0.3,0) rotor pin
JOINT free 0(0.3,-0.2) ball slide axis=(0,1)
JOINT lift 0(-0.3,0.3) follower slide axis=(0,1)
JOINT thrown 0(0.2,0.3) globe slide ic=(0,0.1)
JOINT hub 0(0.6,0.4) tyre pin ic=(0,3)
JOINT spindle 0(0.75,0.4) cog pin ic=(0,2)
JOINT road 0(0.3,0.5) van slide ic=(0,0.2)
JOINT hung 0(0.5,0.1) part pin ic=(0.3,2)
BELT b1 axle shaft r1=0.05 r2=0.1 k=100
STOP s1 hinge min=-60deg max=60deg k=100
STOP s2 rail min=-0.05 max=0.05 k=1k
FRICTION fr rail fc=0.1
CONTACT c1 ball 0(0.3,-0.3) line=(0,1) r=0.02 k=1k
SPRING k1 axle k=0.1
SPRING k2 rail k=100
SPRING k3 arm(0.3,0) 0(0.6,0.2) k=1
DAMPER d1 rail c=1
DAMPER d2 hinge c=1m
TORQUE t1 axle tau={0.01*sin(10*time)}
FORCE f1 arm(0.3,0) dir=(1,0) {0.2*cos(5*time)}
TRANSDUCER coil va 0 rail K={1+pos(rail)}
CAM cm lift shaft lift={0.02*(1-cos(angle(shaft)))}
DRIVE dr shaft qd={1}
MOTOR m1 drive 0 hinge kt=20m r=2 l=1m
Vd drive 0 SIN(0 3 2)
Va a 0 SIN(0 1 3)
Ra a va 10
.tran 1m 0.2
.end
"""
RECORD = """(t) => {
    const m = window.emsim.machine, calls = [], pen = { unit: 1 }, { shapes } = m.scene;
    for (const name of ["line", "polygon", "area", "circle", "arc", "head", "label", "write", "keep_off"])
        pen[name] = (...args) => calls.push([name, ...args]);
    window.emsim.clock.t = t;
    m.draw();
    drawn.paper(m, pen);
    for (const layer of [0, 1, 2])
        for (const s of shapes) if (drawn.GLYPHS[s.kind]?.[0] === layer) drawn.GLYPHS[s.kind][1](m, pen, s);
    return { calls, width: m.width, height: m.height, scale: m.scale, middle: m.middle, kinds: shapes.map((s) => s.kind) }; }"""
CLOSE = 0.25  # px: columns of a page are float32, and thinned where they are many


def nut() -> str:
    """A hexagon with a square hole in an STL file [mm]."""
    rings = [
        [(r * math.cos(2 * math.pi * k / 12), r * math.sin(2 * math.pi * k / 12)) for k in range(12)]
        for r in (30, 12)
    ]
    lines = ["solid nut"]
    for k in range(12):
        (a, b), (d, c) = ((ring[k], ring[(k + 1) % 12]) for ring in rings)
        for z, p, q, r, s in ((5, a, b, c, d), (-5, d, c, b, a)):
            for corners in ((p, q, r), (p, r, s)):
                lines += ["facet normal 0 0 0", "outer loop"]
                lines += [f"vertex {x!r} {y!r} {z}" for x, y in corners] + ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid"])


class Recorder:
    """A pen that notes what it is asked."""

    unit = 1.0

    def __init__(self) -> None:
        self.calls: list[list[Any]] = []

    def __getattr__(self, name: str) -> Any:
        return lambda *args: self.calls.append([name, *args])


def plain(value: Any) -> Any:
    return [plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def same(a: Any, b: Any) -> bool:
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, (int, float)) and isinstance(b, (int, float)):
        return math.isclose(a, b, rel_tol=0.0, abs_tol=CLOSE)
    return a == b


@pytest.fixture(scope="module")
def seen() -> set[str]:
    return set()


@pytest.mark.parametrize("name", [*DECKS, "bench"])
def test_films_and_the_page_draw_the_same_strokes(
    name: str, tmp_path: Path, visit: Any, seen: set[str]
) -> None:
    deck = ROOT / f"{name}.cir"
    if name == "bench":
        deck = tmp_path / "bench.cir"
        deck.write_text(BENCH)
        (tmp_path / "nut.stl").write_text(nut())
    result = pipeline.run(str(deck), scene=True)
    path = tmp_path / "page.html"
    html.write(str(path), result)
    table, page = result.main, visit(path)
    times = table.doubles(0)
    kept = page.evaluate("() => [...window.emsim.run.scene.time]")
    # a row that both have, by the clock of each: at a stop's instant one rounding before it is another picture
    t, k = next((t, k) for t in times[len(times) // 3 :] for k in kept if abs(t - k) <= 1e-12 * t)
    there = page.evaluate(RECORD, k)
    stage, pen = Stage(table, 480), Recorder()
    stage.width, stage.height, stage.scale, stage.middle = (
        there[k] for k in ("width", "height", "scale", "middle")
    )
    stage.at(t)
    paper(stage, pen)
    drawn(stage, pen)
    mine = plain(pen.calls)
    assert [c[0] for c in mine] == [c[0] for c in there["calls"]]
    assert not [(a, b) for a, b in zip(mine, there["calls"], strict=True) if not same(a, b)]
    seen |= set(there["kinds"])


def test_those_decks_show_every_glyph(seen: set[str]) -> None:
    if len(seen) < 3:
        pytest.skip("the strokes were not compared in this run")
    assert set(GLYPHS) == seen


def test_names_stand_where_both_put_them(tmp_path: Path, visit: Any) -> None:
    path = tmp_path / "page.html"
    html.write(str(path), pipeline.run(str(ROOT / "coupled/pendulum_servo.cir"), scene=True))
    page = visit(path)
    labels = [[10 * k % 70, 20 + 7 * k, f"name{k}", "soft" if k % 3 else "coil"] for k in range(12)]
    taken = [[20, 20, 60, 60], [0, 90, 30, 95]]
    there = page.evaluate(
        "([a, b]) => drawn.named(a, b, [200, 150], 1, (t) => 6 * t.length)", [labels, taken]
    )
    assert named(labels, taken, [200, 150], 1, lambda t: 6.0 * len(t)) == there
