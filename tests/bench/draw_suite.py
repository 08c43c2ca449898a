"""Pictures of a suite: small multiples, and the summary of who needs how long for a given error."""

from __future__ import annotations

from emsim.reports.draw import legend, looks, panel, pyplot, save
from emsim.reports.work_precision import Series, best, exponent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from emsim.reports.work_precision import Chart

ACROSS = 4  # panels in a row
ROLES = {
    # what a row of the summary shows: label, colour, mark, size
    "auto": ("auto", "#111111", "o", 46),
    "best": ("best single method", "#1f77b4", "D", 30),
    "scipy": ("best of scipy's, same equations", "#9a9a2e", "^", 26),
    "ngspice": ("ngspice", "#e377c2", "*", 70),
    "engine": ("best of MuJoCo, Exudyn, Drake", "#d1372c", "s", 32),
}


def multiples(path: str, charts: Sequence[Chart], title: str, dpi: int = 110) -> None:
    """One panel a deck, error against CPU time, on scales of its own; one legend."""
    plt = pyplot()
    style = looks(charts)
    rows = -(-len(charts) // ACROSS)
    columns = min(ACROSS, len(charts))
    figure, axes = plt.subplots(
        rows, columns, figsize=(max(4.1 * columns, 8), 3.1 * rows + 1.1), squeeze=False, layout="constrained"
    )
    for chart, axis in zip(charts, axes.flat, strict=False):
        panel(axis, chart, style, lambda p: 1e3 * p.seconds if p.seconds > 0 else None)
        axis.set_title(chart.name, loc="left")
    for axis in list(axes.flat)[len(charts) :]:
        axis.set_visible(False)
    for k, axis in enumerate(axes.flat):
        if k % columns == 0:
            axis.set_ylabel("error")
        if k + columns >= len(charts):
            axis.set_xlabel("CPU time [ms]")
    figure.suptitle(title, fontsize=12, x=0.01, ha="left")
    legend(figure, axes[0, 0], style, 3 * columns)
    save(figure, path, dpi)


def summary(path: str, charts: Sequence[Chart], errors: Sequence[float], dpi: int = 110) -> None:
    """Rows of problems, CPU time across, a panel an error: auto, the best method, and the best of each other kind."""
    plt = pyplot()
    figure, axes = plt.subplots(
        1, len(errors), sharey=True, sharex=True, figsize=(11, 1.6 + 0.27 * len(charts)), layout="constrained",
        squeeze=False,
    )  # fmt: skip
    used: dict[str, Any] = {}
    for axis, error in zip(axes[0], errors, strict=True):
        axis.set(xscale="log", title=f"CPU time to reach an error of {exponent(error)} [ms]")
        for row, chart in enumerate(charts):
            found = _times(chart, error)
            if found:
                axis.plot(
                    [1e3 * min(found.values()), 1e3 * max(found.values())],
                    [row, row],
                    color="#cccccc",
                    zorder=1,
                )
            for role, seconds in found.items():
                label, colour, mark, size = ROLES[role]
                hollow = {"facecolors": "none", "linewidths": 1.4} if role == "best" else {}
                used[role] = axis.scatter(
                    1e3 * seconds, row, s=size, marker=mark, label=label, zorder=3 if role == "auto" else 2,
                    **({"edgecolors": colour, **hollow} if hollow else {"color": colour}),
                )  # fmt: skip
        axis.grid(alpha=0.25, linewidth=0.6, axis="x")
        for side in ("top", "right", "left"):
            axis.spines[side].set_visible(False)
        axis.tick_params(axis="y", length=0)
        axis.minorticks_off()
    axes[0, 0].set_yticks(range(len(charts)), [chart.name for chart in charts])
    axes[0, 0].invert_yaxis()
    _bands(axes[0], charts)
    handles = [used[role] for role in ROLES if role in used]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles) or 1, frameon=False)
    save(figure, path, dpi)


def _times(chart: Chart, error: float) -> dict[str, float]:
    """Role -> CPU seconds at the error, for the roles that reach it."""
    own = [s for s in chart.own if s.name != "auto"]
    candidates: dict[str, list[Series]] = {
        "auto": [s for s in chart.own if s.name == "auto"],
        "best": own,
        **{role: [s for s in chart.series if s.group == role] for role in ("scipy", "ngspice", "engine")},
    }
    found = {role: best(series, error, chart.distance) for role, series in candidates.items()}
    return {role: pair[1] for role, pair in found.items() if pair}


def _bands(axes: Sequence[Any], charts: Sequence[Chart]) -> None:
    """A pale band behind every second group."""
    groups = list(dict.fromkeys(chart.group for chart in charts))
    for k, group in enumerate(groups):
        rows = [row for row, chart in enumerate(charts) if chart.group == group]
        if k % 2:
            for axis in axes:
                axis.axhspan(
                    rows[0] - 0.5, rows[-1] + 0.5, color="#000000", alpha=0.035, linewidth=0, zorder=0
                )
