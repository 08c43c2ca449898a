"""Plots, the sets of vectors that commands work on, and their vectors.

A vector is called as in ngspice: `out` is v(out), `v1#branch` is i(v1). What no circuit has keeps the name of its column.
"""

from __future__ import annotations

import math
import re
import time

import numpy as np

from ..diagnostics import did_you_mean, suggest
from ..table import without_letter
from .errors import CommandError, Followed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from ..elaborate.steps import Change
    from ..table import Table

# unit -> the type of a vector that `display` names, and the words of `settype`
TYPES = {
    "V": "voltage", "A": "current", "s": "time", "Hz": "frequency", "C": "temp-sweep", "Ohm": "impedance", "S": "admittance",
    "W": "power", "rad": "phase", "deg": "phase", "dB": "decibel", "F": "capacitance", "Q": "charge",
    "V/sqrt(Hz)": "onoise-spectrum",
}  # fmt: skip
UNITS = {word: unit for unit, word in reversed(TYPES.items())}
# types of `settype` that are no unit
WORDS = frozenset(
    "voltage-density current-density sqr-voltage-density sqr-current-density sqr-voltage sqr-current pole zero s-param res-sweep "
    "output-noise input-noise onoise-integrated inoise-integrated".split()
)
SEEN = 1e-6  # of its size: a jump that is less needs no row of its own
CONSTANTS = {
    "boltz": 1.38064852e-23, "c": 299792458.0, "e": math.e, "echarge": 1.6021766208e-19, "false": 0.0, "i": 1j,
    "kelvin": -273.15, "no": 0.0, "pi": math.pi, "planck": 6.62607015e-34, "true": 1.0, "yes": 1.0,
}  # fmt: skip


class Vector:
    """Numbers under a name: `values` of shape (length,), float64 or complex128. `dims` is its shape where it has several,
    `scale` the vector that it is over where that is not its plot's. `derived`: an expression made it;
    `word`: a type that is no unit."""

    __slots__ = ("_values", "derived", "dims", "key", "name", "plot", "scale", "unit", "word")

    def __init__(
        self, name: str, values: np.ndarray | tuple[Table, int], unit: str = "", plot: Plot | None = None
    ) -> None:
        self.name, self.key, self.unit, self.plot = name, name.lower(), unit, plot
        self._values = values
        self.derived, self.word = False, ""
        self.dims: tuple[int, ...] = ()
        self.scale: Vector | None = None

    @property
    def values(self) -> np.ndarray:
        if isinstance(self._values, tuple):
            table, column = self._values
            self._values = (
                table.column(table.names[column])
                if table.index(table.names[column]) == column
                else _raw(table, column)
            )
        return self._values

    @property
    def is_complex(self) -> bool:
        return np.iscomplexobj(self.values)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def type(self) -> str:
        return self.word or ("notype" if self.derived else TYPES.get(self.unit, "notype"))

    @property
    def shown(self) -> str:
        """Its name in lists of all vectors: the node 1 is V(1) there, as in ngspice."""
        return f"V({self.name})" if self.key[:1].isdigit() and self.unit == "V" else self.name

    def copied(self, name: str, plot: Plot | None = None) -> Vector:
        v = Vector(name, self.values, self.unit, plot or self.plot)
        v.dims, v.scale, v.derived = self.dims, self.scale, self.derived
        return v


def _raw(table: Table, column: int) -> np.ndarray:
    kind = np.complex128 if table.is_complex(column) else np.float64
    return np.frombuffer(table.waves.column(column), dtype=kind)


