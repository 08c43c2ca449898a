"""One self-contained HTML page of a run: waveforms and the moving machine on one clock, no network.

The page is web/page.html with the styles, uPlot (vendored, MIT, see web/vendor/LICENSE-uPlot) and the scripts of web/,
deflated, and the run as JSON in it. Columns travel as float32 (the axis as float64, and what float32 cannot hold): their
bytes are laid side by side by significance, deflated, base64; of a complex column real and imaginary parts, one after the
other. An ordinary planar page stays below 200 kB. web/data.js unpacks them.

The machine's channels are taken at no more than FRAMES times: a film needs no more, waveforms keep every point. A run whose
columns would come to more than MOST characters is thinned (thin.py) to what can be seen, and the page says how far.
"""

from __future__ import annotations

import re
from array import array
from base64 import b64decode, b64encode
from bisect import bisect_right
from functools import cache
from html import escape
from json import dumps
from math import inf, isfinite, log10
from os.path import dirname, exists, join
from zlib import compress, decompress

from .. import functions
from ..diagnostics import render_text
from .beside import write_text
from .thin import size, thinned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from ..diagnostics import Diagnostic
    from ..outcome import Outcome
    from ..readers.surface import Surface
    from ..store import Scene
    from ..table import Table

FRAMES = 1500
LEAST = 60  # ... of which a run of several has this many at least
MOST = 440_000  # characters of a run in a file; scripts and styles take 110 000 more
SHOWN = 8  # signals drawn at first where the deck has no .print
WEB = join(dirname(__file__), "web")
GLYPHS = "glyphs"  # the script that is made of outputs/glyphs/
FUNCTIONS = "functions"  # the one that is made of functions.py
SCRIPTS = (
    "vendor/uPlot.iife.min.js",
    "data.js",
    FUNCTIONS,
    "waves.js",
    "spectrum.js",
    "measure.js",
    "export.js",
    "link.js",
    "knobs.js",
    GLYPHS,
    "pen.js",
    "solids.js",
    "lit.js",
    "machine.js",
    "circuit.js",
    "energy.js",
    "bench.js",
    "app.js",
)
STYLES: tuple[str, ...] = (
    "page.css",
    "vendor/uPlot.min.css",
    "sheets.css",
    "circuit.css",
    "knobs.css",
    "bench.css",
)
ENGINE_FILE = "engine.lzma"  # engine/page.sh makes it
ENGINE = (
    "lzma.js",
    "meas.js",
    "engine.js",
    "running.js",
    "hands.js",
)  # of pages that compute, before the last script

Sheet = tuple[str, str, str]  # name, title, inner HTML
PACKED = "deflate:"
ENDS = {"failed": "failed", "interrupted": "was interrupted"}


def write(
    path: str,
    result: Outcome,
    deck: str = "",
    sheets: Iterable[Sheet] = (),
    engine: dict[str, Any] | None = None,
) -> None:
    """Writes the page; with an `engine` (fmus/page.py) it computes too.

    OSError as open() raises it; ValueError when no analysis ran."""
    if not result.plots:
        raise ValueError("no analysis ran, so there is nothing to show")
    run = document(result, deck or result.deck, sheets, MOST)
    write_text(path, page(run if engine is None else {**run, "engine": engine}))


def page(
    run: dict[str, Any],
    scripts: Sequence[str] = SCRIPTS,
    styles: Sequence[str] = STYLES,
    beside: str | None = None,
) -> str:
    """The whole page around one run; scripts and styles by their names in web/, GLYPHS and FUNCTIONS. Where many pages share
    them, `beside` is the way from this one to the folder with the files of `shared`."""
    engine = "engine" in run
    parts = {
        "title": escape(run["title"]),
        # a deck may hold "</script>"; inside JSON the slash can be escaped
        "run": dumps(run, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c"),
        "own": "", "beside": "", "engine": "", "code": "",
    }  # fmt: skip
    if beside is None:
        parts["style"] = _style(styles[:1])
        parts["code"] = _code((*scripts[:-1], *ENGINE, scripts[-1]) if engine else scripts, styles)
        parts["engine"] = _engine() if engine else ""
    else:
        parts["own"], parts["style"] = "'self' ", f'@import url("{beside}page.css");'
        files = ("page.js", "engine.js") if engine else ("page.js",)
        parts["beside"] = "".join(f'<script src="{beside}{name}"></script>\n' for name in files)
    # in one pass: a title may read {{run}}
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _file("page.html"))


