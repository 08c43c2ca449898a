"""Conditions that hold for a short while near a crest: the share of such pulses that is seen.

    python tests/bench/crests.py [--sources sin,am] [--paths direct,rc] [--methods auto,trap] [--reltols 1e-3,1e-6] [--levels 0.9,0.999]

One line a source, path, reader and method, one column a level and tolerance: `1` where every pulse is seen and none beside them, else
the share that is seen and, behind `+`, those that are none. The level is a share of the largest value that the signal comes to.
What is right stands in `right`: the signal in closed form on a fine grid, behind an RC by its recursion for straight lines.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.signal import lfilter

import emsim

STOP = 20e-3
POINTS = 2_000_001
TAU = 2 * np.pi


def _rise(t: np.ndarray, at: float, tau: float) -> np.ndarray:
    return np.where(t > at, -np.expm1(-np.maximum(t - at, 0.0) / tau), 0.0)


def _ramps(t: np.ndarray) -> np.ndarray:
    s = t % 1e-3
    return np.clip(np.minimum(s / 0.4e-3, (0.9e-3 - s) / 0.4e-3), 0.0, 1.0)


# lines that make v(s), and the same in closed form
SOURCES: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
    "sin": ("Vs s 0 SIN(0 1 1k)", lambda t: np.sin(TAU * 1e3 * t)),
    "am": (
        "Vs s 0 AM(0.5 1 150 1k)",
        lambda t: 0.5 * (1 + np.sin(TAU * 150 * t)) * np.sin(TAU * 1e3 * t),
    ),
    "sffm": ("Vs s 0 SFFM(0 1 1k 5 100)", lambda t: np.sin(TAU * 1e3 * t + 5 * np.sin(TAU * 100 * t))),
    "exp": (
        "Vs s 0 EXP(0 1 1m 0.2m 5m 0.2m)",
        lambda t: _rise(t, 1e-3, 0.2e-3) - _rise(t, 5e-3, 0.2e-3),
    ),
    "ramps": ("Vs s 0 PULSE(0 1 0 0.4m 0.4m 0.1m 1m)", _ramps),
    "sum": (
        "Va a 0 SIN(0 0.6 1k)\nVs s a SIN(0 0.4 1.7k)",
        lambda t: 0.6 * np.sin(TAU * 1e3 * t) + 0.4 * np.sin(TAU * 1.7e3 * t),
    ),
    "product": (
        "Va a 0 SIN(0 1 1k)\nVb b 0 SIN(0.5 0.5 370)\nBs s 0 V={v(a)*v(b)}",
        lambda t: np.sin(TAU * 1e3 * t) * (0.5 + 0.5 * np.sin(TAU * 370 * t)),
    ),
    "time": ("Bs s 0 V={sin(6283.185307179586*time)}", lambda t: np.sin(6283.185307179586 * t)),
}
RC = 30e-6
# lines from v(s) to v(x), and what they make of it
PATHS: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
    "direct": ("Ex x 0 s 0 1", lambda s: s),
    "divider": ("R1 s m 1k\nR2 m x 1k\nR3 m 0 3k\nR4 x 0 2k", lambda s: s * (1.5 / 2.5) * (2 / 3)),
    "cube": ("Ex x 0 VALUE={v(s)*v(s)*v(s)}", lambda s: s**3),
    "rc": ("R1 s x 1k\nC1 x 0 30n", lambda s: filtered(s)),
    "rc2": ("R1 s m 1k\nC1 m 0 30n\nEm e 0 m 0 2\nR2 e x 1k\nC2 x 0 10n", lambda s: 2 * filtered(filtered(s), 10e-6)),
}
READERS = {
    "B": "B1 g 0 V={v(x)>LEVEL ? 5 : 0}",
    "E": "E1 g 0 VALUE={if(v(x)>LEVEL,5,0)}",
    "S": "Vp p 0 5\nS1 p g x 0 sw\nR9 g 0 1k\n.model sw sw(vt=LEVEL ron=1u roff=1e9)",
    "adc": "A1 [x] [d] ad\nA2 [d] [g] da\n.model ad adc_bridge(in_low=LEVEL in_high=LEVEL rise_delay=1n fall_delay=1n)\n"
    ".model da dac_bridge(out_low=0 out_high=5 t_rise=1n t_fall=1n)",
    "u": "B1 g 0 V={5*u(v(x)-LEVEL)}",
    "max": "B1 g 0 V={max(v(x)-LEVEL, 0)*1e12}",
}


@cache
def times() -> np.ndarray:
    return np.linspace(0.0, STOP, POINTS)


def filtered(s: np.ndarray, tau: float = RC) -> np.ndarray:
    """y' = (s - y)/tau from the operating point, exact for straight lines between the points."""
    h = STOP / (POINTS - 1)
    a = np.exp(-h / tau)
    mean = (1 - a) * tau / h
    y, _ = lfilter([1 - mean, mean - a], [1, -a], s, zi=[s[0] - (1 - mean) * s[0]])
    return y


