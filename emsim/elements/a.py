"""A: a code model of XSPICE, analogue or digital. Which ones there are: xspice/.

The line's words mean something only with the model's ports: `[a b]` is a list, `%vd` says what the next connection is,
`~` turns a digital one round, `null` leaves it open. A connection of one kind takes one word, one between two nodes two.
"""

from __future__ import annotations

from ..build_expr import extent, node_name
from ..diagnostics import Diagnostic, suggest
from ..syntax import LineError
from ..units import spice_number
from .base import Element
from .xspice import ABSENT, NAMES, code_model

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from ..deck import Model
    from ..diagnostics import Span
    from ..source import Line
    from .base import Path
    from .contract import Accounts, Cards, Circuit, Expr, Level
    from .net import Net
    from .xspice.base import CodeModel, Port, Seat, Word

PIECES = r"\[|\]|~|%[A-Za-z]*|[^\[\]~%]+"
PAIRS = ("vd", "id", "gd", "hd")  # types of two nodes
GROUND = ("0", "gnd")
TRUE, FALSE = ("true", "t", "yes", "y"), ("false", "f", "no", "n")

# what a word of the line is: a mark as it stands, or one of these
NODE, SOURCE = "node", "source"


class OfCodeModel(Element):
    __slots__ = ("_seat",)
    letter = "a"
    what = "code model"
    form = "Aname [in ...] out ... model, connections as the model has them: emsim help NAME_OF_THE_MODEL"
    law = "that of its code model: emsim help code_models"
    terminals = ()
    behind = ("model",)
    model_types = NAMES
    accounted = "supplied"
    jumps = 9
    _seat: Seat

    @property
    def seat(self) -> Seat | None:
        return getattr(self, "_seat", None)

    @classmethod
    def model_sort(cls) -> str:
        return "code model"

    @classmethod
    def model_hint(cls, of: str) -> str:
        if of in ABSENT:
            return f"{of} is not supported: write {ABSENT[of]}"
        near = suggest(of, NAMES)
        return f"did you mean `{near}`?" if near else "emsim help code_models lists them"

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        known = code_model(of).parameters.items() if of else ()
        return [
            ([key], w.unit, float("nan") if w.default is None else w.default, w.meaning)
            for key, w in known
            if w.meaning
        ]

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        import re

        words: list[tuple[str, str, Span]] = []
        for leaf in ch[1:]:
            if leaf.__class__ is tuple:
                raise cards.fail(
                    "E102", "a code model's line has no parameters, its .model has", line, leaf, self.hint
                )
            span = line.span_at(*extent(leaf))
            if leaf[0] in "\"'":
                words.append((NODE, node_name(leaf), span))
                continue
            # a model's name may hold any of these characters
            if leaf is ch[-1]:
                words.append((NODE, leaf.lower(), span))
                continue
            words += [
                (p if p in "[]~" or p[0] == "%" else NODE, p.lower(), span) for p in re.findall(PIECES, leaf)
            ]
        if not words or words[-1][0] != NODE:
            raise cards.fail("E109", f"{ch[0]} names no model", line, ch[0], self.hint)
        _, self.model_name, self.model_span = words.pop()
        self.nodes, form = [], []
        sources = False  # %vnam says that names of sources follow, up to the end of its list
        depth = 0
        for kind, word, span in words:
            depth += {"[": 1, "]": -1}.get(kind, 0)
            if kind == NODE and word == "null":
                form.append(("null", "null", span))
            elif kind == NODE and sources:
                form.append((SOURCE, word, span))
                sources = depth > 0
            elif kind == NODE:
                self.nodes.append("0" if word == "gnd" else word)
                form.append((NODE, word, span))
            else:
                form.append((kind, word, span))
                if kind[0] == "%":
                    sources = word == "%vnam"
                elif kind == "]":
                    sources = False
        self.extra["form"] = form

    def bind(self, level: Level) -> None:
        """Names of sources at their level; the nodes are there already."""
        self.extra["form"] = [
            (kind, level.prefix + word if kind == SOURCE else word, span)
            for kind, word, span in self.extra["form"]
        ]

    # ---- its words, once the model is known ----

    def check(self, ctx: Circuit) -> None:
        from .xspice.base import Seat

        if self.model is None:
            return
        model = self.model
        seat = Seat(self.name, self.span, model, code_model(model.type))
        seat.ctx = ctx
        try:
            seat.values = dict(self._values(ctx, model, seat.kind))
            seat.at = self._connections(ctx, seat.kind)
        except LineError as error:
            ctx.sink.add(error.diagnostic)
            self.nodes = []
            return
        seat.kind().check(seat)
        self._seat = seat
        # two nodes a connection, so that `paths` and `reads` tell them apart; digital nodes are no unknowns
        self.nodes = [node for c in self._analogue() for node in c.nodes]

    def _analogue(self) -> Iterator[Any]:
        assert self.seat is not None
        for port in self.seat.kind.ports:
            yield from (c for c in self.seat.at[port.name] if c.type not in ("d", "vnam"))

    def _values(self, ctx: Circuit, model: Model, kind: type[CodeModel]) -> Iterator[tuple[str, Any]]:
        for key, value in model.params.items():
            at = model.param_spans.get(key, model.span)
            word = kind.parameters.get(key)
            if word is None:
                near = suggest(key, kind.parameters)
                ctx.remark(
                    "W284", f".model `{model.name}`: {kind.name} takes no {key}=, it has no effect", at,
                    f"did you mean {near}=?" if near else f"it takes: {', '.join(kind.parameters) or 'nothing'}",
                )  # fmt: skip
                continue
            yield key, self._value(key, value, word, at, model)

    def _value(self, key: str, value: Any, word: Word, at: Span, model: Model) -> Any:
        said = f"{key}= of .model `{model.name}`"
        if word.kind == "text":
            # as it stands: a file's name keeps its case, a table its leading zeros
            return at.text.partition("=")[2].strip().strip("\"'") or str(value)
        if word.kind == "flag":
            if isinstance(value, str) and value in (*TRUE, *FALSE):
                return value in TRUE
            if isinstance(value, (int, float)):
                return bool(value)
            raise LineError(
                Diagnostic(
                    "error", "E110", f"{said} is neither true nor false: `{value}`", at, "write TRUE or FALSE"
                )
            )
        if word.kind == "list":
            words = (
                value
                if isinstance(value, list)
                else (
                    value[1:-1].replace(",", " ").split()
                    if isinstance(value, str) and value[:1] == "["
                    else [value]
                )
            )
            found = [v if isinstance(v, (int, float)) else spice_number(v) for v in words]
            if None in found:
                wrong = words[found.index(None)]
                raise LineError(
                    Diagnostic("error", "E110", f"{said}: `{wrong}` is no number", at, f"write {key}=[1 2 3]")
                )
            return [float(v) for v in found if v is not None]
        if isinstance(value, list) and len(value) == 1:
            value = value[0]
        elif (
            isinstance(value, str)
            and value[:1] == "["
            and (one := spice_number(value[1:-1].strip())) is not None
        ):
            value = one
        if not isinstance(value, (int, float)):
            raise LineError(
                Diagnostic(
                    "error",
                    "E110",
                    f"{said} is no number: `{value}`",
                    at,
                    "write a number, or the name of a .param",
                )
            )
        return float(value)

    def _connections(self, ctx: Circuit, kind: type[CodeModel]) -> dict[str, list[Any]]:
        """The line's words, connection by connection. Raises LineError."""
        # `nodes` is made anew below, and the deck may be assembled again
        nodes = iter(self.extra.setdefault("ends", list(self.nodes)))
        words = [(k, next(nodes) if k == NODE else w, s) for k, w, s in self.extra["form"]]
        found: dict[str, list[Any]] = {}
        form = "form: " + kind.form()

        def fail(message: str, span: Span | None) -> LineError:
            return LineError(
                Diagnostic("error", "E341", f"`{self.name}`: {message}", span or self.span, form)
            )

        for port in kind.ports:
            if not words:
                if port.is_open:
                    found[port.name] = []
                    continue
                raise fail(f"the connection `{port.name}` of {kind.name} is missing", self.model_span)
            found[port.name] = self._port(ctx, port, kind, words, fail)
        if words:
            raise fail(
                f"`{words[0][1]}` is one word too many: {kind.name} has {len(kind.ports)} connections",
                words[0][2],
            )
        return found

    def _port(
        self, ctx: Circuit, port: Port, kind: type[CodeModel], words: list[Any], fail: Any
    ) -> list[Any]:
        from .xspice.base import Connection

        made: list[Any] = []
        type_ = port.types[0]

        def typed(word: str, span: Span) -> str:
            if (name := word[1:]) not in port.types:
                said = " ".join("%" + t for t in port.types)
                raise fail(f"`{port.name}` of {kind.name} cannot be {word}; it may be {said}", span)
            return name

        if words[0][0][0] == "%":
            _, word, span = words.pop(0)
            type_ = typed(word, span)
        opened = bool(words) and words[0][0] == "["
        if opened:
            if not port.is_list:
                raise fail(f"`{port.name}` of {kind.name} is one connection, not a list", words[0][2])
            words.pop(0)
        elif port.is_list and words and words[0][0] != "null":
            raise fail(f"`{port.name}` of {kind.name} is a list: write it in [ ]", words[0][2])
        outer = type_
        while words:
            what, word, span = words.pop(0)
            if what == "]":
                if not opened:
                    raise fail("`]` has no `[` before it", span)
                opened = False
                break
            if what == "[":
                raise fail("a list within a list", span)
            if what == "null":
                if not (port.is_open or port.is_list):
                    raise fail(f"`{port.name}` of {kind.name} cannot be left open", span)
            else:
                inverted = False
                while what == "~" or what[0] == "%":
                    inverted ^= what == "~"
                    type_ = typed(word, span) if what[0] == "%" else type_
                    if not words:
                        raise fail(f"nothing follows `{word}`", span)
                    what, word, span = words.pop(0)
                if what not in (NODE, SOURCE):
                    raise fail(f"`{word}` does not fit here", span)
                if inverted and type_ != "d":
                    raise fail("`~` turns digital connections round, this one is none", span)
                if type_ == "vnam":
                    made.append(self._of_source(ctx, word, span))
                elif type_ == "d":
                    ctx.digital_node(word)
                    made.append(Connection("d", (word,), "", inverted, span))
                elif type_ in PAIRS:
                    if not words or words[0][0] != NODE:
                        raise fail(f"%{type_} takes two nodes, `{word}` has no second one", span)
                    made.append(Connection(type_, (word, words.pop(0)[1]), "", False, span))
                else:
                    made.append(Connection(type_, (word, "0"), "", False, span))
            if not opened:
                break
            type_ = outer
        if opened:
            raise fail(f"the list of `{port.name}` has no `]`", self.span)
        if len(made) < port.least and not port.is_open:
            raise fail(
                f"`{port.name}` of {kind.name} needs {port.least} connection{'s' if port.least > 1 else ''} at least",
                self.span,
            )
        return made

    def _of_source(self, ctx: Circuit, name: str, span: Span) -> Any:
        from .xspice.base import Connection

        known = {e.name: e for e in ctx.flat.elements if e.holds_voltage}
        if name not in known:
            near = suggest(name, known)
            raise LineError(Diagnostic(
                "error", "E341", f"`{self.name}`: %vnam takes a voltage source, none is called `{name}`", span,
                f"did you mean `{near}`?" if near else "the current of a source V is meant",
            ))  # fmt: skip
        return Connection("vnam", (), name, False, span)

    # ---- the circuit's graph ----

    def branches(self, is_read: bool) -> Sequence[tuple[str, float]]:
        return [(name, 0.0) for name in self.seat.branches()] if self.seat is not None else ()

    def _ends(self) -> Iterator[tuple[Port, Any, int]]:
        """Port and connection of each pair of `nodes`, and the place of the first of them."""
        k = 0
        for port in self.seat.kind.ports if self.seat is not None else ():
            assert self.seat is not None
            for c in self.seat.at[port.name]:
                if c.type not in ("d", "vnam"):
                    yield port, c, k
                    k += 2

    def paths(self) -> Sequence[Path]:
        found: list[Path] = []
        for port, c, k in self._ends():
            if c.type in ("g", "gd", "h", "hd"):
                found.append((k, k + 1, "conducts"))
            elif c.type in ("i", "id"):
                found.append((k, k + 1, "drives" if port.drives else "voltage"))
            elif port.drives:
                found.append((k, k + 1, "voltage"))
        return found

    def reads(self) -> list[str]:
        return [
            c.nodes[j]
            for port, c, _ in self._ends()
            if not port.drives and c.type in ("v", "vd")
            for j in (0, 1)
        ]

    # ---- equation (1) ----

    def contribute(self, ctx: Circuit) -> None:
        if self.seat is not None:
            self.seat.short()
            self.seat.kind().build(self.seat)

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        """Into the first node of what it drives."""
        flows = self.seat.flows if self.seat is not None else []
        return flows[0][1] if flows else ctx.b.const(0.0)

    def probe(self, ctx: Circuit, name: str) -> Expr | None:
        return None

    def probes(self, ctx: Circuit) -> dict[str, str]:
        return {}

    def account(self, ctx: Circuit, book: Accounts) -> None:
        for nodes, i in self.seat.flows if self.seat is not None else ():
            book.supplies(self, -(ctx.v(*nodes) * i))

    def analogue(self, net: Net) -> str:
        nodes = iter(self.extra["ends"])
        words = [net.plain(next(nodes)) if kind == NODE else word for kind, word, _ in self.extra["form"]]
        return " ".join([net.head(self).split()[0], *words, self.model.name if self.model else ""])