def shared() -> dict[str, str]:
    """The files that pages with `beside` take their styles, scripts and engine from: name -> text."""

    def put(where: str, text: str) -> str:
        return f'document.getElementById("{where}").textContent="{text}";\n'

    code = _code((*SCRIPTS[:-1], *ENGINE, SCRIPTS[-1]), STYLES)
    files = {"page.css": _style(STYLES[:1]), "page.js": put("code", code)}
    return {**files, "engine.js": put("engine-code", _engine())} if exists(join(WEB, ENGINE_FILE)) else files


def _style(names: Sequence[str]) -> str:
    return "\n".join(_lean(_file(name)) for name in names)


def _code(names: Sequence[str], styles: Sequence[str]) -> str:
    """The scripts, deflated, and before them all styles but the first: of what scripts make."""
    made = f"Object.assign(document.createElement('style'),{{textContent:{dumps(_style(styles[1:]))}}})"
    return _deflated(
        "\n".join(
            [
                f"document.head.append({made});",
                *(_file(name) if "/" in name else _lean(_file(name)) for name in names),
            ]
        )
    )


def _engine() -> str:
    with open(join(WEB, ENGINE_FILE), "rb") as file:
        return b64encode(file.read()).decode("ascii")


def document(
    result: Outcome, deck: str = "", sheets: Iterable[Sheet] = (), most: float = inf
) -> dict[str, Any]:
    """The run as the page's scripts take it; `most`: characters of its columns, thinned where they would take more."""
    table = result.main
    said = list(result.diagnostics)
    sheets = [*_numbers(result), *sheets]
    sheets = [*sheets, deck_sheet(deck, said), *_messages(said)] if deck or said else sheets
    others = [t for t in result.plots if t is not table and len(t)]
    run: dict[str, Any] = {"title": result.title or "emsim", "printed": bool(result.prints), "scene": None}
    pictures: list[str] = []
    meshes: list[Surface] = []
    run["others"] = [
        {**_drawings(t, most / 16, pictures, meshes), **_plot(result, t, most / 8)} for t in others
    ]
    if table.energy is not None and table.axis and len(table) > 1:
        run["energy"] = _energy(table.energy)
        sheets = [("energy", "Energy", ""), *sheets]
    run.update(_drawings(table, most / 4, pictures, meshes))
    run["pictures"], run["meshes"] = pictures, [*map(_mesh, meshes)]
    run["sheets"] = list(sheets)
    # what the rest leaves
    room = max(most - len(dumps(run)), most / 4) if most < inf else most
    return {**run, **_plot(result, table, room)}


def _plot(result: Outcome, table: Table, most: float) -> dict[str, Any]:
    """One analysis: what it is, and its columns or its one point."""
    run: dict[str, Any] = {
        "kind": table.kind, "facts": _facts(table),
        "error": None if table.status == "ok" else f"This run {ENDS[table.status]}: it ends before its time.",
        "rows": len(table) if table.axis and len(table) > 1 else 0,
        "axisName": table.names[0] if table.names else "", "axisUnit": table.units[0] if table.units else "",
        "axisLog": table.axis is not None and table.axis.log,
        "names": table.signals, "units": table.units[1:] if table.axis else table.units,
        "complex": [table.is_complex(name) for name in table.signals],
        "shown": shown(result, table),
    }  # fmt: skip
    steps = table.step_values() if table.steps else []
    run["courses"] = [", ".join(f"{name} = {value:.6g}" for name, value in step.items()) for step in steps]
    if table.kind == "pz" and len(table):
        # every pole and zero of every step, [real part, imaginary part, step]
        found = [(name, *table.parts(name)) for name in table.signals if name.startswith(("pole(", "zero("))]
        run["roots"] = [
            [name, [[re[k], im[k], k] for k in range(len(table)) if isfinite(re[k]) and isfinite(im[k])]]
            for name, re, im in found
        ]
        if table.axis and not steps:
            run["courses"] = [f"{table.names[0]} = {value:.6g}" for value in table.parts(0)[0]]
        run["rows"] = 0
    if not run["rows"] and len(table):
        # an operating point
        run["point"] = [[_number(part[-1]) for part in table.parts(name)] for name in table.signals]
    if run["rows"]:
        run.update(_columns(table, [first for first, _ in table.blocks()[1:]], most))
    return run


