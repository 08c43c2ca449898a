"""Values between points: order, kinks, jumps, and the two writings of one rule."""

from __future__ import annotations

import pickle
from array import array
from bisect import bisect_left, bisect_right

import numpy as np
import pytest

import emsim
from emsim.interpolate import cubic_many

# the rule written out, which the engine's own (engine/src/interpolate.rs) is held to
JUMP = 1e-6


def cubic(x, y, t, corners=()) -> float:
    """Value at t, x[0] <= t <= x[-1]; x ascending, repeated where y jumps; corners ascending."""
    last = len(x) - 1
    k = min(bisect_right(x, t) - 1, last - 1)
    if k < 0 or t == x[k + 1]:
        return y[k + 1]
    width = x[k + 1] - x[k]
    secant = (y[k + 1] - y[k]) / width
    chord = y[k] + secant * (t - x[k])
    a, b = _bend(x, y, k, corners), _bend(x, y, k + 1, corners)
    few = a is None and b is None
    if few:  # what the other sides of two corners tell is better than nothing
        a, b = _bend(x, y, k), _bend(x, y, k + 1)
        if a is None or b is None:
            return chord
    if a is None and b is not None:
        far = _bend(x, y, k + 2, corners)
        few, near, other = far is None, b, b if far is None else far
        c = near + (other - near) * (t - x[k + 2]) / (x[min(k + 3, last)] - x[k])
    elif b is None and a is not None:
        far = _bend(x, y, k - 1, corners)
        few, near, other = far is None, a, a if far is None else far
        c = near + (near - other) * (t - x[k - 1]) / (x[k + 1] - x[max(k - 2, 0)])
    elif a is not None and b is not None:
        near, other = a, b
        c = near + (other - near) * (t - x[k - 1]) / (x[k + 2] - x[k - 1])
    if near * other <= 0:
        return chord
    limit = 3 * min(abs(near), abs(other))
    if few:
        limit = min(limit, abs(secant) / width)
    return chord + max(-limit, min(limit, c)) * (t - x[k]) * (t - x[k + 1])


def _bend(x, y, k, corners=()) -> float | None:
    """The second divided difference about point k; None where there is none."""
    if not 0 < k < len(x) - 1:
        return None
    left, right = x[k] - x[k - 1], x[k + 1] - x[k]
    if left <= JUMP * right or right <= JUMP * left or (corners and _among(corners, x[k])):
        return None
    return ((y[k + 1] - y[k]) / right - (y[k] - y[k - 1]) / left) / (x[k + 1] - x[k - 1])


def _among(corners, t) -> bool:
    k = bisect_left(corners, t)
    return k < len(corners) and corners[k] == t


