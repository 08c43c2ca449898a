"""Random networks of conditions, logic and switches whose values are known at every instant: for test_conditions.py.

A network is a list of layers: sources (PULSE, PWL with plateaus on a coarse grid of voltages, so that thresholds are met
exactly), behavioural sources that read what stands above them, switches, and at the end one low-pass. The reference
evaluates the text itself: sources as straight lines, expressions by Python, switches by ngspice's rule, the low-pass by its
closed form over steps far finer than anything that happens.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np

SPAN = 1.0e-3
ROWS = 200  # of the print grid
GRID = SPAN / ROWS
FINE = 8000  # steps of the reference
LEVELS = (-1.0, 0.0, 0.5, 1.0, 2.0, 2.5, 5.0)
RAMP = 1e-6

State = dict[str, float]
Term = tuple[str, Callable[[State], float]]


@dataclass
class Source:
    """Straight lines between points."""

    name: str
    times: list[float]
    values: list[float]
    text: str

    def at(self, times: np.ndarray) -> list[float]:
        return np.interp(times, self.times, self.values).tolist()


@dataclass
class Switch:
    """ngspice's rule without hysteresis: it turns where its control arrives at vt; with it, beyond vt +- vh."""

    control: str
    vt: float
    vh: float
    on: bool = False
    side: int = -1

    def start(self, v: float) -> None:
        self.on, self.side = False, -1
        self.move(v)

    def move(self, v: float) -> None:
        if self.vh > 0.0:
            self.on = v > self.vt + self.vh or (self.on and v >= self.vt - self.vh)
            return
        side = (v > self.vt) - (v < self.vt)
        if side == 0 and self.side != 0:
            self.on = not self.on
        elif side != 0:
            self.on = side > 0
        self.side = side


