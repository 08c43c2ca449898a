"""Expressions: the tree the parser builds, and its meaning on constants (`evaluate`, `fold`).

Ids and function names are lower-case. In calls such as v(a,b), i(v1), angle(hinge), x(pole(0.6,0)) an
argument that is a bare name is a Name, a node whose name is a number is Name("2"), a point is a Call.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .diagnostics import Span


class Node:
    """Base of the expression tree. `span` is the place in the user's text, None for made-up nodes."""

    __slots__ = ("span",)
    span: Span | None

    def __repr__(self) -> str:
        return to_text(self)

    def __eq__(self, other: object) -> bool:
        """Equal as written: spans do not count."""
        return isinstance(other, type(self)) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash((type(self), self._key()))

    def _key(self) -> tuple[object, ...]:
        raise NotImplementedError


class Num(Node):
    __slots__ = ("value",)

    def __init__(self, value: float, span: Span | None = None) -> None:
        self.value = value
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.value,)


class Name(Node):
    __slots__ = ("id",)

    def __init__(self, id: str, span: Span | None = None) -> None:
        self.id = id
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.id,)


class Call(Node):
    __slots__ = ("args", "fn")

    def __init__(self, fn: str, args: Sequence[Node], span: Span | None = None) -> None:
        self.fn = fn
        self.args = list(args)
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.fn, *self.args)


class Unary(Node):
    """op: "-" "+" "!"."""

    __slots__ = ("a", "op")

    def __init__(self, op: str, a: Node, span: Span | None = None) -> None:
        self.op = op
        self.a = a
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.op, self.a)


class Binary(Node):
    """op: "+" "-" "*" "/" "**" "<" "<=" ">" ">=" "==" "!=" "&&" "||"."""

    __slots__ = ("a", "b", "op")

    def __init__(self, op: str, a: Node, b: Node, span: Span | None = None) -> None:
        self.op = op
        self.a = a
        self.b = b
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.op, self.a, self.b)


class Cond(Node):
    """c ? a : b"""

    __slots__ = ("a", "b", "c")

    def __init__(self, c: Node, a: Node, b: Node, span: Span | None = None) -> None:
        self.c = c
        self.a = a
        self.b = b
        self.span = span

    def _key(self) -> tuple[object, ...]:
        return (self.c, self.a, self.b)


class ExprError(Exception):
    """An expression cannot be evaluated; `code`, `message`, `span`, `hint` go into the diagnostic."""

    def __init__(self, code: str, message: str, span: Span | None = None, hint: str | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.span = span
        self.hint = hint


def to_text(node: Node) -> str:
    """The expression as text, fully bracketed where precedence could be in doubt."""
    if isinstance(node, Num):
        return f"{node.value:g}" if float(f"{node.value:g}") == node.value else repr(node.value)
    if isinstance(node, Name):
        return node.id
    if isinstance(node, Call):
        return f"{node.fn}({','.join(to_text(a) for a in node.args)})"
    if isinstance(node, Unary):
        return f"{node.op}{_bracketed(node.a)}"
    if isinstance(node, Binary):
        return f"{_bracketed(node.a)}{node.op}{_bracketed(node.b)}"
    if isinstance(node, Cond):
        return f"{_bracketed(node.c)}?{_bracketed(node.a)}:{_bracketed(node.b)}"
    raise TypeError(type(node).__name__)


def _bracketed(node: Node) -> str:
    text = to_text(node)
    plain = isinstance(node, (Name, Call)) or (isinstance(node, Num) and node.value >= 0)
    return text if plain else f"({text})"
