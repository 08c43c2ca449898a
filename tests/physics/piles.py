"""Random scenes of impacts: piles of blocks, rows of balls, arms between stops; for test_piles.py and tests/bench/piles.py."""

from __future__ import annotations

import random


def pile(seed: int) -> tuple[str, list[str], list[float]]:
    """1 to 5 blocks let fall on each other in one shaft: deck, joints from below, masses."""
    rng = random.Random(seed)
    count = rng.randint(1, 5)
    cards, joints, masses, height = [], [], [], 0.0
    for k in range(count):
        height += (0.5 if k else 0.0) + (0.0 if rng.random() < 0.2 else rng.uniform(0.01, 0.6))
        masses.append(round(10 ** rng.uniform(-1, 1), 4))
        speed = 0.0 if rng.random() < 0.5 else round(rng.uniform(-3, 3), 3)
        cards += [f"BODY b{k} m={masses[-1]}", f"JOINT j{k} 0 b{k} slide axis=(0,1) ic=({height!r},{speed})"]
        joints.append(f"j{k}")
    e = [rng.choice((0.0, 0.2, 0.5, 0.8, round(rng.uniform(0, 0.9), 2))) for _ in range(count)]
    cards.append(f"STOP c0 j0 min=0 e={e[0]}")
    cards += [f"CONTACT c{k} b{k} b{k - 1} line=(0,1) r=0.5 e={e[k]}" for k in range(1, count)]
    if rng.random() < 0.3:
        cards.append(f"FRICTION f j{rng.randrange(count)} fc={round(rng.uniform(0.1, 3), 2)}")
    return "\n".join([f"pile {seed}", ".gravity 9.81", *cards]), joints, masses


def deck(text: str, joints: list[str], until: float, options: str = "reltol=1e-5") -> str:
    hits = " ".join(f"hits(c{k})" for k in range(len(joints)))
    return f"{text}\n.options {options}\n.tran 20m {until}\n.print tran energy() ke() {hits}\n.end\n"


def arm(seed: int) -> tuple[str, list[str]]:
    """A chain of 1 to 4 links between stops at every joint."""
    rng = random.Random(seed)
    cards, joints, length = [], [], 0.0
    for k in range(rng.randint(1, 4)):
        before = "0" if k == 0 else f"b{k - 1}({length},0)"
        length = round(rng.uniform(0.2, 0.6), 3)
        start = f"({rng.uniform(-1, 1):.4f},{rng.uniform(-8, 8):.4f})"
        cards += [
            f"BODY b{k} shape=rod({length}) m={rng.uniform(0.1, 2):.3f}",
            f"JOINT j{k} {before} b{k} pin {'zero=-90deg ' if k == 0 else ''}ic={start}",
            f"STOP c{k} j{k} min={rng.uniform(-1.5, -1.05):.3f} max={rng.uniform(1.05, 1.5):.3f} e={rng.uniform(0, 1):.3f}",
        ]
        joints.append(f"j{k}")
    return "\n".join([f"arm {seed}", ".gravity 9.81", *cards]), joints
