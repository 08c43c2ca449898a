"""A grid of resistors and capacitors with loads that switch: exact from corner to corner, by exponentials of the matrix."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

import emsim

SIDE = 12
STOP = 2e-9
GRID, STORED, FEED, COIL, SUPPLY = 50e-3, 1e-12, 5e-3, 0.1e-9, 1.2
# node, delay, width, period of each load [s]; rises and falls in 0.1 ns
LOADS = [
    (k, (0.11 * k % 1.3) * 1e-9, (0.3 + 0.07 * k % 0.5) * 1e-9, (1.1 + 0.13 * k % 0.8) * 1e-9)
    for k in range(0, SIDE * SIDE, 5)
]
RISE, HIGH = 0.1e-9, 1e-3


def deck() -> str:
    cards = ["a supply grid", f"V1 in 0 {SUPPLY}", f"R1 in a {FEED}", f"L1 a n0 {COIL}"]
    for k in range(SIDE * SIDE):
        i, j = divmod(k, SIDE)
        cards += [f"RA{k} n{k} n{k + SIDE} {GRID}"] * (i + 1 < SIDE) + [f"RB{k} n{k} n{k + 1} {GRID}"] * (
            j + 1 < SIDE
        )
        cards.append(f"C{k} n{k} 0 {STORED}")
    for k, late, wide, period in LOADS:
        cards.append(f"I{k} n{k} 0 PULSE(0 {HIGH} {late!r} {RISE} {RISE} {wide!r} {period!r})")
    return "\n".join([*cards, f".save v(n0) v(n{SIDE * SIDE - 1})", f".tran 20p {STOP}", ".end", ""])


def corners(late: float, wide: float, period: float) -> tuple[list[float], list[float]]:
    """Times and values of a pulse's corners."""
    times, values = [0.0], [0.0]
    begin = late
    while begin < STOP:
        times += [begin, begin + RISE, begin + RISE + wide, begin + 2 * RISE + wide]
        values += [0.0, HIGH, HIGH, 0.0]
        begin += period
    return times, values


def exact(times: np.ndarray) -> np.ndarray:
    """Voltages of the first and the last node at these times."""
    n = SIDE * SIDE
    a = np.zeros((n + 1, n + 1))
    for k in range(n):
        i, j = divmod(k, SIDE)
        for other in [k + SIDE] * (i + 1 < SIDE) + [k + 1] * (j + 1 < SIDE):
            for row, column in ((k, other), (other, k)):
                a[row, row] -= 1 / GRID / STORED
                a[row, column] += 1 / GRID / STORED
    a[0, n], a[n, 0], a[n, n] = 1 / STORED, -1 / COIL, -FEED / COIL
    shapes = [corners(*load[1:]) for load in LOADS]
    bends = np.unique(np.concatenate([[0.0, STOP], *[t for t, _ in shapes]]))
    bends = bends[(bends < STOP * (1 - 1e-9)) & np.concatenate([[True], np.diff(bends) > 1e-18])]
    bends = np.append(bends, STOP)

    def driven(t: float) -> np.ndarray:
        b = np.zeros(n + 1)
        for (k, *_), (at, values) in zip(LOADS, shapes, strict=True):
            b[k] = -np.interp(t, at, values) / STORED
        b[n] = SUPPLY / COIL
        return b

    x = np.full(n + 1, SUPPLY)
    x[n] = 0.0
    found = np.zeros((len(times), 2))
    for begin, end in pairwise(bends):
        b, slope = driven(begin), (driven(end) - driven(begin)) / (end - begin)
        # x' = a x + b + slope tau, with rows of tau and 1 beside x; times in nanoseconds, lest 1 and tau be far apart
        m = np.zeros((n + 3, n + 3))
        m[: n + 1, : n + 1], m[: n + 1, n + 1], m[: n + 1, n + 2] = 1e-9 * a, 1e-9 * b, 1e-18 * slope
        m[n + 2, n + 1] = 1.0

        def after(tau: float, m: np.ndarray = m, x: np.ndarray = x) -> np.ndarray:
            return (expm(m * tau * 1e9) @ np.concatenate([x, [1.0, 0.0]]))[: n + 1]

        for k in np.flatnonzero((times > begin) & (times <= end)):
            found[k] = after(times[k] - begin)[[0, n - 1]]
        x = after(end - begin)
    found[times == 0.0] = SUPPLY
    assert np.all(found > 0.9 * SUPPLY)
    return found


@pytest.mark.parametrize("reltol", [1e-3, 1e-4])
def test_every_row_is_exact_to_a_share_of_its_range(reltol):
    result = emsim.run(deck(), reltol=reltol)
    assert result.stats["method"] == "esdirk"
    voltages = exact(np.asarray(result.time))
    for column, name in enumerate(("v(n0)", f"v(n{SIDE * SIDE - 1})")):
        off = np.max(abs(result[name] - voltages[:, column]))
        assert off < 5e-4 * np.ptp(voltages[:, column]), (name, off)


def test_factors_recur_where_loads_keep_to_a_raster():
    stats = emsim.run(deck()).stats
    assert stats["method"] == "esdirk"
    assert stats["factorisations"] < 0.6 * stats["steps"], stats


def test_who_goes_by_which_method():
    """Where factors fill: one real factorisation a step. Ladders, whose factors do not, and tight runs keep the long steps."""

    def ladder(n: int) -> str:
        cards = [f"R{k} n{k} n{k + 1} 1\nC{k} n{k + 1} 0 1n" for k in range(n)]
        return "\n".join(["a ladder", "V1 n0 0 PULSE(0 1 0 1u 1u 1m 2m)", *cards, ".tran 10u 1m", ".end", ""])

    assert emsim.run(ladder(200)).stats["method"] == "radau"
    assert emsim.run(deck(), reltol=1e-6).stats["method"] == "radau"
