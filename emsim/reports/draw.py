"""Pictures of work-precision charts.

One deck: error against CPU time, and against evaluations, log-log. A suite: small multiples, one panel a deck, and a
summary. A tool has one colour and mark everywhere. Left and down is better. Above the dashed line is the lane
of runs that did not get through, each at the time it had used, their reasons in words below; the grey floor is what the
reference does not resolve.
"""

from __future__ import annotations

from ..outputs import missing_package
from ..outputs.beside import replacing
from .work_precision import Series, front

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import Any

    from .work_precision import Chart, Point

# methods in hues of their family: explicit warm, one-step implicit blue and green, multistep violet; auto is black
LOOKS = {
    "auto": ("#111111", "o"),
    "radau": ("#1f5fa8", "s"), "radau5": ("#6fa3d8", "s"), "radau9": ("#3d7fc4", "D"), "radau13": ("#123d6b", "v"),
    "gauss": ("#148f8b", "p"), "gauss4": ("#59b8b4", "p"), "gauss6": ("#0d605d", "p"),
    "dop853": ("#d1372c", "^"), "rk45": ("#f08a24", "<"),
    "esdirk": ("#3f9b3f", "P"), "trbdf2": ("#8fbf4d", "X"),
    "gear": ("#8455b3", "h"), "trap": ("#b8860b", "d"),
}  # fmt: skip
OTHERS = ("#d94f8c", "#8c5a3c", "#5b7f95", "#9a9a2e", "#c77cc7", "#50606e", "#b35d00", "#4f8f6f")
STYLES = {"emsim": "-", "absolute": "-.", "scipy": ":", "ngspice": "-", "engine": "--"}
LANE = 0.085  # share of a panel's height that the failures get
LINE, MOST = 0.16, 16  # height of a line under the panels [inch], and how many there are at most


def pyplot() -> Any:
    """matplotlib's pyplot without a screen. OutsideError where it is missing."""
    try:
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        raise missing_package("a picture needs", "matplotlib", "plot") from None
    pyplot.rcParams.update(
        {"font.size": 9, "axes.titlesize": 9.5, "legend.fontsize": 8, "svg.fonttype": "none"}
    )
    return pyplot


def looks(charts: Iterable[Chart]) -> dict[tuple[str, str], dict[str, Any]]:
    """(group, tool) -> colour, mark and line of every tool in the charts, in the order of a legend."""
    out: dict[tuple[str, str], dict[str, Any]] = {}
    spare = list(OTHERS)
    for chart in charts:
        for series in chart.series:
            key = series.group, series.name
            if key in out:
                continue
            own = LOOKS.get(series.name.split()[-1]) if series.group in ("emsim", "absolute") else None
            if series.group == "ngspice":
                own = ("#e377c2", "*")
            colour, mark = own or (spare[0], "o")
            if own is None:
                spare.append(spare.pop(0))
            filled = series.group in ("emsim", "ngspice")
            out[key] = {
                "color": colour, "marker": mark, "linestyle": STYLES[series.group],
                "markerfacecolor": colour if filled else "white",
                "linewidth": 2.0 if series.name == "auto" else 1.2,
                "markersize": 7.0 if mark == "*" else 5.0 if series.name == "auto" else 4.5,
                "zorder": 4 if series.name == "auto" else 3,
            }  # fmt: skip
    return dict(sorted(out.items(), key=lambda pair: list(STYLES).index(pair[0][0])))


def one(path: str, chart: Chart) -> None:
    """The picture of one deck. ValueError for a format that matplotlib does not write."""
    plt = pyplot()
    style, why = looks([chart]), reasons(chart)
    figure = plt.figure(figsize=(11, 5.4 + LINE * len(why)), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(5.0, LINE * len(why) + 0.01))
    axes = [figure.add_subplot(grid[0, 0])]
    axes.append(figure.add_subplot(grid[0, 1], sharey=axes[0]))
    axes[1].tick_params(labelleft=False)
    under = figure.add_subplot(grid[1, :])
    under.axis("off")
    under.text(0, 1, "\n".join(why), fontsize=7.5, color="#555555", va="top", transform=under.transAxes)
    panel(axes[0], chart, style, lambda p: 1e3 * p.seconds if p.seconds > 0 else None)
    panel(axes[1], chart, style, lambda p: float(p.evaluations) if p.evaluations else None)
    axes[0].set_xlabel("CPU time of the solve [ms]")
    axes[1].set_xlabel("evaluations of the equations")
    axes[0].set_ylabel("error, in parts of the signals' range")
    figure.suptitle(chart.title, fontsize=11, x=0.01, ha="left")
    axes[0].set_title(f"reference: {chart.reference}", fontsize=7.5, loc="left", color="#555555")
    legend(figure, axes[0], style, 7)
    save(figure, path)


