"""Expressions of a table's columns: what --plot, the page, `.print` and `Result[...]` understand beyond the columns.

    db(v(out)/v(in))     deg(angle(hinge))     v(a)*i(r1)

A name is a column; all else is arithmetic on whole columns, of complex numbers where these are. The functions are those of
functions.py. Where a value does not exist it is nan, where it has no bound inf: nothing is clipped. What such expressions are,
without numbers: columns.py.
"""

from __future__ import annotations

import math

import numpy as np

from .assemble.outputs import UNITS, unit_of_two
from .columns import SAME_UNIT, UNIT_OF_WHOLE, in_words
from .diagnostics import deck_error
from .expr import Binary, Call, Cond, Name, Num, Unary, to_text
from .functions import KNOWN

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .columns import Columns
    from .diagnostics import Span
    from .expr import Node


def _power(a: Any, b: Any) -> Any:
    return np.power(a if np.iscomplexobj(a) else np.abs(a), b)


FUNCTIONS: dict[str, Callable[..., Any]] = {
    name: column for name, f in KNOWN.items() if (column := f.of_columns(np)) is not None
}


def _pieces(x: np.ndarray) -> list[tuple[int, int]]:
    """Stretches between jumps, which have two rows at one place."""
    ends = np.flatnonzero(np.diff(x) == 0) + 1
    return list(zip([0, *ends], [*ends, len(x)], strict=True))


