"""Parsing: a logical line becomes a small tree, by Lark's tables of the grammar in grammar/*.lark.

A tree is (rule, [children]); a leaf is a str with `type`, `start_pos` and `end_pos` (its place in the line). The
engine runs the tables (engine/src/syntax); grammar/export.py took them from Lark. parsed.py calls it for one line.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .diagnostics import Diagnostic

    Tree = tuple[str, list[Any]]


class LineError(Exception):
    """A line that the grammar does not accept, with the message for its author."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def first_word(text: str) -> str:
    head = text[:64].split(None, 1)
    return head[0].lower() if head else ""


def uncommented(text: str) -> str:
    """The text with blanks for its comments and for the `+` of its continuation lines."""
    at, n, fresh = 0, len(text), False  # fresh: nothing but blanks so far on a continuation line
    out: list[str] = []
    while at < n:
        c = text[at]
        before = text[at - 1] if at else "\n"
        if (
            c == ";"
            or (c == "/" and text[at : at + 2] == "//" and before in " \t\n")
            or (
                c == "$" and before in " \t\n," and text[at + 1 : at + 3] != "N_"
            )  # a node of PSpice Schematics
            or (c == "*" and fresh)
        ):
            end = text.find("\n", at)
            end = n if end < 0 else end
            out.append(" " * (end - at))
            at = end
            continue
        out.append(" " if fresh and c == "+" else c)
        if c == "\n":
            fresh = True
        elif c not in " \t\r\f":
            fresh = False
        at += 1
    return "".join(out)


def code_end(text: str) -> int:
    """Where the code ends: what follows is comment."""
    return len(uncommented(text).rstrip())
