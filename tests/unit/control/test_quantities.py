"""Words that are functions of vectors and quantities of the machine: by what they are asked of."""

from __future__ import annotations

import pytest

import emsim

SLIDE = """a mass on a spring, hung by a slack rope
BODY m m=1
JOINT g 0 m slide ic=0.5
SPRING s g k=1
ROPE r 0(0,2) m slack=1
.control
tran 10m 1
let q = pos(g)
print pos(g)[0] pos(time)[3] length(q) length(time) length(r)[0]
.endc
.end
"""


def test_pos_and_length_are_of_the_machine_or_of_vectors() -> None:
    r = emsim.run(SLIDE)
    said = dict(line.split(" = ") for line in r.output.splitlines() if " = " in line)
    points = len(r.plots[0])
    found = [float(said[name]) for name in ("pos(g)[0]", "pos(time)[3]", "length(q)", "length(time)")]
    assert found == pytest.approx([0.5, 1.0, points, points])
    # from (0.5, 0) to (0, 2)
    assert float(said["length(r)[0]"]) == pytest.approx(4.25**0.5)
