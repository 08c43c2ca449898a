"""SPICE raw files, binary and ascii, written and read.

The layout is ngspice's: a text header, then either `Binary:` and little-endian float64 records, one record a
point, or `Values:` and text; the plots of several analyses follow one another in one file. The `Command:`
line carries the word ngspice because spicelib recognises the dialect by it, and is a comment because ngspice
runs it. A table with complex columns is one of complex numbers altogether, the axis too. Units have no place in the format;
the variable's type stands for them (`angle` is rad). Types that a reader does not know are shown as plain numbers: ngspice
does so with the mechanical ones.

LTspice's files are read as well: text in UTF-16 since version XVII, and unless the flags say `double` all but the first variable
as float32, point by point or (`fastaccess`) variable by variable. The sign of a time marks points that compression has made.
"""

from __future__ import annotations

import os
import sys
from itertools import pairwise

from ..diagnostics import inert
from .beside import create, keep_mode, remove, replacing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Sequence
    from typing import IO

    from ..outcome import Outcome
    from ..store import Waves
    from ..table import Table

TYPES = {
    "s": "time", "V": "voltage", "A": "current", "Hz": "frequency",
    "rad": "angle", "rad/s": "angular_velocity", "rad/s^2": "angular_acceleration",
    "m": "position", "m/s": "velocity", "m/s^2": "acceleration",
    "N": "force", "N m": "torque", "J": "energy", "W": "power",
    "Wb": "flux", "Ohm": "impedance", "S": "admittance", "F": "capacitance", "H": "inductance",
    "K": "temperature", "Pa": "pressure", "m^3/s": "flow", "dB": "decibel", "C": "temp-sweep",
    "": "notype",
}  # fmt: skip
UNITS = {word: unit for unit, word in TYPES.items()}
UNITS |= {
    "device_current": "A",
    "subckt_current": "A",
    "resistance": "Ohm",
    "res-sweep": "Ohm",
    "phase": "rad",
}

REAL = ("re(", "im(", "real(", "imag(", "mag(", "vm(", "vr(", "vi(")

# the axis of a sweep, as raw files spell it and as it is called
SWEEPS = {f"{kind}({kind}-sweep)": f"{kind}-sweep" for kind in "vi"} | {
    word: word for word in ("temp-sweep", "res-sweep")
}


def raw_type(unit: str) -> str:
    """The one-word variable type of a unit."""
    return TYPES.get(unit, "notype")


class Head:
    """What stands above a table in a raw file, as the engine takes it; `plotname`: how raw files spell the analysis."""

    __slots__ = ("command", "date", "names", "plotname", "title", "types")

    def __init__(self, title: str, plotname: str, names: Sequence[str], units: Sequence[str]) -> None:
        # header lines end at the line break, so a title may not hold one
        self.title, self.plotname = inert(" ".join(title.split())), plotname
        self.date, self.command = _date(), _command()
        self.names, self.types = [inert(name) for name in names], [raw_type(unit) for unit in units]


class Stream:
    """The rows of a run on their way to a file that replaces `path` in the end. A run that is killed leaves it, up to its last
    rows, as NAME.partial.raw."""

    def __init__(self, path: str) -> None:
        self.path = path
        stem, extension = os.path.splitext(os.path.realpath(path))
        self.partial = f"{stem}.partial{extension or '.raw'}"
        self.tables = 0  # whole ones in the file
        self.begun = False  # a run may have made the file

    def follow(self, done: Sequence[Table], head: Head) -> tuple[str, bool, Head]:
        """What the engine needs for the table after those that are `done`. OSError."""
        if not self.begun:
            remove(self.partial)
            if done:
                create(self.partial)
            self.begun = True
        for table in done[self.tables :]:
            if not self._finish(table):
                _append(self.partial, table)
            self.tables += 1
        return self.partial, self.tables > 0, head

    def _finish(self, table: Table) -> bool:
        """Whether the table is in the file. OSError where that went wrong."""
        ending = getattr(table.waves, "finish_stream", None)
        found = None if ending is None else ending()
        if found is None:
            return False
        rows, error = found
        if error is not None:
            said = error.partition(" (os error")[0]
            raise OSError(f"{said}; {self.partial} holds the first {rows} of {len(table)} rows")
        return True

    def replaces(self, result: Outcome) -> bool:
        """Puts the file in the place of `path`, if it has come to hold the whole result. OSError."""
        plots = result.plots
        if not self.begun or self.tables != len(plots) - 1 or not self._finish(plots[-1]):
            return False
        real = os.path.realpath(self.path)
        keep_mode(real, self.partial)
        os.replace(self.partial, real)
        self.begun = False
        return True

    def discard(self) -> None:
        if self.begun:
            remove(self.partial)
            self.begun = False


