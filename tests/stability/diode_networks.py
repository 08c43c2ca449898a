"""Random networks of diodes, switches and logic, solved by fine steps of a method of its own: for test_diode_networks.py.

Nodal analysis with capacitors to ground at every node, so that nothing jumps but the sources: TR-BDF2 (Bank et al. 1985) in steps
far finer than what moves, every corner of a source at the end of one, and Newton's method on dense matrices. Switches turn as
ngspice's do, exactly at their threshold included, and only between steps. Microseconds, volts, milliamperes, kilohms, nanofarads.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass, field
from functools import cache

import numpy as np
from conditional_networks import Switch

SPAN = 200.0  # us
STEP = 0.05
ROWS = 100
LEVELS = (0.0, 1.0, 2.0, 2.5, 5.0)
VT = 1.380649e-23 * 300.15 / 1.602176634e-19
GAMMA = 2.0 - math.sqrt(2.0)
NEWTON = 60


@dataclass
class Source:
    """A sine, or straight lines with their corners on the grid of the steps; a node of its own."""

    node: str
    text: str
    amplitude: float = 0.0
    omega: float = 0.0
    times: list[float] = field(default_factory=list)
    values: list[float] = field(default_factory=list)

    def at(self, t: float) -> float:
        return (
            float(np.interp(t, self.times, self.values))
            if self.times
            else self.amplitude * math.sin(self.omega * t)
        )


@dataclass
class Diode:
    """i = is (exp(v / n VT) - 1), and the charge of its junction; rs stands in the deck as a resistor of its own."""

    anode: int
    cathode: int
    saturation: float
    n: float
    cjo: float

    def current(self, v: float) -> tuple[float, float]:
        x = v / (self.n * VT)
        if x > 60.0:  # never in the solution
            e = math.exp(60.0)
            return self.saturation * (e * (x - 59.0) - 1.0), self.saturation * e / (self.n * VT)
        e = math.exp(x) if x > -60.0 else 0.0
        return self.saturation * (e - 1.0), self.saturation * e / (self.n * VT)

    def charge(self, v: float) -> tuple[float, float]:
        """vj = 1, m = 0.5, fc = 0.5."""
        if v < 0.5:
            root = math.sqrt(1.0 - v)
            return 2.0 * self.cjo * (1.0 - root), self.cjo / root
        c = self.cjo / 0.5**1.5
        q = 2.0 * self.cjo * (1.0 - math.sqrt(0.5))
        return q + c * (0.25 * (v - 0.5) + 0.25 * (v * v - 0.25)), c * (0.25 + 0.5 * v)


@dataclass
class Network:
    seed: int
    sources: list[Source]
    lines: list[str]
    nodes: list[str]  # unknown ones
    resistors: list[tuple[int | str, int | str, float]]
    capacitors: list[tuple[int, float]]  # to ground
    diodes: list[Diode]
    switches: list[tuple[int | str, int | str, Switch]]
    gates: list[tuple[int, str, str, float]]  # 1 kohm from 5 V to this node where a source is beyond a level

    def deck(self, options: str = "") -> str:
        sources = [f"V{s.node} {s.node} 0 {s.text}" for s in self.sources]
        text = [f"diodes, network {self.seed}", *sources, *self.lines, f".tran {SPAN / ROWS:g}u {SPAN:g}u"]
        return "\n".join([*text, *([f".options {options}"] if options else []), ".end", ""])

    def solution(self) -> dict[str, np.ndarray]:
        """Node voltages at the rows of the print grid."""
        n = len(self.nodes)
        known = {s.node: s for s in self.sources}
        for _, _, switch in self.switches:
            switch.start(known[switch.control].at(0.0))
        c = np.zeros(n)
        for k, farad in self.capacitors:
            c[k] += farad

        @cache
        def linear(on: tuple[bool, ...], gates: tuple[bool, ...]) -> tuple[np.ndarray, np.ndarray]:
            """Conductances among the nodes, and those to each source and to 1 V."""
            g, to = np.zeros((n, n)), np.zeros((n, len(known) + 1))
            column = {node: k for k, node in enumerate(known)}

            def stamp(a: int | str, b: int | str, conductance: float) -> None:
                for e, o in ((a, b), (b, a)):
                    if isinstance(e, int):
                        g[e, e] += conductance
                        if isinstance(o, int):
                            g[e, o] -= conductance
                        elif o in known:
                            to[e, column[o]] += conductance
                        else:
                            to[e, -1] += conductance * float(o)

            for a, b, r in self.resistors:
                stamp(a, b, 1.0 / r)
            for (a, b, _), closed in zip(self.switches, on, strict=True):
                stamp(a, b, 1.0 / 1e-2 if closed else 1.0 / 1e6)
            for (node, *_), high in zip(self.gates, gates, strict=True):
                stamp(node, "5" if high else "0", 1.0)
            return g, to

        def f(x: np.ndarray, t: float, on: list[bool], gates: list[bool]) -> tuple[np.ndarray, np.ndarray]:
            g, to = linear(tuple(on), tuple(gates))
            out, g = g @ x - to @ [*(s.at(t) for s in known.values()), 1.0], g.copy()
            for d in self.diodes:
                v = self._across(d, x)
                i, slope = d.current(v)
                self._put(out, g, d, i, slope)
            return out, g

        def q(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            out, m = c * x, np.diag(c)
            for d in self.diodes:
                self._put(out, m, d, *d.charge(self._across(d, x)))
            return out, m

        def solve(
            x: np.ndarray, t: float, on: list[bool], gates: list[bool], a: float, r: np.ndarray
        ) -> np.ndarray:
            for _ in range(NEWTON):
                (fx, g), (qx, m) = f(x, t, on, gates), q(x)
                dx = np.linalg.solve(g + a * m, -(fx + a * qx + r))
                largest = float(np.abs(dx).max())
                x = x + dx * min(1.0, 0.5 / largest if largest > 0.5 else 1.0)
                if largest < 1e-9:
                    return x
            raise ArithmeticError(f"network {self.seed}: no solution at {t} us")

        def modes(t: float) -> tuple[list[bool], list[bool]]:
            for _, _, switch in self.switches:
                switch.move(known[switch.control].at(t))
            high = [_compare(op, known[s].at(t), level) for _, s, op, level in self.gates]
            return [switch.on for *_, switch in self.switches], high

        on, gates = modes(0.0)
        x = solve(np.zeros(n), 0.0, on, gates, 0.0, np.zeros(n))
        rows, every = [x], round(SPAN / ROWS / STEP)
        for k in range(round(SPAN / STEP)):
            t = k * STEP
            on, gates = modes(t + 0.5 * STEP)  # what holds within the step
            a = 2.0 / (GAMMA * STEP)
            f0, q0 = f(x, t, on, gates)[0], q(x)[0]
            x1 = solve(x, t + GAMMA * STEP, on, gates, a, f0 - a * q0)
            w = 1.0 / (GAMMA * (2.0 - GAMMA))
            a2 = (2.0 - GAMMA) / ((1.0 - GAMMA) * STEP)
            x = solve(x1, t + STEP, on, gates, a2, -a2 * (w * q(x1)[0] + (1.0 - w) * q0))
            modes(t + STEP)  # a threshold that is met exactly at a corner
            if (k + 1) % every == 0:
                rows.append(x)
        table = np.array(rows)
        return {name: table[:, k] for k, name in enumerate(self.nodes)}

    @staticmethod
    def _across(d: Diode, x: np.ndarray) -> float:
        return float((x[d.anode] if d.anode >= 0 else 0.0) - (x[d.cathode] if d.cathode >= 0 else 0.0))

    @staticmethod
    def _put(out: np.ndarray, m: np.ndarray, d: Diode, value: float, slope: float) -> None:
        for e, o, sign in ((d.anode, d.cathode, 1.0), (d.cathode, d.anode, -1.0)):
            if e >= 0:
                out[e] += sign * value
                m[e, e] += slope
                if o >= 0:
                    m[e, o] -= slope

    def corners(self) -> list[float]:
        return sorted({t for s in self.sources for t in s.times})


def _compare(op: str, v: float, level: float) -> bool:
    return {">": v > level, "<": v < level, ">=": v >= level, "<=": v <= level}[op]


def network(seed: int) -> Network:
    r = random.Random(seed)
    count = r.randint(2, 4)
    nodes = [f"n{k}" for k in range(count)]
    sources = [_source(r, "a"), _source(r, "s", lines=True)]
    net = Network(seed, sources, [], nodes, [], [], [], [], [])

    def name(e: int | str) -> str:
        return nodes[e] if isinstance(e, int) and e >= 0 else "0" if isinstance(e, int) else e

    def resistor(a: int | str, b: int | str, kilo: float) -> None:
        kilo = float(f"{kilo:.3g}")
        net.lines.append(f"R{len(net.lines)} {name(a)} {name(b)} {kilo:g}k")
        net.resistors.append((a, b if b != -1 else "0", kilo))

    for k in range(count):
        resistor(k, "a" if k == 0 else k - 1, 10 ** r.uniform(-1, 0.7))
        resistor(k, -1, 10 ** r.uniform(0.5, 2))
        nano = float(f"{10 ** r.uniform(-0.5, 1):.3g}")
        net.lines.append(f"C{k} {nodes[k]} 0 {nano:g}n")
        net.capacitors.append((k, nano))
    for k in range(r.randint(1, 4)):
        a, b = r.sample(range(-1, count), 2)
        nano_ampere, n = r.choice([1e-5, 1e-3, 1.0]), r.choice([1.0, 1.5])
        cjo = r.choice([0.0, 0.05, 0.5])
        net.lines += [
            f"D{k} {name(a)} {name(b)} d{k}",
            f".model d{k} d(is={nano_ampere:g}n n={n:g}" + (f" cjo={cjo:g}n vj=1 m=0.5" if cjo else "") + ")",
        ]
        net.diodes.append(Diode(a, b, nano_ampere * 1e-6, n, cjo))
    for k in range(r.randint(0, 2)):
        a, b = r.sample(range(-1, count), 2)
        vt, vh = r.choice(LEVELS), r.choice([0.0, 0.0, 0.25])
        # behind a resistance, so that nothing is faster than the steps of the reference
        inner = len(nodes)
        nodes.append(f"w{k}")
        resistor(a if a >= 0 else b, inner, 10 ** r.uniform(-1, 0.5))
        net.lines += [
            f"Cw{k} w{k} 0 0.5n",
            f"S{k} w{k} {name(b) if a >= 0 else 0} s 0 m{k}",
            f".model m{k} sw(vt={vt:g} vh={vh:g} ron=10 roff=1g)",
        ]
        net.capacitors.append((inner, 0.5))
        end = b if a >= 0 else -1
        net.switches.append((inner, end if end >= 0 else "0", Switch("s", vt, vh)))
    if r.random() < 0.6:
        node, op, level = r.randrange(count), r.choice([">", "<", ">=", "<="]), r.choice(LEVELS)
        net.lines += [f"Bg g 0 V={{v(s){op}{level:g} ? 5 : 0}}", f"Rg g {nodes[node]} 1k"]
        net.gates.append((node, "s", op, level))
    return net


def _source(r: random.Random, node: str, lines: bool = False) -> Source:
    if not lines and r.random() < 0.5:
        volts, mega = float(f"{r.uniform(2, 10):.3g}"), float(f"{10 ** r.uniform(-2.3, -1.5):.3g}")
        return Source(node, f"SIN(0 {volts:g} {mega:g}meg)", volts, 2 * math.pi * mega)
    low, high = r.sample(LEVELS, 2)
    if not lines and r.random() < 0.5:
        low = -high
    ramp, delay, width = r.choice([0.1, 0.2, 1.0]), r.randint(5, 30), r.randint(10, 40)
    period = width + r.randint(20, 50)
    times, values, t = [0.0], [low], float(delay)
    while t < SPAN:
        times += [t, t + ramp, t + ramp + width, t + 2 * ramp + width]
        values += [low, high, high, low]
        t += period
    return Source(
        node,
        f"PULSE({low:g} {high:g} {delay}u {ramp:g}u {ramp:g}u {width}u {period}u)",
        times=times,
        values=values,
    )
