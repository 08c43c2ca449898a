"""FRICTION and STOP on joints with several coordinates: ball, universal, cylinder, planar; one of them or a vector of speeds."""

from __future__ import annotations

import math

import numpy as np
import pytest
from machines import problems
from scipy.integrate import solve_ivp
from support import deck, with_options

import emsim
from emsim import pipeline

G = 9.81
FORMULATIONS = ["joint", "absolute"]


def run(deck, formulation="joint", reltol=1e-6, more=""):
    text = f"a joint\n{deck}\n.options formulation={formulation} reltol={reltol}\n{more}\n.end\n"
    return pipeline.run(text, energy=True)


def codes(r):
    return [d.code for d in r.diagnostics]


# friction against a vector ----------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("reltol", [1e-3, 1e-6, 1e-9])
def test_a_spin_on_a_ball_joint_ends_at_j_w_over_fc(formulation, reltol):
    """A body whose inertia is alike about all axes keeps its axis: |w| = w0 - fc t/J, and it rests from then on."""
    w = np.array([1.0, 2.0, -2.0])
    r = run(
        """BODY b m=1 j=(0.1,0.1,0.1)
JOINT k 0 b ball ic=(0,0,0,1,2,-2)
FRICTION f k fc=0.2
.tran 10m 2
.print tran wx(k) wy(k) wz(k) torque(f) torque(f,1) slip(f) mode(f)""",
        formulation,
        reltol,
    )
    t = np.asarray(r["time"])
    speed = np.maximum(3.0 - 2.0 * t, 0.0)
    for word, part in zip(("wx(k)", "wy(k)", "wz(k)"), w / 3.0, strict=True):
        np.testing.assert_allclose(r[word], part * speed, atol=max(3e-8, 1e-2 * reltol))
    np.testing.assert_allclose(r["slip(f)"], speed, atol=max(3e-8, 1e-2 * reltol))
    np.testing.assert_allclose(np.asarray(r["torque(f)"])[t < 1.49], 0.2, rtol=1e-9)
    np.testing.assert_allclose(np.asarray(r["torque(f,1)"])[t < 1.49], -0.2 / 3.0, rtol=1e-6)
    assert np.all(np.asarray(r["mode(f)"])[t > 1.51] == 0.0)
    assert np.all(np.asarray(r["torque(f)"])[t > 1.51] < 1e-9)
    assert r.energy.share < max(1e-7, 1e-3 * reltol)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_pendulum_on_a_ball_joint_swings_as_one_on_a_pin(formulation):
    """In a plane both are one machine: the same turns, each lower by what friction takes, the same rest away from the bottom."""
    arm = "BODY arm m=1 j=(0.12,0.01,0.1) com=(0,-0.4,0)"
    more = """FRICTION f h fc=0.3 fs=0.4
.gravity 0 -9.81 0
.tran 10m 6"""
    pin = run(f"{arm}\nJOINT h 0 arm pin axis=(0,0,1) ic=1.2\n{more}\n.print tran angle(h) mode(f)")
    ball = run(f"{arm}\nJOINT h 0 arm ball ic=(0,0,1.2)\n{more}\n.print tran twist(h) mode(f)", formulation)
    t = np.linspace(0.0, 6.0, 601)
    np.testing.assert_allclose(
        np.interp(t, ball["time"], ball["twist(h)"]), np.interp(t, pin["time"], pin["angle(h)"]), atol=2e-4
    )
    assert abs(ball["twist(h)"][-1] - pin["angle(h)"][-1]) < 1e-5
    assert ball["mode(f)"][-1] == 0.0
    assert ball.energy.share < 1e-6


