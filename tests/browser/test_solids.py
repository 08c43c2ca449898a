"""Spatial machines as solids: what is hidden, turning, perspective, fingers; the page's picture beside the film's."""

from __future__ import annotations

from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from emsim import pipeline
from emsim.outputs import html
from emsim.outputs.film import COLOURS
from emsim.outputs.solid import Solids
from emsim.outputs.stage import Stage

ROOT = Path(__file__).resolve().parents[2] / "netlists"
MOST = 900_000  # characters of a page
# two plates, one behind the other as seen along z, on a slow hinge
PLATES = """plates
.gravity 0 0 0
BODY front m=1 shape=box(0.1,0.1,0.01)
BODY back m=1 shape=box(0.2,0.2,0.01)
BODY bar m=1 shape=rod(0.3,0.02)
JOINT a 0(0,0,0.1) front pin axis=(0,0,1)
JOINT b 0(0,0,-0.1) back pin axis=(0,0,1)
JOINT c 0(-0.15,0.2,0) bar pin axis=(0,1,0)
.tran 10m 0.1
.end
"""
VIEW = """([yaw, pitch]) => { const m = window.emsim.machine;
    Object.assign(m, { yaw, pitch });
    m.measureDepth();
    m.draw(); }"""
# the solids alone, without what is written over them
PIXELS = """() => { const { solids: s, size, scale, middle, t } = window.emsim.machine, bytes = new Uint8Array(s.pixels.buffer);
    let text = '';
    for (let k = 0; k < bytes.length; k += 32768) text += String.fromCharCode(...bytes.subarray(k, k + 32768));
    return { width: s.width, height: s.height, data: btoa(text), size, scale, middle, t }; }"""


@pytest.fixture
def page_of(tmp_path: Path, visit: Any) -> Any:
    def show(deck: str, **how: Any) -> Any:
        path = tmp_path / "page.html"
        html.write(str(path), pipeline.run(deck, scene=True))
        assert path.stat().st_size < MOST
        return visit(path, **how)

    return show


def look(page: Any, yaw: float, pitch: float) -> None:
    page.evaluate(VIEW, [yaw, pitch])


def at(page: Any, place: list[float]) -> tuple[int, int]:
    x, y = page.evaluate("(p) => window.emsim.machine.place(p)", place)
    return round(2 * x), round(2 * y)


def depth(page: Any, x: int, y: int) -> float:
    return page.evaluate(
        "([x, y]) => { const s = window.emsim.machine.solids; return s.depth[y * s.width + x]; }", [x, y]
    )


def test_what_is_behind_is_hidden_from_either_side(page_of: Any) -> None:
    page = page_of(PLATES)
    for yaw, nearer in ((0.0, 1), (np.pi, 2)):
        look(page, float(yaw), 0.0)
        x, y = at(page, [1, 0.03, 0.03, 0])  # over both plates
        z = page.evaluate(
            "(k) => { const m = window.emsim.machine; return m.project(m.world([k, 0.03, 0.03, 0], m.poses))[2]; }",
            nearer,
        )
        assert depth(page, x, y) == pytest.approx(z, abs=0.05)
        x, y = at(page, [2, 0.08, 0.08, 0])  # beyond the small one
        assert np.isfinite(depth(page, x, y))


def test_parts_that_cross_cut_one_another(page_of: Any) -> None:
    """By order alone one of two crossing discs would cover the other."""
    page = page_of(
        "t\nBODY a m=1 shape=disc(0.1)\nBODY b m=1 shape=disc(0.1)\nJOINT j a b pin axis=(1,0,0) ic=90deg\n"
        "JOINT k 0 a pin axis=(0,0,1)\n.tran 1m 2m\n.end\n"
    )
    look(page, -0.6, -0.45)
    front = page.evaluate(
        """() => { const m = window.emsim.machine, s = m.solids, found = [0, 0];
            for (let n = 0; n < 40; n++) for (const k of [0, 1]) {
                const place = [k + 1, 0.07 * Math.cos(n * Math.PI / 20), 0.07 * Math.sin(n * Math.PI / 20), 0];
                const [x, y, near] = m.project(m.world(place, m.poses)), at = Math.round(2 * y) * s.width + Math.round(2 * x);
                if (Math.abs(s.depth[at] - near) < 0.09) found[k]++;
            }
            return found; }"""
    )
    assert min(front) >= 8 and max(front) < 40  # of each a part is in front, and a part of one behind


