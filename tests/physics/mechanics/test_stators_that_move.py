"""MOTOR j= on a joint whose stator moves: the rotor's whole speed counts, carrier and gear times relative."""

from __future__ import annotations

import math

import pytest
from machines import generalised_force, machine, momentum, only_error

import emsim

SATELLITE = """satellite and reaction wheel
BODY sat m=4 j=0.05
{wheel}
JOINT free 0 sat planar
{joint}
Is 0 a 2
MOTOR m a 0 ax kt=0.05 r=1 {motor}
Ra a 0 1e9
.tran 1m 1
.save all energy()
.end
"""
A_BODY = {"wheel": "BODY wheel m=0.1 j=1e-3", "joint": "JOINT ax sat wheel pin", "motor": ""}
IN_J = {"wheel": "BODY wheel m=0.1 j=0", "joint": "JOINT ax sat wheel pin", "motor": "j=1e-3"}


def end(deck: str) -> dict[str, float]:
    r = emsim.run(deck)
    return {name: float(r[name][-1]) for name in r.names}


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_satellite_stays_at_rest_when_its_wheel_stands_in_j(formulation):
    """0.1 N m on the wheel for 1 s and as much on the satellite: -2 rad/s, the wheel 100 rad/s."""
    deck = SATELLITE.format(**IN_J)
    if formulation == "absolute":
        deck = deck.replace(".tran", ".options formulation=absolute\n.tran")
    r, body = end(deck), end(SATELLITE.format(**A_BODY))
    assert r["omega(free)"] == pytest.approx(-2.0, abs=1e-6)
    assert r["omega(ax)"] == pytest.approx(102.0, abs=1e-5)
    assert r["energy()"] == pytest.approx(body["energy()"], rel=1e-6)


@pytest.mark.parametrize("gear", [1.0, 5.0, -3.0])
def test_rotor_speed_is_carrier_plus_gear_times_relative(gear):
    """Momenta of arm and fore-arm: j (a + g u) is the rotor's spin; d/da gives it whole, d/du g times."""
    m = machine(
        "BODY arm m=1 j=0.5\nBODY fore m=1 j=0.1\nJOINT a 0 arm pin\nJOINT b arm fore pin\n"
        f"V1 n 0 0\nMOTOR m n 0 b kt=1 r=1 j=0.01 gear={gear}"
    )
    at = {"omega(a)": 2.0, "omega(b)": 7.0}
    rotor = 0.01 * (2.0 + gear * 7.0)
    assert momentum(m, "angle(a)", at) == pytest.approx(0.5 * 2.0 + 0.1 * 9.0 + rotor)
    assert momentum(m, "angle(b)", at) == pytest.approx(0.1 * 9.0 + gear * rotor)


@pytest.mark.parametrize("order", ["sat wheel", "wheel sat"])
def test_stator_is_on_a_whichever_way_the_tree_runs(order):
    """With B the satellite, the stator rides on the wheel's body: the rotor's j is then in the satellite."""
    m = machine(
        f"BODY sat m=4 j=0.05\nBODY wheel m=0.1 j=2e-3\nJOINT free 0 sat planar\nJOINT ax {order} pin\n"
        "V1 n 0 0\nMOTOR m n 0 ax kt=1 r=1 j=1e-3 gear=4"
    )
    u, w = 3.0, 10.0
    sign = 1.0 if order == "sat wheel" else -1.0
    stator = u if order == "sat wheel" else u - w
    at = {"omega(free)": u, "omega(ax)": w}
    assert momentum(m, "angle(free)", at) == pytest.approx(
        0.05 * u + 2e-3 * (u + sign * w) + 1e-3 * (stator + 4.0 * w)
    )


def test_gyroscopic_moment_of_a_rotor_on_an_arm_is_missing():
    """A spinning wheel along x on a two-axis platform, as a body with Jxx alone and as j=: equal momenta and forces."""
    cards = (
        "BODY yoke m=1 j=(1,1,1)\nBODY plate m=1 j=(0.3,0.2,0.2)\nBODY wheel m=0.1 j=({jx},1e-3,1e-3)\n"
        "JOINT turn 0 yoke pin axis=(0,0,1)\nJOINT tilt yoke plate pin axis=(0,1,0)\nJOINT spin plate wheel pin axis=(1,0,0)\n"
        "V1 n 0 0\nMOTOR m n 0 spin kt=1 r=1 {motor}"
    )
    body = machine(cards.format(jx="2e-3", motor=""))
    inside = machine(cards.format(jx="0", motor="j=2e-3"))
    at = {
        "omega(turn)": 2.0,
        "omega(tilt)": -1.5,
        "omega(spin)": 50.0,
        "angle(tilt)": 0.4,
        "angle(turn)": 0.3,
    }
    for q in ("angle(turn)", "angle(tilt)", "angle(spin)"):
        assert momentum(inside, q, at) == pytest.approx(momentum(body, q, at))
        assert generalised_force(inside, q, at) == pytest.approx(generalised_force(body, q, at), abs=1e-15)
    # the moment of the wheel alone, H (turn x spin)
    spin = 2e-3 * (50.0 - 2.0 * math.sin(0.4))
    still = machine(cards.format(jx="1e-12", motor=""))
    moment = generalised_force(inside, "angle(tilt)", at) - generalised_force(still, "angle(tilt)", at)
    assert moment == pytest.approx(-spin * 2.0 * math.cos(0.4))


def test_pinion_on_a_turning_arm_forgets_that_the_arm_turns():
    """A rack on an arm: the pinion turns about z with the arm and by gear/radius times the way."""
    m = machine(
        "BODY arm m=1 j=0.5\nBODY rack m=1e-9\nJOINT a 0 arm pin\nJOINT s arm rack slide axis=(1,0)\n"
        "V1 n 0 0\nMOTOR m n 0 s kt=1 r=1 j=0.01 gear=3 radius=0.02"
    )
    at = {"omega(a)": 2.0, "vel(s)": 0.1}
    rotor = 0.01 * (2.0 + 3.0 * 0.1 / 0.02)
    assert momentum(m, "angle(a)", at) == pytest.approx(0.5 * 2.0 + rotor)
    assert momentum(m, "pos(s)", at) == pytest.approx(rotor * 3.0 / 0.02, rel=1e-6)


def test_coil_on_a_cart_is_left_behind_by_the_cart():
    """j= on a slide without radius is a mass: 0.2 kg with gear 1 moves as the plunger does."""
    cards = (
        "BODY cart m=2\nBODY plunger m={m}\nJOINT c 0 cart slide axis=(1,0)\nJOINT s cart plunger slide axis=(1,0)\n"
        "V1 n 0 0\nMOTOR m n 0 s kt=1 r=1 {motor}"
    )
    body, inside = machine(cards.format(m=0.7, motor="")), machine(cards.format(m=0.5, motor="j=0.2"))
    at = {"vel(c)": 2.0, "vel(s)": -0.3}
    for q in ("pos(c)", "pos(s)"):
        assert momentum(inside, q, at) == pytest.approx(momentum(body, q, at))


def test_pinion_whose_axis_nobody_knows_is_refused():
    problem = only_error(
        "BODY arm m=1 j=(1,1,1)\nBODY rack m=1 j=(1,1,1)\nJOINT a 0 arm pin axis=(1,0,0)\nJOINT s arm rack slide axis=(0,0,1)\n"
        "V1 n 0 0\nMOTOR m n 0 s kt=1 r=1 j=0.01 radius=0.02"
    )
    assert problem.code == "E240" and "rides on arm" in problem.message
