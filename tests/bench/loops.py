"""Closed loops drawn by a seed: what a plain run gives, beside UIC, a tight run and ngspice.

    python tests/bench/loops.py [--seed 1] [--count 4] [--kinds buck,pll] [--methods auto,trap] [--ngspice] [--wrong]

Every kind of loop below is drawn `count` times. A run of it tells two things: means of signals over the end of the run, when what
it started from is forgotten, and how far limited signals have left their limits, ever. The same circuit from given values (UIC),
with reltol=1e-7 by radau, and in ngspice says what is right. One line a run; `--wrong` leaves those that differ:

    limit     a limited signal is beyond its limit by more than 1e-3 of its width, at any time of the run
    mean      a mean differs by more than SHARE from that of the tight run from the same start, in parts of the signal's range
    start     that of the tight run differs by more than STARTS from that by UIC: limit cycles take their time, a dead loop stays
    failed    the run ended with an error

Exit code 1 where there is one.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

import emsim

SHARE = 0.03  # of a signal's range: cycles that are counted to a part of one
STARTS = 0.15
BEYOND = 1e-3
TIGHT = {"method": "radau", "reltol": 1e-7}
PARTS = 0.4  # of the run, at its end, that means are of


@dataclass(frozen=True)
class Loop:
    """A deck without .tran: its elements, length of the run, signals that are averaged, limits of signals."""

    kind: str
    number: int
    elements: str
    step: float
    stop: float
    means: tuple[str, ...]
    limits: dict[str, tuple[float, float]]

    def text(self, uic: bool = False, options: str = "") -> str:
        shown = " ".join(dict.fromkeys((*self.means, *self.limits)))
        head = f"{self.kind} {self.number}\n{self.elements.strip()}\n"
        tail = f".options {options}\n" if options else ""
        run = f".tran {self.step!r} {self.stop!r}" + (" uic" if uic else "")
        return f"{head}{tail}.save {shown}\n{run}\n.end\n"


@dataclass(frozen=True)
class Outcome:
    means: dict[str, float]
    ranges: dict[str, float]
    beyond: dict[str, float]  # by how much of its width a limited signal was outside
    said: tuple[str, ...]  # codes of warnings


def measured(loop: Loop, result: emsim.Result, said: tuple[str, ...] = ()) -> Outcome:
    t = np.asarray(result.time)
    late = t >= (1.0 - PARTS) * loop.stop
    means, ranges, beyond = {}, {}, {}
    for name in loop.means:
        v = np.asarray(result[name])
        means[name] = float(np.trapezoid(v[late], t[late]) / (t[late][-1] - t[late][0]))
        ranges[name] = float(np.ptp(v[late]))
    for name, (low, high) in loop.limits.items():
        v = np.asarray(result[name])
        beyond[name] = float(max(low - v.min(), v.max() - high, 0.0) / (high - low))
    return Outcome(means, ranges, beyond, said)


def run(loop: Loop, uic: bool = False, **options: object) -> Outcome:
    """Raises emsim.ConvergenceError."""
    result = emsim.run(loop.text(uic), options=options)
    return measured(loop, result, tuple(d.code for d in result.diagnostics))


def spice(loop: Loop) -> Outcome:
    from emsim.interop import ngspice

    step = loop.step / 4.0
    text = loop.text().replace(
        f".tran {loop.step!r} {loop.stop!r}", f".tran {step!r} {loop.stop!r} 0 {step!r}"
    )
    return measured(loop, ngspice.named_alike(ngspice.run(text, 120.0)))


def verdict(loop: Loop, own: Outcome, right: Outcome, kind: str = "mean") -> str:
    """What is wrong with a run, "" where nothing is."""
    for name, by in own.beyond.items():
        if by > BEYOND:
            return f"limit {name} by {by:.3g} of its width"
    for name, mean in own.means.items():
        scale = max(right.ranges[name], abs(right.means[name]), 1e-9)
        if abs(mean - right.means[name]) > (SHARE if kind == "mean" else STARTS) * scale:
            return f"{kind} {name} {mean:.5g} for {right.means[name]:.5g}"
    return ""


# the kinds ---------------------------------------------------------------------------------------


def _pwm(r: random.Random, target: float, ratio: float, falls: bool = False) -> tuple[str, float, float]:
    """Error amplifier with limits and a filter, ramp, comparator that drives g; period, limit. A ramp that falls begins above the
    limit: the switch is off at the operating point, where on it would short the coil to the supply."""
    period = r.choice((5e-6, 10e-6, 20e-6))
    high = round(r.uniform(0.65, 0.8) if falls else r.uniform(0.7, 0.95), 3)
    first, last = (1, 0) if falls else (0, 1)
    gain, ref = round(10 ** r.uniform(1.5, 3.0), 1), 2.0
    upper = 10e3 * (target / ref - 1.0)
    text = f"""
