"""What a picture shows: lists of signals become panels, one a unit, over the axis or over another signal.

    "v(out) v(in)-v(out) angle(hinge)"      two panels over time
    "omega(hinge) vs angle(hinge)"          one panel, a phase portrait

A signal is a column, or an expression of columns (signals.py); a complex one is drawn as db() and ph() of it. Curves
between computed points follow interpolate.py; long ones are thinned to what can be seen, extremes kept. What no scale can
show, because it is infinite or dwarfs all else, is said. Drawn by picture.py and terminal.py.
"""

from __future__ import annotations

import numpy as np

from ..build import parse_signals
from ..diagnostics import DeckError, deck_error
from ..expr import Call, Name, to_text
from ..interpolate import cubic_many
from ..signals import FUNCTIONS, evaluate
from ..tabular import prefixed
from .raw import TYPES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from ..deck import Probe
    from ..expr import Node
    from ..outcome import Outcome
    from ..table import Table

FAR = 1e6  # times the distance of all else from the middle: such rows are off the scale
FINE = 1500  # points that a curve has at least: between computed points it is not straight
QUANTITIES = {
    **{unit: word.replace("_", " ") for unit, word in TYPES.items() if unit},
    "deg": "angle",
    "dB": "ratio",
}


class Curve:
    """A name and the points (x, y), float64 of one length."""

    __slots__ = ("name", "x", "y")

    def __init__(self, name: str, x: np.ndarray, y: np.ndarray) -> None:
        self.name, self.x, self.y = name, x, y


class Panel:
    """Curves of one unit over one quantity. `x`: its name; units are plain, see `prefixed`; `log`: a logarithmic x."""

    __slots__ = ("curves", "log", "unit", "x", "xunit")

    def __init__(self, unit: str, x: str, xunit: str, log: bool) -> None:
        self.unit, self.x, self.xunit, self.log = unit, x, xunit, log
        self.curves: list[Curve] = []

    @property
    def label(self) -> str:
        """The name of the only curve, or of the quantity that all have."""
        return self.curves[0].name if len(self.curves) == 1 else QUANTITIES.get(self.unit, "")

    @property
    def scale(self) -> tuple[float, float]:
        """The lowest and the highest value that are drawn."""
        kept = [c.y[~off_scale(c.y)] for c in self.curves]
        kept = [y for y in kept if y.size]
        if not kept:
            return 0.0, 1.0
        return min(float(y.min()) for y in kept), max(float(y.max()) for y in kept)

    @property
    def unseen(self) -> str:
        """What lies off the scale, in words; empty where nothing does."""
        said = []
        for c in self.curves:
            off = off_scale(c.y) & ~np.isnan(c.y)
            if off.any():
                k = int(np.argmax(np.where(off, np.abs(c.y), -1.0)))
                rows = "1 row" if off.sum() == 1 else f"{off.sum()} rows"
                said.append(
                    f"{c.name}: {rows} off the scale, {c.y[k]:.3g} at {c.x[k]:.4g} {self.xunit}".rstrip()
                )
        return "; ".join(said)


def panels(
    table: Table,
    asked: Sequence[str | Sequence[Probe]],
    degrees: bool = False,
    start: float | None = None,
    stop: float | None = None,
) -> list[Panel]:
    """The panels of every list in turn. `degrees` shows rad as deg; `start`, `stop` cut the axis.

    Raises DeckError for signals that are not there, and where there is no course to draw."""
    if len(table) < 2 or table.is_complex(0):
        deck_error("E349", "there is nothing to draw: no analysis of several points ran")
    # phases are read in degrees
    degrees = degrees or table.names[0] == "frequency"
    # of a deck with .step each run is a curve of its own
    parts = [("", table)]
    if table.is_stepped:
        steps = table.step_values()
        parts = [(_written(v), c) for v, c in zip(steps, table.courses(), strict=True) if len(c) > 1]
    found: list[Panel] = []
    for given in asked:
        wanted, across = split(parse_signals(given) if isinstance(given, str) else list(given))
        own: dict[str, Panel] = {}
        spectral = [probe for probe in wanted if transformed(probe.ast)]
        wanted = [probe for probe in wanted if probe not in spectral]
        for step, part in parts:
            axis = part.column(part.names[0])
            window = _window(part, axis, start, stop)
            xname, xunit, x = part.names[0], part.units[0], axis
            if across is not None:
                (xname, xunit, x), *more = _signals(part, [across], degrees)
                if more:
                    said = "".join(across.text.split())
                    hint = f"re({said}), im(), mag(), db() or ph() of it can be one"
                    deck_error("E353", f"`{said}` is complex, and no x axis", across.span, hint)
            log = across is None and part.axis is not None and part.axis.log and axis[0] > 0
            for name, unit, y in _signals(part, wanted, degrees):
                if not np.isfinite(y).any():
                    deck_error("E349", f"there is nothing to draw: {name} is nowhere a finite number")
                panel = own.setdefault(unit, Panel(unit, xname, xunit, log))
                course = _course(axis, x, y, window, part.smooth, part.corners())
                panel.curves.append(
                    Curve(name + step, *(_apart(part, *course) if window is None else course))
                )
            for name, unit, f, y in _spectra(part, spectral, start, stop):
                panel = own.setdefault(f"fft {unit}", Panel(unit, "frequency", "Hz", True))
                panel.curves.append(Curve(name + step, f, y))
        found += own.values()
    return found