@pytest.mark.parametrize("name", ["gyroscope_gimbals", "rssr", "heavy_top"])
def test_films_and_the_page_show_the_same_solids(name: str, page_of: Any) -> None:
    path = str(ROOT / "mechanical" / f"{name}.cir")
    page = page_of(path, width=700, height=500)
    look(page, -0.6, -0.45)
    found = page.evaluate(PIXELS)
    mine = np.frombuffer(b64decode(found["data"]), np.uint8).reshape(found["height"], found["width"], 4)
    stage = Stage(pipeline.run(path, scene=True).main, 480)
    assert stage.size == pytest.approx(found["size"], rel=1e-4)
    stage.at(found["t"])
    stage.width, stage.height = found["width"] // 2, found["height"] // 2
    stage.scale, stage.middle = found["scale"], found["middle"]

    def rgb(colour: str) -> tuple[int, int, int]:
        r, g, b = (int(COLOURS[colour][k : k + 2], 16) for k in (1, 3, 5))
        return r, g, b

    pixels, where = Solids(stage).draw(2, rgb)
    rows, columns = min(len(where), len(mine)), min(where.shape[1], mine.shape[1])
    there, here = mine[:rows, :columns, 3] > 0, where[:rows, :columns]
    both = there & here
    assert (there ^ here).sum() < 0.03 * both.sum()
    far = np.abs(mine[:rows, :columns, :3].astype(int) - pixels[:rows, :columns]).max(axis=2)
    assert np.median(far[both]) <= 2 and (far[both] > 40).mean() < 0.06


def test_perspective_makes_what_is_near_larger(page_of: Any) -> None:
    page = page_of(PLATES)
    look(page, 0.0, 0.0)
    wide = """() => { const m = window.emsim.machine;
        return [1, 2].map((k) => Math.abs(m.place([k, 0.05, 0, 0])[0] - m.place([k, -0.05, 0, 0])[0])); }"""
    front, back = page.evaluate(wide)
    assert front == pytest.approx(back, rel=1e-6)
    page.check("#perspective")
    page.wait_for_function("() => window.emsim.machine.perspective")
    front, back = page.evaluate(wide)
    assert front > 1.1 * back


def test_a_planar_machine_has_no_perspective(page_of: Any) -> None:
    page = page_of(str(ROOT / "coupled/pendulum_servo.cir"))
    assert not page.is_visible("#perspective") and page.evaluate("() => !window.emsim.machine.solids")


def test_a_planar_machine_is_seen_straight_on_as_solids(page_of: Any) -> None:
    """By a switch: as many parts as a film has, at the places that the flat picture has; what hides what is the bodies' order."""
    deck = str(ROOT / "coupled/slider_crank_hbridge.cir")
    page = page_of(deck)
    page.set_default_timeout(180_000)  # light is computed by the processor here
    where = "() => window.emsim.machine.scene.points.map((p) => window.emsim.machine.place(p.at))"
    page.evaluate("() => { const { clock } = window.emsim; clock.play(false); clock.set(0.02); }")
    page.wait_for_function("() => Math.abs(window.emsim.machine.t - 0.02) < 1e-9")
    flat = page.evaluate(where)
    page.check("#solid")
    page.wait_for_function("() => window.emsim.machine.solids?.depth")
    assert page.evaluate(where) == flat and page.is_hidden("#perspective")
    stage = Stage(pipeline.run(deck, scene=True).main, 480)
    assert not stage.solid
    assert page.evaluate("() => window.emsim.machine.solids.parts.length") == len(Solids(stage).parts)
    ends = page.evaluate(
        """() => { const m = window.emsim.machine;
            return m.scene.shapes.filter((s) => s.kind === "rod").map((s) => [m.place(s.at),
                m.place([s.at[0], s.at[1] + s.sizes[0] / 2, ...s.at.slice(2)])]); }"""
    )
    assert ends
    for _, (x, y) in ends:
        assert np.isfinite(depth(page, round(2 * x), round(2 * y))), "half way along a bar there is the bar"
    page.uncheck("#solid")
    page.wait_for_function("() => !window.emsim.machine.solids")


