"""Results: named columns with units, one table per analysis.

A `Table` is what one analysis computed; a `Result` is a deck's run: its tables, its diagnostics, its
statistics. Columns stay the engine's own bytes until somebody asks for them, so that a run which only
writes its raw file never imports numpy.
"""

from __future__ import annotations

from .diagnostics import suggest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from array import array
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from os import PathLike
    from typing import Any, Protocol

    import numpy as np
    import pandas as pd
    import xarray as xr

    from .diagnostics import Diagnostic
    from .outputs.picture import Picture

    class Waves(Protocol):
        """The duty of a column store: the engine's Waveforms, or `Columns` below."""

        @property
        def rows(self) -> int: ...
        @property
        def columns(self) -> int: ...
        @property
        def corners(self) -> bytes: ...  # times, float64 too
        @property
        def steady(self) -> Sequence[bool]: ...  # columns that no corner bends
        def column(self, i: int, /) -> bytes: ...  # float64, native order


GROUNDED = (",0)", ",gnd)")
PLOTNAMES = {"tran": "Transient Analysis", "op": "Operating Point"}


class Columns:
    """A column store in plain Python: for tables that were read from a file or made by hand."""

    __slots__ = ("_data", "columns", "corners", "rows", "steady")

    def __init__(
        self, data: Iterable[bytes | Sequence[float]], corners: bytes = b"", steady: Sequence[bool] = ()
    ) -> None:
        from array import array

        self._data = [c if isinstance(c, bytes) else array("d", c).tobytes() for c in data]
        self.columns, self.corners, self.steady = len(self._data), corners, steady
        self.rows = len(self._data[0]) // 8 if self._data else 0

    def column(self, i: int, /) -> bytes:
        return self._data[i]

    def __reduce__(self) -> tuple[Any, ...]:
        return Columns, (self._data, self.corners, self.steady)


class Scene:
    """The drawing of a machine (assemble/drawing.py) and the columns that move it, beside a table's time."""

    __slots__ = ("data", "waves")

    def __init__(self, data: dict[str, Any], waves: Waves) -> None:
        self.data, self.waves = data, waves

    def __reduce__(self) -> tuple[Any, ...]:
        return Scene, (self.data, Columns(self.waves.column(k) for k in range(self.waves.columns)))


