"""Source files: the user's bytes as text, lines on demand, and places in them.

Nothing here changes the text: a logical line is a slice of it, and every span points into it.
"""

from __future__ import annotations

from bisect import bisect_right

from .diagnostics import Span


class SourceFile:
    """One deck or included file. `text` has `\\n` line ends; `path` is None for text given as a string."""

    __slots__ = ("_starts", "included_from", "name", "path", "text")

    def __init__(
        self, name: str, text: str, path: str | None = None, included_from: Span | None = None
    ) -> None:
        self.name = name
        self.text = text
        self.path = path
        self.included_from = included_from
        self._starts: list[int] | None = None

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
