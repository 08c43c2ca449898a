"""Solve time of emsim beside ngspice, and whole-process time of a small deck beside `python -c pass`.

    python tests/bench/speed.py [--runs 5] [--scale 1] [names ...]

For each circuit the two programs run in turn (ngspice, emsim, ngspice, emsim, ...), each in a process of its own,
at default tolerances. Two clocks are read on both sides:

  wall   ngspice's own "Transient analysis time" (`rusage all`, a wall clock), the wall time of emsim's analyses;
         without start-up and parsing. On a busy machine both grow.
  CPU    ngspice: user + system time of the process, less that of the same deck cut down to one step;
         emsim: stats["solve_time"], CPU seconds of the native analysis.

Both programs keep the waveforms in memory; no file is written. The ratio is of the medians.
"""

from __future__ import annotations

import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

DIODE = ".model dr D(is=1n n=1.6 rs=50m cjo=20p)\n"


def bridge(scale: float) -> tuple[str, float, float]:
    """Four-diode bridge with smoothing: about 200 000 points."""
    deck = (
        "four-diode bridge\nVac p n SIN(0 17 50)\nD1 p out dr\nD2 n out dr\nD3 0 p dr\nD4 0 n dr\n"
        "C1 out 0 470u\nRL out 0 200\nRb n 0 1meg\n" + DIODE
    )
    return deck, 5e-6, 1.0 * scale


def low_pass(scale: float) -> tuple[str, float, float]:
    """RC low-pass: a million points."""
    return (
        "rc low-pass\nV1 in 0 PULSE(0 1 0 100n 100n 4.9u 10u)\nR1 in out 1k\nC1 out 0 1n\n",
        1e-8,
        1e-2 * scale,
    )


def ladder(scale: float) -> tuple[str, float, float]:
    """RC ladder of 100 stages, a pulse train."""
    lines = ["rc ladder", "V1 n0 0 PULSE(0 5 0 10n 10n 5u 10u)"]
    for k in range(100):
        lines += [f"R{k} n{k} n{k + 1} 100", f"C{k} n{k + 1} 0 1p"]
    return "\n".join([*lines, ""]), 1e-8, 2e-4 * scale


def multiplier(scale: float) -> tuple[str, float, float]:
    """Cockcroft-Walton multiplier of ten stages: 20 diodes."""
    lines = ["ten-stage multiplier", "V1 in 0 SIN(0 100 10k)", "R1 in a0 50"]
    for k in range(1, 11):
        b = f"b{k - 1}" if k > 1 else "0"
        lines += [
            f"CA{k} a{k - 1} a{k} 100n",
            f"DA{k} {b} a{k} dr",
            f"DB{k} a{k} b{k} dr",
            f"CB{k} {b} b{k} 100n",
        ]
    return "\n".join([*lines, "RL b10 0 10meg", DIODE]), 2e-7, 1e-2 * scale


CIRCUITS: dict[str, Callable[[float], tuple[str, float, float]]] = {
    "bridge": bridge, "low_pass": low_pass, "ladder": ladder, "multiplier": multiplier,
}  # fmt: skip
GOALS = {"bridge": 4.0, "low_pass": 10.0, "ladder": 3.0, "multiplier": 3.0}

SMALL = """ten lines
V1 in 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 in a 1k
C1 a 0 100n
R2 a b 2k
C2 b 0 47n
L1 b c 10m
R3 c 0 1k
.tran 20u 4m
.end
"""

EMSIM_RUN = """
import sys, time
from emsim import pipeline
assembly, planned = pipeline.prepare(pipeline.read(sys.argv[1]))
start = time.perf_counter()
runs = pipeline.solve(assembly, planned)
wall = time.perf_counter() - start
result = pipeline.deliver(assembly, runs)
print(wall, result.stats["solve_time"], len(result))
"""


def full_deck(circuit: tuple[str, float, float], tail: str = "") -> str:
    body, tstep, tstop = circuit
    return f"{body}.tran {tstep!r} {tstop!r}\n{tail}.end\n"


def cpu_of(command: list[str], cwd: str) -> tuple[float, float, str]:
    """Wall and CPU seconds of a process and its stdout."""
    before, start = os.times(), time.perf_counter()
    done = subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=True
    )
    wall, after = time.perf_counter() - start, os.times()
    cpu = after.children_user - before.children_user + after.children_system - before.children_system
    return wall, cpu, done.stdout


