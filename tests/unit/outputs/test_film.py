"""Films of the machine: what is where on a frame, when, and the glyphs beside those of the page."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

import emsim
from emsim import DeckError
from emsim.outputs import film
from emsim.outputs.film import COLOURS
from emsim.outputs.glyphs import GLYPHS
from emsim.outputs.html import WEB
from emsim.outputs.numbers import written
from emsim.outputs.stage import PITCH, YAW, Stage

ARM = (
    "arm\n.gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin zero=-90deg ic=60deg\n"
    "POINT arm.tip 0.3 0\n.tran 1m 1\n{more}\n.end\n"
)
SPACE = (
    "space\n.gravity 0 0 -9.81\nBODY arm shape=rod(0.3) m=0.2\nBODY plate shape=box(0.1,0.05,0.02) m=0.1\n"
    "JOINT hinge 0 arm pin axis=(0,1,0) ic=20deg\nJOINT other arm(0.3,0,0) plate pin axis=(1,0,0) ic=(0,3)\n.tran 1m 1\n.end\n"
)


def run(text):
    return emsim.run(text, scene=True)


@pytest.fixture(scope="module")
def arm():
    return run(ARM.format(more=""))


def frames(path):
    image = Image.open(path)
    found = []
    for k in range(image.n_frames):
        image.seek(k)
        found.append(np.asarray(image.convert("RGB")).astype(int))
    return image, found


def colour(name):
    return np.array([int(COLOURS[name][k : k + 2], 16) for k in (1, 3, 5)])


def near(picture, x, y, name, within=1):
    """Whether a pixel about (x, y) has nearly the colour."""
    x, y = round(x), round(y)
    part = picture[y - within : y + within + 1, x - within : x + within + 1]
    return np.abs(part - colour(name)).sum(axis=2).min() < 30


def test_the_rod_is_where_the_angle_says(arm, tmp_path):
    timing = film.Timing(arm.main, duration=2.0)
    film.gif(str(tmp_path / "a.gif"), arm.main, timing)
    image, found = frames(tmp_path / "a.gif")
    assert len(found) == len(timing.times) and image.info["loop"] == 0
    stage = Stage(arm.main, film.WIDTH)
    # the pivot is the origin of the world
    x0 = stage.width / 2 - stage.middle[0] * stage.scale
    y0 = stage.height / 2 + stage.middle[1] * stage.scale
    for t, picture in zip(timing.times, found, strict=True):
        angle = float(arm.at("angle(hinge)", t)) - math.pi / 2  # zero= hangs straight down
        for share, name in ((0.3, "body"), (0.97, "body"), (1.08, "back")):
            along = share * 0.3 * stage.scale
            x, y = x0 + along * math.cos(angle), y0 - along * math.sin(angle)
            assert near(picture, x, y, name, 2), (t, share)
        # and nowhere else at that distance
        other = angle + 0.5
        assert near(picture, x0 + 90 * math.cos(other), y0 - 90 * math.sin(other), "back")


def test_frames_differ_as_long_as_it_moves(arm, tmp_path):
    film.gif(str(tmp_path / "a.gif"), arm.main, film.Timing(arm.main, duration=1.0))
    _, found = frames(tmp_path / "a.gif")
    assert all(np.any(a != b) for a, b in pairwise(found))


def test_a_film_is_small(arm, tmp_path):
    film.gif(str(tmp_path / "a.gif"), arm.main, film.Timing(arm.main))
    assert (tmp_path / "a.gif").stat().st_size < 150_000


def test_what_stands_still_costs_next_to_nothing(tmp_path):
    still = run(ARM.format(more="").replace("ic=60deg", "ic=0"))
    film.gif(str(tmp_path / "a.gif"), still.main, film.Timing(still.main))
    assert (tmp_path / "a.gif").stat().st_size < 40_000


@pytest.mark.parametrize(
    ("more", "options", "speed", "count"),
    [
        ("", {}, 0.25, 81),  # 4 s of 20 frames
        ("", {"speed": 0.5}, 0.5, 41),
        ("", {"duration": 2.0, "fps": 10}, 0.5, 21),
        (".view speed=0.1", {}, 0.1, 201),
        ("", {"start": 0.25, "stop": 0.5, "speed": 0.5}, 0.5, 11),
    ],
)
def test_frames_stand_for_their_times(more, options, speed, count):
    table = run(ARM.format(more=more)).main
    timing = film.Timing(table, **options)
    assert timing.speed == pytest.approx(speed) and len(timing.times) == count
    steps = np.diff(timing.times) / np.array(timing.delays[:-1]) * 100
    assert steps == pytest.approx(speed)
    assert timing.times[-1] == pytest.approx(options.get("stop", 1.0))
    assert timing.delays[-1] > timing.delays[0]


def test_delays_are_in_the_file(arm, tmp_path):
    timing = film.Timing(arm.main, duration=1.0, fps=25)
    film.gif(str(tmp_path / "a.gif"), arm.main, timing)
    image = Image.open(tmp_path / "a.gif")
    delays = []
    for k in range(image.n_frames):
        image.seek(k)
        delays.append(image.info["duration"])
    assert delays == [10 * d for d in timing.delays] and delays[0] == 40


@pytest.mark.parametrize(
    ("options", "said"),
    [({"start": 2.0}, "E349"), ({"start": 0.5, "stop": 0.4}, "E349"), ({"duration": 1e4}, "E355")],
)
def test_films_that_are_refused(arm, options, said):
    with pytest.raises(DeckError, match=said):
        film.Timing(arm.main, **options)


def test_a_trace_grows(arm, tmp_path):
    def traced(t):
        film.png(str(tmp_path / "a.png"), arm.main, t, 480, "arm.tip")
        picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
        return (np.abs(picture - colour("accent")).sum(axis=2) < 120).sum()

    assert 5 < traced(0.1) < traced(0.2) < traced(0.3)
    with pytest.raises(DeckError, match=r"E356.*tpi.*\n.*arm\.tip, arm\.com"):
        film.png(str(tmp_path / "a.png"), arm.main, 0.0, trace="tpi")


def test_view_names_the_trace(tmp_path):
    result = run(ARM.format(more=".view trace=arm.tip"))
    film.png(str(tmp_path / "a.png"), result.main, 0.3, 480)
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    stage = Stage(result.main, 480)
    x, y = stage.course([1, 0.3, 0, 0], [0.1])[0]
    assert near(picture, x, y, "accent") or near(picture, x, y, "accent", 2)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("solid=maybe", "solid= of .view is yes or no"),
        ("colour=red", ".view has no `colour`: it takes fps=, speed=, scale=, trace=, solid="),
        ("solid", "solid of .view has no value"),
        ("speed=0", "speed= of .view is a number greater than zero"),
        ("scale=-1", "scale= of .view is a number greater than zero"),
        ("scale=1e9", "scale= of .view is a number greater than zero, below 10000"),
        ("fps=fast", "fps= of .view is a number greater than zero"),
    ],
)
def test_a_word_that_view_does_not_have_is_told(said, message):
    with pytest.raises(DeckError, match=rf"E239\]: {re.escape(message)}"):
        run(ARM.format(more=f".view {said}"))


def test_view_takes_parameters_and_the_rate_of_pictures():
    result = run(ARM.format(more=".param v=0.5\n.view fps=10 speed={v/5}"))
    timing = film.Timing(result.main)
    assert timing.speed == 0.1
    assert timing.delays[0] == 10  # hundredths of a second


def test_a_trace_of_no_point_is_told_to_the_page_too():
    with pytest.raises(DeckError, match=r"E356.*tpi.*\n.*arm\.tip, arm\.com"):
        run(ARM.format(more=".view trace=tpi"))


def test_frame_size(arm, tmp_path):
    for width in (200, 960):
        film.png(str(tmp_path / "a.png"), arm.main, 0.0, width)
        image = Image.open(tmp_path / "a.png")
        assert image.width == width and image.mode == "RGB"


def test_space_is_projected_in_parallel(tmp_path):
    result = run(SPACE)
    stage = Stage(result.main, 480)
    stage.at(0.4)
    angle = float(result.at("angle(hinge)", 0.4))
    # about y: x towards -z
    tip = np.array([0.3 * math.cos(angle), 0.0, -0.3 * math.sin(angle)])
    assert stage.world([1, 0.3, 0, 0]) == pytest.approx(tip, abs=1e-6)
    # the camera's two axes are orthonormal, so lengths are never drawn longer than they are
    axes = np.array([stage.flat(e) for e in np.eye(3)]).T
    assert axes @ axes.T == pytest.approx(np.eye(2), abs=1e-12)
    # gravity pulls along -z: z is up, and the eye is above
    assert axes[0] == pytest.approx([math.cos(YAW), -math.sin(YAW), 0])
    assert axes[1, 2] == pytest.approx(math.cos(PITCH)) and stage.axes[2][2] > 0.3
    towards = [stage.nearness([0, *e]) for e in np.eye(3)]
    assert towards == pytest.approx(np.cross(axes[0], axes[1]))
    film.png(str(tmp_path / "a.png"), result.main, 0.4, 480)
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    # the rod's own colour, lighter or darker by how it stands to the light
    x, y = stage.place([1, 0.15, 0, 0])
    r, g, b = picture[round(y), round(x)] / colour("body")
    assert 0.45 < r < 1.1 and abs(r - g) < 0.03 and abs(r - b) < 0.03


def test_colours_are_those_of_the_page():
    with open(f"{WEB}/page.css", encoding="utf-8") as file:
        light = dict(re.findall(r"--(\w+): (#\w{6})", file.read().split("}")[0]))
    assert {name: light[name] for name in COLOURS} == COLOURS


def test_every_shape_that_a_card_draws_has_a_glyph():
    """A page left out what it had no glyph for. What is drawn in space alone is a solid."""
    from pathlib import Path

    from emsim.outputs.glyphs.solids import is_solid

    cards = Path(emsim.__file__).parent / "cards"
    drawn = {
        kind
        for path in cards.rglob("*.py")
        for kind in re.findall(r"draw\.add\(\s*\"(\w+)\"", path.read_text())
    }
    assert (
        len(drawn) > 10
        and {kind for kind in drawn if kind not in GLYPHS and not is_solid({"kind": kind})} == set()
    )


ALL = """every glyph
.gravity 9.81
BODY arm shape=rod(0.3) m=0.2
BODY wheel shape=disc(0.05) m=0.2
BODY cart shape=box(0.1,0.05) m=1
BODY rotor m=0 j=1m
JOINT hinge 0 arm pin zero=-90deg
JOINT axle 0(0.4,0) wheel pin
JOINT rail 0(0,-0.4) cart slide
JOINT shaft 0(-0.3,0) rotor pin
MOTOR m1 drive 0 hinge kt=20m r=2 l=1m
POT p1 vp wip 0 hinge r=10k range=(-150deg,150deg)
SPRING k1 axle k=0.1
SPRING k2 rail k=100
SPRING k3 arm(0.3,0) 0(0.6,0.2) k=1
DAMPER c1 rail c=1
DAMPER c2 axle c=1m
TORQUE t1 axle tau={0.01*sin(10*time)}
FORCE f1 arm(0.3,0) dir=(1,0) {0.2*cos(5*time)}
TRANSDUCER coil va 0 rail K={1+pos(rail)}
DRIVE d1 shaft q={time}
Vp vp 0 5
Vd drive 0 SIN(0 3 2)
Va a 0 SIN(0 1 3)
Ra a va 10
.tran 1m 0.5
.end
"""


def test_every_kind_of_shape_is_drawn(tmp_path):
    result = run(ALL)
    kinds = {s["kind"] for s in result.main.scene.data["shapes"]}
    assert kinds >= {
        "rod",
        "disc",
        "box",
        "bones",
        "joint",
        "motor",
        "pot",
        "spring",
        "damper",
        "torque",
        "force",
    }
    film.png(str(tmp_path / "a.png"), result.main, 0.1, 960)
    picture = np.asarray(Image.open(tmp_path / "a.png").convert("RGB")).astype(int)
    for name in ("body", "edge", "ground", "coil", "wiper", "force", "accent"):
        assert (np.abs(picture - colour(name)).sum(axis=2) < 12).sum() > 20, name


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.00574, "A", "5.74 mA"),
        (-1.224, "A", "-1.22 A"),
        (0.0, "V", "0 V"),
        (12e3, "N", "12 kN"),
        (3e-6, "s", "3 µs"),
    ],
)
def test_numbers(value, unit, text):
    assert written(value, unit) == text


@pytest.mark.parametrize("circuit", [False, True])
def test_a_frame_as_svg_has_the_same_shapes(tmp_path, circuit):
    from xml.etree import ElementTree

    result = run(ALL)
    film.png(str(tmp_path / "a.svg"), result.main, 0.1, 480, circuit=circuit)
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    tags = [e.tag.rpartition("}")[2] for e in root.iter()]
    said = [e.text for e in root.iter() if e.tag.endswith("text")]
    stage = Stage(result.main, 480)
    assert tags.count("path") > 60 and "arm" in said and any("m1" in text for text in said)
    assert ("Vd" in said) == circuit
    if not circuit:
        assert [float(v) for v in root.get("viewBox").split()[2:]] == [stage.width, stage.height]


def test_a_spatial_frame_as_svg_has_its_solids(tmp_path):
    film.png(str(tmp_path / "a.svg"), run(SPACE).main, 0.4, 300)
    text = (tmp_path / "a.svg").read_text()
    assert "data:image/png;base64," in text and ">plate</text>" in text


def test_a_motor_stands_out_from_its_ground_mark():
    """It was a pale ring of 16 px under the mark of the frame."""
    from emsim.outputs.glyphs import drawn

    calls = []

    class Recorder:
        unit = 1.0

        def __getattr__(self, name):
            return lambda *args: calls.append((name, *args))

    stage = Stage(run(ALL).main, 480)
    stage.at(0.1)
    drawn(stage, Recorder())
    hinge = stage.place([0, 0, 0, 0])
    disc = max(k for k, c in enumerate(calls) if c[0] == "circle" and c[2] == 18 and c[3] == "panel")
    assert calls[disc][1] == pytest.approx(hinge)
    marks = [k for k, c in enumerate(calls) if c[0] == "line" and c[2] == "ground"]
    # above the mark, whose foot is seen below it
    assert disc > max(marks)
    feet = [p[1] - hinge[1] for k in marks for p in calls[k][1] if abs(p[0] - hinge[0]) < 15]
    assert max(feet) > 18 + 5
