"""What notebooks show of results, equations and errors: HTML that stands by itself, no network.

A result is a table of its signals and the page of html.py in a frame of its own (`srcdoc`, sandboxed: scripts, and nothing of
the notebook). The page travels inside the notebook's file, so a long run is thinned to CELLS values, in each stretch of time
the rows where a signal is lowest and highest; `Result.save("run.html")` writes all of it. Where frames are not shown (a
repository's site) the table is left.
"""

from __future__ import annotations

from html import escape

import numpy as np

from .. import tabular
from ..outcome import Outcome
from ..store import Columns, Scene
from ..table import Table
from . import html

TYPE_CHECKING = False
if TYPE_CHECKING:
    pass

CELLS = 200_000  # values that a page in a notebook holds at most
HEIGHT = 640  # of the page [px]


def result(found: Outcome) -> str:
    """Title, table and page."""
    parts = [f"<div><b>{escape(found.title or 'emsim')}</b></div>"]
    parts += [tabular.table(t) for t in found.plots] or ["<div>nothing ran</div>"]
    if said := [d for d in found.diagnostics if d.severity != "note"]:
        from ..diagnostics import render_text

        parts.append(f"<pre>{escape(render_text(said))}</pre>")
    if found.plots and found.main.axis and len(found.main) > 1:
        shorter = thinned(found)
        if shorter is not found:
            parts.append(
                f"<div><small>The page shows {len(shorter.main)} of {len(found.main)} points, extremes kept;"
                " <code>save('run.html')</code> writes all.</small></div>"
            )
        page = html.page(html.document(shorter, found.deck))
        parts.append(
            f'<iframe sandbox="allow-scripts" title="{escape(found.title or "emsim")}" srcdoc="{escape(page)}"'
            f' style="width: 100%; height: {HEIGHT}px; border: 1px solid #8884; border-radius: 6px"></iframe>'
        )
    return "\n".join(parts)


def thinned(found: Outcome, cells: int = CELLS) -> Outcome:
    """A result whose main table has no more than so many values; the same where it has no more."""
    t = found.main
    most = max(cells // max(1, len(t.names)), 200)
    if len(t) <= most:
        return found
    x, kept = t[t.names[0]], html.shown(found, t)
    buckets = max(2, most // (2 * len(kept) + 2))
    edges = np.linspace(x[0], x[-1], buckets + 1)[:-1]
    starts = np.unique(np.searchsorted(x, edges))
    of = np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(x))))
    ends = np.append(starts[1:], len(x)) - 1
    rows = [starts, ends]
    for name in kept:
        values = t.column(name)
        order = np.lexsort((np.abs(values) if values.dtype.kind == "c" else values, of))
        rows += [order[starts], order[ends]]
    keep = np.unique(np.concatenate(rows))

    def cut(waves: Columns | Table, count: int) -> Columns:
        complex = getattr(waves, "complex", None) or [False] * count
        kinds = [np.complex128 if z else np.float64 for z in complex]
        columns = (np.frombuffer(waves.column(k), kinds[k]) for k in range(count))  # type: ignore[arg-type]
        return Columns((column[keep].tobytes() for column in columns), complex=complex)

    scene = t.scene
    if scene is not None:
        scene = Scene(scene.data, cut(scene.waves, scene.waves.columns))  # type: ignore[arg-type]
    circuit = t.circuit
    if circuit is not None:
        circuit = Scene(circuit.data, cut(circuit.waves, circuit.waves.columns))  # type: ignore[arg-type]
    main = Table(
        t.kind, t.names, t.units, cut(t.waves, len(t.names)), title=t.title, axis=t.axis, steps=t.steps, grid=t.grid,  # type: ignore[arg-type]
        stats=t.stats, status=t.status, plotname=t.plotname, scene=scene, energy=t.energy, circuit=circuit,
    )  # fmt: skip
    return Outcome(found.title, [main], found.diagnostics, found.prints, found.deck)
