"""What the watch tells a run has lost, beside what it has lost: amplitude and lateness, over decks and methods.

    python tests/bench/watch.py [--decks tank,pendulum] [--methods gear,trap] [--wrong]

One line a run. `told` is what the watch made of the run's steps (engine/integrate/src/monitor.rs), `true` is the run beside a
tight one (radau at reltol 1e-11): over the last five periods both are fitted by

    x = a + b tau + (c + c' tau) cos w t + (s + s' tau) sin w t

at the run's own points, and the ratio of the two phasors c + j s gives the share of the amplitude that is gone and, with
the turns counted from window to window since the start, the periods that the run is late. `said` is the warning.
`--wrong` leaves only lines with a verdict:

    factor    warned, and told and true differ by more than a factor of two
    alarm     warned, and the true figure is not half of what is worth a warning
    silence   not warned, and the true one is twice what is worth it
"""

from __future__ import annotations

import argparse
import math
import re
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

import emsim
import emsim.analyses.watch as watch

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
WINDOW = 5.0  # periods that are fitted together
GRID = 40  # points a period of the tight run
ALIKE = 2.0  # factor within which told and true agree
TIGHT = {"method": "radau", "reltol": 1e-11}


@dataclass(frozen=True)
class Case:
    """A deck with an oscillation that is excited once."""

    name: str
    text: str  # a deck, or the name of one under netlists/
    signal: str  # a column, or several that are added up by `weights`
    period: float  # [s]
    stop: float  # [s]
    start: float = 0.0  # excited from then on [s]
    defines: dict[str, float] = field(default_factory=dict)
    uic: bool = True
    weights: tuple[float, ...] = (1.0,)
    methods: tuple[str, ...] = ("trap", "gear", "gear 2", "trbdf2", "esdirk", "radau5", "rk45")

    def run(self, options: dict, grid: float) -> emsim.Result:
        text = self.text if "\n" in self.text else (NETLISTS / f"{self.text}.cir").read_text()
        text = re.sub(r"(?im)^\.(tran|options|save|print|meas|ac)\b.*\n", "", text)
        tran = f".tran {self.period / grid!r} {self.stop!r}" + (" UIC" if self.uic else "")
        text = re.sub(r"(?im)^\.end\b.*$", "", text.rstrip()) + f"\n.print tran {self.signal}\n{tran}\n.end\n"
        return emsim.run(text, defines=self.defines, options=options)

    def points(self, result: emsim.Result) -> tuple[np.ndarray, np.ndarray]:
        t, keep = np.unique(np.asarray(result.time), return_index=True)
        columns = zip(self.signal.split(), self.weights, strict=True)
        return t, sum(w * np.asarray(result[name]) for name, w in columns)[keep]


def tank(name: str, f: float, cap: float) -> Case:
    return Case(name, "paper/tank", "v(a)", 1 / f, 100 / f, defines={"f": f, "cap": cap})


