"""Time of a whole process on a deck of ten lines, beside `python -c pass`.

    python tests/bench/startup.py [--runs 41] [--modules]

The commands run in turn, so that each meets the same machine; shown are medians and the ratio to `python -c pass`.
`console script` is what pip makes of the entry point: older pips' scripts import `re` first, newer ones do not.
Bytecode is cached, as it is after the first run of an installed package. --modules: what the run imports, and how
long each took [us], least of ten.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import emsim

DECK = """ten lines
V1 in 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 in a 1k
C1 a 0 100n
R2 a b 2k
C2 b 0 47n
L1 b c 10m
R3 c 0 1k
.tran 20u 4m
{}.end
"""
# the same deck with cards that ask for more than a raw file
DECKS = {
    "deck.cir": DECK.format(""),
    "print.cir": DECK.format(".print tran v(a) v(c)\n"),
    "meas.cir": DECK.format(
        ".meas tran top max v(c)\n.meas tran late trig v(in) val=0.5 rise=1 targ v(a) val=0.5 rise=1\n"
    ),
}
SCRIPT = "import sys; from emsim.cli import main; sys.exit(main())"


def environment() -> dict[str, str]:
    """The emsim that runs this, with cached bytecode."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONPATH": str(Path(emsim.__file__).parents[1])}


def commands() -> dict[str, list[str]]:
    python = sys.executable
    found = {
        "python -c pass": [python, "-c", "pass"],
        "console script": [python, "-c", SCRIPT, "deck.cir"],
        "  with .print": [python, "-c", SCRIPT, "print.cir"],
        "  with .meas": [python, "-c", SCRIPT, "meas.cir"],
        "  with import re": [python, "-c", "import re; " + SCRIPT, "deck.cir"],
        "python -m emsim": [python, "-m", "emsim", "deck.cir"],
        "python -c 'import lark'": [python, "-c", "import lark"],
    }
    if shutil.which("ngspice"):
        found["ngspice -b -r"] = ["ngspice", "-b", "-r", "n.raw", "deck.cir"]
    return found


def measure(runs: int) -> dict[str, tuple[float, float]]:
    """Median wall and mean CPU milliseconds of every command."""
    wall: dict[str, list[float]] = {}
    cpu: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, text in DECKS.items():
            Path(folder, name).write_text(text)
        for turn in range(runs + 1):
            for name, command in commands().items():
                before, start = os.times(), time.perf_counter()
                subprocess.run(command, cwd=folder, env=environment(), check=True, capture_output=True)
                spent, after = time.perf_counter() - start, os.times()
                if turn:  # the first turn writes the bytecode
                    wall.setdefault(name, []).append(1e3 * spent)
                    used = after.children_user + after.children_system
                    cpu.setdefault(name, []).append(
                        1e3 * (used - before.children_user - before.children_system)
                    )
    return {name: (statistics.median(wall[name]), statistics.mean(cpu[name])) for name in wall}


def modules(runs: int = 10) -> dict[str, int]:
    """Microseconds of each module of emsim that the run imports, and of what it imports besides."""
    least: dict[str, int] = {}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "deck.cir").write_text(DECKS["deck.cir"])
        command = [sys.executable, "-X", "importtime", "-c", SCRIPT, "deck.cir"]
        for _ in range(runs):
            done = subprocess.run(
                command, cwd=folder, env=environment(), check=True, capture_output=True, text=True
            )
            found = [
                line[12:].split("|") for line in done.stderr.splitlines() if line.startswith("import time:")
            ]
            own = [(name.strip(), int(spent)) for spent, _, name in found[1:]]
            first = next(k for k, (name, _) in enumerate(own) if name.startswith("emsim"))
            for name, spent in own[first:]:
                least[name] = min(spent, least.get(name, spent))
    return least


def main(argv: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=41)
    parser.add_argument("--modules", action="store_true")
    given = parser.parse_args(argv)
    if given.modules:
        found = modules()
        for name, spent in sorted(found.items(), key=lambda item: -item[1]):
            print(f"{spent:6} us  {name}")
        print(f"{sum(found.values()):6} us  {len(found)} modules")
        return 0
    found = measure(given.runs)
    base = found["python -c pass"]
    for name, (wall, cpu) in found.items():
        print(
            f"{name:<26}{wall:7.1f} ms wall{cpu:7.1f} ms CPU{wall / base[0]:6.2f} x wall{cpu / base[1]:6.2f} x CPU"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