class Table:
    """One analysis: columns of equal length, each with a name and a unit.

    kind     "tran", "op", ... ; title: the deck's; plotname: as raw files spell the analysis
    names    of all columns, lower-case; with `axis` True, column 0 is the independent one ("time")
    units    in the same order: "s", "V", "A", "rad", "N m", ...; "" where there is none
    waves    the column store, one column a name
    grid     (tstep, tstart, tstop) of a transient [s], for tables on the print grid
    stats    counters of the run: steps, rejected, newton iterations, ...
    energy   the ledger of what was supplied, stored and dissipated (reports/energy.py), where it was kept
    scene    the drawing of the machine with the columns that move it, where it was asked for
    status   "ok", "failed" or "interrupted": whether the table reaches its end
    """

    __slots__ = (
        "_index", "_numpy", "axis", "energy", "grid", "kind", "names", "plotname", "scene", "stats", "status", "title",
        "units", "waves",
    )  # fmt: skip

    def __init__(
        self,
        kind: str,
        names: Sequence[str],
        units: Sequence[str],
        waves: Waves,
        *,
        title: str = "",
        axis: bool = True,
        grid: tuple[float, float, float] | None = None,
        stats: dict[str, Any] | None = None,
        status: str = "ok",
        plotname: str = "",
        scene: Scene | None = None,
        energy: Any = None,
    ) -> None:
        if not len(names) == len(units) == waves.columns:
            raise ValueError(f"{len(names)} names and {len(units)} units for {waves.columns} columns")
        self.kind, self.title, self.plotname = kind, title, plotname or PLOTNAMES.get(kind, kind)
        self.names, self.units = list(names), list(units)
        self.waves, self.axis, self.grid = waves, axis, grid
        self.stats, self.status, self.scene, self.energy = dict(stats or {}), status, scene, energy
        self._index: dict[str, int] = {}
        for k, name in enumerate(self.names):
            self._index.setdefault(_plain(name), k)
        self._numpy: dict[int, Any] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles and copies hold plain bytes, wherever the columns came from."""
        waves = self.waves
        columns = Columns((waves.column(k) for k in range(waves.columns)), waves.corners, waves.steady)
        given = (self.kind, self.names, self.units, columns, self.title, self.axis, self.grid)
        return _table, (*given, self.stats, self.status, self.plotname, self.scene, self.energy)

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

    def __contains__(self, name: object) -> bool:
        try:
            for column in self._pair(str(name)) or (str(name),):
                self.index(column)
        except KeyError:
            return False
        return True

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
        near = suggest(key, self.names)
        raise KeyError(f"no column {name!r}" + (f", did you mean {near!r}?" if near else ""))

    def spelled(self, name: str) -> str:
        """A name as the table writes it."""
        return _plain(name) if self._pair(name) else self.names[self.index(name)]

    def floats(self, name: str | int) -> array[float]:
        """A column as an array of doubles, without numpy."""
        from array import array

        values = array("d")
        values.frombytes(self.waves.column(name if isinstance(name, int) else self.index(name)))
        return values

    def doubles(self, name: str | int) -> memoryview[float]:
        """The column's own memory; the module `array` costs a millisecond to import."""
        if isinstance(name, str) and (pair := self._pair(name)):
            from array import array

            a, b = map(self.doubles, pair)
            return memoryview(array("d", (x - y for x, y in zip(a, b, strict=True))))
        k = name if isinstance(name, int) else self.index(name)
        return memoryview(self.waves.column(k)).cast("d")

    def _pair(self, name: str) -> tuple[str, str] | None:
        """The columns whose difference `v(a,b)` is, where no column has that name."""
        key = _plain(name)
        if key in self._index or not key.startswith("v(") or key.count(",") != 1 or key.endswith(GROUNDED):
            return None
        a, b = key[2:-1].split(",")
        return f"v({a})", f"v({b})"

    def __getitem__(self, name: str) -> np.ndarray:
        """A column as float64 array of shape (len(table),); read-only. `v(a,b)` is v(a) - v(b)."""
        if pair := self._pair(name):
            return self[pair[0]] - self[pair[1]]
        k = self.index(name)
        if k not in self._numpy:
            import numpy as np

            self._numpy[k] = np.frombuffer(self.waves.column(k), dtype=np.float64)
        return self._numpy[k]

    @property
    def time(self) -> np.ndarray:
        """The time points [s]; KeyError where the analysis has none."""
        return self["time"]

    def unit(self, name: str) -> str:
        pair = self._pair(name)
        return self.units[self.index(pair[0] if pair else name)]

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
            return cubic_many(self[self.names[0]], self[name], query, self.corners(name))
        return self.sample(name, [t])[0]

    def sample(self, name: str | int, times: Sequence[float]) -> array[float]:
        """`at` without numpy: the column at each of the times."""
        from array import array

        return array("d", self.samples(name, times))

    def samples(self, name: str | int, times: Sequence[float]) -> list[float]:
        """The same as a list."""
        from .interpolate import cubic

        if times:
            self._check_range(min(times), max(times))
        x, y = self.doubles(0), self.doubles(name)
        corners = self.corners(name)
        return [cubic(x, y, t, corners) for t in times]

    def _check_range(self, low: float, high: float) -> None:
        if not self.axis or not len(self):
            raise ValueError(f"{self.plotname!r} has no points to look between")
        x = self.doubles(0)
        rounding = 1e-12 * (x[-1] - x[0])
        if not (x[0] - rounding <= low and high <= x[-1] + rounding):
            asked = high if low >= x[0] - rounding else low
            raise ValueError(f"asked for {self.names[0]} = {asked:g}, outside {x[0]:g} .. {x[-1]:g}")

    # conversions -------------------------------------------------------------------------------------

    def to_pandas(self) -> pd.DataFrame:
        """DataFrame indexed by the independent column; `attrs["units"]` maps name to unit."""
        import pandas as pd

        index = pd.Index(self[self.names[0]], name=self.names[0]) if self.axis else None
        frame = pd.DataFrame({name: self[name] for name in self.signals}, index=index)
        frame.attrs.update(title=self.title, units=dict(zip(self.names, self.units, strict=True)))
        return frame

    def to_xarray(self) -> xr.Dataset:
        """Dataset with the independent column as coordinate; every variable carries `units`."""
        import xarray as xr

        dim = self.names[0] if self.axis else "point"
        unit = dict(zip(self.names, self.units, strict=True))
        coords = {dim: (dim, self[dim], {"units": unit[dim]})} if self.axis else {}
        data = {name: (dim, self[name], {"units": unit[name]}) for name in self.signals}
        return xr.Dataset(data, coords=coords, attrs={"title": self.title, "analysis": self.kind})

    def _repr_html_(self) -> str:
        """For notebooks: what __repr__ says, as a table."""
        from .outputs import notebook

        return notebook.table(self)

    def __repr__(self) -> str:
        """Each column with unit, smallest, largest and last value; at most 20 of them."""
        points = "1 point" if len(self) == 1 else f"{len(self)} points"
        head = f"{self.plotname}: {points}" + ("" if self.status == "ok" else f" ({self.status})")
        lines = [head]
        shown = self.names[:20]
        width = max((len(name) for name in shown), default=0)
        if len(self) == 1:
            for k, name in enumerate(shown):
                lines.append(f"  {name:<{width}}  {self.floats(k)[0]:>12.6g} {self.units[k]}")
        elif len(self):
            lines.append(f"  {'':<{width}}  {'min':>12} {'max':>12} {'last':>12}")
            for k, name in enumerate(shown):
                c = self.floats(k)
                numbers = f"{min(c):>12.5g} {max(c):>12.5g} {c[-1]:>12.5g}"
                lines.append(f"  {name:<{width}}  {numbers} {self.units[k]}")
        if len(self.names) > len(shown):
            lines.append(f"  ... and {len(self.names) - len(shown)} more")
        return "\n".join(line.rstrip() for line in lines)


