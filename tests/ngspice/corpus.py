"""Decks in both programs: python tests/ngspice/corpus.py FOLDER

Each deck of the folder runs in emsim, and in ngspice twice: as it is, for its time, and with tolerances so tight that its
values count. Every vector of every plot is compared on the merged axis, within a step of the tight run: its largest deviation
divided by its range. So are the numbers that `print`, `echo` and `meas` show. A table, and a line with the score.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import emsim
from emsim.diagnostics import Diagnostic
from emsim.outputs import raw
from emsim.table import Table, without_letter

LIMIT = 0.005  # of a vector's range
TIGHT = ".options reltol=1e-5 abstol=1e-12 vntol=1e-8 itl1=500 itl4=200"
POINTS = 4000  # steps of a tight transient at least
SECONDS = 20
MOST_BYTES = 10_000_000  # of a file that is copied beside a deck
# what ngspice makes of a POLY, an expression, a line, for .probe, inside a VDMOS, a port; a limit that only warns
INTERNAL = r"\$|_int\d|#i\d|#v\d|#int\d|#hi\d|#lo\d|ediff\d|#gate|#body|#res|:bv_max|_bv_max"
NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
VALUE = re.compile(rf"^\s*([^=\n]*\S)\s+=\s+({NUMBER})(?:,({NUMBER}))?", re.I | re.M)
DECKS = ("*.cir", "*.sp", "*.net", "*.spice", "*.ckt")


class Case:
    """What became of one deck."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.deviation, self.where, self.missing = 0.0, "", ""
        self.cpu = self.cpu_ngspice = float("nan")
        self.compared = 0

    @property
    def passed(self) -> bool:
        return not self.missing and self.compared > 0 and self.deviation <= LIMIT

    def line(self) -> str:
        verdict = "pass" if self.passed else "FAIL"
        told = self.missing or self.where
        return (
            f"{self.path.name:<34} {verdict}  {100 * self.deviation:9.4f} %  {1e3 * self.cpu:8.1f} ms "
            f"{1e3 * self.cpu_ngspice:8.1f} ms  {told[:90]}"
        )


# ---- ngspice ----


def for_ngspice(text: str, tight: bool) -> str:
    """The deck with a section that writes every plot; without `quit`, which would come before."""
    lines = text.split("\n")
    if tight:
        lines = [tight_transient(line) for line in lines]
    dump = [
        "set filetype=binary",
        "set appendwrite",
        "foreach all_of_them $plots",
        "setplot $all_of_them",
        "write all.raw",
        "end",
    ]
    control = next((k for k, line in enumerate(lines) if line.strip().lower() == ".control"), None)
    ends = [k for k, line in enumerate(lines) if line.strip().lower() == ".endc"]
    if control is not None and ends:
        lines = [
            line
            for k, line in enumerate(lines)
            if not (k > control and re.match(r"\s*(quit|exit)\b", line, re.I))
        ]
        ends = [k for k, line in enumerate(lines) if line.strip().lower() == ".endc"]
        lines[ends[-1] : ends[-1]] = dump
    else:
        end = next((k for k, line in enumerate(lines) if line.strip().lower() == ".end"), len(lines))
        lines[end:end] = [".control", "run", *dump, "quit", ".endc"]
    if tight:
        lines.insert(1, TIGHT)
    return "\n".join(lines) + "\n"


def tight_transient(line: str) -> str:
    """`tran` with short steps, where its numbers are plain."""
    found = re.match(r"(\s*\.?tran)\s+(\S+)\s+(\S+)(?:\s+(\d\S*))?(?:\s+(\d\S*))?(.*)$", line, re.I)
    if found is None:
        return line
    from emsim.units import spice_number

    stop, largest = spice_number(found[3]), spice_number(found[5]) if found[5] else None
    if stop is None:
        return line
    largest = min(largest or stop, stop / POINTS)
    return f"{found[1]} {found[2]} {found[3]} {found[4] or 0} {largest:.6g} {found[6]}"


