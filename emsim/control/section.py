"""A .control section, carried out: its commands and blocks one after the other.

A command that cannot be carried out is an error with its place, and the section goes on as under ngspice -b; the exit code tells.
"""

from __future__ import annotations

import re

import numpy as np

from ..build import parse_signals
from ..diagnostics import DeckError, suggest
from ..expr import MECHANICAL, PROBES, ExprError, Scope, evaluate
from ..syntax import LineError
from . import program, words
from .budget import Spent
from .errors import CommandError, Jump, Stop
from .plots import CONSTANTS, Vector
from .program import Block, Statement
from .session import SHOWN, Session
from .vectors import Evaluator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from typing import Any

    from ..deck import Probe
    from ..source import Line
    from .base import Command

MOST_ALIASES = 20  # names for names


def quantities(text: str) -> Iterator[str]:
    """@r1[i], omega(hinge) .. in a command's text."""
    from ..cards.joints import WORDS

    for match in re.finditer(
        r"@[A-Za-z][\w.:]*\[\w+\]|\b([A-Za-z]\w*)\([A-Za-z_][\w.]*(?:\([^()]*\))?\)", text
    ):
        if match[1] is None or (match[1].lower() not in "vi" and match[1].lower() in PROBES | WORDS.keys()):
            yield match[0].lower()


