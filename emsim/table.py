"""What one analysis computed: named columns with units. They stay the engine's own bytes until somebody asks for them, so that a
run which only writes its raw file never imports numpy."""

from __future__ import annotations

from .analyses import Axis, find
from .diagnostics import suggest
from .store import Columns

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Any

    import numpy as np
    import pandas as pd
    import xarray as xr

    from .store import Scene, Waves

GROUNDED = (",0)", ",gnd)")
PICKLED = ("title", "axis", "steps", "grid", "stats", "status", "plotname", "scene", "energy", "circuit")


class Table:
    """One analysis: columns of equal length, each with a name and a unit.

    kind     "tran", "op", ... ; title: the deck's; plotname: as raw files spell the analysis
    axis     of the independent variable, which is column 0: its name, unit, whether it is logarithmic; None: there is none
    names    of all columns, lower-case
    units    in the same order: "s", "V", "A", "rad", "N m", ...; "" where there is none
    waves    the column store, one column a name; `is_complex` tells which hold complex numbers
    steps    names of columns that hold still within each block of rows: outer loops of a sweep
    grid     (tstep, tstart, tstop) of a transient [s], for tables on the print grid
    stats    counters of the run: steps, rejected, newton iterations, ...
    energy   the ledger of what was supplied, stored and dissipated (reports/energy.py), where it was kept
    scene    the drawing of the machine with the columns that move it, where it was asked for
    circuit  the drawing of the circuit with its voltages and currents, likewise
    status   "ok", "failed" or "interrupted": whether the table reaches its end
    aside    vectors of another length that commands of .control made, by name: r["bw"]
    """

    __slots__ = (
        "_asked", "_complex", "_courses", "_index", "_numpy", "aside", "axis", "circuit", "energy", "grid", "kind", "names",
        "plotname", "scene", "stats", "status", "steps", "title", "units", "waves",
    )  # fmt: skip

    def __init__(
        self,
        kind: str,
        names: Sequence[str],
        units: Sequence[str],
        waves: Waves,
        *,
        title: str = "",
        axis: Axis | bool | None = True,
        steps: Sequence[str] = (),
        grid: tuple[float, float, float] | None = None,
        stats: dict[str, Any] | None = None,
        status: str = "ok",
        plotname: str = "",
        scene: Scene | None = None,
        energy: Any = None,
        circuit: Scene | None = None,
        courses: Sequence[Table] = (),
    ) -> None:
        if not len(names) == len(units) == waves.columns:
            raise ValueError(f"{len(names)} names and {len(units)} units for {waves.columns} columns")
        self.kind, self.title, self.plotname = kind, title, plotname or plotname_of(kind)
        self.names, self.units, self.steps = list(names), list(units), list(steps)
        self.waves, self.grid, self._courses = waves, grid, list(courses)
        self._complex = {k for k, z in enumerate(getattr(waves, "complex", ())) if z}
        if axis is True:
            axis = self._found_axis() if self.names else None
        self.axis: Axis | None = axis or None
        self.stats, self.status, self.scene, self.energy = dict(stats or {}), status, scene, energy
        self.circuit = circuit
        self.aside: dict[str, np.ndarray] = {}
        self._index: dict[str, int] = {}
        for k, name in enumerate(self.names):
            self._index.setdefault(_plain(name), k)
        self._numpy: dict[int, Any] = {}
        self._asked: dict[tuple[str | int, int], memoryview[float]] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles and copies hold plain bytes, wherever the columns came from."""
        waves = self.waves
        columns = Columns(
            (waves.column(k) for k in range(waves.columns)),
            waves.corners,
            waves.steady,
            getattr(waves, "complex", ()),
        )
        more = {name: getattr(self, name) for name in PICKLED}
        return _table, ((self.kind, self.names, self.units, columns), more, self.aside)

    @property
    def digital(self) -> list[tuple[float, str, str]]:
        """Changes of the digital nodes of a transient, in order: time [s], node, state (0s, 1r, Uz, ... as in XSPICE)."""
        found = getattr(self.waves, "digital", [])
        return [event for event in found if "#" not in event[1]]

    def corners(self, name: str | int | None = None) -> memoryview[float]:
        """Times of rows at which the run knows that a column may bend or jump, any column without a name; none for a
        table from a file."""
        steady = False
        if name is not None and self.waves.steady:
            names = (self._pair(name) or (name,)) if isinstance(name, str) else (name,)
            steady = all(self.waves.steady[k if isinstance(k, int) else self.index(k)] for k in names)
        return memoryview(b"" if steady else self.waves.corners).cast("d")

    # columns -----------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return self.waves.rows

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def _found_axis(self) -> Axis:
        """The axis of a table that does not tell: the first column; logarithmic where a frequency grows by ratios."""
        name, unit = self.names[0], self.units[0]
        return Axis(name, unit, name == "frequency" and _by_ratios(self.doubles(0)))

    def __contains__(self, name: object) -> bool:
        """A column, or an expression of columns."""
        try:
            return self.has_column(str(name)) or self._expression(str(name)) is not None
        except KeyError:
            return False

    def has_column(self, name: str) -> bool:
        try:
            for column in self._pair(str(name)) or (str(name),):
                self.index(column)
        except KeyError:
            return False
        return True

    def is_complex(self, name: str | int) -> bool:
        """Does a column hold complex numbers?"""
        if isinstance(name, str) and (pair := self._pair(name)):
            return any(map(self.is_complex, pair))
        return (name if isinstance(name, int) else self.index(name)) in self._complex

    def index(self, name: str) -> int:
        """Column number of a name. Case and blanks do not matter, `out` and `v(out,0)` mean `v(out)` as in ngspice, and
        `v1#branch` means `i(v1)`. Raises KeyError with the nearest name."""
        key = _plain(name)
        spellings = [key, f"v({key})"]
        if key.endswith(GROUNDED):
            spellings.append(key.rpartition(",")[0] + ")")
        if key.endswith("#branch"):
            spellings.append(f"i({key[:-7]})")
        for spelling in spellings:
            if spelling in self._index:
                return self._index[spelling]
        for spelling in map(without_letter, spellings):
            if spelling in self._index:
                return self._index[spelling]
        near = suggest(key, self.names)
        raise KeyError(f"no column {name!r}" + (f", did you mean {near!r}?" if near else ""))

    def spelled(self, name: str) -> str:
        """A name as the table writes it."""
        return _plain(name) if self._pair(name) else self.names[self.index(name)]

    def floats(self, name: str | int) -> array[float]:
        """A column as an array of doubles, without numpy."""
        from array import array

        values = array("d")
        values.frombytes(self.doubles(name).cast("B"))
        return values

    def doubles(self, name: str | int) -> memoryview[float]:
        """The column's own memory; the module `array` costs a millisecond to import."""
        if isinstance(name, str) and (pair := self._pair(name)) and not self.is_complex(name):
            from array import array

            a, b = map(self.doubles, pair)
            return memoryview(array("d", (x - y for x, y in zip(a, b, strict=True))))
        if isinstance(name, str) and not self.has_column(name):
            values = self[name]
            if values.dtype.kind == "c":
                raise ValueError(f"{name} is complex: ask for re(), im(), mag(), db() or ph() of it")
            return memoryview(values.tobytes()).cast("d")
        if self.is_complex(name):
            raise ValueError(f"{name} is complex: ask for re(), im(), mag(), db() or ph() of it")
        k = name if isinstance(name, int) else self.index(name)
        return memoryview(self.waves.column(k)).cast("d")

    def parts(self, name: str | int) -> tuple[memoryview[float], memoryview[float]]:
        """Real and imaginary parts of a column, without numpy."""
        from array import array

        if isinstance(name, str) and (pair := self._pair(name)):
            (a, b), (c, d) = map(self.parts, pair)
            parts = [array("d", (x - y for x, y in zip(*p, strict=True))) for p in ((a, c), (b, d))]
            return memoryview(parts[0]), memoryview(parts[1])
        if isinstance(name, str) and not self.has_column(name):
            values = self[name]
            return memoryview(values.real.tobytes()).cast("d"), memoryview(values.imag.tobytes()).cast("d")
        if not self.is_complex(name):
            return self.doubles(name), memoryview(array("d", bytes(8 * len(self))))
        k = name if isinstance(name, int) else self.index(name)
        both = memoryview(self.waves.column(k)).cast("d")
        return both[::2], both[1::2]

    def pairs(self, name: str | int) -> bytes:
        """A complex column: real and imaginary part of each number, without numpy."""
        if isinstance(name, int) or not self._pair(name):
            return self.waves.column(name if isinstance(name, int) else self.index(name))
        from array import array

        return array("d", (part for both in zip(*self.parts(name), strict=True) for part in both)).tobytes()

    def flat(self) -> list[tuple[str, str, memoryview[float]]]:
        """(name, unit, numbers) of the columns, for what knows real numbers alone: a complex one is re(name) and im(name)."""
        found: list[tuple[str, str, memoryview[float]]] = []
        for k, (name, unit) in enumerate(zip(self.names, self.units, strict=True)):
            if self.is_complex(k):
                re, im = self.parts(k)
                found += [(f"re({name})", unit, re), (f"im({name})", unit, im)]
            else:
                found.append((name, unit, self.doubles(k)))
        return found

    def _pair(self, name: str) -> tuple[str, str] | None:
        """The columns whose difference `v(a,b)` is, where no column has that name."""
        key = _plain(name)
        if key in self._index or not key.startswith("v(") or key.count(",") != 1 or key.endswith(GROUNDED):
            return None
        a, b = key[2:-1].split(",")
        return f"v({a})", f"v({b})"

    def __getitem__(self, name: str) -> np.ndarray:
        """A column as float64 (or complex128) array of shape (len(table),); read-only. `v(a,b)` is v(a) - v(b). What is no
        column is an expression of columns, as --plot takes it: r["db(v(out)/v(in))"]; a vector of
        `aside` has a length of its own."""
        try:
            return self.column(name)
        except KeyError:
            if (beside := self.aside.get(_plain(name))) is not None:
                return beside
            ast = self._expression(name)
            if ast is None:
                raise
        from .signals import evaluate

        return evaluate(self, ast)[0]

    def column(self, name: str) -> np.ndarray:
        """The same of columns alone, and of differences of two."""
        if pair := self._pair(name):
            return self.column(pair[0]) - self.column(pair[1])
        k = self.index(name)
        if k not in self._numpy:
            import numpy as np

            kind = np.complex128 if k in self._complex else np.float64
            self._numpy[k] = np.frombuffer(self.waves.column(k), dtype=kind)
        return self._numpy[k]

    def _expression(self, name: str) -> Any:
        """The tree of an expression whose every name is a column; None where the text is none, or is a plain name."""
        if not isinstance(name, str):
            return None
        from .build import parse_signals
        from .diagnostics import DeckError
        from .expr import Name

        try:
            asked = parse_signals(name)
        except DeckError:
            return None
        ast = asked[0].ast if len(asked) == 1 else None
        if ast is None or isinstance(ast, Name):
            return None
        from .columns import check

        return ast if check(self, ast) else None

    @property
    def time(self) -> np.ndarray:
        """The time points [s]; KeyError where the analysis has none."""
        return self.column("time")

    def unit(self, name: str) -> str:
        if not self.has_column(name) and (ast := self._expression(name)) is not None:
            from .signals import evaluate

            return evaluate(self, ast)[1]
        return self.column_unit(name)

    def column_unit(self, name: str) -> str:
        pair = self._pair(name)
        return self.units[self.index(pair[0] if pair else name)]

    def blocks(self) -> list[tuple[int, int]]:
        """Rows (first, behind the last) of each block of a sweep within sweeps: where an outer variable changes, another
        begins. One block where there are no steps."""
        n, outer = len(self), [self.doubles(name) for name in self.steps]
        if not outer:
            return [(0, n)] if n else []
        starts = [0, *(k for k in range(1, n) if any(c[k] != c[k - 1] for c in outer))] if n else []
        return list(zip(starts, [*starts[1:], n], strict=True))

    def courses(self) -> list[Table]:
        """Each course of a sweep within sweeps as a table of its own, without the columns that hold still in it: [self] where
        there are no steps. Of a deck with .step these are its single runs."""
        if self._courses or not self.steps:
            return self._courses or [self]
        kept = [k for k, name in enumerate(self.names) if name not in self.steps]
        names, units = [self.names[k] for k in kept], [self.units[k] for k in kept]
        columns = [(self.waves.column(k), 16 if self.is_complex(k) else 8, self.is_complex(k)) for k in kept]
        return [
            Table(
                self.kind, names, units, Columns((c[w * a : w * b] for c, w, _ in columns), complex=[z for _, _, z in columns]),
                title=self.title, axis=self.axis, grid=self.grid, status=self.status, plotname=self.plotname,
            )
            for a, b in self.blocks()
        ]  # fmt: skip

    @property
    def is_stepped(self) -> bool:
        """Are its courses single runs of a deck with .step, to be told apart in tables and pictures?"""
        return bool(self._courses) or (bool(self.steps) and self.kind != "dc")

    def step_values(self) -> list[dict[str, float]]:
        """The values of `steps` in each course."""
        outer = {name: self.doubles(name) for name in self.steps}
        return [{name: values[a] for name, values in outer.items()} for a, _ in self.blocks()]

    @property
    def axis_unit(self) -> str:
        return self.axis.unit if self.axis else ""

    def axis_values(self) -> np.ndarray:
        """The axis; the numbers of the rows where there is none."""
        import numpy as np

        return self.column(self.names[0]) if self.axis else np.arange(float(len(self)))

    @property
    def smooth(self) -> bool:
        """Do columns go on smoothly between their points, as what an analysis computes over time does?"""
        analysis = find(self.kind)
        return analysis is not None and analysis.axis is not None and analysis.axis.name == "time"

    @property
    def signals(self) -> list[str]:
        """Names without the independent column."""
        return self.names[1:] if self.axis else list(self.names)

    def at(self, name: str, t: float | Sequence[float] | np.ndarray) -> Any:
        """A column between its points: float for a float, array for an array; t in seconds.

        A limited cubic through the four recorded points around t, see interpolate.py. At a jump (two points
        at one time) the value after the jump is taken. Outside the run: ValueError.
        """
        if not isinstance(t, (int, float)):
            import numpy as np

            from .interpolate import cubic_many

            query = np.asarray(t, dtype=float)
            self._check_range(float(query.min()), float(query.max())) if query.size else None
            x, y = self[self.names[0]], self[name]
            corners = self.corners(name if self.has_column(name) else None)
            if y.dtype.kind == "c":
                re, im = (cubic_many(x, part, query, corners) for part in (y.real, y.imag))
                return re + 1j * im
            return cubic_many(x, y, query, corners)
        if self.is_complex(name) if self.has_column(name) else self[name].dtype.kind == "c":
            return complex(self.at(name, [t])[0])
        return self.sample(name, [t])[0]

    def sample(self, name: str | int, times: Sequence[float]) -> array[float]:
        """`at` without numpy: the column at each of the times."""
        from array import array

        return array("d", self.samples(name, times))

    def samples(self, name: str | int, times: Sequence[float]) -> list[float]:
        """The same as a list."""
        from .interpolate import doubles

        found: memoryview[float] = memoryview(self.samples_of(name, doubles(times))).cast("d")
        return list(found)

    def samples_of(self, name: str | int, times: bytes) -> bytes:
        """The same as the engine has numbers: float64."""
        from ._engine import interpolated

        asked = memoryview(times).cast("d")
        if asked:
            self._check_range(min(asked), max(asked))
        corners = self.corners(name if isinstance(name, int) or self.has_column(name) else None)
        x, y = self._held(0).tobytes(), self._held(name).tobytes()
        return interpolated(x, y, times, corners.tobytes()) if asked else b""

    def _held(self, name: str | int) -> memoryview[float]:
        """A column that is asked for place by place: the last few are kept, each is a copy of the engine's."""
        key = (name, len(self))
        found = self._asked.get(key)
        if found is None:
            if len(self._asked) > 3:
                self._asked.clear()
            found = self._asked[key] = self.doubles(name)
        return found

    def _check_range(self, low: float, high: float) -> None:
        if not self.axis or not len(self):
            raise ValueError(f"{self.plotname!r} has no points to look between")
        if self.steps:
            raise ValueError(f"{self.plotname!r} has several courses, one for each {', '.join(self.steps)}")
        x = self._held(0)
        rounding = 1e-12 * (x[-1] - x[0])
        if not (x[0] - rounding <= low and high <= x[-1] + rounding):
            asked = high if low >= x[0] - rounding else low
            raise ValueError(f"asked for {self.names[0]} = {asked:g}, outside {x[0]:g} .. {x[-1]:g}")

    def extended(self, columns: Iterable[tuple[str, str, Any]]) -> Table:
        """The same with further columns: name, unit ("" where the expression tells), tree of the expression."""
        from .signals import evaluate

        waves = self.waves
        complex = [self.is_complex(k) for k in range(waves.columns)]
        data, names, units = [waves.column(k) for k in range(waves.columns)], [*self.names], [*self.units]
        for name, unit, ast in columns:
            values, own = evaluate(self, ast)
            data.append(values.tobytes())
            names.append(name)
            units.append(unit or own)
            complex.append(values.dtype.kind == "c")
        steady = [*waves.steady, *(False for _ in names[len(self.names) :])] if waves.steady else []
        store = Columns(data, waves.corners, steady, complex)
        return Table(
            self.kind, names, units, store, title=self.title, axis=self.axis, steps=self.steps, grid=self.grid,
            stats=self.stats, status=self.status, plotname=self.plotname, scene=self.scene, energy=self.energy,
            circuit=self.circuit,
        )  # fmt: skip

    def fft(
        self, *signals: str, window: str = "hann", points: int | None = None, start: float | None = None,
        stop: float | None = None,
    ) -> Table:  # fmt: skip
        """The spectra of signals (columns or expressions) of a transient: a table over frequency of complex amplitudes, columns
        `fft(v(out))`, so that a sine of 2 V is a line of 2 V. `window`: none hann hamming blackman flattop; `points` equally
        spaced ones are taken between start and stop [s], left out: a power of two, as many as there are rows at least.

        ValueError where the table is not one course over time, a signal is complex, or there is no such window."""
        import numpy as np

        from .spectrum import WINDOWS, amplitudes

        if not self.axis or self.axis.name != "time" or self.steps or len(self) < 2:
            raise ValueError(f"{self.plotname!r} is not one course over time")
        if window not in WINDOWS:
            raise ValueError(f"there is no window {window!r}: {', '.join(WINDOWS)}")
        x = self.doubles(0)
        begin, end = x[0] if start is None else start, x[-1] if stop is None else stop
        n = points or min(max(1 << (len(self) - 1).bit_length(), 1024), 1 << 20)
        at = begin + (end - begin) * np.arange(n) / n
        columns: list[bytes] = []
        names, units = ["frequency"], ["Hz"]
        for signal in signals or self.signals:
            y = self.at(signal, at)
            if np.iscomplexobj(y):
                raise ValueError(f"{signal} is complex")
            f, z = amplitudes(y, (end - begin) / n, window)
            columns = columns or [f.tobytes()]
            columns.append(z.tobytes())
            names.append(f"fft({_plain(signal)})")
            units.append(self.unit(signal))
        store = Columns(columns, complex=[False, *(True for _ in names[1:])])
        axis = Axis("frequency", "Hz")
        return Table("fft", names, units, store, title=self.title, axis=axis, plotname="Spectrum")

    # conversions -------------------------------------------------------------------------------------

    def to_pandas(self) -> pd.DataFrame:
        """DataFrame indexed by the independent column; `attrs["units"]` maps name to unit."""
        from .frames import pandas

        return pandas(self)

    def to_xarray(self) -> xr.Dataset:
        """Dataset with the independent column as coordinate, of a sweep within sweeps with a dimension for each step where every
        block has the same points; every variable carries `units`."""
        from .frames import xarray

        return xarray(self)

    def _repr_html_(self) -> str:
        """For notebooks: what __repr__ says, as a table."""
        from . import tabular

        return tabular.table(self)

    def __repr__(self) -> str:
        """Each column with unit, smallest, largest and last value; at most 20 of them."""
        points = "1 point" if len(self) == 1 else f"{len(self)} points"
        head = f"{self.plotname}: {points}" + ("" if self.status == "ok" else f" ({self.status})")
        lines = [head]
        shown = [f"|{name}|" if self.is_complex(k) else name for k, name in enumerate(self.names[:20])]
        width = max((len(name) for name in shown), default=0)
        if len(self) == 1:
            for k, name in enumerate(shown):
                lines.append(f"  {name:<{width}}  {self._sizes(k)[0]:>12.6g} {self.units[k]}")
        elif len(self):
            lines.append(f"  {'':<{width}}  {'min':>12} {'max':>12} {'last':>12}")
            for k, name in enumerate(shown):
                c = self._sizes(k)
                numbers = f"{min(c):>12.5g} {max(c):>12.5g} {c[-1]:>12.5g}"
                lines.append(f"  {name:<{width}}  {numbers} {self.units[k]}")
        if len(self.names) > len(shown):
            lines.append(f"  ... and {len(self.names) - len(shown)} more")
        return "\n".join(line.rstrip() for line in lines)

    def _sizes(self, k: int) -> Sequence[float]:
        """A column, of complex numbers their magnitudes."""
        if not self.is_complex(k):
            return self.floats(k)
        return [abs(complex(re, im)) for re, im in zip(*self.parts(k), strict=True)]


