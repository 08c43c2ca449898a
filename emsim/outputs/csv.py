"""Comma-separated values: a line of names, on request a line of units, then one line a point.

Numbers have as many digits as give the same double when read again. Names with a comma are quoted, as
spreadsheets expect. One file holds one table: the main one. Read are such files and those of other programs.
"""

from __future__ import annotations

from ..diagnostics import inert
from ..result import Result, Table
from .beside import replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator


def write(path: str, result: Result, units: bool = False) -> None:
    """Writes the main table. OSError as open() and write() raise it."""
    with replacing(path) as beside, open(beside, "w", encoding="utf-8", newline="") as file:
        for line in lines(result.main, units):
            file.write(line + "\n")


def lines(table: Table, units: bool = False) -> Iterator[str]:
    yield ",".join(map(_field, table.names))
    if units:
        yield ",".join(map(_field, table.units))
    columns = [table.floats(k) for k in range(len(table.names))]
    for point in zip(*columns, strict=True):
        yield ",".join(map(repr, point))


def _field(text: str) -> str:
    text = inert(text)
    return '"' + text.replace('"', '""') + '"' if "," in text or '"' in text else text


def read(path: str) -> Result:
    """A line of names, perhaps a line of units, then numbers. OSError; ValueError where the file is something else.

    Without a line of units time, v(...) and i(...) get the ones that they always have."""
    import csv
    from array import array

    from ..result import Columns, Table

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
    axis = names[0] in ("time", "frequency")
    kind = "tran" if names[0] == "time" else ""
    table = Table(
        kind, names, units or list(map(_usual_unit, names)), Columns(c.tobytes() for c in columns), axis=axis
    )
    return Result("", [table])


def _usual_unit(name: str) -> str:
    return {"time": "s", "frequency": "Hz"}.get(name) or {"v(": "V", "i(": "A"}.get(name[:2].lower(), "")
