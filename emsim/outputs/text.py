"""Tables as `.print` asks for them, in ngspice's columns: `Index time v(out) ...`.

A transient is shown on the TSTEP grid, interpolated between the computed points by `Table.at`'s rule; without
a grid every point is shown. An operating point is a list `name = value`. There are no page breaks.
"""

from __future__ import annotations

from .._engine import table_text
from ..diagnostics import inert
from ..interpolate import doubles
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from ..outcome import Outcome
    from ..table import Table

RULE = "-" * 80
ROWS = 10_000  # that are made text of at a time


def write(path: str, result: Outcome) -> None:
    """Writes the .print tables, or all columns of the main table when the deck has none."""
    with replacing(path) as beside, open(beside, "w", encoding="utf-8") as file:
        for line in lines(result) if result.prints else table_lines(result.main, result.main.signals):
            file.write(inert(line) + "\n")


def lines(result: Outcome, unfinished: int | None = None) -> Iterator[str]:
    """The .print tables of a result, in the order of the cards; of a run that did not reach its end only the
    last `unfinished` rows, when that is given."""
    for kind, names in result.prints:
        for table in result.plots:
            if table.kind == kind:
                own = [
                    n for name in names for n in (table.signals if name == "all" else [name]) if n in table
                ]
                if own or not names:
                    yield from table_lines(table, own, last=None if table.status == "ok" else unfinished)


def measured(result: Outcome) -> Iterator[str]:
    """What .meas found, as ngspice -b prints it."""
    before: tuple[str, int] | None = None
    for one in result.measured:
        place = (one.analysis, one.step)
        if place != before:
            if before is None or before[0] != one.analysis:
                yield from ("", f"  Measurements for {result.table(one.analysis).plotname}", "")
            if one.step < len(result.steps):
                yield said(result.steps[one.step])
            before = place
        yield one.text()
    yield ""


def harmonics(result: Outcome) -> Iterator[str]:
    """What .four found, as ngspice prints it."""
    for one in result.spectra:
        if one.step < len(result.steps):
            yield said(result.steps[one.step])
        yield from one.lines()


def said(values: Mapping[str, float]) -> str:
    """A step of a sweep, above what is told of it."""
    return "Step: " + ", ".join(f"{name} = {value:g}" for name, value in values.items())


def table_lines(
    table: Table, names: Sequence[str], digits: int = 6, last: int | None = None
) -> Iterator[str]:
    """One table; with `last` its last rows only, numbered as in the whole."""
    if not len(table):
        return
    if table.is_stepped:
        for values, course in zip(table.step_values(), table.courses(), strict=True):
            yield said(values)
            yield from table_lines(course, names, digits, last)
        return
    if not table.axis:
        for name in names:
            for re, im in zip(*table.parts(name), strict=True):
                value = f"{re:.{digits}e},{im:.{digits}e}" if _is_complex(table, name) else f"{re:.{digits}e}"
                yield f"{name} = {value} {table.unit(name)}".rstrip()
        return
    first, columns = _on_grid(table, names, last)
    widths = [digits + 10, *((digits + 10) * (1 + _is_complex(table, name)) for name in names)]
    yield table.title.center(80).rstrip()
    yield table.plotname.center(80).rstrip()
    yield RULE
    heads = zip((table.names[0], *names), widths, strict=True)
    yield f"{'Index':<8}" + "".join(f"{name:<{width - 1}} " for name, width in heads).rstrip()
    yield RULE
    if first:
        yield f"... {first} rows before these"
    complex = [False, *(_is_complex(table, name) for name in names)]
    sizes = [16 if z else 8 for z in complex]
    for begin in range(0, len(columns[0]), 8 * ROWS):
        rows = slice(begin // 8, begin // 8 + ROWS)
        parts = [c[size * rows.start : size * rows.stop] for c, size in zip(columns, sizes, strict=True)]
        yield from table_text(parts, complex, widths, first + rows.start, digits).splitlines()
    yield ""


def _is_complex(table: Table, name: str) -> bool:
    return table.has_column(name) and table.is_complex(name)


def _on_grid(table: Table, names: Sequence[str], last: int | None) -> tuple[int, list[bytes]]:
    """Index of the first row, and the columns: the axis, then those of the names; complex ones hold pairs."""

    def column(name: str) -> bytes:
        if _is_complex(table, name):
            return table.pairs(name)
        return table.doubles(name).tobytes()

    times = print_grid(table)
    if times is None:
        count = len(table)
        first = max(count - last, 0) if last is not None else 0
        columns = [table.doubles(0).tobytes(), *map(column, names)]
        return first, [c[first * (len(c) // count) :] for c in columns]
    first = max(len(times) - last, 0) if last is not None else 0
    at = times[first:]
    return first, [doubles(at), *(table.samples_of(name, doubles(at)) for name in names)]


def print_grid(table: Table) -> list[float] | None:
    """The times of a transient's print grid, as far as the run came [s]; None for a table without one."""
    x = table.doubles(0)
    if table.grid is None or len(x) < 2 or not table.grid[0] > 0:
        return None
    step, start, stop = table.grid
    count = int((min(stop, x[-1]) - start) / step + 1e-9) + 1
    return [min(max(start + k * step, x[0]), x[-1]) for k in range(count)]
