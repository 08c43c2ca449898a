"""What is printed: print, echo, display, setplot, destroy, listing, show, showmod, version, rusage, settype, setscale."""

from __future__ import annotations

from . import words
from .base import Command
from .errors import CommandError, Stop, usage
from .numbers import LEAST_WIDTH, PAGE, columns, lines_of, number
from .plots import UNITS, WORDS, Plot, Vector
from .session import SHOWN
from .vectors import plot_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import Any

    from .program import Statement
    from .session import Session

PRINT = "print [col] [line] expression .."


def print_(s: Session, text: str, at: Statement) -> None:
    first, _, rest = text.strip().partition(" ")
    kind = first.lower() if first.lower() in ("col", "line") else ""
    vectors = s.vectors((rest if kind else text).lower(), at, lenient=True)
    if not vectors:
        return
    long = next((v for v in vectors if len(v) > 1), None)
    of_device = (
        long is not None
        and long.name.startswith("@")
        and long.plot is not None
        and long.plot.scale is not None
    )
    of_device = of_device and len(long) != len(long.plot.scale)  # type: ignore[union-attr, arg-type]
    width = s.integer("width", 80)
    if kind == "line" or (not kind and (long is None or of_device)):
        lines: Iterable[str] = lines_of(vectors, s.plots.current, s.digits, max(width, 60))
    else:
        page = 10**9 if "nobreak" in s.variables else max(s.integer("height", PAGE), 20)
        scale = "noprintscale" not in s.variables
        lines = columns(
            vectors, plot_of(vectors, s.plots.current), s.digits, max(width, LEAST_WIDTH), page, scale
        )
    for line in lines:
        s.say(line)


def echo(s: Session, text: str, at: Statement) -> None:
    text = words.substituted(s, text, shown=True)
    found = words.split(words.without_commas(text))
    end = "\n"
    if found[:1] == ["-n"]:
        found, end = found[1:], ""
    s.say(" ".join(found), end)


# ---- plots ----


def describe(v: Vector, plot: Plot) -> str:
    kind = (
        "complex"
        if v.is_complex or (v.key == "frequency" and plot.kind in ("ac", "noise", "disto", "sp1"))
        else "real"
    )
    dims = f", dims = [{','.join(map(str, v.dims))}]" if v.dims else ""
    log = plot.table is not None and plot.table.axis is not None and plot.table.axis.log
    grid = ", grid = xlog" if v is plot.scale and log else ""
    default = " [default scale]" if v is plot.scale else ""
    return f"    {v.shown:<20}: {v.type}, {kind}, {len(v)} long{grid}{dims}{default}"


def display(s: Session, text: str, at: Statement) -> None:
    plot = s.plots.current
    if text.strip():
        for name in words.split(text):
            s.say(describe(s.plots.vector(name), plot))
        return
    if not plot.vectors:
        s.say("There are no vectors currently active.")
        return
    s.say("Here are the vectors currently active:\n")
    s.say(f"Title: {plot.title}\nName: {plot.name} ({plot.plotname})\nDate: {plot.date}\n")
    for v in plot.sorted():
        s.say(describe(v, plot))


def setplot(s: Session, text: str, at: Statement) -> None:
    name = text.strip().lower()
    if not name:
        s.say("List of plots available:\n")
        for plot in reversed(s.plots.all):
            mark = "Current " if plot is s.plots.current else "\t"
            s.say(f"{mark}{plot.name}\t{plot.title} ({plot.plotname})")
    elif name == "new":
        s.plots.new("unknown", "Anonymous", "unknown")
    elif name in ("previous", "next"):
        at_ = s.plots.all.index(s.plots.current) + (1 if name == "next" else -1)
        if 0 <= at_ < len(s.plots.all):
            s.plots.current = s.plots.all[at_]
        else:
            s.warn(f"there is no {name} plot")
    else:
        s.plots.current = s.plots.get(name)


def destroy(s: Session, text: str, at: Statement) -> None:
    for name in words.split(text) or [s.plots.current.name]:
        if name.lower() == "all":
            for plot in s.plots.all[1:]:
                s.plots.remove(plot)
            s.plots.counter = 1
        else:
            plot = s.plots.get(name)
            if plot is s.plots.const:
                raise CommandError("E164", "the plot of constants stays")
            s.plots.remove(plot)