class Plot:
    """Vectors of one analysis, or those that commands made.

    name      "tran1"; kind: "tran"; plotname: "Transient Analysis"; title: the deck's
    vectors   by their lower-case names; scale: what the others are over, None where there is nothing
    table     what an analysis gave
    beside    names of what commands read that ngspice has in no plot: recorded, and not among `all`
    failed    why there are no vectors, where an analysis was to give them
    family    plots of the same analysis for all values of .step, this one among them; changes: those values of this one
    """

    def __init__(self, name: str, kind: str, title: str, plotname: str, table: Table | None = None) -> None:
        self.name, self.kind, self.title, self.plotname, self.table = name, kind, title, plotname, table
        self.date = time.strftime("%a %b %d %H:%M:%S  %Y")
        self.vectors: dict[str, Vector] = {}
        self.scale: Vector | None = None
        self.failed = False
        self.beside: set[str] = set()
        self.family: list[Plot] = []
        self.changes: list[Change] = []
        self.has_scale = False
        self.shows_scale = True  # print puts it in front
        if table is None:
            return
        for k, (column, unit) in enumerate(zip(table.names, table.units, strict=True)):
            self.add(Vector(spelled(column), (table, k), unit, self))
        if table.axis is not None:
            self.scale, self.has_scale = self.vectors[spelled(table.names[0]).lower()], True
        elif self.vectors:
            self.scale = min(self.vectors.values(), key=lambda v: (v.key[0] == "@", v.key))

    def extend(self, table: Table) -> None:
        """Rows of a run that goes on, behind those of `table`; what commands have made stays as it is."""
        from ..store import Columns
        from ..table import Table

        own = self.table
        assert own is not None
        names = [n for n in own.names if n in table.names]
        last, times = own.column(names[0])[-1], np.array(table.column(names[0]))
        k = int(np.searchsorted(times, last, side="right"))  # rows where it was halted
        if k and any(not np.isclose(own.column(n)[-1], table.column(n)[k - 1], rtol=SEEN) for n in names):
            k -= 1  # what was altered has made it jump
            times[k] = np.nextafter(last, np.inf)
        columns = [times, *(table.column(n) for n in names[1:])]
        data = (
            np.concatenate((own.column(n), column[k:])).tobytes()
            for n, column in zip(names, columns, strict=True)
        )
        units = [own.units[own.index(n)] for n in names]
        made = Table(
            own.kind, names, units, Columns(data), title=own.title, axis=own.axis, plotname=own.plotname
        )
        made.stats, made.grid, made.status = table.stats, own.grid, table.status
        self.table = made
        for k, (column, unit) in enumerate(zip(names, units, strict=True)):
            self.add(Vector(spelled(column), (made, k), unit, self))

    def of_step(self, changes: Sequence[Change], family: list[Plot]) -> None:
        """Notes the values of .step that this is a run of: in its title, and as vectors where it has none of that name."""
        self.title += ": " + ", ".join(f"{step.column} = {value:g}" for step, value in changes)
        for step, value in changes:
            if step.column not in self.vectors and not self.failed:
                self.add(Vector(step.column, np.array([value]), step.unit, self))
                self.beside.add(step.column)
        family.append(self)
        self.family, self.changes = family, list(changes)

    def over(self, name: str, values: np.ndarray, unit: str, shown: bool = False) -> None:
        """Makes the vector that the others are over."""
        self.scale, self.has_scale, self.shows_scale = self.add(Vector(name, values, unit)), True, shown

    def add(self, v: Vector) -> Vector:
        v.plot = self
        self.vectors[v.key] = v
        if self.scale is not None and self.scale.key == v.key:
            self.scale = v
        return v

    def find(self, name: str) -> Vector | None:
        """A vector as people call it: out, v(out), v1#branch, i(v1), @r1[i]."""
        key = "".join(name.split()).lower()
        for spelling in (key, without_letter(key)):
            if (found := self.vectors.get(spelling)) is not None:
                return found
            if spelling[1:2] == "(" and spelling[-1] == ")" and spelling[0] in "vi":
                inner = spelling[2:-1] + ("" if spelling[0] == "v" else "#branch")
                if (found := self.vectors.get(inner)) is not None:
                    return found
        return None

    def listed(self) -> list[Vector]:
        """As `sorted`, numbers within names by their size: x9 before x10."""

        def place(v: Vector) -> list[tuple[str, int]]:
            parts = re.findall(r"\d+|\D", v.shown)
            return [("0", int(p)) if p.isdecimal() else (p, 0) for p in parts]

        return sorted(self.sorted(), key=place)

    def sorted(self) -> list[Vector]:
        return [self.vectors[k] for k in sorted(self.vectors) if k not in self.beside]


def spelled(column: str) -> str:
    """The name of a vector for a column: v(out) is `out`, i(v1) is `v1#branch`."""
    if column.startswith("v(") and column.endswith(")") and "," not in column:
        return column[2:-1]
    if column.startswith("i(") and column.endswith(")"):
        return column[2:-1] + "#branch"
    return column


