"""What is written and read: write, wrdata, load, source. Only below the working directory and the deck's folder, only what
results are stored in, and over nothing but results and what emsim itself has written."""

from __future__ import annotations

import os

import numpy as np

from ..diagnostics import OutsideError
from ..outputs import written
from . import words
from .base import Command
from .budget import RESULTS
from .errors import CommandError, usage
from .plots import Plot, Vector, column_name
from .vectors import Evaluator, _stretched

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..table import Table
    from .program import Statement
    from .session import Session

DIGITS = 8  # of wrdata


def folders(s: Session) -> list[str]:
    path = s.deck.deck.file.path
    return [
        os.path.realpath(f)
        for f in (os.getcwd(), *([os.path.dirname(os.path.abspath(path))] if path else []))
    ]


def is_inside(s: Session, path: str) -> bool:
    """Below the working directory or the deck's folder?"""
    real = os.path.realpath(path)
    return any(os.path.commonpath([real, f]) == f for f in folders(s))


def target(s: Session, name: str, plain: bool = False) -> str:
    """A path that a command may write, `plain`: without an ending too. Raises CommandError for one outside, for what is no file
    of results, and for a file that is there and is neither results nor emsim's own."""
    path = os.path.join(s.folder, name)
    if not name or "\0" in name or name.startswith("~"):
        hint = "write it into the working directory or the deck's folder"
        raise CommandError("E163", f"`{name}` is no name of a file here", hint)
    real = os.path.realpath(path)
    if not is_inside(s, path):
        raise CommandError("E163", f"`{name}` lies outside of the working directory and the deck's folder")
    base = os.path.basename(real)
    suffix = base.rpartition(".")[2].lower() if "." in base else ""
    if base.startswith(".") or (suffix not in RESULTS and not (plain and base == base.partition(".")[0])):
        said = f"`{name}` is no file of results: commands write " + " ".join("." + one for one in RESULTS)
        raise CommandError("E163", said, f"{base.strip('.').partition('.')[0] or 'results'}.txt")
    if real in (*s.own, *map(os.path.realpath, s.deck.deck.named)):
        raise CommandError("E163", f"`{name}` is a file of the deck", "call the file otherwise")
    if os.path.exists(real) and not os.path.isfile(real):
        raise CommandError("E163", f"`{name}` is no file")
    if not os.path.isdir(os.path.dirname(real)):
        raise CommandError("E163", f"there is no folder for `{name}`")
    if os.path.exists(real) and path not in s.files and not written.is_ours(real):
        if not written.holds_results(real):
            hint = "remove it, or write to another name; results are written over, and what emsim wrote"
            raise CommandError("E163", f"`{name}` is there already, and holds no results", hint)
        s.note(f"`{name}` was there, and is written over")
    return path


def readable(s: Session, name: str) -> str:
    """A path that a command may read: in the working directory, or beside the deck."""
    for folder in (s.folder, os.path.dirname(s.deck.deck.file.path or "")):
        path = os.path.join(folder, name)
        if os.path.isfile(path):
            if not is_inside(s, path):
                raise CommandError(
                    "E163", f"`{name}` lies outside of the working directory and the deck's folder"
                )
            return path
    raise CommandError("E166", f"there is no file `{name}`")


def cd(s: Session, text: str, at: Statement) -> None:
    """Where files are written from here on; without a name the working directory."""
    name = (words.split(text) or [""])[0]
    path = os.path.join(s.folder, name) if name else ""
    if name and not (os.path.isdir(path) and is_inside(s, path)):
        raise CommandError("E163", f"`{name}` is no folder below the working directory or the deck's folder")
    s.folder = path


def getcwd(s: Session, text: str, at: Statement) -> None:
    s.say(os.path.abspath(s.folder))


def wrote(s: Session, path: str) -> None:
    written.remember(path)
    if path not in s.files:
        s.files.append(path)


