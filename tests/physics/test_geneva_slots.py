"""geneva_slots.cir: a wheel that moves by contact of pin and slots, beside the closed form of either wall."""

from __future__ import annotations

from math import asin, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import emsim

DECK = Path(__file__).parents[2] / "netlists" / "mechanical" / "geneva_slots.cir"
A, M, ROOM, J, BRAKE, SPEED = 0.1, sqrt(0.5), 20e-6, 0.2e-3, 5e-3, 2 * pi


def wheel(f, side):
    """Angle of the slot's wall that the pin is at, crank at f from the line of centres; and from axle to pin [m]."""
    p = A * np.sqrt(1 + M * M - 2 * M * np.cos(f))
    return np.arctan2(M * np.sin(f), 1 - M * np.cos(f)) + side * np.arcsin(ROOM / p), p


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 3e-5), (1e-6, 1e-6), (1e-8, 2e-8)))
def test_the_pin_is_at_one_wall_or_the_other(reltol, error):
    r = emsim.run(DECK, reltol=reltol)
    angle, main, force, on = (
        np.asarray(r[name]) for name in ("angle(cross)", "angle(main)", "force(touch)", "mode(touch)")
    )
    turn = np.round(main / (2 * pi))
    f, moved = main - 2 * pi * turn, -angle - turn * pi / 2 - pi / 4
    for side in (-1, 1):
        # it drives until the wheel is fastest, at f = 0, and then holds it back; away from where it comes to a wall
        at = (on > 0) & (side * f > 0.1) & (np.abs(f) < pi / 4 - 0.02)
        assert at.sum() > 100
        there, p = wheel(f[at], side)
        assert moved[at] == pytest.approx(there, abs=error)
        h = 1e-3
        bend = sum(
            k * wheel(f[at] + n * h, side)[0] for n, k in ((-2, -1), (-1, 16), (0, -30), (1, 16), (2, -1))
        )
        push = (J * SPEED**2 * bend / (12 * h * h) + BRAKE) / np.sqrt(p**2 - ROOM**2)
        assert -side * push == pytest.approx(force[at], abs=1e-6)
    # at rest outside, where it was left: a quarter further each turn, to the room at the end of a slot
    ends = [-r.at("angle(cross)", k + 0.9) for k in range(3)]
    for k in range(3):
        assert -r.at("angle(cross)", k + 0.65) == pytest.approx(ends[k], abs=1e-9)
        assert ends[k] == pytest.approx((k + 1) * pi / 2, abs=asin(ROOM / (A * M)) + 1e-9)
    assert np.diff(ends) == pytest.approx(pi / 2, abs=1e-9)
