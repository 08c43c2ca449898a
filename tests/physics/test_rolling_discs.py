"""Thin discs that roll on a plane: Euler's disc and a coin that slows down and falls, beside an integration of their own."""

from __future__ import annotations

from functools import cache
from math import cos, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from rolling_stones import G, RollingDisc

import emsim

DECKS = Path(__file__).parents[2] / "netlists" / "mechanical"
TOLERANCES = ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 1e-8))
R, LEAN = 37.5e-3, 0.3
ENDS = 1.5 * 40 * sqrt(R * LEAN / G)  # of Euler's disc, see the deck


@cache
def settling():
    spin = sqrt(4 * G / (R * sin(LEAN)))
    w = (0.0, spin * sin(LEAN) * cos(LEAN), spin * sin(LEAN) ** 2)
    t = np.linspace(0.0, 1.6, 33)
    return t, RollingDisc(R, 0.44, R / 40, (0.0, -sin(LEAN), cos(LEAN)), w).run(1.6, t)


@cache
def falling():
    t = np.linspace(0.0, 3.0, 61)
    lean, w = 0.05, 0.4 / 0.02
    turning = (0.0, w * cos(lean), -w * sin(lean))
    return t, RollingDisc(0.02, 8e-3, 0.2e-3, (0.0, -cos(lean), sin(lean)), turning).run(3.0, t)


def beside(name: str, body: str, r: float, found, reltol: float, error: float):
    t, exact = found
    result = emsim.run(DECKS / f"{name}.cir", reltol=reltol)
    heights = r * np.hypot(exact[0], exact[1])
    for word, row in (("x", exact[6]), ("y", exact[7]), ("z", heights)):
        # of the machine's length
        assert [result.at(f"{word}({body})", time) / r for time in t] == pytest.approx(row / r, abs=error)
    energy = np.asarray(result["energy()"])
    assert np.all(np.asarray(result["mode(touch)"])[np.asarray(result.time) < t[-1]] == 1)
    assert np.diff(energy).max() < 1e-5 * energy[0] and abs(result.energy.residual) < 1e-5 * energy[0]
    return result


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_eulers_disc_settles_in_a_finite_time(reltol, error):
    r = beside("euler_disc", "disc", R, settling(), reltol, error)
    # over its swings, the root of its lean falls evenly
    t = np.linspace(0.0, 1.8, 400)
    root = np.sqrt(np.array([r.at("z(disc)", time) for time in t]) / (R * LEAN))
    slope, begin = np.polyfit(t, root, 1)
    assert -begin / slope == pytest.approx(ENDS, rel=0.01) and begin == pytest.approx(1.0, abs=0.01)
    assert r["z(disc)"][-1] < 0.01 * R * LEAN


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_coin_slows_down_and_falls(reltol, error):
    r = beside("coin", "coin", 0.02, falling(), reltol, error)
    assert r["z(coin)"][0] > 0.0199 and r["z(coin)"][-1] < 0.011


@pytest.mark.parametrize("factor", [0.9, 0.98, 1.02, 1.2])
def test_a_coin_rolls_upright_above_a_speed(factor):
    """Small leans about rolling straight on with w = v/r: lean'' = 4/5 (g/r - 3 w^2) lean, J = m r^2/4 and m r^2/2: it falls
    below v^2 = g r/3, and above it wobbles at that frequency."""
    v, lean = factor * sqrt(G * 0.02 / 3), 1e-5
    r = emsim.run(
        DECKS / "coin.cir",
        {"v": v, "lean": lean, "b": 0},
        reltol=1e-9,
        also="e0(coin) e1(coin) e2(coin) e3(coin)",
    )
    t = np.linspace(0.0, 3.0, 3001)
    e0, e1, e2, e3 = (np.array([r.at(f"e{k}(coin)", time) for time in t]) for k in range(4))
    axle = e0**2 - e1**2 - e2**2 + e3**2  # its height: the lean
    square = 0.8 * (G / 0.02 - 3 * (v / 0.02) ** 2)
    # it leans at the start without turning about the vertical: the middle of the motion is the lean of the circle that it takes
    middle = lean * (1 - 0.8 * G / 0.02 / square)
    if factor < 1.0:
        assert axle[:300] == pytest.approx(
            middle + (lean - middle) * np.cosh(sqrt(square) * t[:300]), rel=1e-3
        )
        assert np.abs(axle).max() > 0.1
    else:
        swings = np.cos(sqrt(-square) * t)
        assert axle == pytest.approx(middle + (lean - middle) * swings, abs=1e-3 * abs(middle))