def test_a_deck_may_ask_for_solids(page_of: Any) -> None:
    deck = (
        "t\nBODY a m=1 shape=box(0.2,0.1)\nBODY b m=1 shape=polygon(0,0,0.1,0,0,0.1)\n"
        "JOINT j 0 a slide\nJOINT k 0(0,0.02) b pin\nDRIVE d j qd={1m}\nDRIVE e k qd={0}\n"
        ".view solid=yes\n.tran 1m 10m\n.end\n"
    )
    page = page_of(deck)
    assert page.is_checked("#solid") and page.evaluate("() => !!window.emsim.machine.solids")
    stage = Stage(pipeline.run(deck, scene=True).main, 480)
    assert stage.solid
    pixels, there = Solids(stage).draw(1, lambda name: (0, 0, 200) if name == "body" else (200, 0, 0))
    x, y = (round(v) for v in stage.place([2, 0.02, 0.06, 0]))
    assert there[y, x] and pixels[y, x, 2] > pixels[y, x, 0], "the polygon lies on the box"


def test_one_finger_turns_a_spatial_machine(page_of: Any) -> None:
    page = page_of(PLATES)
    before = page.evaluate("() => [window.emsim.machine.yaw, window.emsim.machine.pitch]")
    page.evaluate(
        """() => { const c = document.getElementById('machine'), r = c.getBoundingClientRect();
            c.setPointerCapture = () => {};
            const at = (type, x, y) => c.dispatchEvent(new PointerEvent(type, { pointerId: 7, pointerType: 'touch', bubbles: true,
                clientX: r.x + x, clientY: r.y + y }));
            at('pointerdown', 50, 50); at('pointermove', 90, 70); at('pointerup', 90, 70); }"""
    )
    after = page.evaluate("() => [window.emsim.machine.yaw, window.emsim.machine.pitch]")
    assert after == pytest.approx([before[0] + 0.4, before[1] - 0.2], abs=0.02)


def test_a_gimbal_is_rings_about_a_rotor(page_of: Any) -> None:
    """Three wheels of one size stood in one another."""
    page = page_of(str(ROOT / "mechanical/gyroscope_gimbals.cir"))
    sizes = page.evaluate(
        """() => window.emsim.machine.solids.parts.filter((p) => p.colour === 'body')
            .map((p) => Math.max(...p.points.map((q) => Math.hypot(...q))))"""
    )
    outer, inner, rotor = sizes
    assert outer > 1.1 * inner > 1.2 * rotor


CARD = """() => { const own = WebGL2RenderingContext.prototype.getExtension;
    WebGL2RenderingContext.prototype.getExtension = function (name) {
        return /debug/.test(name) ? null : own.call(this, name); }; }"""
BOTH = """() => { const m = window.emsim.machine, s = m.solids, found = {};
    const shot = (how) => { const sheet = Object.assign(document.createElement('canvas'), { width: 300, height: 300 });
        const ctx = sheet.getContext('2d');
        ctx.scale(300 / m.width, 300 / m.height);
        const was = s.ground; s.ground = null; how(ctx); s.ground = was;
        return ctx.getImageData(0, 0, 300, 300).data; };
    const one = shot((ctx) => Lit.draw(s, m, ctx)), other = shot((ctx) => s.draw(m, ctx));
    let both = 0, apart = 0, far = [];
    for (let k = 0; k < one.length; k += 4) {
        const a = one[k + 3] > 127, b = other[k + 3] > 127;
        if (a && b) { both++; far.push(Math.abs(one[k] - other[k])); } else if (a !== b) apart++;
    }
    far.sort((a, b) => a - b);
    return { card: !!Lit.gl, both, apart, median: far[far.length >> 1] }; }"""
SHADOW = """() => { const m = window.emsim.machine, s = m.solids, ctx = document.createElement('canvas').getContext('2d');
    const gl = Lit.gl, { width, height } = gl.canvas, px = new Uint8Array(4 * width * height);
    Lit.draw(s, m, ctx);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, px);
    let dark = 0, faint = 0;
    for (let k = 3; k < px.length; k += 4) { if (px[k] > 60 && px[k] < 120) dark++; else if (px[k] > 4 && px[k] < 20) faint++; }
    return { dark, faint }; }"""


