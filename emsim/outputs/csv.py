"""Comma-separated values: a line of names, on request a line of units, then one line a point.

Numbers have as many digits as give the same double when read again. Names with a comma are quoted, as
spreadsheets expect. One file holds one table: the main one.
"""

from __future__ import annotations

from ..result import Result, Table

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator


def write(path: str, result: Result, units: bool = False) -> None:
    """Writes the main table. OSError as open() and write() raise it."""
    with open(path, "w", encoding="utf-8", newline="") as file:
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
    return '"' + text.replace('"', '""') + '"' if "," in text or '"' in text else text
