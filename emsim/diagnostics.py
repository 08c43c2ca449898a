"""Diagnostics: one type for every message, collected in a `Sink`, rendered for the terminal or as JSON.

A diagnostic shows the user's own line with a caret, names the cause in the field's words and says what to
write instead. Nothing stops at the first error: stages add to the sink and raise once at their end.

Codes: E100-E229 front end, E230-E279 machine, E280-E349 circuit and outputs, E400-E449 run time,
E500-E549 outside world; W and N (warnings and notes) use the same ranges.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any, NoReturn, TypedDict, Unpack

    from .source import Line, SourceFile

    class More(TypedDict, total=False):
        labels: Sequence[tuple[Span, str]]
        fixes: Sequence[Fix]


MAX_ERRORS_SHOWN = 20
EXCERPT_WIDTH = 110

_COLOURS = {"error": "\033[1;31m", "warning": "\033[1;33m", "note": "\033[1;36m"}
_BOLD, _BLUE, _RESET = "\033[1m", "\033[1;34m", "\033[0m"


class Span:
    """A piece of one physical line: `line`, `col` are 1-based, `end` is one past the last column."""

    __slots__ = ("col", "end", "file", "line")

    def __init__(self, file: SourceFile, line: int, col: int, end: int) -> None:
        self.file = file
        self.line = line
        self.col = col
        self.end = end

    def __repr__(self) -> str:
        return f"{self.file.name}:{self.line}:{self.col}"

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Span)
            and self.file is other.file
            and (self.line, self.col, self.end) == (other.line, other.col, other.end)
        )

    def __hash__(self) -> int:
        return hash((id(self.file), self.line, self.col, self.end))

    @property
    def text(self) -> str:
        """The user's own characters under the span."""
        return self.file.text_line(self.line)[self.col - 1 : self.end - 1]

    @property
    def drawn(self) -> Span | None:
        """The place in the schematic that the deck was made of; the span itself where it was made of none. None for what stands
        nowhere in it."""
        origins = self.file.origins
        if origins is None:
            return self
        pieces = origins.get(self.line)
        if not pieces:
            return None
        col, end, file, line, there = next((p for p in pieces if p[1] > self.col), pieces[-1])
        if col <= self.col and file.text_line(line)[there - 1 : there - 1 + end - col] == self.text_of(
            col, end
        ):
            there, most = there + self.col - col, there + end - col
            return Span(file, line, there, max(there, min(there + self.end - self.col, most)))
        return Span(file, line, there, max(there, len(file.text_line(line)) + 1))

    def text_of(self, col: int, end: int) -> str:
        """Of the span's line, from column to column."""
        return self.file.text_line(self.line)[col - 1 : end - 1]

    @property
    def in_deck(self) -> Span:
        """The place in the deck itself: for an included file, that of the .include which leads to it."""
        span = self
        while span.file.included_from is not None:
            span = span.file.included_from
        return span


if TYPE_CHECKING:
    Place = Span | tuple[Line, int, int] | None


class Placed:
    """Something with a place in the user's text. `at` is a Span, or (line, start, end), of which a Span is made when
    somebody asks for it: most places are never asked for."""

    __slots__ = ("at",)
    at: Place

    @property
    def span(self) -> Span:
        at = self.at
        if at.__class__ is tuple:
            at = self.at = at[0].span_at(at[1], at[2])
        return at  # type: ignore[return-value]


