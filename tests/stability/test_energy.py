"""Energy is kept where nothing takes it, and accounted for where something does."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, run


def test_double_pendulum_keeps_its_energy():
    """10 s of chaos: relative to the largest kinetic energy, 1e-9 with radau at reltol 1e-9."""
    text = deck("mechanical/ref_double_pendulum")
    result = run(text, "method=radau reltol=1e-9", tran="0.1 10")
    q1, q2 = (np.asarray(result[n]) for n in ("angle(p1)", "angle(p2)"))
    u1, u2 = (np.asarray(result[n]) for n in ("omega(p1)", "omega(p2)"))
    # by hand: absolute angles from the downward vertical, unit lengths and masses
    a, b, w, z = q1, q1 + q2, u1, u1 + u2
    kinetic = 0.5 * w**2 + 0.5 * (w**2 + z**2 + 2 * w * z * np.cos(a - b))
    energy = kinetic - 9.81 * (2 * np.cos(a) + np.cos(b))
    assert np.abs(energy - energy[0]).max() <= 1e-9 * kinetic.max()
    # the run's own book says the same
    own = np.asarray(result["energy()"])
    assert np.abs((own - own[0]) - (energy - energy[0])).max() <= 1e-11 * kinetic.max()


MOTOR_PENDULUM = """a pendulum driven by a motor, with friction in both
.gravity 9.81
BODY  arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin zero=-90deg damp=2m
MOTOR m1 a 0 hinge kt=20m r=2 l=1m gear=10 j=2u b=1u
V1 a 0 SIN(0 6 1.5)
* the books, as charges on 1 F capacitors: energy from the source, lost in the winding, lost in both dampers
Bs 0 es I={-v(a)*i(v1)}
Cs es 0 1
Br 0 er I={2*i(m1)*i(m1)}
Cr er 0 1
Bd 0 ed I={2m*omega(hinge)*omega(hinge)+1u*(10*omega(hinge))*(10*omega(hinge))}
Cd ed 0 1
.tran 10m 3 UIC
.print tran angle(hinge) omega(hinge) i(m1) ke(arm) pe()
.end
"""


def ledger(options: str) -> float:
    """Largest |supplied - stored - dissipated| over the run, relative to the energy that went through."""
    result = run(MOTOR_PENDULUM, options)
    get = lambda n: np.asarray(result[n])  # noqa: E731
    q, u, i = get("angle(hinge)"), get("omega(hinge)"), get("i(m1)")
    inertia = 0.2 * 0.3**2 / 3 + 2e-6 * 100
    stored = 0.5 * inertia * u**2 + 0.2 * 9.81 * 0.15 * (1 - np.cos(q)) + 0.5 * 1e-3 * i**2
    lost = get("v(er)") + get("v(ed)")
    return float(np.abs(get("v(es)") - stored - lost).max() / (np.abs(stored) + lost).max())


@pytest.mark.parametrize("reltol, limit", [("1e-3", 2e-3), ("1e-6", 1e-5), ("1e-9", 1e-8)])
def test_motor_pendulum_balances(reltol, limit):
    assert ledger(f"method=radau reltol={reltol}") <= limit


def test_balance_closes_with_the_tolerance():
    loose, middle, tight = (ledger(f"method=radau reltol={r}") for r in ("1e-3", "1e-6", "1e-9"))
    assert tight <= middle <= max(loose, 1e-9) and tight <= 1e-3 * max(loose, 1e-6), (loose, middle, tight)


def test_ke_and_kt_that_differ_are_reported_in_watts():
    """The paper's motor makes more torque than its back-EMF pays for, or less: the run says so, in watts."""
    result = run(deck("paper/motor_pendulum_kp30"))
    said = [d for d in result.diagnostics if "ke" in d.message.lower() and "kt" in d.message.lower()]
    assert len(said) == 1, [d.message for d in result.diagnostics]
    assert "W" in said[0].message + str(said[0].hint)
