"""What the watch tells is what a tight run shows: within a factor of two, no alarm, no silence."""

from __future__ import annotations

import math

import pytest
import watch

# What is told wrong, see the numerics chapter: a large swing's period follows its amplitude, and what steps that follow
# the swing take of it is not foreseen (order 2 at 1e-3: 12 % told of 27 %; esdirk with nine steps a swing: none of 10 %);
# 760 steps show a third of themselves; at a quality of 10 or 15 a few coarse periods are all there is (order 2 at 1e-3:
# 3 % told of 6.5 %).
KNOWN = {
    ("pendulum 90 deg", "trap", 1e-4): "silence",
    ("pendulum 90 deg", "gear", 1e-3): "silence",
    ("pendulum 90 deg", "gear 2", 1e-3): "factor",
    ("pendulum 90 deg", "trbdf2", 1e-3): "factor",
    ("tank after a step", "gear 2", 1e-2): "factor",
    ("filter after a ramp", "gear 2", 1e-2): "factor",
    ("filter after a ramp", "gear 2", 1e-3): "factor",
}


@pytest.mark.parametrize("index", range(len(watch.CASES)), ids=[case.name for case in watch.CASES])
def test_told_is_true(index):
    wrong = {}
    for method in watch.CASES[index].methods:
        for reltol in watch.RELTOLS:
            row = watch.compare(index, method, reltol)
            if row.verdict():
                wrong[row.case.name, method, reltol] = row.verdict()
    assert wrong == {key: text for key, text in KNOWN.items() if key[0] == watch.CASES[index].name}


def test_measured_against_the_closed_form():
    """v = cos(2 pi f t): the trapezoid with 20 steps a period is late by y^2/12 of each period and loses nothing."""
    index = next(k for k, case in enumerate(watch.CASES) if case.name == "tank 100 kHz")
    case = watch.CASES[index]
    result = case.run({"method": "trap", "fixed_step": case.period / 20}, 20)
    truth = watch.lost(index, result)
    want = 100 * (2 * math.pi / 20) ** 2 / 12
    assert truth.between(0.0, case.stop, case.stop)[1] == pytest.approx(
        want, rel=0.03
    )  # the next term is -y^4/80 of a period, 0.9 %
    # half a window drifts by d = 0.13 rad, of which the fit with its linear terms takes d^2/6 for a loss
    assert abs(truth.loss[-1]) < 3e-3
