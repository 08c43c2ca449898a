"""Rows behind an event, inside the first step, are as right as those around it.

References: matrix exponentials from event to event, the events by the roots of what they hang on; an integration of scipy's.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

import emsim

Curve = tuple[np.ndarray, list[float]]  # values at given times, and when events were
METHODS = "radau radau5 auto esdirk trbdf2 gear trap gauss dop853".split()


def pieces(times: np.ndarray, x: np.ndarray, next_piece: Callable, steps: float) -> Curve:
    """x at `times`, of x' = a x + b from event to event; `next_piece(x)` gives a, b and what is 0 where the piece ends."""
    found, events, begin = np.empty((len(times), len(x))), [], 0.0
    while True:
        a, b, end = next_piece(x)
        whole = np.block([[a, b[:, None]], [np.zeros((1, len(x) + 1))]])

        def at(h: float, whole=whole, x=x) -> np.ndarray:
            return (expm(whole * h) @ np.append(x, 1.0))[:-1]

        def left(h: float, at=at, end=end) -> float:
            return end(at(h))

        h = steps
        while left(h) * left(0.5 * steps) > 0 and begin + h < times[-1]:
            h += steps
        over = begin + h >= times[-1]
        h = np.inf if over else brentq(left, h - steps, h, xtol=1e-17, rtol=1e-15)
        inside = (times >= begin) & (times <= begin + h)
        found[inside] = [at(t - begin) for t in times[inside]]
        if over:
            return found, events
        x, begin = at(h), begin + h
        events.append(begin)


def on_a_spring(times: np.ndarray) -> Curve:
    """A mass of 1 kg that falls onto a spring of 2 kN/m, again and again."""
    touches = [False]

    def piece(x: np.ndarray):
        touches[0] = bool(x[0] < 1e-9 and x[1] < 0)
        k = 2000.0 if touches[0] else 0.0
        return np.array([[0.0, 1.0], [-k, 0.0]]), np.array([0.0, -9.81]), lambda x: x[0]

    return pieces(times, np.array([0.3, 0.0]), piece, 4e-3)


def with_friction(times: np.ndarray) -> Curve:
    """A mass of 1 kg on a spring of 100 N/m slides under 3 N of friction, and does not come to rest meanwhile."""
    side = [1.0]

    def piece(x: np.ndarray):
        side[0] = -side[0]
        return np.array([[0.0, 1.0], [-100.0, 0.0]]), np.array([0.0, -3.0 * side[0]]), lambda x: x[1]

    return pieces(times, np.array([1.0, 0.0]), piece, 0.05)


def with_a_switch(times: np.ndarray) -> Curve:
    """The voltage of 1 uF behind 1 mH and 3 ohm; a switch that closes at 5 V and opens at 3 V has 20 ohm beside it."""
    closed = [True]

    def piece(x: np.ndarray):
        closed[0] = not closed[0]
        g, level = (1 / 21.0, 3.0) if closed[0] else (1 / (1e6 + 20.0), 5.0)
        a = np.array([[-g / 1e-6, 1 / 1e-6], [-1 / 1e-3, -3 / 1e-3]])
        return a, np.array([0.0, 5 / 1e-3]), lambda x: x[0] - level

    return pieces(times, np.zeros(2), piece, 4e-6)


def at_a_stop(times: np.ndarray) -> Curve:
    """A pendulum of 1 m that a stop at 10 degrees throws back with 0.7 of its speed."""

    def hit(t: float, x: np.ndarray) -> float:
        return x[0] - pi / 18

    hit.terminal, hit.direction = True, -1
    found, events, begin, x = np.empty((len(times), 2)), [], 0.0, [pi / 3, 0.0]
    while True:
        span = (begin, times[-1] + 1e-9)
        run = solve_ivp(
            lambda t, x: [x[1], -9.81 * np.sin(x[0])],
            span,
            x,
            "DOP853",
            dense_output=True,
            rtol=1e-13,
            atol=1e-14,
            events=hit,
        )
        inside = (times >= begin) & (times <= run.t[-1])
        found[inside] = run.sol(times[inside]).T
        if run.status == 0:
            return found, events
        begin, x = run.t[-1], [run.y[0, -1], -0.7 * run.y[1, -1]]
        events.append(begin)


DECKS = {
    "a spring": (
        "BODY b m=1\nJOINT up 0 b slide axis=(0,1) ic=0.3\nSTOP s up min=0 k=2000\n.tran 10m 1.2\n.save pos(up)",
        "pos(up)",
        on_a_spring,
    ),
    "friction": (
        "BODY b m=1\nJOINT x 0 b slide axis=(1,0) ic=1\nSPRING k x k=100\nFRICTION f x fc=3\n.tran 10m 2.5\n.save pos(x)",
        "pos(x)",
        with_friction,
    ),
    "a switch": (
        "V1 a 0 5\nR1 a b 3\nL1 b c 1m ic=0\nC1 c 0 1u ic=0\nS1 c d c 0 sw\nR2 d 0 20\n.model sw sw(vt=4 vh=1 ron=1 roff=1meg)\n"
        ".tran 20u 1m uic\n.save v(c)",
        "v(c)",
        with_a_switch,
    ),
    "a stop": (
        "BODY bob m=1 j=0 com=(0,-1)\nJOINT hinge 0 bob pin ic=60deg\nSTOP peg hinge min=10deg e=0.7\n"
        ".tran 50m 3\n.save angle(hinge)",
        "angle(hinge)",
        at_a_stop,
    ),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", DECKS)
def test_rows_behind_an_event_are_as_right_as_those_around_it(name: str, method: str) -> None:
    deck, signal, curve = DECKS[name]
    for reltol in (1e-5, 1e-8):
        try:
            run = emsim.run(
                f"rows\n.gravity 9.81\n{deck}\n.options reltol={reltol:g} gmin=1e-20\n.end\n", method=method
            )
        except emsim.ConvergenceError as why:
            assert "E413" in str(why)
            pytest.skip("the method does not do this deck")
        t = np.asarray(run["time"])
        exact, events = curve(t)
        error = np.abs(np.asarray(run[signal]) - exact[:, 0])
        tolerance = reltol * np.abs(exact[:, 0]).max()
        step = {"a spring": 10e-3, "friction": 10e-3, "a switch": 20e-6, "a stop": 50e-3}[name]
        assert events
        for event in events:
            behind = (t > event + 1e-6 * step) & (t < event + step)
            around = (t > event - 2 * step) & (t < event + 3 * step) & ~behind
            worst = error[behind].max(initial=0.0)
            assert worst <= 0.2 * tolerance + 2 * error[around].max(), (event, worst / tolerance)
