"""What an analysis is: one class in one file of this folder, and its line in `ANALYSES` (analyses/__init__.py).

The duties of an author, in the order in which they are asked for:

 1. `word`, `form`, `meaning`   the dot card: its name, how it is written, what it computes
 2. `read(card, sink)`          the card's arguments, checked; None after an error, which the sink has
 3. `times()`                   the (tstep, tstop) [s] that waveforms refer to where they leave times out; a period behind them
 4. `columns(ctx)`              what is recorded; the default: what .save and .print ask for
 5. `run(assembly, progress)`   the computation
 6. `axis`, `complex`           what its table is like: over what, of complex numbers or not; writers and pictures
                                ask the table and never the kind
 7. `names_itself`              where columns are its own (onoise_r1) rather than signals of the deck; `tables`, `shown`: kinds of
                                its tables, where there are several, and which of them are printed without .print
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import isfinite

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, ClassVar, Self

    from .._engine import Waveforms
    from ..assemble import Assembly, Context, Output
    from ..deck import Analysis as Card
    from ..diagnostics import Diagnostic, Sink
    from .points import Points

    Progress = Callable[[float, float, float, int, int], object]

POINT = 200  # bytes of a point of Python's while it is computed: its number, the pair or list that the engine reads, its answer


class Axis:
    """The independent variable of a table: its name, its unit, and whether equal ratios are equal distances."""

    __slots__ = ("log", "name", "unit")

    def __init__(self, name: str, unit: str, log: bool = False) -> None:
        self.name, self.unit, self.log = name, unit, log

    def __eq__(self, other: object) -> bool:
        same = isinstance(other, Axis)
        return same and (self.name, self.unit, self.log) == (other.name, other.unit, other.log)  # type: ignore[attr-defined]

    def __hash__(self) -> int:
        return hash((self.name, self.unit, self.log))

    def __repr__(self) -> str:
        return f"{self.name} [{self.unit}]" + (" log" if self.log else "")

    def __reduce__(self) -> tuple[Any, ...]:
        return Axis, (self.name, self.unit, self.log)


class Part:
    """`columns` of the engine's columns, from `first` on: without the time where there is no axis, without the
    channels of a drawing where there is one."""

    __slots__ = ("columns", "complex", "first", "rows", "waves")

    def __init__(self, waves: Any, first: int, columns: int) -> None:
        self.waves, self.rows, self.first, self.columns = waves, waves.rows, first, columns
        self.complex: Sequence[bool] = getattr(waves, "complex", ())[first : first + columns]

    @property
    def corners(self) -> bytes:
        return self.waves.corners

    @property
    def steady(self) -> list[bool]:
        return self.waves.steady[self.first : self.first + self.columns]

    @property
    def digital(self) -> list[tuple[float, str, str]]:
        return self.waves.digital

    def column(self, i: int, /) -> bytes:
        return self.waves.column(self.first + i)

    @property
    def write_raw(self) -> Callable[..., None] | None:
        """The engine's writer; None where Python made the columns."""
        native = getattr(self.waves, "write_raw", None)
        if native is None:
            return None
        return lambda path, head, ascii=False: native(path, head, ascii, self.first)

    def finish_stream(self) -> tuple[int, str | None] | None:
        return self.waves.finish_stream()


class Computed:
    """Columns that an analysis made in Python: what is asked of the engine's record, and of a column store."""

    failure = None
    accounts = None
    corners = b""

    def __init__(
        self,
        data: Iterable[bytes | Iterable[float]],
        complex: Sequence[bool] = (),
        status: str = "ok",
        stats: dict[str, Any] | None = None,
        within: Sequence[bytes] = (),
    ) -> None:
        from array import array

        self.within = within
        self._data = [c if isinstance(c, bytes) else array("d", c).tobytes() for c in data]
        self.columns, self.complex, self.status = len(self._data), list(complex), status
        width = 16 if self.complex and self.complex[0] else 8
        self.rows = len(self._data[0]) // width if self._data else 0
        self.stats = {"points": self.rows, **(stats or {})}
        self.steady: list[bool] = []
        self.events: list[tuple[float, int, int]] = []
        self.broken: list[tuple[float, int]] = []
        self.unbalanced: list[tuple[int, float, float, float, float, bool]] = []
        self.gaps: list[tuple[float, float]] = []
        self.chattering: list[int] = []
        self.watch: dict[str, Any] = {}
        self.hanging: tuple[int, int, float, float] | None = None

    def column(self, i: int, /) -> bytes:
        return self._data[i]

    def inside(self, i: int, /) -> bytes:
        """The axis (0) or a quantity of `Run.inside`, at Chebyshev's points of the second kind of each stretch."""
        return self.within[i] if self.within else b""

    def value(self, row: int, column: int) -> float:
        return memoryview(self._data[column]).cast("d")[row]


