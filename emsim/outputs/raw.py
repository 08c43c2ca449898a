"""SPICE raw files, binary and ascii, written and read.

The layout is ngspice's: a text header, then either `Binary:` and little-endian float64 records, one record a
point, or `Values:` and text; the plots of several analyses follow one another in one file. The `Command:`
line carries the word ngspice because spicelib recognises the dialect by it, and is a comment because ngspice
runs it. Units have no place in the format; the variable's type stands for them (`angle` is rad). Types that
a reader does not know are shown as plain numbers: ngspice does so with the mechanical ones.

LTspice's files are read as well: text in UTF-16 since version XVII, and unless the flags say `double` all but the first variable
as float32, point by point or (`fastaccess`) variable by variable. The sign of a time marks points that compression has made.
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
UNITS = {word: unit for unit, word in TYPES.items()} | {"device_current": "A", "subckt_current": "A"}


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
    """Reads a raw file of ngspice, LTspice or emsim. Complex plots (.ac) are passed over.

    OSError if the file cannot be opened, RawFileError if it cannot be understood."""
    from ..result import Result

    with open(path, "rb") as file:
        wide = file.read(2) == b"T\0"
        file.seek(0)
        tables = []
        while (header := _header(file, wide, path)) is not None:
            table = _table(file, header, wide, path)
            if table is not None:
                tables.append(table)
    return Result(tables[0].title if tables else "", tables)


def _line(file: IO[bytes], wide: bool) -> str:
    """The next line with its end, in UTF-16 where it is `wide`; empty at the end of the file."""
    line = file.readline(1 << 20)
    return (line + file.read(1)).decode("utf-16-le", "replace") if wide else line.decode("utf-8", "replace")


def _header(file: IO[bytes], wide: bool, path: str) -> dict[str, list[str]] | None:
    """Header fields up to and with `Binary:` or `Values:`, lower-case keys; None at the end of the file."""
    fields: dict[str, list[str]] = {}
    key = ""
    while line := _line(file, wide):
        text = line.rstrip("\r\n")
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


def _table(file: IO[bytes], header: dict[str, list[str]], wide: bool, path: str) -> Table | None:
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
    foreign = "ltspice" in header.get("command", [""])[0].lower()
    if "values" in header:
        records = _values(file, count, points, width, wide, path)
    else:
        narrow = foreign and width == 1 and "double" not in flags
        size = 8 + 4 * (count - 1) if narrow else 8 * width * count
        data = file.read(size * points)
        if len(data) < size * points:
            raise RawFileError(f"{path}: ends after {len(data) // size} of {points} points")
        records = _doubles(data, width * count, points, narrow, "fastaccess" in flags)
    if width == 2:
        return None
    plotname = header.get("plotname", [""])[0]
    kind = {"Transient Analysis": "tran", "Operating Point": "op"}.get(plotname, plotname.lower())
    if foreign:
        names = [name.lower() for name in names]
        if types[:1] == ["time"]:
            records[::count] = array("d", map(abs, records[::count]))
    columns = Columns(records[k::count].tobytes() for k in range(count))
    units = [UNITS.get(t, "") for t in types]
    axis = types[0] in ("time", "frequency") if types else False
    return Table(kind, names, units, columns, title=header["title"][0], axis=axis, plotname=plotname)


def _doubles(data: bytes, count: int, points: int, narrow: bool, by_variable: bool) -> array[float]:
    """Records of float64 from the bytes of a plot; `narrow`: of float32 but for the first variable."""
    from array import array

    records = array("d")
    if not narrow and not by_variable:
        records.frombytes(data)
        if sys.byteorder == "big":
            records.byteswap()
        return records
    words = array("I")  # halves of a float64, or a float32
    words.frombytes(data)
    if sys.byteorder == "big":
        words.byteswap()
    each = [2] + [1 if narrow else 2] * (count - 1)
    whole = sum(each)
    records.frombytes(bytes(8 * count * points))
    for k, size in enumerate(each):
        first = sum(each[:k])
        if by_variable:
            parts = [words[first * points + half : (first + size) * points : size] for half in range(size)]
        else:
            parts = [words[first + half :: whole] for half in range(size)]
        column = array("I", bytes(4 * size * points))
        for half, part in enumerate(reversed(parts) if sys.byteorder == "big" else parts):
            column[half::size] = part
        numbers = array("d" if size == 2 else "f")
        numbers.frombytes(column.tobytes())
        records[k::count] = array("d", numbers)
    return records


def _values(file: IO[bytes], count: int, points: int, width: int, wide: bool, path: str) -> array[float]:
    """The numbers of an ascii plot: an index, then one number a variable (two, with a comma, if complex)."""
    from array import array

    records = array("d")
    for _ in range(points):
        words: list[str] = []
        while len(words) < count + 1:
            line = _line(file, wide)
            if not line:
                raise RawFileError(f"{path}: ends after {len(records) // (width * count)} of {points} points")
            words += line.split()
        try:
            for word in words[1:]:
                records.extend(map(float, word.split(",")))
        except ValueError:
            raise RawFileError(f"{path}: {' '.join(words[:3])!r} is not a point") from None
    return records
