"""Gauss's methods keep the energy of what nothing damps, over 1e5 periods: it swings, by h^4 or h^6, and does not drift.

What swings is theory's: a symplectic method keeps a modified energy that lies h^2s beside the true one (Hairer, Lubich
and Wanner, Geometric Numerical Integration, chapter IX); of a quadratic energy it keeps the true one (theorem IV.2.1).
"""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, run

import emsim

TANK = """an LC tank, 1 rad/s
L1 a 0 1 IC=0
C1 a 0 1 IC=1
.print tran v(a) i(l1)
.tran 100 628318.53 UIC
.end
"""

PENDULUM = """a pendulum that swings to 86 degrees
.gravity 9.81
BODY arm shape=rod(1) m=1
JOINT hinge 0 arm pin zero=-90deg ic=(1.5,0)
.print tran angle(hinge) omega(hinge)
.tran 1 200
.end
"""
PERIOD = 1.85  # of its 1.5 rad

# a crank, a rod and a sprung slider: a closed loop that turns over and keeps its energy
CRANK = """slider-crank with a spring
BODY  crank  shape=rod(50m)  m=0.1
BODY  conrod shape=rod(200m) m=0.2
BODY  piston m=0.3
POINT crank.tip  50m 0
POINT conrod.end 200m 0
JOINT shaft 0          crank  pin ic=(0.5,10)
JOINT big   crank.tip  conrod pin
JOINT small conrod.end piston pin
JOINT bore  0          piston slide axis=(1,0)
SPRING s1 bore k=20 q0=0.2
.print tran energy() ke(crank) ke(conrod) ke(piston)
.tran 50m 40
.end
"""


def tank(result):
    return np.asarray(result["v(a)"]) ** 2 + np.asarray(result["i(l1)"]) ** 2


def pendulum(result):
    """Energy over m l^2 / 3, with zero at the bottom."""
    angle, speed = np.asarray(result["angle(hinge)"]), np.asarray(result["omega(hinge)"])
    return 0.5 * speed**2 + 1.5 * 9.81 * (1 - np.cos(angle))


def swing_and_drift(energy):
    """Largest departure, and what a straight line through the run gains, both relative."""
    e = energy / energy[0] - 1
    return float(np.abs(e).max()), abs(float(np.polyfit(np.linspace(0, 1, len(e)), e, 1)[0]))


@pytest.mark.parametrize("method, step", [("gauss4", 0.5), ("gauss6", 1.0)])
def test_a_tank_keeps_its_energy_over_1e5_periods(method, step):
    """A quadratic energy: nothing but rounding, of a million steps, takes of it."""
    swing, drift = swing_and_drift(tank(run(TANK, f"method={method} fixed_step={step}")))
    assert swing <= 5e-10 and drift <= 5e-10, (swing, drift)


@pytest.mark.slow
@pytest.mark.parametrize("method, step, limit", [("gauss4", 0.1, 1e-3), ("gauss6", 0.2, 5e-4)])
def test_a_pendulum_keeps_its_energy_over_1e5_periods(method, step, limit):
    result = run(PENDULUM, f"method={method} fixed_step={step}", tran=f"10 {1e5 * PERIOD}")
    swing, drift = swing_and_drift(pendulum(result))
    assert swing <= limit and drift <= 0.01 * swing, (swing, drift)


def test_chosen_steps_keep_it_too():
    """The search for the step's length ends, so that no drift is left: 1e4 periods, the last as good as the first."""
    result = run(PENDULUM, "method=gauss reltol=1e-4", tran=f"10 {1e4 * PERIOD}")
    swing, drift = swing_and_drift(pendulum(result)[10:])
    assert swing <= 5e-4 and drift <= 0.01 * swing, (swing, drift)


