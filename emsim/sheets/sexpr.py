"""KiCad's files: nested lists of words with their places."""

from __future__ import annotations

import re
from bisect import bisect_right

from .sheet import Word, word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

TOKEN = re.compile(r'\(|\)|"(?:[^"\\]|\\.)*"|[^\s()"]+')
ESCAPED = {"n": "\n", "r": "", "t": "\t"}


class Wrong(ValueError):
    """What is no such file, with its line."""

    def __init__(self, line: int) -> None:
        super().__init__(line)
        self.line = line


class Node(list["Any"]):
    """A list; its first word says what it is. `line`: where it begins."""

    line = 0
    deepest = 200  # lists within lists; a schematic has a dozen

    @property
    def kind(self) -> str:
        return str(self[0]) if self and isinstance(self[0], Word) else ""

    def all(self, kind: str) -> Iterator[Node]:
        return (n for n in self if isinstance(n, Node) and n.kind == kind)

    def first(self, kind: str) -> Node | None:
        return next(self.all(kind), None)

    def word(self, k: int) -> Word:
        """The k-th item, if it is a word."""
        return self[k] if k < len(self) and isinstance(self[k], Word) else word("")

    def text(self, kind: str) -> Word:
        """The word of a list within, "" without one."""
        found = self.first(kind)
        return word("") if found is None else found.word(1)

    def numbers(self, kind: str) -> list[float]:
        """Of a list within."""
        found = self.first(kind)
        return (
            []
            if found is None
            else [float(w) for w in found[1:] if isinstance(w, Word) and w not in ("unlocked",)]
        )


def parse(text: str) -> Node:
    """The outermost list. Raises Wrong."""
    starts = [0, *(m.end() for m in re.finditer("\n", text))]
    root, stack = Node(), []
    at, line = root, 1
    for token in TOKEN.finditer(text):
        piece, start = token[0], token.start()
        line = bisect_right(starts, start)
        if piece == "(":
            stack.append(at)
            inner = Node()
            inner.line = line
            at.append(inner)
            at = inner
            if len(stack) > Node.deepest:
                raise Wrong(line)
        elif piece == ")":
            if not stack:
                raise Wrong(line)
            at = stack.pop()
        elif piece[0] == '"':
            said = re.sub(r"\\(.)", lambda m: ESCAPED.get(m[1], m[1]), piece[1:-1])
            at.append(word(said, line, start - starts[line - 1] + 2))
        else:
            at.append(word(piece, line, start - starts[line - 1] + 1))
    if stack or len(root) != 1 or not isinstance(root[0], Node):
        raise Wrong(line)
    return root[0]