def _table(given: tuple[Any, ...], more: dict[str, Any], aside: dict[str, np.ndarray]) -> Table:
    """A table from its parts, for unpickling."""
    made = Table(*given, **more)
    made.aside = dict(aside)
    return made


def plotname_of(kind: str) -> str:
    """How raw files spell an analysis."""
    analysis = find(kind)
    return analysis.plotname if analysis else kind


def is_axis(name: str) -> bool:
    """Does a column of this name stand first because the others are over it? For files that do not tell."""
    return name in ("time", "frequency") or name.endswith("-sweep")


def kind_of(names: Sequence[str]) -> str:
    """The analysis that a file without a word about it holds, by the name of its axis."""
    known = {"time": "tran", "frequency": "ac"}
    return known.get(names[0], "dc" if is_axis(names[0]) else "") if names else ""


def _by_ratios(x: Sequence[float]) -> bool:
    """Do the points lie by equal ratios rather than by equal distances?"""
    if len(x) < 3 or not x[0] > 0 or not x[-1] > x[0]:
        return False
    middle = x[len(x) // 2]
    return middle < 0.75 * (x[0] + x[-1]) / 2


def without_letter(name: str) -> str:
    """i(x1.v1) for i(v.x1.v1), as ngspice calls what is inside a subcircuit."""
    import re

    return re.sub(r"(^|[(@])[a-z]\.(?=[^.()]+\.)", r"\1", name)


def _plain(name: str) -> str:
    if not isinstance(name, str):
        raise TypeError(f"columns have names, as in result['v(out)']; {name!r} is none")
    return "".join(name.split()).lower()