@pytest.mark.parametrize(
    "method, order, steps", [("gauss4", 4, (0.1, 0.05, 0.025)), ("gauss6", 6, (0.2, 0.1, 0.05))]
)
def test_the_swing_falls_with_the_order(method, order, steps):
    found = []
    for h in steps:
        energy = pendulum(run(PENDULUM, f"method={method} fixed_step={h}"))
        found.append(swing_and_drift(energy)[0])
    slope = float(np.polyfit(np.log(steps), np.log(found), 1)[0])
    assert order - 0.3 <= slope <= order + 0.7, (slope, found)


def test_a_closed_loop_keeps_its_energy():
    """Symmetric projection (gauss4): over 40 s and 100 turns, no drift beside what swings."""
    result = run(CRANK, "method=gauss fixed_step=2m")
    energy = np.asarray(result["energy()"])
    kinetic = sum(np.asarray(result[f"ke({b})"]) for b in ("crank", "conrod", "piston"))
    e = (energy - energy[0]) / kinetic.max()
    drift = abs(float(np.polyfit(np.linspace(0, 1, len(e)), e, 1)[0]))
    assert np.abs(e).max() <= 1e-4 and drift <= 0.02 * np.abs(e).max(), (np.abs(e).max(), drift)


@pytest.mark.parametrize("method", ["gear", "trbdf2"])
def test_others_lose_it(method):
    """Damping is what the tank of the same step shows with BDF and TR-BDF2: Gauss is there for a reason."""
    swing, _ = swing_and_drift(tank(run(TANK, f"method={method} fixed_step=0.5", tran="10 6283 UIC")))
    assert swing > 0.5, swing


@pytest.mark.parametrize(
    "text, method",
    [
        ("capacitor across an expression\nB1 a 0 V={sin(6.28*time)}\nC1 a 0 1\n.tran 0.1 1\n.end\n", "gauss"),
        (CRANK, "gauss6"),
        # (a diode bridge it refuses at some tolerances and gets through at others, rightly, in 60 000 steps for gear's 1000)
        (deck("hard/stiff_van_der_pol"), "gauss"),
    ],
    ids=["index-2 circuit", "three stages on a loop", "what decays at once"],
)
def test_what_gauss_cannot_do_it_says(text, method):
    with pytest.raises(emsim.ConvergenceError, match="cannot do this deck"):
        run(text, f"method={method}")


@pytest.mark.parametrize("method", ["gauss4", "gauss6"])
def test_no_polynomial_goes_through_a_corner(method):
    """Rows after a source's corner came from points on both sides of it: the source's own node was off by a quarter of a volt."""
    corners = [0, 1, 1.5, 3, 3.001], [0, 1, -1, -1, 2]
    pairs = " ".join(f"{t} {v}" for t, v in zip(*corners, strict=True))
    r = run(f"ramps\nV1 a 0 PWL({pairs})\nR1 a b 1k\nC1 b 0 1m\n.tran 0.03 3.1\n.end\n", f"method={method}")
    assert np.abs(r["v(a)"] - np.interp(r.time, *corners)).max() < 1e-9


@pytest.mark.parametrize("method", ["gauss4", "gauss6"])
@pytest.mark.parametrize("edge", [1e-9, 1e-6])
def test_steps_grow_again_behind_an_edge(method, edge):
    """An edge of a nanosecond held all steps that followed to its length, until the run was refused as stiff; one of a
    microsecond took 340 000."""
    r = emsim.run(
        "pulses on a rod\nBODY b m=1 shape=rod(1)\nJOINT h 0 b pin\n"
        f"TORQUE t h tau=PULSE(0 1 0.1 {edge:g} {edge:g} 0.2 0.5)\n.tran 10m 2\n.options method={method}\n.end\n"
    )
    since = np.clip(np.asarray(r["time"]) - 0.1, 0, None)
    omega = 3 * (0.2 * (since // 0.5) + np.minimum(since % 0.5, 0.2))
    assert np.abs(r["omega(h)"] - omega).max() < 20 * edge
    assert r.stats["steps"] < 2000
