"""Values between points: order, kinks, jumps, and the two writings of one rule."""

from __future__ import annotations

from array import array

import numpy as np
import pytest

from emsim.interpolate import cubic, cubic_many


def both(x, y, query):
    """The rule in both writings, which must agree to rounding."""
    x, y = np.asarray(x, float), np.asarray(y, float)
    many = cubic_many(x, y, np.asarray(query, float))
    one = [cubic(array("d", x), array("d", y), float(t)) for t in query]
    np.testing.assert_allclose(many, one, rtol=0, atol=1e-13 * max(1.0, abs(y).max()))
    return many


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 40])
def test_both_writings_agree_on_random_points(n):
    rng = np.random.default_rng(n)
    x, y = np.sort(rng.random(n)), rng.standard_normal(n)
    if n > 5:
        x[10] = x[11]  # a jump
        x[-1] = x[-2]  # and one on the last point
    both(x, y, np.concatenate([x, x[0] + (x[-1] - x[0]) * rng.random(100)]))


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


def test_the_later_value_holds_at_a_jump():
    assert both([0, 1, 1, 2], [0, 0, 5, 5], [0.5, 1, 1.5]).tolist() == [0, 5, 5]
    assert both([0, 1, 1], [0, 0, 5], [0.5, 1]).tolist() == [0, 5]
