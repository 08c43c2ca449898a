"""Tables as `.print` asks for them, in ngspice's columns: `Index time v(out) ...`.

A transient is shown on the TSTEP grid, interpolated between the computed points by `Table.at`'s rule; without
a grid every point is shown. An operating point is a list `name = value`. There are no page breaks.
"""

from __future__ import annotations

from ..diagnostics import inert
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..result import Result, Table

RULE = "-" * 80


def write(path: str, result: Result) -> None:
    """Writes the .print tables, or all columns of the main table when the deck has none."""
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        for line in lines(result) if result.prints else table_lines(result.main, result.main.signals):
            file.write(inert(line) + "\n")


def lines(result: Result, unfinished: int | None = None) -> Iterator[str]:
    """The .print tables of a result, in the order of the cards; of a run that did not reach its end only the
    last `unfinished` rows, when that is given."""
    for kind, names in result.prints:
        for table in result.plots:
            if table.kind == kind:
                yield from table_lines(table, names, last=None if table.status == "ok" else unfinished)


def table_lines(
    table: Table, names: Sequence[str], digits: int = 6, last: int | None = None
) -> Iterator[str]:
    """One table; with `last` its last rows only, numbered as in the whole."""
    if not len(table):
        return
    if not table.axis:
        for name in names:
            for value in table.doubles(name):
                yield f"{name} = {value:.{digits}e} {table.unit(name)}".rstrip()
        return
    first, x, columns = _on_grid(table, names, last)
    width = digits + 10
    yield table.title.center(80).rstrip()
    yield table.plotname.center(80).rstrip()
    yield RULE
    yield f"{'Index':<8}" + "".join(f"{name:<{width - 1}} " for name in (table.names[0], *names)).rstrip()
    yield RULE
    if first:
        yield f"... {first} rows before these"
    for k, point in enumerate(zip(x, *columns, strict=True), first):
        yield f"{k:<8}" + "".join(f"{value:<{width}.{digits}e}" for value in point).rstrip()
    yield ""


def _on_grid(
    table: Table, names: Sequence[str], last: int | None
) -> tuple[int, Sequence[float], list[Sequence[float]]]:
    """Index of the first row, the axis and the columns."""
    x = table.doubles(0)
    if table.grid is None or len(x) < 2 or not table.grid[0] > 0:
        first = max(len(x) - last, 0) if last is not None else 0
        return first, x[first:], [table.doubles(name)[first:] for name in names]
    step, start, stop = table.grid
    count = int((min(stop, x[-1]) - start) / step + 1e-9) + 1
    first = max(count - last, 0) if last is not None else 0
    times = [min(max(start + k * step, x[0]), x[-1]) for k in range(first, count)]
    return first, times, [table.samples(name, times) for name in names]
