"""meas: a measurement of the current plot, as .meas has it; its value is a vector of that name."""

from __future__ import annotations

import numpy as np

from ..diagnostics import DeckError
from ..elaborate.measures import changed
from ..expr import Call, Name, Num, rewritten
from .base import Command
from .errors import CommandError, usage
from .functions import in_degrees
from .plots import Vector, table_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import Measure
    from ..expr import Node
    from .plots import Plot
    from .program import Statement
    from .session import Session

MEAS = "meas tran|ac|dc|sp name what .., as .meas has it"
# how ngspice lines up what it finds
WIDTH = 20


PHASES = ("ph", "cph", "phase", "vp", "ip")


def of_vectors(s: Session, node: Node) -> Node:
    """What a measurement reads: a name of a vector of one value is that number, as `let` makes them; all else is a column.
    Phases are in degrees where `set units=degrees` says so."""

    def known(part: Node) -> Node | None:
        if isinstance(part, Call) and part.fn in PHASES and in_degrees(s):
            return Call("deg", [part], part.at)
        found = s.plots.known(part.id) if isinstance(part, Name) else None
        if found is None or len(found) != 1 or len(s.plots.current.scale or ()) == 1:
            return None
        return Num(float(found.values[0].real), part.at)

    return rewritten(node, known)


def meas(s: Session, text: str, at: Statement) -> None:
    from ..build import parse_measure
    from ..measures import find

    if len(text.split()) < 3:
        usage(MEAS, "an analysis, a name and what is measured are needed")
    try:
        card = parse_measure(text)
        card.span = at.span
        before = s.sink.error_count
        find(card).read(s.sink)
        if s.sink.error_count > before:
            s.say(f"\n meas {text.strip()} failed!\n")
            return
        card = changed(card, lambda node: of_vectors(s, node))
    except DeckError as error:
        for d in error.diagnostics:
            d.span = at.span
        raise
    # of the runs of a .step each is measured
    family = s.plots.current.family
    for plot in [p for p in family if p in s.plots.all] or [s.plots.current]:
        if len(family) > 1:
            s.say(
                "At " + ", ".join(f"{step.column} = {value:g}" for step, value in plot.changes) + ": ", end=""
            )
        _measured(s, text, at, card, plot)


def _measured(s: Session, text: str, at: Statement, card: Measure, plot: Plot) -> None:
    from ..measures import measure

    table = None if plot.failed else table_of(plot)
    if table is None:
        raise (
            s.plots.missing(card.name)
            if plot.failed
            else CommandError("E164", f"{plot.name} has nothing to be measured")
        )
    (found,) = measure([card], table)[:1] or (None,)
    assert found is not None
    if found.trouble is not None:
        found.trouble.span = at.span
        s.say(f"\n meas {text.strip()} failed!\n")
        s.sink.add(found.trouble)
        return
    s.say(found.text())
    plot.add(Vector(card.name, np.array([found.value]), found.unit, plot))


COMMANDS = (
    Command("meas", MEAS, "measures the current plot; of the runs of a .step each", meas, records=True),
    Command("measure", MEAS.replace("meas ", "measure "), "the same", meas, records=True),
)
