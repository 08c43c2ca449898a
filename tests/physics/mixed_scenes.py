"""Random scenes of all that touches, hangs and rubs in a box, in the plane: convex shapes, arms of links with friction and stops,
ropes, springs; for test_mixed_scenes.py."""

from __future__ import annotations

import random
from math import cos, pi, sin

from outlines import box

WALLS = {"floor": (2, 0.2, 0, -0.1), "left": (0.2, 2, -0.7, 0.8), "right": (0.2, 2, 0.7, 0.8)}


class Mixed:
    """`cards` in an order that may be changed but for the first ones; outlines of bodies: corners, or a radius."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.seed = seed
        self.cards: list[str] = [
            f"SHAPE {name} 0 box({w},{h}) at=({x},{y})" for name, (w, h, x, y) in WALLS.items()
        ]
        self.outlines: dict[str, list[tuple[float, float]] | float] = {}
        self.loose: list[str] = []
        self.thrown()
        if self.rng.random() < 0.7:
            self.arm()
        if self.rng.random() < 0.6:
            self.rope()
        e, mu = self.rng.choice((0.0, 0.3, 0.6)), self.rng.choice((0.0, 0.1, 0.4, 0.8))
        self.cards.append(f"CONTACT touch all e={e} mu={mu}")

    def number(self, low: float, high: float) -> float:
        return round(self.rng.uniform(low, high), 4)

    def shape(self, size: float) -> tuple[str, list[tuple[float, float]] | float]:
        """A word of a deck, and its outline."""
        kind = self.rng.choice(("box", "polygon", "disc"))
        if kind == "disc":
            r = round(size * self.rng.uniform(0.6, 1.0), 4)
            return f"disc({r})", r
        if kind == "box":
            w, h = (round(size * self.rng.uniform(0.8, 1.6), 4) for _ in range(2))
            return f"box({w},{h})", box(w, h)
        n, turn = self.rng.randint(3, 6), self.rng.uniform(0, 2 * pi)
        angles = [turn + 2 * pi * (k + self.rng.uniform(-0.2, 0.2)) / n for k in range(n)]
        corners = [(round(size * cos(a), 4), round(size * sin(a), 4)) for a in angles]
        return "polygon(" + ",".join(f"{x},{y}" for x, y in corners) + ")", corners

    def thrown(self) -> None:
        """Bodies side by side above the floor, that fly, spin and fall."""
        for k in range(self.rng.randint(1, 2)):
            text, outline = self.shape(self.rng.uniform(0.05, 0.09))
            name, m = f"b{k}", self.number(0.2, 2)
            motion = f"vx={self.number(-2, 2)} vy={self.number(-2, 1)} omega={self.number(-8, 8)}"
            where = f"x={-0.35 + 0.3 * k:.2f} y={self.number(0.12, 0.4)} angle={self.number(-3, 3)}"
            self.cards.append(f"BODY {name} m={m} shape={text} {where} {motion}")
            self.outlines[name] = outline
            self.loose.append(name)

    def arm(self) -> None:
        """Links that hang from above, with friction, stops or a spring at their joints; their ends may touch the others."""
        length, before = self.number(0.15, 0.25), "0(0.2,1.1)"
        for k in range(self.rng.randint(1, 2)):
            name, joint = f"l{k}", f"h{k}"
            zero = " zero=-90deg" if k == 0 else ""
            self.cards += [
                f"BODY {name} shape=rod({length},0.02) m={self.number(0.1, 1)}",
                f"JOINT {joint} {before} {name} pin{zero} ic=({self.number(-0.6, 0.6)},{self.number(-6, 6)})",
            ]
            self.outlines[name] = box(length, 0.02, length / 2)
            before = f"{name}({length},0)"
            more = self.rng.choice(("", "friction", "stop", "spring"))
            if more == "friction":
                self.cards.append(f"FRICTION f{k} {joint} fc={self.number(0.01, 0.3)}")
            elif more == "stop":
                e = self.rng.choice((0.0, 0.5))
                self.cards.append(f"STOP s{k} {joint} min=-1.2 max=1.2 e={e}")
            elif more == "spring":
                self.cards.append(f"SPRING k{k} {joint} k={self.number(0.5, 5)}")

    def rope(self) -> None:
        """From above the first body to it."""
        self.cards.append(f"ROPE line 0(-0.35,1.1) {self.loose[0]} slack={self.number(0.0, 0.3)} e=0")

    def deck(self, until: float, options: str = "reltol=1e-5", shuffled: bool = False) -> str:
        """With all cards in another order, which changes no motion."""
        cards = list(self.cards)
        if shuffled:
            random.Random(self.seed + 1).shuffle(cards)
        seen = " ".join(f"{word}({name})" for name in self.outlines for word in ("x", "y", "angle"))
        more = "gap(line)" if any(card.startswith("ROPE") for card in cards) else ""
        lines = [f"mixed {self.seed}", ".gravity 9.81", *cards, f".options {options}"]
        return "\n".join([*lines, f".tran 5m {until}", f".print tran energy() {seen} {more}", ".end", ""])