def test_a_small_pendulum_loses_the_same_angle_each_swing():
    """J a'' = -m g l a - fc sgn a': from turn to turn |a| falls by 2 fc/(m g l), in whatever plane it swings."""
    stiff = 0.5 * G * 0.02
    across = 0.02 / math.sqrt(2.0)
    r = run(
        f"""BODY arm m=0.5 j=(0.01,0.01,0.01) com=(0,0,-0.02)
JOINT h 0 arm ball axis=(0,0,1) ic=({across},{across},0)
FRICTION f h fc={{{stiff}*1m}}
.gravity 0 0 -9.81
.tran 2m 8
.print tran swing(h)""",
        reltol=1e-9,
    )
    t, s = np.asarray(r["time"]), np.asarray(r["swing(h)"])
    tops = [s[0]] + [s[k] for k in range(1, len(s) - 1) if s[k - 1] < s[k] >= s[k + 1] and s[k] > 2e-3]
    assert len(tops) >= 8 and t[-1] > 7.9
    np.testing.assert_allclose(-np.diff(tops[:8]), 2e-3, rtol=3e-3)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_top_with_coulomb_friction_by_scipy(formulation):
    """Euler's equations with a torque fc against w, gravity, beside an own integration while it slides."""
    inertia, mass, far, fc = np.array([0.05, 0.06, 0.02]), 1.2, 0.1, 0.15
    own = inertia + mass * far**2 * np.array([1.0, 1.0, 0.0])
    w0 = np.array([0.4, 1.0, 30.0])

    def slope(_, y):
        e, w = y[:4], y[4:]
        e0, v = e[0], e[1:]
        down = np.array([0.0, 0.0, -mass * G])
        s = 2.0 / (e @ e)
        # R^T down
        local = down + s * (-e0 * np.cross(v, down) + np.cross(v, np.cross(v, down)))
        torque = np.cross([0.0, 0.0, far], local) - fc * w / np.linalg.norm(w)
        rate = (torque - np.cross(w, own * w)) / own
        return [-0.5 * (v @ w), *(0.5 * (e0 * w + np.cross(v, w))), *rate]

    start = [math.cos(0.2), math.sin(0.2), 0.0, 0.0, *w0]
    t = np.linspace(0.0, 1.5, 31)
    known = solve_ivp(slope, (0.0, 1.5), start, method="DOP853", rtol=1e-11, atol=1e-12, t_eval=t).y
    r = run(
        f"""BODY top m={mass} j=({inertia[0]},{inertia[1]},{inertia[2]}) com=(0,0,{far})
JOINT h 0 top ball ic=(0.4,0,0,{w0[0]},{w0[1]},{w0[2]})
FRICTION f h fc={fc}
.gravity 0 0 -9.81
.tran 50m 1.5
.print tran wx(h) wy(h) wz(h) z(top(0,0,1)) power(f)""",
        formulation,
        1e-9,
    )
    for k, word in enumerate(("wx(h)", "wy(h)", "wz(h)")):
        np.testing.assert_allclose(np.interp(t, r["time"], r[word]), known[4 + k], atol=2e-5)
    assert r.energy.share < 1e-7


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_ball_joint_holds_up_to_fs_whatever_the_direction(formulation):
    """A load rises by t on y and z at 1 m: torque (0, -t, t). It holds until |torque| = fs, at t = fs/sqrt(2)."""
    r = run(
        """BODY b m=1 j=(1,1,1)
JOINT k 0 b ball
FRICTION f k fc=0.5 fs=1
FORCE y b(1,0,0) dir=(0,1,0) {time}
FORCE z b(1,0,0) dir=(0,0,1) {time}
.tran 5m 1
.print tran slip(f) torque(f) mode(f) torque(f,2)""",
        formulation,
        1e-9,
    )
    t, slip = np.asarray(r["time"]), np.asarray(r["slip(f)"])
    at = math.sqrt(0.5)
    assert np.max(np.abs(slip[t < at - 1e-6])) < 1e-12
    np.testing.assert_allclose(
        np.asarray(r["torque(f)"])[t < at - 1e-6], math.sqrt(2.0) * t[t < at - 1e-6], atol=1e-9
    )
    first = t[np.asarray(r["mode(f)"]) != 0.0][0]
    assert abs(first - at) < 1e-6
    after = (t > at) & (t < at + 0.05)
    # |w|' = sqrt(2) t - fc, nothing else turns it yet
    known = math.sqrt(0.5) * (t**2 - at**2) - 0.5 * (t - at)
    np.testing.assert_allclose(slip[after], known[after], atol=2e-5)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_plate_on_a_table_slides_straight(formulation):
    """p.slide of a planar joint: friction of one size against the direction of the velocity, p.angle another one."""
    r = run(
        """BODY p m=2 j=(1,1,0.1)
JOINT k 0 p planar ic=(0,0,0,3,4,2)
JOINT e 0 q ball
BODY q m=1 j=(1,1,1)
FRICTION f k.slide fc=4
FRICTION g k.angle fc=0.1
.tran 10m 4
.print tran x(k) y(k) angle(k) force(f) torque(g) slip(f)""",
        formulation,
    )
    t = np.asarray(r["time"])
    s = np.minimum(t, 2.5)
    way = 5.0 * s - s * s
    np.testing.assert_allclose(r["x(k)"], 0.6 * way, atol=1e-7)
    np.testing.assert_allclose(r["y(k)"], 0.8 * way, atol=1e-7)
    s = np.minimum(t, 2.0)
    np.testing.assert_allclose(r["angle(k)"], 2.0 * s - 0.5 * s * s, atol=1e-7)
    assert r.energy.share < 1e-7


