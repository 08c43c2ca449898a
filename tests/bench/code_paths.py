"""By how much results differ between machine code and the interpreter.

    python tests/bench/code_paths.py [deck.cir ...]

Each deck runs twice, as EMSIM_CODE=native and =interpreted. A line a deck: rows of either, and the largest difference
of a column at the same times, in parts of its range. Functions are rounded differently; where a step's error is near its
bound, another step follows.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
DECKS = tuple(
    f"electrical/{name}" for name in ("diode_bridge", "buck_mosfet", "clipper", "astable", "class_ab")
)
RUN = """import json, sys, emsim
r = emsim.run(open(sys.argv[1]).read())
print(json.dumps([list(r.time), {n: list(r[n]) for n in r.names}]))"""


def run(deck: Path, code: str) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    environment = {**os.environ, "EMSIM_CODE": code}
    done = subprocess.run(
        [sys.executable, "-c", RUN, deck],
        env=environment,
        cwd=deck.parent,
        capture_output=True,
        text=True,
        check=True,
    )
    time, columns = json.loads(done.stdout)
    return np.array(time), {name: np.array(column) for name, column in columns.items()}


def main() -> None:
    decks = [Path(name) for name in sys.argv[1:]] or [NETLISTS / f"{name}.cir" for name in DECKS]
    for deck in decks:
        if not deck.exists():
            print(f"{deck}: not there")
            continue
        (t, native), (u, other) = run(deck, "native"), run(deck, "interpreted")
        worst = 0.0
        for name, y in native.items():
            swing = float(np.ptp(y))
            if swing > 0 and name != "time":
                # at rows that both have; between rows a straight line would say less
                same = np.isin(t, u)
                worst = max(
                    worst,
                    float(np.abs(y[same] - np.interp(t[same], u, other[name])).max(initial=0.0)) / swing,
                )
        print(f"{deck.stem:24} rows {len(t):7} {len(u):7}   {worst:.1e} of the range")


if __name__ == "__main__":
    main()
