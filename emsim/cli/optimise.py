"""usage: emsim optimise [options] deck.cir -p NAME=low..high ... --goal GOAL ...

Finds values of parameters, elements, models and machine cards with which measures of the deck (.meas) are what they are to be.

  emsim optimise filter.cir -p r=100..10k -p c=1n..1u --goal 'rise=1m' --goal 'over<1.05'
  emsim optimise gear.cir -p ratio=1..20 --goal 'imax<3' --minimise tend"""

from __future__ import annotations

from ..diagnostics import Diagnostic
from .arguments import Option, UsageError, parse
from .console import OK, print_json, print_lines, show, stdin_text
from .searching import SHARED, VARY, Heard, asked, shared, unsure

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..fits.optimised import Optimised

OPTIONS = [
    VARY,
    Option("--goal", "what a measure is to be, as in 'vmax<1.2' or 'rise=1m'", "GOAL", repeat=True),
    Option("--minimise", "the measure that is to be as small as it can be", "MEASURE"),
    Option("--maximise", "... as large", "MEASURE"),
    *SHARED,
]


def main(args: Sequence[str]) -> int:
    from ..fits import optimise

    given = parse(args, OPTIONS)
    if len(given.words) != 1:
        raise UsageError("emsim optimise takes one deck")
    deck = given.words[0]
    vary = {q.name: q for q in asked(given)}
    heard = Heard(given.has("quiet") or given.has("json"))
    try:
        found = optimise(
            stdin_text() if deck == "-" else deck, vary, given.all("goal"), given.text("minimise"), given.text("maximise"),
            progress=heard, **shared(given),
        )  # fmt: skip
    except ValueError as error:
        raise UsageError(str(error)) from None
    finally:
        heard.end()
    said = list(remarks(found))
    show(said, given.has("quiet"))
    if given.has("json"):
        print_json(
            OK, said, values=found.values, measures=found.measures, missed=[str(goal) for goal in found.missed], runs=found.runs,
            converged=found.converged, at_bounds=found.at_bounds,
        )  # fmt: skip
    else:
        print_lines(summary(found))
    return OK


def remarks(found: Optimised) -> Iterator[Diagnostic]:
    if found.missed:
        missed = ", ".join(f"{goal}, it is {found.measures[goal.measure]:.6g}" for goal in found.missed)
        yield Diagnostic(
            "warning", "W434", f"not met: {missed}", None, "wider bounds, other start values, or --everywhere"
        )
    if found.by_runs is not None:
        said = f"derivatives are differences of runs: {found.by_runs}"
        yield Diagnostic("note", "N443", said, None, "measure what is in front of it")
    yield from unsure(found, bool(found.missed))


def summary(found: Optimised) -> Iterator[str]:
    yield f"{found.runs} runs"
    width = max(map(len, [*found.values, *found.measures]))
    for name, value in found.values.items():
        yield f"  {name:<{width}}  {value:.7g}"
    yield "measures:"
    for name, value in found.measures.items():
        goals = ", ".join(str(goal) for goal in found.goals if goal.measure == name)
        yield f"  {name:<{width}}  {value:.6g}" + (f"   ({goals})" if goals else "")