def write(path: str, result: Outcome, ascii: bool = False, stream: Stream | None = None) -> None:
    """Writes every table of a result; those of the engine by the engine's own writer, without a copy. `stream`: the file that
    the run has begun.

    OSError as open() and write() raise it; ValueError when no analysis ran."""
    if not result.plots:
        raise ValueError("no analysis ran, so there is nothing to write")
    if stream is not None and not ascii and stream.replaces(result):
        return
    try:
        with replacing(path) as beside:
            for table in result.plots:
                _append(beside, table, ascii)
    finally:
        if stream is not None:
            stream.discard()


def _append(path: str, table: Table, ascii: bool = False) -> None:
    """Puts a table behind what a file holds."""
    native = getattr(table.waves, "write_raw", None)
    if native is not None:
        native(path, Head(table.title, table.plotname, table.names, table.units), ascii)
        return
    with open(path, "ab") as file:
        write_table(file, table, ascii)


def _date() -> str:
    from time import localtime, strftime

    return strftime("%a %b %d %H:%M:%S  %Y", localtime())


def _command() -> str:
    from .._engine import __version__

    return f"* emsim {__version__} (ngspice raw dialect)"


def write_table(file: IO[bytes], table: Table, ascii: bool = False) -> None:
    """Appends one table to an open file."""
    from array import array

    wide = any(table.is_complex(k) for k in range(len(table.names)))
    variables = "".join(
        f"\t{k}\t{_spelled(table, k)}\t{_type(table, k, wide)}{_grid(table, k)}\n"
        for k, unit in enumerate(table.units)
    )
    header = (
        f"Title: {' '.join(table.title.split())}\n"
        f"Date: {_date()}\n"
        f"Plotname: {table.plotname}\n"
        f"Flags: {'complex' if wide else 'real'}{' stepped' if table.is_stepped else ''}\n"
        f"No. Variables: {len(table.names)}\n"
        f"No. Points: {len(table)}\n"
        f"Command: {_command()}\n"
        f"Variables:\n{variables}"
    )
    width = 2 if wide else 1
    columns = [part for k in range(len(table.names)) for part in table.parts(k)[:width]]
    file.write(header.encode())
    if ascii:
        file.write(b"Values:\n")
        for k, point in enumerate(zip(*columns, strict=True)):
            values = [
                ",".join(f"{v:.16e}" for v in point[i : i + width]) for i in range(0, len(point), width)
            ]
            file.write((f" {k}\t" + "\n\t".join(values) + "\n\n").encode())
        return
    file.write(b"Binary:\n")
    records = array("d", bytes(8 * len(table) * len(columns)))
    for k, column in enumerate(columns):
        records[k :: len(columns)] = array("d", column)
    if sys.byteorder == "big":
        records.byteswap()
    file.write(records.tobytes())


def _spelled(table: Table, k: int) -> str:
    """A name as raw files have it: ngspice writes the axis of a sweep so that it looks like a signal."""
    name = table.names[k]
    if k == 0 and table.axis is not None and name in SWEEPS.values():
        return next(spelled for spelled, plain in SWEEPS.items() if plain == name)
    return name


