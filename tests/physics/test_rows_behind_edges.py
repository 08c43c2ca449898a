"""Rows between the edges of pulse trains, in circuits that are linear from edge to edge.

References: matrix exponentials from edge to edge, of equations written down by hand.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

import emsim

PERIODS = 40


def exactly(times: np.ndarray, edges: list[tuple[float, np.ndarray, np.ndarray]], size: int) -> np.ndarray:
    """x at `times`, from x = 0; from the time of each of the edges on x' = a x + b."""
    x, found, k = np.zeros(size), [], 0

    def after(h: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        whole = np.block([[a, b[:, None]], [np.zeros((1, size + 1))]])
        return np.asarray((expm(whole * h) @ np.append(x, 1.0))[:size])

    for t in times:
        while k + 1 < len(edges) and edges[k + 1][0] <= t:
            x = after(edges[k + 1][0] - edges[k][0], *edges[k][1:])
            k += 1
        found.append(after(t - edges[k][0], *edges[k][1:]))
    return np.array(found)


def bridge(on: bool) -> tuple[np.ndarray, np.ndarray]:
    """i1, the voltage of cf, i2; four switches of 10 mOhm and 10 MOhm."""
    up, down = (100.0, 1e-7) if on else (1e-7, 100.0)
    # each leg as a source behind a resistance
    r = 1.0 / (up + down)
    high, low = 48.0 * up * r, 48.0 * down * r
    l1, c, l2 = 0.5e-3, 4.7e-6, 2e-3
    a = np.array(
        [[-(0.4 + 2.0 * r) / l1, -1.0 / l1, 0.0], [1.0 / c, -0.01 / c, -1.0 / c], [0.0, 1.0 / l2, -1.5 / l2]]
    )
    return a, np.array([(high - low) / l1, 0.0, 0.0])


BRIDGE = """H-bridge on a filter
Vb vb 0 48
S1 vb a g 0 sw
S4 b 0 g 0 sw
S2 a 0 gn 0 sw
S3 vb b gn 0 sw
Vg g 0 PULSE(0 1 0 100n 100n 32.4u 50u)
Bn gn 0 V={{1-v(g)}}
R1 a l 0.4
L1 l o 0.5m
Cf o b 4.7u
Rf o b 100
L2 o m 2m
R2 m b 1.5
.model sw SW(vt=0.5 ron=10m roff=10meg)
.tran 3u {stop} UIC
.options reltol={reltol}
.save i(l1) i(l2) v(o,b)
.end
"""


@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
def test_rows_of_a_bridge(reltol: float) -> None:
    table = emsim.run(BRIDGE.format(stop=PERIODS * 50e-6, reltol=reltol), method="radau").main
    edges = [(0.0, *bridge(False))]
    for k in range(PERIODS):
        edges += [(50e-6 * k + 50e-9, *bridge(True)), (50e-6 * k + 32.55e-6, *bridge(False))]
    expected = exactly(table.time, edges, 3)
    for name, column in (("i(l1)", 0), ("v(o,b)", 1), ("i(l2)", 2)):
        off = np.abs(np.asarray(table[name]) - expected[:, column]).max()
        assert off <= reltol * np.ptp(expected[:, column]), (name, off)


CHOPPER = """A source that is chopped onto two capacitors
Vs s 0 1
Vg g 0 PULSE(0 1 0 20n 20n 3u 10u)
S1 s a g 0 sw
.model sw SW(vt=0.5 ron=10 roff=100meg)
R1 a b {r}
C1 b 0 1n
R2 b c 10k
C2 c 0 2n
RL c 0 100k
.tran 0.7u {stop} UIC
.options reltol={reltol}
.save v(b) v(c)
.end
"""


def chopper(r: float, switch: float) -> tuple[np.ndarray, np.ndarray]:
    g, c1, c2 = 1.0 / (r + switch), 1e-9, 2e-9
    a = np.array([[-(g + 1e-4) / c1, 1e-4 / c1], [1e-4 / c2, -(1e-4 + 1e-5) / c2]])
    return a, np.array([g / c1, 0.0])


@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
@pytest.mark.parametrize("r", [3.0, 30.0, 100.0, 300.0, 1e3, 3e3, 10e3])
def test_rows_on_transients_of_any_speed(r: float, reltol: float) -> None:
    """From one that is over within a hundredth of the stretch to one that lasts for all of it."""
    table = emsim.run(CHOPPER.format(r=r, stop=PERIODS * 10e-6, reltol=reltol), method="radau").main
    edges = [(0.0, *chopper(r, 100e6))]
    for k in range(PERIODS):
        edges += [(10e-6 * k + 10e-9, *chopper(r, 10.0)), (10e-6 * k + 3.03e-6, *chopper(r, 100e6))]
    expected = exactly(table.time, edges, 2)
    for name, column in (("v(b)", 0), ("v(c)", 1)):
        assert np.abs(np.asarray(table[name]) - expected[:, column]).max() <= reltol, name
