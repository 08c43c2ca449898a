"""Asked tolerance against met error, over the whole reference set and every method.

    python tests/bench/error_control.py [--methods radau,gear] [--decks four_bar,comb] [--seconds 5] [--to 1e-10]

One line a deck and method, one column a tolerance: the error (tests/reference_set.py) in units of the tolerance. `.` is an
error below the reference's own digits; `!` marks more than ten times the tolerance; `-` is not tried: the rung before took
`seconds` of CPU or more.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from reference_set import LADDER, PROBLEMS, TRAJECTORIES

from emsim.assemble.options import METHODS
from emsim.diagnostics import DiagnosticError

MEANS = 10.0
TOO_LONG = "-"


def rung(case, method: str, reltol: float) -> float | str:
    """The error, or why there is none."""
    try:
        return max(case.errors(f"method={method} reltol={reltol:g}").values())
    except DiagnosticError as e:
        return next((d.code for d in e.diagnostics), "failed")


def cell(error: float | str, reltol: float, floor: float) -> str:
    if isinstance(error, str):
        return error
    if error <= floor:
        return "."
    return f"{error / reltol:.2g}" + ("!" if error > MEANS * reltol else "")


def ladder(case, method: str, tolerances: list[float], seconds: float) -> list[float | str]:
    found: list[float | str] = []
    for reltol in tolerances:
        if found and found[-1] == TOO_LONG:
            found.append(TOO_LONG)
            continue
        start = time.process_time()
        found.append(rung(case, method, reltol))
        if time.process_time() - start > seconds:
            found += [TOO_LONG]
    return found[: len(tolerances)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--decks", default="", help="words of their names")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--to", type=float, default=LADDER[-1])
    given = parser.parse_args()
    tolerances = [r for r in LADDER if r >= 0.9 * given.to]
    words = given.decks.lower().split(",")
    print(f"{'':28}{'':9}" + "".join(f"{r:>8.0e}" for r in tolerances))
    ratios: dict[str, list[float]] = {}
    above: dict[str, int] = {}
    for case in [*PROBLEMS, *TRAJECTORIES]:
        if not any(w in case.name for w in words):
            continue
        for method in given.methods.split(","):
            found = ladder(case, method, tolerances, given.seconds)
            cells = [cell(e, r, case.floor) for e, r in zip(found, tolerances, strict=True)]
            print(f"{case.name:28}{method:9}" + "".join(f"{c:>8}" for c in cells), flush=True)
            met = [
                e / r
                for e, r in zip(found, tolerances, strict=True)
                if not isinstance(e, str) and e > case.floor
            ]
            ratios.setdefault(method, []).extend(met)
            above[method] = above.get(method, 0) + sum(m > MEANS for m in met)
    print("\nmethod    median of error / tolerance, largest, rungs above ten times")
    for method, met in ratios.items():
        if met:
            print(f"{method:9} {statistics.median(met):8.2g} {max(met):8.2g} {above[method]:6} of {len(met)}")


if __name__ == "__main__":
    main()
