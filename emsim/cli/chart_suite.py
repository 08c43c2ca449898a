"""`emsim chart --suite`: the benchmark set, its pictures, its table, its place in the README."""

from __future__ import annotations

import os
import sys
from functools import partial
from os.path import join

from ..diagnostics import DeckError, Diagnostic, DiagnosticError, OutsideError
from ..outputs.beside import replacing
from ..reports.source_tree import root
from .arguments import Arguments, UsageError
from .chart import Tell, deliver, measured, settings
from .console import CONVERGENCE, OK, print_json, print_lines

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..reports.suite import Entry
    from ..reports.work_precision import Chart

ENGINE_TIMES = 20  # common times of machines that other engines run too: their steps must hit them
SHORT = (1e-3, 1e-5, 1e-7)  # ladder of --quick


def run_suite(given: Arguments) -> int:
    """Measures, draws, writes; the exit code."""
    if given.words:
        raise UsageError(f"--suite takes no deck, got {given.words[0]}")
    for option in ("signals", "define", "times"):
        if given.has(option):
            raise UsageError(f"--{option} goes with one deck, not with --suite")
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
    from ..reports import suite
    from ..reports.chart import failures

    groups = [group for group in suite.GROUPS if any(chart.group == group for chart in charts)]
    out = list(suite.table(charts, groups))
    out += ["", *lines] if (lines := list(suite.engines(charts))) else []
    out += ["", "did not get through:"]
    for chart in charts:
        # scipy's are in the CSV file
        told = [found for found in failures(chart) if not found[0].startswith("scipy")]
        out += [f"  {chart.name}: {tool} {settings}: {why}" for tool, settings, why in told]
        out += [f"  {chart.name}: {note}" for note in chart.notes]
    slow = list(suite.slow_auto(charts))
    return [*out, "", "auto over 1.3 times the best:", *(f"  {line}" for line in slow)] if slow else out


def _measured(
    entries: Sequence[Entry], given: Arguments, tell: Tell, trouble: list[Diagnostic]
) -> list[Chart]:
    tree = root()
    charts = []
    for entry in entries:
        chosen = settings(given)
        chosen.signals, chosen.stop = list(entry.signals) or None, entry.stop
        if entry.engines:
            chosen.times, chosen.even = ENGINE_TIMES, True
            chosen.engines = entry.engines if given.has("peers") else ()
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


def _named(tell: Tell, name: str, text: str) -> None:
    tell(f"{name}: {text}")


def _written(charts: Sequence[Chart], folder: str, given: Arguments) -> list[str]:
    """suite.json, suite.csv, the pictures; with --readme the README and its picture."""
    import json

    from ..reports import draw_suite, suite
    from ..reports.chart import csv_lines

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
    for group, title in suite.GROUPS.items():
        members = [chart for chart in charts if chart.group == group]
        if members:
            path = join(folder, f"{group}.png")
            draw_suite.multiples(path, members, title)
            files.append(path)
    if charts:
        path = join(folder, "summary.png")
        draw_suite.summary(path, charts, suite.ERRORS)
        files.append(path)
    if given.has("readme"):
        readme = str(root() / "README.md")
        with open(readme, encoding="utf-8") as file:
            text = file.read()
        for section, (groups, picture) in suite.SECTIONS.items():
            members = [chart for chart in charts if chart.group in groups]
            if not members and charts:
                continue
            try:
                text = suite.into(text, suite.section(members, picture if members else "", groups), section)
            except ValueError as error:
                raise OutsideError(Diagnostic("error", "E504", f"{readme}: {error}")) from None
            if members:
                path = str(root() / picture)
                if section in suite.PANELS:
                    draw_suite.multiples(path, members, suite.GROUPS[section], dpi=70)
                else:
                    draw_suite.summary(path, members, suite.ERRORS, dpi=80)
                files.append(path)
        with replacing(readme) as beside, open(beside, "w", encoding="utf-8") as file:
            file.write(text)
        files.append(readme)
    return files


def _read(path: str) -> list[Chart]:
    import json

    from ..reports.work_precision import Chart

    with open(path, encoding="utf-8") as file:
        try:
            return [Chart.from_dict(data) for data in json.load(file)]
        except (ValueError, KeyError, TypeError):
            raise OutsideError(
                Diagnostic("error", "E504", f"{path} is no suite.json that emsim chart --suite wrote")
            ) from None


def _chosen(given: Arguments) -> list[Entry]:
    """Entries by --only and --quick."""
    from ..diagnostics import suggest
    from ..reports.suite import GROUPS, QUICK, SUITE

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