class Section(Session):
    """`commands`: those that there are, by their words."""

    def __init__(self, commands: Mapping[str, Command], *given: Any, **more: Any) -> None:
        super().__init__(*given, **more)
        self.commands = commands

    # ---- the section as a whole ----

    def run(self, lines: list[Line]) -> None:
        body = self.read(lines)
        if body is None:
            return
        self.deck.wanted += self.wanted(body)
        scope = Scope(dict(self.deck.flat().params))
        for name, value in self.deck.deck.shared:
            if name not in CONSTANTS:
                scope.values[name] = evaluate(value, scope)
                self.plots.const.add(Vector(name, np.array([scope.values[name]]), "", self.plots.const))
        self.carry_out(body)

    def wanted(self, body: program.Body) -> list[Probe]:
        """What runs have to record besides what they record anyhow: currents of devices, quantities of the machine."""
        found: dict[str, Probe] = {}
        for s in program.every(body):
            command = self.commands.get(s.word)
            if command is not None and not command.records:
                continue
            shown = s.rest.partition(":")[0].split() if s.word == "show" else ()
            for text in (*quantities(s.rest), *(f"@{name}[{key}]" for name in shown for key in SHOWN)):
                if text not in found and self.is_quantity(text):
                    for probe in parse_signals(text):
                        probe.span = s.span
                        found[text] = probe
        return list(found.values())

    def is_quantity(self, text: str) -> bool:
        """length(x) is the length of a ROPE x, pos(x) the place of a slide; of any other x they are functions of a vector."""
        from .functions import EACH, WHOLE

        word, _, rest = text.partition("(")
        of_vectors = word in MECHANICAL and (word in EACH or word in WHOLE)
        return not of_vectors or rest[:-1].split(",")[0] in {c.name.lower() for c in self.deck.flat().machine}

    def carry_out(self, body: program.Body) -> None:
        """A section from its first command to its end, and the deck's own analyses where it has not run them and the deck asks
        for tables, as under ngspice -b; or where nothing else would have run."""
        try:
            try:
                self.body(body)
            except Jump as jump:
                what = (
                    f"no label `{jump.label}` is in reach"
                    if jump.label
                    else f"`{jump.kind}` stands in no loop"
                )
                self.report(CommandError("E160", what))
            if not (self.quit or self.has_run) and (self.deck.flat().prints or len(self.plots.all) == 1):
                try:
                    self.run_deck()
                except CommandError as error:
                    self.report(error)
        except Stop:
            pass
        except Spent as spent:
            now = None if self._now is None else self._now.span
            self.sink.error("E165", str(spent), now, "a loop whose condition never ends? break leaves it")

    def read(self, lines: list[Line]) -> program.Body | None:
        """The program of lines; None where its blocks do not fit together: then nothing of it is carried out."""
        before = self.sink.error_count
        body = program.program(lines, self.sink)
        if self.sink.error_count > before:
            return None
        program.check(body, self.sink, self.commands)
        return body

    def source(self, lines: list[Line], what: str) -> None:
        body = self.read(lines)
        if body is None:
            return
        with self.budget.within(what):
            self.body(body)

    def body(self, body: program.Body) -> None:
        at = 0
        while at < len(body):
            try:
                one = body[at]
                if isinstance(one, Block):
                    self.block(one)
                else:
                    self.statement(one)
            except Jump as jump:
                if jump.kind != "goto":
                    raise
                at = self.label(body, jump)
            at += 1

    def label(self, body: program.Body, jump: Jump) -> int:
        for at, one in enumerate(body):
            if isinstance(one, Statement) and one.word == "label" and one.rest.lower() == jump.label:
                return at
        raise jump

    def named(self, s: Statement) -> Statement:
        """The command that a name of `alias` stands for."""
        for _ in range(MOST_ALIASES):
            if s.word not in self.aliases or s.word in program.FLOW:
                return s
            s = Statement(s.line, s.at, f"{self.aliases[s.word]} {s.rest}")
        raise CommandError("E160", f"`{s.word}` stands for itself", "unalias takes a name away")

    def statement(self, s: Statement) -> None:
        self.count(s)
        try:
            s = self.named(s)
            if s.word in program.BLOCKS:
                raise CommandError("E160", f"an alias cannot begin a block: `{s.word}`")
            if s.word in ("break", "continue"):
                from .numbers import whole

                raise Jump(s.word, max(1, whole(s.rest, "the number of loops")) if s.rest else 1)
            if s.word == "goto":
                raise Jump("goto", label=words.substituted(self, s.rest).lower())
            if s.word == "label":
                return
            command = self.commands.get(s.word)
            if command is None:
                self.sink.add(program.unknown(s, suggest(s.word, self.commands)))
                return
            text = s.rest if command.raw else words.substituted(self, s.rest)
            found = words.redirected(text) if command.shows else None
            if found is None:
                command.run(self, text, s)
            else:
                self.into_file(command, found, s)
        except (CommandError, ExprError, LineError, DeckError) as error:
            self.report(error)
        except RecursionError:
            self.report(CommandError("E165", f"what `{s.word}` is given nests too deeply"))

    def into_file(self, command: Command, found: tuple[str, str, bool], s: Statement) -> None:
        """What a command says, into a file."""
        from .files import put, target

        text, name, behind = found
        path = target(self, words.substituted(self, name))
        said: list[str] = []
        out, self._out = self._out, said.append
        try:
            command.run(self, text, s)
        finally:
            self._out = out
        put(self, path, "".join(said), behind)

    def block(self, block: Block) -> None:
        head = block.head
        self.count(head)
        try:
            with self.budget.within(f"`{head.word}`"):
                getattr(self, "on_" + head.word)(block)
        except (CommandError, ExprError, LineError, DeckError) as error:
            self._now = head
            self.report(error)
        except RecursionError:
            self._now = head
            self.report(CommandError("E165", f"what `{head.word}` is given nests too deeply"))

    # ---- blocks ----

    def truth(self, s: Statement, text: str | None = None) -> bool:
        text = words.substituted(self, s.rest if text is None else text)
        found = self.vectors(text, s)
        if len(found) != 1:
            raise CommandError("E161", f"`{s.word}` needs a condition")
        return Evaluator.truth(found[0])

    def on_if(self, block: Block) -> None:
        for head, body in block.branches:
            if head.word != "else":
                self._now = head
                try:
                    if not self.truth(head):
                        continue
                except (CommandError, ExprError, LineError) as error:
                    self.report(error)  # and counts as false, as in ngspice
                    continue
            self.body(body)
            return

    def round(self, body: program.Body, head: Statement) -> bool:
        """One round of a loop; False where it is left."""
        self.count(head)
        try:
            self.body(body)
        except Jump as jump:
            if jump.kind == "goto":
                raise
            if jump.count > 1:
                raise Jump(jump.kind, jump.count - 1) from None
            return jump.kind == "continue"
        return True

    def on_while(self, block: Block) -> None:
        while self.truth(block.head):
            if not self.round(block.branches[0][1], block.head):
                return
            self._now = block.head

    def on_dowhile(self, block: Block) -> None:
        while self.round(block.branches[0][1], block.head):
            self._now = block.head
            if not self.truth(block.head):
                return

    def on_repeat(self, block: Block) -> None:
        text = words.substituted(self, block.head.rest)
        times = self.vectors(text, block.head)[0].values[0].real if text else float("inf")
        done = 0
        while done < times:
            if not self.round(block.branches[0][1], block.head):
                return
            done += 1

    def on_foreach(self, block: Block) -> None:
        name, _, rest = block.head.rest.partition(" ")
        if not name:
            raise CommandError(
                "E161", "foreach needs the name of a variable", "form: " + program.FLOW["foreach"][0]
            )
        listed = words.split(words.substituted(self, rest))
        if listed and listed[0] == "(" and listed[-1] == ")":
            listed = listed[1:-1]
        for word in listed:
            self.variables[name.lower()] = self.parsed(word)
            if not self.round(block.branches[0][1], block.head):
                return
