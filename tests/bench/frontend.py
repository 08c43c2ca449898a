"""Time of the front end: text to flat deck, per card, and its share of a cold start.

    python tests/bench/frontend.py [cards]

A ladder with diodes, sources, expressions and subcircuits, 50 000 cards (about 2 MB) unless said otherwise.
"""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import time


def deck_text(cards: int) -> str:
    """An RC ladder in which every tenth stage carries something less plain."""
    lines = ["front-end benchmark", ".param rbase=1k cbase={1/1e9}", ".model dm D(is=1e-14 rs=10)"]
    lines += [
        ".subckt stage a b",
        "Rs a b 2.2k",
        "Cs b 0 4.7n",
        ".ends",
        "Vin n0 0 PULSE(0 5 1u 10n 10n 5u 10u)",
    ]
    k = 0
    while len(lines) < cards:
        a, b = f"n{k}", f"n{k + 1}"
        lines += [f"Rladder{k} {a} {b} 1.5k", f"Cladder{k} {b} 0 10p ; stage {k}"]
        match k % 10:
            case 1:
                lines.append(f"Dclamp{k} {b} 0 dm")
            case 3:
                lines.append(f"Rpar{k} {a} {b} {{rbase*{k % 7 + 1}}} tc=1m,2u")
            case 5:
                lines.append(f"Bload{k} {b} 0 I={{v({b})*1u + cbase*0}}")
            case 7:
                lines.append(f"Xst{k} {a} {b} stage")
            case 8:
                lines.append(f"Isrc{k} 0 {b} DC 1u AC 1 SIN(0 1u 1k)")
            case 9:
                lines.append(f"Ectl{k} e{k} 0 {a} {b} 10")
        k += 1
    return "\n".join([*lines, ".tran 1u 1m", ".end", ""])


def measure(cards: int, runs: int = 5) -> None:
    """Least of several runs, without garbage collection, as in a process of one command."""
    from emsim import pipeline
    from emsim.build import read
    from emsim.elaborate import flatten

    text = deck_text(cards)
    read("warm\nR1 a 0 1k\n")  # the tables are loaded once per process
    gc.disable()
    times: dict[str, list[float]] = {"parse and build": [], "flatten": [], "together": [], "assemble": []}
    for _ in range(runs):
        start = time.process_time()
        deck = read(text)
        middle = time.process_time()
        flat = flatten(deck)
        end = time.process_time()
        times["parse and build"].append(middle - start)
        times["flatten"].append(end - middle)
        times["together"].append(end - start)
        assembled = pipeline.prepare(flat)
        times["assemble"].append(time.process_time() - end)
        elements = len(flat.elements)
        # freed outside of the times: a process of one command never frees them
        del deck, flat, assembled
    print(f"{cards} cards, {len(text) / 1e6:.2f} MB -> {elements} elements")
    for name, values in times.items():
        print(f"{name:16} {min(values):6.3f} s cpu {min(values) / cards * 1e6:6.1f} us a card")


SMALL = """ten lines
V1 in 0 PULSE(0 5 0 1n 1n 5u 10u)
R1 in out 1k
C1 out 0 1n
D1 out 0 dm
.model dm D(is=1e-14)
B1 x 0 V={v(out)*2}
R2 x 0 1k
.tran 1u 1m
.end
"""


def cold_start(repeats: int = 15) -> None:
    """Process time of `read + flatten` of ten lines, against `python -c pass`."""
    work = f"from emsim.build import read; from emsim.elaborate import flatten; flatten(read({SMALL!r}))"
    times: dict[str, list[float]] = {"pass": [], "import lark": [], "read and flatten": []}
    for _ in range(repeats):
        for name, code in (("pass", "pass"), ("import lark", "import lark"), ("read and flatten", work)):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True, env=os.environ)
            times[name].append((time.perf_counter() - begin) * 1e3)
    for name, values in times.items():
        values.sort()
        print(f"cold start, {name:17} median {values[len(values) // 2]:6.1f} ms  minimum {values[0]:6.1f} ms")


if __name__ == "__main__":
    measure(int(sys.argv[1]) if len(sys.argv) > 1 else 50_000)
    cold_start()
