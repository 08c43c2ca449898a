"""What it costs to look at every recorded row: runs with and without, by turns, and the medians of their times.

    python tests/bench/invariants.py [--repeat 15] [decks under netlists/ ..]

One line a deck: time to solve with rows that are looked at and with rows that are not [ms], and what the first takes more.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from statistics import median

import emsim
from emsim.assemble import options as settings

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
DECKS = (
    "electrical/rc_ladder",
    "electrical/buck_converter",
    "electrical/zener_regulator",
    "electrical/diode_bridge",
    "mechanical/ref_four_bar",
    "coupled/relay",
    "coupled/cart_pole",
)


def seconds(text: str, watched: bool) -> float:
    """Time of one run's solver [s]."""
    resolve = settings.resolve
    if not watched:
        settings.resolve = lambda *a, **k: {**resolve(*a, **k), "unwatched": True}
    try:
        return float(emsim.run(text).stats["solve_time"])
    finally:
        settings.resolve = resolve


def cost(text: str, repeat: int) -> tuple[float, float]:
    """Medians with and without, of runs by turns [s]."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeat):
        for k, watched in enumerate((True, False)):
            times[k].append(seconds(text, watched))
    return median(times[0]), median(times[1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("decks", nargs="*", default=DECKS)
    parser.add_argument("--repeat", type=int, default=15)
    asked = parser.parse_args()
    print(f"{'deck':<32}{'looked at':>12}{'not':>10}{'more':>9}")
    for name in asked.decks:
        with_, without = cost((NETLISTS / f"{name}.cir").read_text(encoding="utf-8"), asked.repeat)
        print(
            f"{name:<32}{1e3 * with_:>9.3f} ms{1e3 * without:>7.3f} ms{100 * (with_ / without - 1):>+8.1f} %"
        )


if __name__ == "__main__":
    main()
