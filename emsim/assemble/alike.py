"""Pairs of parts that are alike but for their unknowns, balls among balls: what is read of them is computed by one program.

Of each pair the expressions are written down as of a single one. Where another pair has the same form (engine/expr/src/alike.rs),
gaps, speeds, edges and powers become calls of it, derivatives too: what is differentiated and compiled grows with kinds of pairs.
"""

from __future__ import annotations

from ..cards.laws import Edge

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from ..cards.base import Card
    from ..cards.laws import Law
    from .mechanism import Mechanism


def share(m: Mechanism, laws: Sequence[Law]) -> None:
    """Rates of gaps; laws of like pairs read calls of one program from now on."""
    zero = m.b.const(0.0)
    corners = [law for law in laws if law.gap is not None]
    for law, rate in zip(corners, m.rates([zero + law.gap for law in corners]), strict=True):  # type: ignore[operator]
        law.flow = rate
    pairs: dict[int, list[Law]] = {}
    for law in laws:
        pair = law.pair if law.normal is None else law.normal[0].pair
        if pair is not None:
            pairs.setdefault(id(pair), []).append(law)
    read = []
    for group in pairs.values():
        values = [zero + v for law in group for v in (law.flow, law.gap) if v is not None]
        edges = [v for law in group if law.edge for v in (law.edge.which, law.edge.past)]
        read.append([*values, *edges, *powers(m, group)])
    for group, like in zip(pairs.values(), m.b.outlined(read), strict=True):
        if like is None:
            continue
        *values, rates, positions = like
        for law in group:
            law.flow, law.powers = values.pop(0), (zero, zero)
            if law.gap is not None:
                law.gap = values.pop(0)
        for law in group:
            if law.edge:
                law.edge = Edge(law.edge.held, values.pop(0), values.pop(0))
        group[0].powers = rates, positions


def powers(m: Mechanism, laws: Sequence[Law]) -> tuple[Expr, Expr]:
    """f w of laws, and mu g of corners, efforts and mu to be held while they are differentiated."""
    rates = positions = m.b.const(0.0)
    for law in laws:
        assert law.flow is not None
        if law.powers is not None:
            rates, positions = rates + law.powers[0], positions + law.powers[1]
            continue
        rates = rates + law.effort * law.flow
        if law.gap is not None:
            positions = positions + m.b.x(law.second) * law.gap
    return rates, positions


def separations(m: Mechanism, card: Card) -> list[Expr]:
    """How far pairs of its polygons or solids are apart."""
    own: list[Expr] = getattr(card, "separations", lambda _: [])(m)
    return [like[0] if like else e for e, like in zip(own, m.b.outlined([[e] for e in own]), strict=True)]
