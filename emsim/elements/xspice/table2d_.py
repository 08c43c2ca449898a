"""table2d: straight lines between the values of a table, along x and along y."""

from __future__ import annotations

from itertools import pairwise
from math import prod

from ...tables import TableError, number
from .base import CodeModel, Port, Seat, Word, driving, reading, text
from .files import lines, report

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar

    from ..contract import Expr


WORDS = {
    "order": Word("no effect on values; slopes are those of straight lines, as order=2 of ngspice", "", 3.0),
    "verbose": Word(),
    "offset": Word("added to it", "", 0.0),
    "gain": Word("factor on the value", "", 1.0),
    "file": text(
        "file of the table: counts, then the abscissas of each input, then values, the first input fastest"
    ),
}
MOST = 65_536  # values: each is an expression of its own


def table_of(seat: Seat, inputs: int) -> tuple[list[list[float]], list[float]] | None:
    """Abscissas of each input, and the values; None, reported, where the file is not of that form."""
    rows = lines(seat, "file")
    if rows is None:
        return None
    try:
        words = iter([(word, line) for line, row in rows for word in row])
        counts = [int(number(*next(words))) for _ in range(inputs)]
        if min(counts) < 2:
            raise TableError("two places are needed along each input")
        axes = [[number(*next(words)) for _ in range(count)] for count in counts]
        values = [number(*word) for word in words]
        total = prod(counts)
        if len(values) != total:
            raise TableError(f"{len(values)} values, {' x '.join(map(str, counts))} want {total}")
        if total > MOST:
            raise TableError(f"{total} values, {MOST} are the most")
        if any(a >= b for axis in axes for a, b in pairwise(axis)):
            raise TableError("places do not ascend")
    except StopIteration:
        report(seat, "file", TableError("the file ends too early"))
        return None
    except TableError as error:
        report(seat, "file", error)
        return None
    return axes, values


def interpolated(seat: Seat, at: list[Expr], axes: list[list[float]], values: list[float]) -> Expr:
    """Along the last input a sum of what the others come to at each of its places, times a hat about it."""
    if len(axes) == 1:
        return seat.curve(at[0], axes[0], values, True)
    places, size = axes[-1], len(values) // len(axes[-1])
    total = seat.ctx.b.const(0.0)
    for k in range(len(places)):
        hat = seat.curve(at[-1], places, [float(j == k) for j in range(len(places))], True)
        total = total + hat * interpolated(seat, at[:-1], axes[:-1], values[k * size : (k + 1) * size])
    return total


class Table2d(CodeModel):
    """ngspice's values are those of straight lines whatever the order; beyond 2 its slopes, which Newton's method and small
    signals take, are those of another curve. Here slopes are always those of the values."""

    name = "table2d"
    what = "table of two inputs"
    law = "out = offset + gain value, straight lines along both inputs; beyond the table constant"
    ports: ClassVar[tuple[Port, ...]] = (reading("inx"), reading("iny"), driving("out", "i", "id", "v", "vd"))
    parameters: ClassVar[dict[str, Word]] = WORDS

    def check(self, seat: Seat) -> None:
        if seat["order"] > 2.0:
            seat.ctx.remark(
                "W284",
                f".model `{seat.model.name}`: order={seat['order']:g} has no effect, slopes in small signals are those of the "
                "straight lines between values",
                seat.model.param_spans.get("order", seat.model.span),
                "order=2 says so; ngspice's values are the same at any order, its slopes are not",
            )

    def build(self, seat: Seat) -> None:
        found = table_of(seat, len(self.ports) - 1)
        if found is not None:
            at = [seat.read(port.name) for port in self.ports[:-1]]
            seat.drive("out", seat["offset"] + seat["gain"] * interpolated(seat, at, *found))


MODEL = Table2d
