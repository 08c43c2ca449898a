"""The paper's tank experiment as a table: which method keeps a lossless oscillation, and at what cost.

    python tests/bench/paper_tank.py [--quick]

netlists/paper/tank.cir at 100 kHz, 400 kHz and 700 MHz, 100 periods, under trap, SPICE's gear (order 2) and radau, every
tolerance and largest step (in periods). Kept means: amplitude within 1 % and phase within 0.01 period of v = cos(2 pi f t).

Amplitude and phase come from both states: A = sqrt(v^2 + (L/C) i^2), largest over the last five periods, and
phi = atan2(sqrt(L/C) i, v) followed through all points. So a coarse grid of points costs no accuracy.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from pathlib import Path

import numpy as np

import emsim

DECK = Path(__file__).resolve().parents[2] / "netlists" / "paper" / "tank.cir"
CASES = {"100 kHz": (1e5, 1e-8), "400 kHz": (4e5, 1e-8), "700 MHz": (7e8, 1e-12)}  # frequency [Hz], C [F]
METHODS = ("trap", "gear", "radau")
RELTOLS = (1e-3, 1e-6)
TMAX = (0.5, 0.1, 0.02, 0.005)  # of a period
PERIODS = 100


def tank(f: float, cap: float, method: str, reltol: float, tmax: float) -> dict[str, float]:
    """One run: amplitude, phase error [periods], steps, CPU seconds, points per period."""
    text = re.sub(r"(?im)^\.tran.*$", f".tran {1 / f!r} {PERIODS / f!r} 0 {tmax / f!r} UIC", DECK.read_text())
    options = {"method": method, "reltol": reltol} | ({"maxord": 2} if method == "gear" else {})
    result = emsim.run(text, defines={"f": f, "cap": cap}, options=options)
    t, v, i = (np.asarray(result[n]) for n in ("time", "v(a)", "i(l1)"))
    z = 1 / (2 * math.pi * f * cap)  # sqrt(L/C) [ohm]
    amplitude = np.hypot(v, z * i)
    phase = (
        np.unwrap(np.arctan2(z * i, v)) / (2 * math.pi) if amplitude[-1] > 1e-9 else np.full_like(t, np.nan)
    )
    return {
        "amplitude": float(amplitude[t >= (PERIODS - 5) / f].max()),
        "phase": float(phase[-1] - f * t[-1]),
        "steps": float(result.stats.get("steps", len(t))),
        "points": len(t) / PERIODS,
        "cpu": float(result.stats["solve_time"]),
    }


def kept(row: dict[str, float]) -> bool:
    return abs(row["amplitude"] - 1) < 0.01 and abs(row["phase"]) < 0.01


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one frequency only")
    given = parser.parse_args(argv)
    print(f"{'f':<9}{'method':<7}{'reltol':>8}{'tmax/T':>8}{'amplitude':>11}{'phase':>10}  "
          f"{'verdict':<14}{'steps':>8}{'points/T':>9}{'CPU ms':>9}")  # fmt: skip
    for label, (f, cap) in list(CASES.items())[: 1 if given.quick else None]:
        for method in METHODS:
            for reltol in RELTOLS:
                for tmax in TMAX:
                    row = tank(f, cap, method, reltol, tmax)
                    verdict = "kept" if kept(row) else "damped" if row["amplitude"] < 0.99 else "out of phase"
                    print(f"{label:<9}{method:<7}{reltol:8.0e}{tmax:8.3f}{row['amplitude']:11.5f}{row['phase']:10.5f}  "
                          f"{verdict:<14}{row['steps']:8.0f}{row['points']:9.1f}{1e3 * row['cpu']:9.2f}")  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