class Run:
    """What one analysis computed.

    kind, names, units   of all columns; with an `axis` the first is the independent one
    waves                the record: the engine's, whose columns begin with the time, or Computed: status, events, statistics
    store                the named columns, whoever holds them (result.Waves)
    derived              columns that follow from the others: (name, unit, expression's tree)
    steps                names of columns that hold still in each block of rows, of sweeps within sweeps
    grid                 (tstep, tstop, tstart) of a transient [s]
    uic                  it started from initial values, without an operating point
    channels             columns beyond the named ones, which move a drawing
    trouble              diagnostics of a run that did not reach its end
    swing                what moves the machine's drawing on an axis of its own: its values, the channels
    beside               further tables of the same analysis
    stats                counters beside those of the record
    inside               quantities that the record has within the steps too (Waveforms.inside), and the degree of the polynomials
    """

    __slots__ = (
        "analysis", "axis", "beside", "channels", "derived", "grid", "inside", "kind", "names", "plotname", "stats", "steps",
        "store", "swing", "trouble", "uic", "units", "waves",
    )  # fmt: skip

    def __init__(
        self,
        analysis: Analysis,
        names: list[str],
        units: list[str],
        waves: Waveforms | Computed,
        axis: Axis | None,
        *,
        store: Any = None,
        derived: Sequence[tuple[str, str, Any]] = (),
        steps: Sequence[str] = (),
        grid: tuple[float, float, float] | None = None,
        trouble: list[Diagnostic] | None = None,
        uic: bool = False,
        kind: str = "",
        plotname: str = "",
        inside: tuple[Sequence[Output], int] = ((), 0),
    ) -> None:
        self.beside: list[Run] = []
        self.swing: tuple[Any, Computed] | None = None
        self.stats: dict[str, Any] = {}
        self.plotname = plotname
        self.analysis, self.kind = analysis, kind or analysis.word
        self.names, self.units, self.waves = names, units, waves
        self.axis, self.grid, self.trouble, self.uic = axis, grid, trouble or [], uic
        self.derived, self.steps, self.inside = list(derived), list(steps), inside
        first = 1 if axis is None and not isinstance(waves, Computed) else 0
        whole = len(names) == waves.columns
        self.store: Any = store or (waves if whole else Part(waves, first, len(names)))
        self.channels = Part(waves, first + len(names), max(0, waves.columns - len(names) - first))

    def gaps(self) -> list[tuple[str, float, float]]:
        """(name, value, place on the axis) of columns without a finite value at the first or last point: no such value is
        a result. The engine looks at the unknowns alone, and an expression of finite ones may have none."""
        store, found = self.store, []
        for k, name in enumerate(self.names):
            column = memoryview(store.column(k)).cast("d")
            width = len(column) // store.rows if store.rows else 1
            for row in {0, store.rows - 1} if store.rows else ():
                values = column[row * width : (row + 1) * width]
                if not all(map(isfinite, values)):
                    worst = next(v for v in values if not isfinite(v))
                    place = memoryview(store.column(0)).cast("d")[row] if self.axis else 0.0
                    found.append((name, worst, place))
                    break
        return found


