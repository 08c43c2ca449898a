"""Random scenes of impacts: piles of blocks, arms between stops, parts that rub; for test_piles.py and tests/bench/piles.py."""

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


def _rub(rng: random.Random) -> str:
    mu = rng.choice((0.0, 0.1, 0.3, 0.6, round(rng.uniform(0.0, 1.0), 2)))
    held = f" mus={mu + 0.1:.2f}" if rng.random() < 0.2 else ""
    return f"e={rng.choice((0.0, 0.3, 0.6, round(rng.uniform(0, 0.9), 2)))} mu={mu}{held}"


def stack(seed: int) -> tuple[str, list[str]]:
    """1 to 3 blocks that may tip, slide and turn: each with two corners over the top of the one below. Deck and its contacts."""
    rng = random.Random(seed)
    cards, touches, height, x, top = [], [], 0.0, 0.0, 0.0
    for k in range(rng.randint(1, 3)):
        half, tall, m = rng.uniform(0.1, 0.3), rng.uniform(0.1, 0.4), 10 ** rng.uniform(-1, 1)
        height += 0.0 if rng.random() < 0.3 else rng.uniform(0.01, 0.3)
        x += rng.uniform(-0.05, 0.05)
        speeds = (
            "" if rng.random() < 0.3 else f"vx={rng.uniform(-2, 2):.3f} omega={rng.uniform(-0.5, 0.5):.3f}"
        )
        inertia = m * (4 * half**2 + tall**2) / 12
        cards.append(f"BODY b{k} m={m:.5g} j={inertia:.5g} x={x:.4f} y={height + tall / 2!r} {speeds}")
        below = "0" if k == 0 else f"b{k - 1}(0,{top:.5f})"
        for side, at in (("l", -half), ("r", half)):
            touches.append(f"c{k}{side}")
            cards.append(f"CONTACT c{k}{side} b{k}({at:.4f},{-tall / 2!r}) {below} line=(0,1) {_rub(rng)}")
        top = tall / 2
        height += tall + 1e-5
    return "\n".join([f"stack {seed}", ".gravity 9.81", *cards]), touches


def box(seed: int) -> tuple[str, list[str]]:
    """1 to 4 balls that spin, in a box with two walls, each against all others."""
    rng = random.Random(seed)
    cards, touches, radii = [], [], []
    for k in range(rng.randint(1, 4)):
        r, m = round(rng.uniform(0.05, 0.115), 4), 10 ** rng.uniform(-1, 1)
        where = f"x={-0.36 + 0.24 * k:.3f} y={rng.uniform(0.13, 0.8):.4f}"
        motion = f"vx={rng.uniform(-3, 3):.3f} vy={rng.uniform(-2, 2):.3f} omega={rng.uniform(-30, 30):.2f}"
        cards.append(f"BODY b{k} m={m:.5g} j={0.4 * m * r * r:.5g} {where} {motion}")
        walls = (("f", "0", "(0,1)"), ("l", "0(-0.5,0)", "(1,0)"), ("r", "0(0.5,0)", "(-1,0)"))
        found = [(f"{name}{k}", f"{at} line={line}") for name, at, line in walls]
        found += [(f"c{j}{k}", f"b{j} rq={other}") for j, other in enumerate(radii)]
        cards += [f"CONTACT {name} b{k} {how} r={r} {_rub(rng)}" for name, how in found]
        touches += [name for name, _ in found]
        radii.append(r)
    return "\n".join([f"box {seed}", ".gravity 9.81", *cards]), touches


def rods(seed: int) -> tuple[str, list[str]]:
    """1 or 2 rods that fall between a floor and two walls, ends first."""
    rng = random.Random(seed)
    cards, touches = [], []
    for k in range(rng.randint(1, 2)):
        length, m, angle = rng.uniform(0.3, 0.8), 10 ** rng.uniform(-1, 1), rng.uniform(-3.1, 3.1)
        cards.append(
            f"BODY b{k} m={m:.5g} j={m * length**2 / 12:.5g} x={rng.uniform(-0.1, 0.1):.3f} y={rng.uniform(0.5, 1):.3f} "
            f"angle={angle:.4f} vx={rng.uniform(-2, 2):.3f} vy={rng.uniform(-2, 1):.3f} omega={rng.uniform(-8, 8):.3f}"
        )
        rub = _rub(rng)
        for end, at in (("a", -length / 2), ("b", length / 2)):
            for name, q, line in (
                ("f", "0", "(0,1)"),
                ("l", "0(-0.6,0)", "(1,0)"),
                ("r", "0(0.6,0)", "(-1,0)"),
            ):
                touches.append(f"{name}{k}{end}")
                cards.append(f"CONTACT {touches[-1]} b{k}({at:.4f},0) {q} line={line} {rub}")
    return "\n".join([f"rods {seed}", ".gravity 9.81", *cards]), touches


