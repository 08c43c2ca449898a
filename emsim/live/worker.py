"""The process of the runs: jobs come as lines of JSON on stdin, answers go to stdout.

    job      {"deck": path, "defines": {name: text}, "set": {name: [text, text in the deck]}, "options": {...}}
    answer   any number of {"kind": "progress", "t": s, "stop": s}; then {"kind": "done", "size": n, ...}, see `work`,
             and n bytes, the run as the page takes it
    job      the same with "explain": true, for a deck that has run: the sheet of its equations
    answer   {"kind": "done", "size": 0, "sheets": [[name, title, HTML]]}

`set` are the page's own values, of .param and of numbers in cards (values.py); one whose text in the deck is another by
now, or is gone, is left out: the deck's last edit counts. A run is ended by ending this process: neither the derivation of
the equations nor a step can be interrupted.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from html import escape
from time import monotonic, perf_counter

from .. import pipeline
from ..build import read, read_source
from ..diagnostics import MAX_ERRORS_SHOWN, Diagnostic, DiagnosticError, not_installed, render_text
from ..elaborate import flatten
from ..expr import Node, Num, Unary
from ..outputs import html
from ..source import SourceFile
from .helping import mark, mending
from .values import altered, places

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, BinaryIO

    from ..deck import Deck, Param
    from ..elaborate.flat import FlatDeck
    from ..result import Result
    from .values import Place

    Job = dict[str, Any]

TELL_EVERY = 0.1  # seconds between words of progress
# what a first run would have to load
WARM = """warm
BODY arm shape=rod(1) m=1
JOINT hinge 0 arm pin
R1 a 0 1
V1 a 0 1
.tran 1m 1m
"""


def main() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the session ends this process
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    work({"deck": WARM, "defines": {}, "set": {}, "options": {}})
    for line in sys.stdin.buffer:
        job = json.loads(line)
        head, document = (explain(job), b"") if "explain" in job else work(job, _Progress(out))
        _send(out, {"kind": "done", "size": len(document), **head}, document)


def work(job: Job, progress: Callable[..., object] | None = None) -> tuple[dict[str, Any], bytes]:
    """`carried`, the run as bytes, empty where there is nothing to draw."""
    head, run = carried(job, progress)[:2]
    return head, packed(run)


def packed(run: dict[str, Any] | None) -> bytes:
    return b"" if run is None else json.dumps(run, separators=(",", ":"), allow_nan=False).encode()


def carried(
    job: Job, progress: Callable[..., object] | None = None
) -> tuple[dict[str, Any], dict[str, Any] | None, Result | None, list[Diagnostic]]:
    """What is said of a run, the run itself for the page, None where there is nothing to draw, its result and the messages.

    ok       a run reached its end;  read: the deck itself is right
    text     all diagnostics as on a coloured terminal;  lines: (line of the deck, message and hint) of the errors
    fixes    what mends the deck's own text, see `mending`;  marks: the messages at their places, see `mark`
    sheet    the deck as text for the page, with its wrong lines marked
    params   the .param of the deck, see `_param`; values: numbers of its cards, see `_value`; set: the page's values that counted
    named    every file that was read or looked for
    seconds  from the file to here; facts: one line
    """
    began = perf_counter()
    kept = dict(job["set"])
    while True:
        deck, flat, error = _read(job["deck"], job["defines"], kept)
        outdated = _outdated(deck, flat, kept, _text_of(job["deck"]))
        if not outdated:
            break
        for name in outdated:
            del kept[name]
    result = None
    if flat is not None:
        try:
            assert deck is not None
            result = pipeline.carry_out(deck, flat, job["options"], True, progress, scene=True)
        except Exception as failed:
            error, result = failed, getattr(failed, "partial", None)
    said = [] if result is None else list(result.diagnostics)
    said += [d for d in _explained(error) if d not in said]
    text = "" if deck is None else _text_of(job["deck"])
    drawn = result is not None and any(len(table) for table in result.plots)
    run = None
    if result is not None and drawn:
        result.diagnostics = said
        run = html.document(result, text)
    errors = [d for d in said if d.severity == "error"][:MAX_ERRORS_SHOWN]
    head = {
        "ok": drawn and error is None,
        "read": flat is not None,
        "text": render_text(said, color=True),
        "lines": [(d.span.in_deck.line, _brief(d)) for d in errors if d.span is not None],
        "fixes": [
            mending(f)
            for d in said
            for f in d.fixes
            if deck is not None and f.span.file.path == deck.file.path
        ],
        "marks": [found for d in said if (found := mark(d)) is not None],
        "sheet": html.deck_sheet(text, said)[2],
        "source": text,
        "params": [] if deck is None else [_param(p, flat, job["defines"]) for p in deck.params.values()],
        "values": []
        if deck is None
        else [_value(n, p, text, deck.file.name) for n, p in places(text).items()],
        "set": kept,
        "named": [] if deck is None else deck.named,
        "facts": "" if run is None else run["facts"],
        "seconds": perf_counter() - began,
    }
    return head, run, result, said


def explain(job: Job) -> dict[str, Any]:
    """The sheet of the deck's equations."""
    from ..reports import explained

    try:
        flat = pipeline.flatten(_deck(job["deck"], job["defines"], job["set"]), job["options"])
        found = pipeline.explain_flat(flat, job["options"])
        return {"sheets": explained.sheets(found)}
    except Exception as error:  # the deck may have become wrong since it ran
        why = "".join(f"<pre>{escape(render_text([d]))}</pre>" for d in _explained(error))
        return {"sheets": [("equations", "Equations", why)]}