@dataclass
class Network:
    seed: int
    sources: list[Source] = field(default_factory=list)
    nodes: list[tuple[str, Callable[[State], float]]] = field(default_factory=list)
    switches: list[tuple[str, Switch, str]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    low_pass: str = ""

    def deck(self) -> str:
        text = [
            f"conditions, network {self.seed}",
            ".func gate(x,y)={x>y ? 1 : 0}",
            *(s.text for s in self.sources),
            *self.lines,
        ]
        return "\n".join([*text, f".tran {GRID:g} {SPAN:g}", ".end", ""])

    def columns(self) -> list[str]:
        return [name for name, _ in self.nodes] + [name for name, _, _ in self.switches] + ["lp"]

    @cached_property
    def reference(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Values at a fine grid that holds every corner."""
        corners = {t for s in self.sources for t in s.times if 0 <= t <= SPAN}
        times = np.array(sorted({*np.linspace(0.0, SPAN, FINE + 1), *corners}))
        found: dict[str, list[float]] = {name: [] for name in self.columns()}
        y, tau, last = 0.0, 20e-6, 0.0
        given = {s.name: s.at(times) for s in self.sources}
        for k, t in enumerate(times):
            state: State = {name: values[k] for name, values in given.items()}
            for name, law in self.nodes:
                state[name] = law(state)
                found[name].append(state[name])
            for name, switch, supply in self.switches:
                (switch.start if k == 0 else switch.move)(state[switch.control])
                r = 1.0 if switch.on else 1e9
                found[name].append(state[supply] * r / (r + 1e3))
            x = state[self.low_pass]
            if k == 0:
                y = x
            else:
                # what drives it goes straight from the last value to this one, or jumps: half a step is the error
                h = (t - times[k - 1]) / tau
                keeps = math.exp(-h)
                y = keeps * y + (1 - keeps) * 0.5 * (x + last)
            last = x
            found["lp"].append(y)
        return times, {name: np.array(v) for name, v in found.items()}

    def quiet_rows(self) -> np.ndarray:
        """Numbers of rows of the print grid around which nothing bends or jumps, by the reference."""
        times, found = self.reference
        corners = np.array(sorted({t for s in self.sources for t in s.times}))
        rows = []
        for k in range(1, ROWS):
            t = k * GRID
            a, b = np.searchsorted(times, [t - 1.6 * GRID, t + 1.6 * GRID])
            if np.any(np.abs(corners - t) < 1.6 * GRID):
                continue
            if all(np.abs(np.diff(v[a:b], 2)).max(initial=0.0) < 1e-3 for n, v in found.items() if n != "lp"):
                rows.append(k)
        return np.array(rows, dtype=int)


@cache
def network(seed: int) -> Network:
    rng = random.Random(seed)
    net = Network(seed)
    for k in range(rng.randint(2, 3)):
        net.sources.append(_source(rng, f"s{k}"))
    names = [s.name for s in net.sources]
    for k in range(rng.randint(2, 5)):
        name = f"b{k}"
        text, law = _value(rng, names)
        kind = rng.randrange(5)
        if kind == 0:
            net.lines += [f"E{name} {name} 0 vol='{text}'", f"R{name} {name} 0 1k"]
        elif kind == 1:
            # a divider with a resistance that a condition chooses: 5 * 1k / (1k + R)
            ask, truth = _logic(rng, names, 2)
            net.lines += [
                f"V{name} {name}v 0 5",
                f"R{name}a {name}v {name} R={{({ask}) ? 3k : 1k}}",
                f"R{name}b {name} 0 1k",
            ]

            def law(state: State, truth: Callable[[State], float] = truth) -> float:
                return 1.25 if truth(state) else 2.5

        elif kind == 2:
            net.lines += [f"G{name} 0 {name} cur='({text})*1m'", f"R{name} {name} 0 1k"]
        else:
            net.lines += [f"B{name} {name} 0 V={{{text}}}", f"R{name} {name} 0 1k"]
        net.nodes.append((name, law))
        names.append(name)
    for k in range(rng.randint(0, 2)):
        control, vt = rng.choice(net.sources), rng.choice(LEVELS)
        vh = rng.choice((0.0, 0.0, 0.25))
        net.lines += [
            f"Vw{k} w{k}v 0 5", f"Rw{k} w{k}v w{k} 1k", f"Sw{k} w{k} 0 {control.name} 0 m{k}",
            f".model m{k} sw(vt={vt:g} vh={vh:g} ron=1 roff=1g)",
        ]  # fmt: skip
        net.nodes.append((f"w{k}v", lambda state: 5.0))
        net.switches.append((f"w{k}", Switch(control.name, vt, vh), f"w{k}v"))
    net.low_pass = rng.choice([name for name in names if name.startswith("b")])
    net.lines += [f"Elp lpv 0 {net.low_pass} 0 1", "Rlp lpv lp 1k", "Clp lp 0 20n"]
    return net


def _source(rng: random.Random, name: str) -> Source:
    low, high = rng.sample(LEVELS, 2)
    if rng.random() < 0.6:
        delay, width = rng.randint(5, 25) * 1e-5, rng.randint(5, 20) * 1e-5
        period = width + rng.randint(5, 20) * 1e-5
        times, values, t = [0.0], [low], delay
        while t < SPAN:
            times += [t, t + RAMP, t + RAMP + width, t + 2 * RAMP + width]
            values += [low, high, high, low]
            t += period
        text = f"V{name} {name} 0 PULSE({low:g} {high:g} {delay:g} {RAMP:g} {RAMP:g} {width:g} {period:g})"
        return Source(name, times, values, text)
    times = sorted(rng.sample(range(4, 96), rng.randint(4, 8)))
    points = [(0.0, low)]
    for t in times:
        # a ramp over a hundredth of the run, or a plateau
        points.append((t * 1e-5, points[-1][1] if rng.random() < 0.5 else rng.choice(LEVELS)))
    text = f"V{name} {name} 0 PWL({' '.join(f'{t:g} {v:g}' for t, v in points)})"
    return Source(name, [t for t, _ in points], [v for _, v in points], text)


COMPARE: dict[str, Callable[[float, float], bool]] = {
    ">": lambda a, b: a > b, "<": lambda a, b: a < b, ">=": lambda a, b: a >= b,
    "<=": lambda a, b: a <= b, "==": lambda a, b: a == b, "!=": lambda a, b: a != b,
}  # fmt: skip


def _atom(rng: random.Random, names: list[str]) -> Term:
    n, op = rng.choice(names), rng.choice(list(COMPARE))
    kind = rng.randrange(6)
    if kind == 0:
        return f"v({n})", lambda s: s[n]
    if kind == 1:
        m = rng.choice(names)
        return f"(v({n}){op}v({m}))", lambda s: float(COMPARE[op](s[n], s[m]))
    at = rng.choice(LEVELS)
    if kind == 2:
        return f"gate(v({n}),{at:g})", lambda s: float(s[n] > at)
    return f"(v({n}){op}{at:g})", lambda s: float(COMPARE[op](s[n], at))


def _logic(rng: random.Random, names: list[str], depth: int) -> Term:
    """Something that is asked for being true, not 0."""
    if depth == 0 or rng.random() < 0.2:
        return _atom(rng, names)
    a, f = _logic(rng, names, depth - 1)
    b, g = _logic(rng, names, depth - 1)
    kind = rng.randrange(8)
    if kind == 0:
        return f"(!({a}))", lambda s: float(not f(s))
    if kind == 1:
        return f"(({a}) && ({b}))", lambda s: float(bool(f(s)) and bool(g(s)))
    if kind == 2:
        return f"(({a}) || ({b}))", lambda s: float(bool(f(s)) or bool(g(s)))
    # of truths, so that both sides are 0 or 1
    if kind in (3, 4):
        op = rng.choice(list(COMPARE))
        return (
            f"((({a}) ? 1 : 0) {op} (({b}) ? 1 : 0))",
            lambda s: float(COMPARE[op](float(bool(f(s))), float(bool(g(s))))),
        )
    c, h = _logic(rng, names, depth - 1)
    if kind == 5:
        return (
            f"((({a}) ? 1 : 0) + (({b}) ? 1 : 0) + (({c}) ? 1 : 0) >= 2)",
            lambda s: float(bool(f(s)) + bool(g(s)) + bool(h(s)) >= 2),
        )
    return f"(({a}) ? ({b}) : ({c}))", lambda s: g(s) if f(s) else h(s)


def _value(rng: random.Random, names: list[str]) -> Term:
    ask, truth = _logic(rng, names, rng.randint(1, 3))
    if rng.random() < 0.25:
        return f"(({ask}) ? 1 : 0)", lambda s: float(bool(truth(s)))
    p, q = rng.sample(LEVELS, 2)
    if rng.random() < 0.25:
        other, inner = _logic(rng, names, 1)
        return (
            f"(({ask}) ? {p:g} : (({other}) ? {q:g} : 0.5))",
            lambda s: p if truth(s) else q if inner(s) else 0.5,
        )
    return f"(({ask}) ? {p:g} : {q:g})", lambda s: p if truth(s) else q