class Result:
    """What `emsim.run` returns.

    plots        all tables in the order in which they ran; `table("op")` finds one by its kind
    diagnostics  warnings and notes, in deck order, and what ended a run before its time
    prints       what .print asked for: (kind, column names)
    deck         the text that was run, "" for a result that was read from a file
    Everything a Table offers is offered here too, of the main table: the last transient, else the last.
    """

    __slots__ = ("deck", "diagnostics", "plots", "prints", "title")

    def __init__(
        self,
        title: str,
        plots: Sequence[Table],
        diagnostics: Sequence[Diagnostic] = (),
        prints: Sequence[tuple[str, list[str]]] = (),
        deck: str = "",
    ) -> None:
        self.title, self.plots, self.deck = title, list(plots), deck
        self.diagnostics, self.prints = list(diagnostics), list(prints)

    @property
    def main(self) -> Table:
        """The last transient, or else the last table. ValueError when nothing ran."""
        if not self.plots:
            raise ValueError("no analysis ran, so there are no columns")
        return next((p for p in reversed(self.plots) if p.kind == "tran"), self.plots[-1])

    def table(self, kind: str) -> Table:
        """The last table of a kind ("op", "tran"); KeyError if that analysis did not run."""
        for table in reversed(self.plots):
            if table.kind == kind:
                return table
        raise KeyError(f"no {kind!r} ran; there is {', '.join(p.kind for p in self.plots) or 'nothing'}")

    @property
    def status(self) -> str:
        """ "ok", or the first trouble among the tables: "failed", "interrupted"."""
        return next((p.status for p in self.plots if p.status != "ok"), "ok")

    def __getitem__(self, name: str) -> np.ndarray:
        return self.main[name]

    def __contains__(self, name: object) -> bool:
        return bool(self.plots) and name in self.main

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.main)

    @property
    def names(self) -> list[str]:
        return self.main.names

    @property
    def signals(self) -> list[str]:
        return self.main.signals

    @property
    def units(self) -> dict[str, str]:
        """name -> unit of the main table."""
        return dict(zip(self.main.names, self.main.units, strict=True))

    @property
    def time(self) -> np.ndarray:
        return self.main.time

    @property
    def energy(self) -> Any:
        """The energy ledger of the main table, or None where none was kept."""
        return self.main.energy

    @property
    def analysis(self) -> str:
        return self.main.kind

    @property
    def stats(self) -> dict[str, Any]:
        return self.main.stats

    def unit(self, name: str) -> str:
        return self.main.unit(name)

    def at(self, name: str, t: float | Sequence[float] | np.ndarray) -> Any:
        return self.main.at(name, t)

    def to_pandas(self) -> pd.DataFrame:
        return self.main.to_pandas()

    def to_xarray(self) -> xr.Dataset:
        return self.main.to_xarray()

    def save(self, path: str | PathLike[str], **options: Any) -> None:
        """Writes a file in the format of its extension: .raw (ascii=True for text), .csv (units=True for a
        line of units), .txt, .parquet, .nc, .html (the page). ValueError for any other, OutsideError where it
        cannot be written."""
        from .outputs import save  # the one import that looks upward, and only when called

        save(self, path, **options)

    def plot(
        self, *signals: str, degrees: bool | None = None, start: float | None = None, stop: float | None = None,
        width: int = 1080,
    ) -> Picture:  # fmt: skip
        """A matplotlib Figure of signals, a panel a unit: plot("v(out) i(v1)"), plot("omega(hinge) vs angle(hinge)").

        Each argument is a list of signals or expressions as .print takes them; none: what .print asks for. `degrees`
        shows rad as deg; left out: where the deck writes degrees. `start`, `stop` [s] cut the axis. `width` in pixels.
        DeckError for signals that are not there, OutsideError without matplotlib."""
        from .outputs import html, panels, picture

        asked = signals or (" ".join(html.shown(self, self.main)),)
        angles = panels.writes_degrees(self.deck) if degrees is None else degrees
        return picture.picture(panels.panels(self.main, asked, angles, start, stop), self.title, width)

    def _repr_html_(self) -> str:
        """For notebooks: a table of the signals, and the page."""
        from .outputs import notebook

        return notebook.result(self)

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, Any]:
        """Text and HTML; a PNG only where it is asked for, since drawing it takes longer than most runs."""
        makers: dict[str, Callable[[], Any]] = {"text/plain": self.__repr__, "text/html": self._repr_html_}
        if include and "image/png" in include and self.plots and len(self.main) > 1:
            makers["image/png"] = lambda: self.plot()._repr_png_()
        return {
            kind: make()
            for kind, make in makers.items()
            if not (include and kind not in include) and not (exclude and kind in exclude)
        }

    def __repr__(self) -> str:
        return "\n".join([self.title, *(map(repr, self.plots) if self.plots else ["(nothing ran)"])])


def _table(
    kind: str, names: list[str], units: list[str], waves: Waves, title: str, axis: bool,
    grid: tuple[float, float, float] | None, stats: dict[str, Any], status: str, plotname: str, scene: Scene | None, energy: Any,
) -> Table:  # fmt: skip
    """A table from its parts in order, for unpickling."""
    return Table(
        kind, names, units, waves, title=title, axis=axis, grid=grid, stats=stats, status=status,
        plotname=plotname, scene=scene, energy=energy,
    )  # fmt: skip


def _plain(name: str) -> str:
    if not isinstance(name, str):
        raise TypeError(f"columns have names, as in result['v(out)']; {name!r} is none")
    return "".join(name.split()).lower()
