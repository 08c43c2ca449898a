"""Pictures: hardcopy, gnuplot, and plot where it is asked to draw, write a file and name it. Loads matplotlib for that."""

from __future__ import annotations

import re

import numpy as np

from .base import Command
from .errors import CommandError, usage
from .files import curves, target, wrote
from .plots import Vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .program import Statement
    from .session import Session

PLOT = "plot vector .. [vs vector] [xlimit low high] [ylimit low high] [xlog] [ylog] [loglog] [title text]"
# words of plot, with how many values follow
WORDS = {
    **dict.fromkeys("xlimit xl ylimit yl xindices".split(), 2),
    **dict.fromkeys("xcompress xdelta ydelta title xlabel ylabel sgraphid".split(), 1),
    **dict.fromkeys(
        "linear lingrid loglog xlog ylog polar smith smithgrid nogrid linplot combplot pointplot".split(), 0
    ),
    **dict.fromkeys("nointerp samep kicad plainplot digitop retraceplot".split(), 0),
}
MOST_PICTURES = 200


def divided(text: str) -> tuple[str, dict[str, list[str]]]:
    """The vectors, and the words of plot with their values."""
    tokens = re.findall(
        r"\"[^\"]*\"|'[^']*'|[^\s\"'(\[]*(?:\((?:[^()]|\([^()]*\))*\)|\[[^\]]*\]|[^\s\"'(\[]+)+|\S+", text
    )
    kept, options = [], {}
    k = 0
    while k < len(tokens):
        key = tokens[k].lower()
        if key in WORDS:
            options[key] = [t.strip("\"'") for t in tokens[k + 1 : k + 1 + WORDS[key]]]
            k += 1 + WORDS[key]
            continue
        kept.append(tokens[k])
        k += 1
    return " ".join(kept), options


def draw(s: Session, path: str, text: str) -> None:
    listed, options = divided(text)
    if not listed:
        usage(PLOT, "no vector is named")
    found = [c for c in curves(s, listed) if len(c[0])]
    if not found:
        raise CommandError("E164", "there is nothing to draw: what is named holds no numbers")
    found = [c for c in found if c[0] is not (c[0].plot.scale if c[0].plot else None)] or found
    if not path:
        return s.note("plot draws nothing by itself", "--pictures or .options pictures=1 draws, and hardcopy")
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return s.note("no picture is drawn: matplotlib is not installed", "pip install 'emsim[plot]'")
    figure = Figure(figsize=(8, 5), layout="constrained")
    axes: Any = figure.add_subplot()
    for v, x, _ in found:
        y = v.values
        if np.iscomplexobj(y):
            y = np.abs(y) if np.any(y.imag) else y.real
        style = "." if "pointplot" in options or len(x) == 1 else "-"
        axes.plot(np.nan_to_num(x, nan=np.nan), y, style, label=v.name)
    _axes(s, axes, found, options)
    axes.legend(loc="best")
    axes.set_title(next(iter(options.get("title", [])), s.plots.current.title))
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise CommandError("E163", f"cannot write {path}: {error}") from None
    wrote(s, path)
    s.note(f"the picture is {path}")


def _axes(
    s: Session, axes: Any, found: list[tuple[Vector, np.ndarray, str]], options: dict[str, list[str]]
) -> None:
    v, x, name = found[0]
    table = v.plot.table if v.plot is not None else None
    log = table is not None and table.axis is not None and table.axis.log and name == table.axis.name
    if ("xlog" in options or "loglog" in options or log) and np.all(x > 0):
        axes.set_xscale("log")
    if "ylog" in options or "loglog" in options:
        axes.set_yscale("log")
    units = {v.unit for v, _, _ in found}
    axes.set_xlabel(next(iter(options.get("xlabel", [])), name))
    axes.set_ylabel(next(iter(options.get("ylabel", [])), units.pop() if len(units) == 1 else ""))
    axes.grid("nogrid" not in options)
    limited = {"xlimit": axes.set_xlim, "xl": axes.set_xlim, "ylimit": axes.set_ylim, "yl": axes.set_ylim}
    for key, set_ in limited.items():
        if key in options:
            limits = s.numbers(" ".join(options[key]))
            log = (axes.get_xscale() if key[0] == "x" else axes.get_yscale()) == "log"
            if log and min(limits) <= 0:
                s.warn(f"{key} has no effect: a logarithmic axis begins above 0")
            elif len(limits) == 2 and limits[0] != limits[1] and all(map(np.isfinite, limits)):
                set_(*limits)


def plot(s: Session, text: str, at: Statement) -> None:
    number = s.pictures + s.draws
    if number > MOST_PICTURES:
        raise CommandError("E165", f"{MOST_PICTURES} pictures are the most")
    draw(s, target(s, f"{s.stem}-{number}.png") if s.draws else "", text)
    s.pictures = number


def _file(text: str, form: str) -> tuple[str, str]:
    name, _, rest = text.strip().partition(" ")
    return (name, rest) if rest.strip() else usage(form, "a file and vectors are needed")


def hardcopy(s: Session, text: str, at: Statement) -> None:
    name, rest = _file(text, "hardcopy file vector ..")
    kind = str(s.variables.get("hcopydevtype", "svg")).lower()
    _, dot, extension = name.rpartition(".")
    if not dot or extension.lower() not in ("svg", "png", "pdf", "ps", "eps"):
        name += ".ps" if kind == "postscript" else ".svg" if kind == "svg" else ".png"
    draw(s, target(s, name), rest)


def gnuplot(s: Session, text: str, at: Statement) -> None:
    """The picture that gnuplot would draw, and the data beside it."""
    name, rest = _file(text, "gnuplot file vector ..")
    draw(s, target(s, name + ".png"), rest)


COMMANDS = (
    Command("plot", PLOT, "draws into DECK-1.png, .. with --pictures", plot, records=True),
    Command("hardcopy", "hardcopy file vector ..", "draws a picture into that file", hardcopy, records=True),
    Command("gnuplot", "gnuplot name vector ..", "draws a picture into name.png", gnuplot, records=True),
)
