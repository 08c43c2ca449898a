"""The deck as typed objects: what a card says, free of how it was spelled.

Two forms share these classes. `Deck` is what one text holds: cards in order, subcircuits and conditions
nested, values still expressions. `FlatDeck` (elaborate/flat.py) is what every later stage sees. All names are lower-case.
"""

from __future__ import annotations

from .diagnostics import Placed

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .diagnostics import Diagnostic, Place, Sink, Span
    from .expr import Node
    from .source import SourceFile

    # A value on a machine card: number (SI), expression, tuple, or word; a shape such as rod(0.3) is a Call.
    Value = float | Node | str | tuple["Value", ...]
    Written = tuple[str, str, int, str, Span]


class Waveform:
    """PULSE, SIN, EXP, PWL, SFFM, AM, TRNOISE, TRRANDOM as written: `args` in order, defaults not yet filled in.

    `params` holds `r` and `td` of PWL, and factors on its times and values; `seed` says which random values it has. In a `Deck`
    args may be expressions; in a `FlatDeck` they are floats.
    """

    __slots__ = ("args", "kind", "params", "seed", "span")

    def __init__(
        self, kind: str, args: list[Any], params: dict[str, Any], span: Span, seed: str = ""
    ) -> None:
        self.kind, self.seed = kind, seed
        self.args = args
        self.params = params
        self.span = span

    def __repr__(self) -> str:
        return f"{self.kind}({' '.join(map(str, self.args))})"


# types of .model that a MOTOR names
MATRIX_TYPES = ("cpl",)  # of a .model whose parameters may be several numbers
MOTOR_TYPES = ("dcmotor", "dcwound", "pmsm", "bldc", "stepper", "induction")


class Model:
    """A .model card. `type` is "d" "sw" "csw" "r" "c" "l" "nmos" "dcmotor" ...; flag parameters are 1.0."""

    __slots__ = ("name", "param_spans", "params", "span", "type")

    def __init__(
        self,
        name: str,
        type: str,
        params: dict[str, Any],
        span: Span,
        param_spans: dict[str, Span] | None = None,
    ) -> None:
        self.name = name
        self.type = type
        self.params = params
        self.span = span
        self.param_spans = {} if param_spans is None else param_spans

    def __repr__(self) -> str:
        return f".model {self.name} {self.type} {self.params}"


class Ref(Placed):
    """What a machine card names: `arm`, `arm(0.3,0)`, `arm.tip`, `0`, `0(0.1,0.2)`, a joint, node or word."""

    __slots__ = ("name", "point")

    def __init__(self, name: str, point: tuple[Any, ...] | None, at: Place) -> None:
        self.name = name
        self.point = point
        self.at = at

    def __repr__(self) -> str:
        return self.name if self.point is None else f"{self.name}{self.point}"


class MachineCard:
    """One machine card, generic: what each word means is the card's own business (cards/).

    `kind` is the upper-case card word. A positional number or {expr} is params["value"], a
    positional waveform (or key=SIN(...)) is `wave`. POINT has name "arm.tip" and params["at"] = (x, y[, z]).
    Numbers are SI: units and scale suffixes are already applied, angles are in radians. `units` are the units as
    written: (parameter, or "" for a point's; kind of waveform or ""; which number of it; unit; place). `groups`: how
    many of the args stood in each of the parentheses behind the name.
    """

    __slots__ = ("args", "groups", "kind", "line", "name", "param_spans", "params", "span", "units", "wave")

    def __init__(
        self,
        kind: str,
        name: str,
        args: list[Ref],
        params: dict[str, Value],
        wave: Waveform | None,
        span: Span,
        param_spans: dict[str, Span],
        line: Any = None,
        units: list[Written] | None = None,
        groups: tuple[int, ...] = (),
    ) -> None:
        self.groups = groups
        self.kind = kind
        self.name = name
        self.args = args
        self.params = params
        self.wave = wave
        self.span = span
        self.param_spans = param_spans
        self.line = line  # the logical line, for a second reading as SPICE
        self.units = [] if units is None else units

    def __repr__(self) -> str:
        return f"<{self.kind} {self.name} {self.args} {self.params} {self.wave or ''}>"


class Analysis:
    """A dot card that asks for an analysis: `kind` "tran", "op", or another kept by name; args as written."""

    __slots__ = ("args", "flags", "kind", "leg", "span")

    def __init__(self, kind: str, args: list[Any], flags: set[str], span: Span) -> None:
        self.leg: Any = None  # the part of it that is run (analyses/tran.py)
        self.kind = kind
        self.args = args
        self.flags = flags
        self.span = span

    def __repr__(self) -> str:
        return f".{self.kind} {self.args} {self.flags or ''}"


class Print:
    """.print: `kind` is the analysis ("tran", "op", ...), items are (text as written, AST)."""

    __slots__ = ("items", "kind", "span")

    def __init__(self, kind: str, items: list[tuple[str, Node]], span: Span) -> None:
        self.kind = kind
        self.items = items
        self.span = span