TAU = 2 * math.pi
STIFF = ("trap", "gear", "gear 2", "trbdf2", "esdirk", "radau5")
MASS = """A mass on a spring
BODY   sled m=0.2
JOINT  rail 0 sled slide axis=(1,0) ic=0.1
SPRING s    rail k=80
"""
DAMPED_MASS = MASS + "DAMPER d    rail c=0.02\n"
PENDULUM = """A pendulum let go
.gravity 9.81
BODY  bob   m=1 com=(1,0) j=0
JOINT hinge 0 bob pin zero=-90deg ic=%s
"""
GENERATOR = """A flywheel on a torsion spring turns a motor that feeds a large resistor
BODY   wheel m=0.1 j=1m
JOINT  axle 0 wheel pin ic=0.5
SPRING t axle k=0.4
MOTOR  m1 a 0 axle kt=20m r=2 l=1m j=2u
Rl     a 0 400
"""
COIL = """A voice coil's cone rings after a step, its coil behind a large resistor
BODY   cone m=20m
JOINT  x 0 cone slide axis=(1,0)
SPRING spider x k=2k
DAMPER air    x c=20m
TRANSDUCER coil a 0 x K={7/(1+(pos(x)/5m)**2)}
Lc     b a 0.5m
Rc     s b 5k
Vs     s 0 PULSE(0 1000 1m 0.1m 0.1m 10 20)
"""
COMB = """A comb drive's shuttle rings at its bias
.param eps0=8.854e-12 nf=100 t=20u g=2u x0=20u
.param dcdx={2*nf*eps0*t/g}
BODY   shuttle shape=box(200u,100u) m=2n
JOINT  beam    0 shuttle slide axis=(1,0) ic=2u
SPRING fold    beam k=1
DAMPER air     beam c=20n
TRANSDUCER cd  vd 0   beam  C={dcdx*(x0+pos(beam))}
Vdrv   in 0 DC 20
Rdrv   in vd 1k
"""
LOSSY = "A tank of quality 300\nC1 a 0 10n IC=1\nL1 a b 253.3029591u\nR1 b 0 0.53\n"
SECTIONS = 6
LADDER = "An open ladder rings after a step\nV1 in 0 PWL(0 0 1u 0 1.2u 1)\nR1 in n0 0.1\n" + "".join(
    f"L{k} n{k - 1} n{k} 10u\nC{k} n{k} 0 1n\n" for k in range(1, SECTIONS + 1)
)
CROSS = """A filter of the fifth order between small losses rings after a ramp
V1 in 0 PWL(0 0 1u 0 21u 1)
R1 in n1 1
L1 n1 n2 100u
C1 n2 0 22n
Rl n2 0 20k
"""
SECOND = """Two tanks, one at ten times the frequency of the other, far from each other
C1 a 0 100n IC=1
L1 a 0 253.3029591u
C2 b 0 10n IC=0.2
L2 b 0 25.33029591u
"""
VAN_DER_POL = """A limit cycle, near to a sine
C1 a 0 1u IC=2
L1 a 0 1m
B1 a 0 I={1m*(v(a)*v(a)*v(a)/3-v(a))}
"""
STEP_TANK = """A tank behind a resistor after a step
V1 in 0 PWL(0 0 10u 0 11u 1)
R1 in a 3
L1 a c 1m
C1 c 0 1u
"""
DOUBLE = """A double pendulum's slow mode, small
.gravity 9.81
BODY  p1 m=1 com=(1,0) j=0
BODY  p2 m=1 com=(1,0) j=0
JOINT h1 0 p1 pin zero=-90deg ic=0.05
JOINT h2 p1(1,0) p2 pin ic=0.0207106781
"""


def swing(degrees: float) -> float:
    """Period of a pendulum of 1 m let go at `degrees` [s], by the arithmetic-geometric mean."""
    a, b = 1.0, math.cos(math.radians(degrees) / 2)
    for _ in range(8):
        a, b = (a + b) / 2, math.sqrt(a * b)
    return TAU * math.sqrt(1 / 9.81) / a


CASES = [
    tank("tank 100 kHz", 1e5, 1e-8),
    tank("tank 400 kHz", 4e5, 1e-8),
    tank("tank 700 MHz", 7e8, 1e-12),
    Case("tank, 20 periods", "paper/tank", "v(a)", 1e-5, 2e-4, defines={"f": 1e5, "cap": 1e-8}),
    Case("tank, 1000 periods", "paper/tank", "v(a)", 1e-5, 1e-2, defines={"f": 1e5, "cap": 1e-8}),
    Case("tank of quality 300", LOSSY, "v(a)", 1e-5, 1e-3),
    Case("tank after a step", STEP_TANK, "v(c)", TAU * math.sqrt(1e-9), 5e-3, 12e-6, uic=False),
    Case("small tank of two", SECOND, "v(b)", TAU * math.sqrt(25.33029591e-14), 3e-4),
    Case("large tank of two", SECOND, "v(a)", TAU * math.sqrt(253.3029591e-13), 1e-3),
    Case("limit cycle", VAN_DER_POL, "v(a)", TAU * math.sqrt(1e-9), 2e-2),
    Case("filter after a ramp", CROSS, "v(n2)", TAU * math.sqrt(22e-13), 4e-4, 22e-6, uic=False),
    Case("pendulum 5 deg", PENDULUM % "5deg", "angle(hinge)", swing(5), 100.0),
    Case("pendulum 90 deg", PENDULUM % "90deg", "angle(hinge)", swing(90), 120.0),
    Case("double pendulum", DOUBLE, "angle(h1)", TAU / math.sqrt(9.81 * (2 - math.sqrt(2))), 150.0),
    Case("mass on a spring", MASS, "pos(rail)", TAU * math.sqrt(0.2 / 80), 20.0),
    Case("damped mass", DAMPED_MASS, "pos(rail)", TAU * math.sqrt(0.2 / 80), 20.0),
    Case("flywheel and motor", GENERATOR, "angle(axle)", TAU * math.sqrt(1.002e-3 / 0.4), 20.0, methods=STIFF),
    Case("voice coil", COIL, "pos(x)", TAU * math.sqrt(20e-3 / 2e3), 1.0, 1.2e-3, uic=False, methods=STIFF),
    Case("comb drive", COMB, "pos(beam)", TAU * math.sqrt(2e-9), 2e-2, methods=STIFF),
    Case("ladder, lowest mode", LADDER, " ".join(f"v(n{k + 1})" for k in range(SECTIONS)),
         TAU * 1e-7 / (2 * math.sin(math.pi / (4 * SECTIONS + 2))), 1.5e-4, 2e-6, uic=False,
         weights=tuple(math.sin(math.pi * (k + 1) / (2 * SECTIONS + 1)) for k in range(SECTIONS))),
]  # fmt: skip
METHODS = {
    "trap": {"method": "trap"},
    "gear": {"method": "gear"},
    "gear 2": {"method": "gear", "maxord": 2},
    "trbdf2": {"method": "trbdf2"},
    "esdirk": {"method": "esdirk"},
    "radau5": {"method": "radau5"},
    "rk45": {"method": "rk45"},
}
RELTOLS = (1e-2, 1e-3, 1e-4)


