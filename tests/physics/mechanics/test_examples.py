"""The decks of netlists/mechanical and netlists/coupled that have a closed form or a balance beside them."""

import numpy as np
import pytest
from support import deck, run

import emsim


def columns(name, *names, options="", tran=None):
    r = run(deck(name), options, tran=tran)
    return r.time, *(np.asarray(r[n]) for n in names)


def test_thrown_disc():
    t, x, y, angle = columns("mechanical/thrown_disc", "x(puck)", "y(puck)", "angle(puck)")
    assert x == pytest.approx(3 * t, abs=1e-9)
    assert y == pytest.approx(1 + 4 * t - 9.81 * t * t / 2, abs=1e-6)
    assert angle == pytest.approx(5 * t, abs=1e-9)


def test_driven_slider_crank():
    names = ("pos(bore)", "vel(bore)", "power(d)", "energy()", "loss()")
    t, x, v, power, energy, loss = columns("mechanical/driven_slider_crank", *names)
    r, l, q = 0.05, 0.15, 20 * t  # noqa: E741
    root = np.sqrt(l * l - (r * np.sin(q)) ** 2)
    assert x == pytest.approx(r * np.cos(q) + root, abs=1e-6)
    assert v == pytest.approx(-20 * r * np.sin(q) * (1 + r * np.cos(q) / root), abs=1e-4)
    work = np.sum(0.5 * (power - loss)[1:] * np.diff(t) + 0.5 * (power - loss)[:-1] * np.diff(t))
    assert work == pytest.approx(energy[-1] - energy[0], abs=2e-3 * np.ptp(energy))


def test_scotch_yoke():
    t, x, v = columns("mechanical/scotch_yoke", "pos(guide)", "vel(guide)", options="reltol=1e-6")
    assert x == pytest.approx(0.1 * np.cos(30 * t), abs=1e-6)
    assert v == pytest.approx(-3 * np.sin(30 * t), abs=1e-4)


def test_trammel():
    names = ("pos(across)", "pos(up)", "vel(across)", "vel(up)", "fx(r)", "fy(r)", "energy()")
    _, x, y, u, v, fx, fy, energy = columns("mechanical/trammel", *names)
    assert np.hypot(x, y) == pytest.approx(0.5, abs=1e-8)
    assert energy == pytest.approx(energy[0], abs=1e-5)
    # the rod pushes b along its direction (-x, y)/l: m g y/l - m (u^2 + v^2)/l
    force = (9.81 * y - u * u - v * v) / 0.5
    assert fx == pytest.approx(-force * x / 0.5, abs=1e-3)
    assert fy == pytest.approx(force * y / 0.5, abs=1e-3)


def test_spring_pendulum_keeps_its_energy():
    _, energy = columns("mechanical/spring_pendulum", "energy()")
    assert energy == pytest.approx(energy[0], abs=1e-5)


def test_lead_screw():
    t, travel, angle, force = columns(
        "mechanical/lead_screw", "pos(lift)", "angle(axle)", "force(screwdrive)"
    )
    p = 0.01 / (2 * np.pi)
    acceleration = p * (0.5 - 5 * 9.81 * p) / (1e-3 + 5 * p * p)
    assert travel == pytest.approx(acceleration * t * t / 2, abs=1e-6)
    assert angle == pytest.approx(travel / p, abs=1e-6)
    assert force[5:] == pytest.approx(5 * (9.81 + acceleration), rel=1e-6)


def test_bricard():
    t, angle, x, energy = columns("mechanical/bricard", "angle(p0)", "x(r3(0,0,1))", "energy()")
    for when, q, place in (
        (1.0, 1.035028459518062182, 0.510501461187219736),
        (2.0, 2.893328205981293361, -0.969340344777651603),
    ):
        k = int(np.argmin(np.abs(t - when)))
        assert t[k] == pytest.approx(when, abs=1e-12)
        assert angle[k] == pytest.approx(q, abs=1e-6)
        assert x[k] == pytest.approx(place, abs=1e-6)
    assert energy == pytest.approx(-29.43, abs=1e-4)


def test_saturating_magnet_balances_its_energy():
    """loss() counts the winding's 8 Ohm, and the 1 Ohm across which the power is shown as a voltage."""
    names = "v(w)", "energy()", "loss()", "i(mag)", "vel(gap)"
    t, power, energy, heat, i, u = columns("coupled/saturating_magnet", *names, tran="1u 20m")
    assert heat == pytest.approx(8 * i * i + 3 * u * u + power * power, rel=1e-9, abs=1e-12)
    net = power - (heat - power * power)
    supplied = np.sum(0.5 * (net[1:] + net[:-1]) * np.diff(t))
    assert supplied == pytest.approx(energy[-1] - energy[0], abs=1e-3 * np.ptp(energy))
    assert np.ptp(energy) > 1e-4


def test_voice_coil_is_lossless():
    _, x, u, v, i, out, into = columns(
        "coupled/voice_coil", "pos(x)", "vel(x)", "v(coil)", "i(coil)", "power(coil)", "p(coil)"
    )
    k = 7 / (1 + (x / 5e-3) ** 2)
    assert v == pytest.approx(k * u, abs=1e-6)
    assert out == pytest.approx(into, abs=1e-6)
    assert np.ptp(i) > 1


def test_a_machine_in_a_subcircuit_is_the_same_machine():
    text = deck("coupled/lever_in_a_box")
    flat = text.replace("X1    drive 0 tach hinge actuator ratio=30\n", "").replace(".ends\n", "")
    flat = flat.replace(".subckt actuator plus minus tacho joint ratio=1\n", "").replace("{ratio}", "30")
    for inner, outer in (
        (" joint ", " hinge "),
        (" plus minus ", " drive 0 "),
        ("tacho", "tach"),
        ("x1.", ""),
    ):
        flat = flat.replace(inner, outer)
    one, two = emsim.run(text), emsim.run(flat)
    for a, b in (("angle(hinge)", "angle(hinge)"), ("omega(x1.axle)", "omega(axle)"), ("v(tach)", "v(tach)")):
        assert one[a][-1] == pytest.approx(two[b][-1], rel=1e-6), a
