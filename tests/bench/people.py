"""Whole processes beside ngspice on sixty decks as people write them, at defaults and at equal error.

    python tests/bench/people.py [--runs 5] [--only NAME,KIND,..] [--defaults] [--readme]

The decks are those of people_decks.txt; none is of the benchmark set. Each program runs in turn in a process of its own and
writes a raw file (`emsim -r`, `ngspice -b -r`); CPU time is user and system time of the whole process, medians. A ratio above 1
says that emsim is the quicker one. At equal error: both go down a ladder of tolerances (ngspice of largest steps too), and times
are read on the straight line between a program's points in the log-log chart. The error is the largest difference of a node's
voltage in parts of its range, from a run of emsim at reltol 1e-8; `own` says what emsim's default comes to, `its` what ngspice's.
--readme writes the table of kinds into README.md.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
from itertools import product
from pathlib import Path

import numpy as np

import emsim
from emsim.outputs import raw
from emsim.reports.work_precision import front, time_at
from emsim.units import spice_number

ROOT = Path(emsim.__file__).parents[1]
SCRIPT = "import sys; from emsim.cli import main; sys.exit(main())"
ERRORS = (1e-2, 1e-3, 1e-5)
RELTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
PARTS = (1, 5, 25, 125, 625)  # ngspice's largest step: a 50th of the run, divided by these
TIGHT = 1e-8
TIMES = 1000
LIMIT = 30.0  # [s] of a run
README = ("<!-- people: written by python tests/bench/people.py --readme -->", "<!-- end of people -->")


def decks() -> dict[str, tuple[str, str]]:
    """name -> (kind, text), what is written once for many sections written out."""
    text = Path(__file__).with_name("people_decks.txt").read_text()
    found = re.findall(r"(?ms)^==== (\w+) \| (\w+)\n(.*?)(?=^====|\Z)", text)
    return {name: (kind, _written_out(body) + ".end\n") for name, kind, body in found}


def _written_out(body: str) -> str:
    """`*repeat N .. *end`: lines for k = 1..N with j = k - 1; `*mesh N`, `*tree N`, `*tower N`: a grid of resistors with
    capacitors, a tree of N inverters, each driving two, N stages of diodes and capacitors."""
    many = re.compile(r"(?ms)^\*repeat (\d+)\n(.*?)^\*end\n")
    body = many.sub(lambda m: "".join(m[2].format(k=k, j=k - 1) for k in range(1, int(m[1]) + 1)), body)
    body = re.sub(r"(?m)^\*mesh (\d+)$", lambda m: _mesh(int(m[1])), body)
    body = re.sub(r"(?m)^\*tree (\d+)$", lambda m: _tree(int(m[1])), body)
    return re.sub(r"(?m)^\*tower (\d+)$", lambda m: _tower(int(m[1])), body)


def _mesh(n: int) -> str:
    lines = []
    for i, j in product(range(n), repeat=2):
        lines += [f"RX{i}x{j} n{i}x{j} n{i + 1}x{j} 0.5"] * (i + 1 < n)
        lines += [f"RY{i}x{j} n{i}x{j} n{i}x{j + 1} 0.5"] * (j + 1 < n)
        lines.append(f"C{i}x{j} n{i}x{j} 0 1p")
    return "\n".join(lines)


def _tree(n: int) -> str:
    return "\n".join(f"X{k}{s} n{k} n{2 * k + s} vdd inv" for k in range(1, n + 1) for s in (0, 1))


def _tower(n: int) -> str:
    lines = []
    for k in range(1, n + 1):
        push, hold = ("in" if k == 1 else f"a{k - 1}"), ("0" if k == 1 else f"b{k - 1}")
        lines += [f"CA{k} {push} a{k} 1u", f"CB{k} {hold} b{k} 1u"]
        lines += [f"DA{k} {hold} a{k} dm", f"DB{k} a{k} b{k} dm"]
    return "\n".join(lines)


def spent(command: list[str], folder: Path) -> float:
    """CPU seconds of a process; nan where it fails or takes too long."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            command, cwd=folder, env={**kept, "PYTHONPATH": str(ROOT)}, capture_output=True, timeout=LIMIT
        )
    except subprocess.TimeoutExpired:
        return float("nan")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return seconds if done.returncode in (0, 4) else float("nan")


