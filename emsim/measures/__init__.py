"""Measurements of results: `.meas` in ngspice's and LTspice's spellings. One kind a class, and the one list of what there is.

`check` says what is wrong with cards before the run, `measure` finds their values in a table: the pipeline calls them, and
whatever else has a table and cards (`build.parse_measure` reads one that stands alone).
"""

from __future__ import annotations

from . import window
from .base import Kind, Measured, NotFound
from .param import Param
from .trigger import Trigger
from .when import Deriv, Find, When

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from ..deck import Measure as Card
    from ..diagnostics import Diagnostic, Sink
    from ..expr import Node
    from ..table import Table
    from .fourier import Spectrum
    from .points import Points

__all__ = ["KINDS", "Kind", "Measured", "NotFound", "check", "find", "harmonics", "measure", "read_by"]

KINDS: tuple[type[Kind], ...] = (Trigger, When, Find, Deriv, *window.KINDS, Param)


def find(card: Card) -> Kind:
    """The measurement that a card asks for."""
    word = card.clauses[0].word
    return next(kind for kind in KINDS if word in kind.words)(card)


def check(cards: Iterable[Card], sink: Sink) -> None:
    """Errors of cards that cannot be: E330, E331."""
    for card in cards:
        find(card).read(sink)


def measure(
    cards: Sequence[Card], table: Table, given: Iterable[Measured] = (), fine: tuple[Table, int] | None = None
) -> list[Measured]:
    """The values of cards in a table, of every course where it has several (`Table.steps`), in order of courses and cards. A card
    may read those before it, and `given` from elsewhere. `fine`: a table with more points, at Chebyshev's of each step, and
    their number less one; or 0, where they lie anyhow. What finds nothing has the value nan and a diagnostic E430 in
    `trouble`."""
    from .. import columns
    from ..diagnostics import Diagnostic
    from .points import Points

    found: list[Measured] = []
    for step, rows in enumerate(table.blocks() or [(0, len(table))]):
        coarse = Points(table, rows)
        inside = _inside(fine, step, coarse)
        known = {m.name: m for m in given}
        first = len(found)
        for card in _in_order(cards):
            points = inside if all(columns.check(inside, node) for node in _nodes(card)) else coarse
            try:
                if rows[1] <= rows[0]:
                    raise NotFound("there are no results")
                one = find(card).find(points, known)
            except NotFound as error:
                said = f"`{card.name}` is not found: {error.said}"
                where = error.span or card.span
                one = Measured(
                    card.name, table.kind, trouble=Diagnostic("error", "E430", said, where, error.hint)
                )
            one.step = step
            if points.real_parts:
                one.remark = _real_part(points.real_parts.pop(0), card)
                points.real_parts.clear()
            known[card.name] = one
            found.append(one)
        places = {card.name: k for k, card in enumerate(cards)}
        found[first:] = sorted(found[first:], key=lambda m: places[m.name])
    return found


def _in_order(cards: Sequence[Card]) -> list[Card]:
    """Each card behind those of its own that it reads; those that read each other as they stand, and say so."""
    left, ordered = list(cards), []
    while left:
        names = {card.name for card in left}
        ready = [card for card in left if not read_by(card) & (names - {card.name})]
        ordered += ready or left
        left = [card for card in left if ready and card not in ready]
    return ordered


def read_by(card: Card) -> set[str]:
    """Names of the measurements that a card reads."""
    from ..expr import MEASURED, Call, Name, rewritten

    found: set[str] = set()

    def look(node: Node) -> Node | None:
        if isinstance(node, Call) and node.fn == MEASURED and isinstance(node.args[0], Name):
            found.add(node.args[0].id)
        return None

    for node in _nodes(card):
        rewritten(node, look)
    return found


def harmonics(
    cards: Sequence[Card], table: Table, fine: tuple[Table, int] | None = None
) -> tuple[list[Spectrum], list[Diagnostic]]:
    """The harmonics that .four asks for, of every course, and what could not be found (E430). Each card has a clause a signal."""
    if not cards:
        return [], []
    from .. import columns
    from ..diagnostics import Diagnostic
    from .fourier import spectrum
    from .points import Points

    found: list[Spectrum] = []
    trouble: list[Diagnostic] = []
    for step, rows in enumerate(table.blocks()):
        coarse = Points(table, rows)
        inside = _inside(fine, step, coarse)
        for card in cards:
            for c in card.clauses:
                assert c.body is not None
                points = inside if columns.check(inside, c.body) else coarse
                try:
                    frequency = points.number(c.values["freq"], "the frequency of .four", card.span)
                    if not frequency > 0:
                        raise NotFound(f"the frequency is {frequency:g} Hz, it must be positive")
                    curve, unit = points.curve(c.body, card.span)
                    one = spectrum(repr(c.body), unit, curve, frequency, points.last, points.first)
                    one.step = step
                    found.append(one)
                except NotFound as error:
                    said = f"no harmonics of `{c.body!r}`: {error.said}"
                    trouble.append(Diagnostic("error", "E430", said, error.span or card.span, error.hint))
    return found, trouble


def _inside(fine: tuple[Table, int] | None, step: int, coarse: Points) -> Points:
    """What is known between the points of a table, else the table itself."""
    from .points import Points

    if fine is None:
        return coarse
    table, degree = fine
    blocks = table.blocks()
    return Points(table, blocks[step] if step < len(blocks) else None, degree, coarse.first)


def _nodes(card: Card) -> Iterator[Node]:
    """All expressions of a card."""
    for c in card.clauses:
        for word, node in (("", c.body), ("", c.level), *c.values.items()):
            if node is not None and word not in ("rise", "fall", "cross"):
                yield node


def _real_part(node: Node, card: Card) -> Diagnostic:
    from ..diagnostics import Diagnostic

    said = f"`{card.name}` takes the real part of `{node!r}`, as ngspice does"
    hint = f"mag({node!r}), db({node!r}) or ph({node!r}); re({node!r}) where the real part is meant"
    return Diagnostic("note", "N331", said, node.span or card.span, hint)
