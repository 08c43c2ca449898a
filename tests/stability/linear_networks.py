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
INDEX = 3
SMALL = 1e-9  # singular values below this part of the largest are none


@dataclass
class Wave:
    """A source's value: a constant and either a sine or straight lines."""

    offset: float
    amplitude: float = 0.0
    omega: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    @property
    def text(self) -> str:
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

    def solution(self, times: np.ndarray) -> np.ndarray | None:
        """x at each of the times [us], a row each, just before a corner where one is; None where nothing determines the
        start, where ranks cannot be told, or where the network runs away."""
        n, sizes = len(self.unknowns), [len(w.block) for w in self.waves]
        m = n + sum(sizes)
        e, a = np.eye(m), np.zeros((m, m))
        e[:n, :n], a[:n, :n] = self.e, self.a
        at = n
        for k, w in enumerate(self.waves):
            a[:n, at : at + sizes[k]] = -np.outer(self.b[:, k], w.reads)
            a[at : at + sizes[k], at : at + sizes[k]] = -w.block
            at += sizes[k]
        if np.linalg.cond(self.a) > 1e12:
            return None
        shift = 1.7
        t = np.linalg.solve(shift * e + a, e)
        u, sigma, _ = np.linalg.svd(np.linalg.matrix_power(t, INDEX))
        gaps = sigma[:-1] / np.maximum(sigma[1:], 1e-300)
        rank = int(np.argmax(gaps)) + 1
        if gaps[rank - 1] < 1e3 or rank < sum(sizes):
            return None
        v = u[:, :rank]
        core = v.T @ t @ v
        if np.linalg.cond(core) > 1e10:
            return None
        rate = -(np.linalg.inv(core) - shift * np.eye(rank))
        if np.linalg.eigvals(rate).real.max() * SPAN > 3.0:
            return None
        # along the null space of T^k: its left complement
        _, _, right = np.linalg.svd(np.linalg.matrix_power(t, INDEX))
        onto = np.linalg.solve(right[:rank] @ v, right[:rank])

        def w_at(now: float) -> np.ndarray:
            return np.concatenate([w.state(now) for w in self.waves])

        inputs = np.array([w.reads @ w.state(0.0) for w in self.waves])
        x = np.linalg.solve(self.a, self.b @ inputs)
        y, now = onto @ np.concatenate([x, w_at(0.0)]), 0.0
        out, corners = np.empty((len(times), n)), [*self.corners(), np.inf]
        for i, t_i in enumerate(times):
            while corners[0] < t_i:
                z = v @ expm(rate * (corners[0] - now)) @ y
                now = corners.pop(0)
                y = onto @ np.concatenate([z[:n], w_at(now)])
            out[i] = (v @ expm(rate * (t_i - now)) @ y)[:n]
        return out


def network(seed: int) -> Network:
    """R, L, C, sources of four kinds and controlled ones, with loops of capacitors and cutsets of coils on purpose."""
    r = random.Random(seed)
    count = r.randint(3, 7)
    cards: list[str] = []
    stamps: list[tuple[str, int, int, float]] = []  # conductance, capacitance of nodes
    branches: list[tuple[str, int, int, float, int]] = []  # name, ends, henry, wave (-1: none)
    controlled: list[tuple[str, int, int, int, int, float]] = []
    waves: list[Wave] = []

    def ends() -> tuple[int, int]:
        a = r.randint(1, count)
        b = r.choice([k for k in range(count + 1) if k != a])
        return a, b

    def add(letter: str, a: int, b: int, value: str) -> str:
        name = f"{letter}{len(cards) + 1}"
        cards.append(f"{name} {a} {b} {value}")
        return name.lower()

    def resistor(a: int, b: int, ohm: float) -> None:
        ohm = float(f"{ohm:.4g}")
        add("R", a, b, f"{ohm:.10g}")
        stamps.append(("g", a, b, 1.0 / ohm))

    def capacitor(a: int, b: int, nano: float) -> None:
        nano = float(f"{nano:.4g}")
        add("C", a, b, f"{nano:.10g}n")
        stamps.append(("c", a, b, nano * 1e-9 / US))

    def coil(a: int, b: int, milli: float) -> None:
        milli = float(f"{milli:.4g}")
        name = add("L", a, b, f"{milli:.10g}m")
        branches.append((name, a, b, milli * 1e-3 / US, -1))

    # a tree that holds every node, then more of everything
    supply = wave(r, r.choice([1.0, 5.0]))
    waves.append(supply)
    branches.append((add("V", 1, 0, supply.text), 1, 0, 0.0, 0))
    for k in range(2, count + 1):
        to = r.randint(1, k - 1)
        if r.random() < 0.25:
            coil(k, to, 10 ** r.uniform(-2, 0))
        else:
            resistor(k, to, 10 ** r.uniform(1.5, 3.5))
        if r.random() < 0.5:
            resistor(k, 0, 10 ** r.uniform(2.5, 4.5))
    for _ in range(r.randint(1, count)):
        a, b = ends()
        capacitor(a, b, 10 ** r.uniform(-1, 1))
    if r.random() < 0.5:  # across the supply, and a loop through it
        capacitor(1, 0, 10 ** r.uniform(-1, 1))
    for _ in range(r.randint(0, 2)):
        a, b = ends()
        coil(a, b, 10 ** r.uniform(-2, 0))
    if r.random() < 0.4:  # a star of coils that nothing else touches
        count += 1
        for to in r.sample(range(2, count), min(3, count - 2)):
            coil(count, to, 10 ** r.uniform(-2, 0))
    if r.random() < 0.4:
        a, b = ends()
        waves.append(wave(r, 2e-3))
        add("I", a, b, waves[-1].text)
        stamps.append(("i", a, b, len(waves) - 1))
    for letter in r.sample("EGFH", r.choice([0, 0, 1, 1, 2])):
        a, b = ends()
        if letter in "EH":
            count += 1
            b, inner = 0, count
            resistor(inner, a, 10 ** r.uniform(2, 3.5))
            a = inner
        if letter in "EG":
            c, d = ends()
            gain = r.uniform(-1.5, 1.5) if letter == "E" else r.uniform(-1, 1) * 1e-3
            name = add(letter, a, b, f"{c} {d} {gain:.6g}")
        else:
            c = d = 0
            gain = r.uniform(-0.8, 0.8) if letter == "F" else r.uniform(-300, 300)
            name = add(letter, a, b, f"{branches[0][0]} {gain:.6g}")
        controlled.append((name, a, b, c, d, float(f"{gain:.6g}")))

    extra = [c for c in controlled if c[0][0] in "eh"]
    n = count + len(branches) + len(extra)
    e, a, b = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, len(waves)))

    def put(m: np.ndarray, row: int, col: int, v: float) -> None:
        if row > 0 and col > 0:
            m[row - 1, col - 1] += v

    for kind, p, q, v in stamps:
        if kind == "i":
            for node, sign in ((p, -1.0), (q, 1.0)):
                if node:
                    b[node - 1, int(v)] += sign
            continue
        m = a if kind == "g" else e
        for row, sign in ((p, 1.0), (q, -1.0)):
            put(m, row, p, sign * v)
            put(m, row, q, -sign * v)
    unknowns = [f"v({k})" for k in range(1, count + 1)]
    place = {}
    for name, p, q, henry, k in branches:
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
    sense = place[branches[0][0]]
    for name, p, q, c, d, gain in controlled:
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
    return Network(cards, unknowns, e, a, b, waves)
