"""Reading the machine by name."""

import math

import pytest
from machines import machine, problems, reads

ARM = ".gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nPOINT arm.tip 0.3 0\n"
ARM += "JOINT hinge 0(1,2) arm pin zero=-90deg\n"
SLED = "BODY sled m=2\nJOINT rail 0 sled slide axis=(3,4) zero=0.5\n"


def test_joint_and_body_angles():
    m = machine(ARM)
    at = {"angle(hinge)": 0.4, "omega(hinge)": 2.0}
    assert reads(m, "angle", "hinge", at=at) == pytest.approx(0.4)
    assert reads(m, "angle", "arm", at=at) == pytest.approx(0.4 - math.pi / 2)
    assert reads(m, "angle", "arm", "0", at=at) == pytest.approx(0.4 - math.pi / 2)
    assert reads(m, "omega", "arm", at=at) == pytest.approx(2.0)


@pytest.mark.parametrize("point", ["arm.tip", ("arm", 0.3, 0)])
def test_points(point):
    m = machine(ARM)
    at = {"angle(hinge)": 0.4, "omega(hinge)": 2.0}
    assert reads(m, "x", point, at=at) == pytest.approx(1 + 0.3 * math.sin(0.4))
    assert reads(m, "y", point, at=at) == pytest.approx(2 - 0.3 * math.cos(0.4))
    assert reads(m, "z", point, at=at) == 0.0
    assert reads(m, "vx", point, at=at) == pytest.approx(0.6 * math.cos(0.4))
    assert reads(m, "vy", point, at=at) == pytest.approx(0.6 * math.sin(0.4))


def test_centre_of_mass_is_a_point():
    m = machine(ARM)
    assert reads(m, "y", "arm.com") == pytest.approx(2 - 0.15)


def test_slide_runs_along_its_axis_from_zero():
    m = machine(SLED)
    at = {"pos(rail)": 1.0, "vel(rail)": 2.0}
    assert reads(m, "x", "sled", at=at) == pytest.approx(1.5 * 0.6)
    assert reads(m, "y", "sled", at=at) == pytest.approx(1.5 * 0.8)
    assert reads(m, "vel", "rail", at=at) == pytest.approx(2.0)


def test_energies():
    m = machine(ARM)
    at = {"angle(hinge)": 0.0, "omega(hinge)": 2.0}
    assert reads(m, "ke", "arm", at=at) == pytest.approx(0.5 * 0.2 * 0.09 / 3 * 4)
    assert reads(m, "pe", at=at) == pytest.approx(0.2 * 9.81 * 1.85)


@pytest.mark.parametrize(
    "call, code, hint",
    [
        ("pos(hinge)", "E249", "angle(hinge)"),
        ("acc(hinge)", "E249", "alpha(hinge)"),
        ("angle(rail)", "E249", "pos(rail)"),
        ("vel(rial)", "E250", "vel(rail)"),
        ("pos(arm)", "E249", "x(arm)"),
        ("torque(hinge)", "E249", "fx(hinge)"),
        ("force(s1)", "E249", "torque(s1)"),
        ("gap(s1)", "E249", "torque"),
        ("x(leg)", "E250", None),
        ("x(arm(1))", "E246", None),
        ("mz(arm)", "E249", None),
    ],
)
def test_misuse_is_explained(call, code, hint):
    found = [
        d
        for d in problems(ARM + SLED + f"SPRING s1 hinge k=1\nB1 out 0 V={{{call}}}\nR1 out 0 1")
        if d.severity == "error"
    ]
    assert [d.code for d in found] == [code], found
    if hint:
        assert hint in (found[0].hint or "")


def test_a_node_wins_where_names_are_shared():
    """v(m1) is a node's voltage when there is a node m1, else the motor's."""
    motor = "BODY r m=1 j=1\nJOINT j 0 r pin\nMOTOR m1 a 0 j kt=1 r=1\nV1 a 0 3\n"
    assert reads(machine(motor), "v", "m1", at={"a": 3.0}) == pytest.approx(3.0)
    assert reads(
        machine(motor + "R1 m1 0 1\nV2 m1 0 7"), "v", "m1", at={"a": 3.0, "m1": 7.0}
    ) == pytest.approx(7.0)


def test_note_when_masses_hang_on_nothing():
    codes = [d.code for d in problems("BODY arm shape=rod(1) m=1\nJOINT h 0 arm pin")]
    assert codes == ["N230"]
    # a rotor on its axis and a horizontal slide do not care
    assert problems("BODY rotor m=1 j=1\nJOINT h 0 rotor pin\nBODY sled m=1\nJOINT r 0 sled slide") == []