def _drawings(table: Table, most: float, pictures: list[str], meshes: list[Surface]) -> dict[str, Any]:
    """Machine and circuit beside a table, or beside each run of a deck with .step, from which row on it stands in the table."""
    own = table.courses() if table.circuit is None and table.scene is None else [table]
    drawn, first = [t for t in own if t.scene is not None or t.circuit is not None], 0
    found: list[dict[str, Any]] = []
    for t in own:
        if t in drawn:
            found.append(
                {
                    "first": first,
                    "rows": len(t),
                    **_drawing(t, most / len(drawn), FRAMES // len(drawn), pictures, meshes, t is table),
                }
            )
        first += len(t)
    return {"runs": found} if len(own) > 1 and found else found[0] if found else {}


def _drawing(
    table: Table, most: float, count: int, pictures: list[str], meshes: list[Surface], whole: bool
) -> dict[str, Any]:
    """`whole`: the page has the columns of this table, and these are not sent twice."""
    if not len(table):
        return {}
    axis = (
        array("d", range(len(table))) if table.steps else table.floats(0) if table.axis else array("d", [0.0])
    )
    log = bool(table.axis and table.axis.log and min(axis) > 0)
    rows, found = frames(array("d", map(log10, axis)) if log else axis, max(count, LEAST)), {}
    if table.scene is not None:
        own = axis if table.scene.axis is None else table.scene.axis
        kept = rows if table.scene.axis is None else frames(own, max(count, LEAST))
        found["scene"] = _scene(table.scene, own, kept, most)
        found["scene"]["meshes"] = [*range(len(meshes), len(meshes) + len(table.scene.data["meshes"]))]
        meshes += table.scene.data["meshes"]
    if table.circuit is not None:
        known = [] if not whole or any(map(table.is_complex, range(len(table.names)))) else table.signals
        found["circuit"] = _circuit(table.circuit, axis, rows, known, most, pictures)
        found["circuit"]["axisName"] = table.axis.name if table.axis else ""
    return found


def pack(values: array[float] | array[int]) -> str:
    """Bytes side by side by significance, deflated, base64; little-endian on every machine."""
    width = values.itemsize
    data = values.tobytes()
    return b64encode(compress(b"".join(data[k::width] for k in range(width)), 9)).decode("ascii")


def packed_sheet(name: str, title: str, inner: str) -> Sheet:
    """A sheet whose HTML travels deflated, as columns do; web/app.js unpacks it."""
    return name, title, PACKED + _deflated(inner)


def inflated(text: str) -> str:
    return decompress(b64decode(text)).decode()


def _deflated(text: str) -> str:
    return b64encode(compress(text.encode(), 9)).decode("ascii")


def _mesh(surface: Surface) -> dict[str, Any]:
    """Points in whole steps, the coordinates one after the other; faces as how far each number is from the one three before."""
    points = array("H", surface.points.T.tobytes())
    flat = surface.faces.ravel().tolist()
    ahead = array("i", (k - j for k, j in zip(flat, [0, 0, 0, *flat], strict=False)))
    return {"points": pack(points), "count": len(surface.points), "faces": pack(ahead), "corners": len(flat),
            "low": surface.low.tolist(), "step": surface.step}  # fmt: skip


def _columns(table: Table, starts: Sequence[int], most: float) -> dict[str, Any]:
    """Axis and columns, every row or, over time, thinned to about `most` characters: what is small beside the largest counts in
    a spectrum, and is nothing beside the range of a course."""
    if table.names[0] != "time" or any(map(table.is_complex, range(len(table.names)))):
        most = inf
    axis, columns = table.floats(0), [numbers for _, _, numbers in table.flat()[1:]]
    packed, total = [], 0
    for column in (axis, *map(single, columns)):
        packed.append(pack(column))
        total += len(packed[-1])
        if total > most and (found := thinned(axis, columns, starts, most)) is not None:
            return found
    return {"axis": packed[0], "packed": packed[1:], "blocks": starts}


def _number(value: float) -> float | None:
    return value if isfinite(value) else None


def single(values: Sequence[float]) -> array[float]:
    """float32, or float64 where a finite number does not fit into it."""
    single = array("f", values)
    if isfinite(sum(single)) or all(isfinite(v) == isfinite(s) for v, s in zip(values, single, strict=True)):
        return single
    return array("d", values)


def _scene(scene: Scene, time: array[float], rows: Sequence[int], most: float) -> dict[str, Any]:
    axis, columns, channels = array("d", (time[r] for r in rows)), [], []
    for k, channel in enumerate(scene.data["channels"]):
        column = array("d")
        column.frombytes(scene.waves.column(k))
        columns.append(array("f", (column[r] for r in rows)))
        # arrows are drawn in parts of the largest value, whichever rows are kept
        channels.append({**channel, "top": max(map(abs, filter(isfinite, column)), default=0.0)})
    found = {
        **scene.data,
        "channels": channels,
        "rows": len(rows),
        "axis": pack(axis),
        "packed": [*map(pack, columns)],
    }
    if sum(map(size, found["packed"])) > most:
        found.update(thinned(axis, columns, (), most) or {})
    return found


def _circuit(
    circuit: Scene,
    time: array[float],
    rows: Sequence[int],
    known: Sequence[str],
    most: float,
    pictures: list[str],
) -> dict[str, Any]:
    """The circuit's pictures and flows, with the columns that the page does not have already. Colours and dots show three and a
    half digits: the rest of a float32 is left out and packs to nothing. A complex column is two, real and imaginary parts.
    `pictures` are those of the page so far; the circuit says which of them is its own."""
    if "refused" in circuit.data:
        return {**circuit.data, "rows": 0}
    picture = _deflated(dumps(circuit.data["pictures"], separators=(",", ":")))
    if picture not in pictures:
        pictures.append(picture)
    own = [k for k, channel in enumerate(circuit.data["channels"]) if channel["name"] not in known]
    axis, columns = array("d", (time[r] for r in rows)), []
    complex = any(getattr(circuit.waves, "complex", ()))
    for k in own:
        column = array("d")
        column.frombytes(circuit.waves.column(k))
        for part in (column[::2], column[1::2]) if complex else (column,):
            columns.append(_coarse(part[r] for r in rows))
    data = {**circuit.data, "pictures": pictures.index(picture), "own": own, "complex": complex}
    data.update(rows=len(rows), axis=pack(axis))
    found = {**data, "packed": [*map(pack, columns)]}
    if sum(map(size, found["packed"])) > most:
        found.update(thinned(axis, columns, (), most) or {})
    return found


def _coarse(values: Iterable[float]) -> array[float]:
    bits = array("I", array("f", (max(-3e38, min(3e38, v)) if v == v else 0.0 for v in values)).tobytes())
    return array("f", array("I", (b & 0xFFFFF000 for b in bits)).tobytes())


def _energy(ledger: Any) -> dict[str, Any]:
    """The ledger; its course over time at no more than FRAMES times."""
    found: dict[str, Any] = {**ledger.to_dict(), "summary": ledger.summary(), "rows": 0}
    if ledger.trace is not None and len(ledger.trace["time"]) > 1:
        time = ledger.trace["time"]
        rows = frames(time)
        found["rows"] = len(rows)
        found["axis"] = pack(array("d", (time[r] for r in rows)))
        found["packed"] = [
            pack(single([ledger.trace[key][r] for r in rows]))
            for key in ("supplied", "dissipated", "stored", "residual")
        ]
    return found


def frames(time: array[float], most: int = FRAMES) -> Sequence[int]:
    """Rows to keep for a film: all, or the ones nearest to equal times; the last always."""
    if len(time) <= most:
        return range(len(time))
    first, last = time[0], time[-1]
    rows = sorted({bisect_right(time, first + (last - first) * k / (most - 1)) - 1 for k in range(most)})
    return rows if rows[-1] == len(time) - 1 else [*rows, len(time) - 1]


def _facts(table: Table) -> str:
    points = "1 point" if len(table) == 1 else f"{len(table)} points"
    parts = [table.plotname, points]
    if method := table.stats.get("method"):
        parts.append(str(method))
    return " \u00b7 ".join(parts)


def shown(result: Outcome, table: Table) -> list[str]:
    """What .print asks for; else the machine's coordinates and forces and the voltages that move."""
    printed = [n for kind, names in result.prints if kind == table.kind for n in names if n in table.signals]
    if printed:
        return list(dict.fromkeys(printed))
    moving = [
        n
        for n in table.signals
        if n not in table.steps and any(len(c) and max(c) > min(c) for c in table.parts(n))
    ]
    order = ("angle(", "pos(", "x(", "y(", "v(", "torque(", "force(", "i(", "omega(", "vel(")

    def rank(name: str) -> int:
        return next((k for k, word in enumerate(order) if name.startswith(word)), len(order))

    return sorted(moving, key=rank)[:SHOWN] or table.signals[:SHOWN]


def _numbers(result: Outcome) -> list[Sheet]:
    """What .meas and .four found."""
    found: list[Sheet] = []
    if result.measured:
        head = [
            "",
            *(", ".join(f"{n} = {v:g}" for n, v in step.items()) for step in result.steps or [{}]),
            "unit",
        ]
        rows: dict[str, list[str]] = {}
        for one in result.measured:
            value = (
                "not found"
                if one.trouble
                else " ".join([f"{one.value:.7g}", *(f"{k} {v:.7g}" for k, v in one.more.items())])
            )
            rows.setdefault(one.name, [one.unit]).append(value)
        cells = [[name, *values, unit] for name, (unit, *values) in rows.items()]
        found.append(("measures", "Measurements", _table([head, *cells] if result.steps else cells)))
    if result.spectra:
        blocks = []
        for spectrum in result.spectra:
            step = result.steps[spectrum.step] if spectrum.step < len(result.steps) else {}
            name = ", ".join([spectrum.signal, *(f"{n} = {v:g}" for n, v in step.items())])
            head = ["", "Hz", spectrum.unit, "degrees", "of the first"]
            rows_of = [
                [str(h.k), f"{h.frequency:g}", f"{h.magnitude:.6g}", f"{h.phase:.4g}", f"{h.normalised:.4g}"]
                for h in spectrum.harmonics
            ]
            blocks.append(f"<p>{escape(name)}: THD {spectrum.thd:.4g} %</p>{_table([head, *rows_of])}")
        found.append(("harmonics", "Harmonics", "".join(blocks)))
    return found


def _table(rows: Sequence[Sequence[str]]) -> str:
    lines = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in rows)
    return f'<table class="numbers">{"".join(f"<tr>{line}</tr>" for line in lines)}</table>'


def deck_sheet(deck: str, said: Sequence[Diagnostic]) -> Sheet:
    """The deck's text by lines, those with an error marked."""
    bad = {d.span.in_deck.line for d in said if d.span is not None and d.severity == "error"}
    lines = [
        f'<span id="line-{k}"{" class=bad" if k in bad else ""}>{escape(line)}</span>'
        for k, line in enumerate(deck.splitlines(), 1)
    ]
    return "deck", "Deck", f'<pre class="deck">{"".join(lines)}</pre>'


def _messages(said: Sequence[Diagnostic]) -> list[Sheet]:
    if not said:
        return []
    return [("messages", f"Messages ({len(said)})", f"<pre>{escape(render_text(said))}</pre>")]


@cache
def _file(name: str) -> str:
    if name == GLYPHS:
        from .glyphs import script

        return script()
    if name == FUNCTIONS:
        return functions.script()
    with open(join(WEB, name), encoding="utf-8") as file:
        return file.read()


def _lean(text: str) -> str:
    """Without indentation and whole-line comments; the page is sent around, its sources lie in web/."""
    lines = (line.strip() for line in text.splitlines())
    return "\n".join(line for line in lines if line and not line.startswith("//"))
