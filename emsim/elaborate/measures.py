"""`.meas`: what names in it mean. Parameters become numbers, names of other measurements are marked, all else is a signal."""

from __future__ import annotations

from ..deck import Clause, Measure
from ..expr import MEASURED, Call, Name, Node, Scope, fold

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable

    from .bind import Level

COUNTED = ("rise", "fall", "cross")


class OfResults(Scope):
    """Names in an expression of results: what is no parameter is a measurement, or else a node or a column."""

    def __init__(self, level: Level, measures: Container[str] = ()) -> None:
        super().__init__(level.scope.values)
        self.level, self.measures = level, measures

    def lookup(self, name: str) -> float | None:
        return self.level.scope.lookup(name)

    def function(self, name: str) -> tuple[list[str], Node] | None:
        return self.level.scope.function(name)

    def names(self) -> Iterable[str]:
        return self.level.scope.names()

    def reads(self, function: str) -> bool:
        return self.level.scope.reads(function)

    def probe(self, call: Call) -> Node:
        return self.level.scope.probe(call)

    def unknown(self, node: Name) -> Node | None:
        if node.id in self.measures:
            return Call(MEASURED, [node], node.at)
        return Name(self.level.node(node.id, node.span), node.at)


def bind_measure(card: Measure, level: Level, names: Container[str]) -> Measure:
    """The card with parameters put in. Raises ExprError."""
    scope = OfResults(level, names)
    return changed(card, lambda node: fold(node, scope))


def changed(card: Measure, change: Callable[[Node], Node]) -> Measure:
    """The card with all its expressions changed."""
    clauses = []
    for clause in card.clauses:
        body, other = (None if part is None else change(part) for part in (clause.body, clause.level))
        whole = Clause(clause.word, body, other, clause.span)
        for key, node in clause.values.items():
            last = key in COUNTED and isinstance(node, Name) and node.id == "last"
            whole.values[key] = node if last else change(node)
        clauses.append(whole)
    return Measure(card.analysis, card.name, clauses, card.span)