@pytest.mark.parametrize("perspective", [False, True])
def test_the_graphics_card_draws_what_the_processor_draws(
    tmp_path: Path, chromium: Any, perspective: bool
) -> None:
    """The test's own card is the processor, which the page would not use: it is asked to."""
    path = tmp_path / "page.html"
    html.write(str(path), pipeline.run(str(ROOT / "mechanical/rssr.cir"), scene=True))
    context = chromium.new_context(bypass_csp=True)
    try:
        page, said = context.new_page(), []
        page.add_init_script(f"({CARD})()")
        page.on("pageerror", lambda e: said.append(str(e)))
        page.goto(path.as_uri())
        page.wait_for_function("window.emsim && window.emsim.waves.panels.length > 0")
        page.evaluate(
            """(perspective) => { const { clock, machine } = window.emsim;
                clock.play(false);
                clock.set(clock.first);
                machine.perspective = perspective; }""",
            perspective,
        )
        look(page, -0.6, -0.45)
        found = page.evaluate(BOTH)
        assert found["card"] and found["both"] > 1500
        assert found["apart"] < 0.12 * found["both"]  # outlines are drawn in another way
        assert found["median"] < 12  # parts that lie in shadow differ
        if not perspective:
            shadow = page.evaluate(SHADOW)
            assert shadow["dark"] > 500 and shadow["faint"] > shadow["dark"]
        assert not said
    finally:
        context.close()


def test_a_card_that_the_processor_plays_is_not_used(page_of: Any) -> None:
    page = page_of(PLATES)
    assert page.evaluate("() => Lit.gl === null && window.emsim.machine.solids.depth.length > 0")


CORNER = ((0, 0, 0), (30, 0, 0), (0, 20, 0), (0, 0, 10))


def test_a_screw_has_its_thread_and_a_body_its_looks(page_of: Any, tmp_path: Path) -> None:
    """Meshes that films have, by the page's own text: as many points, in the same places."""
    faces = [[CORNER[k] for k in face] for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))]
    said = "".join(
        "facet normal 0 0 0 outer loop "
        + " ".join("vertex {} {} {}".format(*p) for p in face)
        + " endloop endfacet\n"
        for face in faces
    )
    (tmp_path / "corner.stl").write_text(f"solid corner\n{said}endsolid")
    deck = (
        "t\n.gravity 0 0 -9.81\nBODY nut m=1 j=(1m,1m,1m)\nJOINT s 0 nut screw axis=(0,0,1) lead=-20m\n"
        "BODY a m=1 j=(1m,1m,1m) look=gear(0.05,17)\nBODY b m=1 j=(1m,1m,1m) look=wheel(0.05)\n"
        "BODY c m=1 j=(1m,1m,1m) look=ball(0.05)\nBODY d m=1 j=(1m,1m,1m) look=wagon(0.1,0.05)\n"
        "JOINT ja 0(0.2,0) a pin\nJOINT jb 0(0.4,0) b pin\nJOINT jc 0(0.6,0) c pin\nJOINT jd 0(0.8,0) d slide\n"
        "BODY e m=1 j=(1m,1m,1m) look=stl(corner.stl,1m)\nJOINT je 0(1,0) e pin\n.tran 1m 20m\n.end\n"
    )
    (tmp_path / "deck.cir").write_text(deck)
    page = page_of(str(tmp_path / "deck.cir"))
    there = page.evaluate(
        """() => window.emsim.machine.solids.parts.map((p) => [p.colour, p.points.length,
            p.points.flat().reduce((sum, v) => sum + Math.abs(v), 0)])"""
    )
    stage = Stage(pipeline.run(str(tmp_path / "deck.cir"), scene=True).main, 480)
    here = [[p[0]["colour"], len(p[1]), float(np.abs(p[1]).sum())] for p in Solids(stage).parts]
    assert [one[:2] for one in there] == [one[:2] for one in here]
    assert [one[2] for one in there] == pytest.approx([one[2] for one in here], rel=1e-3)