def test_smooth_friction_of_a_vector_and_viscous():
    """model=smooth is fc tanh(|w|/vs) against w; b= takes b w: both along the axis of the spin."""
    deck = """BODY b m=1 j=(0.1,0.1,0.1)
JOINT k 0 b ball ic=(0,0,0,2,-1,2)
FRICTION f k fc=0.2 vs=0.5 b=0.05 model=smooth
.tran 10m 1
.print tran wx(k) slip(f) torque(f) power(f)"""
    r = run(deck, reltol=1e-9)
    known = solve_ivp(
        lambda _, w: -(0.2 * np.tanh(w / 0.5) + 0.05 * w) / 0.1,
        (0, 1),
        [3.0],
        rtol=1e-11,
        atol=1e-12,
        dense_output=True,
    )
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["slip(f)"], known.sol(t)[0], atol=1e-7)
    np.testing.assert_allclose(r["wx(k)"], 2.0 / 3.0 * known.sol(t)[0], atol=1e-7)
    assert r.energy.share < 1e-7


def test_stribecks_curve_in_the_length_of_the_vector():
    """fs falls to fc with exp(-(|w|/vs)^2)."""
    deck = """BODY b m=1 j=(0.1,0.1,0.1)
JOINT k 0 b ball ic=(0,0,0,2,-1,2)
FRICTION f k fc=0.1 fs=0.3 vs=1
.tran 10m 3
.print tran slip(f) mode(f)"""
    r = run(deck, reltol=1e-9)
    known = solve_ivp(
        lambda _, w: [-(0.1 + 0.2 * math.exp(-w[0] * w[0])) / 0.1], (0, 3), [3.0], rtol=1e-11, atol=1e-12, dense_output=True,
        events=lambda _, w: w[0],
    )  # fmt: skip
    end = known.t_events[0][0]
    t = np.asarray(r["time"])
    moving = t < end - 1e-3
    np.testing.assert_allclose(np.asarray(r["slip(f)"])[moving], known.sol(t[moving])[0], atol=1e-6)
    assert np.all(np.asarray(r["mode(f)"])[t > end + 1e-3] == 0.0)


