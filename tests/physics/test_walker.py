"""walker.cir: a compass gait down a slope, beside its published fixed point and an integration of its own."""

from __future__ import annotations

from functools import cache
from math import sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import emsim

DECK = Path(__file__).parents[2] / "netlists" / "mechanical" / "walker.cir"
G, SLOPE = 9.81, 0.009
RATE = sqrt(G)
# lean of the leg that stands, and its rate in sqrt(l/g), just after a foot struck, of feet without mass at this slope
PUBLISHED = (0.200310900544287, -0.199832473004977)


def along(q):
    return np.array([-np.sin(q), np.cos(q)])


def across(q):
    return np.array([-np.cos(q), -np.sin(q)])


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def rates(_, y, beta):
    """Leans of the leg that stands and the one that swings, from the slope's normal, and their rates. Masses: hip 1, foot beta,
    which are at p = along(q) and p - along(s)."""
    q, s, dq, ds = y
    weight = G * np.array([sin(SLOPE), -np.cos(SLOPE)])
    hip, foot = (
        (np.array([across(q), 0.0 * across(q)]), -along(q) * dq**2),
        (np.array([across(q), -across(s)]), -along(q) * dq**2 + along(s) * ds**2),
    )
    inertia, push = np.zeros((2, 2)), np.zeros(2)
    for m, (lever, own) in ((1.0, hip), (beta, foot)):
        inertia += m * lever @ lever.T
        push += m * lever @ (weight - own)
    return [dq, ds, *np.linalg.solve(inertia, push)]


def struck(y, beta):
    """The foot that swung stays where it is; the moment of momentum about it is kept, and of the other leg about the hip."""
    q, s, dq, _ = y
    hip, foot = along(q), along(q) - along(s)
    kept = cross(hip - foot, across(q) * dq)
    # the foot that stood had no speed: neither has its leg a moment about the hip
    unknown = np.array(
        [
            [
                cross(hip - foot, across(s)) + beta * cross(-foot, across(s)),
                -beta * cross(-foot, across(q)),
            ],
            [beta * cross(-hip, across(s)), -beta * cross(-hip, across(q))],
        ]
    )
    w, u = np.linalg.solve(unknown, [kept, 0.0])
    return np.array([s, q, w, u])


@cache
def walk(beta: float, start: tuple[float, ...], steps: int):
    """Instants of strikes, and the state after each."""
    y, t, found = np.array([start[0], -start[0], *start[1:]]), 0.0, []
    level = lambda _, y, beta: y[0] + y[1]  # noqa: E731
    for _ in range(steps):
        r = solve_ivp(
            rates, (0.0, 3.0), y, method="DOP853", rtol=1e-12, atol=1e-14, events=level, args=(beta,)
        )
        strikes = [
            (at, z) for at, z in zip(r.t_events[0], r.y_events[0], strict=True) if at > 0.1 and z[0] < -0.01
        ]
        at, z = strikes[0]
        t, y = t + at, struck(z, beta)
        found.append((t, *y))
    return np.array(found)


def strikes_of(r):
    """The first row after each strike."""
    hits = np.asarray(r["hits(foot1)"]) + np.asarray(r["hits(foot2)"])
    return np.flatnonzero(np.diff(hits) > 0.5) + 1


@pytest.mark.parametrize(("reltol", "error"), ((1e-4, 1e-4), (1e-6, 1e-6), (1e-8, 1e-8)))
def test_it_walks_as_by_its_own_integration(reltol, error):
    exact = walk(0.01, (0.19882537, -0.20056552 * RATE, -0.18491606 * RATE), 5)
    r = emsim.run(DECK, reltol=reltol)
    k = strikes_of(r)
    assert np.asarray(r.time)[k] == pytest.approx(exact[:, 0], abs=error)
    # the leg that stands is the right one after the first step
    hip, left = np.asarray(r["angle(hip)"])[k], np.asarray(r["angle(left)"])[k]
    standing = np.where(np.arange(5) % 2 == 0, left + hip, left)
    assert standing == pytest.approx(exact[:, 1], abs=error)
    rate = np.asarray(r["omega(hip)"])[k] * np.where(np.arange(5) % 2 == 0, -1, 1)
    assert rate == pytest.approx(exact[:, 4] - exact[:, 3], abs=10 * error)
    # the start is the gait's: a step takes what it falls by; and no foot slips
    energy = np.asarray(r["energy()"])
    step = 2 * sin(0.19882537)
    assert energy[0] - energy[-1] == pytest.approx(5 * 1.02 * G * step * sin(SLOPE), rel=1e-3)
    assert np.diff(energy).max() < 10 * reltol and abs(r.energy.residual) < 10 * reltol
    assert np.asarray(r["x(left)"])[-1] > 5 * step


def test_it_has_the_published_gait_without_mass_in_its_feet():
    lean, rate = PUBLISHED
    begin = {"beta": 1e-7, "a": lean, "w": rate * RATE, "u": rate * np.cos(2 * lean) * RATE}
    r = emsim.run(DECK, begin, reltol=1e-9, also="omega(left)")
    k = strikes_of(r)
    left = np.asarray(r["angle(left)"])[k]
    assert np.abs(left) == pytest.approx(lean, abs=1e-6)
    assert np.asarray(r["omega(left)"])[k[1::2]] / RATE == pytest.approx(rate, abs=1e-6)
    assert np.diff(np.asarray(r.time)[k]) * RATE == pytest.approx(3.882464, abs=3e-6)


def test_a_disturbed_gait_comes_back():
    """Its multipliers are 0.59 in size: what a push changed is gone by a third after two steps, to and fro."""
    start = {"w": -0.203 * RATE}
    r, own = (
        emsim.run(DECK, start, reltol=1e-8),
        walk(0.01, (0.19882537, -0.203 * RATE, -0.18491606 * RATE), 5),
    )
    assert np.asarray(r.time)[strikes_of(r)] == pytest.approx(own[:, 0], abs=1e-6)
    off = np.abs(own[:, 1] - 0.19882537)
    assert off[-1] < 0.35 * off[:2].max()
