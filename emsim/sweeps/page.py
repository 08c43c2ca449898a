"""The page of a sweep: what was run, the measures and the yield as tables, the pictures (pictures.py); one file, no network."""

from __future__ import annotations

import re
from html import escape

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .result import Goal, Swept

STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 54em; padding: 0 1em; color: #222; background: #fff }
table { border-collapse: collapse; margin: 1em 0 } td, th { padding: .2em .9em .2em 0; text-align: right }
td:first-child, th:first-child { text-align: left } th { font-weight: 600; border-bottom: 1px solid #bbb }
svg { max-width: 100%; height: auto } .failed { color: #a02020 }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #181818 } svg { background: #fff } }
"""
MOST_FAILED = 20


def write(swept: Swept, path: str, goals: Sequence[Goal] = ()) -> None:
    """Raises OutsideError where matplotlib is not installed, ValueError, OSError."""
    from ..outputs.beside import write_text

    text = page(swept, goals)
    write_text(path, text)


def page(swept: Swept, goals: Sequence[Goal] = ()) -> str:
    title = escape(swept.title or "A sweep")
    parts = [f"<h1>{title}</h1>", f"<p>{len(swept)} runs: {escape(swept.scheme.label())}</p>"]
    if swept.axes:
        varied = [(a.name, f"{len(a.values)}", f"{a.values[0]:g}", f"{a.values[-1]:g}") for a in swept.axes]
        parts.append(_table(("varied", "values", "first", "last"), varied))
    words = ("mean", "deviation", "least", "greatest")
    about = {name: swept.statistics(name) for name in swept.names}
    rows = [[name, *(f"{a[w]:.6g}" for w in words)] for name, a in about.items() if a["runs"]]
    parts.append(_table(("measure", *words), rows))
    if goals:
        met, runs, low, high = swept.yielded(goals)
        share = f"{100 * met / max(runs, 1):.4g} % ({met} of {runs} runs; 95 % bounds {100 * low:.4g} to {100 * high:.4g} %)"
        parts.append(f"<p><b>Yield {share}</b>: {escape(', '.join(goal.text for goal in goals))}</p>")
    if swept.scheme.name == "sensitivity" and not swept.axes:
        rows = [[name, *(f"{v:.6g}" for v in swept.worst(name))] for name in swept.names]
        parts.append(_table(("worst case", "least", "greatest"), rows))
    for name in about:
        found, said = swept.shares(name)
        lines = [(value, f"{100 * alone:.3g} %", f"{100 * total:.3g} %") for value, alone, total in found]
        parts += [_table((f"what moves {name}", "share of its variance", said), lines)] if lines else []
    if failed := swept.failed:
        shown = [f"<li>run {k}: {escape(why)}</li>" for k, why in list(failed.items())[:MOST_FAILED]]
        parts.append(f'<p class="failed">{len(failed)} runs failed</p><ul>{"".join(shown)}</ul>')
    parts.append(_picture(swept, goals))
    head = f'<meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>{title}</title>'
    return f"<!doctype html><html lang=en><head>{head}<style>{STYLE}</style></head><body>{''.join(parts)}</body></html>\n"


def _picture(swept: Swept, goals: Sequence[Goal]) -> str:
    from io import StringIO

    from .pictures import figure

    out = StringIO()
    figure(swept, goals).savefig(out, format="svg", metadata={"Date": None})
    return re.sub(r"^.*?(?=<svg)", "", out.getvalue(), flags=re.S)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    lines = ["".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows]
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    return f"<table><tr>{top}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
