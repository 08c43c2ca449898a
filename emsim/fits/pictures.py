"""Data, the curves that were fitted to them, and what is left."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .fitted import Fitted

WIDTH, HEIGHT = 7.0, 2.8  # of a panel [inch]


def draw(found: Fitted, path: str) -> None:
    """Writes .png, .svg or .pdf. Raises OutsideError where matplotlib is not installed, OSError."""
    from ..outputs import missing_package

    try:
        import matplotlib

        matplotlib.use("Agg", force=False)
        from matplotlib.figure import Figure
    except ImportError:
        raise missing_package("pictures need", "matplotlib", "plot") from None
    several = len(found.experiments) > 1
    shown = [
        (f"{name}, {number}" if several else name, data.times, data.values[:, k], curves[:, k])
        for number, (data, curves) in enumerate(found.experiments, 1)
        for k, name in enumerate(data.names)
    ]
    figure = Figure(figsize=(WIDTH, 1.6 * HEIGHT * len(shown)), layout="constrained")
    heights = [3, 1] * len(shown)
    panels = figure.subplots(2 * len(shown), 1, squeeze=False, sharex=not several, height_ratios=heights)[
        :, 0
    ]
    for k, (name, times, data, curve) in enumerate(shown):
        above, below = panels[2 * k], panels[2 * k + 1]
        above.plot(times, data, ".", ms=3, color="#888", label="data")
        above.plot(times, curve, color="#b03030", lw=1.2, label="fitted")
        above.set(ylabel=name)
        above.legend(frameon=False, fontsize="small")
        below.plot(times, curve - data, ".", ms=3, color="#4878b0")
        below.axhline(0.0, color="#333", lw=0.8)
        below.set(ylabel="left")
        for axes in (above, below):
            axes.spines[["top", "right"]].set_visible(False)
            axes.grid(alpha=0.25)
    panels[-1].set(xlabel="time")
    figure.savefig(path, dpi=144)
