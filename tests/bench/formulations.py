"""What maximal coordinates cost: solve time, unknowns and operations of joint and of absolute coordinates.

    python tests/bench/formulations.py [--reltol X] [--method M]

CPU seconds of the engine, the least of three runs; errors are the largest difference between the two formulations on the
print grid, over the largest value. Chains of N links hang from one end and fall from the horizontal.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from support import NETLISTS, deck, with_options

import emsim
from emsim.diagnostics import DiagnosticError


def chain(links: int, tran: str = "10m 1") -> str:
    """A chain of uniform rods, hung at one end."""
    length = 1.0 / links
    cards = ["chain", ".gravity 9.81"]
    before = "0"
    for k in range(1, links + 1):
        cards += [f"BODY b{k} shape=rod({length}) m={length}", f"JOINT p{k} {before} b{k} pin damp=1u"]
        before = f"b{k}({length},0)"
    return "\n".join([*cards, f".print tran angle(p1) x({before}) y({before})", f".tran {tran}", ".end", ""])


def cases() -> dict[str, str]:
    found = {name: deck(f"mechanical/{name}") for name in ("ref_four_bar", "bricard")}
    found["ref_slider_crank"] = deck("coupled/ref_slider_crank")
    for path in sorted((NETLISTS / "mechanical").glob("ref_andrews*.cir")):
        found[path.stem] = path.read_text()
    found.update({f"chain of {n}": chain(n) for n in (2, 5, 10, 20, 50)})
    return found


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--reltol", type=float, default=1e-6)
    parser.add_argument("--method", default="radau")
    parser.add_argument("cases", nargs="*", help="words that the names of cases contain")
    args = parser.parse_args()
    print(f"{'case':<20}{'unknowns':>12}{'operations':>16}{'steps':>14}{'ms':>18}{'ratio':>7}{'apart':>9}")
    for name, text in cases().items():
        if args.cases and not any(word in name for word in args.cases):
            continue
        runs, costs = [], []
        try:
            for formulation in ("joint", "absolute"):
                options = f"reltol={args.reltol} method={args.method} formulation={formulation}"
                runs.append([emsim.run(with_options(text, options)) for _ in range(3)])
                costs.append(emsim.check(with_options(text, options)))
        except DiagnosticError as trouble:
            print(f"{name:<20}{str(trouble).splitlines()[0]}")
            continue
        a, b = (r[0] for r in runs)
        ms = [min(r.stats["seconds"] for r in rs) * 1e3 for rs in runs]
        step, _, stop = a.plots[0].grid
        times = np.arange(1, round(stop / step)) * step
        apart = max(
            np.abs(np.asarray(a.at(n, times)) - np.asarray(b.at(n, times))).max()
            / (np.abs(a[n]).max() or 1.0)
            for n in a.names[1:4]
        )

        def pair(values: list[object]) -> str:
            return " / ".join(f"{v}" for v in values)

        print(
            f"{name:<20}{pair([c['size'] for c in costs]):>12}"
            f"{pair([c['operations']['with_derivatives'] for c in costs]):>16}"
            f"{pair([r[0].stats['steps'] for r in runs]):>14}{pair([f'{v:.2f}' for v in ms]):>18}"
            f"{ms[1] / ms[0]:>7.1f}{apart:>9.0e}"
        )


if __name__ == "__main__":
    main()