def settype(s: Session, text: str, at: Statement) -> None:
    given = words.split(text)
    if len(given) < 2:
        usage("settype type vector ..", "a type and vectors are needed")
    kind = given[0].lower()
    if kind not in UNITS and kind not in WORDS and kind != "notype":
        from ..diagnostics import did_you_mean

        raise CommandError(
            "E162",
            f"there is no type `{kind}`",
            did_you_mean(kind, [*UNITS, *WORDS], "there are " + ", ".join(sorted([*UNITS, *WORDS]))),
        )
    for name in given[1:]:
        v = s.plots.vector(name)
        v.unit, v.derived, v.word = UNITS.get(kind, ""), False, kind if kind in WORDS else ""


def setscale(s: Session, text: str, at: Statement) -> None:
    given = words.split(text)
    if not given:
        scale = s.plots.current.scale
        s.say(describe(scale, s.plots.current) if scale else "There is no scale.")
        return
    scale = s.plots.vector(given[-1])
    if len(given) == 1:
        s.plots.current.scale, s.plots.current.has_scale = scale, True
        return
    for name in given[:-1]:
        s.plots.vector(name).scale = scale


# ---- the deck ----


def listing(s: Session, text: str, at: Statement) -> None:
    """The deck's lines, numbered, comments and continuation lines as they stand."""
    file = s.deck.deck.file
    s.say(f"\t{s.deck.title}\n")
    for k, line in enumerate(file.text.rstrip("\n").split("\n"), 1):
        if line.strip() and not line.lstrip().startswith("*"):
            s.say(f"{k:6} : {line.strip()}")


def show(s: Session, text: str, at: Statement) -> None:
    """Devices with their parameters, and what the current plot knows of them."""
    asked = [w.lower() for w in words.split(text.partition(":")[0])]
    only = [w.lower() for w in words.split(text.partition(":")[2])]
    flat = s.deck.flat()
    found = [
        e
        for e in flat.elements
        if not asked or "all" in asked or any(_is_asked(e.name, e.letter, w) for w in asked)
    ]
    if not found:
        raise CommandError("E166", f"the deck has no element `{' '.join(asked)}`")
    for e in found:
        s.say(f" {e.what.capitalize()}: {e.law or e.form}")
        s.say(f"{'device':>12} {e.name:>20}")
        if e.model_name:
            s.say(f"{'model':>12} {e.model_name:>20}")
        for key, value in _parameters(s, e):
            if not only or key in only or "all" in only:
                s.say(f"{key:>12} {value:>20.6g}")
        s.say("")


def _is_asked(name: str, letter: str, word: str) -> bool:
    return name == word or letter == word or (word[1:2] == "." and name == word[2:])


def _parameters(s: Session, e: Any) -> Iterable[tuple[str, float]]:
    from ..elaborate.altered import VALUES

    seen = set()
    for key in (*VALUES.get(e.letter, ())[:1], *(("dc", "acmag") if e.letter in "vi" else ()), *e.instance):
        value = s.deck.value(e.name, key)
        if isinstance(value, float) and key not in seen:
            seen.add(key)
            yield key, value
    for key in SHOWN:
        known = s.plots.current.find(f"@{e.name}[{key}]") or (
            s.plots.current.find(f"{e.name}#branch") if key == "i" else None
        )
        if known is not None and key not in seen:
            yield key, float(known.values[-1].real)


def showmod(s: Session, text: str, at: Statement) -> None:
    asked = [w.lower().lstrip("#") for w in words.split(text.partition(":")[0])]
    flat = s.deck.flat()
    used = {e.model_name for e in flat.elements if e.model_name and (not asked or e.name in asked)}
    found = [
        m for name, m in flat.models.items() if not asked or "all" in asked or name in asked or name in used
    ]
    if not found:
        s.say("No matching models")
    for m in found:
        s.say(f" {m.type.upper()} models")
        s.say(f"{'model':>12} {m.name:>20}\n")
        for key, value in m.params.items():
            if isinstance(value, float):
                s.say(f"{key:>12} {value:>20.6g}")
        s.say("")