Vr rp 0 PULSE({first} {last} 0 {0.985 * period!r} {5e-3 * period!r} {5e-3 * period!r} {period!r})
Vref ref 0 {ref}
Rf1 out fb {upper:.6g}
Rf2 fb 0 10k
Eea e 0 VALUE={{min(max({gain}*(v(ref)-v(fb)),0),{high})}}
Re e c 10k
Ce c 0 {ratio * period / 10e3!r}
Bg g 0 V={{v(c)>v(rp) ? 5 : 0}}
.model swm SW(vt=2.5 vh=.5 ron=50m roff=1meg)
.model dd D(is=1e-9 rs=20m)
"""
    return text, period, high


def buck(r: random.Random, n: int) -> Loop:
    vin, share = round(r.uniform(8, 30), 2), r.uniform(0.25, 0.7)
    control, period, high = _pwm(r, vin * share, r.uniform(50, 150))
    load = round(r.uniform(2, 15), 2)
    coil = r.choice((47, 100, 220))
    power = (
        f"Vin in 0 {vin}\nS1 in sw g 0 swm\nD1 0 sw dd\nL1 sw out {coil}u\nC1 out 0 47u\nR1 out 0 {load}\n"
    )
    return Loop("buck", n, power + control, period / 10, 600 * period, ("v(out)",), {"v(c)": (0.0, high)})


def boost(r: random.Random, n: int) -> Loop:
    vin = round(r.uniform(4, 10), 2)
    control, period, high = _pwm(r, vin * r.uniform(1.5, 2.5), r.uniform(200, 500), falls=True)
    load = round(r.uniform(15, 60), 1)
    power = f"Vin in 0 {vin}\nL1 in sw 100u\nS1 sw 0 g 0 swm\nD1 sw out dd\nC1 out 0 47u\nR1 out 0 {load}\n"
    return Loop("boost", n, power + control, period / 10, 3000 * period, ("v(out)",), {"v(c)": (0.0, high)})


def flyback(r: random.Random, n: int) -> Loop:
    vin = round(r.uniform(10, 30), 2)
    control, period, high = _pwm(r, round(r.uniform(5, 12), 2), r.uniform(200, 500), falls=True)
    load = round(r.uniform(8, 30), 1)
    power = f"""Vin in 0 {vin}
L1 in d 100u
L2 0 s {r.choice((25, 50, 100))}u
K1 L1 L2 0.995
Rsn d sn 100
Csn sn 0 220p
S1 d 0 g 0 swm
D1 s out dd
C1 out 0 100u
R1 out 0 {load}
"""
    return Loop("flyback", n, power + control, period / 10, 3000 * period, ("v(out)",), {"v(c)": (0.0, high)})


def current_mode(r: random.Random, n: int) -> Loop:
    """A buck whose coil current follows the error amplifier between two thresholds."""
    vin, share = round(r.uniform(10, 30), 2), r.uniform(0.3, 0.6)
    upper, most = 10e3 * (vin * share / 2.0 - 1.0), round(r.uniform(3.0, 6.0), 2)
    text = f"""
Vin in 0 {vin}
S1 in sw e cs swm
D1 0 sw dd
Vs sw l 0
L1 l out 100u
C1 out 0 47u
R1 out 0 {r.uniform(3, 8):.3g}
Rf1 out fb {upper:.6g}
Rf2 fb 0 10k
Eea ea 0 VALUE={{min(max({r.uniform(10, 100):.4g}*(2-v(fb)),0),{most})}}
Re ea e 1k
Ce e 0 100n
Hs cs 0 Vs 1
.model swm SW(vt=0 vh=.15 ron=50m roff=1meg)
.model dd D(is=1e-9 rs=20m)
"""
    return Loop("current", n, text, 1e-6, 6e-3, ("v(out)",), {"v(ea)": (0.0, most)})


def hysteretic(r: random.Random, n: int) -> Loop:
    vin, out = round(r.uniform(8, 24), 2), round(r.uniform(2, 5), 2)
    text = f"""
