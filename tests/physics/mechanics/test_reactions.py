"""Reactions: the same forces by multipliers and by virtual motion, statics, and what drives apply."""

import math

import numpy as np
import pytest

import emsim

BODIES = """.gravity 9.81
BODY  crank   shape=rod(0.10) m=0.10
BODY  coupler shape=rod(0.24) m=0.24
BODY  rocker  shape=rod(0.20) m=0.20
"""
READ = "fx(a) fy(a) fx(b) fy(b) fx(d) fy(d) fx(close) fy(close) alpha(a) ax(coupler.com)"


def four_bar(cut):
    where = {"a": "ic=(0,10)", "b": "guess=56deg", "d": "guess=86deg", "close": "guess=28deg"}
    where[cut] += " cut=yes"
    return (
        "four-bar\n"
        + BODIES
        + f"JOINT a 0 crank pin {where['a']}\nJOINT b crank(0.10,0) coupler pin {where['b']}\n"
        f"JOINT d 0(0.22,0) rocker pin {where['d']}\n"
        f"JOINT close coupler(0.24,0) rocker(0.20,0) pin {where['close']}\n"
        f".tran 10m 0.2\n.options reltol=1e-8\n.print tran {READ}\n.end\n"
    )


@pytest.fixture(scope="module")
def reference():
    return emsim.run(four_bar("close"))


@pytest.mark.parametrize("cut", ["a", "b", "d"])
def test_reactions_do_not_depend_on_where_the_loop_is_cut(reference, cut):
    """A cut joint reads its multipliers, a tree joint its virtual motion; both are the pin's force on B."""
    other = emsim.run(four_bar(cut))
    for name in READ.split():
        one, two = reference[name], other[name]
        scale = np.ptp(one)
        # the first point of a time derivative is its one-sided start
        assert (
            np.abs(np.interp(0.15, reference.time, one) - np.interp(0.15, other.time, two)) < 1e-3 * scale
        ), name
        assert one[-1] == pytest.approx(two[-1], abs=1e-5 * scale), name


def test_pin_of_a_resting_arm_carries_its_weight():
    r = emsim.run(
        "at rest\n.gravity 9.81\nBODY arm shape=rod(1) m=2\nJOINT h 0 arm pin zero=-90deg\n"
        ".tran 1m 10m\n.print tran fx(h) fy(h) mz(h)\n.end\n"
    )
    assert r["fy(h)"][-1] == pytest.approx(2 * 9.81)
    assert r["fx(h)"][-1] == pytest.approx(0.0, abs=1e-9)
    assert r["mz(h)"][-1] == pytest.approx(0.0, abs=1e-9)


def test_weld_of_a_beam_carries_force_and_moment():
    """A beam held at its left end on a sled that does not move: m g, and m g l/2 against the weight."""
    r = emsim.run(
        "beam\n.gravity 9.81\nBODY sled m=1\nBODY beam shape=rod(1) m=2\nJOINT s 0 sled slide axis=(1,0)\n"
        "JOINT w sled beam weld\n.tran 1m 10m\n.print tran fy(w) mz(w)\n.end\n"
    )
    assert r["fy(w)"][-1] == pytest.approx(2 * 9.81)
    assert r["mz(w)"][-1] == pytest.approx(2 * 9.81 * 0.5)


def test_whirling_mass_pulls_on_its_pin():
    """m r w^2 towards the axis."""
    r = emsim.run(
        "whirl\nBODY bob m=0.5 com=(0.4,0)\nJOINT h 0 bob pin ic=(0,10)\n"
        ".tran 1m 0.1\n.print tran fx(h) fy(h) angle(h)\n.end\n"
    )
    angle = r["angle(h)"][-1]
    assert r["fx(h)"][-1] == pytest.approx(-0.5 * 0.4 * 100 * math.cos(angle), rel=1e-3)
    assert r["fy(h)"][-1] == pytest.approx(-0.5 * 0.4 * 100 * math.sin(angle), rel=1e-3)


def test_torque_of_a_drive():
    r = emsim.run(
        "drive\nBODY r m=1 j=0.1\nJOINT j 0 r pin damp=0.2\nDRIVE d j q={0.5*sin(6*time)}\n"
        ".tran 1m 1\n.options reltol=1e-7\n.print tran torque(d) power(d)\n.end\n"
    )
    t = r.time[-1]
    torque = -0.1 * 18 * math.sin(6 * t) + 0.2 * 3 * math.cos(6 * t)
    assert r["torque(d)"][-1] == pytest.approx(torque, rel=1e-4)
    assert r["power(d)"][-1] == pytest.approx(torque * 3 * math.cos(6 * t), rel=1e-4)


@pytest.mark.parametrize("first, second", [("j1", "j2"), ("j2", "j1")])
def test_torque_of_a_gear_on_its_first_joint(first, second):
    """j1 a' = T + tau on the driven shaft; the other shaft gets the rest through the ratio."""
    ratio = 10 if first == "j1" else 0.1
    r = emsim.run(
        "gear\nBODY a m=1 j=0.1\nBODY b m=1 j=2\nJOINT j1 0 a pin\nJOINT j2 0 b pin\n"
        f"GEAR g {first} {second} ratio={ratio}\nTORQUE t j1 tau=1\n"
        ".tran 1m 0.1\n.print tran torque(g)\n.end\n"
    )
    alpha2 = 10.0 / (2 + 100 * 0.1)
    expected = 0.1 * 10 * alpha2 - 1.0 if first == "j1" else 2 * alpha2
    assert r["torque(g)"][-1] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
