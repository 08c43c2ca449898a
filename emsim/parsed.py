"""One line, parsed. What the engine does not accept is parsed again by Lark itself, which knows what would have fitted
(mistakes.py): so Lark is imported only when something is wrong."""

from __future__ import annotations

from .source import trees

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .source import Line
    from .syntax import Tree


def parse_line(line: Line, start: str) -> Tree:
    """The tree of a logical line, from one of lark_grammar.STARTS. Raises LineError."""
    try:
        tree: Tree | None = trees().line(line.text, start)
    except UnicodeEncodeError:  # half a surrogate pair
        tree = None
    if tree is None:
        from .mistakes import lark_line

        tree = lark_line(line, start)
    return tree