Vin in 0 {vin}
Vref ref 0 {out}
S1 in sw ref fb swm
D1 0 sw dd
L1 sw out {r.choice((22, 47, 100))}u
Rc out fb 1m
C1 out x 47u
Rx x 0 {r.uniform(0.05, 0.15):.3g}
R1 out 0 {r.uniform(2, 8):.3g}
.model swm SW(vt=0 vh={r.uniform(0.01, 0.04):.3g} ron=50m roff=1meg)
.model dd D(is=1e-9 rs=20m)
"""
    return Loop("hysteretic", n, text, 1e-6, 4e-3, ("v(out)",), {})


def class_d(r: random.Random, n: int) -> Loop:
    period, rail, level = (
        r.choice((2e-6, 4e-6, 5e-6)),
        round(r.uniform(10, 30), 1),
        round(r.uniform(-0.6, 0.6), 3),
    )
    high = 0.9
    text = f"""
Vt tri 0 PULSE(-1 1 0 {period / 2!r} {period / 2!r} 1p {period!r})
Vi in 0 {level}
Eea e 0 VALUE={{min(max({r.uniform(20, 60):.4g}*(v(in)-v(fb)),-{high}),{high})}}
Re e c 10k
Ce c 0 {r.uniform(0.5, 2) * 1e-9:.4g}
Bo o 0 V={{v(c)>v(tri) ? {rail} : -{rail}}}
L1 o out 22u
C1 out 0 1u
R1 out 0 {r.uniform(4, 8):.3g}
Rf1 o fb {(rail - 1.0) * 10e3:.6g}
Rf2 fb 0 10k
Cf fb 0 2n
"""
    return Loop("class_d", n, text, period / 10, 400 * period, ("v(out)",), {"v(c)": (-high, high)})


def sigma_delta(r: random.Random, n: int) -> Loop:
    """An integrator with a leak and a comparator with hysteresis: the mean of its output follows its input."""
    level = round(r.uniform(-0.7, 0.7), 3)
    text = f"""
Vi in 0 {level}
Gi 0 x VALUE={{v(in)-v(y)}}
Ci x 0 {r.uniform(1, 4) * 1e-6:.4g}
Rx x 0 20
S1 p y x 0 up
S2 y m 0 x up
Vp p 0 1
Vm m 0 -1
Cy y 0 1n
Ry y 0 100k
.model up SW(vt=0 vh={r.uniform(0.05, 0.3):.3g} ron=10 roff=10meg)
"""
    return Loop("sigma_delta", n, text, 2e-7, 2e-4, ("v(y)",), {})


def timer(r: random.Random, n: int) -> Loop:
    """An astable like a 555: charged through two resistors, discharged through one, between two levels."""
    ra, rb, c = r.uniform(1e3, 20e3), r.uniform(1e3, 20e3), r.uniform(1e-9, 20e-9)
    period = 0.69 * (ra + 2 * rb) * c
    text = f"""
Vcc vcc 0 {r.uniform(4, 15):.3g}
Ra vcc d {ra:.5g}
Rb d t {rb:.5g}
Ct t 0 {c:.5g}
Bm m 0 V={{v(t)-v(vcc)/2}}
Bh h 0 V={{v(m)*6/v(vcc)}}
S1 d 0 h 0 dis
.model dis SW(vt=0 vh=1 ron=10 roff=100meg)
"""
    return Loop("timer", n, text, period / 50, 20.3 * period, ("v(t)", "v(d)"), {})


def pll(r: random.Random, n: int) -> Loop:
    """A multiplier, a lead-lag filter, a limited control voltage and an oscillator: it locks to the reference."""
    f, off = r.uniform(8e3, 12e3), r.uniform(-0.03, 0.03)
    text = f"""
