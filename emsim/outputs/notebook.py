"""What notebooks show of results, equations and errors: HTML that stands by itself, no network.

A result is a table of its signals and the page of html.py in a frame of its own (`srcdoc`, sandboxed: scripts, and nothing of
the notebook). The page travels inside the notebook's file, so a long run is thinned to CELLS values, in each stretch of time
the rows where a signal is lowest and highest; `Result.save("run.html")` writes all of it. Where frames are not shown (a
repository's site) the table is left.
"""

from __future__ import annotations

from html import escape

import numpy as np

from ..result import Columns, Result, Scene, Table
from . import html
from .panels import prefixed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

CELLS = 200_000  # values that a page in a notebook holds at most
LISTED = 12  # signals that are listed at once; the rest is unfolded
HEIGHT = 640  # of the page [px]
STYLE = "font-variant-numeric: tabular-nums; border-collapse: collapse;"


def result(found: Result) -> str:
    """Title, table and page."""
    parts = [f"<div><b>{escape(found.title or 'emsim')}</b></div>"]
    parts += [table(t) for t in found.plots] or ["<div>nothing ran</div>"]
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


def table(t: Table) -> str:
    """One line a signal: smallest, largest and last value; of a single point its value."""
    points = "1 point" if len(t) == 1 else f"{len(t)} points"
    head = f"{escape(t.plotname)}: {points}" + ("" if t.status == "ok" else f" <b>({t.status})</b>")
    if not len(t):
        return f"<div>{head}</div>"
    rows = []
    for name, unit in zip(t.names, t.units, strict=True):
        column = t.column(name)
        if column.dtype.kind == "c":
            name, column = f"|{name}|", np.abs(column)
        values = [column[-1]] if len(t) == 1 else [np.min(column), np.max(column), column[-1]]
        largest = max((abs(v) for v in values if np.isfinite(v)), default=0.0)
        factor, unit = prefixed(unit, largest)
        # rounding noise is nothing
        rows.append(
            [name, *(f"{factor * v if not abs(v) < 1e-9 * largest else 0.0:.5g}" for v in values), unit]
        )
    titles = ["signal", "value" if len(t) == 1 else "min", *(() if len(t) == 1 else ("max", "last")), "unit"]
    shown = _rows(titles, rows[:LISTED])
    if len(rows) > LISTED:
        shown += (
            f"<details><summary>{len(rows) - LISTED} more</summary>{_rows(titles, rows[LISTED:])}</details>"
        )
    return f"<div>{head}</div>{shown}"


def unknowns(
    names: Sequence[str], kinds: Sequence[str], units: Sequence[str], algebraic: Iterable[bool]
) -> str:
    """The equations of a deck: one line an unknown and its row."""
    rows = [
        [name, kind, unit, "F = 0" if plain else "dQ/dt + F = 0"]
        for name, kind, unit, plain in zip(names, kinds, units, algebraic, strict=True)
    ]
    shown = _rows(["unknown", "kind", "unit", "row"], rows[:LISTED])
    if len(rows) > LISTED:
        more = _rows(["unknown", "kind", "unit", "row"], rows[LISTED:])
        shown += f"<details><summary>{len(rows) - LISTED} more</summary>{more}</details>"
    return f"<div><b>{len(rows)} equations</b> d/dt Q(x, t) + F(x, t) = 0</div>{shown}"


def _rows(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table; what begins with a letter stands at the left, numbers at the right."""

    def cells(tag: str, row: Sequence[str]) -> str:
        number = [text[:1] in "-0123456789" for text in (rows or [titles])[0]]
        return "".join(
            f'<{tag} style="text-align: {"right" if number[k] and k else "left"}; padding: 0 0.8em 0 0">{escape(text)}</{tag}>'
            for k, text in enumerate(row)
        )

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return (
        f'<table style="{STYLE}"><thead><tr>{cells("th", titles)}</tr></thead><tbody>{body}</tbody></table>'
    )


def thinned(found: Result, cells: int = CELLS) -> Result:
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
    return Result(found.title, [main], found.diagnostics, found.prints, found.deck)
