"""How far two runs of a deck are from a tight reference run, signal by signal.

A run is looked at on its own time points and the reference's, both interpolated between their points by the
same rule (interpolate.py). With y the run and r the reference, at a point t

    deviation(t) = distance of y(t) from [min r, max r] over t - w .. t + w            (1)

w is a small time, 1e-6 of the run unless given: a vertical edge that comes 1e-12 s late is not a wrong
voltage. A sine of N periods a run is forgiven 6e-6 N of its amplitude by that.
Maximum and time-weighted root mean square of (1) are divided by the signal's scale: its range, but at
least 1e-3 of its largest magnitude (a supply that does not move has no range) and 1e-6 of the largest
range or magnitude among signals of its unit, and never less than `FLOORS` (numerical zero).
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    import numpy as np

    from ..table import Table

WINDOW = 1e-6
FLOORS = {"V": 1e-9, "A": 1e-12}
TIE = 1e-6  # two runs that are both this near, in parts of the scale, are equally near


class Row:
    """One signal of one analysis; deviations in parts of `scale`, `written` ones None without that run."""

    __slots__ = (
        "kind", "maximum", "name", "rms", "scale", "unit", "worst_at", "written_maximum", "written_rms",
    )  # fmt: skip

    def __init__(self, kind: str, name: str, unit: str, scale: float) -> None:
        self.kind, self.name, self.unit, self.scale = kind, name, unit, scale
        self.maximum = self.rms = 0.0
        self.worst_at: float | None = None
        self.written_maximum: float | None = None
        self.written_rms: float | None = None

    @property
    def nearer(self) -> str:
        """The run nearer to the reference by rms: "emsim", "ngspice", "equal"; "" without a second run."""
        if self.written_rms is None:
            return ""
        if max(self.rms, self.written_rms) < TIE or self.rms == self.written_rms:
            return "equal"
        return "emsim" if self.rms < self.written_rms else "ngspice"

    def as_dict(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in (*self.__slots__, "nearer")}


class Comparison:
    """Rows of all common signals, and what could not be compared."""

    __slots__ = ("rows", "tolerance", "unmatched", "window")

    def __init__(self, tolerance: float) -> None:
        self.tolerance, self.rows = tolerance, list[Row]()
        self.unmatched: list[str] = []
        self.window = 0.0  # [s]

    @property
    def passed(self) -> bool:
        """Every signal within the tolerance, and at least one signal compared."""
        return bool(self.rows) and all(row.maximum <= self.tolerance for row in self.rows)

    def count(self, who: str) -> int:
        return sum(row.nearer == who for row in self.rows)


def compare(
    ours: Sequence[Table],
    tight: Sequence[Table],
    written: Sequence[Table] = (),
    tolerance: float = 0.005,
    window: float | None = None,
) -> Comparison:
    """Compares the last table of each kind that `ours` and `tight` share; `written` is judged alike if given.

    tolerance: allowed maximum, in parts of the scale; window: w of (1) [s]."""
    out = Comparison(tolerance)
    for kind in dict.fromkeys(table.kind for table in ours):
        run, reference, other = _last(ours, kind), _last(tight, kind), _last(written, kind)
        if run is None or reference is None:
            continue
        common = [name for name in run.signals if name in reference and (other is None or name in other)]
        out.unmatched += [name for name in run.signals if name not in common]
        scales = _scales(reference, common)
        start = stop = span = 0.0
        over_time = reference.axis is not None and reference.axis.name == "time"
        if reference.axis is not None and not over_time and len(run) != len(reference):
            out.unmatched += common
            continue
        if over_time:
            times = [table.time for table in (run, reference, other) if table is not None]
            start, stop = max(t[0] for t in times), min(t[-1] for t in times)
            if stop <= start:
                continue
            span = WINDOW * (stop - start) if window is None else window
            out.window = max(out.window, span)
        points = reference.axis is not None and not over_time
        judge: Points | Judge = Points(run, reference) if points else Judge(run, reference, start, stop, span)
        judge_other: Points | Judge | None = None
        if other is not None:
            judge_other = Points(other, reference) if points else Judge(other, reference, start, stop, span)
        for name in common:
            row = Row(kind, name, reference.unit(name) or run.unit(name), scales[name])
            row.maximum, row.rms, row.worst_at = judge.deviation(name, row.scale)
            if judge_other is not None:
                row.written_maximum, row.written_rms, _ = judge_other.deviation(name, row.scale)
            out.rows.append(row)
    return out


class Points:
    """The same for tables that were computed at the same points of a sweep; complex numbers by the size of their difference."""

    def __init__(self, run: Table, reference: Table) -> None:
        self.run, self.reference = run, reference

    def deviation(self, name: str, scale: float) -> tuple[float, float, float | None]:
        import numpy as np

        off = np.abs(self.run[name] - self.reference[name]) / scale
        worst = int(np.argmax(off))
        return float(off[worst]), float(np.sqrt(np.mean(off**2))), float(self.reference.doubles(0)[worst])


class Judge:
    """Evaluates (1) for one run against the reference, on the points of both within start .. stop [s]."""

    def __init__(self, run: Table, reference: Table, start: float, stop: float, window: float) -> None:
        import numpy as np

        self.run, self.reference = run, reference
        if stop <= start:
            return
        time = np.union1d(reference.time, run.time)
        self.time: np.ndarray = time[(time >= start) & (time <= stop)]
        # the reference's points within the window around each, as slices for reduceat, and the window's ends
        low = np.searchsorted(reference.time, self.time - window, side="left")
        high = np.searchsorted(reference.time, self.time + window, side="right")
        self.slices = np.column_stack([low, high]).ravel()
        self.empty = low == high
        self.ends = np.clip([self.time - window, self.time + window], *reference.time[[0, -1]])
        gaps = np.diff(self.time)
        self.weights = (np.append(gaps, 0) + np.insert(gaps, 0, 0)) / 2

    def deviation(self, name: str, scale: float) -> tuple[float, float, float | None]:
        """Largest and rms deviation in parts of scale, and where the largest is [s]."""
        import numpy as np

        from ..interpolate import cubic_many

        reference = self.reference[name]
        if not self.reference.axis:
            off = float(abs(self.run[name][-1] - reference[-1])) / scale
            return off, off, None
        value = cubic_many(self.run.time, self.run[name], self.time, self.run.corners(name))
        before, after = cubic_many(self.reference.time, reference, self.ends)
        low, high = np.minimum(before, after), np.maximum(before, after)
        padded = np.append(reference, reference[-1])
        low = np.where(self.empty, low, np.minimum(low, np.minimum.reduceat(padded, self.slices)[::2]))
        high = np.where(self.empty, high, np.maximum(high, np.maximum.reduceat(padded, self.slices)[::2]))
        off = np.maximum(np.maximum(low - value, value - high), 0.0) / scale
        worst = int(np.argmax(off))
        rms = float(np.sqrt((self.weights * off**2).sum() / self.weights.sum()))
        return float(off[worst]), rms, float(self.time[worst])


def _last(tables: Sequence[Table], kind: str) -> Table | None:
    return next((table for table in reversed(tables) if table.kind == kind), None)


def _scales(reference: Table, names: Sequence[str]) -> dict[str, float]:
    """The scale of every signal; see the head of the file."""
    reach, size, unit = {}, {}, {name: reference.unit(name) for name in names}
    for name in names:
        y = reference[name]
        size[name] = float(abs(y).max())
        reach[name] = size[name] if y.dtype.kind == "c" else float(y.max() - y.min())
    moving = len(reference) > 1
    out = {}
    for name in names:
        largest = max((max(reach[n], size[n]) for n in names if unit[n] == unit[name]), default=0.0)
        own = max(reach[name], 1e-3 * size[name]) if moving else size[name]
        out[name] = max(own, 1e-6 * largest, FLOORS.get(unit[name], 1e-12))
    return out


def table_lines(comparison: Comparison) -> list[str]:
    """The comparison as text: a line a signal, a verdict."""
    rows = comparison.rows
    width = max([len("signal"), *(len(row.name) for row in rows)]) + 2
    lines = [
        f"{'':<{width}}{'emsim':>20}{'ngspice as written':>22}",
        f"{'signal':<{width}}{'max %':>10}{'rms %':>10}{'max %':>12}{'rms %':>10}  nearer   range",
    ]
    for row in rows:
        other = "-".rjust(12) + "-".rjust(10)
        if row.written_maximum is not None and row.written_rms is not None:
            other = f"{100 * row.written_maximum:>12.3g}{100 * row.written_rms:>10.3g}"
        over = row.maximum > comparison.tolerance
        mark = f"  over at {row.worst_at:g} s" if over and row.worst_at is not None else ""
        lines.append(
            f"{row.name:<{width}}{100 * row.maximum:>10.3g}{100 * row.rms:>10.3g}{other}"
            f"  {row.nearer:<8} {row.scale:.4g} {row.unit}{mark}"
        )
    far = [row.name for row in rows if row.maximum > comparison.tolerance]
    limit = f"{100 * comparison.tolerance:g} % of its range"
    if not rows:
        lines.append("no signal in common: nothing compared")
    elif far:
        lines.append(f"{len(far)} of {len(rows)} signals are further than {limit} from the tight run:")
        lines.append("  " + ", ".join(far))
    else:
        lines.append(f"all {len(rows)} signals are within {limit} of the tight run")
    if any(row.nearer for row in rows):
        emsim, ngspice, equal = (comparison.count(who) for who in ("emsim", "ngspice", "equal"))
        lines.append(f"nearer to the tight run: emsim on {emsim}, ngspice on {ngspice}, equal on {equal}")
    return lines