def own(deck: str, out: str, reltol: float | None) -> list[str]:
    return [
        sys.executable,
        "-c",
        SCRIPT,
        deck,
        "-r",
        out,
        "-q",
        *([f"--reltol={reltol:g}"] if reltol else []),
    ]


def its(text: str, reltol: float, part: float) -> str:
    """The deck at a tolerance and a largest step of ngspice's."""
    small = reltol / 1e-3
    options = f".options reltol={reltol:g} abstol={1e-12 * small:g} vntol={1e-6 * small:g} chgtol={1e-14 * small:g}\n"
    step, stop = tran(text)
    uic = " uic" if re.search(r"(?m)^\.tran.*\buic", text) else ""
    text = re.sub(r"(?m)^\.tran.*$", f".tran {step} {stop!r} 0 {stop / 50 / part:g}{uic}", text)
    return text.replace(".end\n", options + ".end\n")


def tran(text: str) -> tuple[str, float]:
    """The step, as it is written, and the stop time [s] of a deck's .tran."""
    found = re.search(r"(?m)^\.tran (\S+) (\S+)", text)
    assert found
    stop = spice_number(found[2])
    assert stop is not None
    return found[1], stop


def voltages(path: Path, times: np.ndarray) -> dict[str, np.ndarray]:
    """Node voltages of the transient in a raw file, at common times."""
    return of(raw.read(str(path)), times)


def of(result: emsim.Result, times: np.ndarray) -> dict[str, np.ndarray]:
    """The same of a result. OSError where the run did not reach its end."""
    table = next(table for table in result.plots if table.kind == "tran")
    if table.time[-1] < times[-1] * (1 - 1e-9):
        raise OSError(f"it ends at {table.time[-1]} s")
    inside = np.clip(times, table.time[0], table.time[-1])
    names = [name for name in table.names if re.fullmatch(r"v\([a-z0-9_]+\)", name)]
    return {name: table.at(name, inside) for name in names}


def distance(found: dict[str, np.ndarray], reference: dict[str, np.ndarray]) -> float:
    """Largest difference in parts of a node's range; what hardly moves beside the others counts by theirs."""
    both = [name for name in reference if name in found]
    largest = max(float(np.ptp(reference[name])) for name in both)
    return max(
        float(np.max(abs(found[name] - reference[name])))
        / max(float(np.ptp(reference[name])), 1e-3 * largest)
        for name in both
    )


def off(path: Path, reference: dict[str, np.ndarray], times: np.ndarray) -> float:
    """The error of a run; nan where it has no file or did not reach its end."""
    try:
        return distance(voltages(path, times), reference)
    except (OSError, raw.RawFileError):
        return float("nan")


class Row:
    """What was measured on one deck: CPU seconds at defaults, errors there, seconds at equal errors."""

    def __init__(self, name: str, kind: str) -> None:
        self.name, self.kind = name, kind
        self.defaults = (float("nan"), float("nan"))
        self.errors: list[float] = []
        self.equal: dict[float, tuple[float | None, float | None]] = {}

    @property
    def ratio(self) -> float:
        return self.defaults[1] / self.defaults[0]

    def at(self, error: float) -> float | None:
        """How many times as long ngspice takes; inf where it does not get there."""
        mine, theirs = self.equal.get(error, (None, None))
        return None if mine is None else float("inf") if theirs is None else theirs / mine


