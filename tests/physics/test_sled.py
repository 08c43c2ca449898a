"""A block on a sled that swings on a spring: it slides and sticks, harmonic motions one after another."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from support import NETLISTS

import emsim

SLED, BLOCK, K, BOUND = 1.0, 0.5, 10.0, 1.0
STOP = 10.0


def exact(times: np.ndarray) -> tuple[np.ndarray, int]:
    """(positions of sled and of block on it, changes of mode): each piece in closed form, its end by bisection."""
    t, x, v, y, u = 0.0, 0.0, 3.0, 0.0, 0.0
    sign, changes = 0, 0
    out = np.zeros((2, len(times)))
    while True:
        # the sled's own motion: with the block, or under its friction
        w = np.sqrt(K / (SLED + BLOCK if sign == 0 else SLED))
        middle, push = sign * BOUND / K, -sign * BOUND / BLOCK
        half = np.pi / w

        def at(s, x=x, v=v, w=w, middle=middle):
            c, n = np.cos(w * s), np.sin(w * s)
            return middle + (x - middle) * c + v / w * n, v * c - (x - middle) * w * n

        def slip(s, at=at, u=u, v=v, push=push):
            # of the block against the sled
            return v + u + push * s - at(s)[1]

        def load(s, at=at):
            return BLOCK * K * abs(at(s)[0]) / (SLED + BLOCK) - BOUND

        grid = np.linspace(1e-6, half, 2001)
        values = np.array([load(s) if sign == 0 else -sign * slip(s) for s in grid])
        found = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
        end = (
            brentq(load if sign == 0 else slip, grid[found[0]], grid[found[0] + 1], xtol=1e-15)
            if len(found)
            else half
        )
        inside = (times >= t) & (times < t + end)
        s = times[inside] - t
        moved = v + u + push * s / 2
        out[0, inside] = at(s)[0]
        out[1, inside] = y if sign == 0 else y + x + moved * s - at(s)[0]
        if sign:
            y += x + (v + u + push * end / 2) * end - at(end)[0]
            u = slip(end)
        x, v = at(end)
        t += end
        if t > STOP:
            return out, changes
        if len(found):
            changes += 1
            u = 0.0
            # after a stop: it holds where it can, else it goes where the sled leaves it behind
            holds = sign and BLOCK * K * abs(x) < BOUND * (SLED + BLOCK)
            sign = 0 if holds else int(np.sign(x))


@pytest.mark.parametrize("reltol", [1e-4, 1e-6, 1e-8])
def test_sled(reltol):
    deck = (
        (NETLISTS / "bench" / "sled.cir").read_text().replace(".tran", f".options reltol={reltol}\n.tran", 1)
    )
    r = emsim.run(deck)
    positions, changes = exact(np.asarray(r["time"]))
    found = np.array([r["pos(rail)"], r["pos(bed)"]])
    assert np.abs(found - positions)[:, :-1].max() < 30 * reltol
    assert r.stats["events"] == changes
