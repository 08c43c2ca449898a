"""pin_wheel_clock.cir: an escapement by its pins and pallets, beside an integration of its own."""

from __future__ import annotations

from functools import cache
from math import radians
from pathlib import Path

import numpy as np
import pytest
from clockwork import DRUM, LOAD, STEP, Clock, G

import emsim

DECK = Path(__file__).parents[2] / "netlists" / "mechanical" / "pin_wheel_clock.cir"
TIMES = np.linspace(0.05, 4.95, 99)


@cache
def clock():
    return Clock(radians(4.5), radians(-6.5)).run(5.0)


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-2), (1e-6, 1e-6), (1e-7, 1e-7), (1e-8, 1e-8)))
def test_a_clock_ticks_as_by_its_own_integration(reltol, error):
    """Errors by a tenth of a radian, the swing."""
    own = clock()
    exact = np.array([own.at(t) for t in TIMES])
    r = emsim.run(DECK, reltol=reltol)
    swing, main = (r.at(f"angle({joint})", TIMES) for joint in ("swing", "main"))
    assert swing == pytest.approx(exact[:, 0], abs=0.1 * error)
    # what is late by dt is off by its rate: the wheel turns at 7 rad/s while it drops, the pendulum at 0.6
    assert main == pytest.approx(exact[:, 1], abs=error)
    assert r["hits(tick)"][-1] + r["hits(tock)"][-1] == len(own.impacts)
    # where the weight's work went
    lost = {line.name: line.dissipated for line in r.energy.lines if line.dissipated}
    assert lost["tick"] + lost["tock"] == pytest.approx(own.lost, rel=error)
    gained = LOAD * G * -r["pos(falls)"][-1]
    assert r["pos(falls)"][-1] == pytest.approx(DRUM * r["angle(main)"][-1], rel=1e-9)
    assert gained == pytest.approx(LOAD * G * DRUM * -exact[-1, 1], rel=0.01)
    assert abs(r.energy.residual) < max(error, 1e-4) * gained


def test_a_pin_passes_each_period_and_keeps_it_swinging():
    r = emsim.run(DECK)
    swing, t = np.asarray(r["angle(swing)"]), np.asarray(r.time)
    up = np.flatnonzero((swing[:-1] < 0.0) & (swing[1:] >= 0.0))
    ticks = t[up]
    pins = -np.array([r.at("angle(main)", time) for time in ticks]) / STEP
    assert len(ticks) >= 4 and np.diff(pins) == pytest.approx(1.0, abs=0.05)
    # more than it began with, and without the weight less
    assert np.abs(swing[t > 4.0]).max() > radians(5.0)
    free = emsim.run(DECK, {"load": "1u"})
    assert np.abs(np.asarray(free["angle(swing)"])[np.asarray(free.time) > 4.0]).max() < radians(4.1)
