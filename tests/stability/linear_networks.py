"""Random linear networks whose solution is known at every instant: for test_linear_networks.py.

The reference is a modified nodal analysis of its own,  E x' + A x = B w,  with the sources as solutions of w' = S w (a sine
and its cosine; a line's value and its slope), so that the whole is  E z' + A z = 0.  What such a system can do is the range
of T^k, T = (s E + A)^-1 E, for k from its index on; there  y' = -(T^-1 - s) y,  and a matrix exponential is the solution,
capacitor loops and inductor cutsets included. At a corner of a source w jumps, and z goes onto that range along the null
space of T^k.
Times are microseconds.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

US = 1e-6
SPAN = 20.0
GRID = 0.05
SHIFT = 1.7
SMALL = 1e-10  # singular values below this part of the largest are none
CLEAR = 1e3  # ... and are told by a gap of that much


class Unsuitable(Exception):
    """There is nothing to compare with; says why."""


def reached(t: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the range of T^k, k from the index on: what T makes of it has as many directions."""
    basis = np.eye(len(t))
    while True:
        u, sigma, _ = np.linalg.svd(t @ basis, full_matrices=False)
        rank = int((sigma > SMALL * sigma[0]).sum())
        if rank < len(sigma) and sigma[rank - 1] < CLEAR * sigma[rank]:
            raise Unsuitable("ranks cannot be told")
        if rank == basis.shape[1]:
            return basis
        basis = u[:, :rank]


@dataclass
class Wave:
    """A source's value: a constant and either a sine or straight lines."""

    offset: float
    amplitude: float = 0.0
    omega: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    pulse: bool = False  # the lines are written as one

    @property
    def text(self) -> str:
        if self.pulse:
            _, start, top, fall, end = self.times
            lengths = " ".join(
                f"{t:.10g}u" for t in (start, top - start, end - fall, fall - top, 10.0 * SPAN)
            )
            return f"PULSE(0 {self.values[2]:.10g} {lengths})"
        if self.times:
            points = " ".join(f"{t:.10g}u {v:.10g}" for t, v in zip(self.times, self.values, strict=True))
            return f"PWL({points})"
        if self.amplitude:
            return f"SIN({self.offset:.10g} {self.amplitude:.10g} {self.omega / (2 * np.pi):.15g}meg)"
        return f"{self.offset:.10g}"

    def state(self, t: float) -> np.ndarray:
        """w behind t: value, slope; or offset, sine, cosine."""
        if self.times:
            k = int(np.searchsorted(self.times, t + 1e-12, side="right"))
            if k == len(self.times):
                return np.array([self.values[-1], 0.0])
            rise = (self.values[k] - self.values[k - 1]) / (self.times[k] - self.times[k - 1])
            return np.array([self.values[k - 1] + rise * (t - self.times[k - 1]), rise])
        phase = self.omega * t
        return np.array([self.offset, self.amplitude * np.sin(phase), self.amplitude * np.cos(phase)])

    @property
    def block(self) -> np.ndarray:
        if self.times:
            return np.array([[0.0, 1.0], [0.0, 0.0]])
        return np.array([[0.0, 0.0, 0.0], [0.0, 0.0, self.omega], [0.0, -self.omega, 0.0]])

    @property
    def reads(self) -> np.ndarray:
        return np.array([1.0, 0.0]) if self.times else np.array([1.0, 1.0, 0.0])


def wave(r: random.Random, size: float) -> Wave:
    kind = r.choice(["sin", "sin", "pwl", "pulse"])
    if kind == "sin":
        return Wave(r.choice([0.0, 0.5 * size]), size * r.uniform(0.3, 1.0), 2 * np.pi * r.uniform(0.05, 0.4))
    if kind == "pulse":
        start, rise, width = r.uniform(1, 4), r.uniform(0.05, 0.5), r.uniform(2, 6)
        times = [0.0, start, start + rise, start + rise + width, start + 2 * rise + width]
        times = [float(f"{t:.10g}") for t in times]  # as they are written
        values = [0.0, 0.0, size, size, 0.0]
    else:
        times = [0.0, *sorted(round(r.uniform(1, SPAN - 1), 2) for _ in range(r.randint(2, 4)))]
        values = [0.0, *(round(size * r.uniform(-1, 1), 3) for _ in times[1:])]
    return Wave(0.0, times=times, values=values)