def ngspice(text: str, folder: Path) -> tuple[list[Table], str, float, bool]:
    """Plots, what it printed, CPU time, and whether it came to the end."""
    (folder / "corpus_deck.cir").write_text(text)
    written = folder / "all.raw"
    written.unlink(missing_ok=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            ["ngspice", "-b", "corpus_deck.cir"],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=SECONDS,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        return [], "", float("nan"), False
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    plots = [p for p in raw.read(str(written)).plots if p.plotname != "constants"] if written.exists() else []
    return plots, done.stdout, cpu, bool(plots)


# ---- comparison ----


def key(name: str) -> str:
    """One spelling for what files call v(out), out, i(v1), v1#branch."""
    name = without_letter("".join(name.lower().split())).replace(":b_tj", ":b")
    if name.endswith("#branch"):
        return f"i({without_letter(name[:-7])})"
    return name


def columns(table: Table) -> dict[str, str]:
    found = {}
    for name in table.names:
        found.setdefault(key(name), name)
        # vectors of `let` and `meas` have a type in one program and none in the other
        plain = key(name)
        for other in (plain[2:-1], f"v({plain})", f"i({plain})"):
            found.setdefault(other, name)
    for name in table.names:
        # raw files of ngspice have one name for all currents of a line with losses: the first is meant
        if (line := re.fullmatch(r"i\((.*)#i1(_1)?\)", key(name))) is not None:
            found.setdefault(f"i({line[1]})", name)
    return found


def deviation(ours: Table, theirs: Table, name: str, own: str) -> float:
    """The largest difference of a vector, divided by its range (or by its size where it holds still)."""
    a, b = ours[own], theirs[name]
    if theirs.axis is not None and ours.axis is not None and len(b) > 1 and len(a) > 1:
        x, y = ours[ours.names[0]].real, theirs[theirs.names[0]].real
        if len(x) != len(y) or not np.allclose(x, y, rtol=1e-6, atol=0):
            up, vp = bool(np.all(np.diff(x) >= 0)), bool(np.all(np.diff(y) >= 0))
            if not (up and vp):
                return float("inf")
            low, high = max(x[0], y[0]), min(x[-1], y[-1])
            merged = np.unique(np.concatenate([x, y]))
            # where a source bends at the start, one has its first row before the bend and the other behind it
            merged = merged[(merged >= (low if np.iscomplexobj(b) else max(low, y[1]))) & (merged <= high)]
            # at a jump there are two values: beside it, not on it
            jumps = y[1:][np.diff(y) < 1e-9 * (high - low)]
            for t in jumps:
                merged = merged[np.abs(merged - t) > 2e-9 * (high - low)]
            b = between(merged, y, b)
            a = nearest(merged, x, a, b, (high - low) / POINTS) if np.isrealobj(a) else between(merged, x, a)
    n = min(len(a), len(b))
    if not n:
        return float("inf")
    a, b = a[:n], b[:n]
    size = float(np.max(np.abs(b)))
    span = float(np.ptp(b)) if not np.iscomplexobj(b) else size
    scale = span if span > 1e-6 * size and n > 1 else size
    worst = float(np.max(np.abs(a - b)))
    if not np.isfinite(worst):
        return float("inf")
    floor = 1e-9 if name.lower().startswith("v(") else 1e-11
    return worst / max(scale, floor) if worst > 1e-3 * floor else 0.0


def nearest(at: np.ndarray, x: np.ndarray, y: np.ndarray, to: np.ndarray, step: float) -> np.ndarray:
    """Values within a step of each place that come nearest to `to`: an edge is no more known than the steps of the tight run."""
    low, high = np.clip(at - step, x[0], x[-1]), np.clip(at + step, x[0], x[-1])
    ends = np.array([between(low, x, y), between(high, x, y)])
    rows = np.stack([np.searchsorted(x, low), np.searchsorted(x, high, "right")], axis=1)
    inside = [y[a:b] for a, b in rows]
    least = [v.min(initial=e) for v, e in zip(inside, ends.min(axis=0), strict=True)]
    most = [v.max(initial=e) for v, e in zip(inside, ends.max(axis=0), strict=True)]
    return np.clip(to, least, most)


def between(at: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    if np.iscomplexobj(y):
        return np.interp(at, x, y.real) + 1j * np.interp(at, x, y.imag)
    return np.interp(at, x, y)


def compare(case: Case, ours: list[Table], theirs: list[Table]) -> None:
    left = list(ours)
    for plot in theirs:
        kind = plot.plotname.lower()
        own = next((p for p in left if p.plotname.lower() == kind), None)
        if own is None:
            case.missing = case.missing or f"no plot {plot.plotname}"
            continue
        left.remove(own)
        known = columns(own)
        if "pole" in kind:
            roots(case, own, plot)
            continue
        for name in plot.names[1 if plot.axis else 0 :]:
            if re.search(INTERNAL, name) or name == "all":  # the name of nothing in a plot without vectors
                continue
            if "inoise_total" in name:
                continue  # emsim integrates the spectrum at the source, ngspice the slope of the one at the output
            mine = known.get(key(name))
            plain = re.sub(r"^[vi]\((.*)\)$", r"\1", key(name))
            if mine is None and (made := own.aside.get(plain)) is not None:
                # what commands made of another length than the plot's: a number is compared, else what is printed of it
                if len(made) == 1:
                    case.compared += 1
                    found = abs(made[0] - plot[name][0]) / max(abs(plot[name][0]), 1e-9)
                    if found > case.deviation:
                        case.deviation, case.where = float(found), f"{plot.plotname}: {name}"
                continue
            still = len(plot) > 1 and (plot.axis is None or np.all(plot[name][1:] == plot[name][1]))
            if mine is None and still:
                continue  # a current of ngspice's own parts that is none, a number made by commands
            if mine is None and kind.startswith(("sens", "noise", "integrated")) and not np.any(plot[name]):
                continue  # of a parameter without effect, of a part without noise
            if mine is None:
                case.missing = case.missing or f"{plot.plotname}: no {name}"
                continue
            case.compared += 1
            found = deviation(own, plot, name, mine)
            if found > case.deviation:
                case.deviation, case.where = found, f"{plot.plotname}: {name}"


def roots(case: Case, ours: Table, theirs: Table) -> None:
    """Poles, and zeros, in whatever order."""
    for word in ("pole", "zero"):
        mine, other = ([complex(t[n][0]) for n in t.names if word in n] for t in (ours, theirs))
        if len(mine) != len(other):
            case.missing = case.missing or f"{len(mine)} {word}s, not {len(other)}"
        for z in other:
            case.compared += 1
            found = min((abs(z - w) for w in mine), default=float("inf")) / max(abs(z), 1e-9)
            if found > case.deviation:
                case.deviation, case.where = found, f"{word} {z:.6g}"


def printed(case: Case, ours: str, theirs: str, deck: str) -> None:
    """`name = number` of both, in order of each name."""
    a, b = ({}, {})
    for text, found in ((ours, a), (theirs, b)):
        for name, re_, im in VALUE.findall(text):
            if re.search(r"[A-Za-z.] [A-Za-z]|^\s*(pole|zero)\(", name):  # a sentence; roots have no order
                continue
            found.setdefault(key(name), []).append(complex(float(re_), float(im or 0)))
    for name, values in b.items():
        mine = a.get(name, [])
        if not mine:  # how often is another matter: ngspice -b measures again behind the section
            if name in key(deck):  # else it is of ngspice about itself
                case.missing = case.missing or f"`{name}` is not printed"
            continue
        for x, y in zip(mine, values, strict=False):
            case.compared += 1
            found = abs(x - y) / max(abs(y), 1e-9) if abs(x - y) > 1e-11 else 0.0
            if found > case.deviation:
                case.deviation, case.where = found, f"printed {name}: {x:.6g} beside {y:.6g}"


# ---- a deck, a folder ----


def run(path: Path, timed: bool = True) -> Case:
    case = Case(path)
    text = path.read_text(errors="replace")
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as scratch:
        for name, deck in (("ngspice", for_ngspice(text, True)), ("timed", for_ngspice(text, False))):
            folder = beside(path, Path(scratch) / name)
            if name == "ngspice":
                theirs, said, _, there = ngspice(deck, folder)
            elif timed:
                _, _, case.cpu_ngspice, _ = ngspice(deck, folder)
        if not there:
            case.missing = "ngspice has no result"
            return case
        folder = beside(path, Path(scratch) / "emsim")
        (folder / path.name).unlink(missing_ok=True)
        (folder / path.name).write_text(text)
        os.chdir(folder)
        began = time.process_time()
        try:
            result = emsim.run(path.name)
            errors = [d for d in result.diagnostics if d.severity == "error"]
        except (emsim.DeckError, emsim.ConvergenceError, emsim.OutsideError) as error:
            result = getattr(error, "partial", None)
            errors = [d for d in error.diagnostics if d.severity == "error"]
        except Exception as error:  # a fault of emsim's own, one deck's among many
            result, errors = None, []
            case.missing = f"crash: {type(error).__name__}: {error}"
        finally:
            case.cpu = time.process_time() - began
            os.chdir(here)
        errors = [e for e in errors if not failed_too(e, said)]
        if errors:
            case.missing = f"{errors[0].code} {errors[0].message}"
        if result is not None:
            compare(case, result.plots, theirs)
            measured = "\n".join(m.text() for m in result.measured)
            printed(case, result.output + "\n" + measured, said, text)
    return case


def failed_too(error: Diagnostic, said: str) -> bool:
    """Is this a measurement that ngspice did not find either?"""
    name = re.match(r"`([^`]+)` is not found", error.message)
    if error.code != "E430" or name is None:
        return False
    return bool(re.search(rf"\bmeas\w* +(\w+ +)?'?{re.escape(name[1])}\b.*failed", said, re.I))


def beside(path: Path, folder: Path) -> Path:
    """A folder where the files beside the deck can be read, and nothing of theirs is written: copies, since what a section
    reads has to lie there."""
    folder.mkdir()
    for other in path.parent.iterdir():
        if other.is_file() and other != path and other.stat().st_size < MOST_BYTES:
            shutil.copy(other, folder)
        elif other != path:
            os.symlink(other.resolve(), folder / other.name)
    return folder


def decks(folder: Path) -> list[Path]:
    return sorted(p for pattern in DECKS for p in folder.rglob(pattern))


def score(cases: list[Case]) -> str:
    known = [c for c in cases if c.missing != "ngspice has no result"]
    passed = sum(c.passed for c in known)
    computed = sum(not c.missing and c.compared > 0 for c in known)
    close = sum(not c.missing and c.compared > 0 and c.deviation <= 0.01 for c in known)
    share = 100 / max(len(known), 1)
    return (
        f"{passed} of {len(known)} decks pass ({passed * share:.1f} %), {computed * share:.1f} % computed, "
        f"{close * share:.1f} % within 1 %; {len(cases) - len(known)} without a result of ngspice"
    )


def main(folder: str) -> int:
    cases = []
    print(
        f"{'deck':<34} {'':4}  {'deviation':>11}  {'emsim':>11} {'ngspice':>11}  worst, or first thing missing"
    )
    for path in decks(Path(folder)):
        case = run(path)
        cases.append(case)
        print(case.line(), flush=True)
    print(score(cases))
    return 0 if all(c.passed for c in cases) else 1


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
