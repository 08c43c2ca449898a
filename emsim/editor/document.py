"""A deck as it stands in an editor: its diagnostics, what its names stand for and where, and its values.

Everything comes from the same objects as on the command line: the text is built and flattened, its equations are
assembled as for `emsim check`. While a deck is wrong, values are those of the last text that was right.
"""

from __future__ import annotations

from ..build import read_source
from ..cards import CARDS
from ..deck import Conditional, Func, Include, Instance, MachineCard, Model, Param, Subckt
from ..diagnostics import Diagnostic, DiagnosticError, Sink, Span
from ..elaborate import flatten
from ..elaborate.files import Files
from ..elements import Element
from ..pipeline import prepare
from ..source import SourceFile

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from ..assemble import Assembly
    from ..elaborate.flat import FlatDeck

MOST_UNKNOWNS = 1000  # of a deck whose starting point is computed while somebody waits
MACHINE_KINDS = {"BODY": "body", "JOINT": "joint", "POINT": "point"}


class Symbol:
    """A name of the deck. kind: param, func, subckt, model, element, node, body, joint, point, card (any other machine
    card), scope: names of the subcircuits around it; `card` what it stands for; `span` where its name stands."""

    __slots__ = ("card", "kind", "name", "scope", "span")

    def __init__(self, kind: str, name: str, span: Span, scope: tuple[str, ...], card: Any) -> None:
        self.kind, self.name, self.span, self.scope, self.card = kind, name, span, scope, card

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name} at {self.span!r}>"


