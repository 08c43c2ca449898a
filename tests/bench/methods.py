"""What a method spends on a deck, by its own counters: steps, Newton iterations, factorisations, CPU time, and its error.

    python tests/bench/methods.py [--reltol 1e-6] [--set smooth|switching] [--methods "gear,gear maxord=2,radau"] [decks ...]

A method is a name with further options behind it. The error is that of the worst column, in parts of its largest value,
against radau (esdirk where that stops) at a thousandth of the tolerance, at 161 rows of the print grid in the last four
fifths of the run: the 95th percentile of them, since what jumps is wrong by the jump for the time by which it comes late.
CPU seconds are those of the native analysis, the least of `--runs`.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import numpy as np

import emsim
from emsim.units import spice_number as value

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
SETS = {
    "smooth": [
        "bench/lc_oscillator", "bench/multiplier4", "bench/two_loop_rlc", "electrical/clipper", "electrical/diode_bridge",
        "electrical/ref_robertson", "hard/stiff_van_der_pol", "mechanical/spring_pendulum", "bench/slider_crank",
        "coupled/voice_coil", "coupled/ref_ctms_motor_position",
    ],
    "switching": [
        "electrical/buck_converter", "electrical/boost_converter", "bench/rc_pulses",
        "coupled/ref_pwm_hbridge_motor", "coupled/slider_crank_hbridge",
    ],
}  # fmt: skip
# shorter runs, TSTEP and TSTOP
SPANS = {"coupled/ref_pwm_hbridge_motor": "50u 10m UIC", "coupled/slider_crank_hbridge": "20u 50m"}
METHODS = {
    "smooth": ["gear maxord=2", "gear", "radau", "esdirk", "trap"],
    "switching": ["trbdf2", "esdirk", "radau", "trap", "gear maxord=2", "gear"],
}


def run(text: str, options: str) -> emsim.Result:
    return emsim.run(re.sub(r"(?im)^\.end\s*$", f".options {options}\n.end", text))


def plain(text: str) -> str:
    """The deck without its own method and tolerances."""
    words = r"(?im)^(\.options?\b.*?)\s(method|reltol|abstol|vntol|trtol|maxord)\s*=\s*\S+"
    while True:
        shorter = re.sub(words, r"\1", text)
        if shorter == text:
            return text
        text = shorter


def reference(text: str, reltol: float) -> emsim.Result:
    try:
        return run(text, f"method=radau reltol={reltol:g}")
    except emsim.ConvergenceError:
        return run(text, f"method=esdirk reltol={10 * reltol:g}")


def error(found: emsim.Result, exact: emsim.Result, times: np.ndarray) -> float:
    worst = 0.0
    for name in exact.names:
        if name == "time" or name not in found.names:
            continue
        want = np.array([exact.at(name, float(t)) for t in times])
        if not np.isrealobj(want) or not (size := float(np.abs(want).max())):
            continue
        got = np.array([found.at(name, float(t)) for t in times])
        apart = np.abs(got - want) / size
        worst = max(worst, float(np.quantile(apart, 0.95)))
    return worst


def measure(
    deck: str, methods: list[str], reltol: float, runs: int = 1
) -> list[tuple[str, dict[str, float] | str]]:
    text = plain((NETLISTS / f"{deck}.cir").read_text())
    if deck in SPANS:
        text = re.sub(r"(?im)^\.tran\b.*$", f".tran {SPANS[deck]}", text)
    exact = reference(text, 1e-3 * reltol)
    stop = exact.time[-1]
    # rows of the print grid, with no common measure with the edges
    step = value(re.search(r"(?im)^\.tran\s+(\S+)", text)[1])
    share = 0.6180339887498949 * np.arange(1, 162) % 1
    times = np.sort(step * np.floor(stop * (0.2 + 0.8 * share) / step))
    rows: list[tuple[str, dict[str, float] | str]] = []
    for method in methods:
        try:
            results = [run(text, f"method={method} reltol={reltol:g}") for _ in range(runs)]
        except emsim.ConvergenceError as trouble:
            rows.append((method, str(trouble).splitlines()[0]))
            continue
        stats = dict(results[0].stats)
        stats["solve_time"] = min(r.stats["solve_time"] for r in results)
        rows.append((method, stats | {"error": error(results[0], exact, times)}))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("decks", nargs="*")
    parser.add_argument("--set", choices=SETS, default="smooth")
    parser.add_argument("--methods", help="separated by commas")
    parser.add_argument("--reltol", type=float, default=1e-6)
    parser.add_argument("--runs", type=int, default=1)
    asked = parser.parse_args()
    methods = asked.methods.split(",") if asked.methods else METHODS[asked.set]
    heads = ("steps", "rejected", "events", "iterations", "factor.", "CPU ms", "error")
    print(f"{f'reltol {asked.reltol:g}':30}" + "".join(f"{head:>11}" for head in heads))
    for deck in asked.decks or SETS[asked.set]:
        print(deck)
        for method, found in measure(deck, methods, asked.reltol, asked.runs):
            if isinstance(found, str):
                print(f"  {method:28} {found}")
                continue
            counts = [found[k] for k in ("steps", "rejected", "events", "iterations", "factorisations")]
            cells = [*map(str, counts), f"{1e3 * found['solve_time']:.2f}", f"{found['error']:.1e}"]
            print(f"  {method:28}" + "".join(f"{cell:>11}" for cell in cells), flush=True)


if __name__ == "__main__":
    main()
