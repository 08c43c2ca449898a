"""Expressions of a table's columns as words: which are there, which units they have. Their numbers are in signals.py."""

from __future__ import annotations

from .assemble.outputs import WORDS, unit_of, unit_of_two
from .expr import MEASURED, Binary, Call, Cond, Name, Num, Unary, to_text
from .functions import KNOWN, SAME
from .units import product, quotient

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from typing import Protocol

    import numpy as np

    from .expr import Node

    class Columns(Protocol):
        """What is asked of a table."""

        def __len__(self) -> int: ...
        def column(self, name: str) -> np.ndarray: ...
        def column_unit(self, name: str) -> str: ...
        def has_column(self, name: str) -> bool: ...
        @property
        def axis_unit(self) -> str: ...
        def axis_values(self) -> np.ndarray: ...  # row numbers where there is no axis
        def blocks(self) -> list[tuple[int, int]]: ...  # rows of each course


def _same(unit: str, axis: str) -> str:
    return unit


# functions of a whole course (signals.WHOLE): how the unit follows from that of the course and of its axis
UNIT_OF_WHOLE: dict[str, Callable[[str, str], str]] = {
    **dict.fromkeys(("cph", "cphase"), lambda unit, axis: "rad"),
    **dict.fromkeys(("avg", "mean", "rms", "pp", "maximum", "minimum"), _same),
    "integ": product,
    **dict.fromkeys(("ddt", "deriv"), quotient),
}
SAME_UNIT = tuple(name for name, f in KNOWN.items() if f.unit == SAME)


def in_words(table: Columns, node: Node) -> Node | None:
    """SPICE's vdb(a,b), vp(a), im(v1) ... in the words of this table: db(v(a,b)), ph(v(a)), mag(i(v1)). None for others."""
    if not isinstance(node, Call) or node.fn[:1] not in ("v", "i") or table.has_column(to_text(node)):
        return None
    word = WORDS.get(node.fn[1:])
    quantity = Call(node.fn[:1], node.args, node.at)
    return Call(word, [quantity], node.at) if word and table.has_column(to_text(quantity)) else None


def check(table: Columns, node: Node) -> bool:
    """Is every name of an expression a column, and every function known?"""
    if isinstance(node, Num) or (isinstance(node, Name) and node.id == "pi"):
        return True
    if isinstance(node, (Name, Call)) and table.has_column(to_text(node)):
        return True
    if in_words(table, node) is not None or (isinstance(node, Call) and node.fn == MEASURED):
        return True
    if isinstance(node, Call):
        known = node.fn in KNOWN or node.fn in UNIT_OF_WHOLE
        return known and all(check(table, a) for a in node.args)
    parts = [getattr(node, key, None) for key in ("a", "b", "c")]
    return not isinstance(node, Name) and all(check(table, part) for part in parts if part is not None)


def unit_of_values(node: Node, units: Mapping[str, str]) -> str:
    """The unit of an expression of other measurements, whose units are known."""
    if isinstance(node, Call) and node.fn == MEASURED:
        return units.get(to_text(node.args[0]), "")
    if isinstance(node, Binary):
        return unit_of_two(node, unit_of_values(node.a, units), unit_of_values(node.b, units))
    if isinstance(node, (Unary, Cond)):
        return unit_of_values(node.a, units)
    if isinstance(node, Call) and node.fn in SAME_UNIT and node.args:
        return unit_of_values(node.args[0], units)
    return unit_of(node)
