"""The schematics of netlists/schematics against closed forms, and against the deck of the same machine."""

import numpy as np
import pytest
from support import NETLISTS

import emsim

HERE = NETLISTS / "schematics"


def test_the_servo_in_a_drawing_is_the_servo_of_the_deck():
    drawn = emsim.run(str(HERE / "pendulum_servo.asc"), reltol=1e-6)
    deck = emsim.run(str(NETLISTS / "coupled" / "pendulum_servo.cir"), reltol=1e-6)
    for name in ("angle(hinge)", "i(m1)", "v(wip)"):
        same = np.interp(deck.time, drawn.time, drawn[name])
        # between rows a straight line, within the millisecond that the pulse rises in
        assert np.allclose(same, deck[name], atol=5e-3 * np.ptp(deck[name])), name


def test_the_low_pass_of_sallen_and_key():
    """v(out)/v(in) = 1/(1 + 2 s R C2 + s^2 R^2 C1 C2), as long as the amplifier's gain is large."""
    ac = emsim.run(str(HERE / "sallen_key.kicad_sch")).table("ac")
    f = np.asarray(ac["frequency"]).real
    low = f < 2e4
    s = 2j * np.pi * f[low]
    exact = 1 / (1 + 2 * s * 1e4 * 1e-9 + s**2 * 1e8 * 2e-18)
    assert np.allclose(np.asarray(ac["v(/out)"])[low], exact, atol=0.01)


@pytest.mark.parametrize(("k", "c"), [(0, 470e-9), (1, 1e-6), (2, 2.2e-6)])
def test_the_band_pass(k, c):
    """v(out)/v(in) = R/(R + s L + 1/(s C))."""
    course = emsim.run(str(HERE / "rlc_bandpass.sch")).table("ac").courses()[k]
    s = 2j * np.pi * np.asarray(course["frequency"]).real
    assert np.allclose(course["v(out)"], 10 / (10 + s * 1e-3 + 1 / (s * c)), rtol=1e-6)