def _middles(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values half-way between rows, of the cubic through them (interpolate.py)."""
    from .interpolate import cubic_many

    if x[-1] < x[0]:
        return _middles(x[::-1], y[::-1])[::-1]
    at = 0.5 * (x[1:] + x[:-1])
    if np.iscomplexobj(y):
        return cubic_many(x, y.real, at) + 1j * cubic_many(x, y.imag, at)
    return cubic_many(x, y, at)


def _integral(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Along the axis, from its start: Simpson's rule, exact for the cubics between rows."""
    if len(x) < 2:
        return np.zeros(len(x))
    parts = np.diff(x) * (y[:-1] + 4 * _middles(x, y) + y[1:]) / 6
    return np.concatenate([[0.0], np.cumsum(np.where(np.diff(x) == 0, 0.0, parts))])


def _slope(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of second order in the distance of rows, one-sided at ends and jumps."""
    found = np.zeros(len(x), dtype=np.result_type(y, float))
    for a, b in _pieces(x):
        if b - a > 1:
            found[a:b] = np.gradient(y[a:b], x[a:b], edge_order=2 if b - a > 2 else 1)
    return found


def _mean(x: np.ndarray, y: np.ndarray) -> Any:
    return _integral(x, y)[-1] / (x[-1] - x[0]) if len(x) > 1 and x[-1] != x[0] else y[:1].mean()


# functions of a whole course, which follow it along its axis x
WHOLE: dict[str, Callable[[np.ndarray, np.ndarray], Any]] = {
    **dict.fromkeys(("cph", "cphase"), lambda x, y: np.unwrap(FUNCTIONS["ph"](y))),
    **dict.fromkeys(("avg", "mean"), _mean),
    "rms": lambda x, y: np.sqrt(_mean(x, np.abs(y) ** 2)),
    "pp": lambda x, y: np.ptp(y.real),
    "maximum": lambda x, y: y.real.max(),
    "minimum": lambda x, y: y.real.min(),
    "integ": _integral,
    **dict.fromkeys(("ddt", "deriv"), _slope),
}
OPERATORS: dict[str, Callable[..., Any]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": _power,
    "<": lambda a, b: np.less(a, b) * 1.0, "<=": lambda a, b: np.less_equal(a, b) * 1.0,
    ">": lambda a, b: np.greater(a, b) * 1.0, ">=": lambda a, b: np.greater_equal(a, b) * 1.0,
    "==": lambda a, b: np.equal(a, b) * 1.0, "!=": lambda a, b: np.not_equal(a, b) * 1.0,
    "&&": lambda a, b: np.logical_and(a, b) * 1.0, "||": lambda a, b: np.logical_or(a, b) * 1.0,
}  # fmt: skip


def evaluate(table: Columns, node: Node, where: Span | None = None) -> tuple[np.ndarray, str]:
    """An expression's values, shape (len(table),), float64 or complex128, and its unit. DeckError (E352) for a name that
    is no column, (E121) for a wrong number of arguments."""
    value, unit = _value(table, node, where)
    value = np.asarray(value)
    kind = complex if np.iscomplexobj(value) else float
    return np.broadcast_to(value.astype(kind), (len(table),)), unit


def _value(table: Columns, node: Node, where: Span | None) -> tuple[Any, str]:
    if isinstance(node, Num):
        return node.value, ""
    if (
        isinstance(node, Call)
        and (node.fn in KNOWN or node.fn in WHOLE)
        and not table.has_column(to_text(node))
        and not (node.fn == "im" and in_words(table, node) is not None)
    ):
        args = [_value(table, a, where) for a in node.args]
        if node.fn in WHOLE:
            _check_count(node, len(args), where)
            values, unit = args[0]
            return _along(table, node.fn, values), UNIT_OF_WHOLE[node.fn](unit, table.axis_unit)
        unit = args[0][1] if node.fn in SAME_UNIT and args else UNITS.get(node.fn, "")
        return _apply(node, [a for a, _ in args], where), unit
    if isinstance(node, (Name, Call)):
        if isinstance(node, Name) and node.id == "pi":
            return math.pi, ""
        if (word := in_words(table, node)) is not None:
            return _value(table, word, where)
        return _column(table, node, where)
    if isinstance(node, Unary):
        a, unit = _value(table, node.a, where)
        return (-a if node.op == "-" else a if node.op == "+" else np.equal(a, 0) * 1.0), unit
    if isinstance(node, Binary):
        (a, ua), (b, ub) = _value(table, node.a, where), _value(table, node.b, where)
        with np.errstate(all="ignore"):
            return OPERATORS[node.op](a, b), unit_of_two(node, ua, ub)
    assert isinstance(node, Cond)
    (a, unit), (b, _) = _value(table, node.a, where), _value(table, node.b, where)
    return np.where(np.not_equal(_value(table, node.c, where)[0], 0), a, b), unit


def _column(table: Columns, node: Node, where: Span | None) -> tuple[np.ndarray, str]:
    text = to_text(node)
    try:
        return table.column(text), table.column_unit(text)
    except KeyError as error:
        said, _, near = str(error.args[0]).replace("'", "`").partition(", did")
        hint = f"did{near}" if near else None
        deck_error("E352", f"there is {said} in these results", node.span or where, hint)


def _along(table: Columns, fn: str, values: Any) -> np.ndarray:
    """A function of a whole course, of each of them where the table has several."""
    y = np.broadcast_to(np.asarray(values), (len(table),))
    own = getattr(table, "along", None)
    if own is not None:
        found: np.ndarray = own(fn, y)
        return found
    x = table.axis_values()
    with np.errstate(all="ignore"):
        parts = [np.broadcast_to(WHOLE[fn](x[a:b], y[a:b]), (b - a,)) for a, b in table.blocks()]
    return np.concatenate(parts) if parts else y


def _check_count(node: Call, count: int, where: Span | None) -> None:
    known = KNOWN.get(node.fn)
    least, most = (1, 1) if known is None else (known.least, known.most)
    if not least <= count <= most:
        wanted = f"{least} argument" + ("s" if least != 1 else "")
        deck_error("E121", f"{node.fn} takes {wanted}, there are {count}", node.span or where)


def _apply(node: Call, args: list[Any], where: Span | None) -> Any:
    _check_count(node, len(args), where)
    function = KNOWN[node.fn].source

    def guarded(*values: float) -> float:
        try:
            return float(function(*values))
        except (ValueError, OverflowError, ZeroDivisionError):
            return math.nan

    with np.errstate(all="ignore"):
        if (found := FUNCTIONS.get(node.fn)) is not None:
            return found(*args)
        return np.asarray(np.frompyfunc(guarded, len(args), 1)(*args), dtype=float)
