"""Films of .modes: two pendulums on a spring swing in step, then against each other, as the modes' vectors say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from emsim import pipeline
from emsim.cli import main
from emsim.outputs.film import Camera, Timing, called_mode, swings
from emsim.outputs.stage import Stage

TWO = """two pendulums on a spring
.gravity 9.81
BODY a m=1 com=(0,-0.5) j=1m
BODY b m=1 com=(0,-0.5) j=1m
JOINT ja 0 a pin
JOINT jb 0(0.4,0) b pin
SPRING s a(0,-0.5) b(0,-0.5) k=20
POINT a.tip 0 -0.5
POINT b.tip 0 -0.5
{more}
.modes
.end
"""


@pytest.fixture(scope="module")
def table() -> Any:
    return pipeline.run(TWO.format(more=""), scene=True).main


def test_every_mode_swings_as_it_is_told(table: Any) -> None:
    stage = Stage(table, 480)
    assert swings(table) and len(table) == 2
    # a quarter of a swing on: half a number is a whole swing
    rest = {name: stage.course(at, [1.125])[0][0] for name, at in stage.points.items()}
    for mode, way in ((1, 1), (2, -1)):
        a, b = (stage.course(stage.points[name], [mode])[0][0] - rest[name] for name in ("a.tip", "b.tip"))
        assert abs(a) > 0.05 * stage.scale * 0.5 and b == pytest.approx(way * a, rel=0.02, abs=0.5)


def test_it_says_what_it_shows(table: Any) -> None:
    """omega^2 = g l m/J, and with 2 k l^2/J more."""
    inertia = 1e-3 + 0.25
    first = np.sqrt(9.81 * 0.5 / inertia) / (2 * np.pi)
    second = np.sqrt((9.81 * 0.5 + 2 * 20 * 0.25) / inertia) / (2 * np.pi)
    assert called_mode(table, 0.6) == f"mode 1: {1e3 * first:.4g} mHz, damping 0"
    assert called_mode(table, 2.4) == f"mode 2: {second:.4g} Hz, damping 0"
    timing = Timing(table)
    assert timing.times[0] == 0.5 and timing.times[-1] < 2.5
    assert sum(timing.delays) / 100 == pytest.approx(4.0, abs=1.0), "two seconds a mode"
    picture = Camera(table, 240, 1, None, 0.5).frame(1.0)
    assert np.asarray(picture).std() > 1


def test_a_machine_at_rest_has_its_picture_in_the_gallery(tmp_path: Path) -> None:
    from emsim.playground import tile

    deck = TWO.format(more="").replace(".modes", ".op static").replace("pin\nJOINT", "pin ic=10deg\nJOINT")
    paths = [str(tmp_path / name) for name in ("moving.webp", "still.webp")]
    tile.write(pipeline.run(deck, scene=True), *paths)
    for path in paths:
        with Image.open(path) as picture:
            assert getattr(picture, "n_frames", 1) == 1
            assert np.asarray(picture.convert("L")).std() > 5


def test_one_of_them_from_the_command_line(tmp_path: Path, monkeypatch: Any, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.cir").write_text(TWO.format(more=".tran 10m 0.1"))
    assert (
        main(["two.cir", "--mode", "2", "--gif", "m.gif", "--frame", "m.png", "--width", "160", "--fps", "5"])
        == 0
    )
    with Image.open(tmp_path / "m.gif") as film:
        assert 8 <= film.n_frames <= 12  # type: ignore[attr-defined]
    assert main(["two.cir", "--mode", "3", "--frame", "m.png"]) != 0
    assert "there are 2" in capsys.readouterr().err
    (tmp_path / "still.cir").write_text(TWO.format(more=".tran 10m 0.1").replace(".modes\n", ""))
    assert main(["still.cir", "--mode", "1", "--frame", "m.png"]) != 0
    assert "they come of .modes" in capsys.readouterr().err
    assert main(["two.cir", "--mode", "1"]) == 2
