"""What `auto` costs beside the best single method at equal accuracy, deck by deck of the benchmark set.

    python tests/bench/auto.py [--only NAME,NAME] [--errors 1e-3,1e-6] [--rounds 5] [--references FILE.npz]

One line a deck: for each error auto's CPU time in parts of the best single method's, and that method. Errors are largest
differences from the converged reference in parts of each signal's range, times at equal error come from the front of each
ladder of tolerances, timed in turns (emsim/reports/ladder.py, work_precision.py). The goal is 1.3 everywhere.
`--references` keeps the references from one run to the next: they take longer than all else.
Exit code 1 when a ratio is over the goal.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from suite_table import SUITE, Entry

from emsim import pipeline
from emsim.assemble.options import METHODS
from emsim.diagnostics import DiagnosticError
from emsim.reports import ladder, reference
from emsim.reports.work_precision import Series, best, exponent

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
GOAL = 1.3


def problem_of(entry: Entry) -> ladder.Problem:
    path = str(NETLISTS / f"{entry.deck}.cir")

    def prepare(options: dict[str, Any]) -> Any:
        return pipeline.prepare(pipeline.read(path), options)

    return ladder.Problem(prepare, list(entry.signals) or None, ladder.TIMES, entry.stop)


def judge_of(problem: ladder.Problem, name: str, kept: dict[str, Any]) -> tuple[ladder.Judge, float]:
    """The judge of errors, and the distance to which the reference is known."""
    if f"{name}/values" not in kept:
        found = reference.find(problem, METHODS, 3.0)
        kept[f"{name}/values"], kept[f"{name}/distance"] = found.judge.reference, found.distance
    return ladder.Judge(problem, np.asarray(kept[f"{name}/values"])), float(kept[f"{name}/distance"])


def ratio(series: list[Series], error: float, floor: float) -> tuple[float, str] | None:
    """auto's time in parts of the best single method's, and that one's name; None where no method gets there."""
    auto = next(s for s in series if s.name == "auto")
    first = best([s for s in series if s is not auto], error, floor)
    if first is None:
        return None
    time = auto.at(error, floor)
    return (time / first[1] if time is not None else float("inf")), first[0].name


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", default="")
    parser.add_argument("--errors", default="1e-3,1e-4,1e-6,1e-8")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--budget", type=float, default=4.0, help="seconds of repetitions a deck")
    parser.add_argument("--references", type=Path)
    parser.add_argument("--points", action="store_true", help="every method's times and errors too")
    given = parser.parse_args()
    errors = [float(e) for e in given.errors.split(",")]
    only = [name.strip() for name in given.only.split(",") if name.strip()]
    entries = [e for e in SUITE if not only or any(o in (e.name, e.deck, e.deck.split("/")[1]) for o in only)]
    kept: dict[str, Any] = {}
    if given.references and given.references.exists():
        kept = dict(np.load(given.references))
    print(f"{'deck':24s}" + "".join(f"{exponent(e):>20s}" for e in errors))
    ratios: list[float] = []
    for entry in entries:
        problem = problem_of(entry)
        try:
            judge, floor = judge_of(problem, entry.name, kept)
        except DiagnosticError as error:
            print(f"{entry.name:24s}  {error.diagnostics[0].message}")
            continue
        if given.references:
            np.savez(given.references, **kept)
        series = ladder.measure(problem, judge, METHODS, rounds=given.rounds, budget=given.budget, most=1.0)
        turns = ladder.Turns(problem, series)
        turns.spend(given.rounds, given.budget)
        turns.settle()
        found = [ratio(series, e, floor) for e in errors]
        cells = [f"{r[0]:6.2f} of {r[1]:10s}" if r else "-" for r in found]
        print(f"{entry.name:24s}" + "".join(f"{c:>20s}" for c in cells), flush=True)
        ratios += [r[0] for r in found if r]
        for s in series if given.points else []:
            times = [s.at(e, floor) for e in errors]
            row = "".join(f"{'-' if t is None else format(1e3 * t, '.3g'):>20s}" for t in times)
            print(
                f"  {s.name:22s}{row}   "
                + " ".join(
                    f"{p.setting}:{p.error:.0e}/{1e3 * p.seconds:.2g}"
                    if p.good
                    else f"{p.setting}:{p.reason}"
                    for p in s.points
                )
            )
    over = sum(r > GOAL for r in ratios)
    print(f"{len(ratios)} ratios: median {median(ratios):.2f}, largest {max(ratios):.2f}, {over} over {GOAL}")
    return int(over > 0)


if __name__ == "__main__":
    sys.exit(main())
