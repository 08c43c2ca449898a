"""Transients that are halted and go on: stop, status, delete, step, resume.

A halted run leaves its state behind (analyses/tran.py). What goes on is the deck as it stands by then, with voltages of
capacitors, currents of coils and the machine as they were; where an altered part stores otherwise, its charge stays.
"""

from __future__ import annotations

import re
from copy import copy

from ..analyses.tran import Leg
from ..build import parse_expression
from ..expr import Binary, Call, Name, Node, Num
from ..units import spice_number
from .base import Command
from .errors import CommandError, usage

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import Analysis
    from .plots import Plot
    from .program import Statement
    from .session import Session

STOP = "stop when time = 1m, stop when v(out) > 0.5 [when ..]"
SIGNS = {"eq": "=", "gt": ">", "lt": "<", "ge": ">=", "le": "<=", "ne": "<>"}
SIDES = re.compile(r"(.+?)\s*(<>|>=|<=|=|>|<|\b(?:eq|gt|lt|ge|le|ne)\b)\s*(.+)$", re.IGNORECASE)


class Breakpoint:
    """A condition at which transients are halted. `at`: where it is a time alone [s]; else `tree`, which is positive where it
    holds, or passes 0 where it is an equality (`both`)."""

    def __init__(
        self, number: int, shown: str, at: float | None = None, tree: Node | None = None, both: bool = False
    ) -> None:
        self.number, self.shown, self.at, self.tree, self.both = number, shown, at, tree, both


class Halted:
    """A transient on its way: its card with the part of it that ran last, and its plot."""

    def __init__(self, card: Analysis, plot: Plot) -> None:
        self.card, self.plot = card, plot


def _side(text: str) -> tuple[Node, str]:
    """One side of a relation: a number, `time`, a node, or what expressions read of a circuit and its machine."""
    text = text.strip().lower()
    number = spice_number(text)
    if number is not None:
        return Num(number), f"{number:g}"
    if text.startswith("@") or "#" in text:
        raise CommandError(
            "E161", f"`stop` does not read `{text}`", "it reads time, nodes, v(..), i(..), angle(..)"
        )
    tree = parse_expression(text)
    if isinstance(tree, Name) and tree.id != "time":
        tree = Call("v", [tree], tree.at)
    return tree, text


def _relation(text: str) -> tuple[Node, bool, float | None, str]:
    """(what is positive where it holds, is it an equality?, the time that it means alone, as it is shown)."""
    found = SIDES.match(text.strip())
    if found is None:
        usage(STOP, f"`{text.strip()}` is no relation")
    sign = SIGNS.get(found[2].lower(), found[2])
    if sign == "<>":
        raise CommandError("E161", "`<>` holds nearly always", "write >, < or =")
    (left, said), (right, of) = _side(found[1]), _side(found[3])
    shown = f"{said} {sign} {of}"
    if sign in ("<", "<="):
        left, right = right, left
    at = right.value if isinstance(left, Name) and left.id == "time" and isinstance(right, Num) else None
    return Binary("-", left, right), sign == "=", at, shown


def stop(s: Session, text: str, at: Statement) -> None:
    words = re.split(r"\b(when|after)\b", text, flags=re.IGNORECASE)
    if words[0].strip() or len(words) < 3:
        usage(STOP, "a condition is needed")
    if any(w.lower() == "after" for w in words[1::2]):
        raise CommandError(
            "E163", "`stop after` counts points, and the method chooses these", "write stop when time = 1m"
        )
    relations = [_relation(w) for w in words[2::2]]
    shown = " ".join(f"when {r[3]}" for r in relations)
    number = max((b.number for b in s.breakpoints), default=0) + 1
    if len(relations) == 1 and (time := relations[0][2]) is not None:
        s.breakpoints.append(Breakpoint(number, shown, at=time))
        return
    tree = relations[0][0]
    for other in relations[1:]:
        tree = Call("min", [tree, other[0]])
    both = len(relations) == 1 and relations[0][1]
    if len(relations) > 1 and any(r[1] for r in relations):
        raise CommandError("E161", "`=` beside another condition never holds in a step", "write > or <")
    s.breakpoints.append(Breakpoint(number, shown, tree=tree, both=both))


def status(s: Session, text: str, at: Statement) -> None:
    for b in s.breakpoints:
        s.say(f"{b.number:<4d} stop {b.shown}")


def delete(s: Session, text: str, at: Statement) -> None:
    words = text.lower().split()
    if "all" in words:
        s.breakpoints.clear()
    numbers = [w for w in words if w != "all"]
    if any(not w.isdecimal() for w in numbers):
        usage("delete number .. or delete all", "breakpoints have numbers")
    gone = {int(w) for w in numbers}
    s.breakpoints[:] = [b for b in s.breakpoints if b.number not in gone]


def leg(s: Session, before: Leg | None = None, until: float | None = None) -> Leg | None:
    """The part of a transient that runs next; None where nothing halts it."""
    begin = None if before is None else before.left
    now = -1.0 if begin is None else begin.t
    times = [b.at for b in s.breakpoints if b.at is not None and b.at > max(now, 0.0)]
    times += [] if until is None else [until]
    halts = [(f"stop {b.number}", b.tree, b.both) for b in s.breakpoints if b.tree is not None]
    if not (times or halts or begin):
        return None
    return Leg(begin, min(times, default=None), halts)


def on_its_way(s: Session, card: Analysis, plot: Plot) -> None:
    """Is the transient that has just run halted?"""
    part: Leg | None = card.leg
    s.halted = None
    if part is None or part.left is None:
        return
    end = float(card.args[1])
    if part.left.t >= end * (1.0 - 1e-12):
        return
    s.halted = Halted(card, plot)
    s.note(f"{plot.name} stands at time = {part.left.t:g}", "resume goes on, delete takes breakpoints away")


def _go_on(s: Session, until: float | None = None) -> None:
    found = s.halted
    if found is None or found.plot not in s.plots.all:
        s.halted = None
        s.note("no transient is halted that could go on")
        return
    card = copy(found.card)
    card.leg = leg(s, found.card.leg, until)
    s.halted = None
    s.extend(card, found.plot)


def resume(s: Session, text: str, at: Statement) -> None:
    _go_on(s)


def step(s: Session, text: str, at: Statement) -> None:
    count = s.numbers(text, 1)[0] if text.strip() else 1.0
    if not count >= 1.0:
        usage("step [number]", "so many steps of the print grid")
    if s.halted is None:
        return _go_on(s)
    card = s.halted.card
    left = card.leg.left
    _go_on(s, left.t + count * float(card.args[0]))


COMMANDS = (
    Command("stop", STOP, "halts the transients that follow where the condition comes", stop, records=True),
    Command("status", "status", "the breakpoints", status, shows=True),
    Command("delete", "delete number .. | all", "takes breakpoints away", delete),
    Command("resume", "resume", "goes on with a halted transient, with the deck as it stands", resume),
    Command("step", "step [number]", "goes on by so many steps of the print grid", step),
)