def both(x, y, query, corners=()):
    """The rule in both writings, which must agree to rounding."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    many = cubic_many(x, y, np.asarray(query, float), corners)
    one = [cubic(array("d", x), array("d", y), float(t), corners) for t in query]
    np.testing.assert_allclose(many, one, rtol=0, atol=1e-13 * max(1.0, abs(y).max()))
    return many


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6, 7, 40])
def test_both_writings_agree_on_random_points(n):
    rng = np.random.default_rng(n)
    x, y = np.sort(rng.random(n)), rng.standard_normal(n)
    if n > 7:
        x[10] = x[11]  # a jump
        x[20] = x[21] - 1e-9  # as a run records it
        x[-1] = x[-2]  # and one on the last point
    query = np.concatenate([x, x[0] + (x[-1] - x[0]) * rng.random(100)])
    both(x, y, query)
    for count in range(1, n + 1):
        both(x, y, query, sorted(rng.choice(x, count, replace=False)))


def test_beside_a_jump_and_a_corner_the_own_side_tells():
    # a ball in flight up to 1 and from there on: the intervals beside the bounce were straight lines, 0.01 off
    x = np.array([0.0, 0.25, 0.5, 0.75, 1, 1.2, 1.4, 1.6, 1.8])
    query = np.linspace(0, 1.8, 400)

    def flight(t):
        return np.where(t < 1, 1 - t * t, 1.5 * (t - 1) - (t - 1) ** 2)

    np.testing.assert_allclose(both(x, flight(x), query, [1.0]), flight(query), atol=1e-14)
    jump = np.insert(x, 5, [1 + 1e-9])
    np.testing.assert_allclose(both(jump, flight(jump), query), flight(query), atol=1e-8)


def test_fourth_order_beside_an_end_and_a_corner():
    errors = []
    for n in (20, 40, 80):
        x = np.linspace(0, 2, 2 * n + 1)
        query = np.linspace(0, 2, 1001)

        def curve(t):
            return np.where(t < 1, np.exp(3 * t), np.exp(3) * np.exp(-2 * (t - 1)))

        errors.append(abs(both(x, curve(x), query, [1.0]) - curve(query)).max())
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert slopes.min() > 3.7, slopes


def test_fourth_order_away_from_inflections():
    errors = []
    for n in (20, 40, 80):
        x = np.linspace(0, 1, n + 1)
        query = np.linspace(x[2], x[-3], 501)
        errors.append(abs(both(x, np.exp(3 * x), query) - np.exp(3 * query)).max())
    slopes = np.log2(np.array(errors[:-1]) / errors[1:])
    assert slopes.min() > 3.7, slopes


def test_a_straight_edge_stays_straight():
    # flat, an edge within one step, flat: a cubic through the points would ring
    x, y = [0, 1, 2, 3, 4, 5], [0, 0, 0, 1, 1, 1]
    query = np.linspace(0, 5, 101)
    np.testing.assert_allclose(both(x, y, query), np.interp(query, x, y), atol=1e-15)


def test_no_overshoot_beside_a_corner():
    # a ramp over many points that begins at 1
    x = np.linspace(0, 2, 21)
    query = np.linspace(0, 2, 401)
    np.testing.assert_allclose(both(x, np.maximum(x - 1, 0), query), np.maximum(query - 1, 0), atol=1e-15)


def test_the_low_of_a_pulse_that_one_step_takes():
    # two edges look like a parabola to four points: it went to -4.6 V
    x, y = np.array([0.0, 1, 9, 10]), np.array([5.0, 0, 0, 5])
    query = np.linspace(0, 10, 101)
    np.testing.assert_allclose(cubic_many(x, y, query, [1.0, 9.0]), np.interp(query, x, y), atol=1e-15)
    assert cubic(x, y, 5.0, [1.0, 9.0]) == 0.0
    assert cubic(x, y, 5.0) < -1.0  # where nothing is known of corners, it is a parabola


def test_a_mass_that_bounces_between_rows_far_apart():
    """Beside the ground it went on straight lines, 2 mm off."""
    lines = (
        ".gravity 9.81",
        "BODY b m=1 j=1 y=0.5",
        "FORCE f b fx={0} fy={y(b)<0 ? -1e5*y(b) : 0}",
        ".tran 40m 3",
    )
    r = emsim.run("\n".join(["ball", *lines, ".end"]), options={"reltol": 1e-6})
    g, w = 9.81, 1e5**0.5
    fall, v = (1 / g) ** 0.5, g**0.5
    touch = 2 * (np.pi - np.arctan2(v / w, g / w**2)) / w

    def height(t):
        s = (t - fall) % (touch + 2 * v / g)
        below = -g / w**2 * (1 - np.cos(w * s)) - v / w * np.sin(w * s)
        return np.where(
            t < fall, 0.5 - g / 2 * t**2, np.where(s < touch, below, (v - g / 2 * (s - touch)) * (s - touch))
        )

    query = np.linspace(0, 3, 30001)
    assert abs(r.at("y(b)", query) - height(query)).max() < 2e-5


@pytest.mark.parametrize("method", ["trap", "gear", "trbdf2", "esdirk", "radau", "auto"])
def test_pulses_between_the_rows_of_a_run(method):
    lines = ("V1 a 0 PULSE(0 5 0 6m 6m 85m 121m)", "R1 a 0 1k", "L1 a b 10", "R2 b 0 1", ".tran 35m 2")
    r = emsim.run("\n".join(["low", *lines, ".end"]), method=method)
    query = np.linspace(0, 2, 3001)
    pulses = np.interp(query % 0.121, [0, 6e-3, 91e-3, 97e-3, 0.121], [0, 5, 5, 0, 0])
    assert abs(r.at("v(a)", query) - pulses).max() < 1e-9
    kept = pickle.loads(pickle.dumps(r.main))
    assert abs(np.asarray(kept.sample("v(a)", query.tolist())) - pulses).max() < 1e-9


def test_the_later_value_holds_at_a_jump():
    assert both([0, 1, 1, 2], [0, 0, 5, 5], [0.5, 1, 1.5]).tolist() == [0, 5, 5]
    assert both([0, 1, 1], [0, 0, 5], [0.5, 1]).tolist() == [0, 5]