def _type(table: Table, k: int, wide: bool) -> str:
    """In a table of complex numbers a real angle is a phase."""
    unit = table.units[k]
    return "phase" if wide and unit == "rad" and not table.is_complex(k) else raw_type(unit)


def _grid(table: Table, k: int) -> str:
    """ngspice's word for a logarithmic axis."""
    return "\tgrid=3" if k == 0 and table.axis is not None and table.axis.log else ""


class RawFileError(ValueError):
    """The file is not a raw file, or ends too early."""


def read(path: str) -> Outcome:
    """Reads a raw file of ngspice, LTspice or emsim. Binary columns of real numbers stay in the file, which is mapped, until
    they are asked for.

    OSError if the file cannot be opened, RawFileError if it cannot be understood."""
    from ..outcome import Outcome

    with open(path, "rb") as file:
        wide = file.read(2) == b"T\0"
        file.seek(0)
        tables = []
        while (header := _header(file, wide, path)) is not None:
            tables.append(_table(file, header, wide, path))
    return Outcome(tables[0].title if tables else "", tables)


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


def _table(file: IO[bytes], header: dict[str, list[str]], wide: bool, path: str) -> Table:
    from array import array

    from ..store import Columns

    try:
        count, points = int(header["no. variables"][0]), int(header["no. points"][0])
        # between tabs, where a name may have blanks: v(m1#body diode)
        variables = [
            line.split("\t" if line.strip().count("\t") > 1 else None) for line in header["variables"]
        ]
        variables = [[word.strip() for word in words if word.strip()] for words in variables]
        variables = [words for words in variables if words]
        names, types = [v[1] for v in variables], [v[2] for v in variables]
    except (KeyError, ValueError, IndexError):
        raise RawFileError(f"{path}: a header lacks its counts or variables") from None
    if points < 0 or count < 1:
        raise RawFileError(f"{path}: {points} points of {count} variables")
    if len(names) != count:
        raise RawFileError(f"{path}: {count} variables announced, {len(names)} listed")
    flags = header.get("flags", [""])[0].lower().split()
    width = 2 if "complex" in flags else 1
    stepped = "stepped" in flags
    foreign = "ltspice" in header.get("command", [""])[0].lower()
    if "values" in header:
        records = _values(file, count, points, width, wide, path)
    else:
        narrow = foreign and width == 1 and "double" not in flags
        size = 8 + 4 * (count - 1) if narrow else 8 * width * count
        mapped = Mapped(file, count, path)
        there = (mapped.size - mapped.start) // size
        if there < points:
            raise RawFileError(f"{path}: ends after {there} of {points} points")
        end = mapped.start + size * points
        if "emsim" in header.get("command", [""])[0] and mapped.piece(end, end + 1) not in (b"", b"T"):
            # killed between writing the last rows and their number
            points, end = there, mapped.size
        file.seek(end)
        if width == 1 and not foreign and "fastaccess" not in flags and sys.byteorder == "little":
            mapped.rows = points
            return _named(header, names, types, mapped)
        data = mapped.piece(mapped.start, mapped.start + size * points)
        records = _doubles(data, width * count, points, narrow, "fastaccess" in flags)
    if foreign:
        names = [name.lower() for name in names]
        if types[:1] == ["time"]:
            records[::count] = array("d", map(abs, records[::count]))
    columns, complex = [], []
    leading = stepped and not foreign  # behind the axis stand the stepped quantities, which are real
    for k in range(count):
        # of a complex table the axis is real, and so is what has the type of a magnitude or of a phase
        complex.append(
            width == 2 and not (k == 0 and _has_axis(names, types)) and types[k] not in ("decibel", "phase")
        )
        real = names[k].lower().startswith(REAL)  # and so is what a function has made real
        if (leading or real) and complex[k]:
            complex[k] = any(records[2 * k + 1 :: 2 * count])
            leading = leading and not complex[k]
        if width == 1 or not complex[k]:
            columns.append(records[width * k :: width * count].tobytes())
        else:
            both = array("d", bytes(16 * points))
            both[::2], both[1::2] = records[2 * k :: 2 * count], records[2 * k + 1 :: 2 * count]
            columns.append(both.tobytes())
    if stepped and foreign and _has_axis(names, types) and points:
        # LTspice tells the steps in its log file alone: here they are counted
        counted = array("d", bytes(8 * points))
        for k in _restarts(array("d", columns[0])):
            counted[k:] = array("d", [counted[k] + 1]) * (points - k)
        columns.insert(1, counted.tobytes())
        names, types = [names[0], "step", *names[1:]], [types[0], "notype", *types[1:]]
        complex.insert(1, False)
    return _named(header, names, types, Columns(columns, complex=complex))


