"""The decks of netlists/hard: each names why methods fail on it; here is what must come out."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, run

import emsim


def test_stiff_van_der_pol():
    r = run(deck("hard/stiff_van_der_pol"))
    assert r["v(y)"][-1] == pytest.approx(1.706167732170469, abs=4e-5)
    assert r["v(z)"][-1] == pytest.approx(-8.928097010248e-4, rel=1e-4)
    assert r.stats["steps"] < 5000


@pytest.mark.parametrize("method", ["trap", "gear", "radau", "esdirk"])
def test_capacitor_loop(method):
    r = run(deck("hard/capacitor_loop"), f"method={method}")
    t, a, b = (np.asarray(r[n]) for n in ("time", "v(a)", "v(b)"))
    assert np.abs(b - a / 4).max() < 1e-3
    # C3 and the series pair hang on the source: 2 uF + 0.75 uF
    want = -2.75e-6 * 2 * np.pi * 1e3 * np.cos(2 * np.pi * 1e3 * t)
    tol = {"trap": 0.1, "gear": 0.05, "radau": 1e-2, "esdirk": 1e-6}[method]
    assert np.abs(np.asarray(r["i(b1)"]) - want)[t > 1e-4].max() < tol * np.ptp(want)


METHODS = ("auto", "trap", "gear", "radau", "esdirk", "trbdf2")
W = 2e3 * np.pi
SLOPES = {  # what the slopes of sources decide: cards, an unknown, its closed form
    "capacitors on a source": (
        "V1 a 0 SIN(0 1 1k)\nC1 a b 1u\nC2 b 0 3u\nC3 a 0 2u\nRb b 0 1g",
        "i(v1)",
        lambda t: -2.75e-6 * W * np.cos(W * t),
    ),
    "coils that carry a source": (
        "I1 0 a SIN(0 1 1k)\nL1 a b 1m\nL2 b 0 2m\nI2 0 b SIN(0 0.5 2k)",
        "v(a)",
        lambda t: W * (3e-3 * np.cos(W * t) + 2e-3 * np.cos(2 * W * t)),
    ),
    "a ramp": (
        "V1 a 0 PWL(0 0 1.04m 0 2.14m 1.1 10m 1.1)\nC1 a 0 1u",
        "i(v1)",
        lambda t: np.where((t > 1.0401e-3) & (t < 2.14e-3), -1e-3, 0.0),
    ),
    "gain 1": ("V1 in 0 SIN(0 1 1k)\nR1 in a 1k\nC1 a b 1u\nE1 b 0 a 0 1", "v(a)", lambda t: np.sin(W * t)),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("case", SLOPES)
def test_what_slopes_of_sources_decide_is_right_by_what_damps(case, method):
    """Trap rang behind the ramp. Explicit methods and gauss refuse these by name."""
    cards, name, want = SLOPES[case]
    r = run(f"{case}\n{cards}\n.tran 20u 3m\n.end\n", f"method={method}")
    t = np.asarray(r.time)
    # (rows that stand at a corner may show either side)
    late = np.abs(t[:, None] - [1.04e-3, 2.14e-3]).min(axis=1) > 1e-6
    assert np.abs(np.asarray(r[name]) - want(t))[late].max() < 1e-3 * np.ptp(want(t))


@pytest.mark.parametrize("method", ["gauss", "rk45", "dop853"])
@pytest.mark.parametrize("case", SLOPES)
def test_what_slopes_of_sources_decide_is_refused_by_what_does_not_damp(case, method):
    with pytest.raises(emsim.ConvergenceError, match="E413"):
        run(f"{case}\n{SLOPES[case][0]}\n.tran 20u 3m\n.end\n", f"method={method}")


@pytest.mark.parametrize("method", ["radau", "esdirk"])
def test_inductor_cutset(method):
    """Node voltages that are derivatives are computed anew in each row: the stages are wrong by 1e-4 and 1e-2 of the range."""
    r = run(deck("hard/inductor_cutset"), f"method={method}")
    t, a, b = (np.asarray(r[n])[1:] for n in ("time", "v(a)", "v(b)"))
    w = 2 * np.pi * 1e3
    i, j = w * np.cos(w * t), w * np.cos(2 * w * t)
    want = 2e-3 * (i + j)
    assert np.abs(b - want).max() < 1e-6 * np.ptp(want)
    assert np.abs(a - want - 1e-3 * i).max() < 1e-6 * np.ptp(want)


@pytest.mark.parametrize("method", ["gear", "radau"])
def test_no_ringing_after_a_corner(method):
    """The voltage of the inductor returns to zero and stays there."""
    r = run(deck("hard/trap_ringing"), f"method={method}")
    t, v = np.asarray(r.time), np.asarray(r["v(a)"])
    assert np.abs(v[(t > 1.2e-3) & (t < 1.9e-3)] - 1).max() < 1e-3
    assert np.abs(v[t > 2.5e-3]).max() < 1e-3


def test_gear_damps_a_lossless_tank_and_radau_does_not():
    left = {}
    for method in ("gear", "radau"):
        r = run(deck("hard/gear_damps"), f"method={method}")
        z = np.sqrt(253.3029591e-6 / 10e-9)
        left[method] = float(np.hypot(r["v(a)"][-1], z * r["i(l1)"][-1]))
    assert left["gear"] < 0.9 and left["radau"] > 0.99, left


def test_change_points_are_passed_on_the_same_branch():
    r = run(deck("hard/change_point"))
    a, d = np.asarray(r["angle(a)"]), np.asarray(r["angle(d)"])
    assert a[-1] > 2 * np.pi  # at least one full turn: two change points
    assert np.abs(a - d).max() < 1e-3


def test_operating_point_of_eight_diodes():
    """I R + 8 n Vt ln(I/Is + 1) = 20 V."""
    r = run(deck("hard/diode_loop_start"))
    i = -float(r["i(v1)"][0])
    vt = 1.38064852e-23 * 300.15 / 1.6021766208e-19
    assert i * 10 + 8 * vt * np.log1p(i / 1e-15) == pytest.approx(20, rel=1e-3)
