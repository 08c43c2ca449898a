"""A table as measurements see it: an axis, and signals as curves over it."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..diagnostics import DeckError
from ..expr import Num
from ..signals import WHOLE, evaluate
from .base import NotFound
from .curve import DEGREE, Curve, integrals, nodes, slopes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Span
    from ..expr import Node
    from ..result import Table


class Points:
    """One course of a table (`rows`: the first and behind the last). With `fine` its columns lie at Chebyshev's points of each
    step, that many and one a step; else they are what lies between neighbouring points of the table."""

    def __init__(
        self, table: Table, rows: tuple[int, int] | None = None, fine: int = 0, start: float | None = None
    ) -> None:
        self.table, self.analysis, self.n = table, table.kind, fine or DEGREE
        self.begin, self.end = rows or (0, len(table))
        self.fine, self.start = bool(fine), start
        self.axis_name = table.axis.name if table.axis else ""
        self.axis_unit = table.axis.unit if table.axis else ""
        self._columns: dict[str, np.ndarray] = {}
        self.real_parts: list[Node] = []  # of complex expressions, taken as ngspice does

    @cached_property
    def x(self) -> np.ndarray:
        """The axis, (segments, n+1)."""
        if not self.axis_name:
            return np.zeros((1, self.n + 1))
        x = self.table.column(self.table.names[0])[self.begin : self.end].astype(float)
        if self.fine:
            return x.reshape(-1, self.n + 1)
        if len(x) < 2:
            return np.repeat(x[:1, None], self.n + 1, axis=1)
        a, b = x[:-1, None], x[1:, None]
        found = a + (b - a) * nodes(self.n)
        found[:, -1] = x[1:]  # to the bit
        return found

    def __len__(self) -> int:
        return int(self.x.size)

    # ---- what signals.py asks of a table ----

    def has_column(self, name: str) -> bool:
        return self.table.has_column(name)

    def column_unit(self, name: str) -> str:
        return self.table.column_unit(name)

    def column(self, name: str) -> np.ndarray:
        if name not in self._columns:
            self._columns[name] = self._between(name)
        return self._columns[name]

    def _between(self, name: str) -> np.ndarray:
        table = self.table
        y = table.column(name)[self.begin : self.end]
        if not self.axis_name:
            return np.repeat(y[:1], self.n + 1)
        if self.fine:
            return y
        if name in (self.axis_name, table.names[0]):
            return self.x.ravel()
        if len(y) < 2:
            return np.repeat(y[:1], self.n + 1)
        return _smooth(table, name, self.x, table.column(table.names[0])[self.begin : self.end], y)

    def axis_values(self) -> np.ndarray:
        flat: np.ndarray = self.x.ravel()
        return flat

    def blocks(self) -> list[tuple[int, int]]:
        return [(0, len(self))]

    def along(self, fn: str, values: np.ndarray) -> np.ndarray:
        """A function of the whole course (signals.WHOLE), by the polynomials of the segments."""
        y, width = values.reshape(self.x.shape), (self.x[:, -1] - self.x[:, 0])[:, None]
        sums = (y @ integrals(self.n).T) * width
        if fn in ("ddt", "deriv"):
            with np.errstate(all="ignore"):
                found = np.where(width == 0, 0.0, (y @ slopes(self.n).T) / width)
        elif fn == "integ":
            found = sums + (np.cumsum(sums[:, -1]) - sums[:, -1])[:, None]
        elif fn in ("avg", "mean", "rms"):
            if fn == "rms":
                sums = (np.abs(y) ** 2 @ integrals(self.n).T) * width
            mean = sums[:, -1].sum() / width.sum() if width.sum() else y.ravel()[0]
            found = np.full(self.x.shape, np.sqrt(abs(mean)) if fn == "rms" else mean)
        else:
            found = np.broadcast_to(WHOLE[fn][0](self.axis_values(), values), (len(self),))
        flat: np.ndarray = found.ravel()
        return flat

    # ---- what measurements ask ----

    @property
    def first(self) -> float:
        """Where the results begin: a step may begin before."""
        if self.start is not None or not self.axis_name:
            return self.start or 0.0
        x = self.table.column(self.table.names[0])
        return float(min(x[self.begin], x[self.end - 1]))

    @property
    def last(self) -> float:
        return float(max(self.x[0, 0], self.x[-1, -1]))

    def place(self, value: float) -> str:
        return f"{self.axis_name} = {value:g} {self.axis_unit}".strip() if self.axis_name else "the point"

    def check(self, place: float) -> None:
        """NotFound for a place outside the results."""
        rounding = 1e-9 * (self.last - self.first)
        if not self.first - rounding <= place <= self.last + rounding:
            said = f"{self.place(place)} lies outside the results"
            raise NotFound(said, f"they go from {self.place(self.first)} to {self.place(self.last)}")

    def curve(self, node: Node, where: Span) -> tuple[Curve, str]:
        """An expression over the axis, and its unit. Of complex values the real part, as in ngspice; `real_parts` notes it."""
        if isinstance(node, Num):
            return Curve(self.x, np.full(self.x.shape, node.value)), ""
        try:
            values, unit = evaluate(self, node, where)
        except DeckError as error:
            found = error.diagnostics[0]
            raise NotFound(found.message, found.hint, found.span) from None
        if np.iscomplexobj(values):
            self.real_parts.append(node)
            values = values.real
        return Curve(self.x, np.ascontiguousarray(values).reshape(self.x.shape)), unit

    def number(self, node: Node, what: str, where: Span) -> float:
        """The value of an expression that does not change along the axis."""
        if isinstance(node, Num):
            return node.value
        curve, _ = self.curve(node, where)
        if np.ptp(curve.y) > 1e-9 * np.abs(curve.y).max():
            raise NotFound(f"{what} is one number, `{node!r}` changes along the results", None, node.span)
        return float(curve.y[0, 0])


def _smooth(table: Table, name: str, at: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Values at places between points, by the cubic of interpolate.py; over a logarithmic axis in its logarithm."""
    from ..interpolate import cubic_many

    corners = table.corners(name) if table.smooth else ()
    if table.axis is not None and table.axis.log and x[0] > 0:
        x, at = np.log(x), np.log(at)
    if x[-1] < x[0]:
        x, at = -x, -at
    query = np.clip(at, x[0], x[-1])
    if np.iscomplexobj(y):
        found = cubic_many(x, y.real, query) + 1j * cubic_many(x, y.imag, query)
    else:
        found = cubic_many(x, y, query, corners)
    # ends as they are: a jump has two points at one place
    found[:, 0], found[:, -1] = y[:-1], y[1:]
    flat: np.ndarray = found.ravel()
    return flat
