"""The sample decks of the README, against figures of separate hand-written models with idealised electronics.

The figures have two or three digits, so the tolerances are one unit of the last digit printed.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support import deck, run


@cache
def sample(name: str):
    return run(deck(f"coupled/{name}"))


def test_pendulum_servo():
    """Asked for 45 degrees, it ends at 43.4, overshoots to 51.6, draws 5.8 A at most."""
    r = sample("pendulum_servo")
    angle, current = np.degrees(r["angle(hinge)"]), np.asarray(r["i(m1)"])
    assert angle[-1] == pytest.approx(43.4, abs=0.1)
    assert angle.max() == pytest.approx(51.6, abs=0.1)
    assert np.abs(current).max() == pytest.approx(5.8, abs=0.1)


def test_comb_drive_amplitudes():
    """Driven at resonance: 7.8 um, 6.1 mV at the sense output."""
    r = sample("comb_drive")
    late = np.asarray(r.time) > 18e-3
    assert 0.5e6 * np.ptp(np.asarray(r["pos(beam)"])[late]) == pytest.approx(7.8, abs=0.1)
    assert 0.5e3 * np.ptp(np.asarray(r["v(out)"])[late]) == pytest.approx(6.1, abs=0.1)


def ring_down(tia: str) -> tuple[float, float]:
    """Frequency [Hz] and Q of the comb drive left alone after a displacement, with another sense resistor."""
    text = (
        deck("coupled/comb_drive")
        .replace("SIN(20 0.5 3.5588k)", "")
        .replace("Rtia   out 0 100k", f"Rtia out 0 {tia}")
    )
    text = text.replace("slide axis=(1,0)", "slide axis=(1,0) ic=8u")
    text = text.replace(".tran  1u 20m", ".tran  1u 5m 0 1u")
    r = run(text, "method=radau reltol=1e-6")
    t, x, u = (np.asarray(r[n]) for n in ("time", "pos(beam)", "vel(beam)"))
    k = np.flatnonzero((u[:-1] < 0) & (u[1:] >= 0))  # minima of x
    at = t[k] - u[k] * (t[k + 1] - t[k]) / (u[k + 1] - u[k])
    top = np.flatnonzero((u[:-1] > 0) & (u[1:] <= 0))
    swing = (x[top] - np.interp(t[top], t[k], x[k]))[1:-1]  # maxima over the line through the minima
    decrement = np.log(swing[0] / swing[-1]) / (len(swing) - 1)
    return (len(at) - 1) / (at[-1] - at[0]), float(np.pi / decrement)


def test_comb_drive_rings_at_its_resonance():
    """3558.8 Hz and Q = 44.7 with an ideal sense amplifier (1 ohm instead of 100 k)."""
    f, q = ring_down("1")
    assert f == pytest.approx(3558.8, abs=1.0)  # damping pulls it by 0.2 Hz
    assert q == pytest.approx(44.7, abs=0.1)


def test_the_sense_resistor_damps_the_comb_drive():
    """Motional current through R takes energy: c grows by (V dC/dx)^2 (R_tia + R_drv), so Q falls to 44.16."""
    eta = 20 * 2 * 100 * 8.854e-12 * 20e-6 / 2e-6
    q = np.sqrt(1 * 2e-9) / (1e-6 + eta**2 * (100e3 + 1e3))
    assert ring_down("100k")[1] == pytest.approx(q, abs=0.05)


def test_cart_pole():
    """Balanced from 8 degrees, poked at 3 s, at rest by 6 s; travel and swing by an independent model (scipy LSODA
    at 1e-9 on the same two coordinates and the current)."""
    r = sample("cart_pole")
    t, angle, travel = np.asarray(r.time), np.degrees(r["angle(hinge)"]), np.asarray(r["pos(rail)"])
    assert angle[0] == pytest.approx(8)
    assert np.abs(angle[(t > 2.5) & (t < 3)]).max() < 0.5
    assert angle[t > 3].max() == pytest.approx(17.776, abs=0.02)
    assert np.abs(angle[t > 5.9]).max() < 0.5 and np.abs(np.asarray(r["vel(rail)"])[t > 5.9]).max() < 0.05
    assert travel.min() == pytest.approx(-0.1034, abs=5e-4) and travel.max() == pytest.approx(
        0.3656, abs=5e-4
    )


def test_cart_pole_with_an_ideal_motor():
    """Without rotor inertia, winding inductance and hinge damping: 17.4 degrees, travel -0.10 to 0.36 m."""
    text = deck("coupled/cart_pole").replace(" l=0.2m j=10u", "").replace("damp=1m ic=8deg", "ic=8deg")
    r = run(text)
    t, angle, travel = np.asarray(r.time), np.degrees(r["angle(hinge)"]), np.asarray(r["pos(rail)"])
    assert angle[t > 3].max() == pytest.approx(17.4, abs=0.06)
    assert travel.min() == pytest.approx(-0.10, abs=0.005) and travel.max() == pytest.approx(0.36, abs=0.005)
