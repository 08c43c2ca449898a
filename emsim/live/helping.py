"""What the language server says at a place of a text that a page edits: completion and hover, as data of JSON."""

from __future__ import annotations

from threading import Lock

from ..editor.complete import complete
from ..editor.document import Document
from ..editor.hover import hover

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Diagnostic, Fix


class Helper:
    """Of one deck, whose file is at `path`, if it is in one. It may be asked by several threads."""

    def __init__(self, path: str | None = None) -> None:
        self._path, self._document, self._lock = path, None, Lock()

    _document: Document | None

    def complete(self, text: str, row: int, col: int) -> list[dict[str, Any]]:
        """What may be typed there: kind, label, detail, text, insert of each. Row and column from 0."""
        names = ("kind", "label", "detail", "text", "insert")
        with self._lock:
            found = complete(self._read(text), row, col)
        return [{name: getattr(item, name) for name in names} for item in found]

    def hover(self, text: str, row: int, col: int) -> str | None:
        with self._lock:
            return hover(self._read(text), row, col)

    def _read(self, text: str) -> Document:
        if self._document is None or self._document.file.text != text:
            self._document = Document(text, self._path, self._document)
        return self._document


def mark(d: Diagnostic) -> dict[str, Any] | None:
    """A message at its place in the deck's text, columns from 1, with what mends it there."""
    if d.span is None:
        return None
    place = d.span.in_deck
    return {
        "severity": d.severity, "message": f"{d.message}\n{d.hint}" if d.hint else d.message, "line": place.line,
        "col": place.col, "end": max(place.end, place.col + 1),
        "fixes": [mending(f) for f in d.fixes if f.span.file is place.file],
    }  # fmt: skip


def mending(fix: Fix) -> dict[str, Any]:
    """A mending of the deck's own text: what stands at its place now, and what is to."""
    span = fix.span
    return {
        "label": fix.label, "line": span.line, "col": span.col, "old": span.text, "text": fix.text,
    }  # fmt: skip
