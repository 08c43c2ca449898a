"""A motor on a 20 kHz bridge, 20 000 periods: solve time and error in speed, ngspice beside it.

    python tests/bench/pwm.py [--rounds 3]

netlists/coupled/ref_pwm_hbridge_motor.cir as it is (default method and tolerance), and its electrical analogue
(`emsim analogue`) in ngspice over a few largest steps. Error: largest distance of the speed from matrix exponentials taken
from edge to edge (tests/physics/refs/pwm_hbridge_motor.csv), over the speed's range. Time: CPU seconds of the analysis,
without start-up and parsing, in rounds that take turns; the median. The goal: 1e-6 in at most 0.5 s.
Exit code 1 when the error is over it.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median

import numpy as np

from emsim import pipeline
from emsim.interop.ngspice import NgspiceError
from emsim.interop.ngspice_time import Bench
from emsim.reports import analogue

ROOT = Path(__file__).resolve().parents[2]
DECK = str(ROOT / "netlists/coupled/ref_pwm_hbridge_motor.cir")
REFERENCE = ROOT / "tests/physics/refs/pwm_hbridge_motor.csv"
GOAL = 1e-6
# ngspice's knobs: reltol and the largest step [s]; as written first
SETTINGS = (("reltol=1e-3", 50e-6), ("reltol=1e-6 abstol=1e-15 vntol=1e-9", 50e-6), ("reltol=1e-3", 1e-6))


def reference() -> tuple[np.ndarray, np.ndarray]:
    lines = [line for line in REFERENCE.read_text().splitlines() if not line.startswith("#")]
    place = lines[0].split(",").index("w")
    rows = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
    return rows[:, 0], rows[:, place]


def emsim_once(times: np.ndarray, speed: np.ndarray) -> tuple[float, float, str]:
    """Error, CPU seconds, what ran."""
    table = pipeline.run(DECK).main
    values = np.array([float(table.at("omega(shaft)", t)) for t in times])
    stats = table.stats
    about = f"{stats['method']}, {stats['steps']} steps, {stats['events']} edges"
    return float(np.abs(values - speed).max() / np.ptp(speed)), float(stats["solve_time"]), about


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--limit", type=float, default=120.0, help="seconds that a run of ngspice may take")
    given = parser.parse_args()
    times, speed = reference()
    spice = analogue.deck(*pipeline.prepare(pipeline.read(DECK)))
    rows: dict[str, list[tuple[float, float, str]]] = {"emsim": []}
    with Bench(spice, str(ROOT), ["v(w_rotor)"]) as bench:
        for k in range(given.rounds):
            rows["emsim"].append(emsim_once(times, speed))
            for options, tmax in SETTINGS if k == 0 else SETTINGS[:1]:
                name = f"ngspice, {options.split()[0]}, tmax {tmax * 1e6:g} us"
                try:
                    table, seconds = bench.values((50e-6, 0.0, 1.0, tmax), options, given.limit)
                except NgspiceError as error:
                    print(f"{name}: {error}")
                    continue
                inside = np.clip(times, table.time[0], table.time[-1])
                values = np.array([float(table.at("v(w_rotor)", t)) for t in inside])
                error = float(np.abs(values - speed).max() / np.ptp(speed))
                rows.setdefault(name, []).append((error, seconds, f"{len(table)} points"))
    print(f"{'':42s}{'error':>10s}{'CPU s':>9s}")
    for name, found in rows.items():
        print(f"{name:42s}{found[-1][0]:10.1e}{median(f[1] for f in found):9.3g}   {found[-1][2]}")
    return int(max(f[0] for f in rows["emsim"]) > GOAL)


if __name__ == "__main__":
    sys.exit(main())
