"""Decks against exact references, as they stand: every signal within 1e-3 of its range (how the error follows the
tolerance is told by test_ladder.py); what the references say beside their signals.
"""

from __future__ import annotations

import itertools
from math import pi

import numpy as np
import pytest
from reference_set import PROBLEMS
from support import deck, rows_at, run


@pytest.mark.parametrize("problem", [pytest.param(p, id=p.name) for p in PROBLEMS])
def test_default_tolerance_is_within_1e3_of_range(problem):
    found = problem.errors("")
    assert max(found.values()) <= 1e-3, found


EXPLICIT = ("simple_pendulum", "double_pendulum", "four_bar", "dc_motor_step", "slider_crank")


@pytest.mark.parametrize("case", [pytest.param(p, id=p.name) for p in PROBLEMS if p.name in EXPLICIT])
def test_dop853_falls_with_the_tolerance(case):
    """Machines, free and coupled: every digit asked for buys one, to what twelve digits leave; where stability or rows shorten
    the loosest run's steps its digits are there before, and the next need only be a tenth of what is asked. The error of a
    run that stability limits is scattered by powers of ten; of three tolerances close by the middle one counts."""
    tolerances = (1e-5, 1e-7, 1e-9, 1e-11)

    def error(reltol: float) -> float:
        return max(case.errors(f"method=dop853 reltol={reltol:g}").values())

    ladder = [sorted(error(c * r) for c in (0.8, 1.0, 1.25))[1] for r in tolerances]
    steps = zip(tolerances[1:], itertools.pairwise(ladder), strict=True)
    assert all(b <= 0.3 * a or b <= 0.1 * r for r, (a, b) in steps), ladder
    assert ladder[-1] <= 3e-10, ladder


def test_four_bar_closing_force():
    """The pin that closes the loop carries the multiplier of the closure, in world axes."""
    result = run(deck("mechanical/ref_four_bar"), "method=radau reltol=1e-9")
    rows = rows_at(result, np.array([1.0, 2.0, 5.0]))
    want_x = np.array([-0.62145796916189334, -0.009207992606340416, 1.523119627560293])
    want_y = np.array([-0.782683153763617843, -0.783221113794306949, 2.599031314920958])
    fx, fy = np.asarray(result["fx(close)"])[rows], np.asarray(result["fy(close)"])[rows]
    sign = np.sign(fx[2] * want_x[2])  # the reference counts it on one body, emsim on B from A
    assert np.abs(sign * fx - want_x).max() <= 1e-6 * np.ptp(result["fx(close)"])
    assert np.abs(sign * fy - want_y).max() <= 1e-6 * np.ptp(result["fy(close)"])


def test_lc_tank_period_by_zero_crossings():
    """2 pi sqrt(LC) = 0.000198691765315922 s over 100 periods, from the crossings of the recorded points."""
    result = run(deck("electrical/ref_lc_tank"), "reltol=1e-7", tran="0.5u 20m 0 0.5u UIC")
    t, v = np.asarray(result.time), np.asarray(result["v(a)"])
    k = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    # the inverse cubic through four points around the crossing
    cross = []
    for i in (k[0], k[-1]):
        x, y = t[i - 1 : i + 3], v[i - 1 : i + 3]
        c = sum(x0 * np.prod([-y1 / (y0 - y1) for y1 in y if y1 != y0]) for x0, y0 in zip(x, y, strict=True))
        cross.append(c)
    period = (cross[1] - cross[0]) / (len(k) - 1)
    assert period == pytest.approx(2 * pi * np.sqrt(1e-3 * 1e-6), rel=1e-7)