def of_result(
    result: Outcome,
    asked: Sequence[Probe],
    degrees: bool = False,
    start: float | None = None,
    stop: float | None = None,
) -> list[Panel]:
    """The panels of one list of signals, from the analysis that has them: of several the one that the result's `main` is,
    or else the last. Raises as panels() does of `main`."""
    wrong = None
    others = (t for t in result.plots[::-1] if t is not result.main and t.axis is not None and len(t) > 1)
    for table in [result.main, *others]:
        try:
            return panels(table, [asked], degrees, start, stop)
        except DeckError as error:
            # that a signal is nowhere says less than what is wrong where it is
            wrong = error if wrong is None or wrong.diagnostics[0].code == "E352" else wrong
    assert wrong is not None
    raise wrong


def _written(values: Mapping[str, float]) -> str:
    """Which step a curve is of: ` r=1k`."""
    found = []
    for name, value in values.items():
        factor, prefix = prefixed("V", abs(value))
        found.append(f"{name}={value * factor:.4g}{prefix[:-1]}")
    return " " + ",".join(found)


def transformed(ast: Node) -> list[Node]:
    """What is transformed in an expression with fft()."""
    if isinstance(ast, Call) and ast.fn == "fft" and len(ast.args) == 1:
        return [ast.args[0]]
    parts = ast.args if isinstance(ast, Call) else [getattr(ast, key, None) for key in "cab"]
    return [found for part in parts if part is not None for found in transformed(part)]


