"""An ellipsoid and a ball on a plane in space: rattleback and tippe top, beside integrations of their own."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from rolling_stones import RollingStone, SlidingTop

import emsim

DECKS = Path(__file__).parents[2] / "netlists" / "mechanical"


@cache
def stone():
    j = np.array([[2e-4, -2e-5, 0.0], [-2e-5, 1.6e-3, 0.0], [0.0, 0.0, 1.7e-3]])
    t = np.linspace(0.0, 3.9, 79)
    found = RollingStone((0.2, 0.03, 0.02), 0.01, 1.0, j, (0.0087, 0.0087, 0.0), (0.0, 0.0, -5.0))
    return t, found.run(3.9, t)


@cache
def top():
    m, r = 0.02, 0.02
    j1, j3 = 131 / 350 * m * r * r, 0.4 * m * r * r
    t = np.linspace(0.0, 0.5, 26)
    return t, SlidingTop(r, 0.3 * r, m, (j1, j1, j3), 0.3, 0.1, 155.0).run(0.5, t)


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 5e-8)))
def test_a_rattleback_turns_back(reltol, error):
    """Its axes of inertia are turned to those of its shape: it spins against the clock, rocks, and turns back with the clock."""
    t, exact = stone()
    assert exact[6][0] == -5.0 and exact[6][-1] > 1.0
    r = emsim.run(DECKS / "rattleback.cir", reltol=reltol, also="wz(s) wx(s) y(s) gap(touch) mode(touch)")
    for name, row in (("wx(s)", 4), ("wz(s)", 6)):
        assert [r.at(name, time) for time in t] == pytest.approx(exact[row], abs=error * 20)
    assert [r.at("x(s)", time) for time in t] == pytest.approx(exact[7], abs=error)
    assert np.all(np.asarray(r["mode(touch)"]) == 1) and abs(r.energy.residual) < error


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 5e-8)))
def test_a_tippe_top_turns_over(reltol, error):
    """While it slides: its centre of mass rises from below the middle to above it."""
    t, exact = top()
    r = emsim.run(DECKS / "tippe_top.cir", reltol=reltol, also="z(s) x(s) slip(touch)")
    for name, row in (("x(s)", 0), ("z(s)", 2)):
        assert [r.at(name, time) for time in t] == pytest.approx(exact[row], abs=error * 0.1)
    assert r["z(s)"][0] < 0.75 * 0.02 and r["z(s)"][-1] > 1.25 * 0.02
    energy = np.asarray(r["energy()"])
    assert np.diff(energy).max() < 1e-7 + error * energy[0]
    assert abs(r.energy.residual) < 1e-6
