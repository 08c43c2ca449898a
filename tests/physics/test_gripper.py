"""gripper.cir: two jaws hold a part by friction; where the current is too small it falls, by a closed form."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import emsim

DECK = Path(__file__).parents[2] / "netlists" / "coupled" / "gripper.cir"
G, M, MU, KT = 9.81, 0.2, 0.3, 10.0
CARRIES = M * G / (MU * KT)
HIGH = 0.08


def pull(low: float):
    """v' = mu kt i/m - g from where the current is too small: times, speeds and places at the corners of the current, and where
    it is held again. The current is straight between corners: parabolas and cubics."""
    corners = [(0.5, 1.5), (0.6, low), (0.7, low), (0.71, 1.5)]
    begin = 0.5 + 0.1 * (1.5 - CARRIES) / (1.5 - low)
    t, a, v, y = begin, 0.0, 0.0, HIGH
    for (t0, i0), (t1, i1) in [*pairwise(corners), (corners[-1], (2.0, 1.5))]:
        if t1 <= t:
            continue
        rate = MU * KT / M * (i1 - i0) / (t1 - t0)
        a, span = MU * KT * (i0 + (i1 - i0) * (t - t0) / (t1 - t0)) / M - G, t1 - t
        rests = [z.real for z in np.roots([rate / 2, a, v]) if abs(z.imag) < 1e-12 and 1e-9 < z.real <= span]
        span = min(rests, default=span)
        y += v * span + a * span**2 / 2 + rate * span**3 / 6
        v += a * span + rate * span**2 / 2
        t += span
        if rests:
            break
    return begin, t, y


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 1e-8)))
def test_it_lifts_lets_slip_and_holds_again(reltol, error):
    r = emsim.run(DECK, reltol=reltol)
    begin, end, y = pull(0.5)
    t = np.asarray(r.time)
    assert r.at("y(part)", [0.15, 0.45]) == pytest.approx([0.03, HIGH], abs=0.1 * error)
    # in the middle of the lift, 50 mm in all
    assert r.at("y(part)", 0.3) == pytest.approx(0.03 + 0.025, abs=error)
    assert r["y(part)"][-1] == pytest.approx(y, abs=0.1 * error)
    slips = np.abs(np.asarray(r["vy(part)"])) > 1e-6
    late = t[slips & (t > 0.45)]
    assert late[0] == pytest.approx(begin, abs=3e-3) and late[-1] == pytest.approx(end, abs=3e-3)
    for grip in ("force(grip1)", "force(grip2)"):
        assert r.at(grip, [0.3, 0.65]) == pytest.approx([KT * 1.5 / 2, KT * 0.5 / 2], rel=error)
    # what friction took while it slipped: the fall, as it is at rest before and after; jaws of 50 g that meet 2 mm from rest
    lost = sum(line.dissipated for line in r.energy.lines if line.name.startswith("grip"))
    assert lost == pytest.approx(M * G * (HIGH - y) + KT * 1.5 * 2e-3, rel=3 * error)
    assert abs(r.energy.residual) < error


@pytest.mark.parametrize(("factor", "holds"), ((0.99, False), (1.01, True)))
def test_it_slips_below_a_current(factor, holds):
    r = emsim.run(DECK, {"low": factor * CARRIES}, reltol=1e-7)
    fell = HIGH - r["y(part)"][-1]
    if holds:
        assert abs(fell) < 1e-9
    else:
        assert fell == pytest.approx(HIGH - pull(factor * CARRIES)[2], rel=1e-4) and fell > 1e-4


@pytest.mark.parametrize(("current", "holds"), ((0.97, False), (1.0, True)))
def test_lifted_fast_it_needs_more(current, holds):
    """It is lifted at 5 m/s^2: m (g + a)/(mu kt) = 0.987 A."""
    assert 0.97 < M * (G + 5.0) / (MU * KT) < 1.0
    text = DECK.read_text().replace("PWL(0 1.5 0.5 1.5", f"PWL(0 {current} 0.5 {current}")
    r = emsim.run(text, reltol=1e-7)
    assert (abs(r.at("y(part)", 0.45) - HIGH) < 1e-9) == holds
