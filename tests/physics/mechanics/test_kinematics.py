"""Frames and rotations against scipy's, and what folds on the way."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

from emsim._engine import Builder
from emsim.assemble.tree import Edge, plan
from emsim.cards.kinematics import Frame, Moving, Rotation, ground, perpendicular

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
SKEW = (0.6, 0.0, 0.8)


def numbers(b, rows, x=()):
    return np.array([b.eval([b.const(0.0) + e for e in row], list(x), 0.0) for row in rows])


@pytest.mark.parametrize("axes", [(Z,), (X, Y), (Z, X, Z), (SKEW, Y, X, SKEW)])
def test_a_sequence_of_turns(axes):
    b = Builder()
    angles = [0.3 + 0.4 * k for k in range(len(axes))]
    r, expected = Rotation(b), Turn.identity()
    for k, (axis, angle) in enumerate(zip(axes, angles, strict=True)):
        r = r.then(axis, b.x(b.unknown(f"q{k}", "coordinate", "rad")))
        expected = expected * Turn.from_rotvec(np.array(axis) * angle)
    assert numbers(b, r.matrix(), angles) == pytest.approx(expected.as_matrix(), abs=1e-14)


def test_a_turn_about_a_world_axis_comes_first():
    b = Builder()
    r = Rotation(b).then(X, 0.3).before(Y, 0.7)
    expected = Turn.from_rotvec([0, 0.7, 0]) * Turn.from_rotvec([0.3, 0, 0])
    assert numbers(b, r.matrix()) == pytest.approx(expected.as_matrix(), abs=1e-14)


def test_turns_about_one_axis_merge_both_ways_round():
    b = Builder()
    q = b.x(b.unknown("q", "coordinate", "rad"))
    r = Rotation(b).then(Z, q).then((-0.0, -0.0, -1.0), q)
    assert r.about_z() is not None and b.eval([b.const(0.0) + r.about_z()], [0.4], 0.0) == [0.0]
    assert Rotation(b).then(Z, q).then(X, q).about_z() is None


def test_full_turns_are_counted():
    b = Builder()
    q = b.x(b.unknown("q", "coordinate", "rad"))
    turned = Rotation(b).then(Z, q).since(Rotation(b).then(Z, 1.0), Z)
    assert b.eval([turned], [20.0], 0.0)[0] == pytest.approx(19.0)


def test_right_angles_are_exact():
    b = Builder()
    matrix = Rotation(b).then(X, math.pi / 2).matrix()
    assert matrix == [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]


@pytest.mark.parametrize("axis", [X, Y, Z, SKEW, (0.48, 0.6, 0.64), (0.0, -1.0, 0.0)])
def test_perpendicular_vectors_make_a_right_handed_frame(axis):
    e1, e2 = perpendicular(axis)
    assert np.cross(e1, e2) == pytest.approx(axis, abs=1e-15)
    assert np.dot(e1, axis) == pytest.approx(0.0, abs=1e-15)


def test_velocities_are_derivatives_of_positions():
    """A slide on a turning arm that turns about a skew axis: dx/dt by the chain rule."""
    b = Builder()
    q = [b.x(b.unknown(f"q{k}", "coordinate", "")) for k in range(3)]
    u = [b.x(b.unknown(f"u{k}", "speed", "")) for k in range(3)]
    moving = Moving(ground(b), (0.1, 0.2, 0.3))
    moving.turn(SKEW, q[0], u[0])
    moving.slide(Y, q[1], u[1])
    moving.turn(X, q[2], u[2])
    frame: Frame = moving.frame("b", (0.0, 0.1, 0.0))
    point = frame.point((0.3, -0.4, 0.5))
    at = [0.3, 0.5, -0.7, 1.1, -0.6, 2.0]
    rates = b.tangent(point.pos, list(zip(q, u, strict=True)))
    assert b.eval(point.vel, at, 0.0) == pytest.approx(b.eval(rates, at, 0.0), abs=1e-14)
    spin = np.array(b.eval(frame.spin(), at, 0.0))
    world = np.array(b.eval(frame.omega, at, 0.0))
    assert numbers(b, frame.rot.matrix(), at) @ spin == pytest.approx(world, abs=1e-14)


def test_tree_and_loops():
    """Two loops that share a side, and an island."""
    edges = [Edge("a", "0", "p", False), Edge("b", "p", "q", False), Edge("c", "q", "0", False),
             Edge("d", "r", "q", False), Edge("e", "r", "0", False), Edge("f", "s", "t", False)]  # fmt: skip
    found = plan(["p", "q", "r", "s", "t"], set(), edges)
    assert found.cut == ["c", "e"] and found.roots == ["s"]
    assert found.loop("q", "0") == ["b", "a"]
    assert found.loop("r", "0") == ["d", "b", "a"]
    assert {(s.joint, s.parent, s.child, s.backward) for s in found.steps} == {
        ("a", "0", "p", False), ("b", "p", "q", False), ("d", "q", "r", True), ("f", "s", "t", False),
    }  # fmt: skip


def test_a_chosen_cut_moves_the_loop():
    edges = [Edge("a", "0", "p", True), Edge("b", "p", "q", False), Edge("c", "q", "0", False)]
    found = plan(["p", "q"], set(), edges)
    assert found.cut == ["a"] and found.loop("0", "p") == ["c", "b"]
