"""Comma-separated values: a line of names, on request a line of units, then one line a point.

Numbers have as many digits as give the same double when read again. Names with a comma are quoted, as
spreadsheets expect. A complex column is two, re(name) and im(name). One file holds one table: the main one. Read are such
files and those of other programs.
"""

from __future__ import annotations

from ..diagnostics import inert
from ..outcome import Outcome
from ..table import Table, is_axis, kind_of
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator


def write(path: str, result: Outcome, units: bool = False) -> None:
    """Writes the main table. OSError as open() and write() raise it."""
    with replacing(path) as beside, open(beside, "w", encoding="utf-8", newline="") as file:
        for line in lines(result.main, units):
            file.write(line + "\n")


def lines(table: Table, units: bool = False) -> Iterator[str]:
    columns = table.flat()
    yield ",".join(_field(name) for name, _, _ in columns)
    if units:
        yield ",".join(_field(unit) for _, unit, _ in columns)
    for point in zip(*(numbers for _, _, numbers in columns), strict=True):
        yield ",".join(map(repr, point))


def _field(text: str) -> str:
    text = inert(text)
    return '"' + text.replace('"', '""') + '"' if "," in text or '"' in text else text


def read(path: str) -> Outcome:
    """A line of names, perhaps a line of units, then numbers. OSError; ValueError where the file is something else.

    Without a line of units time, v(...) and i(...) get the ones that they always have."""
    import csv
    from array import array

    from ..store import paired
    from ..table import Table

    with open(path, encoding="utf-8-sig", newline="") as file:
        rows = csv.reader(file, skipinitialspace=True)
        names = [name.strip() for name in next(rows, [])]
        columns = [array("d") for _ in names]
        units: list[str] = []
        for row in rows:
            if not row:
                continue
            if len(row) != len(names):
                raise ValueError(f"{path}:{rows.line_num}: {len(row)} values for {len(names)} names")
            try:
                values = [float(word) for word in row]
            except ValueError:
                if units or columns[0]:
                    raise ValueError(
                        f"{path}:{rows.line_num}: {row[0]!r} ... is no line of numbers"
                    ) from None
                units = [word.strip() for word in row]
                continue
            for column, value in zip(columns, values, strict=True):
                column.append(value)
    if not names or not columns[0]:
        raise ValueError(f"{path}: no line of names with lines of numbers under it")
    names, units, store = paired(
        names, units or list(map(_usual_unit, names)), [c.tobytes() for c in columns]
    )
    return Outcome("", [Table(kind_of(names), names, units, store, axis=is_axis(names[0]))])


def _usual_unit(name: str) -> str:
    if name.startswith(("re(", "im(")):
        name = name[3:]
    return {"time": "s", "frequency": "Hz"}.get(name) or {"v(": "V", "i(": "A"}.get(name[:2].lower(), "")
