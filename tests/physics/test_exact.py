"""Decks against exact references.

Each reference is a closed form or agrees between two computations to the digits written here. Errors are
divided by the signal's range over the run. Claims, per deck:

  method radau at reltol 1e-9   every signal within 1e-7 of its range
  as the deck stands            within 1e-3
  reltol 1e-3 .. 1e-9           the error falls with the tolerance, down to a floor (`floor`, of range)
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from math import pi

import numpy as np
import pytest
from support import deck, rows_at, run, values_at

Signal = Callable[[Callable[[str], np.ndarray]], np.ndarray]


@dataclass(frozen=True)
class Exact:
    deck: str
    signals: dict[str, str | Signal]  # name in the reference -> column, or function of columns
    values: dict[float, dict[str, float]]  # time [s] -> signal -> value
    source: str
    tight: float = 1e-7
    default: float = 1e-3
    floor: float = 3e-9
    options: str = "method=radau"  # of the ladder and the tight run
    ladder: tuple[float, ...] = (1e-3, 1e-5, 1e-7, 1e-9)
    slow: bool = False


THETA2: Signal = lambda v: v("angle(p1)") + v("angle(p2)")  # noqa: E731
OMEGA2: Signal = lambda v: v("omega(p1)") + v("omega(p2)")  # noqa: E731

CASES = [
    Exact(
        "mechanical/ref_simple_pendulum",
        {"theta": "angle(hinge)", "thetadot": "omega(hinge)"},
        {
            1: {"theta": -1.405027311524799, "thetadot": -1.799309016907079},
            10: {"theta": 0.2786806735699829, "thetadot": -4.343160692864683},
        },
        "Jacobi elliptic functions in 60-digit arithmetic",
    ),
    Exact(
        "mechanical/ref_double_pendulum",
        {"theta1": "angle(p1)", "theta2": THETA2, "omega1": "omega(p1)", "omega2": OMEGA2},
        {
            1: dict(
                theta1=-0.6250876998063906,
                theta2=-1.034585085680012,
                omega1=-3.922279572887977,
                omega2=-1.303099248696331,
            ),
            2: dict(
                theta1=-0.4829715342517544,
                theta2=-1.324048712302363,
                omega1=3.065288192073401,
                omega2=2.949271547571619,
            ),
            5: dict(
                theta1=-0.6271867050665307,
                theta2=-1.301315550209812,
                omega1=2.125408673842911,
                omega2=3.881888727265607,
            ),
        },
        "Gragg-Bulirsch-Stoer in binary128; MuJoCo, Simbody and scipy agree",
    ),
    Exact(
        "mechanical/ref_four_bar",
        {"th1": "angle(a)", "th2": "angle(coupler)", "th3": "angle(rocker)", "w1": "omega(a)"},
        {
            1: dict(
                th1=13.58013651307514, th2=0.4745920656150973, th3=1.336962208016465, w1=10.39454183822152
            ),
            2: dict(
                th1=26.73510177428669, th2=0.4297199586210235, th3=1.595679437295989, w1=7.200392222951495
            ),
            5: dict(
                th1=67.78272150122560, th2=1.3566720793825794, th3=2.3845892895086871, w1=24.37615472632867
            ),
        },
        "Gragg-Bulirsch-Stoer in binary128; Simbody, Exudyn, MuJoCo agree",
    ),
    Exact(
        "coupled/ref_dc_motor_step",
        {"i": "i(m1)", "omega": "omega(shaft)"},
        {
            0.001: {"i": 7.554394628905245, "omega": 2.202928666329948},
            0.01: {"i": 9.786647356068963, "omega": 49.27062611794250},
            0.1: {"i": 1.006393854931379, "omega": 220.3660061830447},
            0.5: {"i": 0.04784086286097782, "omega": 239.0431992803071},
        },
        "matrix exponential, 40 digits",
    ),
    Exact(
        "coupled/ref_slider_crank",
        {"phi": "angle(shaft)", "omega": "omega(shaft)", "i": "i(m1)"},
        {
            0.1: dict(phi=3.332138890806870, omega=93.76689877110422, i=7.295889781272553),
            0.5: dict(phi=56.08378465742719, omega=202.7096045187029, i=3.100871101090060),
            1.0: dict(phi=157.6904489395086, omega=215.8185637565509, i=-0.879138089515779),
        },
        "Gragg-Bulirsch-Stoer in binary128; an absolute-coordinate model agrees to 8 digits",
    ),
    Exact(
        "electrical/ref_lc_tank",
        {"v": "v(a)", "i": "i(l1)"},
        {1.0: {"v": 0.8799452654465220, "i": -0.01502319306333544}},
        "closed form",
        ladder=(1e-6, 1e-7, 1e-9),
        slow=True,
    ),
    Exact(
        "electrical/ref_rlc_700mhz",
        {"v": "v(c)"},
        {1e-9: {"v": 1.269164019521405}, 5e-9: {"v": 1.079917727993278}, 1e-8: {"v": 0.9937509591513175}},
        "closed form",
    ),
    Exact(
        "electrical/ref_vc_loop",
        {"i": lambda v: -v("i(v1)")},
        {0: {"i": 0.03141592653589793}, 1e-4: {"i": 0.02541601846157630}, 2e-4: {"i": 0.009708055193627333}},
        "closed form, i = C dV/dt",
    ),
    Exact(
        "electrical/ref_robertson",
        {"y1": "v(y1)", "y2": "v(y2)", "y3": "v(y3)"},
        {1e11: {"y1": 2.0833401497013e-8, "y2": 8.33336077033478e-14, "y3": 0.99999997916651517}},
        "Test Set for IVP Solvers; RADAU in binary128 agrees to 13 digits",
    ),
]


@cache
def errors(case_name: str, options: str) -> dict[str, float]:
    """Largest error of each signal over the reference times, divided by the signal's range."""
    case = next(c for c in CASES if c.deck == case_name)
    result = run(deck(case.deck), options)
    times = np.array(sorted(case.values), dtype=float)
    found = {}
    for name, how in case.signals.items():
        of = (lambda at, how=how: at(how)) if isinstance(how, str) else how
        column, value = of(lambda n: np.asarray(result[n])), of(lambda n: values_at(result, n, times))
        want = np.array([case.values[t][name] for t in sorted(case.values)])
        found[name] = float(np.abs(value - want).max() / np.ptp(column))
    return found


