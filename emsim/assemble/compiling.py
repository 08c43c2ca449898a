"""A Context that compiles expressions of the deck's text (behaviour.py, which only decks with such expressions import)."""

from __future__ import annotations

from .context import Context

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .._engine import Expr
    from ..diagnostics import Span
    from ..expr import Node
    from .behaviour import Compiler


class Compiling(Context):
    _compiler: Compiler | None = None

    def compile(
        self, ast: Node, where: Span | None, holds: Callable[[], frozenset[str]] | None = None
    ) -> Expr:
        if self._compiler is None:
            from .behaviour import Compiler

            self._compiler = Compiler(self)
        return self._compiler.compile(ast, where, holds)

    @property
    def where(self) -> Span | None:
        return self._compiler.where if self._compiler else None
