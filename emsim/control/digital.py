"""What digital nodes did: eprint, edisplay, eprvcd."""

from __future__ import annotations

from ..diagnostics import did_you_mean
from ..outputs.vcd import lines
from . import words
from .base import Command
from .errors import CommandError, usage

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .program import Statement
    from .session import Session

    Events = list[tuple[float, str, str]]

EPRINT, EPRVCD = "eprint node .. [> file]", "eprvcd node .. [> file]"


def events(s: Session) -> Events:
    """Of the current plot. E162 where it has none."""
    table = s.plots.current.table
    found = table.digital if table is not None else []
    if not found:
        raise CommandError(
            "E162",
            f"the plot {s.plots.current.name} has no digital nodes",
            "those of a transient analysis are meant",
        )
    return found


def named(text: str, form: str, known: Events) -> list[str]:
    """Nodes by their names, or all of them."""
    there = list(dict.fromkeys(node for _, node, _ in known))
    wanted = [word.lower() for word in words.split(text)]
    if not wanted:
        usage(form, "nodes are needed")
    if wanted == ["all"]:
        return there
    for node in wanted:
        if node not in there:
            hint = did_you_mean(node, there, f"there are {', '.join(there[:8])}")
            raise CommandError("E162", f"no digital node is called `{node}`", hint)
    return list(dict.fromkeys(wanted))


def eprint(s: Session, text: str, at: Statement) -> None:
    known = events(s)
    nodes = named(text, EPRINT, known)
    for line in ("", "**** Results Data ****", "", "Time or Step", *nodes, "", ""):
        s.say(line)
    now = dict.fromkeys(nodes, "Uu")
    last: float | None = None
    rows: list[tuple[float, list[str]]] = []
    for t, node, state in known:
        if node in now:
            now[node] = state
            if t == last:
                rows.pop()
            rows.append((t, list(now.values())))
            last = t
    for t, states in rows:
        s.say(f"{t:.9e}" + "".join(f"    {state}" for state in states))
    s.say("")


def edisplay(s: Session, text: str, at: Statement) -> None:
    known = events(s)
    s.say(f"\nList of event nodes in plot {s.plots.current.name}")
    s.say("    node name           : type , number of events\n")
    for node in dict.fromkeys(node for _, node, _ in known):
        s.say(f"    {node:<20}: d    , {sum(event[1] == node for event in known):5d}")


def eprvcd(s: Session, text: str, at: Statement) -> None:
    known = events(s)
    for line in lines(known, named(text, EPRVCD, known), s.deck.title):
        s.say(line)


COMMANDS = (
    Command("eprint", EPRINT, "when digital nodes change, and to which states", eprint, shows=True),
    Command("edisplay", "edisplay", "the digital nodes of the current plot", edisplay, shows=True),
    Command("eprvcd", EPRVCD, "digital nodes as a value change dump, for wave viewers", eprvcd, shows=True),
)
