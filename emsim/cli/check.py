"""usage: emsim check [options] deck.cir

Reads a deck, builds its equations and says what they are made of, without running it: unknowns, degrees of
freedom, loops, what folded away, tolerances; with a machine what its equations cost in the coordinates of joints
(the default but for long chains) and in those of every body (.options formulation=absolute). Exit code 1 when the deck
is wrong."""

from __future__ import annotations

import sys

from .. import pipeline
from .arguments import DEFINE, HELP, JSON, QUIET, Option, defines, overrides, parse
from .console import DECK, OK, print_json, print_lines, show
from .run import METHOD_OPTIONS, source_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

OPTIONS: list[Option] = [*METHOD_OPTIONS, DEFINE, JSON, QUIET, HELP]
ROLES = {"cut": "closes a loop", "rows": "constraint rows"}


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    source = source_of(given.deck("check"))
    facts = pipeline.check(source, defines=defines(given), options=overrides(given))
    diagnostics = facts.pop("diagnostics")
    show(diagnostics, given.has("quiet"))
    code = DECK if any(d.severity == "error" for d in diagnostics) else OK
    if given.has("json"):
        print_json(code, diagnostics, facts=facts)
    else:
        sys.stderr.flush()
        print_lines(lines(facts))
    return code


def lines(facts: dict[str, Any]) -> Iterator[str]:
    """The facts of pipeline.check as text."""
    yield facts["title"]
    for label, text in _rows(facts):
        yield f"  {label:<14}{text}"


def _rows(facts: dict[str, Any]) -> Iterator[tuple[str, str]]:
    yield "elements", _counts(facts["elements"]) or "none"
    if facts["cards"]:
        yield "machine", _counts(facts["cards"])
    yield "unknowns", f"{facts['size']}: {_counts(facts['unknowns'])}"
    linear = ", linear with constant matrices" if facts["linear"] else ""
    yield "equations", f"{facts['algebraic']} algebraic, {facts['nonzeros']} nonzeros{linear}"
    operations = facts["operations"]
    if operations["values"]:
        yield (
            "operations",
            f"{operations['values']} for values, {operations['with_derivatives']} with derivatives",
        )
    if facts["events"]:
        yield "events", f"{facts['events']} conditions watched"
    if facts["machine"]:
        yield from _machine(facts["machine"])
        yield from _formulations(facts["formulations"])
    if facts["two_paces"] and facts["method"] != "multirate":
        yield "two paces", "a large machine behind many edges: .options method=multirate may be far faster"
    yield "analyses", "; ".join(facts["analyses"]) or "none"
    yield "tolerances", f"method {facts['method']}, relative {facts['reltol']:g}; absolute:"
    for row in facts["tolerances"]:
        value = f"{row['value']:.3g} {row['unit']}"
        yield "", f"{row['quantity']:<18}{value:<16}{row['option']:<11}{row['source']}"


def _machine(machine: dict[str, Any]) -> Iterator[tuple[str, str]]:
    freedom = machine["degrees_of_freedom"]
    scene = "planar" if machine["planar"] else "spatial"
    yield "freedom", f"{freedom} {'degree' if freedom == 1 else 'degrees'} of freedom, {scene}"
    for joint in machine["joints"]:
        what = ", ".join(f"{c['name']} [{c['unit']}]" for c in joint["coordinates"])
        closes = ROLES.get(joint["role"]) or what or "no coordinate"
        yield "joint", f"{joint['name']}: {joint['kind']} {joint['a']} - {joint['b']}, {closes}"
    label = "free body" if machine["formulation"] == "joint" else "body"
    for body in machine["free_bodies"]:
        yield label, f"{body['name']}: {', '.join(c['name'] for c in body['coordinates'])}"
    for loop in machine["loops"]:
        yield "loop", " - ".join(loop)
    if machine["constraint_rows"]:
        yield "constraints", f"{len(machine['constraint_rows'])} rows"
    if machine["redundant_rows"]:
        yield "redundant", ", ".join(machine["redundant_rows"])
    if machine["folded_rows"]:
        yield "folded away", f"{machine['folded_rows']} constraint rows that nothing in the scene can break"
    if machine["singular_start"]:
        yield "start", "at a singular position"
    for name, before, after in machine["moved"]:
        yield "moved", f"{name} from {before:.6g} to {after:.6g} to close the loops"


def _formulations(found: dict[str, Any]) -> Iterator[tuple[str, str]]:
    for name, cost in found.items():
        if isinstance(cost, str):
            yield "formulation", f"{name}: {cost}"
            continue
        yield (
            "formulation",
            f"{name}: {cost['size']} unknowns, {cost['rows']} constraint rows, {cost['nonzeros']} nonzeros, "
            f"{cost['values']} operations, {cost['with_derivatives']} with derivatives",
        )


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{n} {name}" for name, n in counts.items())