@cache
def right(source: str, path: str, level: float) -> tuple[float, tuple[tuple[float, float], ...], float]:
    """The level itself, the pulses (from, to) above it, the share of time above it."""
    x = PATHS[path][1](SOURCES[source][1](times()))
    at = level * float(x.max())
    above = np.concatenate(([False], x > at, [False]))
    starts, ends = np.flatnonzero(~above[:-1] & above[1:]), np.flatnonzero(above[:-1] & ~above[1:])
    t = np.append(times(), STOP)
    return at, tuple(zip(t[starts].tolist(), t[ends].tolist(), strict=True)), float(above.mean())


def deck(source: str, path: str, reader: str, level: float, method: str, reltol: float) -> str:
    lines = (SOURCES[source][0], PATHS[path][0], READERS[reader].replace("LEVEL", repr(level)))
    options = f".options method={method} reltol={reltol:g}"
    return "\n".join(["crests", *lines, "Rg g o 1k", "Cg o 0 1n", options, f".tran 10u {STOP:g}", ".end"])


def seen(source: str, path: str, reader: str, level: float, method: str, reltol: float) -> tuple[float, int]:
    """The share of the pulses that is seen, and how many there are beside them."""
    at, pulses, _ = right(source, path, level)
    r = emsim.run(deck(source, path, reader, at, method, reltol))
    t, g = np.asarray(r.time), np.asarray(r["v(g)"])
    high = t[g > 2.5]
    if not pulses:
        return 1.0, int(high.size > 0)
    found = [bool(np.any((high >= a - 1e-8) & (high <= b + 1e-8))) for a, b in pulses]
    rises = int(np.count_nonzero((g[:-1] <= 2.5) & (g[1:] > 2.5))) + int(g[0] > 2.5)
    return sum(found) / len(found), max(rises - len(pulses), 0)


def cell(share: float, more: int) -> str:
    return f"{share:.3g}" + (f"+{more}" if more else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sources", default=",".join(SOURCES))
    parser.add_argument("--paths", default=",".join(PATHS))
    parser.add_argument("--readers", default="B")
    parser.add_argument("--methods", default="auto,trap,gear,radau,trbdf2,esdirk,gauss,rk45,dop853")
    parser.add_argument("--reltols", default="1e-3,1e-6")
    parser.add_argument("--levels", default="0.9,0.95,0.99,0.999")
    words = {key: value.split(",") for key, value in vars(parser.parse_args()).items()}
    columns = [(float(level), float(tol)) for level in words["levels"] for tol in words["reltols"]]
    print(" ".join(f"{level:g}@{tol:g}" for level, tol in columns))
    missing = 0
    for source in words["sources"]:
        for path in words["paths"]:
            for reader in words["readers"]:
                for method in words["methods"]:
                    cells = []
                    for level, tol in columns:
                        try:
                            cells.append(cell(*seen(source, path, reader, level, method, tol)))
                        except emsim.DiagnosticError as e:
                            cells.append(e.diagnostics[0].code)
                    missing += sum(c != "1" for c in cells)
                    print(f"{source:8} {path:8} {reader:4} {method:7}", *(f"{c:>9}" for c in cells), flush=True)
    sys.exit(1 if missing else 0)


if __name__ == "__main__":
    main()