@pytest.mark.parametrize("method", ["radau", "esdirk", "gear", "trap", "trbdf2"])
def test_a_swinging_pendulum_pulls_on_its_pin(method, reltol):
    """alpha = -g sin(angle); m (acceleration) - m g, in every row by the row's own angle and speed."""
    r = emsim.run(
        "pendulum\n.gravity 9.81\nBODY bob m=1 com=(1,0) j=0\nJOINT hinge 0 bob pin zero=-90deg ic=90deg\n"
        f".tran 37m 10\n.options method={method} reltol={reltol:g}\n"
        ".print tran fx(hinge) fy(hinge) alpha(hinge) omega(hinge) angle(hinge)\n.end\n"
    )
    angle, omega, alpha = (np.asarray(r[f"{name}(hinge)"])[1:] for name in ("angle", "omega", "alpha"))
    sin, cos = np.sin(angle), np.cos(angle)
    # what the three short steps of a row leave, at any tolerance; the stages of esdirk are wrong by 3e-2 and 1.5e-3, gear by 2e-2
    limit = 1e-7 * 3 * 9.81
    assert np.abs(alpha + 9.81 * sin).max() <= limit
    assert np.abs(r["fx(hinge)"][1:] - (alpha * cos - omega**2 * sin)).max() <= limit
    assert np.abs(r["fy(hinge)"][1:] - (alpha * sin + omega**2 * cos + 9.81)).max() <= limit


@pytest.mark.parametrize("method", ["radau", "esdirk", "gear", "trap", "trbdf2"])
def test_a_driven_slider_crank_shakes_its_pin(method):
    """A driven machine has steps of any length: multipliers of trbdf2 are wrong by three times the range, of gear by 8e-2."""
    r = emsim.run(
        "slider crank\nBODY crank m=0.5 shape=rod(0.1)\nBODY rod m=1u j=1n\nBODY piston m=1\n"
        "JOINT a 0 crank pin\nJOINT b crank(0.1,0) rod pin\nJOINT s 0 piston slide axis=(1,0)\n"
        "JOINT c rod(0.3,0) piston pin\nDRIVE d a qd=20\nTORQUE f s tau={-5*tanh(vel(s)/10m)}\n.gravity 0\n"
        f".tran 1m 0.5\n.options method={method}\n.print tran fx(c) acc(s)\n.end\n"
    )
    t = np.asarray(r["time"])
    sin, cos = np.sin(20 * t), np.cos(20 * t)
    root = np.sqrt(0.09 - 0.01 * sin**2)
    slope = -0.1 * sin - 0.01 * sin * cos / root  # d/dangle of the piston's place
    bend = -0.1 * cos - 0.01 * (cos**2 - sin**2) / root - 1e-4 * (sin * cos) ** 2 / root**3
    assert np.abs(r["acc(s)"] - 400 * bend).max() < 1e-3 * np.ptp(bend * 400)
    push = 400 * bend + 5 * np.tanh(20 * slope / 10e-3)
    assert np.abs(r["fx(c)"] - push)[np.abs(slope) > 1e-2].max() < 1e-3 * np.ptp(push)


@pytest.mark.parametrize("options", ["", " formulation=absolute"])
@pytest.mark.parametrize(("a", "b"), [("arm", "s"), ("s", "arm")])
def test_a_rotor_on_a_turning_slide_leaves_no_force_across_it(options, a, b):
    """Newton for the slider: R across the slide is m a, along it 0, whatever the motor's rotor carries."""
    r = emsim.run(
        f"slider with a motor on a turning arm\nBODY arm m=1 j=1\nBODY s m=0.2 j=1m\nJOINT h 0 arm pin\n"
        f"DRIVE d h q={{5*time}}\nJOINT r {a} {b} slide axis=(1,0) ic=(0.2,1)\n"
        "MOTOR m a 0 r kt=0.1 r=1 radius=10m j=10u\nR1 a 0 1k\n"
        f".options reltol=1e-8{options}\n.tran 10m 0.2\n"
        ".print tran fx(r) fy(r) ax(s) ay(s) angle(h)\n.end\n"
    )
    fx, fy, ax, ay, angle = (r[k][-1] for k in ("fx(r)", "fy(r)", "ax(s)", "ay(s)", "angle(h)"))
    if a == "s":  # the force on B, from the slider
        fx, fy = -fx, -fy
    across = -ax * math.sin(angle) + ay * math.cos(angle)
    assert abs(across) > 15.0  # 2 w v and the arm's own: the Coriolis force is there
    assert -fx * math.sin(angle) + fy * math.cos(angle) == pytest.approx(0.2 * across, rel=1e-6)
    assert fx * math.cos(angle) + fy * math.sin(angle) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("options", ["", " formulation=absolute"])
def test_gyroscopic_moment_of_a_body_that_a_motor_spins(options):
    """J w W = 1 g m^2 * 100 rad/s * 5 rad/s; the motor's rotor counts along its axis alone."""
    r = emsim.run(
        "spun body on a turning arm\nBODY arm m=1 j=(1,1,1)\nBODY s m=0.2 j=(1m,1m,1m)\n"
        "JOINT h 0 arm pin axis=(0,0,1)\nDRIVE d h q={5*time}\n"
        "JOINT r arm s pin axis=(1,0,0) ic=(0,100)\nMOTOR m a 0 r kt=1m r=1 j=100u gear=3\nR1 a 0 1g\n"
        f".options reltol=1e-8{options}\n.tran 10m 0.2\n.print tran mx(r) my(r)\n.end\n"
    )
    assert np.hypot(r["mx(r)"], r["my(r)"])[-1] == pytest.approx(0.5, rel=1e-6)
