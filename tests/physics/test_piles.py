"""Random piles and arms between stops: no impact raises the energy, nothing hangs, piles come to rest."""

from __future__ import annotations

import numpy as np
import pytest
from piles import arm, deck, pile
from support import daily

import emsim

# 48, 56, 76, 136: a block that bounced on one that lies on the floor never came to rest; 160 000 events
PILES = [*range(40), 48, 56, 58, 76, 136]


@pytest.mark.parametrize("seed", PILES)
def test_a_random_pile_comes_to_rest(seed):
    text, joints, _ = pile(seed)
    r = emsim.run(deck(text, joints, 8.0))
    energy = np.asarray(r["energy()"])
    size = max(1.0, np.abs(energy).max())
    hits = sum(r[f"hits(c{k})"][-1] for k in range(len(joints)))
    assert r.stats["events"] < 30 * max(10.0, hits) and r.stats["events"] < 3000
    assert np.diff(energy).max() < 1e-4 * size
    assert r["ke()"][-1] < 1e-6 * size and abs(r.energy.residual) < 1e-3 * size


@pytest.mark.parametrize("seed", daily(range(40), 3))
def test_no_impact_of_an_arm_between_stops_raises_the_energy(seed):
    text, joints = arm(seed)
    r = emsim.run(deck(text, joints, 1.5, "reltol=1e-6"))
    energy = np.asarray(r["energy()"])
    assert np.diff(energy).max() < 1e-4 * max(1.0, np.ptp(energy), np.abs(energy).max())


def test_there_are_enough_impacts():
    hits = 0.0
    for seed in range(20):
        text, joints = arm(seed)
        r = emsim.run(deck(text, joints, 1.5))
        hits += sum(r[f"hits(c{k})"][-1] for k in range(len(joints)))
    assert hits > 200
