"""Drawings read back: `python tests/bench/drawn_back.py [COUNT] [SEED] [PARTS]` draws so many mutated decks, those of more than
PARTS parts aside, and tells which do not read as their deck, and how long a drawing takes.

Mutations of the decks in netlists/ and of small ones with every letter: terminals moved to other nets, elements left out, put in
series and in parallel, made sources of what others carry, coupled, boxed; see tests/unit/schematic/mutants.py.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import process_time

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "unit" / "schematic"))

from mutants import mutants

from emsim.schematic.back import differences
from emsim.schematic.circuit import Circuit
from emsim.schematic.layout import MOST
from emsim.schematic.picture import Picture


def main(count: int, seed: int, most: int = MOST) -> None:
    wrong, drawn, seconds = 0, 0, []
    for name, flat in mutants(sys.maxsize, seed):
        circuit = Circuit(flat)
        if not 0 < len(circuit.parts) <= most:
            continue
        began = process_time()
        picture = Picture(circuit)
        seconds.append(process_time() - began)
        drawn += 1
        if said := differences(picture.data, circuit):
            wrong += 1
            print(f"{name}: {'; '.join(said[:3])}", flush=True)
        if drawn % 100 == 0:
            print(f"{drawn} drawn", flush=True)
        if drawn == count:
            break
    seconds.sort()
    print(
        f"{drawn} drawn, {wrong} do not read as their deck; median {seconds[drawn // 2]:.2f} s, longest {seconds[-1]:.2f} s"
    )


if __name__ == "__main__":
    main(*(int(word) for word in (sys.argv[1:] + ["1000", "1"][len(sys.argv) - 1 :])))
