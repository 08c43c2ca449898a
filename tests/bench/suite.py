"""usage: python tests/bench/suite.py [options]

Charts the benchmark set of netlists/: small multiples for each group, a summary picture and the README's table, beside scipy,
ngspice and, with --peers, the engines that build the same machines (peers/). A deck that has no converged reference is listed
and makes exit code 3."""

from __future__ import annotations

import json
import os
import sys
from functools import partial
from os.path import join

import draw_suite
import peers
import suite_table
from suite_table import GROUPS, QUICK, SUITE

from emsim.cli.arguments import HELP, JSON, QUIET, Arguments, Option, UsageError, parse
from emsim.cli.chart import OF_LADDER, Settings, Tell, deliver, measured, settings
from emsim.cli.console import CONVERGENCE, OK, print_json, print_lines
from emsim.cli.failures import report
from emsim.diagnostics import DeckError, Diagnostic, DiagnosticError, OutsideError, suggest
from emsim.outputs.beside import replacing
from emsim.reports.chart import csv_lines, failures
from emsim.reports.source_tree import root
from emsim.reports.work_precision import Chart

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from suite_table import Entry

OPTIONS = [
    Option("-o --output", "folder of the pictures, suite.csv, suite.json; chart without it", "FOLDER"),
    *OF_LADDER,
    Option("--only", "these entries, by name, deck or group", "A,B,..."),
    Option("--quick", "three entries, a short ladder"),
    Option("--peers", "MuJoCo, Exudyn and Drake on the machines that they build too"),
    Option("--readme", "write the table and its picture into README.md"),
    Option("--from", "nothing is run, charts come from a suite.json", "FILE"),
    JSON,
    QUIET,
    HELP,
]
ENGINE_TIMES = 20  # common times of machines that other engines run too: their steps must hit them
SHORT = (1e-3, 1e-5, 1e-7)  # ladder of --quick


def main(args: Sequence[str]) -> int:
    """The exit code; what goes wrong is told as emsim tells it."""
    if "-h" in args or "--help" in args:
        print(__doc__, "", *(f"  {', '.join(o.names):<16} {o.value:<10} {o.help}" for o in OPTIONS), sep="\n")
        return OK
    try:
        return run_suite(parse(args, OPTIONS))
    except Exception as error:
        return report(error, args)


def run_suite(given: Arguments) -> int:
    """Measures, draws, writes; the exit code."""
    if given.words:
        raise UsageError(f"the suite takes no deck, got {given.words[0]}")
    entries = _chosen(given)
    folder = given.text("output") or "chart"
    tell = Tell(given.has("quiet"))
    trouble: list[Diagnostic] = []
    if path := given.text("from"):
        charts = _read(path)
    else:
        try:
            charts = _measured(entries, given, tell, trouble)
        finally:
            tell.clear()
    files = _written(charts, folder, given)
    code = CONVERGENCE if trouble else OK
    if given.has("json"):
        print_json(code, trouble, charts=[chart.as_dict() for chart in charts], files=files)
    elif given.text("csv") != "-":
        print_lines(_lines(charts))
        for d in trouble:
            print(f"not charted: {d.message}", file=sys.stderr)
        if not given.has("quiet"):
            print("-> " + ", ".join(files), file=sys.stderr)
    return code


def _lines(charts: Sequence[Chart]) -> list[str]:
    groups = [group for group in suite_table.GROUPS if any(chart.group == group for chart in charts)]
    out = list(suite_table.table(charts, groups))
    out += ["", *lines] if (lines := list(suite_table.engines(charts))) else []
    out += ["", "did not get through:"]
    for chart in charts:
        # scipy's are in the CSV file
        told = [found for found in failures(chart) if not found[0].startswith("scipy")]
        out += [f"  {chart.name}: {tool} {settings}: {why}" for tool, settings, why in told]
        out += [f"  {chart.name}: {note}" for note in chart.notes]
    slow = list(suite_table.slow_auto(charts))
    return [*out, "", "auto over 1.3 times the best:", *(f"  {line}" for line in slow)] if slow else out


