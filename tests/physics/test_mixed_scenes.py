"""Random scenes of shapes, arms, ropes, friction and stops together: energy never rises, nothing is in another, all come to the
end, and the order of the cards changes nothing."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from mixed_scenes import WALLS, Mixed
from outlines import apart, apart_disc, box, placed

import emsim

SEEDS = range(24)


def between(one, other):
    """Of (corners at every time, radius)."""
    (a, r), (b, s) = one, other
    if r and s:
        return np.hypot(*(a - b)[:, 0].T) - r - s
    if r or s:
        return apart_disc(b, a[:, 0], r) if r else apart_disc(a, b[:, 0], s)
    return apart(a, b)


def solids(m: Mixed, r):
    """Every outline where it is; those that a joint joins are not compared."""
    still = np.zeros((3, len(r.time)))
    found = {name: (placed(box(w, h, x, y), *still), 0.0) for name, (w, h, x, y) in WALLS.items()}
    for name, outline in m.outlines.items():
        motion = [np.asarray(r[f"{word}({name})"]) for word in ("x", "y", "angle")]
        corners, radius = ([(0.0, 0.0)], outline) if isinstance(outline, float) else (outline, 0.0)
        found[name] = (placed(corners, *motion), radius)
    return found


@pytest.mark.parametrize("seed", SEEDS)
def test_a_scene_of_all_loses_energy_and_nothing_passes(seed):
    m = Mixed(seed)
    r = emsim.run(m.deck(0.6))
    energy = np.asarray(r["energy()"])
    size = max(1.0, float(np.ptp(energy)))
    assert np.diff(energy).max() < 1e-4 * size and abs(r.energy.residual) < 1e-3 * size
    assert min(line.dissipated for line in r.energy.lines) > -1e-6 * size
    for (name, one), (other, two) in combinations(solids(m, r).items(), 2):
        if (name in WALLS and other in WALLS) or {name, other} == {"l0", "l1"}:
            continue
        assert between(one, two).min() > -1e-5, f"{name} in {other}\n{m.deck(0.6)}"
    if "gap(line)" in r.names:
        assert np.asarray(r["gap(line)"]).min() > -1e-5
    assert r.time[-1] == 0.6 and r.stats["events"] < 3000


@pytest.mark.parametrize("seed", range(8))
def test_another_order_of_cards_is_the_same_scene(seed):
    """Until motions part that began 1e-12 from each other: over the first impacts."""
    m = Mixed(seed)
    one, other = (emsim.run(m.deck(0.25, "reltol=1e-8", shuffled)) for shuffled in (False, True))
    for name in m.outlines:
        for word in ("x", "y", "angle"):
            column = f"{word}({name})"
            assert one.at(column, 0.25) == pytest.approx(other.at(column, 0.25), abs=1e-5), m.deck(0.25)


def test_the_scenes_hold_all_of_it():
    words = [card.split()[0] for seed in SEEDS for card in Mixed(seed).cards]
    for word in ("ROPE", "STOP", "FRICTION", "SPRING", "JOINT"):
        assert words.count(word) >= 3, word
    text = " ".join(card for seed in SEEDS for card in Mixed(seed).cards)
    for kind in ("polygon(", "disc(", "box("):
        assert text.count(kind) > 5, kind
