"""A TRANSDUCER with a gap: where it is closed follows from its L or C; its core stands there, its armature moves."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.outputs.glyphs.transducer import transducer
from emsim.outputs.stage import Stage

ROOT = Path(__file__).resolve().parents[3] / "netlists" / "coupled"
SLED = """a sled
BODY b m=1
JOINT x 0 b slide axis=(1,0) ic={ic}
TRANSDUCER t a 0 x {law}
V1 s 0 SIN(0 1 50)
R1 s a 1k
.tran 1m 10m
.end
"""


def shape(deck: str) -> tuple[Stage, dict[str, Any]]:
    table = pipeline.run(deck, scene=True).main
    stage = Stage(table, 480)
    (found,) = (s for s in stage.shapes if s["kind"] == "transducer")
    return stage, found


@pytest.mark.parametrize(
    ("deck", "closed"),
    [
        ("relay", 1.1e-3),
        ("saturating_magnet", 3e-3),
        ("es_switch", 2e-6),
        ("ref_comb_drive", None),
        ("rail_gun", None),
    ],
)
def test_decks_have_their_gaps(deck: str, closed: float | None) -> None:
    """The relay's iron, 0.2 mm of air of its worth, is half on either side of the closed gap."""
    _, found = shape(str(ROOT / f"{deck}.cir"))
    assert found["closed"] is None if closed is None else found["closed"] == pytest.approx(closed, rel=1e-6)


@pytest.mark.parametrize(
    ("law", "ic", "closed"),
    [
        ("L={1m + 2u/(5m - pos(x))}", 0.0, 5e-3),
        ("L={0.5 + 10m/pos(x)}", 0.01, 0.0),
        ("L={1m/(1 + 100*pos(x))}", 0.0, -0.01),
        ("C={1p/(3m + pos(x))}", 0.0, -3e-3),
        ("W={1n/(2m - pos(x))*v(t)**2/2}", 0.0, 2e-3),
        # saturating; at small currents L0 + c/(x0 - x)
        ("W={(1m+2u/(5m-pos(x)))*0.04*(sqrt(1+(i(t)/0.2)**2)-1)}", 0.0, 5e-3),
        ("L={1m*exp(-pos(x))}", 0.0, None),
        ("L={1m/(1 + (pos(x)/5m)**2)}", 0.001, None),
        ("L={1m + 1m*pos(x)}", 0.0, None),
        ("K={7}", 0.0, None),
    ],
)
def test_where_a_law_closes(law: str, ic: float, closed: float | None) -> None:
    _, found = shape(SLED.format(law=law, ic=ic))
    if closed is None:
        assert found["closed"] is None
    else:
        assert found["closed"] == pytest.approx(closed, rel=1e-6, abs=1e-12)


class Recorder:
    unit = 1.0

    def __init__(self) -> None:
        self.calls: list[Any] = []

    def __getattr__(self, name: str) -> Any:
        return lambda *args: self.calls.append((name, *args))


def test_the_armature_nears_the_core_as_it_moves() -> None:
    stage, found = shape(str(ROOT / "saturating_magnet.cir"))
    gaps, cores = [], []
    for t in (0.0, 5e-3, 15e-3):
        stage.at(t)
        pen = Recorder()
        transducer(stage, pen, found)
        armature, core = (call[1] for call in pen.calls if call[0] == "polygon")
        near, face = max(x for x, _ in armature), min(x for x, _ in core)
        gaps.append((face - near) / stage.scale)
        cores.append(face)
        assert gaps[-1] == pytest.approx(3e-3 - stage.value(found["q"]), rel=1e-6)
    assert gaps[1] != gaps[0] and math.isclose(cores[0], cores[2])