def test_where_it_rests_by_op_static():
    """A pendulum on a rough ball joint is held where it stands, up to m g l sin = fs; beyond it slides to where fc holds it."""
    deck = """BODY arm m=1 j=(0.1,0.1,0.1) com=(0,0,-0.5)
JOINT h 0 arm ball ic=({angle},0,0)
FRICTION f h fc=1
.gravity 0 0 -9.81
.op static
.print op swing(h) torque(f)"""
    held = run(deck.replace("{angle}", "0.1"))
    assert abs(held["swing(h)"][0] - 0.1) < 1e-6
    np.testing.assert_allclose(held["torque(f)"][0], 0.5 * G * math.sin(0.1), rtol=1e-4)
    slid = run(deck.replace("{angle}", "0.8"))
    np.testing.assert_allclose(slid["swing(h)"][0], math.asin(1.0 / (0.5 * G)), rtol=1e-3)


# one coordinate of several ----------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_rod_in_a_sleeve_slides_and_turns_with_friction_and_stops_of_their_own(formulation):
    r = run(
        """BODY rod m=2 j=(0.02,0.02,0.02)
JOINT c 0 rod cylinder axis=(1,2,2) ic=(0,0,2,3)
FRICTION f c.pos fc=1
FRICTION g c.angle fc=0.01
STOP s c.pos max=1.75 e=0.5
.tran 10m 7
.print tran pos(c) vel(c) angle(c) omega(c) force(f) torque(g) hits(s)""",
        formulation,
    )
    t = np.asarray(r["time"])
    # 2 t - t^2/4 = 1.75 at t = 1, with 1.5 m/s; back at half of it, which friction stops within 1.5 s
    back = np.minimum(t, 2.5) - 1.0
    known = np.where(t < 1.0, 2.0 * t - 0.25 * t * t, 1.75 - 0.75 * back + 0.25 * back * back)
    np.testing.assert_allclose(r["pos(c)"], known, atol=1e-7)
    s = np.minimum(t, 6.0)
    np.testing.assert_allclose(r["angle(c)"], 3.0 * s - 0.25 * s * s, atol=1e-6)
    assert r["hits(s)"][-1] == 1.0
    assert r.energy.share < 1e-7


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_universal_joint_between_stops(formulation):
    """About its second axis alone it is a pin between two ends."""
    r = run(
        """BODY b m=1 j=(0.1,0.1,0.1)
JOINT u 0 b universal axis=(1,0,0) axis2=(0,1,0) ic=(0,0,0,2)
STOP s u.angle2 min=-30deg max=30deg e=0.5
FRICTION g u.angle1 fc=0.1
.tran 10m 1.5
.print tran angle1(u) angle2(u) omega2(u) hits(s) torque(s)""",
        formulation,
    )
    far = math.pi / 6.0
    first, second = far / 2.0, far / 2.0 + 2.0 * far / 1.0
    t = np.asarray(r["time"])
    known = np.where(t < first, 2.0 * t, np.where(t < second, far - (t - first), -far + 0.5 * (t - second)))
    np.testing.assert_allclose(r["angle2(u)"], known, atol=1e-6)
    np.testing.assert_allclose(r["angle1(u)"], 0.0, atol=1e-9)
    assert r["hits(s)"][-1] == 2.0


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_friction_of_a_cross_by_scipy(formulation):
    """Both turns of a universal with friction of their own, an anisotropic body, before either of them stops."""
    j = np.array([0.3, 0.2, 0.5])

    def slope(_, y):
        q2, u = y[1], y[2:]
        c, s = math.cos(q2), math.sin(q2)
        # L = (J1 c^2 + J3 s^2) u1^2/2 + J2 u2^2/2
        m1, dm1 = j[0] * c * c + j[2] * s * s, 2.0 * (j[2] - j[0]) * s * c
        return [
            *u,
            (-0.05 * np.sign(u[0]) - dm1 * u[1] * u[0]) / m1,
            (0.5 * dm1 * u[0] ** 2 - 0.03 * np.sign(u[1])) / j[1],
        ]

    known = solve_ivp(slope, (0, 1), [0.1, 0.3, 2.0, 3.0], rtol=1e-11, atol=1e-12, dense_output=True)
    r = run(
        """BODY b m=1 j=(0.3,0.2,0.5)
JOINT u 0 b universal axis=(1,0,0) axis2=(0,1,0) ic=(0.1,0.3,2,3)
FRICTION f u.angle1 fc=0.05
FRICTION g u.angle2 fc=0.03
.tran 10m 1
.print tran angle1(u) angle2(u) omega1(u) omega2(u)""",
        formulation,
        1e-9,
    )
    for k, word in enumerate(("angle1(u)", "angle2(u)", "omega1(u)", "omega2(u)")):
        np.testing.assert_allclose(r[word], known.sol(np.asarray(r["time"]))[k], atol=1e-6)