def _has_axis(names: Sequence[str], types: Sequence[str]) -> bool:
    from ..table import is_axis

    return bool(types) and (
        types[0] in ("time", "frequency") or is_axis(SWEEPS.get(names[0].lower(), names[0]))
    )


def _named(header: dict[str, list[str]], names: list[str], types: list[str], waves: Waves) -> Table:
    from ..analyses import ANALYSES, Axis
    from ..table import Table

    plotname = header.get("plotname", [""])[0]
    kind = next(
        (a.word for a in ANALYSES.values() if a.plotname.lower() == plotname.lower()), plotname.lower()
    )
    names = [SWEEPS.get(names[0].lower(), names[0]), *names[1:]]
    units, axis = [UNITS.get(t, "") for t in types], _has_axis(names, types)
    table = Table(kind, names, units, waves, title=header["title"][0], axis=axis, plotname=plotname)
    if "stepped" in header.get("flags", [""])[0].lower().split() and len(table):
        if table.axis is None:  # of operating points the first stepped quantity is the axis
            table = Table(
                kind, names, units, waves, title=table.title, axis=Axis(names[0], units[0]), plotname=plotname
            )
        table.steps = _steps(table)
    return table


def _restarts(x: Sequence[float]) -> list[int]:
    """Rows at which an axis begins anew."""
    sign = next((b - a for a, b in pairwise(x) if a != b), 1.0)
    return [k + 1 for k, (a, b) in enumerate(pairwise(x)) if (b - a) * sign < 0]


def _steps(table: Table) -> list[str]:
    """The columns behind the axis that hold still until it begins anew."""
    ends = [0, *_restarts(table.doubles(0)), len(table)]
    found = []
    for k, name in enumerate(table.names[1:], 1):
        if table.is_complex(k):
            break
        values = table.doubles(k)
        if any(min(values[a:b]) != max(values[a:b]) for a, b in pairwise(ends)):
            break
        found.append(name)
    # a signal that never changes is none of them
    while found and min(table.doubles(found[-1])) == max(table.doubles(found[-1])):
        found.pop()
    return found


class Mapped:
    """A column store: the records of float64 that begin where a file stands."""

    __slots__ = ("_file", "_map", "columns", "corners", "path", "rows", "size", "start", "steady")

    def __init__(self, file: IO[bytes], columns: int, path: str) -> None:
        import mmap

        self.start, self.columns, self.rows, self.path = file.tell(), columns, 0, path
        self._file = os.dup(file.fileno())
        self.size = os.fstat(self._file).st_size
        self._map = mmap.mmap(self._file, 0, access=mmap.ACCESS_READ)
        self.corners, self.steady = b"", ()

    def __del__(self) -> None:
        if hasattr(self, "_file"):
            os.close(self._file)

    def _whole(self, end: int) -> None:
        """Where somebody cut the file, its pages are no memory any more."""
        if os.fstat(self._file).st_size < min(end, self.size):
            raise OSError(f"{self.path} has become shorter since it was opened")

    def piece(self, start: int, end: int) -> bytes:
        self._whole(end)
        return self._map[start:end]

    def column(self, i: int, /) -> bytes:
        end = self.start + 8 * self.columns * self.rows
        self._whole(end)
        with memoryview(self._map) as whole, whole[self.start : end] as records, records.cast("d") as numbers:
            return numbers[i :: self.columns].tobytes()


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
