"""What a run of a sweep costs, and what a second process saves: `python tests/bench/sweep.py`."""

from __future__ import annotations

import time
from pathlib import Path

import emsim

RC = "rc\n.param r=1k\nV1 a 0 PULSE(0 1 0 1n 1n 1 2)\nR1 a b {r}\nC1 b 0 1u\n.tran 50u 5m\n.meas tran top MAX v(b)\n.end\n"
SERVO = Path(__file__).parents[2] / "netlists" / "coupled" / "pendulum_servo.cir"
DECKS = {"RC": (RC, "r=100..10k:1000log", 1000), "pendulum servo": (SERVO, "vp=4.5..5.5:1000", 1000)}


def seconds(source: object, axis: str, jobs: int) -> float:
    start = time.perf_counter()
    swept = emsim.sweep(source, [axis], jobs=jobs)
    assert swept.complete and not swept.failed, next(iter(swept.failed.values()), "")
    return time.perf_counter() - start


def main() -> None:
    print(f"{'deck':<16}{'runs':>6}{'one process [s]':>18}{'two [s]':>10}{'ratio':>8}")
    for name, (source, axis, runs) in DECKS.items():
        one, two = seconds(source, axis, 1), seconds(source, axis, 2)
        print(f"{name:<16}{runs:>6}{one:>18.2f}{two:>10.2f}{one / two:>8.2f}")


if __name__ == "__main__":
    main()