def reasons(chart: Chart) -> list[str]:
    """What stands under the panels: why runs failed, tool by tool, and what was left out."""
    from .chart import failures

    lines = [f"failed: {name}, {settings}: {reason}" for name, settings, reason in failures(chart)]
    lines += chart.notes
    return lines if len(lines) <= MOST else [*lines[: MOST - 1], f"and {len(lines) - MOST + 1} more"]


def legend(figure: Any, axis: Any, style: dict[tuple[str, str], dict[str, Any]], columns: int) -> None:
    """Every tool once, under the panels."""
    from matplotlib.lines import Line2D

    labels = [Series(name, group).label for group, name in style]
    handles = [Line2D([], [], label=t, **look) for t, look in zip(labels, style.values(), strict=True)]
    figure.legend(
        handles=handles, loc="outside lower center", ncols=min(columns, len(handles)), frameon=False
    )


def panel(
    axis: Any,
    chart: Chart,
    style: dict[tuple[str, str], dict[str, Any]],
    across: Callable[[Point], float | None],
) -> None:
    """Error over a cost, every tool; failures in their lane, the unresolved floor in grey."""
    errors: list[float] = []
    costs: list[float] = []
    axis.set(xscale="log", yscale="log")
    for series in chart.series:
        pairs = [
            (c, max(p.error or 0.0, chart.distance, 1e-16))
            for p in series.good
            if (c := across(p)) is not None
        ]
        if not pairs:
            continue
        look = style[series.group, series.name]
        line = pairs
        if series.group == "ngspice":
            # two knobs: the line follows the best of their combinations
            line = [(c, e) for e, c in front((e, c) for c, e in pairs)]
            axis.plot(*zip(*pairs, strict=True), **{**look, "linestyle": "", "alpha": 0.35})
        axis.plot(*zip(*line, strict=True), **look)
        costs += [c for c, _ in pairs]
        errors += [e for _, e in pairs]
    low, high = min(errors, default=1e-9), max(errors, default=1e-1)
    floor, roof = 10 ** (_log(low) - 0.5), 10 ** (_log(high) + 0.5)
    top = roof * 10 ** ((_log(roof) - _log(floor)) * LANE / (1 - LANE))
    axis.set_ylim(floor, top)
    # failures, each tool a little higher than the one before, so that marks at one time stay apart
    failed = [(s, [c for p in s.failures if (c := across(p)) is not None]) for s in chart.series]
    failed = [(s, cs) for s, cs in failed if cs]
    axis.axhline(roof, color="#999999", linestyle=(0, (4, 3)), linewidth=0.7)
    for k, (series, xs) in enumerate(failed):
        y = roof * (top / roof) ** ((k + 1) / (len(failed) + 1))
        colour = style[series.group, series.name]["color"]
        axis.plot(
            xs, [y] * len(xs), linestyle="", marker="x", color=colour, markersize=5, markeredgewidth=1.5
        )
        costs += xs
    if costs:
        axis.set_xlim(0.6 * min(costs), 1.7 * max(costs))
        _narrow(axis, 0.6 * min(costs), 1.7 * max(costs))
    if chart.distance > floor:
        axis.axhspan(floor, min(chart.distance, roof), color="#000000", alpha=0.06, linewidth=0)
    _ticks(axis, floor, roof, top)
    axis.grid(alpha=0.25, linewidth=0.6)
    for side in ("top", "right"):
        axis.spines[side].set_visible(False)


def _ticks(axis: Any, floor: float, roof: float, top: float) -> None:
    """Powers of ten, at most nine of them, and the name of the lane above."""
    from math import ceil

    powers = list(range(ceil(_log(floor)), ceil(_log(roof))))
    stride = -(-len(powers) // 9)
    shown = [k for k in powers if k % stride == 0]
    labels = [f"$10^{{{k}}}$" for k in shown]
    axis.set_yticks([*(10.0**k for k in shown), (roof * top) ** 0.5], [*labels, "failed"])
    axis.minorticks_off()


def _narrow(axis: Any, low: float, high: float) -> None:
    """Numbers between the powers of ten where there are fewer than two of these."""
    from math import ceil, floor

    shown = range(floor(_log(low)), ceil(_log(high)))
    if sum(low <= 10.0**k <= high for k in shown) < 2:
        ticks = [x for k in shown for m in (1, 2, 5) if low <= (x := m * 10.0**k) <= high]
        axis.set_xticks(ticks, [f"{x:g}" for x in ticks])


def _log(value: float) -> float:
    from math import log10

    return log10(value)


def save(figure: Any, path: str, dpi: int = 110) -> None:
    plt = pyplot()
    figure.patch.set_facecolor("white")
    try:
        with replacing(path) as beside:
            figure.savefig(beside, dpi=dpi)
    finally:
        plt.close(figure)


__all__ = ["legend", "looks", "one", "panel", "pyplot", "save"]
