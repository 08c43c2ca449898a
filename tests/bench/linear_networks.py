"""Random linear networks under every method against their exact solutions: `python tests/bench/linear_networks.py`.

Rows are compared where they stand, the ones right behind a corner among them; a tolerance is as in
tests/stability/test_linear_networks.py, of which this is the whole. For each method and tolerance: how many runs are
right, wrong (beyond ten tolerances without a message), told of, refused or stopped.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "stability"))

from linear_networks import SPAN, Unsuitable, capacitor_loops, driven, network
from test_linear_networks import MOST, TIMES, TOLD, own_start, worst_row

import emsim
from emsim.diagnostics import ConvergenceError, DeckError

METHODS = ("auto", "trap", "gear", "radau", "esdirk", "trbdf2", "gauss")
RELTOLS = (1e-3, 1e-6, 1e-9)
FAMILIES = {"network": network, "loops": capacitor_loops, "driven": driven}


def main() -> None:
    ask = argparse.ArgumentParser()
    ask.add_argument("--count", type=int, default=300, help="networks, shared among the families")
    ask.add_argument("--family", nargs="*", default=list(FAMILIES))
    ask.add_argument("--methods", nargs="*", default=list(METHODS))
    ask.add_argument("--reltol", nargs="*", type=float, default=list(RELTOLS))
    ask.add_argument("--show", action="store_true", help="a line for each that is wrong")
    given = ask.parse_args()
    found: dict[tuple[str, float], Counter[str]] = {
        (m, tol): Counter() for m in given.methods for tol in given.reltol
    }
    for k in range(given.count):
        family, seed = given.family[k % len(given.family)], k // len(given.family)
        net = FAMILIES[family](seed)
        determined = True
        try:
            net.solution(TIMES[:1])
        except Unsuitable as why:
            if str(why) != "nothing determines the start":
                continue
            determined = False
        for (method, reltol), counts in found.items():
            try:
                result = emsim.run(net.deck(f"method={method} reltol={reltol:g}"))
            except (DeckError, ConvergenceError) as refused:
                code = refused.diagnostics[0].code
                counts[code if code in ("E413", "E414") else "stopped"] += 1
                if given.show and code not in ("E413", "E414"):
                    print(family, seed, method, reltol, code, flush=True)
                continue
            start = None if determined else own_start(net, result)
            largest = np.abs(net.solution(np.arange(0.01, SPAN, 0.11), start)).max(axis=0)
            off, name, at = worst_row(net, result, reltol, largest, start)
            # (N402: trap says of itself that it does not hold a tolerance below 1e-4)
            told = [d.code for d in result.diagnostics if d.code in (*TOLD, "N402")]
            right = off <= MOST
            counts["right" if right else "told" if told else "wrong"] += 1
            if given.show and not right:
                print(
                    family,
                    seed,
                    method,
                    reltol,
                    f"{off:.3g} {name} at {at:.9g} us",
                    *sorted(set(told)),
                    flush=True,
                )
    for (method, reltol), counts in found.items():
        print(f"{method:7s} {reltol:g}", dict(sorted(counts.items())))


if __name__ == "__main__":
    main()