@dataclass
class Network:
    """Cards, and the matrices of E x' + A x = B w."""

    cards: list[str]
    unknowns: list[str]  # as columns are called
    e: np.ndarray
    a: np.ndarray
    b: np.ndarray
    waves: list[Wave]

    def deck(self, options: str = "") -> str:
        end = [f".options {options}"] if options else []
        return "\n".join(
            ["random linear network", *self.cards, f".tran {GRID}u {SPAN}u", ".save all", *end, ".end", ""]
        )

    def corners(self) -> list[float]:
        return sorted({t for w in self.waves for t in w.times if 0.0 < t < SPAN})

    def scaled(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """E, A, B with the sources as further unknowns, in volts, milliamperes, microseconds, and what an unknown is worth in
        them: kilohms, nanofarads and millihenries then, so that everything is of order one and ranks can be told."""
        n, sizes = len(self.unknowns), [len(w.block) for w in self.waves]
        m = n + sum(sizes)
        unit = np.array([1.0 if u.startswith("v") else 1e-3 for u in self.unknowns])
        nodes = sum(u.startswith("v") for u in self.unknowns)
        row = np.array([1e3] * nodes + [1.0] * (n - nodes))
        e, a = np.eye(m), np.zeros((m, m))
        e[:n, :n], a[:n, :n] = row[:, None] * self.e * unit, row[:, None] * self.a * unit
        b = row[:, None] * self.b
        at = n
        for k, w in enumerate(self.waves):
            a[:n, at : at + sizes[k]] = -np.outer(b[:, k], w.reads)
            a[at : at + sizes[k], at : at + sizes[k]] = -w.block
            at += sizes[k]
        return e, a, b, unit

    def solution(self, times: np.ndarray, start: np.ndarray | None = None) -> np.ndarray:
        """x at each of the times [us], a row each, just before a corner where one is; from `start`, or from the operating point.
        Raises Unsuitable where nothing determines the start, where ranks cannot be told, or where the network runs away."""
        n = len(self.unknowns)
        e, a, b, unit = self.scaled()
        if np.linalg.cond(SHIFT * e + a) > 1e10:
            raise Unsuitable("no solution, or many")
        t = np.linalg.solve(SHIFT * e + a, e)
        v, left = reached(t), reached(t.T)
        if v.shape != left.shape:
            raise Unsuitable("ranks cannot be told")
        rate = -(np.linalg.inv(v.T @ t @ v) - SHIFT * np.eye(v.shape[1]))
        if np.linalg.eigvals(rate).real.max() * SPAN > 3.0:
            raise Unsuitable("runs away")
        # along the null space of T^k, which its left counterpart is orthogonal to
        onto = np.linalg.solve(left.T @ v, left.T)

        values, vectors = np.linalg.eig(rate)
        inverse = np.linalg.inv(vectors) if np.linalg.cond(vectors) < 1e5 else None

        def after(time: float, y: np.ndarray) -> np.ndarray:
            if inverse is None:
                return expm(rate * time) @ y
            return (vectors @ (np.exp(values * time) * (inverse @ y))).real

        def w_at(now: float) -> np.ndarray:
            return np.concatenate([w.state(now) for w in self.waves])

        if start is None:
            if np.linalg.cond(a[:n, :n]) > 1e10:
                raise Unsuitable("nothing determines the start")
            x = np.linalg.solve(a[:n, :n], b @ np.array([w.reads @ w.state(0.0) for w in self.waves]))
        else:
            x = start / unit
        y, now = onto @ np.concatenate([x, w_at(0.0)]), 0.0
        out, corners = np.empty((len(times), n)), [*self.corners(), np.inf]
        for i, t_i in enumerate(times):
            while corners[0] < t_i:
                z = v @ after(corners[0] - now, y)
                now = corners.pop(0)
                y = onto @ np.concatenate([z[:n], w_at(now)])
            out[i] = (v @ after(t_i - now, y))[:n] * unit
        return out


@dataclass
class Cards:
    """Lines of a deck with what they mean: conductances and capacitances by node, branches, controlled sources."""

    r: random.Random
    count: int  # nodes
    lines: list[str] = field(default_factory=list)
    stamps: list[tuple[str, int, int, float]] = field(
        default_factory=list
    )  # conductance, capacitance, current of nodes
    branches: list[tuple[str, int, int, float, int]] = field(
        default_factory=list
    )  # name, ends, henry, wave (-1: none)
    controlled: list[tuple[str, int, int, int, int, float]] = field(default_factory=list)
    waves: list[Wave] = field(default_factory=list)
    coupled: list[tuple[str, str, float]] = field(default_factory=list)  # coils, mutual inductance

    def ends(self) -> tuple[int, int]:
        a = self.r.randint(1, self.count)
        b = self.r.choice([k for k in range(self.count + 1) if k != a])
        return a, b

    def add(self, letter: str, a: int, b: int, value: str) -> str:
        name = f"{letter}{len(self.lines) + 1}"
        self.lines.append(f"{name} {a} {b} {value}")
        return name.lower()

    def resistor(self, a: int, b: int, ohm: float) -> None:
        ohm = float(f"{ohm:.4g}")
        self.add("R", a, b, f"{ohm:.10g}")
        self.stamps.append(("g", a, b, 1.0 / ohm))

    def capacitor(self, a: int, b: int, nano: float) -> None:
        nano = float(f"{nano:.4g}")
        self.add("C", a, b, f"{nano:.10g}n")
        self.stamps.append(("c", a, b, nano * 1e-9 / US))

    def coil(self, a: int, b: int, milli: float) -> None:
        milli = float(f"{milli:.4g}")
        name = self.add("L", a, b, f"{milli:.10g}m")
        self.branches.append((name, a, b, milli * 1e-3 / US, -1))

    def couple(self, name: str, other: str, k: float) -> None:
        henry = {coil[0]: coil[3] for coil in self.branches}
        k = float(f"{k:.3g}")
        self.lines.append(f"K{len(self.lines) + 1} {name} {other} {k:g}")
        self.coupled.append((name, other, k * (henry[name] * henry[other]) ** 0.5))

    def supply(self, a: int, b: int, size: float, driven: Wave | None = None) -> None:
        self.waves.append(driven or wave(self.r, size))
        self.branches.append((self.add("V", a, b, self.waves[-1].text), a, b, 0.0, len(self.waves) - 1))

    def current(self, a: int, b: int, size: float, driven: Wave | None = None) -> None:
        self.waves.append(driven or wave(self.r, size))
        self.add("I", a, b, self.waves[-1].text)
        self.stamps.append(("i", a, b, len(self.waves) - 1))

    def source(self, letter: str) -> None:
        """A controlled one, by voltages somewhere or by the current of the first supply."""
        r = self.r
        a, b = self.ends()
        if letter in "EH":
            self.count += 1
            b, inner = 0, self.count
            self.resistor(inner, a, 10 ** r.uniform(2, 3.5))
            a = inner
        c = d = 0
        if letter in "EG":
            c, d = self.ends()
            gain = r.uniform(-1.5, 1.5) if letter == "E" else r.uniform(-1, 1) * 1e-3
            name = self.add(letter, a, b, f"{c} {d} {gain:.6g}")
        else:
            gain = r.uniform(-0.8, 0.8) if letter == "F" else r.uniform(-300, 300)
            name = self.add(letter, a, b, f"{self.branches[0][0]} {gain:.6g}")
        self.controlled.append((name, a, b, c, d, float(f"{gain:.6g}")))

    def network(self) -> Network:
        extra = [c for c in self.controlled if c[0][0] in "eh"]
        n = self.count + len(self.branches) + len(extra)
        e, a, b = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, len(self.waves)))

        def put(m: np.ndarray, row: int, col: int, v: float) -> None:
            if row > 0 and col > 0:
                m[row - 1, col - 1] += v

        for kind, p, q, v in self.stamps:
            if kind == "i":
                for node, sign in ((p, -1.0), (q, 1.0)):
                    if node:
                        b[node - 1, int(v)] += sign
                continue
            m = a if kind == "g" else e
            for row, sign in ((p, 1.0), (q, -1.0)):
                put(m, row, p, sign * v)
                put(m, row, q, -sign * v)
        unknowns = [f"v({k})" for k in range(1, self.count + 1)]
        place = {}
        for name, p, q, henry, k in self.branches:
            row = len(unknowns) + 1
            place[name] = row
            unknowns.append(f"i({name})")
            for node, sign in ((p, 1.0), (q, -1.0)):
                put(a, node, row, sign)
                put(a, row, node, sign)
            if k >= 0:
                b[row - 1, k] = 1.0
            else:
                e[row - 1, row - 1] = -henry
        for name, other, mutual in self.coupled:
            for row, col in ((name, other), (other, name)):
                e[place[row] - 1, place[col] - 1] = -mutual
        sense = place[self.branches[0][0]]
        for name, p, q, c, d, gain in self.controlled:
            letter = name[0]
            if letter in "gf":
                for node, sign in ((p, gain), (q, -gain)):
                    if letter == "f":
                        put(a, node, sense, sign)
                    else:
                        put(a, node, c, sign)
                        put(a, node, d, -sign)
                continue
            row = len(unknowns) + 1
            unknowns.append(f"i({name})")
            for node, sign in ((p, 1.0), (q, -1.0)):
                put(a, node, row, sign)
                put(a, row, node, sign)
            if letter == "h":
                put(a, row, sense, -gain)
            else:
                put(a, row, c, -gain)
                put(a, row, d, gain)
        return Network(self.lines, unknowns, e, a, b, self.waves)


