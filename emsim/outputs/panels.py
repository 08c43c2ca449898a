"""What a picture shows: lists of signals become panels, one a unit, over the axis or over another signal.

    "v(out) v(in)-v(out) angle(hinge)"      two panels over time
    "omega(hinge) vs angle(hinge)"          one panel, a phase portrait

A signal is a column, or an expression of columns as .print takes them. Curves between computed points follow
interpolate.py; long ones are thinned to what can be seen, extremes kept. Drawn by picture.py and terminal.py.
"""

from __future__ import annotations

import math

import numpy as np

from ..assemble.outputs import KEEPS_UNIT, UNITS, unit_of_two
from ..build import parse_signals
from ..diagnostics import deck_error
from ..expr import SOURCE_MATH, Binary, Call, Cond, Name, Num, Unary, to_text
from ..interpolate import cubic_many
from .raw import TYPES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from ..deck import Probe
    from ..expr import Node
    from ..result import Table

FINE = 1500  # points that a curve has at least: between computed points it is not straight
PREFIXES = {-15: "f", -12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
UNSCALED = ("", "rad", "deg", "rpm", "C")
QUANTITIES = {**{unit: word.replace("_", " ") for unit, word in TYPES.items() if unit}, "deg": "angle"}


class Curve:
    """A name and the points (x, y), float64 of one length."""

    __slots__ = ("name", "x", "y")

    def __init__(self, name: str, x: np.ndarray, y: np.ndarray) -> None:
        self.name, self.x, self.y = name, x, y


class Panel:
    """Curves of one unit over one quantity. `x`: its name; units are plain, see `prefixed`; `log`: a logarithmic x."""

    __slots__ = ("curves", "log", "unit", "x", "xunit")

    def __init__(self, unit: str, x: str, xunit: str, log: bool) -> None:
        self.unit, self.x, self.xunit, self.log = unit, x, xunit, log
        self.curves: list[Curve] = []

    @property
    def label(self) -> str:
        """The name of the only curve, or of the quantity that all have."""
        return self.curves[0].name if len(self.curves) == 1 else QUANTITIES.get(self.unit, "")


def panels(
    table: Table,
    asked: Sequence[str | Sequence[Probe]],
    degrees: bool = False,
    start: float | None = None,
    stop: float | None = None,
) -> list[Panel]:
    """The panels of every list in turn. `degrees` shows rad as deg; `start`, `stop` cut the axis.

    Raises DeckError for signals that are not there, and where there is no course to draw."""
    if len(table) < 2:
        deck_error("E349", "there is nothing to draw: no analysis of several points ran")
    axis = table[table.names[0]]
    window = _window(table, axis, start, stop)
    found: list[Panel] = []
    for given in asked:
        wanted, across = split(parse_signals(given) if isinstance(given, str) else list(given))
        xname, xunit, x = table.names[0], table.units[0], axis
        if across is not None:
            ((xname, xunit, x),) = _signals(table, [across], degrees)
        own: dict[str, Panel] = {}
        log = across is None and xname == "frequency" and axis[0] > 0
        for name, unit, y in _signals(table, wanted, degrees):
            if not np.isfinite(y).any():
                deck_error("E349", f"there is nothing to draw: {name} is nowhere a finite number")
            panel = own.setdefault(unit, Panel(unit, xname, xunit, log))
            panel.curves.append(
                Curve(name, *_course(axis, x, y, window, table.kind == "tran", table.corners()))
            )
        found += own.values()
    return found


def _window(
    table: Table, axis: np.ndarray, start: float | None, stop: float | None
) -> tuple[float, float] | None:
    """The part of the axis that is drawn; None for all of one that turns back, such as two sweeps in one."""
    if np.any(np.diff(axis) < 0):
        if start is None and stop is None:
            return None
        deck_error("E349", f"{table.names[0]} turns back: it cannot be cut at a beginning and an end")
    first, last = float(axis[0]), float(axis[-1])
    window = (first if start is None else max(start, first), last if stop is None else min(stop, last))
    if not window[0] < window[1]:
        name, unit = table.names[0], table.units[0]
        wanted = f"from {window[0] if start is None else start:g} to {window[1] if stop is None else stop:g}"
        ends = f"{first:g} {unit} to {last:g} {unit}"
        deck_error("E349", f"there is nothing to draw {wanted} {unit}: {name} goes from {ends}")
    return window


def writes_degrees(deck: str) -> bool:
    """Whether a deck gives its angles in degrees."""
    import re

    return re.search(r"\d(deg)\b", deck, re.I) is not None


def prefixed(unit: str, largest: float) -> tuple[float, str]:
    """(factor, unit) by which numbers of up to this size are short: 0.02 A -> (1000, "mA")."""
    if unit in UNSCALED or unit.startswith(("rad", "deg")) or not 0 < largest < math.inf:
        return 1.0, unit
    power = 3 * math.floor(math.log10(largest * 1.0000001) / 3)
    power = min(max(power, -15), 0 if unit == "s" else 9)
    return 10.0**-power, PREFIXES[power] + unit


def is_flat(low: float, high: float) -> bool:
    """Whether what lies between is rounding and tolerance alone: it is drawn as a straight line."""
    return not high - low > 1e-6 * max(abs(low), abs(high))


# ---- signals ------------------------------------------------------------------------------------


def split(items: list[Probe]) -> tuple[list[Probe], Probe | None]:
    """`a b vs x` as ([a, b], x)."""
    at = next((k for k, p in enumerate(items) if isinstance(p.ast, Name) and p.ast.id == "vs"), None)
    if at is not None and not (0 < at == len(items) - 2):
        deck_error(
            "E353",
            "`vs` stands between signals and one x axis",
            items[at].span,
            "for example omega(hinge) vs angle(hinge)",
        )
    return (items, None) if at is None else (items[:at], items[at + 1])


def _signals(table: Table, items: Sequence[Probe], degrees: bool) -> Iterator[tuple[str, str, np.ndarray]]:
    """Name, unit and values of columns and expressions; `all` is every column."""
    for probe in items:
        asked = "".join(probe.text.split()).lower().strip("{}'\"")
        for name in table.names[1:] if asked == "all" and asked not in table else [asked]:
            if name in table:
                name, unit, y = table.spelled(name), table.unit(name), table[name]
            else:
                value, unit = _value(table, probe.ast, probe)
                y = np.broadcast_to(np.asarray(value, dtype=float), (len(table),))
            if degrees and unit.startswith("rad"):
                unit, y = "deg" + unit[3:], np.degrees(y)
            yield name, unit, y


def _value(table: Table, node: Node, probe: Probe) -> tuple[np.ndarray | float, str]:
    """An expression over the columns, and its unit. Where it has no value it is NaN."""
    if isinstance(node, Num):
        return node.value, ""
    if isinstance(node, Call) and to_text(node) not in table and node.fn in SOURCE_MATH:
        args = [_value(table, a, probe) for a in node.args]
        unit = args[0][1] if node.fn in KEEPS_UNIT and args else UNITS.get(node.fn, "")
        return _apply(node, [a for a, _ in args], probe), unit
    if isinstance(node, (Name, Call)):
        if isinstance(node, Name) and node.id == "pi":
            return math.pi, ""
        return _column(table, node, probe)
    if isinstance(node, Unary):
        a, unit = _value(table, node.a, probe)
        return (-a if node.op == "-" else a if node.op == "+" else np.equal(a, 0) * 1.0), unit
    if isinstance(node, Binary):
        (a, ua), (b, ub) = _value(table, node.a, probe), _value(table, node.b, probe)
        with np.errstate(all="ignore"):
            return OPERATORS[node.op](a, b), unit_of_two(node, ua, ub)
    assert isinstance(node, Cond)
    (a, unit), (b, _) = _value(table, node.a, probe), _value(table, node.b, probe)
    return np.where(np.not_equal(_value(table, node.c, probe)[0], 0), a, b), unit


def _column(table: Table, node: Node, probe: Probe) -> tuple[np.ndarray, str]:
    text = to_text(node)
    try:
        y = table[text]
    except KeyError as error:
        said, _, near = str(error.args[0]).replace("'", "`").partition(", did")
        span = node.span or probe.span
        deck_error("E352", f"there is {said} in these results", span, f"did{near}" if near else None)
    return y, table.unit(text)


def _apply(node: Call, args: list[np.ndarray | float], probe: Probe) -> np.ndarray:
    least, most, function = SOURCE_MATH[node.fn]
    if not least <= len(args) <= most:
        deck_error(
            "E121", f"{node.fn} takes {least} arguments, there are {len(args)}", node.span or probe.span
        )

    def guarded(*values: float) -> float:
        try:
            return float(function(*values))
        except (ValueError, OverflowError, ZeroDivisionError):
            return math.nan

    with np.errstate(all="ignore"):
        found = VECTORS.get(node.fn) or np.frompyfunc(guarded, len(args), 1)
        return np.asarray(found(*args), dtype=float)


VECTORS: dict[str, Callable[..., np.ndarray]] = {
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp, "ln": np.log, "log": np.log, "log10": np.log10,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "atan": np.arctan, "atan2": np.arctan2, "hypot": np.hypot,
    "deg": np.degrees, "rpm": lambda x: np.asarray(x) * 30 / np.pi, "db": lambda x: 20 * np.log10(np.abs(x)),
}  # fmt: skip
OPERATORS: dict[str, Callable[..., np.ndarray]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide,
    "**": lambda a, b: np.power(np.abs(a), b),
    "<": lambda a, b: np.less(a, b) * 1.0, "<=": lambda a, b: np.less_equal(a, b) * 1.0,
    ">": lambda a, b: np.greater(a, b) * 1.0, ">=": lambda a, b: np.greater_equal(a, b) * 1.0,
    "==": lambda a, b: np.equal(a, b) * 1.0, "!=": lambda a, b: np.not_equal(a, b) * 1.0,
    "&&": lambda a, b: np.logical_and(a, b) * 1.0, "||": lambda a, b: np.logical_or(a, b) * 1.0,
}  # fmt: skip


# ---- courses ------------------------------------------------------------------------------------


def _course(
    axis: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    window: tuple[float, float] | None,
    smooth: bool,
    corners: Sequence[float],
) -> tuple[np.ndarray, np.ndarray]:
    """The points of a curve within the window of the axis, its ends among them; between few points of a transient
    the ones of interpolate.py."""
    if window is None:
        return x, y
    first, last = (
        int(np.searchsorted(axis, window[0], "left")),
        int(np.searchsorted(axis, window[1], "right")),
    )
    more = np.array([t for t, k in zip(window, (first, last - 1), strict=True) if axis[k] != t])
    if smooth and last - first < FINE:
        fine = np.linspace(*window, FINE)
        more = np.union1d(more, fine[~np.isin(fine, axis)])
    places = np.searchsorted(axis, more, "right") - first
    ends = slice(first, last)

    def course(values: np.ndarray) -> np.ndarray:
        if not len(more):
            return values[ends]
        between = cubic_many(axis, values, more, corners) if smooth else np.interp(more, axis, values)
        return np.insert(values[ends], places, between)

    across = course(x)
    return across, across if y is x else course(y)


def thinned(x: np.ndarray, y: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """What `columns` columns of a screen can show of a curve over ascending x: in each the first and the last point,
    the lowest and the highest. Curves that turn back in x, and short ones, stay as they are."""
    n = len(x)
    if n <= 4 * columns or np.any(np.diff(x) < 0):
        return x, y
    edges = np.linspace(x[0], x[-1], columns + 1)[:-1]
    starts = np.unique(np.searchsorted(x, edges))
    ends = np.append(starts[1:], n) - 1
    of = np.repeat(np.arange(len(starts)), ends - starts + 1)
    order = np.lexsort((y, of))
    keep = np.unique(np.concatenate([starts, ends, order[starts], order[ends]]))
    return x[keep], y[keep]
