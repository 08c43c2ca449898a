"""A sweep as a picture: families of signals, measures over what varied, histograms with the goals, tornado."""

from __future__ import annotations

import math
from itertools import pairwise

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .result import Goal, Swept

MOST_CURVES = 200  # of a family; more are an area
WIDTH, HEIGHT = 7.0, 2.8  # of a panel [inch]


def draw(swept: Swept, path: str, goals: Sequence[Goal] = ()) -> None:
    """Writes .png, .svg or .pdf. Raises OutsideError where matplotlib is not installed, ValueError, OSError."""
    figure(swept, goals).savefig(path, dpi=144)


def figure(swept: Swept, goals: Sequence[Goal] = ()) -> Any:
    """All panels, a matplotlib figure. Raises OutsideError where that is not installed, ValueError."""
    from ..outputs import missing_package

    try:
        import matplotlib

        matplotlib.use("Agg", force=False)
        from matplotlib.figure import Figure
    except ImportError:
        raise missing_package("pictures need", "matplotlib", "plot") from None
    names = swept.names
    signals = next((list(o.signals) for o in swept.good()), [])
    panels: list[tuple[Any, str]] = [(family, name) for name in signals]
    if swept.scheme.name == "sensitivity" and not swept.axes:
        panels += [(tornado, name) for name in names]
    elif swept.axes and swept.per_point == 1:
        panels += [(course, name) for name in names]
    else:
        panels += [(histogram, name) for name in names]
        panels += [(kind, name) for name in names if swept.shares(name)[0] for kind in (shares, scatter)]
    if not panels:
        raise ValueError("there is nothing to draw: no run has a measure or a signal")
    found = Figure(figsize=(WIDTH, HEIGHT * len(panels)), layout="constrained")
    for axes, (kind, name) in zip(found.subplots(len(panels), 1, squeeze=False)[:, 0], panels, strict=True):
        kind(axes, swept, name, [goal for goal in goals if goal.measure == name])
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
    return found


def family(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    """The signal of every run, the colour by the first axis; of very many the area between 5 and 95 % with the median."""
    import numpy as np
    from matplotlib import colormaps

    x, y = swept.signal(name)
    curves = y.reshape(-1, len(x))
    if len(curves) > MOST_CURVES:
        low, middle, high = np.nanpercentile(curves, [5, 50, 95], axis=0)
        axes.fill_between(x, low, high, alpha=0.3, label="5 to 95 %")
        axes.plot(x, middle, label="median")
        axes.legend(frameon=False)
    else:
        values = swept.axes[0].values if swept.axes else ()
        share = max(len(values) - 1, 1)
        each = len(curves) // max(len(values), 1)
        for k, curve in enumerate(curves):
            colour = colormaps["viridis"](0.9 * (k // each) / share) if values else None
            first = bool(values) and k % each == 0 and len(values) <= 8
            axes.plot(
                x,
                curve,
                color=colour,
                lw=1.0,
                label=f"{swept.axes[0].name} = {values[k // each]:g}" if first else None,
            )
        if values and len(values) <= 8:
            axes.legend(frameon=False, fontsize="small")
    axes.set(xlabel=swept.over(name), ylabel=name)


def course(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    """A measure over the last axis, a curve for each value of the others."""
    values = swept.measure(name)
    if values.ndim > len(swept.axes):
        values = values[..., 0]
    axis = swept.axes[-1]
    for k, curve in enumerate(values.reshape(-1, len(axis.values))):
        where = swept.values(k * len(axis.values) * swept.per_point)
        label = ", ".join(f"{other.name} = {where[other.name]:g}" for other in swept.axes[:-1])
        axes.plot(axis.values, curve, ".-" if len(axis.values) < 40 else "-", label=label or None)
    if len(swept.axes) > 1 and values.size <= 8 * len(axis.values):
        axes.legend(frameon=False, fontsize="small")
    if _is_logarithmic(axis.values):
        axes.set_xscale("log")
    for goal in goals:
        axes.axhline(goal.bound, ls="--", color="#b00", lw=1.0)
    axes.set(xlabel=axis.name, ylabel=name)


def histogram(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    import numpy as np

    found = swept.measure(name).ravel()
    found = found[np.isfinite(found)]
    axes.hist(
        found, bins=min(60, max(8, round(math.sqrt(len(found))))), color="#4878b0", edgecolor="white", lw=0.3
    )
    for goal in goals:
        axes.axvline(goal.bound, ls="--", color="#b00", lw=1.0)
    about = swept.statistics(name)
    title = f"mean {about['mean']:.6g}, deviation {about['deviation']:.3g}" if about["runs"] else "no values"
    if goals and len(found):
        title += (
            f", {100 * sum(all(g.met(v) for g in goals) for v in found) / swept.size:.1f} % meet the goal"
        )
    axes.set(xlabel=name, ylabel="runs", title=title)
    axes.title.set_fontsize("medium")


def tornado(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    """What each random value changes by itself, the largest on top."""
    rows = swept.influences(name)[:20][::-1]
    for k, (_, low, high) in enumerate(rows):
        axes.barh(k, low, color="#4878b0")
        axes.barh(k, high, color="#d07030")
    axes.set_yticks(range(len(rows)), [label for label, _, _ in rows])
    axes.axvline(0.0, color="#333", lw=0.8)
    centre = float(swept.measure(name)[0])
    axes.set(xlabel=f"change of {name} from {centre:.6g} (blue: least, orange: greatest)")


def shares(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    """What share of the measure's variance goes with each random value: by itself, and (where the runs tell) with others."""
    found, said = swept.shares(name)
    rows = found[:20][::-1]
    for k, (_, first, total) in enumerate(rows):
        axes.barh(k, total, color="#d07030")
        axes.barh(k, first, color="#4878b0")
    axes.set_yticks(range(len(rows)), [value for value, *_ in rows])
    axes.set(xlabel=f"share of the variance of {name}: {said}", xlim=(0.0, None))


def scatter(axes: Any, swept: Swept, name: str, goals: Sequence[Goal]) -> None:
    """The measure over the random value that most goes with it."""
    most = swept.shares(name)[0][0][0]
    axes.plot(swept.drawn(most).ravel(), swept.measure(name).ravel(), ".", ms=3, color="#4878b0", alpha=0.6)
    for goal in goals:
        axes.axhline(goal.bound, ls="--", color="#b00", lw=1.0)
    axes.set(xlabel=most, ylabel=name)


def _is_logarithmic(values: Sequence[float]) -> bool:
    """Spaced by ratios, over more than a factor of 8."""
    if len(values) < 3 or min(values) <= 0.0 or max(values) / min(values) < 8.0:
        return False
    ratios = [math.log(b / a) for a, b in pairwise(values)]
    return max(ratios) - min(ratios) < 0.5 * abs(ratios[0])