@dataclass
class Truth:
    """By windows from the start on: what is lost of the tight run's amplitude, how late it is, what is left of that amplitude."""

    t: np.ndarray
    loss: np.ndarray
    late: np.ndarray
    left: np.ndarray

    def between(self, a: float, b: float, least: float) -> tuple[float, float]:
        """Loss and lateness from a to b [s]; of what is shorter than `least`, which the windows do not resolve, in proportion."""
        a, b = max(a, self.t[0]), min(b, self.t[-1])
        start = max(min(a, self.t[-1] - least), self.t[0])
        stop = min(max(b, start + least), self.t[-1])
        kept, late = (
            np.interp([start, stop], self.t, v) for v in (np.log(np.maximum(1 - self.loss, 1e-12)), self.late)
        )
        part = (b - a) / (stop - start)
        return float(-np.expm1(part * (kept[1] - kept[0]))), float(part * (late[1] - late[0]))

    def worst(self) -> tuple[float, float]:
        """Largest loss and lateness, as much as is left of the oscillation."""
        return float((self.left * self.loss).max()), float((self.left * np.abs(self.late)).max())


@dataclass
class Row:
    case: Case
    method: str
    reltol: float
    told: tuple[float, float]  # share of the amplitude lost, periods late
    true: tuple[
        float, float
    ]  # over the time that it was told of; of what is not told, the most of what is left
    worst: tuple[float, float]
    said: str  # W410, W411, else W415 (energy without a cause) or nothing; in brackets of another mode
    steps: float  # a period

    def verdict(self) -> str:
        """What is wrong with it, or nothing."""
        worth, which = watch.WORTH, ("W410", "W411")
        if self.said in which:
            k = which.index(self.said)
            if abs(self.true[k]) < worth / 2:
                return "alarm"
            if not 1 / ALIKE < self.told[k] / self.true[k] < ALIKE:
                return "factor"
            return "silence on loss" if k and self.worst[0] > max(2 * worth, self.worst[1]) else ""
        return "silence" if max(self.worst) > 2 * worth and not self.said else ""


def phasor(t: np.ndarray, x: np.ndarray, w: float) -> complex:
    """Of the oscillation in the middle of the points."""
    middle, half = 0.5 * (t[0] + t[-1]), 0.5 * (t[-1] - t[0])
    tau = (t - middle) / half
    c, s = np.cos(w * t), np.sin(w * t)
    p = np.linalg.lstsq(np.stack([np.ones_like(t), tau, c, s, tau * c, tau * s], 1), x, rcond=None)[0]
    return complex(p[2], -p[3])


@cache
def tight(index: int) -> tuple[CubicSpline, float]:
    """The tight run, and the period that it shows at its end [s]."""
    case = CASES[index]
    result = case.run(TIGHT, GRID)
    x = CubicSpline(*case.points(result))
    points = np.linspace(case.stop - WINDOW * case.period, case.stop, 400)
    w = TAU / case.period
    for _ in range(3):
        a, b = (phasor(p, x(p), w) for p in np.split(points, 2))
        w += np.angle(b / a) / (points[200] - points[0])
    return x, TAU / w