def version(s: Session, text: str, at: Statement) -> None:
    from .._engine import __version__

    s.say(f"emsim {__version__}, .control as ngspice 39 has it")


def rusage(s: Session, text: str, at: Statement) -> None:
    """Counters of the last analysis."""
    plot = s.plots.current
    stats = {} if plot.table is None else plot.table.stats
    s.say(f"Total analysis time (seconds) = {stats.get('seconds', 0.0) or 0.0:.6g}")
    if text.strip().lower() in ("all", "everything"):
        for key, value in stats.items():
            if isinstance(value, (int, float)):
                s.say(f"{key} = {value:g}")


MOST_CODE = 255  # that every system can tell


def quit_(s: Session, text: str, at: Statement) -> None:
    from .numbers import whole

    s.quit = True
    try:
        s.code = whole(text, "the exit code") if text.strip() else None
        if s.code is not None and not 0 <= s.code <= MOST_CODE:
            said = f"{s.code} is no exit code: they go from 0 to {MOST_CODE}"
            s.code = None
            usage("quit [code]", said)
    except CommandError as error:
        s.report(error)
    raise Stop


def passed(s: Session, text: str, at: Statement) -> None:
    """What has no meaning without a screen, a history or ngspice's own files."""


def refused(s: Session, text: str, at: Statement) -> None:
    raise CommandError("E163", f"`{at.word}` is not supported", REFUSED[at.word])


PASSED = """
    bug cdump codemodel pre_codemodel devhelp dump help oldhelp history inventory state mdump mrdump noquery
    rehash use where optran snsave pre_set osdi pre_osdi remzerovec esave sysinfo jobs rspice aspice asciiplot tutorial led wait
    setcs iprint
"""


def shell(s: Session, text: str, at: Statement) -> None:
    s.warn(
        f"`{at.word}` is passed over: there is no shell here", "what the program would have made is missing"
    )


REFUSED = {
    "edit": "edit the deck",
    "circbyline": "write the lines into the deck",
    "snload": "state the start with .ic",
    "wric": "print v(..) gives the values", "wrnodev": "print v(..) gives the values",
    "xgraph": "plot draws", "aclist": "print shows values", "alterinit": "state the start with .ic",
}  # fmt: skip

COMMANDS = (
    Command("print", PRINT + " [> file]", "values, or columns below `Index`", print_, "vectors", shows=True),
    Command(
        "echo",
        "echo [-n] words [> file]",
        "words, with $name and $&vector put in",
        echo,
        raw=True,
        shows=True,
    ),
    Command("display", "display [vector ..]", "the vectors of the current plot", display, shows=True),
    Command(
        "setplot",
        "setplot [name|new|previous|next]",
        "the plots, or which is the current one",
        setplot,
        shows=True,
    ),
    Command("destroy", "destroy [plot ..|all]", "takes plots away", destroy),
    Command("settype", "settype type vector ..", "what a vector is: voltage, current, time ..", settype),
    Command("setscale", "setscale vector", "what the vectors of the plot are over", setscale),
    Command("listing", "listing", "the lines of the deck", listing, shows=True),
    Command(
        "show",
        "show [device ..] [: parameter ..]",
        "elements with their parameters",
        show,
        records=True,
        shows=True,
    ),
    Command("showmod", "showmod [model ..]", "models with their parameters", showmod, shows=True),
    Command("version", "version", "which program this is", version, shows=True),
    Command("rusage", "rusage [all]", "counters of the last analysis", rusage, shows=True),
    *(Command(w, f"{w} [code]", "ends the section, and the run", quit_) for w in ("quit", "exit", "bye")),
    *(
        Command(w, w, "passed over: it has no meaning in a batch run", passed, raw=True)
        for w in PASSED.split()
    ),
    *(Command(w, w, f"not supported: {hint}", refused, raw=True) for w, hint in REFUSED.items()),
    Command("shell", "shell words", "passed over with a warning: there is no shell", shell, raw=True),
)

__all__ = ["COMMANDS", "display", "number"]
