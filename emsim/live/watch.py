"""Files that may change: looked at often, by their times, sizes and inodes.

Editors save in three ways: over the file itself (it is empty for a moment), by a new file of the same name (none is
there for a moment, and the inode is another), or through a link. What is gone or empty is waited for, GAP seconds.
"""

from __future__ import annotations

import os
from time import monotonic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

    Mark = tuple[int, ...] | None

GAP = 0.4  # seconds


class Watch:
    """`changed` is true once for every change of one of the files, which need not exist."""

    __slots__ = ("_gap", "_marks")

    def __init__(self, paths: Iterable[str]) -> None:
        self._marks: dict[str, Mark] = {path: mark(path) for path in paths}
        self._gap: float | None = None

    @property
    def paths(self) -> list[str]:
        return list(self._marks)

    def follow(self, paths: Iterable[str], since: int) -> None:
        """Watches these files instead. One that is new here counts as changed if it is younger than `since` [ns of
        the clock of files]: it may have been written after it was read."""
        marks: dict[str, Mark] = {}
        for path in paths:
            if path in self._marks:
                marks[path] = self._marks[path]
            else:
                now = mark(path)
                marks[path] = () if now is not None and now[0] >= since else now
        self._marks = marks

    def changed(self) -> bool:
        marks = {path: mark(path) for path in self._marks}
        if marks == self._marks:
            self._gap = None
            return False
        if any((now is None or now[1] == 0) and now != self._marks[path] for path, now in marks.items()):
            # probably in the middle of being saved
            if self._gap is None:
                self._gap = monotonic()
            if monotonic() - self._gap < GAP:
                return False
        self._gap, self._marks = None, marks
        return True


def mark(path: str) -> Mark:
    """(time of the last change [ns], size, inode); None where no file is."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