def ngspice_once(circuit: tuple[str, float, float], folder: str) -> dict[str, float]:
    """Reported analysis time, process CPU time and points of one run."""
    path = os.path.join(folder, "ngspice.cir")
    Path(path).write_text(full_deck(circuit, ".control\nrun\nrusage all\nquit\n.endc\n"))
    _, cpu, out = cpu_of(["ngspice", "-b", path], folder)
    number = {k: float(v) for k, v in re.findall(r"^([A-Z][\w ]+?) = ([-\d.e+]+)\s*$", out, re.M)}
    return {"wall": number["Transient analysis time"], "cpu": cpu, "points": number["Accepted timepoints"]}


def emsim_once(circuit: tuple[str, float, float], folder: str) -> dict[str, float]:
    path = os.path.join(folder, "emsim.cir")
    Path(path).write_text(full_deck(circuit))
    _, _, out = cpu_of([sys.executable, "-c", EMSIM_RUN, path], folder)
    wall, cpu, points = map(float, out.split())
    return {"wall": wall, "cpu": cpu, "points": points}


def measure(name: str, runs: int, scale: float) -> dict[str, float]:
    """Medians of interleaved runs of one circuit."""
    circuit = CIRCUITS[name](scale)
    body, tstep, _ = circuit
    theirs, ours, base = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(runs):
            theirs.append(ngspice_once(circuit, folder))
            ours.append(emsim_once(circuit, folder))
            base.append(ngspice_once((body, tstep, tstep), folder)["cpu"])
    mid = statistics.median
    return {
        "ngspice_points": mid(r["points"] for r in theirs),
        "emsim_points": mid(r["points"] for r in ours),
        "ngspice_wall": mid(r["wall"] for r in theirs),
        "emsim_wall": mid(r["wall"] for r in ours),
        "ngspice_cpu": max(mid(r["cpu"] for r in theirs) - mid(base), 1e-4),
        "emsim_cpu": max(mid(r["cpu"] for r in ours), 1e-6),
    }


def process_times(runs: int) -> dict[str, tuple[float, float]]:
    """Median milliseconds (wall, CPU) of python alone, of emsim and of ngspice on a deck of ten lines."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "small.cir").write_text(SMALL)
        commands = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "emsim small.cir": [sys.executable, "-m", "emsim", "small.cir"],
            "ngspice -b -r": ["ngspice", "-b", "-r", "n.raw", "small.cir"],
        }
        seen: dict[str, list[tuple[float, float, str]]] = {key: [] for key in commands}
        for _ in range(runs):
            for key, command in commands.items():
                seen[key].append(cpu_of(command, folder))
    mid = statistics.median
    return {
        key: (1e3 * mid(v[0] for v in values), 1e3 * mid(v[1] for v in values))
        for key, values in seen.items()
    }


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("names", nargs="*", choices=[[], *CIRCUITS], metavar="NAME")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--scale", type=float, default=1.0, help="length of the runs, 1 for the stated ones")
    given = parser.parse_args(argv)
    print(f"{'circuit':<12}{'points':>9}{'/ngspice':>10}{'wall ms':>10}{'/ngspice':>10}{'ratio':>7}"
          f"{'CPU ms':>10}{'/ngspice':>10}{'ratio':>7}{'goal':>6}")  # fmt: skip
    for name in given.names or CIRCUITS:
        m = measure(name, given.runs, given.scale)
        print(f"{name:<12}{m['emsim_points']:9.0f}{m['ngspice_points']:10.0f}"
              f"{1e3 * m['emsim_wall']:10.1f}{1e3 * m['ngspice_wall']:10.1f}{m['ngspice_wall'] / m['emsim_wall']:7.1f}"
              f"{1e3 * m['emsim_cpu']:10.1f}{1e3 * m['ngspice_cpu']:10.1f}{m['ngspice_cpu'] / m['emsim_cpu']:7.1f}"
              f"{GOALS[name]:6.0f}", flush=True)  # fmt: skip
    for key, value in process_times(max(given.runs, 5)).items():
        print(f"{key:<18}{value[0]:7.1f} ms wall {value[1]:7.1f} ms CPU")
    return 0


if __name__ == "__main__":
    sys.exit(main())