class Document:
    """`text` with `\\n` line ends. `before`: the document of an earlier text, for its values."""

    def __init__(self, text: str, path: str | None = None, before: Document | None = None) -> None:
        self.file = SourceFile(path or "<text>", text, path)
        self.lines = text.split("\n")
        self.diagnostics: list[Diagnostic] = []
        self.flat: FlatDeck | None = None
        self.assembly: Assembly | None = None
        self._start: dict[str, tuple[float, str]] | None = None
        deck = read_source(self.file)
        self.body, self.sections = list(deck.body), [card for part in deck.sections.values() for card in part]
        try:
            self.flat = flatten(deck)
            self.assembly = prepare(self.flat)[0]
            if self.flat.commands:
                from ..control import check as check_commands  # numpy, which other decks do without

                check_commands(self.flat.commands, self.flat.sink)
            self.diagnostics = self.flat.sink.diagnostics
        except DiagnosticError as error:
            self.diagnostics = error.diagnostics
            if before is not None:
                self.flat, self.assembly, self._start = (
                    self.flat or before.flat,
                    before.assembly,
                    before._start,
                )
        except Exception as error:  # a bug in emsim must not end the editor's session
            said = f"internal error: {type(error).__name__}: {error}"
            self.diagnostics = [*deck.sink.diagnostics, Diagnostic("error", "E499", said)]
        self._symbols: list[Symbol] | None = None

    # ---- names ----

    @property
    def symbols(self) -> list[Symbol]:
        """In the order of the text, those of included files behind the line that includes them."""
        if self._symbols is None:
            found = self._walk([*self.body, *self.sections], (), Files(Sink(), []), ())
            self._symbols = list(found)
        return self._symbols

    def _walk(
        self, cards: list[Any], scope: tuple[str, ...], files: Files, chain: tuple[str, ...]
    ) -> Iterator[Symbol]:
        nodes: set[str] = set()
        for card in cards:
            if isinstance(card, Element):
                yield Symbol("element", card.name, card.span, scope, card)
                for node in card.nodes:
                    if node not in nodes:
                        nodes.add(node)
                        yield Symbol("node", node, self._word_on_line(card.span, node), scope, card)
            elif isinstance(card, Instance):
                yield Symbol("element", card.name, card.span, scope, card)
                for ref in card.refs:
                    if ref.name not in nodes:
                        nodes.add(ref.name)
                        yield Symbol("node", ref.name, ref.span, scope, card)
            elif isinstance(card, MachineCard):
                kind = MACHINE_KINDS.get(card.kind, "card")
                yield Symbol(kind, card.name, self._word_on_line(card.span, card.name), scope, card)
                for k, kinds in enumerate(self.terminal_kinds(card)):
                    if kinds == {"node"} and card.args[k].name not in nodes:
                        nodes.add(card.args[k].name)
                        yield Symbol("node", card.args[k].name, card.args[k].span, scope, card)
            elif isinstance(card, (Param, Func, Model)):
                yield Symbol(type(card).__name__.lower(), card.name, card.span, scope, card)
            elif isinstance(card, Subckt):
                yield Symbol("subckt", card.name, card.span, scope, card)
                inner = (*scope, card.name)
                for key, value in card.params.items():
                    where = self._word_on_line(card.span, key)
                    yield Symbol("param", key, where, inner, Param(key, value, where))
                yield from self._walk(card.body, inner, files, chain)
            elif isinstance(card, Conditional):
                for _, branch in card.branches:
                    yield from self._walk(branch, scope, files, chain)
            elif isinstance(card, Include):
                included, its_chain = files.cards(card, chain)
                yield from self._walk(included, scope, files, its_chain)

    @staticmethod
    def terminal_kinds(card: MachineCard) -> list[set[str]]:
        """What each terminal of a card may be, by its spec."""
        forms = [f for f in CARDS[card.kind].spec.forms if len(f) == len(card.args)]
        return [{form[k][1] for form in forms} for k in range(len(card.args))]

    @staticmethod
    def _word_on_line(span: Span, word: str) -> Span:
        """Where a word stands on the line of a span, behind it; the span itself where it does not."""
        import re

        text = span.file.text_line(span.line)
        pattern = r"(?<![^\s=(){},;\"'])" + re.escape(word) + r"(?![^\s=(){},;\"'])"
        found = re.compile(pattern, re.I).search(text, span.end - 1)
        return span if found is None else Span(span.file, span.line, found.start() + 1, found.end() + 1)

    def scope_at(self, row: int) -> tuple[str, ...]:
        """Names of the subcircuits around a line (from 0)."""
        scope: list[str] = []
        for line in self.lines[1 : row + 1]:
            words = line.split(None, 2)
            if words and words[0].lower() == ".subckt":
                scope.append(words[1].lower() if len(words) > 1 else "")
            elif words and words[0].lower() == ".ends" and scope and line is not self.lines[row]:
                scope.pop()
        return tuple(scope)

    def find(self, name: str, kinds: tuple[str, ...], scope: tuple[str, ...] = ()) -> Symbol | None:
        """The symbol that a name means at a scope: the innermost one, the first of `kinds` that fits."""
        name = name.lower()
        here = [s for s in self.symbols if s.name == name and s.scope == scope[: len(s.scope)]]
        for depth in range(len(scope), -1, -1):
            for kind in kinds:
                for symbol in here:
                    if len(symbol.scope) == depth and symbol.kind == kind:
                        return symbol
        return None

    def visible(self, kinds: tuple[str, ...], scope: tuple[str, ...]) -> list[Symbol]:
        """Every symbol of these kinds that may be named at a scope; nodes and elements of its own level alone."""
        level_only = {"node", "element"}
        return [
            s for s in self.symbols
            if s.kind in kinds and s.scope == scope[: len(s.scope)] and (s.kind not in level_only or s.scope == scope)
        ]  # fmt: skip

    # ---- values ----

    def param(self, name: str) -> float | None:
        """A parameter of the top level."""
        return None if self.flat is None else self.flat.params.get(name)

    def at_start(self, column: str) -> tuple[float, str] | None:
        """Value and unit of `v(out)`, `i(v1)`, `angle(hinge)` at the start of a run."""
        if self._start is None:
            self._start = {}
            if self.assembly is not None and self.assembly.system.n <= MOST_UNKNOWNS:
                system = self.assembly.system
                uic = any("uic" in a.flags for a in self.assembly.flat.analyses)
                found, x, _ = system.start(self.assembly.options, uic)
                if found:
                    calls = {"node": "v({})", "branch": "i({})"}
                    for name, kind, value, unit in zip(
                        system.names, system.kinds, x, system.units, strict=True
                    ):
                        self._start[calls.get(kind, "{}").format(name.lower())] = (value, unit)
        return self._start.get(column.lower())
