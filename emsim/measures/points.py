"""A table as measurements see it: an axis, and signals as curves over it."""

from __future__ import annotations

from .._engine import Curve, segments, smooth
from ..diagnostics import DeckError
from ..expr import Binary, Call, Name, Num, Unary, to_text
from .base import NotFound

TYPE_CHECKING = False
if TYPE_CHECKING:
    import numpy as np

    from ..diagnostics import Span
    from ..expr import Node
    from ..table import Table

DEGREE = 4  # between two points of a table


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
        self._axis: bytes | None = None
        self.real_parts: list[Node] = []  # of complex expressions, taken as ngspice does

    @property
    def x(self) -> bytes:
        """The axis, n+1 float64 a segment."""
        if self._axis is None:
            own = self._own(0) if self.axis_name else bytes(8)
            self._axis = own if self.fine and self.axis_name else segments(own, self.n)
        return self._axis

    def __len__(self) -> int:
        return len(self.x) // 8

    def _own(self, name: str | int) -> bytes:
        """A real column of the table, of this course."""
        return self.table.doubles(name)[self.begin : self.end].tobytes()

    def real(self, name: str) -> bytes:
        """A real column on the axis."""
        table = self.table
        if self.axis_name and name in (self.axis_name, table.names[0]):
            return self.x
        own = self._own(name)
        if self.fine and self.axis_name:
            return own
        if not self.axis_name or len(own) <= 8:
            return own[:8] * (self.n + 1)
        logarithmic = table.axis is not None and table.axis.log
        corners = table.corners(name).tobytes() if table.smooth else b""
        return smooth(self._own(0), own, self.n, corners, logarithmic)

    # ---- what signals.py asks of a table ----

    def has_column(self, name: str) -> bool:
        return self.table.has_column(name)

    def column_unit(self, name: str) -> str:
        return self.table.column_unit(name)

    def column(self, name: str) -> np.ndarray:
        import numpy as np

        table = self.table
        if not table.is_complex(name):
            return np.frombuffer(self.real(name))
        y = table.column(name)[self.begin : self.end]
        if self.fine and self.axis_name:
            return y
        if not self.axis_name or len(y) < 2:
            return np.repeat(y[:1], self.n + 1)
        logarithmic = table.axis is not None and table.axis.log
        x = self._own(0)
        re, im = (
            np.frombuffer(smooth(x, part.tobytes(), self.n, b"", logarithmic)) for part in (y.real, y.imag)
        )
        found: np.ndarray = re + 1j * im
        return found

    def axis_values(self) -> np.ndarray:
        import numpy as np

        return np.frombuffer(self.x)

    def blocks(self) -> list[tuple[int, int]]:
        return [(0, len(self))]

    def along(self, fn: str, values: np.ndarray) -> np.ndarray:
        """A function of the whole course (signals.WHOLE), by the polynomials of the segments."""
        import numpy as np

        from ..signals import WHOLE
        from .curve import integrals, slopes

        x = self.axis_values().reshape(-1, self.n + 1)
        y, width = values.reshape(x.shape), (x[:, -1] - x[:, 0])[:, None]
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
            found = np.full(x.shape, np.sqrt(abs(mean)) if fn == "rms" else mean)
        else:
            found = np.broadcast_to(WHOLE[fn](self.axis_values(), values), (len(self),))
        flat: np.ndarray = found.ravel()
        return flat

    # ---- what measurements ask ----

    @property
    def first(self) -> float:
        """Where the results begin: a step may begin before."""
        if self.start is not None or not self.axis_name:
            return self.start or 0.0
        x = self.table.doubles(0)
        return min(x[self.begin], x[self.end - 1])

    @property
    def last(self) -> float:
        x = memoryview(self.x).cast("d")
        return max(x[0], x[-1])

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
        from array import array

        if isinstance(node, Num):
            return Curve(self.x, array("d", [node.value]).tobytes() * len(self), self.n), ""
        text = to_text(node) if isinstance(node, (Name, Call)) else ""
        if text and self.table.has_column(text) and not self.table.is_complex(text):
            return Curve(self.x, self.real(text), self.n), self.column_unit(text)
        import numpy as np

        from ..signals import evaluate

        try:
            with np.errstate(
                all="ignore"
            ):  # of db(0) and its like a measurement says itself that it has no value
                values, unit = evaluate(self, node, where)
        except DeckError as error:
            found = error.diagnostics[0]
            raise NotFound(found.message, found.hint, found.span) from None
        if np.iscomplexobj(values):
            self.real_parts.append(node)
            values = values.real
        return Curve(self.x, values.tobytes(), self.n), unit

    def number(self, node: Node, what: str, where: Span) -> float:
        """The value of an expression that does not change along the axis."""
        if (known := arithmetic(node)) is not None:
            return known
        curve, _ = self.curve(node, where)
        value = curve.constant
        if value is None:
            raise NotFound(f"{what} is one number, `{node!r}` changes along the results", None, node.span)
        return value


def arithmetic(node: Node) -> float | None:
    """The value of + - * / of numbers; None of all else, and where there is none."""
    if isinstance(node, Num):
        return node.value
    if isinstance(node, Unary) and node.op in "+-":
        a = arithmetic(node.a)
        return None if a is None else -a if node.op == "-" else a
    if not isinstance(node, Binary) or node.op not in ("+", "-", "*", "/"):
        return None
    a, b = arithmetic(node.a), arithmetic(node.b)
    if a is None or b is None or (node.op == "/" and b == 0.0):
        return None
    return a + b if node.op == "+" else a - b if node.op == "-" else a * b if node.op == "*" else a / b
