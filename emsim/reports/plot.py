"""The overlay picture of a comparison."""

from __future__ import annotations

from .draw import pyplot, save

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..table import Table

COLOURS = {"emsim": "#c8553d", "ngspice as written": "#588b8b", "ngspice tight": "#222222"}


def overlay(path: str, runs: dict[str, Table], names: Sequence[str], title: str) -> None:
    """One axis a signal, one line a run, to a file in the format of its extension.

    runs: table by a label of COLOURS, drawn in this order. OutsideError without matplotlib, ValueError for
    an extension it does not know."""
    figure, axes = pyplot().subplots(
        len(names), 1, sharex=True, squeeze=False, figsize=(8, 1 + 1.6 * len(names)), layout="constrained"
    )
    for axis, name in zip(axes[:, 0], names, strict=True):
        for label, table in runs.items():
            # the reference broad and pale behind the others, single points where there are few
            looks = {"linewidth": 3.0, "alpha": 0.35} if label == "ngspice tight" else {"linewidth": 1.2}
            marker = "." if label == "emsim" and len(table) < 200 else ""
            axis.plot(table.time, table[name], label=label, color=COLOURS[label], marker=marker, **looks)
        axis.set_ylabel(f"{name} [{runs['emsim'].unit(name)}]")
        axis.grid(alpha=0.25)
    axes[0, 0].set_title(title)
    axes[0, 0].legend(loc="best", fontsize="small")
    axes[-1, 0].set_xlabel("time [s]")
    save(figure, path, 120)
