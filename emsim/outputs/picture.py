"""Panels as a picture, drawn by matplotlib (the extra `plot`): PNG, SVG, PDF, and inline in notebooks.

Colours are those of Okabe and Ito (2008), which colour-blind people tell apart; further curves change their line.
"""

from __future__ import annotations

from itertools import cycle

import numpy as np

from ..tabular import prefixed
from . import missing_package
from .beside import replacing
from .panels import is_flat, thinned

try:
    from matplotlib import rc_context
    from matplotlib.figure import Figure
    from matplotlib.ticker import EngFormatter, LogLocator, MaxNLocator
except ImportError:
    raise missing_package("a picture needs", "matplotlib", "plot") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .panels import Panel

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
LINES = ("-", "--", ":", "-.")
DPI = 120
WIDTH = 1080  # [px]
STYLE: Any = {
    "font.size": 9, "axes.labelsize": 9, "legend.fontsize": 8.5, "svg.fonttype": "none", "axes.spines.top": False,
    "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25, "grid.linewidth": 0.6, "axes.edgecolor": "#555555",
    "xtick.color": "#333333", "ytick.color": "#333333", "axes.unicode_minus": True, "svg.hashsalt": "emsim",
}  # fmt: skip


class Picture(Figure):
    """A matplotlib Figure that notebooks show without pyplot, which would show it twice."""

    def _repr_png_(self) -> bytes:
        from io import BytesIO

        file = BytesIO()
        self.savefig(file, format="png", dpi=DPI)
        return file.getvalue()


def picture(panels: Sequence[Panel], title: str = "", width: int = WIDTH) -> Picture:
    """The panels one above the other. `width` in pixels of a PNG."""
    with rc_context(STYLE):
        across = width / DPI
        tall = 0.75 + (0.38 * across if len(panels) == 1 else len(panels) * min(max(0.26 * across, 1.5), 2.2))
        figure = Picture(figsize=(across, tall), dpi=DPI, layout="constrained")
        axes = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
        for k, (axis, panel) in enumerate(zip(axes, panels, strict=True)):
            _draw(axis, panel, width)
            # panels over the same quantity have one scale, written under the last of them
            if k and panel.x == panels[k - 1].x:
                axis.sharex(axes[k - 1])
                axes[k - 1].tick_params(labelbottom=False)
                axes[k - 1].set_xlabel("")
        figure.align_ylabels(axes)
        if title:
            figure.suptitle(title, fontsize=10.5, x=0.01, ha="left")
    return figure


def write(path: str, panels: Sequence[Panel], title: str = "", width: int = WIDTH) -> None:
    """A file in the format of its extension. OSError; ValueError for a format that matplotlib does not write."""
    with rc_context(STYLE):
        # no date in the file: the same run gives the same bytes
        metadata = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}.get(path[-4:].lower())
        with replacing(path) as beside:
            picture(panels, title, width).savefig(beside, dpi=DPI, metadata=metadata)


def _draw(axis: Any, panel: Panel, width: int) -> None:
    largest = max(map(abs, panel.scale))
    factor, unit = prefixed(panel.unit, largest)
    xlargest = largest if panel.xunit == panel.unit else _largest([c.x for c in panel.curves])
    # over decades each mark has its own prefix
    xfactor, xunit = (1.0, panel.xunit) if panel.log else prefixed(panel.xunit, xlargest)
    looks = cycle([(colour, line) for line in LINES for colour in COLOURS])
    for curve, (colour, line) in zip(panel.curves, looks, strict=False):
        x, y = thinned(curve.x, curve.y, width)
        y = factor * np.where(
            np.isfinite(y), y, np.nan
        )  # an infinite value is a gap, not the end of the scale
        axis.plot(xfactor * x, y, label=curve.name, color=colour, linestyle=line, linewidth=1.4)
    axis.set_ylabel(_with(panel.label, unit))
    axis.set_xlabel(_with(panel.x, xunit))
    axis.margins(x=0.01, y=0.08)
    if panel.unit == panel.xunit == "m":
        # a path in the plane keeps its shape
        axis.set_aspect("equal", adjustable="datalim")
    low, high = (factor * v for v in panel.scale)
    if is_flat(low, high):
        pad = abs(high) * 0.1 or 1.0
        axis.set_ylim(low - pad, high + pad)
    elif panel.unseen:
        axis.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    if panel.unseen:
        axis.text(0.01, 0.98, panel.unseen, transform=axis.transAxes, va="top", fontsize=8, color="#a00000")
    axis.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10], min_n_ticks=3))
    if panel.log:
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(LogLocator())
        axis.xaxis.set_major_formatter(EngFormatter(sep=""))
    # spectral densities span decades
    density = panel.unit.endswith("/sqrt(Hz)") and low > 0
    if density:
        axis.set_yscale("log")
    for scale in (*(() if density else (axis.yaxis,)), *(() if panel.log else (axis.xaxis,))):
        scale.get_major_formatter().set_useOffset(False)
    if len(panel.curves) > 1:
        axis.legend(
            loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=min(len(panel.curves), 6), frameon=False,
            borderaxespad=0.1, handlelength=1.6, columnspacing=1.2,
        )  # fmt: skip


def _largest(columns: Sequence[np.ndarray]) -> float:
    """The largest finite size."""
    return max((float(np.max(np.abs(c), where=np.isfinite(c), initial=0.0)) for c in columns), default=0.0)


def _with(name: str, unit: str) -> str:
    return f"{name} [{unit.replace('u', 'µ', 1) if unit[:1] == 'u' else unit}]" if unit else name
