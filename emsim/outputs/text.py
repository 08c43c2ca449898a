"""Tables as `.print` asks for them, in ngspice's columns: `Index time v(out) ...`.

A transient is shown on the TSTEP grid, interpolated between the computed points by `Table.at`'s rule; without
a grid every point is shown. An operating point is a list `name = value`. There are no page breaks.
"""

from __future__ import annotations

from ..diagnostics import inert
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

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
                own = [
                    n for name in names for n in (table.signals if name == "all" else [name]) if n in table
                ]
                if own or not names:
                    yield from table_lines(table, own, last=None if table.status == "ok" else unfinished)


def measured(result: Result) -> Iterator[str]:
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


def harmonics(result: Result) -> Iterator[str]:
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
    first, x, columns = _on_grid(table, names, last)
    widths = [digits + 10, *((digits + 10) * (1 + _is_complex(table, name)) for name in names)]
    yield table.title.center(80).rstrip()
    yield table.plotname.center(80).rstrip()
    yield RULE
    heads = zip((table.names[0], *names), widths, strict=True)
    yield f"{'Index':<8}" + "".join(f"{name:<{width - 1}} " for name, width in heads).rstrip()
    yield RULE
    if first:
        yield f"... {first} rows before these"
    for k, point in enumerate(zip(x, *columns, strict=True), first):
        cells = zip(point, widths, strict=True)
        yield f"{k:<8}" + "".join(f"{_number(value, digits):<{width}}" for value, width in cells).rstrip()
    yield ""


def _is_complex(table: Table, name: str) -> bool:
    return table.has_column(name) and table.is_complex(name)


def _number(value: complex | float, digits: int) -> str:
    """A number; a complex one as ngspice writes it, real and imaginary part with a comma between."""
    if isinstance(value, complex):
        return f"{value.real:.{digits}e}, {value.imag:.{digits}e}"
    return f"{value:.{digits}e}"


def _on_grid(
    table: Table, names: Sequence[str], last: int | None
) -> tuple[int, Sequence[float], list[Sequence[complex | float]]]:
    """Index of the first row, the axis and the columns."""

    def column(name: str) -> Sequence[complex | float]:
        if _is_complex(table, name):
            return [complex(re, im) for re, im in zip(*table.parts(name), strict=True)]
        return table.doubles(name)

    times = print_grid(table)
    if times is None:
        x = table.doubles(0)
        first = max(len(x) - last, 0) if last is not None else 0
        return first, x[first:], [column(name)[first:] for name in names]
    first = max(len(times) - last, 0) if last is not None else 0
    return first, times[first:], [table.samples(name, times[first:]) for name in names]


def print_grid(table: Table) -> list[float] | None:
    """The times of a transient's print grid, as far as the run came [s]; None for a table without one."""
    x = table.doubles(0)
    if table.grid is None or len(x) < 2 or not table.grid[0] > 0:
        return None
    step, start, stop = table.grid
    count = int((min(stop, x[-1]) - start) / step + 1e-9) + 1
    return [min(max(start + k * step, x[0]), x[-1]) for k in range(count)]