class Plots:
    """All plots, the oldest first, and the current one."""

    def __init__(self) -> None:
        const = Plot("const", "const", "Constant values", "constants")
        for name, value in CONSTANTS.items():
            const.add(Vector(name, np.array([value])))
        const.date = ""
        self.all: list[Plot] = [const]
        self.const = self.current = const
        self.counter = 1

    def name_for(self, kind: str) -> str:
        """tran1: the first number, from the last one given on, that this kind has not."""
        names = {p.name for p in self.all}
        while f"{kind}{self.counter}" in names:
            self.counter += 1
        return f"{kind}{self.counter}"

    def new(self, kind: str, title: str, plotname: str, table: Table | None = None) -> Plot:
        plot = Plot(self.name_for(kind), kind, title, plotname, table)
        self.all.append(plot)
        self.current = plot
        return plot

    def named(self, name: str) -> Plot | None:
        return next((p for p in self.all if p.name == name.lower()), None)

    def get(self, name: str) -> Plot:
        found = self.named(name)
        if found is None:
            hint = did_you_mean(
                name, [p.name for p in self.all], "there are " + ", ".join(p.name for p in self.all)
            )
            raise CommandError("E162", f"there is no plot `{name}`", hint)
        return found

    def remove(self, plot: Plot) -> None:
        if plot is self.const:
            return
        self.all.remove(plot)
        if self.current is plot:
            self.current = self.all[-1]

    def vector(self, name: str) -> Vector:
        """A vector of the current plot, of a named one (tran1.v(out)), or a constant. Raises CommandError."""
        found = self.known(name)
        if found is None:
            raise self.missing(name)
        return found

    def known(self, name: str) -> Vector | None:
        if (found := self.current.find(name)) is not None:
            return found
        head, dot, rest = name.partition(".")
        if dot and (plot := self.named(head)) is not None:
            return plot.find(rest)
        return self.const.find(name)

    def missing(self, name: str) -> CommandError:
        head, dot, _ = name.partition(".")
        plot = (self.named(head) if dot else None) or self.current
        if plot.failed:
            return Followed("E162", f"`{plot.name}` has no vectors")
        shown = [v.name for v in plot.vectors.values()] if plot is not self.const else []
        near = suggest(name.lower(), [*shown, *(f"v({n})" for n in shown)])
        if near:
            hint = f"did you mean `{near}`?"
        elif plot is self.const and len(self.all) == 1:
            hint = "no analysis has run yet: run, op, tran .."
        else:
            hint = (
                f"{plot.name} has "
                + (", ".join(shown[:8]) or "no vectors")
                + (" .." if len(shown) > 8 else "")
            )
        return CommandError("E162", f"there is no vector `{name}` in {plot.name}", hint)

    def __iter__(self) -> Iterator[Plot]:
        return iter(self.all)


def table_of(plot: Plot) -> Table | None:
    """A plot as a table, with what commands added where it is as long as the rest, else aside of it; None where there are no
    numbers."""
    from ..store import Columns
    from ..table import Table

    own = plot.table
    listed = list(plot.vectors.values())
    if plot.scale is not None and plot.has_scale:
        listed = [plot.scale, *(v for v in listed if v is not plot.scale)]
    rows = len(own) if own is not None else len(listed[0]) if listed else 0
    if not rows:
        return None
    aside = {v.key: v.values for v in listed if len(v) != rows or v.dims}
    listed = [v for v in listed if len(v) == rows and not v.dims]
    theirs = () if own is None else {spelled(name).lower() for name in own.names}
    if own is not None and all(v.key in theirs for v in listed):
        own.aside = aside
        return own
    store = Columns((v.values.tobytes() for v in listed), complex=[v.is_complex for v in listed])
    names, units = [column_name(v, plot) for v in listed], [v.unit for v in listed]
    axis = own.axis if own is not None else plot.has_scale
    made = Table(plot.kind, names, units, store, title=plot.title, axis=axis, plotname=plot.plotname)
    made.aside = aside
    if own is not None:
        made.stats, made.grid, made.status = own.stats, own.grid, own.status
    return made


def column_name(v: Vector, plot: Plot) -> str:
    """The name of a vector in tables and files: v(out) for `out`, i(v1) for `v1#branch`."""
    own = plot.table
    if own is not None:
        for name in own.names:
            if spelled(name).lower() == v.key:
                return name
    if v.key.endswith("#branch"):
        return f"i({v.key[:-7]})"
    if (
        v.unit == "V"
        and not v.derived
        and v is not plot.scale
        and v.key.replace("_", "").replace(".", "").isalnum()
    ):
        return f"v({v.key})"
    return v.name