def network(seed: int) -> Network:
    """R, L, C, sources of four kinds and controlled ones, with loops of capacitors and cutsets of coils on purpose."""
    r = random.Random(seed)
    count = r.randint(3, 7)
    n = Cards(r, count)
    # a tree that holds every node, then more of everything
    n.supply(1, 0, r.choice([1.0, 5.0]))
    for k in range(2, count + 1):
        to = r.randint(1, k - 1)
        if r.random() < 0.25:
            n.coil(k, to, 10 ** r.uniform(-2, 0))
        else:
            n.resistor(k, to, 10 ** r.uniform(1.5, 3.5))
        if r.random() < 0.5:
            n.resistor(k, 0, 10 ** r.uniform(2.5, 4.5))
    for _ in range(r.randint(1, count)):
        a, b = n.ends()
        n.capacitor(a, b, 10 ** r.uniform(-1, 1))
    if r.random() < 0.5:  # across the supply, and a loop through it
        n.capacitor(1, 0, 10 ** r.uniform(-1, 1))
    for _ in range(r.randint(0, 2)):
        a, b = n.ends()
        n.coil(a, b, 10 ** r.uniform(-2, 0))
    if r.random() < 0.4:  # a star of coils that nothing else touches
        n.count += 1
        for to in r.sample(range(2, n.count), min(3, n.count - 2)):
            n.coil(n.count, to, 10 ** r.uniform(-2, 0))
    if r.random() < 0.4:
        a, b = n.ends()
        n.current(a, b, 2e-3)
    for letter in r.sample("EGFH", r.choice([0, 0, 1, 1, 2])):
        n.source(letter)
    return n.network()


