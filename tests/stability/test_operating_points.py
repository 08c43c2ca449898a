"""Operating points that were none: the equations hold with every condition as it is there, or the point is refused."""

from __future__ import annotations

from itertools import pairwise

import pytest

import emsim

COMPARATOR = """comparator with hysteresis and RC, .nodeset on the capacitor
vcc vcc 0 15
r1 o c 1k
c1 c 0 100n
r2 o r 100k
r3 vcc r 100k
r4 r 0 100k
e1 o 0 table {v(r,c)} = (-1u,0) (1u,15)
.nodeset v(c)=0
.op
.tran 1u 500u
.end
"""


def test_a_steep_table_that_steps_jump_over():
    """It was 15 V where the table gives 0: conditions had been left as they were when they found no rest."""
    r = emsim.run(COMPARATOR)
    assert r.table("op")["v(o)"][0] == pytest.approx(7.5, abs=1e-5)
    assert abs(r["v(o)"] - 7.5).max() < 1e-3


def test_what_has_no_operating_point_is_refused_with_its_card():
    """Below 2.5 V the source is off, and the node at 5 V; above it pulls the node to -5 V."""
    text = "t\nV1 a 0 5\nR1 a b 1k\nB1 b 0 I={v(b)>2.5 ? 10m : 0}\n.op\n.end\n"
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run(text)
    (said,) = caught.value.diagnostics
    assert said.code == "E410" and "`b`" in said.message and any(span.line == 4 for span, _ in said.labels)


@pytest.mark.parametrize("steps", [3, 9, 33])
def test_piecewise_linear_circuits_of_many_conditions(steps):
    """A table of many slopes in a ring of negative feedback: v(o) = f(1 - v(o)), solved by bisection here."""
    points = " ".join(f"({k / steps - 0.5:.6g},{(k / steps) ** 2:.6g})" for k in range(steps + 1))
    r = emsim.run(f"t\nV1 a 0 1\nE1 o 0 table {{40*(v(a)-v(o))-20}} = {points}\nR1 o 0 1k\n.op\n.end\n")
    found = r["v(o)"][0]
    low, high = (-1.0, 2.0)
    xs = [(k / steps - 0.5, (k / steps) ** 2) for k in range(steps + 1)]

    def table(x: float) -> float:
        if x <= xs[0][0]:
            return xs[0][1]
        for (x0, y0), (x1, y1) in pairwise(xs):
            if x <= x1:
                return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
        return xs[-1][1]

    assert abs(table(40 * (1 - found) - 20) - found) < 0.25 / steps + 1e-3  # corners are rounded over a tenth
    assert low < found < high


def test_atan2_of_two_voltages_that_start_at_zero():
    r = emsim.run("t\nV1 a 0 1\nV2 b 0 2\nB1 o 0 V=atan2(v(a),v(b))\nR1 o 0 1k\n.op\n.end\n")
    assert r["v(o)"][0] == pytest.approx(0.4636476, abs=1e-7)


def test_a_domain_error_names_the_source_that_has_it():
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run("asin\nV1 a 0 2\nB1 o 0 V=asin(v(a))\nR1 o 0 1k\n.op\n.end\n")
    (said,) = caught.value.diagnostics
    assert said.code == "E412" and "`b1`" in said.message and said.span.line == 3
