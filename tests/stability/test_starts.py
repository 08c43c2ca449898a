"""Analogue circuits that are hard to start (starts.txt), from nothing: each operating point is checked against the equations,
and where a circuit has one state only, against ngspice's. (ngspice finds a point of each.)"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop import ngspice

# name, text of the cards; the first are in every deck
_, *SECTIONS = re.split(
    r"^=== ", (Path(__file__).parent / "starts.txt").read_text(encoding="utf-8"), flags=re.M
)
(_, PARTS), *FOUND = (section.split("\n", 1) for section in SECTIONS)
STARTS = dict(FOUND)

# more than one state, or held by less than the accuracy of a run: open loops, rings, nodes that leak alone
LOOSE = (
    "open loop", "Schmitt", "integrator", "comparator", "rectifier", "two states", "thyristor", "ring of", "hangs on",
    "bistable", "memory", "latch", "flip-flop", "gates off", "regulator", "adder", "NAND", "multivibrator",
)  # fmt: skip


def deck(name: str) -> str:
    return f"{name}\n{PARTS}\n{STARTS[name]}\n.op\n.end\n"


def test_there_are_sixty():
    assert len(STARTS) >= 60


@pytest.mark.parametrize("name", STARTS)
def test_the_point_satisfies_the_equations(name):
    """What one more step of Newton's method would change, full F and full G: less than a hundredth of the tolerances."""
    s = emsim.compile(deck(name))
    x = s.x0
    x[np.array(s.kinds) == "derivative"] = (
        0.0  # at rest; what a run starts with is a difference over a very short step
    )
    _, g = s.dense(x, 0.0)
    left = np.abs(np.linalg.lstsq(g, s.F(x, 0.0), rcond=None)[0])
    allowed = 1e-6 + 1e-4 * np.abs(x)
    worst = int(np.argmax(left / allowed))
    assert left[worst] <= allowed[worst], f"{s.names[worst]} is off by {left[worst]:.3g}"


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", [name for name in STARTS if not any(word in name for word in LOOSE)])
def test_the_point_is_that_of_ngspice(name):
    ours = emsim.run(deck(name))
    theirs = ngspice.run(ngspice.as_written(deck(name), "."))
    nodes = [column for column in theirs.main.names if column.startswith("v(") and "#" not in column]
    assert nodes
    for node in nodes:
        assert float(ours[node][0]) == pytest.approx(float(theirs[node][0]), rel=1e-3, abs=3e-3), node
