"""Source files: the user's bytes as text, lines on demand, and places in them.

Nothing here changes the text: a logical line is a slice of it, and every span points into it.
"""

from __future__ import annotations

from bisect import bisect_right

from .diagnostics import Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any


class SourceFile:
    """One deck or included file. `text` has `\\n` line ends; `path` is None for text given as a string."""

    __slots__ = ("_starts", "included_from", "name", "path", "remarks", "text")

    def __init__(
        self, name: str, text: str, path: str | None = None, included_from: Span | None = None
    ) -> None:
        self.name = name
        self.text = text
        self.path = path
        self.included_from = included_from
        self._starts: list[int] | None = None
        self.remarks: list[Any] = []  # diagnostics found while its numbers were read

    @property
    def has_sections(self) -> bool:
        """Whether the file is a library of .lib name ... .endl sections."""
        return "\n.endl" in self.text.lower()

    @property
    def starts(self) -> list[int]:
        """Offset of the first character of every line."""
        if self._starts is None:
            starts, at, find = [0], 0, self.text.find
            while (at := find("\n", at) + 1) > 0:
                starts.append(at)
            self._starts = starts
        return self._starts

    def text_line(self, line: int) -> str:
        """The text of a line (1-based) without its line end; empty beyond the end."""
        starts = self.starts
        if not 1 <= line <= len(starts):
            return ""
        end = starts[line] - 1 if line < len(starts) else len(self.text)
        return self.text[starts[line - 1] : end]

    def span(self, start: int, end: int) -> Span:
        """The span of text[start:end], cut at the end of its first line."""
        starts = self.starts
        line = bisect_right(starts, start)
        col = start - starts[line - 1] + 1
        limit = (starts[line] if line < len(starts) else len(self.text) + 1) - starts[line - 1]
        return Span(self, line, col, max(col, min(col + end - start, limit)))


class Line:
    """A logical line: text[start:end] of a file, with the continuation lines and the comments among them."""

    __slots__ = ("col", "end", "file", "number", "single", "start", "text")

    def __init__(self, file: SourceFile, number: int, col: int, start: int, end: int) -> None:
        self.file = file
        self.number = number
        self.col = col
        self.start = start
        self.end = end
        self.text = file.text[start:end]
        self.single = "\n" not in self.text

    def span(self, leaf: Any) -> Span:
        """The place of a leaf of the line's tree (a str with `start_pos` and `end_pos`)."""
        return self.span_at(leaf.start_pos, leaf.end_pos)

    def span_at(self, start: int, end: int) -> Span:
        if self.single:
            return Span(self.file, self.number, self.col + start, self.col + end)
        return self.file.span(self.start + start, self.start + end)

    @property
    def whole(self) -> Span:
        """The line's first physical line."""
        text = self.text
        stop = text.find("\n")
        return Span(self.file, self.number, self.col, self.col + len(text[:stop] if stop >= 0 else text))


class Reading:
    """A text cut into its title, logical lines, and the commands of its .control sections."""

    __slots__ = ("control", "control_span", "lines", "stray", "title", "title_line")

    def __init__(self) -> None:
        self.title = ""
        self.title_line = 0
        self.lines: list[Line] = []
        self.control: list[Line] = []
        self.control_span: Span | None = None
        self.stray: list[Span] = []  # continuation lines that continue nothing


def cut(file: SourceFile, has_title: bool) -> Reading:
    """Cut a text into logical lines. Reading stops at `.end`; what follows is not part of the deck."""
    out = Reading()
    lines, current = out.lines, out.lines
    in_control = False
    at = 0
    open_line: list[int] | None = None  # number, col, start, end of the line that a `+` would continue
    awaiting_title = has_title
    for number, raw in enumerate(file.text.split("\n"), 1):
        begin = at
        at += len(raw) + 1
        body = raw.strip()
        if awaiting_title:
            # a text given as a string may begin with empty lines; the first line of a file is its title
            if body or file.path is not None:
                out.title, out.title_line, awaiting_title = body, number, False
            continue
        if not body or body[0] in "*;$" or body.startswith("//"):
            continue
        col = raw.index(body[0])
        if body[0] == "+":
            if open_line is None:
                out.stray.append(Span(file, number, col + 1, len(raw) + 1))
            else:
                open_line[3] = begin + len(raw)
            continue
        if open_line is not None:
            current.append(Line(file, *open_line))
            open_line = None
        if body[0] == ".":
            word = body.split(None, 1)[0].lower()
            if word == ".control":
                in_control, current = True, out.control
                out.control_span = out.control_span or Span(file, number, col + 1, col + len(body) + 1)
                continue
            if word == ".endc":
                in_control, current = False, lines
                continue
            if word == ".end" and not in_control:
                break
        open_line = [number, col + 1, begin + col, begin + len(raw)]
    if open_line is not None:
        current.append(Line(file, *open_line))
    return out


def decode(data: bytes) -> str | None:
    """Bytes of a deck as text with `\\n` line ends: UTF-8, UTF-16 with its mark, else Latin-1; None for binary."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            text = data.decode("utf-16")
        except UnicodeDecodeError:
            return None
    else:
        if b"\0" in data:
            return None
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            strange = sum(c < " " and c not in "\t\n\r\f\x1a" for c in text[:4096])
            if strange * 50 > min(len(text), 4096):
                return None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text


def load(path: str, included_from: Span | None = None, shown: str | None = None) -> SourceFile:
    """Read a file. Raises OSError, or ValueError when it is not text."""
    with open(path, "rb") as handle:
        data = handle.read()
    text = decode(data)
    if text is None:
        raise ValueError(f"{path} is not a text file")
    return SourceFile(shown or path, text, path, included_from)