def put(s: Session, path: str, text: str, behind: bool) -> None:
    """Text into a file that `target` has allowed, `behind` what it has."""
    s.budget.make(len(text))
    try:
        with open(path, "a" if behind else "w", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise CommandError("E163", f"cannot write {path}: {error.strerror or error}") from None
    wrote(s, path)


def tables_of(s: Session, vectors: list[Vector]) -> list[Table]:
    """Vectors as tables, plot by plot, each with its scale in front."""
    from ..store import Columns
    from ..table import Table

    found = []
    plots: list[Plot] = []
    for v in vectors:
        plot = v.plot or s.plots.current
        if plot not in plots:
            plots.append(plot)
    for plot in plots:
        own = [v for v in vectors if (v.plot or s.plots.current) is plot]
        scale = plot.scale
        if scale is not None:
            own = [scale, *(v for v in own if v.key != scale.key)]
        rows = max(map(len, own))
        store = Columns(
            (np.ascontiguousarray(_stretched(v.values, rows)).tobytes() for v in own),
            complex=[v.is_complex for v in own],
        )
        axis = plot.table.axis if plot.table is not None and _is_first(plot) else plot.has_scale
        names, units = [column_name(_stored(plot, v), plot) for v in own], [v.unit for v in own]
        found.append(
            Table(plot.kind, names, units, store, title=plot.title, axis=axis, plotname=plot.plotname)
        )
    return found


def _is_first(plot: Plot) -> bool:
    """Is what the vectors are over still what the analysis said?"""
    return plot.table is not None and plot.scale is plot.find(plot.table.names[0])


def _stored(plot: Plot, v: Vector) -> Vector:
    """The plot's own vector, where a list named it: tran1.v(out) is v(out) of tran1."""
    for name in (v.name, v.name.partition(".")[2]):
        known = plot.find(name) if name else None
        if known is not None and known.values is v.values:
            return known
    return v


def write(s: Session, text: str, at: Statement) -> None:
    from ..outputs import raw
    from ..result import Result

    given = text.strip()
    name, _, rest = given.partition(" ")
    path = target(s, name.strip("\"'") or "rawspice.raw", plain=True)
    vectors = s.vectors(rest.strip() or "all", at)
    s.budget.make(sum(v.values.nbytes for v in vectors))
    ascii = str(s.variables.get("filetype", "binary")).lower() == "ascii"
    result = Result(s.deck.title, tables_of(s, vectors))
    try:
        if "appendwrite" in s.variables and os.path.exists(path):
            for table in result.plots:
                with open(path, "ab") as file:
                    raw.write_table(file, table, ascii)
        else:
            raw.write(path, result, ascii=ascii)
    except OSError as error:
        raise CommandError("E163", f"cannot write {path}: {error.strerror or error}") from None
    wrote(s, path)
    s.say(f'{"ASCII" if ascii else "binary"} raw file "{path}"')


def curves(s: Session, text: str) -> list[tuple[Vector, np.ndarray, str]]:
    """(vector, what it is over, the name of that) of a list with `vs` in it."""
    text = words.without_braces(text)
    tree = s.tree(text, "vectors")
    evaluator = Evaluator(s, text)
    found: list[tuple[Vector, np.ndarray, str]] = []
    waiting: list[Vector] = []
    items = list(tree[1])
    k = 0
    while k < len(items):
        if items[k].__class__ is not tuple and items[k].type == "VERSUS":
            if k + 1 >= len(items) or not waiting:
                usage("vector vs vector", "`vs` stands between vectors")
            over = evaluator.named(items[k + 1])[0]
            found += [(v, over.values.real, over.name) for v in waiting]
            waiting, k = [], k + 2
            continue
        waiting += evaluator.named(items[k])
        k += 1
    for v in waiting:
        plot = v.plot or s.plots.current
        scale = v.scale or plot.scale
        if scale is not None and len(scale) == len(v):
            name = plot.scale.name if plot.scale is not None and v.scale is not None else scale.name
            found.append((v, scale.values.real, name))
        else:
            found.append((v, np.arange(len(v), dtype=float), "index"))
    for v, x, _ in found:
        if len(x) != len(v):
            raise CommandError("E164", f"`{v.name}` has {len(v)} numbers over {len(x)}")
    return found


def wrdata(s: Session, text: str, at: Statement) -> None:
    """Columns of text: before each vector its scale (`set wr_singlescale`: once), of complex ones two columns."""
    name, _, rest = text.strip().partition(" ")
    if not rest.strip():
        usage("wrdata file vector .. [vs vector]", "a file and vectors are needed")
    path = target(s, name.strip("\"'"), plain=True)
    found = curves(s, rest.strip())
    vectors = [v for v, _, _ in found]
    digits = s.digits if "numdgt" in s.variables else DIGITS
    s.budget.make((digits + 8) * sum(map(len, vectors)))
    single = "wr_singlescale" in s.variables
    if single and len({len(v) for v in vectors}) > 1:
        raise CommandError("E164", "with wr_singlescale the vectors need one length")
    columns: list[tuple[str, list[float] | None]] = []
    for k, (v, x, over) in enumerate(found):
        scale = (v.plot or s.plots.current).scale
        if (not single or not k) and (scale is not None or over != "index"):
            columns.append((scale.name if scale is not None and over == "index" else over, x.tolist()))
        if v.is_complex:
            columns += [(v.name, v.values.real.tolist()), (v.name, v.values.imag.tolist())]
        else:
            columns.append((v.name, v.values.tolist()))
    wide = digits + 7
    lines = []
    if "wr_vecnames" in s.variables:
        lines.append("".join(f" {title:<{wide}}" for title, _ in columns))
    for row in range(max(map(len, vectors))):
        cells = [
            f"{values[row]: .{digits}e} " if values is not None and row < len(values) else " " * (wide + 1)
            for _, values in columns
        ]
        lines.append("".join(cells))
    put(s, path, "\n".join(lines) + "\n", "appendwrite" in s.variables)


WAVES = ("s_1_1", "s_2_1", "s_1_2", "s_2_2")
TOUCHSTONE = "wrs2p [file]"


def wrs2p(s: Session, text: str, at: Statement) -> None:
    """S parameters of two ports as a Touchstone file; the vector Rbase is the resistance of the ports."""
    path = target(s, (words.split(text) or ["s_param.s2p"])[0])
    frequency, *waves = (s.plots.vector(name) for name in ("frequency", *WAVES))
    ports = s.plots.known("rbase")
    if ports is None:
        raise CommandError("E162", "the resistance of the ports is not known", "let Rbase = 50 before wrs2p")
    if any(len(w) != len(frequency) or w.dims for w in waves):
        raise CommandError("E164", f"{', '.join(WAVES)} have one value at each frequency")
    digits = s.digits if "numdgt" in s.variables else DIGITS - 2
    titles = ["freq", *(part + name.upper().replace("_", "") for name in WAVES for part in ("Re", "Im"))]
    lines = [
        "!2-port S-parameter file",
        f"!Title: {s.plots.current.title}",
        f"!Generated by emsim at {s.plots.current.date}",
        f"# Hz S RI R {ports.values[0].real:g}",
        "!" + "  ".join(f"{title[:5]:<{digits + 8}}" for title in titles),
    ]
    for f, *row in zip(frequency.values.real, *(w.values.astype(complex) for w in waves), strict=True):
        numbers = [f, *(part for z in row for part in (z.real, z.imag))]
        lines.append("".join(f"{x: .{digits}e}  " for x in numbers))
    put(s, path, "\n".join(lines) + "\n", False)


def load(s: Session, text: str, at: Statement) -> None:
    """A raw file's plots."""
    from ..outputs import raw

    for name in words.split(text) or ["rawspice.raw"]:
        path = readable(s, name)
        s.say(f'Loading raw data file ("{name}") ... ', end="")
        try:
            result = raw.read(path)
        except (ValueError, OSError, OutsideError) as error:
            raise CommandError("E166", f"`{name}` is no raw file: {error}") from None
        s.say("done.")
        for table in result.plots:
            s.plots.new(table.kind or "unknown", table.title or result.title, table.plotname, table)
            s.say(f"Title:  {table.title}\nName: {table.plotname}\nDate: {s.plots.current.date}\n")


def source(s: Session, text: str, at: Statement) -> None:
    """The commands of another file, carried out here."""
    from ..source import Line
    from ..source import load as load_file

    for name in words.split(text):
        path = readable(s, name)
        try:
            file = load_file(path, at.span)
        except (OSError, ValueError) as error:
            raise CommandError("E166", f"cannot read `{name}`: {error}") from None
        lines, start, within, has_section = [], 0, False, ".control" in file.text.lower()
        for number, line in enumerate(file.text.split("\n"), 1):
            word = line.strip().lower()
            if word in (".control", ".endc"):
                within = word == ".control"
            elif word and (within or not has_section) and not (number == 1 and word.startswith("*")):
                lines.append(Line(file, number, 1, start, start + len(line)))
            start += len(line) + 1
        if has_section and any(
            w.strip()[:1].lower() in "rcvil"
            for w in file.text.lower().split(".control")[0].split("\n")[1:]
            if w.strip()
        ):
            raise CommandError(
                "E163", f"`{name}` is a deck of its own", "run it by itself; source takes a file of commands"
            )
        s.source(lines, f"`{name}`")


COMMANDS = (
    Command(
        "write",
        "write file [vector ..]",
        "a raw file; `set filetype=ascii`, `set appendwrite`",
        write,
        records=True,
    ),
    Command(
        "wrdata",
        "wrdata file vector .. [vs vector]",
        "columns of text; `set wr_singlescale`, `set wr_vecnames`",
        wrdata,
        records=True,
    ),
    Command(
        "wrs2p", TOUCHSTONE, "S parameters of two ports as a Touchstone file; `let Rbase = 50` before", wrs2p
    ),
    *(
        Command(w, f"{w} [folder]", "where files are written and read from here on", cd)
        for w in ("cd", "chdir")
    ),
    Command("getcwd", "getcwd", "that folder", getcwd, shows=True),
    Command("load", "load file ..", "the plots of a raw file", load),
    Command("source", "source file", "the commands of a file, carried out here", source),
)
