"""What a gradient along a transient costs: an RC ladder of n steps by its n resistances, beside a run and beside differences of
two runs a quantity. CPU time, medians of three.

    python tests/bench/gradients.py [n ..]
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable

import emsim


def ladder(n: int) -> str:
    lines = ["a ladder", "V1 n0 0 PULSE(0 1 0 1u 1u 1 2)"]
    for k in range(n):
        lines += [f"R{k + 1} n{k} n{k + 1} 1k", f"C{k + 1} n{k + 1} 0 {1e-6 / n**2!r}"]
    return "\n".join([*lines, ".tran 10u 2m", f".meas tran half when v(n{n})=0.5", ".end", ""])


def seconds(what: Callable[[], object]) -> float:
    taken = []
    for _ in range(3):
        begin = time.process_time()
        what()
        taken.append(time.process_time() - begin)
    return statistics.median(taken)


def main(counts: list[int]) -> None:
    emsim.Deck(ladder(2)).gradient(by=["r1"])  # imports
    for n in counts:
        deck = ladder(n)
        run = seconds(lambda deck=deck: emsim.run(deck, reltol=1e-6))
        names = [f"r{k + 1}" for k in range(n)]
        gradient = seconds(lambda deck=deck, names=names: emsim.Deck(deck).gradient("half", by=names))
        print(f"| {n} | {run:.3f} s | {gradient:.2f} s | {2 * n * run:.2f} s |", flush=True)


if __name__ == "__main__":
    main([int(word) for word in sys.argv[1:]] or [10, 30, 100, 300])