class Clause:
    """One word of a .meas card with what it is about: `find v(out)`, `when v(a)=v(b)`, `trig v(in)`. `level` stands behind the
    `=`; `values` are those of `val rise fall cross td at from to`, as expressions; LAST is Name("last")."""

    __slots__ = ("body", "level", "span", "values", "word")

    def __init__(self, word: str, body: Node | None, level: Node | None, span: Span) -> None:
        self.word, self.body, self.level, self.span = word, body, level, span
        self.values: dict[str, Node] = {}

    def __repr__(self) -> str:
        return f"{self.word} {self.body}={self.level} {self.values}"


class Measure:
    """.meas: `analysis` is the word of the one that it is about, "" where the card does not say."""

    __slots__ = ("analysis", "clauses", "name", "span")

    def __init__(self, analysis: str, name: str, clauses: list[Clause], span: Span) -> None:
        self.analysis, self.name, self.clauses, self.span = analysis, name, clauses, span

    def expressions(self) -> list[Node]:
        """All that stand on the card."""
        parts = ((c.body, c.level, *c.values.values()) for c in self.clauses)
        return [node for part in parts for node in part if node is not None]

    def __repr__(self) -> str:
        return f".meas {self.analysis} {self.name} {self.clauses}"


class Probe:
    """One thing of .save or .probe: v(a), i(v1), angle(hinge), or Name("all"). `of_terminals`: vd(m1:d:s), i(m1:s), p(q1) of
    .probe, whose names are devices with terminals."""

    __slots__ = ("ast", "of_terminals", "span", "text")

    def __init__(self, text: str, ast: Node, span: Span, of_terminals: bool = False) -> None:
        self.text, self.of_terminals = text, of_terminals
        self.ast = ast
        self.span = span

    def __repr__(self) -> str:
        return self.text


# ---- the nested form ----


class Instance(Placed):
    """X card: the subcircuit `of` put to use between `refs`."""

    __slots__ = ("name", "of", "params", "refs")

    def __init__(self, name: str, params: dict[str, Any], at: Place, refs: list[Ref], of: Ref) -> None:
        self.name = name
        self.params = params
        self.at = at
        self.refs = refs
        self.of = of

    @property
    def nodes(self) -> list[str]:
        return [ref.name for ref in self.refs]


class Unread:
    """A line of a library's subcircuit that is wrong: told where somebody uses the subcircuit."""

    __slots__ = ("diagnostic",)

    def __init__(self, diagnostic: Diagnostic) -> None:
        self.diagnostic = diagnostic


class Subckt:
    """.subckt ... .ends: ports, default parameters and the cards between; `altered`: parameters that alterparam has set,
    whatever its uses give."""

    __slots__ = ("altered", "body", "file", "name", "params", "ports", "span")

    def __init__(
        self, name: str, ports: list[str], params: dict[str, Any], span: Span, file: SourceFile
    ) -> None:
        self.name = name
        self.ports = ports
        self.params = params
        self.span = span
        self.file = file
        self.body: list[Any] = []
        self.altered: dict[str, float] = {}


class Conditional:
    """.if/.elseif/.else/.endif: (condition or None for .else, cards) in order."""

    __slots__ = ("branches", "span")

    def __init__(self, span: Span) -> None:
        self.span = span
        self.branches: list[tuple[Node | None, list[Any]]] = []


class Param:
    """One name=expression of a .param card."""

    __slots__ = ("name", "span", "value")

    def __init__(self, name: str, value: Any, span: Span) -> None:
        self.name = name
        self.value = value
        self.span = span


class Func:
    """.func name(a, b) = expression"""

    __slots__ = ("args", "body", "name", "span")

    def __init__(self, name: str, args: list[str], body: Node, span: Span) -> None:
        self.name = name
        self.args = args
        self.body = body
        self.span = span


class Include:
    """.include file, or .lib file section."""

    __slots__ = ("path", "section", "span")

    def __init__(self, path: str, section: str | None, span: Span) -> None:
        self.path = path
        self.section = section
        self.span = span


class Dot:
    """Any other dot card: `kind` without the dot; `items` as that kind needs them."""

    __slots__ = ("items", "kind", "span")

    def __init__(self, kind: str, items: Any, span: Span) -> None:
        self.kind = kind
        self.items = items
        self.span = span


class Deck:
    """One text, parsed: title and cards in order, `sections` the .lib/.endl parts by name.

    Flattening fills in, and leaves also where it fails: `params`, the .param of the top level by name, and `named`,
    the path of every file that is included, found or not. `asked`: analyses that stand in place of the deck's own;
    `shared`: parameters of .csparam, which commands of .control read as vectors."""

    __slots__ = (
        "asked", "body", "defines", "file", "named", "outside", "params", "sections", "shared", "sink", "title",
    )  # fmt: skip

    def __init__(self, title: str, file: SourceFile, sink: Sink) -> None:
        self.title = title
        self.file = file
        self.sink = sink
        self.body: list[Any] = []
        self.sections: dict[str, list[Any]] = {}
        self.defines: dict[str, float | str] = {}
        self.params: dict[str, Param] = {}
        self.named: list[str] = []
        self.asked: list[Analysis] | None = None
        self.outside: frozenset[str] = frozenset()  # parameters whose values come from outside (fmus/)
        self.shared: list[tuple[str, Node]] = []
