"""What the first run on a prepared deck takes beside later ones: machine code is made, patterns are analysed, caches are cold.

    python tests/bench/first.py [--rounds 40]

One line a deck and method: the least and the median CPU time of the transient, of first runs and of the three after each.
"""

from __future__ import annotations

import argparse
from statistics import median

from auto import problem_of
from suite_table import SUITE

RUNS = (
    ("bench/multiplier4", "trap", 3e-3),
    ("bench/multiplier4", "gear", 3e-6),
    ("electrical/diode_bridge", "trap", 1e-3),
    ("electrical/clipper", "trbdf2", 1e-4),
    ("bench/two_link_arm", "radau", 1e-3),
    ("mechanical/ref_double_pendulum", "dop853", 1e-4),
)


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=40)
    rounds = parser.parse_args(arguments).rounds
    entries = {entry.deck: entry for entry in SUITE}
    print(
        f"{'deck':32}{'method':8}{'reltol':>8}{'first, ms: least':>18}{'median':>9}{'later: least':>15}{'median':>9}"
    )
    for deck, method, reltol in RUNS:
        first, later = [], []
        for _ in range(rounds):
            problem = problem_of(entries[deck])
            times = [1e3 * problem.run(method, reltol)[1]["solve_time"] for _ in range(4)]
            first.append(times[0])
            later.append(min(times[1:]))
        shown = f"{min(first):18.3f}{median(first):9.3f}{min(later):15.3f}{median(later):9.3f}"
        print(f"{deck:32}{method:8}{reltol:8.0e}{shown}", flush=True)


if __name__ == "__main__":
    main()
