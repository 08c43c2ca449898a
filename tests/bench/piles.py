"""Random piles, arms and parts that rub in large numbers: `python tests/bench/piles.py pile 0 10000`, `.. arm 0 2000`,
`.. stack 0 3000`, `.. box 0 3000`, `.. rods 0 3000`; in space `.. balls 0 3000`, `.. dice 0 3000`.

Prints every scene that gains energy, does not come to rest, whose ledger has a line below 0 or does not add up, or that needs
many events or long; and the counts.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "physics"))

from piles import RUBBING, arm, deck, pile, rubbing

import emsim

LONG = 3.0  # s


def scene(kind: str, seed: int) -> tuple[str, list[str]]:
    """The deck, and its cards that hit."""
    if kind in RUBBING:
        return rubbing(kind, seed, 2.0)
    text, joints = pile(seed)[:2] if kind == "pile" else arm(seed)
    return deck(text, joints, 8.0 if kind == "pile" else 1.5), [f"c{k}" for k in range(len(joints))]


def main(kind: str, first: int, last: int) -> None:
    begun, impacts, told, steps = time.time(), 0.0, 0, 0
    for seed in range(first, last):
        text, touches = scene(kind, seed)
        start = time.process_time()
        try:
            r = emsim.run(text)
        except (emsim.DeckError, emsim.ConvergenceError) as error:
            told += 1
            print(seed, str(error).partition("\n")[0], flush=True)
            continue
        took, energy = time.process_time() - start, np.asarray(r["energy()"])
        size = max(1.0, float(np.abs(energy).max()), float(np.ptp(energy)))
        hits = float(sum(r[f"hits({c})"][-1] for c in touches))
        impacts += hits
        wrong = []
        if float(np.diff(energy).max()) > 1e-3 * size:
            wrong.append(f"energy rises by {float(np.diff(energy).max()):.2g} J")
        if kind == "pile" and r["ke()"][-1] > 1e-6 * size:
            wrong.append("still moves")
        if r.stats["events"] > 100 * max(10.0, hits) or took > LONG:
            wrong.append(f"{r.stats['events']} events for {hits:.0f} impacts, {took:.1f} s")
        if (least := min(line.dissipated for line in r.energy.lines)) < -1e-6 * size:
            wrong.append(f"a ledger line of {least:.2g} J")
        if abs(r.energy.residual) > 1e-3 * size:
            wrong.append(f"{r.energy.residual:.2g} J without a cause")
        if kind in RUBBING and (gap := min(float(np.min(r[f"gap({c})"])) for c in touches)) < -1e-4:
            wrong.append(f"a gap of {gap:.2g} m")
        steps += sum(d.code == "W420" for d in r.diagnostics)
        if wrong:
            told += 1
            print(seed, "; ".join(wrong), flush=True)
    said = f"{last - first} scenes, {impacts:.0f} impacts, {told} told, {steps} with short steps"
    print(f"{said}, {time.time() - begun:.0f} s")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