Vr r 0 SIN(0 1 {f * (1 + off):.8g})
Bpd pd 0 V={{v(r)*cos(v(ph))}}
R1 pd c 10k
R2 c z 2k
C1 z 0 {r.uniform(20, 60) * 1e-9:.4g}
Bl l 0 V={{min(max(v(c),-1),1)}}
Gph 0 ph VALUE={{6.283185307179586*({f:.8g}+{0.2 * f:.8g}*v(l))*1u}}
Cph ph 0 1u
Rph ph 0 1g
.ic v(ph)=0
"""
    return Loop("pll", n, text, 0.02 / f, 150 / f, ("v(l)",), {"v(l)": (-1.0, 1.0)})


def ring(r: random.Random, n: int) -> Loop:
    """Inverters with saturation in a ring, of an odd number; a source kicks it once."""
    count, tau = r.choice((3, 5, 7)), 10 ** r.uniform(-8, -5)
    stage = [
        f"B{k} d{k} 0 V={{2.5-2.5*tanh({r.uniform(2.0, 6.0):.4g}*(v(n{k})-2.5))}}\nR{k} d{k} n{k % count + 1} 1k\n"
        f"C{k} n{k % count + 1} 0 {tau * r.uniform(0.8, 1.2) / 1e3:.5g}\n"
        for k in range(1, count + 1)
    ]
    kick = f"I1 0 n1 PULSE(0 {r.uniform(0.2, 1.0):.3g}m {tau!r} {tau / 10!r} {tau / 10!r} {tau!r} 1)\n"
    return Loop("ring", n, "".join(stage) + kick, tau / 10, 120 * count * tau, ("v(n1)",), {})


def wien(r: random.Random, n: int) -> Loop:
    """A Wien bridge whose amplifier is limited by its supplies; a source kicks it once."""
    f, gain, rail = 10 ** r.uniform(2, 4), r.uniform(3.1, 3.5), round(r.uniform(5, 12), 2)
    c = 1.0 / (6.283185307179586 * f * 10e3)
    text = f"""
E1 o 0 VALUE={{min(max({gain:.4g}*v(p),-{rail}),{rail})}}
R1 o x 10k
C1 x p {c:.6g}
R2 p 0 10k
C2 p 0 {c:.6g}
I1 0 p PULSE(0 10u 0 {0.01 / f!r} {0.01 / f!r} {0.1 / f!r} 1)
"""
    return Loop("wien", n, text, 0.01 / f, 60.0 / f, ("v(o)",), {"v(o)": (-rail, rail)})


KINDS: dict[str, Callable[[random.Random, int], Loop]] = {
    "buck": buck, "boost": boost, "flyback": flyback, "current": current_mode, "hysteretic": hysteretic,
    "class_d": class_d, "sigma_delta": sigma_delta, "timer": timer, "pll": pll, "ring": ring, "wien": wien,
}  # fmt: skip


def loops(seed: int, count: int, kinds: list[str] | None = None) -> Iterator[Loop]:
    """The same for the same seed, whatever else is drawn."""
    for kind in kinds or KINDS:
        for n in range(count):
            yield KINDS[kind](random.Random(f"{seed} {kind} {n}"), n)


def judged(loop: Loop, methods: list[str], with_spice: bool) -> Iterator[tuple[str, str]]:
    """(who ran, what is wrong) of every run of a loop."""
    given, right = run(loop, uic=True, **TIGHT), run(loop, **TIGHT)
    yield f"tight {' '.join(right.said)}".strip(), verdict(loop, right, given, "start")
    runs: list[tuple[str, Callable[[], Outcome], Outcome, str]] = [
        (method, lambda method=method: run(loop, method=method), right, "mean") for method in methods
    ]
    runs.append(("uic", lambda: run(loop, uic=True), given, "mean"))
    if with_spice:
        runs.append(("ngspice", lambda: spice(loop), given, "start"))
    for who, does, beside, kind in runs:
        try:
            own = does()
        except Exception as e:  # whatever ends a run is a finding, and the next one is still to be made
            yield who, f"failed {type(e).__name__}: {str(e).splitlines()[0][:100]}"
            continue
        yield f"{who} {' '.join(own.said)}".strip(), verdict(loop, own, beside, kind)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=4)
    parser.add_argument("--kinds", default="")
    parser.add_argument("--methods", default="auto")
    parser.add_argument("--ngspice", action="store_true")
    parser.add_argument("--wrong", action="store_true")
    given = parser.parse_args()
    wrong = runs = 0
    for loop in loops(given.seed, given.count, given.kinds.split(",") if given.kinds else None):
        for who, what in judged(loop, given.methods.split(","), given.ngspice):
            runs, wrong = runs + 1, wrong + bool(what)
            if what or not given.wrong:
                print(f"{loop.kind:12} {loop.number:3}  {who:24} {what or 'right'}", flush=True)
    print(f"{runs} runs, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