def capacitor_loops(seed: int) -> Network:
    """Loops of capacitors through one or two supplies, whose currents an F, an H or both read: of index 2, or 3 where a capacitor
    or a coil stands behind them."""
    r = random.Random(10_000 + seed)
    count = r.randint(3, 6)
    n = Cards(r, count)
    n.supply(1, 0, r.choice([1.0, 5.0]))
    if second := r.random() < 0.4:
        n.supply(2, 0, r.choice([1.0, 5.0]))
    for k in range(2 + second, count + 1):
        n.resistor(k, r.randint(1, k - 1), 10 ** r.uniform(1.5, 3.5))
        if r.random() < 0.4:
            n.resistor(k, 0, 10 ** r.uniform(2.5, 4.5))
    # a ring of capacitors through the supplies, with others across parts of it
    ring = r.sample(range(1, count + 1), r.randint(1, count))
    if 1 not in ring:
        ring.insert(0, 1)
    for a, b in zip([0, *ring], [*ring, 0], strict=True):
        n.capacitor(max(a, b), min(a, b), 10 ** r.uniform(-1, 1))
    for _ in range(r.randint(0, 2)):
        a, b = n.ends()
        n.capacitor(a, b, 10 ** r.uniform(-1, 1))
    if r.random() < 0.3:
        a, b = n.ends()
        n.coil(a, b, 10 ** r.uniform(-2, 0))
    if r.random() < 0.3:
        a, b = n.ends()
        n.current(a, b, 2e-3)
    for letter in r.choice(["F", "H", "FH", "FG", "HE"]):
        n.source(letter)
    return n.network()


