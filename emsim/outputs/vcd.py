"""Value change dumps (IEEE 1364): what the digital nodes of a run did, for wave viewers. Written by eprvcd of .control.

Times are whole picoseconds, or femtoseconds where a run is shorter than a nanosecond; a level is 0, 1, x where it is
undefined, z where nothing drives the node.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    Events = Iterable[tuple[float, str, str]]

SHORT = 1e-9  # s


def lines(events: Events, nodes: Sequence[str], head: str = "") -> Iterator[str]:
    """The lines of a file: events are (time [s], node, state such as 0s), in order; `nodes` those that are written."""
    kept = [event for event in events if event[1] in nodes]
    scale, unit = (1e15, "fs") if kept and kept[-1][0] < SHORT else (1e12, "ps")
    marks = {node: _mark(k) for k, node in enumerate(nodes)}
    if head:
        yield f"$comment {head} $end"
    yield f"$timescale 1 {unit} $end"
    for node, mark in marks.items():
        yield f"$var wire 1 {mark} {node} $end"
    yield "$enddefinitions $end"
    now, shown = -1, dict.fromkeys(nodes, "")
    for t, node, state in kept:
        value = "z" if state[1] == "z" else state[0].lower().replace("u", "x")
        if value == shown[node]:
            continue
        at = round(t * scale)
        if at != now:
            if now == 0:
                yield "$end"
            yield f"#{at}"
            if at == 0:
                yield "$dumpvars"
            now = at
        shown[node] = value
        yield value + marks[node]
    if now == 0:
        yield "$end"


def _mark(k: int) -> str:
    """A short name of printable characters."""
    first, count = 33, 94
    mark = chr(first + k % count)
    while k >= count:
        k = k // count - 1
        mark = chr(first + k % count) + mark
    return mark
