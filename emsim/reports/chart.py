"""A work-precision chart as text: the terminal table, the CSV file, the list of failures."""

from __future__ import annotations

from .work_precision import exponent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from .work_precision import Chart, Point, Series

COLUMNS = (
    "deck", "group", "tool", "setting", "tolerance", "error", "cpu_seconds", "evaluations", "steps", "reason",
)  # fmt: skip


def lines(chart: Chart, points: bool = False) -> Iterator[str]:
    """The chart in the terminal: time to reach each error, then what failed; with `points` every run too."""
    yield chart.title
    shown = ", ".join(chart.signals[:6]) + (
        f" and {len(chart.signals) - 6} more" if len(chart.signals) > 6 else ""
    )
    yield f"  compared   {shown}, at {chart.times} common times"
    yield f"  reference  {chart.reference}"
    if chart.smallest < chart.confirmed and chart.distance < chart.confirmed:
        yield f"  errors below {chart.confirmed:.1e} rest on the reference's own convergence, no second method came so near"
    if chart.unresolved:
        count = f"{chart.unresolved} of the points" if chart.unresolved > 1 else "one point"
        yield f"  {count} came nearer than that: their errors are not resolved and count as {chart.distance:.1e}"
    yield ""
    yield from _costs(chart)
    if points:
        yield ""
        yield from _points(chart)
    failed = list(failures(chart))
    if failed:
        yield ""
        yield "did not get through:"
        width = max(len(name) for name, _, _ in failed)
        yield from (f"  {name:<{width}}  {settings}: {reason}" for name, settings, reason in failed)
    yield from (f"note: {note}" for note in chart.notes)


def _costs(chart: Chart) -> Iterator[str]:
    """One row a tool: CPU ms on its front at each power of ten."""
    errors = [10.0**-k for k in range(2, 11)]
    errors = [e for e in errors if any(s.at(e, chart.distance) is not None for s in chart.series)]
    width = max([4, *(len(s.label) for s in chart.series)])
    yield "CPU ms to reach an error of"
    yield f"  {'':<{width}}" + "".join(f"{exponent(e):>9}" for e in errors) + "   best error"
    for series in chart.series:
        cells = [series.at(e, chart.distance) for e in errors]
        texts = [f"{1e3 * t:>9.3g}" if t is not None else f"{'-':>9}" for t in cells]
        least = min((p.error for p in series.good if p.error is not None), default=None)
        resolved = least is None or least >= chart.distance
        best = "none" if least is None else f"{least:.1e}" if resolved else f"<{chart.distance:.1e}"
        yield f"  {series.label:<{width}}" + "".join(texts) + f"   {best}"


def _points(chart: Chart) -> Iterator[str]:
    width = max(len(s.label) for s in chart.series)
    wide = max(len(p.setting) for s in chart.series for p in s.points)
    yield f"  {'':<{width}}  {'setting':<{wide}} {'error':>9} {'CPU ms':>9} {'evaluations':>12} {'steps':>8}"
    for series in chart.series:
        for p in series.good:
            counts = "".join(
                f"{'-' if n is None else n:>{w}}" for n, w in ((p.evaluations, 13), (p.steps, 9))
            )
            time = f"{1e3 * p.seconds:.3g}"
            yield f"  {series.label:<{width}}  {p.setting:<{wide}} {p.error:>9.2e} {time:>9}{counts}"


def failures(chart: Chart) -> Iterator[tuple[str, str, str]]:
    """(tool, settings, reason), neighbouring settings with one reason together."""
    for series in chart.series:
        runs: list[tuple[str, list[Point]]] = []
        for point in series.failures:
            if runs and runs[-1][0] == point.reason:
                runs[-1][1].append(point)
            else:
                runs.append((point.reason, [point]))
        for reason, group in runs:
            first, last = group[0].setting, group[-1].setting
            yield series.label, first if first == last else f"{first} .. {last}", reason


def csv_lines(charts: Sequence[Chart]) -> Iterator[str]:
    """Every point as a line of CSV."""
    yield ",".join(COLUMNS)
    for chart in charts:
        for series in chart.series:
            for point in series.points:
                yield ",".join(_quoted(cell) for cell in _cells(chart, series, point))


def _cells(chart: Chart, series: Series, p: Point) -> tuple[object, ...]:
    return (
        chart.name, series.group, series.name, p.setting, p.tolerance, p.error, p.seconds, p.evaluations, p.steps,
        p.reason,
    )  # fmt: skip


def _quoted(cell: object) -> str:
    text = "" if cell is None else f"{cell:.6g}" if isinstance(cell, float) else str(cell)
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\n') else text