def _measured(
    entries: Sequence[Entry], given: Arguments, tell: Tell, trouble: list[Diagnostic]
) -> list[Chart]:
    tree = root()
    charts = []
    for entry in entries:
        chosen = of_suite(given)
        chosen.signals, chosen.stop = list(entry.signals) or None, entry.stop
        if entry.engines:
            chosen.times, chosen.even = ENGINE_TIMES, True
            if given.has("peers"):
                chosen.others = partial(_peers, entry)
        if given.has("quick"):
            chosen.own |= dict(tolerances=SHORT, rounds=1)
            chosen.reference = 1.0
            chosen.scipy = dict(methods=("DOP853",), tolerances=(1e-6,), limit=0.3) if chosen.scipy else None
            chosen.ngspice = (
                dict(rounds=1, reltols=(1e-4,), parts=(1, 25), limit=1.0) if chosen.ngspice else None
            )
        deck = str(tree / "netlists" / (entry.deck + ".cir"))
        try:
            chart = measured(deck, entry.name, chosen, partial(_named, tell, entry.name))
        except DiagnosticError as error:
            if isinstance(error, (DeckError, OutsideError)):
                raise
            trouble.append(
                Diagnostic(
                    "error", error.diagnostics[0].code, f"{entry.name}: {error.diagnostics[0].message}"
                )
            )
            continue
        chart.group = entry.group
        charts.append(chart)
    return charts


def of_suite(given: Arguments) -> Settings:
    """A suite has less time for each deck than a deck alone."""
    out = settings(given)
    out.reference = 3.0
    out.own = dict(rounds=3, budget=3.0, most=0.8) | out.own
    if out.scipy is not None:
        out.scipy = dict(tolerances=(1e-3, 1e-6, 1e-9), limit=0.3)
    if out.ngspice is not None:
        out.ngspice = dict(limit=5.0)
    return out


def _peers(entry: Entry, problem: Any, judge: Any, tell: Any, turn: Any) -> tuple[list[Any], list[str]]:
    machine = entry.deck.rpartition("/")[2]
    return peers.measure(problem, judge, machine, entry.engines, said=tell, turn=turn)


def _named(tell: Tell, name: str, text: str) -> None:
    tell(f"{name}: {text}")


def _written(charts: Sequence[Chart], folder: str, given: Arguments) -> list[str]:
    """suite.json, suite.csv, the pictures; with --readme the README and its picture."""
    files = deliver(charts, given)
    os.makedirs(folder, exist_ok=True)
    path = join(folder, "suite.json")
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        json.dump([chart.as_dict() for chart in charts], file, indent=1)
    files.append(path)
    path = join(folder, "suite.csv")
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        file.write("\n".join(csv_lines(charts)) + "\n")
    files.append(path)
    for group, title in suite_table.GROUPS.items():
        members = [chart for chart in charts if chart.group == group]
        if members:
            path = join(folder, f"{group}.png")
            draw_suite.multiples(path, members, title)
            files.append(path)
    if charts:
        path = join(folder, "summary.png")
        draw_suite.summary(path, charts, suite_table.ERRORS)
        files.append(path)
    if given.has("readme"):
        readme = str(root() / "README.md")
        with open(readme, encoding="utf-8") as file:
            text = file.read()
        for section, (groups, picture) in suite_table.SECTIONS.items():
            members = [chart for chart in charts if chart.group in groups]
            if not members and charts:
                continue
            try:
                text = suite_table.into(
                    text, suite_table.section(members, picture if members else "", groups), section
                )
            except ValueError as error:
                raise UsageError(f"{readme}: {error}") from None
            if members:
                path = str(root() / picture)
                if section in suite_table.PANELS:
                    draw_suite.multiples(path, members, suite_table.GROUPS[section], dpi=70)
                else:
                    draw_suite.summary(path, members, suite_table.ERRORS, dpi=80)
                files.append(path)
        with replacing(readme) as beside, open(beside, "w", encoding="utf-8") as file:
            file.write(text)
        files.append(readme)
    return files


def _read(path: str) -> list[Chart]:
    with open(path, encoding="utf-8") as file:
        try:
            return [Chart.from_dict(data) for data in json.load(file)]
        except (ValueError, KeyError, TypeError):
            raise UsageError(f"{path} is no suite.json that suite.py wrote") from None


def _chosen(given: Arguments) -> list[Entry]:
    """Entries by --only and --quick."""
    only = [word.strip() for word in (given.text("only") or "").split(",") if word.strip()]
    of_group = {group: [e.name for e in SUITE if e.group == group] for group in GROUPS}
    only = [name for word in only for name in of_group.get(word, [word])]
    # names may hold a comma themselves
    names = (
        {e.name: e for e in SUITE}
        | {e.deck: e for e in SUITE}
        | {e.deck.rpartition("/")[2]: e for e in SUITE}
    )
    if given.has("only") and given.text("only") in names:
        return [names[given.text("only") or ""]]
    for word in only:
        if word not in names:
            near = suggest(word, names)
            raise UsageError(
                f"--only: the suite has no {word!r}" + (f", did you mean {near!r}?" if near else "")
            )
    chosen = [names[word] for word in only] or list(SUITE)
    return [e for e in chosen if e.name in QUICK] if given.has("quick") and not only else chosen


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
