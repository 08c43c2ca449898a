"""What machines look like: teeth that mesh, cams, Geneva wheels, look= that changes the picture alone, floors cut off."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from emsim import DeckError, pipeline
from emsim.outputs.glyphs.cam import cam
from emsim.outputs.glyphs.gear import phase, toothed
from emsim.outputs.glyphs.meshes import block, cylinder, globe, normals, prism, thread
from emsim.outputs.stage import Stage

ROOT = Path(__file__).resolve().parents[3] / "netlists" / "mechanical"
PRESSED = math.radians(20)
SLED = "t\nBODY b m=2 {look}\nJOINT j 0 b slide ic=(0,1)\nSPRING s j k=30\n.tran 10m 0.3\n.end\n"


class Recorder:
    """A pen that notes what it is asked."""

    unit = 1.0

    def __init__(self) -> None:
        self.calls: list[list[Any]] = []

    def __getattr__(self, name: str) -> Any:
        return lambda *args: self.calls.append([name, *args])


def shapes(text: str, kind: str) -> list[dict[str, Any]]:
    table = pipeline.run(text, scene=True).main
    assert table.scene is not None
    return [s for s in table.scene.data["shapes"] if s["kind"] == kind]


def half(z: int, r: float, radius: float) -> float:
    """Half the angle of an involute tooth at a radius, by its definition [rad]."""
    t = math.acos(min(1.0, r * math.cos(PRESSED) / radius))
    return math.pi / (2 * z) + math.tan(PRESSED) - PRESSED - (math.tan(t) - t)


def test_a_tooth_is_half_its_pitch_wide_and_two_and_a_quarter_modules_high():
    z, r = 20, 100.0
    points = toothed([0.0, 0.0], r, z, 0.0)
    far = [math.hypot(*p) for p in points]
    assert len(points) == 8 * z
    assert max(far) - min(far) == pytest.approx(2.25 * 2 * r / z)
    assert half(z, r, r) * r == pytest.approx(math.pi * r / z / 2)
    for x, y in points[2:6]:  # flanks and tip
        assert abs(math.atan2(-y, x)) == pytest.approx(half(z, r, math.hypot(x, y)), abs=1e-9)


PAIR = "t\nBODY a m=1 j=1m\nBODY b m=1 j=1m\nJOINT p 0 a pin ic=(0.3,5)\nJOINT q 0(0.1,0.05) b pin\n"
PAIR += "GEAR g p q ratio={ratio}\n.tran 5m 0.5\n.end\n"


@pytest.mark.parametrize("ratio", [-2.0, -0.4, -1.25])
def test_teeth_mesh_as_the_wheels_turn(ratio):
    """No corner of a tooth of the one lies within a tooth of the other by more than a tenth of a module."""
    table = pipeline.run(PAIR.format(ratio=ratio), scene=True).main
    stage = Stage(table, 800)
    (s,) = (s for s in stage.shapes if s["kind"] == "gear")
    (za, zb), (ra, rb) = s["teeth"], [r * stage.scale for r in s["radii"]]
    assert za / zb == pytest.approx(1 / -ratio, rel=2e-3)
    a, b = stage.place(s["first"]["a"]), stage.place(s["second"]["a"])
    assert math.dist(a, b) == pytest.approx(ra + rb)
    body = int(s["second"]["b"][0])
    before = phase(stage, s, 1) - stage.poses[body].angle
    for t in (0.02, 0.11, 0.3, 0.47):
        stage.at(t)
        own = phase(stage, s, 0)
        inside = 0
        for x, y in toothed(b, rb, zb, phase(stage, s, 1)):
            radius, angle = math.dist(a, (x, y)), math.atan2(a[1] - y, x - a[0])
            if radius > ra + 2 * ra / za or radius < ra - 2.5 * ra / za:
                continue
            off = (angle - own + math.pi / za) % (2 * math.pi / za) - math.pi / za
            inside = max(inside, (half(za, ra, radius) - abs(off)) * radius)
        assert inside < 0.1 * 2 * ra / za
        # and as its body turns, but for whole teeth
        turned = (phase(stage, s, 1) - before - stage.poses[body].angle) % (2 * math.pi / zb)
        assert min(turned, 2 * math.pi / zb - turned) < 0.01


def test_a_planet_stands_in_its_ring():
    """z_ring = z_sun + 2 z_planet, and sun, planet and ring stand about one middle."""
    sun, ring = shapes(str(ROOT / "planetary_gear.cir"), "gear")
    assert (sun["law"], ring["law"]) == ("outer", "inner")
    assert ring["teeth"][0] == sun["teeth"][0] + 2 * sun["teeth"][1] and ring["teeth"][1] == sun["teeth"][1]
    assert ring["radii"][0] == pytest.approx(0.06) and ring["known"] == 1
    assert sun["first"]["a"] == ring["first"]["a"]


def test_a_stop_of_two_ends_whose_gap_nobody_reads_is_drawn(tmp_path):
    deck = tmp_path / "between.cir"
    deck.write_text(
        "two ends\nBODY a m=1 j=1\nJOINT p 0 a pin ic=(0,3)\nSTOP s p min=-1 max=2 e=0.5\n.save angle(p)\n.tran 1m 1\n.end\n"
    )
    (s,) = shapes(str(deck), "stop")
    assert s["ends"] == [-1, 2]


def test_a_cam_has_the_profile_of_its_lift():
    (s,) = shapes(str(ROOT / "cam_follower.cir"), "cam")
    n = len(s["lift"]) - 1
    assert s["lift"] == pytest.approx([3e-3 * (1 - math.cos(2 * math.pi * k / n)) for k in range(n + 1)])
    assert s["base"] > 0


def test_the_pin_of_a_geneva_drive_is_in_a_slot_while_it_turns_the_wheel():
    stage = Stage(pipeline.run(str(ROOT / "geneva.cir"), scene=True).main, 480)
    (s,) = (s for s in stage.shapes if s["kind"] == "cam")
    assert s["slots"] == 4
    for t in (0.4, 0.45, 0.5, 0.57, 1.55):  # in a slot within an eighth of a turn about the line of centres
        stage.at(t)
        pen = Recorder()
        cam(stage, pen, s)
        wheel = next(call[1] for call in pen.calls if call[0] == "polygon")
        pin = [call for call in pen.calls if call[0] == "circle"][-1][1]
        # corners of each slot: outside, inside, inside, outside; the pin is between its sides
        slots = [wheel[13 * k : 13 * k + 4] for k in range(4)]
        off = []
        for p, q, r, end in slots:
            a, middle = ([(one[i] + other[i]) / 2 for i in (0, 1)] for one, other in ((p, end), (q, r)))
            length = math.dist(a, middle)
            along = sum((pin[i] - middle[i]) * (a[i] - middle[i]) for i in (0, 1)) / length
            across = (pin[0] - middle[0]) * (a[1] - middle[1]) - (pin[1] - middle[1]) * (a[0] - middle[0])
            if -2 <= along <= length + 3:
                off.append(abs(across) / length)
        assert off and min(off) < 1.0  # px


@pytest.mark.parametrize(
    "look", ["ball(0.1)", "wheel(0.1)", "gear(0.1,17)", "wagon(0.3,0.1)", "plate(0.2,0.1)"]
)
def test_look_changes_the_picture_alone(look):
    plain, dressed = (pipeline.run(SLED.format(look=word), scene=True).main for word in ("", f"look={look}"))
    assert list(plain.doubles(1)) == list(dressed.doubles(1))
    assert plain.scene is not None and dressed.scene is not None
    kinds = [[s["kind"] for s in t.scene.data["shapes"]] for t in (plain, dressed)]
    assert kinds[0] != kinds[1] and "bones" in kinds[0] and "bones" not in kinds[1]


@pytest.mark.parametrize(
    ("look", "said"),
    [
        ("bal(0.1)", "there is no `bal`"),
        ("ball(0)", "greater than zero"),
        ("ball(1,2)", "takes 1 size in metres"),
        ("gear(0.1,3)", "6 to 400 teeth"),
        ("gear(0.1,7.5)", "a whole number"),
        ("5", "look= of BODY b is"),
    ],
)
def test_what_a_body_cannot_look_like_is_told(look, said):
    with pytest.raises(DeckError) as told:
        pipeline.run(SLED.format(look=f"look={look}"))
    assert said in str(told.value)


def test_a_floor_is_no_reason_to_look_from_afar():
    stage = Stage(pipeline.run(str(ROOT / "dominoes.cir"), scene=True).main, 480)
    assert stage.box[2] - stage.box[0] < 0.3  # the floor is 2 m long, the dominoes stand on 68 mm


def test_films_follow_what_crosses_a_long_way():
    stage = Stage(pipeline.run(str(ROOT / "brake_car.cir"), scene=True).main, 480)
    assert stage.follow
    places = []
    for t in (0.0, 2.0):
        stage.at(t)
        stage.seen()
        places.append(stage.place([1, 0, 0, 0])[0])
    assert places[0] == pytest.approx(places[1], abs=1) and 100 < places[0] < 380


@pytest.mark.parametrize(
    "mesh",
    [cylinder([0, 0, 0], [1, 2, 3], 0.4), block([1, 0, 0], [0, 0, 2], [0, 3, 0]), globe(1.0),
     thread([0, 0, 1], 0.1, 0.05, 0.5), thread([0, 0, 1], 0.1, -0.05, 0.5),
     prism([[math.cos(k), math.sin(k), 0] for k in range(6)], [0, 0, 0.2], 0.02)],
)  # fmt: skip
def test_normals_point_outwards(mesh):
    """The volume within faces that are turned as their normals say is that of the solid, above 0, and normals are of length 1."""
    points, faces, _ = mesh
    volume = 0.0
    for face, own in zip(faces, normals(points, faces), strict=True):
        a = points[face[0]]
        for k in range(1, len(face) - 1):
            b, c = points[face[k]], points[face[k + 1]]
            n = [
                (b[i - 2] - a[i - 2]) * (c[i - 1] - a[i - 1]) - (b[i - 1] - a[i - 1]) * (c[i - 2] - a[i - 2])
                for i in range(3)
            ]
            way = sum(n[i] * own[0][i] for i in range(3))
            volume += (
                math.copysign(
                    sum(n[i] * a[i] for i in range(3)), way * sum(n[i] * a[i] for i in range(3)) or 1.0
                )
                / 6
            )
        assert all(math.hypot(*n) == pytest.approx(1.0) or not any(n) for n in own)
    assert volume > 0
