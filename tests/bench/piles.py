"""Random piles and arms in large numbers: `python tests/bench/piles.py pile 0 10000`, `python tests/bench/piles.py arm 0 2000`.

Prints every scene that gains energy, does not come to rest, or needs many events or long, and the counts.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "physics"))

from piles import arm, deck, pile

import emsim

LONG = 3.0  # s


def main(kind: str, first: int, last: int) -> None:
    begun, impacts, told = time.time(), 0.0, 0
    for seed in range(first, last):
        text, joints = pile(seed)[:2] if kind == "pile" else arm(seed)
        start = time.time()
        try:
            r = emsim.run(deck(text, joints, 8.0 if kind == "pile" else 1.5))
        except emsim.ConvergenceError as error:
            told += 1
            print(seed, str(error).partition("\n")[0], flush=True)
            continue
        took, energy = time.time() - start, np.asarray(r["energy()"])
        size = max(1.0, float(np.abs(energy).max()), float(np.ptp(energy)))
        hits = float(sum(r[f"hits(c{k})"][-1] for k in range(len(joints))))
        impacts += hits
        wrong = []
        if float(np.diff(energy).max()) > 1e-3 * size:
            wrong.append(f"energy rises by {float(np.diff(energy).max()):.2g} J")
        if kind == "pile" and r["ke()"][-1] > 1e-6 * size:
            wrong.append("still moves")
        if r.stats["events"] > 100 * max(10.0, hits) or took > LONG:
            wrong.append(f"{r.stats['events']} events for {hits:.0f} impacts, {took:.1f} s")
        if wrong:
            told += 1
            print(seed, "; ".join(wrong), flush=True)
    print(f"{last - first} scenes, {impacts:.0f} impacts, {told} told, {time.time() - begun:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
