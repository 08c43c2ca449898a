"""The circuit as PNG and in films: drawn as in the page, its dots move with the current."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("PIL")

from PIL import Image

from emsim import pipeline
from emsim.cli import main
from emsim.outputs.schematic import DOTTED, OVER, SPACING, UNDER, Moving

ROOT = Path(__file__).resolve().parents[3]
SWING = "swing\nV1 in 0 PULSE(5 -5 1m 1u 1u 5m 10m)\nR1 in out 1k\nR2 out 0 1k\n.tran 10u 2m\n.end\n"


@pytest.fixture(scope="module")
def swing():
    return pipeline.run(SWING, scene=True).main


def test_dots_go_with_the_sign_of_the_current(swing):
    moving = Moving(swing, 400)
    resistor = next(k for k, p in enumerate(moving.data["parts"]) if p["name"] == "r1")
    way = next(k for k, (what, _) in enumerate(moving.ways) if what == (resistor, 0))
    moving.image(0.5e-3, 0.02)
    forwards = moving.phases[way]
    assert 0 < forwards < SPACING / 2
    moving.image(1.5e-3, 0.01)
    assert 0 < moving.phases[way] < forwards


def test_wires_have_the_colour_of_their_voltage(swing):
    def share(t: float, colour: str) -> int:
        pixels = np.asarray(Moving(swing, 400).image(t)).astype(int)
        wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        return int((np.abs(pixels - wanted).sum(axis=2) < 60).sum())

    assert share(0.5e-3, OVER) > 50 > share(1.5e-3, OVER)
    assert share(1.5e-3, UNDER) > 50 > share(0.5e-3, UNDER)
    assert share(0.5e-3, DOTTED) > 20


def test_a_current_that_nobody_tells_follows_from_the_others(swing):
    """Kirchhoff's law at the wire's other end."""
    moving = Moving(swing, 400)
    wire = next(w for w in moving.data["wires"] if w["net"] == "out")
    assert abs(abs(moving.along(wire, 0.5e-3)) - 2.5e-3) < 1e-6


@pytest.mark.parametrize("name", ["coupled/pendulum_servo", "lessons/01_rc"])
def test_a_frame_holds_circuit_and_machine(name, tmp_path, capsys):
    deck = str(ROOT / "netlists" / f"{name}.cir")
    out, raw = tmp_path / "both.png", str(tmp_path / "x.raw")
    assert main([deck, "--frame", str(out), "--circuit", "--width", "400", "-o", raw, "-q"]) == 0
    with Image.open(out) as both:
        assert both.width == 400
        height = both.height
    if name.startswith("coupled"):
        assert main([deck, "--frame", str(out), "--width", "400", "-o", raw, "-q"]) == 0
        with Image.open(out) as machine:
            assert machine.height < height


def test_draw_writes_png_and_svg(tmp_path, capsys):
    deck = str(ROOT / "netlists" / "lessons" / "01_rc.cir")
    assert main(["draw", deck, "-o", str(tmp_path / "c.png"), "--dark"]) == 0
    assert main(["draw", deck, "-o", str(tmp_path / "c.svg"), "--symbols", "iec"]) == 0
    assert main(["draw", deck]) == 0
    assert capsys.readouterr().out.startswith("<svg ")
    with Image.open(tmp_path / "c.png") as image:
        assert image.width > 200 and image.getpixel((2, 2)) == (0x14, 0x18, 0x1E)
    assert main(["draw", deck, "-o", str(tmp_path / "c.jpg")]) == 2
    assert main(["draw", deck, "--symbols", "din"]) == 2


def test_the_readme_shows_what_is_drawn():
    from emsim.schematic.picture import draw
    from emsim.schematic.svg import svg

    flat = pipeline.read(ROOT / "netlists" / "coupled" / "pendulum_servo.cir")
    picture = draw(flat)
    assert picture is not None
    kept = (ROOT / "netlists" / "coupled" / "pendulum_servo.svg").read_text(encoding="utf-8")
    assert kept == svg(picture.data, title=flat.title), (
        "emsim draw netlists/coupled/pendulum_servo.cir -o ...svg"
    )