def _spectra(
    table: Table, items: Sequence[Probe], start: float | None, stop: float | None
) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Name, unit, frequencies and values of expressions with fft(): of a spectrum its size in dB. Without its mean."""
    for probe in items:
        signals = [to_text(ast) for ast in transformed(probe.ast)]
        try:
            spectrum = table.fft(*signals, start=start, stop=stop)
        except (KeyError, ValueError) as error:
            deck_error("E352", f"no spectrum of {', '.join(signals)}: {error.args[0]}", probe.span)
        shown = next(_signals(spectrum, [probe], False))  # of complex ones db() comes first
        yield shown[0], shown[1], spectrum.column("frequency")[1:], shown[2][1:]


def _window(
    table: Table, axis: np.ndarray, start: float | None, stop: float | None
) -> tuple[float, float] | None:
    """The part of the axis that is drawn; None for all of one that turns back, such as two sweeps in one."""
    if np.any(np.diff(axis) < 0):
        if start is None and stop is None:
            return None
        deck_error("E349", f"{table.names[0]} turns back: it cannot be cut at a beginning and an end")
    first, last = float(axis[0]), float(axis[-1])
    window = (first if start is None else max(start, first), last if stop is None else min(stop, last))
    if not window[0] < window[1]:
        name, unit = table.names[0], table.units[0]
        wanted = f"from {window[0] if start is None else start:g} to {window[1] if stop is None else stop:g}"
        ends = f"{first:g} {unit} to {last:g} {unit}"
        deck_error("E349", f"there is nothing to draw {wanted} {unit}: {name} goes from {ends}")
    return window


def writes_degrees(deck: str) -> bool:
    """Whether a deck gives its angles in degrees."""
    import re

    return re.search(r"\d(deg)\b", deck, re.I) is not None


def is_flat(low: float, high: float) -> bool:
    """Whether what lies between is rounding and tolerance alone: it is drawn as a straight line."""
    return not high - low > 1e-6 * max(abs(low), abs(high))


# ---- signals ------------------------------------------------------------------------------------


def split(items: list[Probe]) -> tuple[list[Probe], Probe | None]:
    """`a b vs x` as ([a, b], x)."""
    at = next((k for k, p in enumerate(items) if isinstance(p.ast, Name) and p.ast.id == "vs"), None)
    if at is not None and not (0 < at == len(items) - 2):
        deck_error(
            "E353",
            "`vs` stands between signals and one x axis",
            items[at].span,
            "for example omega(hinge) vs angle(hinge)",
        )
    return (items, None) if at is None else (items[:at], items[at + 1])


def _signals(table: Table, items: Sequence[Probe], degrees: bool) -> Iterator[tuple[str, str, np.ndarray]]:
    """Name, unit and values of columns and expressions, of complex ones their size in dB and their phase; `all` is every
    column."""
    for probe in items:
        asked = "".join(probe.text.split()).lower().strip("{}'\"")
        for name in table.names[1:] if asked == "all" and not table.has_column(asked) else [asked]:
            if table.has_column(name):
                name, unit, y = table.spelled(name), table.column_unit(name), table.column(name)
            else:
                y, unit = evaluate(table, probe.ast, probe.span)
            shown = [(name, unit, y)]
            if np.iscomplexobj(y):
                with np.errstate(all="ignore"):
                    shown = [
                        (f"{fn}({name})", u, FUNCTIONS[fn](y)) for fn, u in (("db", "dB"), ("ph", "rad"))
                    ]
            for name, unit, y in shown:
                if degrees and unit.startswith("rad"):
                    unit, y = "deg" + unit[3:], np.degrees(y)
                yield name, unit, y


# ---- courses ------------------------------------------------------------------------------------


def _course(
    axis: np.ndarray,
    x: np.ndarray,
    y: np.ndarray,
    window: tuple[float, float] | None,
    smooth: bool,
    corners: Sequence[float],
) -> tuple[np.ndarray, np.ndarray]:
    """The points of a curve within the window of the axis, its ends among them; between few points of a transient
    the ones of interpolate.py."""
    if window is None:
        return x, y
    first, last = (
        int(np.searchsorted(axis, window[0], "left")),
        int(np.searchsorted(axis, window[1], "right")),
    )
    more = np.array([t for t, k in zip(window, (first, last - 1), strict=True) if axis[k] != t])
    if smooth and last - first < FINE:
        fine = np.linspace(*window, FINE)
        more = np.union1d(more, fine[~np.isin(fine, axis)])
    places = np.searchsorted(axis, more, "right") - first
    ends = slice(first, last)

    def course(values: np.ndarray) -> np.ndarray:
        if not len(more):
            return values[ends]
        between = cubic_many(axis, values, more, corners) if smooth else np.interp(more, axis, values)
        return np.insert(values[ends], places, between)

    across = course(x)
    return across, across if y is x else course(y)


def _apart(table: Table, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The courses of a sweep within sweeps with a gap between them."""
    starts = [first for first, _ in table.blocks()[1:]]
    return np.insert(x, starts, x[starts]), np.insert(y, starts, np.nan)


def off_scale(y: np.ndarray) -> np.ndarray:
    """Which values no scale shows beside the others: what is not finite, and a hundredth of the rows at most that is FAR
    times as distant from the middle as all else."""
    off = ~np.isfinite(y)
    if off.all():
        return off
    finite = y[~off]
    distance = np.abs(y - np.median(finite))
    rest = float(np.quantile(distance[~off], 0.99, method="lower"))
    return off | (distance > FAR * rest) if rest > 0 and len(finite) > 2 else off


def thinned(x: np.ndarray, y: np.ndarray, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """What `columns` columns of a screen can show of a curve over ascending x: in each the first and the last point,
    the lowest and the highest. Curves that turn back in x, and short ones, stay as they are."""
    n = len(x)
    if n <= 4 * columns or np.any(np.diff(x) < 0):
        return x, y
    edges = np.linspace(x[0], x[-1], columns + 1)[:-1]
    starts = np.unique(np.searchsorted(x, edges))
    ends = np.append(starts[1:], n) - 1
    of = np.repeat(np.arange(len(starts)), ends - starts + 1)
    order = np.lexsort((y, of))
    keep = np.unique(np.concatenate([starts, ends, order[starts], order[ends]]))
    return x[keep], y[keep]
