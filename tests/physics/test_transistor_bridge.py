"""A motor on a bridge of power MOSFETs: what the bridge gives is what the winding and the rotor take."""

from __future__ import annotations

import numpy as np
from support import deck, run


def test_motor_on_four_mosfets_keeps_momentum_and_voltage():
    r = run(deck("coupled/hbridge_motor_mosfet"), "reltol=1e-4")
    t, i, omega = (np.asarray(r[name]) for name in ("time", "i(mot)", "omega(shaft)"))
    v = np.asarray(r["v(a)"]) - np.asarray(r["v(b)"])
    # it turns one way, then the other, and nearly as fast as kt allows at 24 V
    assert omega.max() > 1100 and omega[-1] < -1100
    # J domega = (kt i - d omega) dt
    turned = np.trapezoid(0.02 * i - 1e-6 * omega, t)
    assert abs(turned - 2e-6 * (omega[-1] - omega[0])) < 1e-4 * abs(turned)
    # v = L di/dt + r i + kt omega, over the whole run
    dropped = np.trapezoid(1.2 * i + 0.02 * omega, t) + 0.4e-3 * (i[-1] - i[0])
    assert abs(np.trapezoid(v, t) - dropped) < 1e-4 * np.trapezoid(np.abs(v), t)


def test_body_diodes_carry_the_current_of_the_dead_time():
    """For 20 us all four transistors are off: the motor's current goes back into the supply through two diodes."""
    r = run(deck("coupled/hbridge_motor_mosfet"), "reltol=1e-4")
    t = np.asarray(r.time)
    dead = (t > 20.004e-3) & (t < 20.018e-3)
    i, a, b = (np.asarray(r[name])[dead] for name in ("i(mot)", "v(a)", "v(b)"))
    carrying = i > 1e-2
    assert carrying.any()
    assert np.all(a[carrying] < -0.3) and np.all(b[carrying] > 24.3)
