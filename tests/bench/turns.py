"""What a change costs: two trees, or one tree under two settings, on the same decks in turns.

    python tests/bench/turns.py OLD NEW [--set suite|outside|all] [--reltol 1e-4] [--rounds 5] [decks ...]

OLD and NEW are folders that hold an `emsim` package with its compiled engine (a checkout, a site-packages), each with
environment variables behind it if wanted: `../old`, `.,EMSIM_CODE=interpreted`. Each has one process that lives through the
whole comparison; the two take turns run by run, so that a slow moment of the machine meets both. Told are, deck by deck, the
ratio of the least CPU times of the native analysis (new / old) and both errors against a tight run of OLD (`--no-errors` leaves
them out): largest deviation of any column at rows of the print grid, in parts of that column's range. At the end:
median and worst.

    suite    the decks of README's table (suite_table.py)
    outside  every other deck of netlists/ with a .tran
"""

from __future__ import annotations

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
NETLISTS = ROOT / "netlists"
TIGHT = 1e-3  # the reference's tolerance, in parts of the runs'
POINTS = 400  # rows compared

# the process of one side: a request a line, an answer a line
WORKER = r"""
import json, sys
import numpy as np
import emsim
for line in sys.stdin:
    ask = json.loads(line)
    try:
        r = emsim.run(ask["deck"], reltol=ask["reltol"], options=ask["options"], energy=False)
        t = np.asarray(r.time)
        answer = {"cpu": r.stats["solve_time"], "steps": r.stats.get("steps", 0)}
        if ask["at"]:
            at = np.linspace(t[0], t[-1], ask["at"])
            answer["values"] = {n: np.asarray(r.at(n, at), float).tolist() for n in r.names if n != "time"}
    except Exception as error:
        answer = {"failed": type(error).__name__ + ": " + str(error).splitlines()[0][:100]}
    print(json.dumps(answer), flush=True)
"""


class Side:
    """One tree with its settings, alive for the whole comparison."""

    def __init__(self, told: str) -> None:
        path, *settings = told.split(",")
        env = {
            **os.environ,
            "PYTHONPATH": str(Path(path).resolve()),
            **dict(s.split("=", 1) for s in settings),
        }
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", WORKER], env=env, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip

    def run(self, deck: str, reltol: float, at: int = 0, **options: object) -> dict:
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(
            json.dumps({"deck": deck, "reltol": reltol, "at": at, "options": options}) + "\n"
        )
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline() or '{"failed": "the process ended"}')


def decks(which: str) -> list[tuple[str, str]]:
    """(name, text) with the deck's own method and tolerance taken out."""
    from suite_table import SUITE

    suite = {entry.deck for entry in SUITE}
    found = []
    for path in sorted(NETLISTS.rglob("*.cir")):
        name, text = str(path.relative_to(NETLISTS).with_suffix("")), path.read_text(encoding="utf-8")
        inside = name in suite
        if (which == "suite" and not inside) or (which == "outside" and inside):
            continue
        if name.startswith("lessons/") or not re.search(r"(?im)^\.tran\b", text):
            continue
        text = re.sub(r"(?im)^(\.(?:include|lib)\s+)(\S)", rf"\1{path.parent}/\2", text)
        found.append((name, re.sub(r"(?im)(\s)(method|reltol|trtol|maxord)\s*=\s*\S+", r"\1", text)))
    return found


def error(of: dict, reference: dict) -> float:
    """Largest deviation of any common column, in parts of its range."""
    worst = 0.0
    for name, values in reference.get("values", {}).items():
        want, got = np.array(values), np.array(of.get("values", {}).get(name, values))
        span = float(np.ptp(want))
        if span > 0 and np.isfinite(got).all():
            worst = max(worst, float(np.quantile(np.abs(got - want), 0.95)) / span)
    return worst


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("decks", nargs="*", help="names below netlists/")
    parser.add_argument("--set", default="suite", choices=("suite", "outside", "all"))
    parser.add_argument("--reltol", type=float, default=1e-4)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--no-errors", action="store_true")
    a = parser.parse_intermixed_args()

    old, new = Side(a.old), Side(a.new)
    at = 0 if a.no_errors else POINTS
    ratios: dict[str, float] = {}
    print(f"{'deck':38} {'old ms':>9} {'new ms':>9} {'ratio':>6} {'old err':>8} {'new err':>8}")
    for name, text in decks("all" if a.decks else a.set):
        if a.decks and name not in a.decks:
            continue
        first = [side.run(text, a.reltol, at) for side in (old, new)]
        failed = [answer.get("failed") for answer in first]
        if any(failed):
            print(f"{name:38} {'failed':>9}: old {failed[0] or 'ok'}, new {failed[1] or 'ok'}", flush=True)
            continue
        times = [[answer["cpu"]] for answer in first]
        # short runs more often
        for _ in range(a.rounds if max(t[0] for t in times) > 0.05 else 4 * a.rounds):
            for side, kept in zip((old, new), times, strict=True):
                kept.append(side.run(text, a.reltol)["cpu"])
        least = [min(t) for t in times]
        ratios[name] = least[1] / least[0]
        errors = ""
        if at:
            reference = old.run(text, max(TIGHT * a.reltol, 1e-10), at)
            if "failed" not in reference:
                errors = " ".join(f"{error(answer, reference):8.1e}" for answer in first)
        print(
            f"{name:38} {1e3 * least[0]:9.3f} {1e3 * least[1]:9.3f} {ratios[name]:6.2f} {errors}", flush=True
        )
    worst = sorted(ratios.items(), key=lambda item: -item[1])[:5]
    print(f"{len(ratios)} decks: median {statistics.median(ratios.values()):.3f}; "
          f"worst {', '.join(f'{name} {ratio:.2f}' for name, ratio in worst)}")  # fmt: skip


if __name__ == "__main__":
    main()