def test_coordinates_of_a_joint_that_closes_a_loop():
    """The same rod by its other joint: a cylinder that is cut rubs and stops as one in the tree."""
    deck = """BODY rod m=2 j=(0.1,0.1,0.02)
JOINT c 0 rod cylinder axis=(0,0,1) ic=(0,0,2,3) {cut}
{other}
FRICTION f c.pos fc=1
STOP s c.angle max=2 e=1
.tran 10m 3
.print tran pos(c) angle(c)"""
    own = run(deck.format(cut="", other="SPRING k c.pos k=0.1"))
    cut = run(deck.format(cut="cut=yes", other="SPRING k c.pos k=0.1\nJOINT free 0 rod free"), reltol=1e-8)
    t = np.linspace(0, 3, 301)
    for word in ("pos(c)", "angle(c)"):
        np.testing.assert_allclose(
            np.interp(t, cut["time"], cut[word]), np.interp(t, own["time"], own[word]), atol=3e-4
        )


# cones ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_swing_cone_in_a_plane_is_a_stop_on_a_pin(formulation):
    body = "BODY arm m=1 j=(0.1,0.12,0.1) com=(0.4,0,0)\n"
    gravity = ".gravity 9.81 0 0\n.tran 10m 3\n"
    pin = run(
        f"{body}JOINT h 0 arm pin axis=(0,0,1) ic=(0.3,3)\nSTOP s h min=-0.7 max=0.7 e=0.6\n{gravity}.print tran omega(h) hits(s)"
    )
    ball = run(
        f"{body}JOINT h 0 arm ball axis=(1,0,0) ic=(0,0,0.3,0,0,3)\nSTOP s h.swing max=0.7 e=0.6\n{gravity}"
        ".print tran wz(h) hits(s) swing(h) impulse(s)",
        formulation,
    )
    assert ball["hits(s)"][-1] == pin["hits(s)"][-1] > 1
    t = np.linspace(0, 3, 301)
    off = np.abs(np.interp(t, ball["time"], ball["wz(h)"]) - np.interp(t, pin["time"], pin["omega(h)"]))
    assert np.median(off) < 1e-5
    assert np.max(ball["swing(h)"]) < 0.7 + 1e-6
    assert ball.energy.share < 1e-6


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_cone_is_smooth_and_round(formulation):
    """A spherical pendulum within an upright cone: with e=1 it keeps its energy."""
    r = run(
        """BODY bob m=1 j=(0.02,0.02,0.02) com=(0,0,-0.5)
JOINT h 0 bob ball axis=(0,0,1) ic=(0.3,0.1,0,4,-1,0)
STOP s h.swing max=40deg e=1
.gravity 0 0 -9.81
.tran 10m 4
.print tran swing(h) hits(s) x(bob(0,0,-0.5)) y(bob(0,0,-0.5)) vx(bob(0,0,-0.5)) vy(bob(0,0,-0.5)) energy()""",
        formulation,
        1e-8,
    )
    assert r["hits(s)"][-1] >= 4
    assert np.max(r["swing(h)"]) <= math.radians(40.0) + 1e-7
    np.testing.assert_allclose(r["energy()"], r["energy()"][0], atol=1e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_swing_and_twist_are_those_of_the_quaternion(formulation):
    """t = 2 atan2(e.a, e0), cos s = Ra.a: for a body that tumbles, and a stop on the twist alone."""
    r = run(
        f"""BODY b m=1 j=(0.1,0.2,0.3)
JOINT k 0 b ball axis=(1,2,2) ic=(0.1,0.2,0.3,1,1.5,-0.7)
STOP s k.twist min=-0.6 max=0.6 e=1
.tran 10m 3
.print tran swing(k) twist(k) hits(s) energy() {"e0(k) e1(k) e2(k) e3(k)" if formulation == "joint" else ""}""",
        formulation,
        1e-8,
    )
    assert np.max(np.abs(r["twist(k)"])) < 0.6 + 1e-7
    assert r["hits(s)"][-1] >= 1
    np.testing.assert_allclose(r["energy()"], r["energy()"][0], rtol=1e-7)
    if formulation == "joint":
        a = np.array([1.0, 2.0, 2.0]) / 3.0
        e = np.array([r[f"e{k}(k)"] for k in range(4)])
        np.testing.assert_allclose(r["twist(k)"], 2.0 * np.arctan2(a @ e[1:], e[0]), atol=1e-9)
        np.testing.assert_allclose(
            np.cos(r["swing(k)"]), 1.0 - 2.0 * ((e[1:] ** 2).sum(0) - (a @ e[1:]) ** 2), atol=1e-9
        )


def test_springs_and_dampers_take_a_coordinate_too():
    """A torsion spring on c.angle: sqrt(k/J); on b.swing the cone is a soft one."""
    r = run(
        """BODY rod m=2 j=(0.1,0.1,0.02)
JOINT c 0 rod cylinder axis=(0,0,1) ic=(0,0.5,0,0)
SPRING k c.angle k=0.5
.tran 10m 3
.print tran angle(c) torque(k)"""
    )
    np.testing.assert_allclose(r["angle(c)"], 0.5 * np.cos(5.0 * np.asarray(r["time"])), atol=1e-5)


# what is refused --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("FRICTION f c fc=1", "name one: c.pos or c.angle"),
        ("STOP f c max=1", "name one: c.pos or c.angle"),
        ("STOP f b max=1", "name one: b.swing or b.twist"),
        ("STOP f c.turn max=1", "name one: c.pos or c.angle"),
        ("FRICTION f p fc=1", "name one: p.x or p.y or p.angle or p.slide"),
        ("STOP f p.slide max=1", "name one: p.x or p.y or p.angle"),
        ("FRICTION f w fc=1", ""),
        ("TORQUE f c.angle tau=1", ""),
    ],
)
def test_what_has_several_coordinates_is_named_by_one(card, said):
    found = problems(
        f"""BODY r m=1 j=(1,1,1)
BODY q m=1 j=(1,1,1)
BODY s m=1 j=(1,1,1)
BODY u m=1 j=(1,1,1)
JOINT c 0 r cylinder
JOINT b 0 q ball
JOINT p 0 s planar
JOINT w r u weld
{card}"""
    )
    d = next(d for d in found if d.code == "E241")
    assert said in (d.hint or "")


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_arm_within_its_cone_comes_to_rest(formulation):
    """The deck: it never leaves cone and range of twist, and hangs where friction holds it."""
    text = deck("mechanical/rough_ball_joint")
    r = emsim.run(with_options(text, f"formulation={formulation} reltol=1e-6"), energy=True)
    assert (
        np.max(r["swing(hip)"]) < math.radians(50.0) + 1e-6 and np.max(np.abs(r["twist(hip)"])) < 1.0 + 1e-6
    )
    assert r["hits(rim)"][-1] >= 1 and r["hits(turn)"][-1] >= 2
    # (but for the rows on either side of the instants in which it stops)
    assert np.sum(np.asarray(r["torque(rub)"]) > 0.1 * (1.0 + 1e-6)) <= 4
    assert abs(r["swing(hip)"][-1] - r.at("swing(hip)", 11.0)) < 1e-9
    assert r.energy.share < 1e-5