def _defines(given: dict[str, str], kept: dict[str, list[str]]) -> dict[str, str]:
    return {**given, **{name: text for name, (text, _) in kept.items()}}


def _deck(path: str, defines: dict[str, str], kept: dict[str, list[str]]) -> Deck:
    """The deck with the page's values in it."""
    deck = read(path, _defines(defines, {name: value for name, value in kept.items() if ":" not in name}))
    chosen = {name: text for name, (text, _) in kept.items() if ":" in name}
    if not chosen:
        return deck
    file = deck.file
    text = SourceFile(file.name, altered(file.text, chosen), file.path)
    text.dialect = file.dialect
    other = read_source(text)
    other.defines = deck.defines
    return other


def _read(
    path: str, defines: dict[str, str], kept: dict[str, list[str]]
) -> tuple[Deck | None, FlatDeck | None, Exception | None]:
    deck = None
    try:
        deck = _deck(path, defines, kept)
        return deck, flatten(deck), None
    except Exception as error:
        return deck, None, error


def _text_of(path: str) -> str:
    """The deck's own text, whatever the page has set."""
    try:
        return read(path).file.text
    except Exception:
        return ""


def _outdated(deck: Deck | None, flat: FlatDeck | None, kept: dict[str, list[str]], text: str) -> list[str]:
    """Values of the page whose text was edited since, or is gone from a deck that is right."""
    if deck is None:
        return []
    found, own = [], places(text)
    for name, (_, before) in kept.items():
        if ":" in name:
            if name not in own or own[name].text != before:
                found.append(name)
            continue
        param = deck.params.get(name)
        if (flat is not None) if param is None else _written(param) != before:
            found.append(name)
    return found


def _explained(error: Exception | None) -> list[Diagnostic]:
    if error is None:
        return []
    if isinstance(error, DiagnosticError):
        return error.diagnostics
    if isinstance(error, MemoryError):
        return [
            Diagnostic("error", "E509", "out of memory", None, "record less: .save, a larger step on .tran")
        ]
    if (missing := not_installed(error)) is not None:
        return [missing]
    return [Diagnostic("error", "E499", f"internal error: {type(error).__name__}: {error}")]


def _brief(d: Diagnostic) -> str:
    return f"{d.message}\n{d.hint}" if d.hint else d.message


def _param(param: Param, flat: FlatDeck | None, defines: dict[str, str]) -> dict[str, Any]:
    """shown: the name as written; text: the value as the deck has it; given: as the command line has it, or None;
    literal: whether the deck has a number; value: that of this run; file, line, col, end, source: the place of the text
    (1-based) and its line."""
    place = param.value.span
    literal = isinstance(param.value, Num) or (
        isinstance(param.value, Unary) and param.value.op in "+-" and isinstance(param.value.a, Num)
    )
    return {
        "name": param.name, "shown": param.span.text, "text": place.text, "literal": literal,
        "given": defines.get(param.name), "value": _finite(flat.params.get(param.name)) if flat is not None else None,
        "file": os.path.basename(place.file.name), "line": place.line, "col": place.col, "end": place.end,
        "source": place.file.text_line(place.line),
    }  # fmt: skip


def _value(name: str, place: Place, text: str, file: str) -> dict[str, Any]:
    """As of a .param, of a number in a card."""
    return {
        "name": name, "shown": place.shown, "text": place.text, "literal": True, "given": None, "value": None, "card": True,
        "file": os.path.basename(file), "line": place.line, "col": place.col, "end": place.end,
        "source": text.split("\n")[place.line - 1],
    }  # fmt: skip


def _finite(value: float | None) -> float | None:
    return value if value is not None and abs(value) < float("inf") else None


def _written(param: Param) -> str:
    return param.value.span.text if isinstance(param.value, Node) else str(param.value)


class _Progress:
    def __init__(self, out: BinaryIO) -> None:
        self.out, self.then = out, monotonic()

    def __call__(self, t: float, stop: float, step: float, steps: int, events: int) -> None:
        now = monotonic()
        if now - self.then >= TELL_EVERY:
            self.then = now
            _send(self.out, {"kind": "progress", "t": t, "stop": stop})


def _send(out: BinaryIO, head: dict[str, Any], more: bytes = b"") -> None:
    try:
        out.write(json.dumps(head).encode() + b"\n" + more)
        out.flush()
    except OSError:
        os._exit(0)  # nobody listens any more