def measured(name: str, kind: str, text: str, runs: int, ladder: bool) -> Row:
    row = Row(name, kind)
    with tempfile.TemporaryDirectory() as directory:
        folder = Path(directory)
        (folder / "deck.cir").write_text(text)
        theirs = ["ngspice", "-b", *([] if ".sens" in text else ["-r", "its.raw"]), "deck.cir"]
        pairs = [
            (spent(own("deck.cir", "own.raw", None), folder), spent(theirs, folder)) for _ in range(runs)
        ]
        row.defaults = (statistics.median(p[0] for p in pairs), statistics.median(p[1] for p in pairs))
        if ladder and ".tran" in text:
            _ladder(row, text, folder, max(3, runs // 2))
    return row


def _ladder(row: Row, text: str, folder: Path, runs: int) -> None:
    times = np.linspace(0, tran(text)[1], TIMES + 1)[1:]
    spent(own("deck.cir", "tight.raw", TIGHT), folder)
    if not (folder / "tight.raw").exists():
        return
    reference = voltages(folder / "tight.raw", times)
    row.errors = [off(folder / file, reference, times) for file in ("own.raw", "its.raw")]
    points: tuple[list[tuple[float, float]], list[tuple[float, float]]] = ([], [])
    commands = [(0, own("deck.cir", f"o{k}.raw", r), f"o{k}.raw") for k, r in enumerate(RELTOLS)]
    for k, (reltol, part) in enumerate(product(RELTOLS[1:], PARTS)):
        (folder / f"n{k}.cir").write_text(its(text, reltol, part))
        commands.append((1, ["ngspice", "-b", "-r", f"n{k}.raw", f"n{k}.cir"], f"n{k}.raw"))
    for who, command, file in commands:
        seconds = [spent(command, folder) for _ in range(runs if who == 0 else 1)]
        if not np.isnan(seconds).any():
            points[who].append(
                (distance(voltages(folder / file, times), reference), statistics.median(seconds))
            )
    lines = [front((e, s) for e, s in p if not np.isnan(e)) for p in points]
    row.equal = {error: (time_at(lines[0], error), time_at(lines[1], error)) for error in ERRORS}


def told(ratio: float | None) -> str:
    return "-" if ratio is None else "only emsim" if ratio == float("inf") else f"{ratio:.2g}"


def table(rows: list[Row]) -> list[str]:
    """The kinds: medians over their decks, and the least."""
    out = [
        "| kind | decks | at defaults, median (least) | at 1e-2 | at 1e-3 | at 1e-5 |",
        "|---|---|---|---|---|---|",
    ]
    for kind in dict.fromkeys(row.kind for row in rows):
        of = [row for row in rows if row.kind == kind]
        both = [row for row in of if not np.isnan(row.ratio)]
        ratios = sorted(row.ratio for row in both)
        least = min(both, key=lambda row: row.ratio)
        cells = []
        for error in ERRORS:
            found = sorted(r for row in of if (r := row.at(error)) is not None)
            cells.append(f"{told(statistics.median(found))} ({told(found[0])})" if found else "-")
        out.append(
            f"| {kind} | {len(of)} | {statistics.median(ratios):.2g} ({ratios[0]:.2g}, {least.name}) | {' | '.join(cells)} |"
        )
    return out


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--only", default="")
    parser.add_argument("--defaults", action="store_true", help="no ladder")
    parser.add_argument("--readme", action="store_true")
    given = parser.parse_args()
    only = set(filter(None, given.only.split(",")))
    rows = []
    print(f"{'deck':<22}{'kind':<12}{'emsim':>9}{'ngspice':>9}{'ratio':>7}{'own':>9}{'its':>9}   at {ERRORS}")
    for name, (kind, text) in decks().items():
        if only and not only & {name, kind}:
            continue
        row = measured(name, kind, text, given.runs, not given.defaults)
        rows.append(row)
        errors = "".join(f"{e:9.1e}" for e in row.errors) if row.errors else " " * 18
        ms = "".join(f"{1e3 * s:7.0f}ms" for s in row.defaults)
        print(
            f"{name:<22}{kind:<12}{ms}{row.ratio:7.2g}{errors}   {'  '.join(told(row.at(e)) for e in ERRORS)}",
            flush=True,
        )
    lines = table(rows)
    print("", *lines, sep="\n")
    if given.readme:
        path = Path(__file__).resolve().parents[2] / "README.md"
        start, end = README
        head, _, rest = path.read_text().partition(start)
        path.write_text("\n".join([head + start, "", *lines, "", end + rest.partition(end)[2]]))


if __name__ == "__main__":
    main()
