"""When do two paces pay? CPU time of multirate over the best single-rate method at equal accuracy: links x frequency.

    python tests/bench/multirate.py [--out FOLDER] [--links 1,2,...] [--fsw 1k,...] [--within 1e-4] [--stop 20m]

A chain of N rods hangs on the rotor of a motor that an H-bridge feeds at constant duty. Each method runs down a ladder
of tolerances until its error at the print grid, of current, speed, angle and the chain's end, is within what was asked
against radau at 1e-8; its cost is the engine's CPU time of that run, without the set-up (which doubles: the two parts are
compiled too), the least of three where it is short. Writes multirate.csv and multirate.png, prints the table.

What it shows: from five links on at 30 kHz, ten at 10 kHz, twenty at 3 kHz two paces pay, and the more the larger both
are: 2.5 times at ten links, 8 times at twenty, 24 times at fifty, all at 100 kHz. Below they cost up to three times as
much: the circuit is solved by itself, and the machine, once more, by Radau IIA even where an explicit method is cheaper.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from emsim import pipeline
from emsim.diagnostics import DiagnosticError
from emsim.table import Table
from emsim.units import spice_number

SINGLE = ("radau", "esdirk", "trbdf2", "dop853")
LADDER = (1e-3, 1e-4, 1e-5, 1e-6)
REFERENCE = ("radau", 1e-8)
PRINTED = 50
SHORT = 0.3  # seconds; a shorter run is repeated


def deck(links: int, fsw: float, stop: float) -> str:
    """The gate is late by 0.45 of a period, so that no printed time is that of an edge."""
    length = 1.0 / links
    cards = [
        "chain on a converter",
        ".gravity 9.81",
        f".param fsw={fsw} tr={0.01 / fsw}",
        "Vbat vb 0 24",
        "Vg g 0 PULSE(0 5 {0.45/fsw-tr/2} {tr} {tr} {0.7/fsw-tr} {1/fsw})",
        "S1 vb a g 0 high",
        "S4 b 0 g 0 high",
        "S2 a 0 0 g low",
        "S3 vb b 0 g low",
        ".model high SW(vt=2.5 ron=20m roff=1g)",
        ".model low SW(vt=-2.5 ron=20m roff=1g)",
        "MOTOR m1 a b p1 kt=0.5 r=1 l=1m j=1m",
    ]
    before = "0"
    for k in range(1, links + 1):
        cards.append(f"BODY b{k} shape=rod({length}) m={1.0 / links}")
        cards.append(f"JOINT p{k} {before} b{k} pin damp=2m")
        before = f"b{k}({length},0)"
    printed = f".print tran i(m1) omega(p1) angle(p1) x({before}) y({before})"
    return "\n".join([*cards, printed, f".tran {stop / PRINTED} {stop} UIC", ".end", ""])


def run(text: str, method: str, reltol: float) -> Table:
    return pipeline.run(text, method=method, reltol=reltol, energy=False).plots[0]


def error(found: Table, truth: Table, stop: float) -> float:
    """Largest difference over the largest value, at the printed times."""
    at = np.arange(1, PRINTED) * stop / PRINTED
    tip = [n for n in truth.names if n[:2] in ("x(", "y(")]
    return max(
        float(np.abs(found.at(n, at) - truth.at(n, at)).max() / np.abs(truth.at(n, at)).max())
        for n in ("i(m1)", "omega(p1)", "angle(p1)", *tip)
    )


def cost(text: str, method: str, truth: Table, stop: float, within: float) -> tuple[float, float, float]:
    """CPU seconds, error and tolerance of the cheapest run that is near enough; infinite seconds where none is."""
    for reltol in LADDER:
        try:
            found = run(text, method, reltol)
        except DiagnosticError:
            continue
        off = error(found, truth, stop)
        if off <= within:
            seconds = float(found.stats["seconds"])
            if seconds < SHORT:
                seconds = min(seconds, *(float(run(text, method, reltol).stats["seconds"]) for _ in range(2)))
            return seconds, off, reltol
    return float("inf"), float("nan"), float("nan")


def cell(links: int, fsw: float, stop: float, within: float) -> dict[str, Any]:
    text = deck(links, fsw, stop)
    truth = run(text, *REFERENCE)
    row: dict[str, Any] = {"links": links, "fsw": fsw}
    for method in ("multirate", *SINGLE):
        row[method], row[f"error {method}"], row[f"reltol {method}"] = cost(text, method, truth, stop, within)
    best = min(SINGLE, key=lambda m: row[m])
    row["best"] = best
    row["ratio"] = row["multirate"] / row[best]
    return row


def draw(rows: Sequence[dict[str, Any]], path: Path, within: float) -> None:
    """The map of ratios, and the times at the highest frequency."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.colors import LogNorm

    links = sorted({r["links"] for r in rows})
    rates = sorted({r["fsw"] for r in rows})
    ratio = np.full((len(links), len(rates)), np.nan)
    for r in rows:
        ratio[links.index(r["links"]), rates.index(r["fsw"])] = r["ratio"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
    left.imshow(ratio, origin="lower", aspect="auto", cmap="RdBu_r", norm=LogNorm(0.05, 20))
    for i, j in np.ndindex(ratio.shape):
        value = ratio[i, j]
        left.text(
            j, i, f"{value:.2g}", ha="center", va="center", color="w" if abs(np.log(value)) > 1.6 else "k"
        )
    left.set_xticks(range(len(rates)), [f"{f / 1e3:g}" for f in rates])
    left.set_yticks(range(len(links)), [str(n) for n in links])
    left.set(xlabel="switching frequency [kHz]", ylabel="links")
    left.set_title(f"CPU time, multirate / best single rate, error within {within:g}", fontsize=10)
    for method in ("multirate", *SINGLE):
        chosen = sorted((r for r in rows if r["fsw"] == rates[-1]), key=lambda r: r["links"])
        x, y = [r["links"] for r in chosen], [1e3 * r[method] for r in chosen]
        right.loglog(x, y, "o-", lw=2.4 if method == "multirate" else 1.2, label=method)
    right.set_xticks(links, [str(n) for n in links], minor=False)
    right.minorticks_off()
    right.set(xlabel="links", ylabel="CPU time [ms]")
    right.set_title(f"at {rates[-1] / 1e3:g} kHz", fontsize=10)
    right.grid(True, which="both", alpha=0.3)
    right.legend(fontsize=8)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main(arguments: Sequence[str] | None = None) -> list[dict[str, Any]]:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("."))
    parser.add_argument("--links", default="1,2,5,10,20,50,100")
    parser.add_argument("--fsw", default="1k,3k,10k,30k,100k")
    parser.add_argument("--stop", default="20m")
    parser.add_argument("--within", type=float, default=1e-4)
    args = parser.parse_args(arguments)
    stop = spice_number(args.stop)
    rows = []
    args.out.mkdir(parents=True, exist_ok=True)
    print(f"{'links':>5}{'kHz':>6}{'multirate ms':>14}{'best ms':>10} {'by':<8}{'ratio':>7}{'errors':>18}")
    for links in (int(n) for n in args.links.split(",")):
        for fsw in (spice_number(f) for f in args.fsw.split(",")):
            row = cell(links, fsw, stop, args.within)
            rows.append(row)
            best = row["best"]
            errors = f"{row['error multirate']:.0e} / {row[f'error {best}']:.0e}"
            times = f"{1e3 * row['multirate']:>14.1f}{1e3 * row[best]:>10.1f}"
            print(f"{links:>5}{fsw / 1e3:>6g}{times} {best:<8}{row['ratio']:>7.2f}{errors:>18}", flush=True)
    with (args.out / "multirate.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    draw(rows, args.out / "multirate.png", args.within)
    return rows


if __name__ == "__main__":
    main(sys.argv[1:])