def params():
    return [
        pytest.param(c, id=c.deck.split("/")[1], marks=[pytest.mark.slow] if c.slow else []) for c in CASES
    ]


@pytest.mark.parametrize("case", params())
def test_radau_at_1e9_is_within_1e7_of_range(case):
    found = errors(case.deck, f"{case.options} reltol=1e-9")
    assert max(found.values()) <= case.tight, found


@pytest.mark.parametrize("case", params())
def test_default_tolerance_is_within_1e3_of_range(case):
    found = errors(case.deck, "")
    assert max(found.values()) <= case.default, found


@pytest.mark.parametrize("case", params())
def test_error_falls_with_the_tolerance(case):
    ladder = [max(errors(case.deck, f"{case.options} reltol={r:g}").values()) for r in case.ladder]
    for looser, tighter in itertools.pairwise(ladder):
        assert tighter <= max(looser, case.floor), ladder
    assert ladder[-1] <= max(1e-2 * ladder[0], case.floor), ladder


EXPLICIT = ("simple_pendulum", "double_pendulum", "four_bar", "dc_motor_step", "slider_crank")


@pytest.mark.parametrize("case", [p for p in params() if p.id.removeprefix("ref_") in EXPLICIT])
def test_dop853_falls_with_the_tolerance(case):
    """Machines, free and coupled: every digit asked for buys one, to what twelve digits leave."""
    ladder = [
        max(errors(case.deck, f"method=dop853 reltol={r:g}").values()) for r in (1e-5, 1e-7, 1e-9, 1e-11)
    ]
    assert all(b <= 0.3 * a for a, b in itertools.pairwise(ladder)), ladder
    assert ladder[-1] <= 1e-10, ladder


def test_four_bar_closing_force():
    """The pin that closes the loop carries the multiplier of the closure, in world axes."""
    result = run(deck("mechanical/ref_four_bar"), "method=radau reltol=1e-9")
    rows = rows_at(result, np.array([1.0, 2.0, 5.0]))
    want_x = np.array([-0.62145796916189334, -0.009207992606340416, 1.523119627560293])
    want_y = np.array([-0.782683153763617843, -0.783221113794306949, 2.599031314920958])
    fx, fy = np.asarray(result["fx(close)"])[rows], np.asarray(result["fy(close)"])[rows]
    sign = np.sign(fx[2] * want_x[2])  # the reference counts it on one body, emsim on B from A
    assert np.abs(sign * fx - want_x).max() <= 1e-6 * np.ptp(result["fx(close)"])
    assert np.abs(sign * fy - want_y).max() <= 1e-6 * np.ptp(result["fy(close)"])


def test_lc_tank_period_by_zero_crossings():
    """2 pi sqrt(LC) = 0.000198691765315922 s over 100 periods, from the crossings of the recorded points."""
    result = run(deck("electrical/ref_lc_tank"), "reltol=1e-7", tran="0.5u 20m 0 0.5u UIC")
    t, v = np.asarray(result.time), np.asarray(result["v(a)"])
    k = np.flatnonzero((v[:-1] < 0) & (v[1:] >= 0))
    # the inverse cubic through four points around the crossing
    cross = []
    for i in (k[0], k[-1]):
        x, y = t[i - 1 : i + 3], v[i - 1 : i + 3]
        c = sum(x0 * np.prod([-y1 / (y0 - y1) for y1 in y if y1 != y0]) for x0, y0 in zip(x, y, strict=True))
        cross.append(c)
    period = (cross[1] - cross[0]) / (len(k) - 1)
    assert period == pytest.approx(2 * pi * np.sqrt(1e-3 * 1e-6), rel=1e-7)
