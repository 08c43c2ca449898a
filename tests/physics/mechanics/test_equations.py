"""Momenta and forces against formulas written by hand."""

import math

import pytest
from machines import generalised_force, machine, momentum, reads

G = 9.81


def test_pendulum():
    """p = (m l^2/3) w, dL/dq = -m g l/2 sin(q), hanging at q = 0."""
    m = machine(".gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin zero=-90deg")
    at = {"angle(hinge)": 0.4, "omega(hinge)": 1.7}
    assert momentum(m, "angle(hinge)", at) == pytest.approx(0.2 * 0.09 / 3 * 1.7, rel=1e-13)
    assert generalised_force(m, "angle(hinge)", at) == pytest.approx(
        -0.2 * G * 0.15 * math.sin(0.4), rel=1e-12
    )
    assert reads(m, "energy", at=at) == pytest.approx(0.5 * 0.006 * 1.7**2 - 0.2 * G * 0.15 * math.cos(0.4))


@pytest.mark.parametrize("q1, q2", [(0.3, -0.8), (-1.1, 2.0)])
def test_double_pendulum_mass_matrix(q1, q2):
    """Point masses at the ends, second angle relative: M and gravity of the textbook."""
    m1, m2, l1, l2 = 1.5, 0.7, 0.9, 0.4
    m = machine(
        f".gravity 9.81\nBODY u m={m1} com=({l1},0)\nBODY v m={m2} com=({l2},0)\n"
        f"JOINT a 0 u pin zero=-90deg\nJOINT b u({l1},0) v pin"
    )
    c = math.cos(q2)
    m22 = m2 * l2**2
    m12 = m22 + m2 * l1 * l2 * c
    m11 = (m1 + m2) * l1**2 + m22 + 2 * m2 * l1 * l2 * c
    at = {"angle(a)": q1, "angle(b)": q2}
    assert momentum(m, "angle(a)", {**at, "omega(a)": 1.0}) == pytest.approx(m11, rel=1e-12)
    assert momentum(m, "angle(a)", {**at, "omega(b)": 1.0}) == pytest.approx(m12, rel=1e-12)
    assert momentum(m, "angle(b)", {**at, "omega(a)": 1.0}) == pytest.approx(m12, rel=1e-12)
    assert momentum(m, "angle(b)", {**at, "omega(b)": 1.0}) == pytest.approx(m22, rel=1e-12)
    w1, w2 = 2.0, -1.5
    speeds = {**at, "omega(a)": w1, "omega(b)": w2}
    weight = -m2 * G * l2 * math.sin(q1 + q2)
    assert generalised_force(m, "angle(a)", speeds) == pytest.approx(
        -(m1 + m2) * G * l1 * math.sin(q1) + weight, rel=1e-12
    )
    # dT/dq2 = -m2 l1 l2 sin(q2) w1 (w1 + w2)
    assert generalised_force(m, "angle(b)", speeds) == pytest.approx(
        weight - m2 * l1 * l2 * math.sin(q2) * w1 * (w1 + w2), rel=1e-12
    )


def test_cart_and_pole():
    """Box on a slide, rod on a pin: the classical coupling m l cos(q)."""
    m = machine(
        ".gravity 9.81\nBODY cart shape=box(0.2,0.1) m=0.5\nBODY pole shape=rod(0.6) m=0.2\n"
        "JOINT rail 0 cart slide axis=(1,0)\nJOINT hinge cart pole pin zero=90deg"
    )
    at = {"angle(hinge)": 0.3, "vel(rail)": 1.0, "omega(hinge)": 2.0}
    assert momentum(m, "pos(rail)", at) == pytest.approx(0.7 * 1.0 - 0.2 * 0.3 * math.cos(0.3) * 2.0)
    assert generalised_force(m, "angle(hinge)", {"angle(hinge)": 0.3}) == pytest.approx(
        0.2 * G * 0.3 * math.sin(0.3)
    )


@pytest.mark.parametrize(
    "shape, inertia", [("disc(0.2)", 0.5 * 0.04), ("box(0.3,0.4)", 0.25 / 12), ("rod(0.6)", 0.36 / 12)]
)
def test_inertia_of_shapes(shape, inertia):
    m = machine(f"BODY b shape={shape} m=3 x=0 y=0")
    centre = 0.3 if shape.startswith("rod") else 0.0
    at = {"omega(b)": 1.0}
    assert momentum(m, "angle(b)", at) == pytest.approx(3 * (inertia + centre**2))


def test_given_inertia_wins_over_the_shape():
    m = machine("BODY b shape=disc(0.2) m=3 j=7")
    assert momentum(m, "angle(b)", {"omega(b)": 1.0}) == pytest.approx(7.0)


def test_a_joint_written_the_other_way_round_turns_the_other_way():
    one = machine(".gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT h 0 arm pin")
    two = machine(".gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT h arm 0 pin")
    a, b = {"angle(h)": 0.4}, {"angle(h)": -0.4}
    assert generalised_force(two, "angle(h)", b) == pytest.approx(-generalised_force(one, "angle(h)", a))
    assert reads(two, "x", "arm.com", at=b) == pytest.approx(reads(one, "x", "arm.com", at=a))
    assert reads(two, "y", "arm.com", at=b) == pytest.approx(reads(one, "y", "arm.com", at=a))


def test_planar_joint_written_the_other_way_round():
    """B against A in the frame of A, though B is ground."""
    m = machine("BODY puck m=1 j=1\nJOINT p puck 0 planar")
    at = {"x(p)": 0.3, "y(p)": -0.2, "angle(p)": 0.5}
    c, s = math.cos(0.5), math.sin(0.5)
    assert reads(m, "angle", "puck", at=at) == pytest.approx(-0.5)
    # ground's origin, seen from the puck, is at (0.3, -0.2)
    x, y = reads(m, "x", "puck", at=at), reads(m, "y", "puck", at=at)
    assert (x * c - y * s, x * s + y * c) == pytest.approx((-0.3, 0.2))


def test_gyroscopic_terms_of_a_spinning_disc():
    """A disc spins about its own x on an arm that turns about z: p of the arm, and no force on the spin."""
    m = machine(
        "BODY arm m=1 j=(1,1,1)\nBODY disc m=2 j=(0.3,0.2,0.2)\n"
        "JOINT turn 0 arm pin axis=(0,0,1)\nJOINT spin arm(0.5,0) disc pin axis=(1,0,0)"
    )
    at = {"omega(turn)": 2.0, "omega(spin)": 5.0, "angle(spin)": 0.7}
    assert momentum(m, "angle(spin)", at) == pytest.approx(0.3 * 5.0)
    assert momentum(m, "angle(turn)", at) == pytest.approx((1 + 0.2 + 2 * 0.25) * 2.0)
    assert generalised_force(m, "angle(spin)", at) == pytest.approx(0.0, abs=1e-15)