def lost(index: int, result: emsim.Result) -> Truth:
    case = CASES[index]
    exact, period = tight(index)
    t, x = case.points(result)
    times, own, ideal = [], [], []
    for end in np.arange(case.stop, case.start + WINDOW * period, -WINDOW * period)[::-1]:
        inside = (t >= end - WINDOW * period) & (t <= end)
        at = t[inside]
        if len(at) >= 12:
            times.append(0.5 * (at[0] + at[-1]))
            own.append(phasor(at, x[inside], TAU / period))
            ideal.append(phasor(at, exact(at), TAU / period))
    times, left = np.array(times), np.abs(ideal) / abs(ideal[0])
    log = np.log(np.maximum(np.abs(np.array(own) / np.array(ideal)), 1e-12))
    late = -np.unwrap(np.angle([1.0, *(np.array(own) / np.array(ideal))]))[1:] / TAU
    if case.start > 0:  # what the first edge excited is not the oscillation's to lose
        log, late = log - log[0], late - late[0]
    else:
        times, left, log, late = (
            np.append(first, v) for first, v in zip((0, 1, 0, 0), (times, left, log, late), strict=True)
        )
    # to the end of the last window
    more = (case.stop - times[-1]) / (times[-1] - times[-2])
    log, late, left = (
        np.append(v, v[-1] + more * (v[-1] - v[-2])) for v in (log, late, np.log(np.maximum(left, 1e-12)))
    )
    return Truth(np.append(times, case.stop), -np.expm1(log), late, np.exp(left))


def compare(index: int, method: str, reltol: float) -> Row:
    """One run, with what was told of it."""
    case, found = CASES[index], {}
    teach = watch.teach

    def listen(assembly, told, end) -> None:
        found.update(told)
        teach(assembly, told, end)

    watch.teach = listen
    try:
        result = case.run(METHODS[method] | {"reltol": reltol}, 8)
    finally:
        watch.teach = teach
    period, truth = tight(index)[1], lost(index, result)
    told, true, mine = [0.0, 0.0], list(truth.worst()), [False, False]
    for k, (mode, figure) in enumerate((("damped", "loss"), ("late", "late"))):
        if mode in found and 0.8 < found[mode]["period"] / period < 1.25:
            span = found[mode]["from"], found[mode]["until"]
            told[k], true[k], mine[k] = (
                found[mode][figure],
                truth.between(*span, 2 * WINDOW * period)[k],
                True,
            )
    codes = sorted(d.code for d in result.diagnostics if d.code in ("W410", "W411", "W415"))
    said = codes[0] if codes else ""
    if said in ("W410", "W411") and not mine[said == "W411"]:
        said = f"({said})"
    steps = result.stats["steps"] * period / case.stop
    return Row(case, method, reltol, (told[0], told[1]), (true[0], true[1]), truth.worst(), said, steps)


def row_text(row: Row) -> str:
    return (
        f"{row.case.name:22}{row.method:8}{row.reltol:7.0e}{row.steps:8.1f} {row.told[0]:10.2%}{row.true[0]:9.2%} "
        f"{row.told[1]:10.4f}{row.true[1]:9.4f}  {row.said:7}{row.verdict()}"
    )


def summary(rows: list[Row]) -> str:
    """A line a deck: how many runs, warnings, and between what told/true lies where a figure was told."""
    lines = [f"{'':22}{'runs':>6}{'W410':>6}{'told/true':>14}{'W411':>6}{'told/true':>14}{'wrong':>7}"]
    for case in CASES:
        mine = [row for row in rows if row.case is case]
        cells = ""
        for k, code in enumerate(("W410", "W411")):
            ratios = [row.told[k] / row.true[k] for row in mine if row.said == code]
            cells += f"{len(ratios):6}{f'{min(ratios):.2f} to {max(ratios):.2f}' if ratios else '':>14}"
        if mine:
            lines.append(f"{case.name:22}{len(mine):6}{cells}{sum(bool(row.verdict()) for row in mine):7}")
    return "\n".join(lines)


def main(argv: list[str] | None = None) -> list[Row]:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--decks", default="", help="words of their names")
    parser.add_argument("--methods", default="")
    parser.add_argument("--reltols", default=",".join(f"{r:g}" for r in RELTOLS))
    parser.add_argument("--wrong", action="store_true")
    given = parser.parse_args(argv)
    words = given.decks.split(",")
    rows = []
    print(
        f"{'':22}{'method':8}{'reltol':>7}{'steps/T':>8} {'told loss':>10}{'true':>9} {'told late':>10}{'true':>9}  said"
    )
    for index, case in enumerate(CASES):
        if not any(word in case.name for word in words):
            continue
        for method in given.methods.split(",") if given.methods else case.methods:
            for reltol in map(float, given.reltols.split(",")):
                rows.append(compare(index, method, reltol))
                if not given.wrong or rows[-1].verdict():
                    print(row_text(rows[-1]), flush=True)
    print(f"\n{summary(rows)}")
    return rows


if __name__ == "__main__":
    main()