def lines_of(r: random.Random, size: float) -> Wave:
    """A PULSE or a PWL, or now and then a sine."""
    made = wave(r, size)
    while not made.times and r.random() < 0.8:
        made = wave(r, size)
    made.times = [round(t, 3) for t in made.times]
    made.pulse = made.values == [0.0, 0.0, size, size, 0.0]
    return made


def driven(seed: int) -> Network:
    """What a source's slope drives: capacitors across supplies and between them, coils that carry a source's current, alone, in
    series, in stars with others and coupled ones, with resistors within, beside a network of everything."""
    r = random.Random(20_000 + seed)
    count = r.randint(3, 5)
    n = Cards(r, count)
    n.supply(1, 0, 0.0, lines_of(r, r.choice([1.0, 5.0])))
    held = [1]
    if r.random() < 0.5:
        n.supply(2, r.choice([0, 0, 1]), 0.0, lines_of(r, r.choice([1.0, 5.0])))
        held.append(2)
    for k in range(1 + len(held), count + 1):
        n.resistor(k, r.randint(1, k - 1), 10 ** r.uniform(1.5, 3.5))
        if r.random() < 0.5:
            n.resistor(k, 0, 10 ** r.uniform(2.5, 4.5))
    for _ in range(r.randint(1, 3)):  # capacitors that the supplies fix, or divide
        n.capacitor(r.choice(held), r.choice([0, *range(1 + len(held), count + 1)]), 10 ** r.uniform(-1, 1))
    if len(held) == 2:
        n.capacitor(1, 2, 10 ** r.uniform(-1, 1))
    for _ in range(r.randint(0, 2)):
        a, b = n.ends()
        n.capacitor(a, b, 10 ** r.uniform(-1, 1))
    for _ in range(r.randint(1, 2)):  # a current into coils and nothing else
        n.count += 1
        star = n.count
        n.current(r.choice([0, 0, r.randint(1, count)]), star, 0.0, lines_of(r, 2e-3))
        if r.random() < 0.5:  # behind a resistor
            n.count += 1
            n.resistor(star, n.count, 10 ** r.uniform(1, 3))
            star = n.count
        for to in r.sample(range(count + 1), r.randint(1, min(3, count))):
            n.coil(star, to, 10 ** r.uniform(-2, 0))
    coils = [name for name, *_, k in n.branches if k < 0]
    if len(coils) > 1 and r.random() < 0.5:
        n.couple(*r.sample(coils, 2), r.uniform(0.2, 0.9))
    for letter in r.sample("EGFH", r.choice([0, 1, 1, 2])):
        n.source(letter)
    return n.network()
