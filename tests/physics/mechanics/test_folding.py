"""The equations are no larger than the scene: what does not move is not computed."""

from machines import machine
from support import deck

import emsim


def chain(n, axis=""):
    text = [".gravity 9.81"]
    for k in range(n):
        text.append(f"BODY b{k} m=1 com=(0.5,0) j=(1m,0.1,0.1)")
        text.append(f"JOINT j{k} {'0' if k == 0 else f'b{k - 1}(1,0)'} b{k} pin{axis if k % 2 else ''}")
    return "\n".join(text)


def test_pendulum_is_a_few_operations():
    assert machine(chain(1)).operations <= 28


def test_planar_chain_grows_linearly():
    ten, twenty = machine(chain(10)).operations, machine(chain(20)).operations
    assert (twenty - ten) / 10 <= 55
    assert twenty < 1200


def test_spatial_arm():
    assert machine(chain(6, " axis=(0,1,0)")).operations <= 1300


def test_velocities_in_space_are_carried_in_the_bodies_axes():
    """A six-joint arm and gimbals: what a graph of velocities in world axes takes is more than twice as much."""
    arm = emsim.check(deck("mechanical/arm6"))["operations"]
    assert arm["values"] <= 560 and arm["with_derivatives"] <= 3800
    gimbals = emsim.check(deck("mechanical/gyroscope_gimbals"))["operations"]
    assert gimbals["values"] <= 60


FOUR_BAR = """.gravity 9.81
BODY  crank   shape=rod(0.10) m=0.10
BODY  coupler shape=rod(0.24) m=0.24
BODY  rocker  shape=rod(0.20) m=0.20
JOINT a     0             crank   pin ic=(0,10)
JOINT b     crank(0.10,0) coupler pin guess=56deg
JOINT d     0(0.22,0)     rocker  pin guess=86deg
JOINT close coupler(0.24,0) rocker(0.20,0) pin"""


def test_out_of_plane_closure_folds_away():
    m = machine(FOUR_BAR)
    assert [row.label for row in m.rows] == ["x", "y"]
    assert m.folded == 3  # z, and two tilts of the axis
    assert m.operations <= 218
    report = m.report()
    assert report["degrees_of_freedom"] == 1 and report["planar"]
    assert report["loops"] == [["b", "a", "d", "close"]]


def test_the_plane_need_not_be_xy():
    """The same four-bar about y, in the x-z plane: as few rows."""
    turned = FOUR_BAR.replace(" pin", " pin axis=(0,-1,0)").replace(".gravity 9.81", ".gravity 0 0 -9.81")
    m = machine(turned)
    assert len(m.rows) == 2 and m.folded == 3
    assert m.operations <= 218


def test_merged_rotations_take_one_sine():
    """Three pins in a row about z: the last angle is a sum, and a weld in between adds nothing."""
    m = machine(
        "BODY a m=1 j=1\nBODY b m=1 j=1\nBODY c m=1 j=1\n"
        "JOINT j 0 a pin\nJOINT k a b weld zero=30deg\nJOINT l b c pin"
    )
    assert m.operations <= 6


def test_rotor_on_its_axis_is_linear():
    m = machine("BODY rotor m=5 j=0.1\nJOINT shaft 0 rotor pin\n.gravity 9.81")
    assert m.operations <= 1


def test_fixed_body_costs_nothing():
    a = machine("BODY post m=5 fixed=yes x=1\nBODY arm m=1 com=(1,0)\nJOINT j post arm pin\n.gravity 9.81")
    b = machine("BODY arm m=1 com=(1,0)\nJOINT j 0(1,0) arm pin\n.gravity 9.81")
    assert a.operations == b.operations