class Analysis(ABC):
    """One dot card that computes something. `card` is the deck's own, for its place."""

    word: ClassVar[str]
    form: ClassVar[str]
    meaning: ClassVar[str]
    plotname: ClassVar[str]  # as raw files spell it
    axis: Axis | None = None
    complex: ClassVar[bool] = False
    in_time: ClassVar[bool] = False  # a transient, or steady states that are one
    streams: ClassVar[bool] = False  # rows can go to a file while the run goes on
    asks_as: ClassVar[str] = "dc"  # what analysis() of Verilog-A knows it as: dc, tran, ac, noise
    has_responses: ClassVar[bool] = False  # gains that only frequencies have make sense in it
    names_itself: ClassVar[bool] = False  # its columns are no signals of the deck
    draws: ClassVar[
        tuple[str, ...]
    ] = ()  # "machine", "circuit": what moves their drawings is recorded too, see `channels`
    tables: ClassVar[tuple[str, ...]] = ()  # kinds of its tables, where there are several
    shown: ClassVar[tuple[str, ...]] = ()  # ... that are printed where no .print asks for any

    card: Card
    frequencies: Points | tuple[()] = ()  # [Hz], of those that go over them
    into: tuple[str, bool, Any] | None = None  # ... to this one, see outputs/raw.py

    @classmethod
    @abstractmethod
    def read(cls, card: Card, sink: Sink) -> Self | Analysis | None:
        """The card's arguments. None after an error, which the sink has."""

    def times(self) -> tuple[float, ...] | None:
        """(tstep, tstop) [s] that waveforms refer to where they leave times out, and a period with which they have to repeat
        where one stands behind; None: to those of any other analysis."""
        return None

    def rows(self) -> tuple[float, int, str]:
        """Rows that are known before the run, bytes of each beside the table's own, and what makes fewer: see `size`."""
        return len(self.frequencies), POINT, "fewer points; those of `dec` lie evenly over decades"

    def size(self, assembly: Assembly) -> float:
        """Bytes of the rows that are known before the run."""
        (rows, beside, _), columns = self.rows(), 1 + len(assembly.outputs[self])
        return rows * (8.0 * columns * (1 + self.complex) + beside)

    def columns(self, ctx: Context) -> list[Output]:
        """What is recorded, without the axis: compiled before the equations are."""
        from ..assemble.outputs import columns

        return columns(ctx, self.word, self.axis.name if self.axis else "", not self.complex)

    @abstractmethod
    def run(self, assembly: Assembly, progress: Progress | None = None) -> Run: ...

    def text(self) -> str:
        """The card as `emsim check` shows it."""
        return " ".join([f".{self.word}", *(_written(a) for a in self.card.args), *sorted(self.card.flags)])

    def place(self, value: float) -> str:
        """Where on the axis something happened, for messages: `at t = 0.1 s`."""
        if self.axis is None:
            return "at the operating point"
        return f"at {'t' if self.axis.name == 'time' else self.axis.name} = {value:.6g} {self.axis.unit}"


def _written(value: Any) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)


def wrong(analysis: type[Analysis], card: Card, sink: Sink, message: str) -> None:
    """E305 for a card whose arguments make no sense; the hint is the form. Returns None, as `read` does after an error."""
    sink.error("E305", message, card.span, hint=analysis.form)


def recorded(assembly: Assembly, analysis: Analysis) -> tuple[list[str], list[str], list[Any]]:
    """Names, units and expressions of the columns that the engine computes."""
    outputs = [o for o in assembly.outputs[analysis] if o.expr is not None]
    return [o.name for o in outputs], [o.unit for o in outputs], [o.expr for o in outputs]


def channels(assembly: Assembly, analysis: Analysis) -> list[Any]:
    """Expressions of what moves the drawings, to be recorded behind the columns: of the machine, then of the circuit."""
    drawn = {"machine": assembly.drawn, "circuit": assembly.flows}
    return [c.expr for word in analysis.draws if (one := drawn[word]) is not None for c in one.channels]


def derived(assembly: Assembly, analysis: Analysis) -> list[tuple[str, str, Any]]:
    """Columns that follow from those: name, unit, tree of the expression."""
    return [(o.name, o.unit, o.ast) for o in assembly.outputs[analysis] if o.expr is None]
