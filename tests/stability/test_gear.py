"""Gear: the order chosen by the step pays; maxord=2 is SPICE's gear."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from support import deck, run, values_at

# how many times fewer steps than order 2 at 1e-6, at a smaller error
FEWER = {
    "bench/lc_oscillator": 4,
    "bench/two_loop_rlc": 7,
    "bench/multiplier4": 2,
    "electrical/clipper": 1.7,
    "electrical/diode_bridge": 2.5,
}


@pytest.mark.parametrize("name, fewer", FEWER.items())
def test_a_chosen_order_costs_fewer_steps_than_order_2(name, fewer):
    steps = [run(deck(name), f"reltol=1e-6 method=gear {o}").stats["steps"] for o in ("", "maxord=2")]
    assert fewer * steps[0] <= steps[1], steps


LOGISTIC = """C dv/dt = v (1 - v) -> v = 1/(1 + 9 exp(-t))
C1 a 0 1 IC=0.1
B1 0 a I={v(a)*(1-v(a))}
.tran 0.1 12 UIC
.end
"""


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-7, 1e-9])
def test_error_and_rows_follow_the_tolerance(reltol):
    """Rows on the print grid come from the dense output; they are as good as the steps."""
    result = run(LOGISTIC, f"method=gear reltol={reltol!r}")
    t = np.asarray(result.time)
    error = np.abs(np.asarray(result["v(a)"]) - 1 / (1 + 9 * np.exp(-t)))
    grid = np.abs(t / 0.1 - np.round(t / 0.1)) < 1e-6
    assert grid.sum() >= 120
    assert error[grid].max() <= 3 * reltol and error[grid].max() <= 3 * error[~grid].max(), (
        error[grid].max(),
        error[~grid].max(),
    )


def test_maxord_2_has_its_steps_for_rows():
    """No longer than TSTEP, nothing between: ngspice's gear."""
    result = run(LOGISTIC, "method=gear maxord=2 reltol=1e-3")
    assert len(result.time) <= result.stats["steps"] + 2 and np.diff(result.time).max() <= 0.1 * (1 + 1e-9)
    free = run(LOGISTIC, "method=gear reltol=1e-3")
    assert free.stats["steps"] < len(free.time) and free.stats["steps"] < result.stats["steps"]


def test_higher_limits_are_kept_to():
    """A limit on the order costs steps, one after the other, at a tight tolerance."""
    steps = [run(LOGISTIC, f"method=gear maxord={k} reltol=1e-8").stats["steps"] for k in (1, 2, 3, 4, 5)]
    assert all(a > b for a, b in pairwise(steps)), steps


def test_events_between_orders():
    """A comparator's switch at v(a) = 0.5, t = ln 9: met as exactly as the steps are."""
    text = LOGISTIC.replace(".tran", "B2 f 0 V={v(a) > 0.5 ? 1 : 0}\nR2 f 0 1\n.tran")
    result = run(text, "method=gear reltol=1e-7")
    high = np.asarray(result["v(f)"]) > 0.5
    first = float(np.asarray(result.time)[high].min())
    assert abs(first - np.log(9)) <= 5e-6
    assert values_at(result, "v(f)", np.array([2.0, 3.0])) == pytest.approx([0, 1])
