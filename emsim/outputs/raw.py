"""SPICE raw files, binary and ascii, written and read.

The layout is ngspice's: a text header, then either `Binary:` and little-endian float64 records, one record a
point, or `Values:` and text; the plots of several analyses follow one another in one file. The `Command:`
line carries the word ngspice because spicelib recognises the dialect by it, and is a comment because ngspice
runs it. Units have no place in the format; the variable's type stands for them (`angle` is rad). Types that
a reader does not know are shown as plain numbers: ngspice does so with the mechanical ones.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from typing import IO

    from ..result import Result, Table

TYPES = {
    "s": "time", "V": "voltage", "A": "current", "Hz": "frequency",
    "rad": "angle", "rad/s": "angular_velocity", "rad/s^2": "angular_acceleration",
    "m": "position", "m/s": "velocity", "m/s^2": "acceleration",
    "N": "force", "N m": "torque", "J": "energy", "W": "power",
    "Wb": "flux", "Ohm": "resistance", "F": "capacitance", "H": "inductance",
    "": "notype",
}  # fmt: skip
UNITS = {word: unit for unit, word in TYPES.items()}


def raw_type(unit: str) -> str:
    """The one-word variable type of a unit."""
    return TYPES.get(unit, "notype")


def write(path: str, result: Result, ascii: bool = False) -> None:
    """Writes every table of a result; those of the engine by the engine's own writer, without a copy.

    OSError as open() and write() raise it; ValueError when no analysis ran."""
    if not result.plots:
        raise ValueError("no analysis ran, so there is nothing to write")
    for k, table in enumerate(result.plots):
        native = getattr(table.waves, "write_raw", None)
        if native is not None:
            types = [raw_type(unit) for unit in table.units]
            native(path, _title(table), _date(), table.plotname, _command(), table.names, types, ascii, k > 0)
        else:
            with open(path, "ab" if k else "wb") as file:
                write_table(file, table, ascii)


def _title(table: Table) -> str:
    """Header lines end at the line break, so a title may not hold one."""
    return " ".join(table.title.split())


def _date() -> str:
    from time import localtime, strftime

    return strftime("%a %b %d %H:%M:%S  %Y", localtime())


def _command() -> str:
    from .. import __version__

    return f"* emsim {__version__} (ngspice raw dialect)"


def write_table(file: IO[bytes], table: Table, ascii: bool = False) -> None:
    """Appends one table to an open file."""
    from array import array

    variables = "".join(
        f"\t{k}\t{name}\t{raw_type(unit)}\n"
        for k, (name, unit) in enumerate(zip(table.names, table.units, strict=True))
    )
    header = (
        f"Title: {_title(table)}\n"
        f"Date: {_date()}\n"
        f"Plotname: {table.plotname}\n"
        f"Flags: real\n"
        f"No. Variables: {len(table.names)}\n"
        f"No. Points: {len(table)}\n"
        f"Command: {_command()}\n"
        f"Variables:\n{variables}"
    )
    columns = [table.floats(k) for k in range(len(table.names))]
    file.write(header.encode())
    if ascii:
        file.write(b"Values:\n")
        for k, point in enumerate(zip(*columns, strict=True)):
            file.write((f" {k}\t" + "\n\t".join(f"{v:.16e}" for v in point) + "\n\n").encode())
        return
    file.write(b"Binary:\n")
    records = array("d", bytes(8 * len(table) * len(columns)))
    for k, column in enumerate(columns):
        records[k :: len(columns)] = column
    if sys.byteorder == "big":
        records.byteswap()
    file.write(records.tobytes())


class RawFileError(ValueError):
    """The file is not a raw file, or ends too early."""


def read(path: str) -> Result:
    """Reads a raw file of ngspice or emsim. Complex plots (.ac) are passed over.

    OSError if the file cannot be opened, RawFileError if it cannot be understood."""
    from ..result import Result

    with open(path, "rb") as file:
        tables = []
        while (header := _header(file, path)) is not None:
            table = _table(file, header, path)
            if table is not None:
                tables.append(table)
    return Result(tables[0].title if tables else "", tables)


def _header(file: IO[bytes], path: str) -> dict[str, list[str]] | None:
    """Header fields up to and with `Binary:` or `Values:`, lower-case keys; None at the end of the file."""
    fields: dict[str, list[str]] = {}
    key = ""
    while line := file.readline(1 << 20):
        text = line.decode("utf-8", "replace").rstrip("\r\n")
        if text.startswith("\t") and key == "variables":
            fields[key].append(text)
            continue
        if not text.strip():
            continue
        word, colon, rest = text.partition(":")
        key = word.strip().lower()
        if not colon or (not fields and key != "title"):
            raise RawFileError(f"{path}: not a raw file")
        fields[key] = [rest.strip()]
        if key in ("binary", "values"):
            return fields
    if fields:
        raise RawFileError(f"{path}: ends within a header")
    return None


def _table(file: IO[bytes], header: dict[str, list[str]], path: str) -> Table | None:
    from array import array

    from ..result import Columns, Table

    try:
        count, points = int(header["no. variables"][0]), int(header["no. points"][0])
        variables = [line.split() for line in header["variables"] if line.strip()]
        names, types = [v[1] for v in variables], [v[2] for v in variables]
    except (KeyError, ValueError, IndexError):
        raise RawFileError(f"{path}: a header lacks its counts or variables") from None
    if len(names) != count:
        raise RawFileError(f"{path}: {count} variables announced, {len(names)} listed")
    flags = header.get("flags", [""])[0].lower().split()
    width = 2 if "complex" in flags else 1
    if "binary" in header:
        records = array("d")
        data = file.read(8 * width * count * points)
        if len(data) < 8 * width * count * points:
            raise RawFileError(f"{path}: ends after {len(data) // (8 * width * count)} of {points} points")
        records.frombytes(data)
        if sys.byteorder == "big":
            records.byteswap()
    else:
        records = _values(file, count, points, width, path)
    if width == 2:
        return None
    plotname = header.get("plotname", [""])[0]
    kind = {"Transient Analysis": "tran", "Operating Point": "op"}.get(plotname, plotname.lower())
    columns = Columns(records[k::count].tobytes() for k in range(count))
    units = [UNITS.get(t, "") for t in types]
    axis = types[0] in ("time", "frequency") if types else False
    return Table(kind, names, units, columns, title=header["title"][0], axis=axis, plotname=plotname)


def _values(file: IO[bytes], count: int, points: int, width: int, path: str) -> array[float]:
    """The numbers of an ascii plot: an index, then one number a variable (two, with a comma, if complex)."""
    from array import array

    records = array("d")
    for _ in range(points):
        words: list[str] = []
        while len(words) < count + 1:
            line = file.readline()
            if not line:
                raise RawFileError(f"{path}: ends after {len(records) // (width * count)} of {points} points")
            words += line.decode("ascii", "replace").split()
        try:
            for word in words[1:]:
                records.extend(map(float, word.split(",")))
        except ValueError:
            raise RawFileError(f"{path}: {' '.join(words[:3])!r} is not a point") from None
    return records