def inert(text: str) -> str:
    """Text of a deck or a file for a terminal: what would move its cursor, paint it or turn its letters round is a dot."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\t\n" else "\N{MIDDLE DOT}" for c in text)


LONGEST = 1000  # characters of a message: a megabyte of junk is quoted by its ends


def _short(text: str) -> str:
    text = inert(text)
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} ... {text[-LONGEST // 4 :]}"


class Fix:
    """What mends a deck: `text` in the place of `span`, before it where the span is empty. `label` says so in a few words."""

    __slots__ = ("label", "span", "text")

    def __init__(self, span: Span, text: str, label: str = "") -> None:
        self.span, self.text, self.label = span, text, label or f"write `{text.strip()}`"


def not_installed(error: Exception) -> Diagnostic | None:
    """The message of a package that emsim imports and that is not there; None for any other error."""
    name = error.name if isinstance(error, ModuleNotFoundError) else None
    if not name or name.partition(".")[0] == "emsim":
        return None
    said, hint = f"emsim needs {name}, which is not installed", f"pip install {name}"
    if sys.platform == "emscripten":
        said = f"this needs {name}, which is not in the playground"
        hint = "run the deck with emsim on your machine"
    return Diagnostic("error", "E521", said, None, hint)


def instead(span: Span | None, wrong: str, right: str) -> list[Fix]:
    """The fix that writes `right` for the word `wrong`, which is the span or stands behind it on its line; none where it does
    not stand there."""
    if span is None:
        return []
    line = span.file.text_line(span.line)
    at = _word_in(line, wrong, span.col - 1)
    if at is None:
        return []
    return [Fix(Span(span.file, span.line, at + 1, at + 1 + len(wrong)), right)]


def meant_by(span: Span | None, message: str, hint: str | None) -> list[Fix]:
    """Of a hint that asks whether another word was meant: that word for the one of the message that is like it."""
    if span is None or hint is None or not hint.startswith("did you mean "):
        return []
    near = hint.partition("\n")[0][len("did you mean ") :].rstrip("?").strip("`=")
    for wrong in (
        *message.split("`")[1::2],
        *(word for word in message.replace(",", " ").split() if word[-1] == "="),
    ):
        wrong = wrong.rstrip("=")
        if wrong != near and suggest(wrong, [near]) == near and (found := instead(span, wrong, near)):
            return found
    return []


def _word_in(line: str, word: str, start: int) -> int | None:
    """Where a word stands on a line, from `start` on, in capitals or not; not as a part of another."""
    text, word = line.lower(), word.lower()
    at = text.find(word, start)
    while at >= 0:
        before, behind = text[at - 1 : at] if at else "", text[at + len(word) : at + len(word) + 1]
        if not (_in_name(before) and _in_name(word[:1])) and not (_in_name(behind) and _in_name(word[-1:])):
            return at
        at = text.find(word, at + 1)
    return None


def _in_name(c: str) -> bool:
    return c.isalnum() or c in ("_", ".", "#", "$")


def mended(text: str, fixes: Iterable[Fix]) -> str:
    """The text of a file with fixes of that file applied. Of two that overlap the first stands."""
    starts = [0]
    for line in text.split("\n"):
        starts.append(starts[-1] + len(line) + 1)
    places = []
    for f in fixes:
        start = starts[f.span.line - 1]
        places.append((start + f.span.col - 1, start + f.span.end - 1, f.text))
    out, taken = text, len(text) + 1
    for start, end, new in sorted(places, key=lambda place: place[:2], reverse=True):
        if end <= taken:
            out, taken = out[:start] + new + out[end:], start
    return out


class Diagnostic:
    """One message. `labels` are (span, text); a label on the main span is written at its caret. `fixes` are mendings, of which
    one is chosen; where there is no hint, what they say is the hint."""

    __slots__ = ("code", "fixes", "hint", "labels", "message", "severity", "span")

    def __init__(
        self,
        severity: str,
        code: str,
        message: str,
        span: Span | None = None,
        hint: str | None = None,
        labels: Sequence[tuple[Span, str]] = (),
        fixes: Sequence[Fix] = (),
    ) -> None:
        if hint is None and fixes:
            hint = "\n".join(dict.fromkeys(f.label for f in fixes))
        self.severity = severity
        self.code = code
        if span is not None and span.file.origins is not None:
            span = span.drawn
            moved = [(f, f.span.drawn) for f in fixes]
            fixes = [Fix(at, f.text, f.label) for f, at in moved if at and at.text == f.span.text != ""]
        self.message = _short(message)
        self.span = span
        self.hint = hint if hint is None else _short(hint)
        self.labels = [(there, inert(text)) for where, text in labels if (there := where.drawn)]
        self.fixes = list(fixes) or meant_by(span, message, hint)

    def __repr__(self) -> str:
        where = f" at {self.span!r}" if self.span else ""
        return f"<{self.severity}[{self.code}]{where}: {self.message}>"


class DiagnosticError(Exception):
    """Base of the errors that carry diagnostics instead of a bare text."""

    def __init__(self, diagnostics: Iterable[Diagnostic] | Diagnostic) -> None:
        self.diagnostics: list[Diagnostic] = (
            [diagnostics] if isinstance(diagnostics, Diagnostic) else list(diagnostics)
        )
        super().__init__(render_text(self.diagnostics))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.diagnostics,), self.__dict__

    def _render_traceback_(self) -> list[str]:
        """What IPython shows of an error that nobody caught: the line that called emsim, then the messages. The
        frames within emsim say nothing about a deck; `%debug` still finds them."""
        import os
        from traceback import extract_tb

        inside = os.path.dirname(os.path.abspath(__file__)) + os.sep
        calls = [f for f in extract_tb(self.__traceback__) if not f.filename.startswith(inside)]
        head = [f"{type(self).__name__} in line {calls[-1].lineno}: {calls[-1].line}", ""] if calls else []
        return head + render_text(self.diagnostics, not os.environ.get("NO_COLOR")).split("\n")

    def _repr_html_(self) -> str:
        """For notebooks, where the error is looked at as a value."""
        from html import escape

        return f"<pre>{escape(render_text(self.diagnostics))}</pre>"


class DeckError(DiagnosticError):
    """The deck is wrong: syntax, names, values, an impossible circuit or machine. Exit code 1."""


class ConvergenceError(DiagnosticError):
    """The analysis did not reach its end. `partial` is the Result up to there, or None. Exit code 3."""

    def __init__(self, diagnostics: Iterable[Diagnostic] | Diagnostic, partial: Any = None) -> None:
        super().__init__(diagnostics)
        self.partial = partial


class Interrupted(KeyboardInterrupt):
    """Ctrl-C ended a run. `partial` is the Result up to there. Exit code 130."""

    def __init__(self, partial: Any = None) -> None:
        super().__init__()
        self.partial = partial


REPORT = "please report it with the deck: this is a bug in emsim, not in your deck"


class InternalError(DiagnosticError):
    """The engine has panicked: a fault of emsim. Exit code 70."""


class OutsideError(DiagnosticError):
    """Something outside the deck is missing: a file, the ngspice program. Exit code 5."""


class Sink:
    """Collects diagnostics; the same message at the same place is kept once."""

    __slots__ = ("_seen", "diagnostics", "error_count")

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.error_count = 0
        self._seen: set[tuple[str, str, Span | None]] = set()

    @property
    def has_errors(self) -> bool:
        return self.error_count > 0

    def add(self, diagnostic: Diagnostic) -> None:
        # an error that was told before is one for those who ask whether something went wrong
        if diagnostic.severity == "error":
            self.error_count += 1
        key = (diagnostic.code, diagnostic.message, diagnostic.span)
        if key not in self._seen:
            self._seen.add(key)
            self.diagnostics.append(diagnostic)

    def error(
        self, code: str, message: str, span: Span | None = None, hint: str | None = None, **more: Unpack[More]
    ) -> None:
        self.add(Diagnostic("error", code, message, span, hint, **more))

    def warning(
        self, code: str, message: str, span: Span | None = None, hint: str | None = None, **more: Unpack[More]
    ) -> None:
        self.add(Diagnostic("warning", code, message, span, hint, **more))

    def note(
        self, code: str, message: str, span: Span | None = None, hint: str | None = None, **more: Unpack[More]
    ) -> None:
        self.add(Diagnostic("note", code, message, span, hint, **more))

    def raise_if_errors(self) -> None:
        """Raise DeckError with everything collected, when an error is among it."""
        if self.error_count:
            raise DeckError(self.diagnostics)


def deck_error(
    code: str, message: str, span: Span | None = None, hint: str | None = None, fixes: Sequence[Fix] = ()
) -> NoReturn:
    raise DeckError(Diagnostic("error", code, message, span, hint, fixes=fixes))


LEAST_BEGINNING = 3  # letters that a name and its beginning have in common


def suggest(word: str, candidates: Iterable[str]) -> str | None:
    """The candidate nearest to `word` by edit distance (swaps count one), else the shortest that begins as it does, or
    None."""
    word = word.lower()
    candidates = list(candidates)
    best, best_distance = None, max(1, min(3, len(word) // 3)) + 1
    for candidate in candidates:
        if candidate.lower() == word:
            return candidate
        if abs(len(candidate) - len(word)) >= best_distance:
            continue
        distance = _edit_distance(word, candidate.lower())
        if distance < best_distance and distance < max(len(word), len(candidate)):
            best, best_distance = candidate, distance
    if best is None and len(word) >= LEAST_BEGINNING:
        best = min((c for c in candidates if c.lower().startswith(word)), key=len, default=None)
    return best


def did_you_mean(
    word: str, candidates: Iterable[str], otherwise: str | None = None, form: str = "`{}`"
) -> str | None:
    """The hint that names what `suggest` finds, or `otherwise` where nothing is near."""
    near = suggest(word, candidates)
    return f"did you mean {form.format(near)}?" if near else otherwise


def _edit_distance(a: str, b: str) -> int:
    """Damerau-Levenshtein distance, adjacent transpositions only."""
    before: list[int] = []
    previous = list(range(len(b) + 1))
    for i, x in enumerate(a, 1):
        row = [i]
        for j, y in enumerate(b, 1):
            cost = min(previous[j] + 1, row[j - 1] + 1, previous[j - 1] + (x != y))
            if i > 1 and j > 1 and x == b[j - 2] and a[i - 2] == y:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before, previous = previous, row
    return previous[-1]


def render_text(diagnostics: Iterable[Diagnostic], color: bool = False) -> str:
    """All diagnostics as the terminal shows them, at most 20 errors; no trailing newline."""
    blocks: list[str] = []
    errors = 0
    for d in diagnostics:
        if d.severity == "error":
            errors += 1
            if errors > MAX_ERRORS_SHOWN:
                continue
        blocks.append(_render_one(d, color))
    if errors > MAX_ERRORS_SHOWN:
        blocks.append(f"... and {errors - MAX_ERRORS_SHOWN} more errors")
    return "\n\n".join(blocks)


def _render_one(d: Diagnostic, color: bool) -> str:
    hue, bold, blue, reset = (_COLOURS[d.severity], _BOLD, _BLUE, _RESET) if color else ("", "", "", "")
    out = [f"{hue}{d.severity}[{d.code}]{reset}{bold}: {d.message}{reset}"]
    margin = " "
    if d.span is not None:
        span = d.span
        marks = {(s.file, s.line): [] for s, _ in d.labels}  # type: dict[Any, list[tuple[Span, str, str]]]
        marks.setdefault((span.file, span.line), [])
        text_at_caret = ""
        for s, text in d.labels:
            if s == span:
                text_at_caret = text
            else:
                marks[s.file, s.line].append((s, "-", text))
        marks[span.file, span.line].insert(0, (span, "^", text_at_caret))
        own = sorted((key for key in marks if key[0] is span.file), key=lambda key: key[1])
        foreign = [key for key in marks if key[0] is not span.file]
        width = max(len(str(line)) for _, line in marks)
        margin = " " * (width + 1)
        out.append(f"{margin[:-1]}{blue} -->{reset} {inert(span.file.name)}:{span.line}:{span.col}")
        out.append(f"{margin}{blue} |{reset}")
        for file, line in own + foreign:
            if file is not span.file:
                out.append(f"{margin[:-1]}{blue} :::{reset} {inert(file.name)}:{line}")
            text = file.text_line(line)
            first = marks[file, line][0][0]
            for i, (s, glyph, label) in enumerate(marks[file, line]):
                shown, col, end = _crop(text, s, first)
                if i == 0:
                    out.append(f" {line:>{width}}{blue} |{reset} {shown}".rstrip())
                if not file.text_line(line) and not label:
                    continue
                paint = hue if glyph == "^" else blue
                caret = glyph * max(1, end - col)
                out.append(f"{margin}{blue} |{reset} {' ' * col}{paint}{caret} {label}".rstrip() + reset)
        chain = span.file.included_from
        while chain is not None:
            at = chain.drawn or chain
            out.append(f"{margin}{blue} = {reset}included from {inert(at.file.name)}:{at.line}")
            chain = chain.file.included_from
    if d.hint:
        for part in d.hint.splitlines():
            out.append(f"{margin}{blue} = {reset}help: {part}")
    return "\n".join(out)


def _crop(text: str, span: Span, around: Span) -> tuple[str, int, int]:
    """One printable line of bounded width and the columns (0-based) of the span in it."""
    text = "".join(c if c.isprintable() else ("\t" if c == "\t" else "·") for c in text)
    shift, lead, tail = 0, "", ""
    if len(text) > EXCERPT_WIDTH:
        shift = max(0, min(around.col - 1 - EXCERPT_WIDTH // 3, len(text) - EXCERPT_WIDTH))
        lead = "..." if shift else ""
        tail = "..." if shift + EXCERPT_WIDTH < len(text) else ""
        text = text[shift : shift + EXCERPT_WIDTH]
    col = min(max(span.col - 1 - shift, 0), len(text))
    end = min(max(span.end - 1 - shift, col), len(text))
    # tabs are drawn as the spaces a terminal would show, so that carets stand under what they mean
    stops = [0]
    for c in text:
        stops.append(stops[-1] + (8 - stops[-1] % 8 if c == "\t" else 1))
    shown = lead + text.expandtabs(8) + tail
    return shown, len(lead) + stops[col], len(lead) + stops[end]


def to_json(d: Diagnostic) -> dict[str, Any]:
    """Plain data for `--json`, editors and tests."""
    return {
        "severity": d.severity,
        "code": d.code,
        "message": d.message,
        "span": _span_json(d.span),
        "hint": d.hint,
        "labels": [{"span": _span_json(s), "text": text} for s, text in d.labels],
        "fixes": [{"span": _span_json(f.span), "text": f.text, "label": f.label} for f in d.fixes],
    }


def _span_json(span: Span | None) -> dict[str, Any] | None:
    if span is None:
        return None
    return {"file": span.file.name, "line": span.line, "col": span.col, "end": span.end}