def balls(seed: int) -> tuple[str, list[str]]:
    """In space: 1 to 3 balls that spin about any axis, in a box with four walls, each against all others."""
    rng = random.Random(seed)
    cards, touches, radii = [], [], []
    for k in range(rng.randint(1, 3)):
        r, m = round(rng.uniform(0.05, 0.115), 4), 10 ** rng.uniform(-1, 1)
        j = f"{0.4 * m * r * r:.5g}"
        where = f"x={-0.3 + 0.3 * k:.3f} y={rng.uniform(0.13, 0.8):.4f} z={rng.uniform(-0.3, 0.3):.4f}"
        speeds = " ".join(f"v{axis}={rng.uniform(-3, 3):.3f}" for axis in "xyz")
        spins = ",".join(f"{rng.uniform(-30, 30):.2f}" for _ in range(3))
        cards.append(f"BODY b{k} m={m:.5g} j=({j},{j},{j}) {where} {speeds} omega=({spins})")
        walls = (
            ("f", "0", "(0,1,0)"),
            ("l", "0(-0.5,0,0)", "(1,0,0)"),
            ("r", "0(0.5,0,0)", "(-1,0,0)"),
            ("n", "0(0,0,-0.5)", "(0,0,1)"),
            ("s", "0(0,0,0.5)", "(0,0,-1)"),
        )
        found = [(f"{name}{k}", f"{at} line={line}") for name, at, line in walls]
        found += [(f"c{j}{k}", f"b{j} rq={other}") for j, other in enumerate(radii)]
        cards += [f"CONTACT {name} b{k} {how} r={r} {_rub(rng)}" for name, how in found]
        touches += [name for name, _ in found]
        radii.append(r)
    return "\n".join([f"balls {seed}", ".gravity 9.81", *cards]), touches


def dice(seed: int) -> tuple[str, list[str]]:
    """In space: a block that is thrown on a floor, with its eight corners."""
    rng = random.Random(seed)
    a, b, c, m = *(rng.uniform(0.05, 0.2) for _ in range(3)), 10 ** rng.uniform(-1, 1)
    inertia = ",".join(f"{m * (p * p + q * q) / 3:.5g}" for p, q in ((b, c), (a, c), (a, b)))
    speeds = f"vx={rng.uniform(-2, 2):.3f} vy={rng.uniform(-2, 1):.3f} vz={rng.uniform(-2, 2):.3f}"
    spins = ",".join(f"{rng.uniform(-8, 8):.2f}" for _ in range(3))
    turned = ",".join(f"{rng.uniform(-3, 3):.3f}" for _ in range(3))
    cards = [
        f"BODY b m={m:.5g} j=({inertia}) y={rng.uniform(0.35, 0.6):.3f} rot=({turned}) {speeds} omega=({spins})"
    ]
    rub = _rub(rng)
    corners = [(p, q, r) for p in (-a, a) for q in (-b, b) for r in (-c, c)]
    touches = [f"c{k}" for k in range(8)]
    cards += [
        f"CONTACT {name} b({x:.4f},{y:.4f},{z:.4f}) 0 line=(0,1,0) {rub}"
        for name, (x, y, z) in zip(touches, corners, strict=True)
    ]
    return "\n".join([f"dice {seed}", ".gravity 9.81", *cards]), touches


RUBBING = {"stack": stack, "box": box, "rods": rods, "balls": balls, "dice": dice}


def rubbing(kind: str, seed: int, until: float, options: str = "reltol=1e-5") -> tuple[str, list[str]]:
    """Deck of a scene of parts that rub, and its contacts."""
    text, touches = RUBBING[kind](seed)
    shown = " ".join(f"hits({c}) gap({c})" for c in touches)
    return (
        f"{text}\n.options {options}\n.tran 20m {until}\n.print tran energy() ke() {shown}\n.end\n",
        touches,
    )
