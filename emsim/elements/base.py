"""What a SPICE element is: one class a letter, which says how its line reads, what it adds to equation (1), and its words.

The duties of an element, by who asks; `ctx` is assemble.context.Context. A file in this folder and a line in `INDEX`
(__init__.py) make an element. Two-terminal elements need `flow` in place of 4. to 6.

 1. `letter what form law terminals instance model_types`   its words, for messages, `emsim help`, editors and the reference.
 2. `read(cards, rule, ch, line)`   what the words of its line mean. The default reads nodes, the model's name, positional
                        parameters, flags and key=value; with `bind(level)` names and values get their level's meaning.
 3. `check(ctx)`        rules between its parameters; reports through `ctx.sink`.
 4. `branches(is_read)` the currents that are unknowns of their own, with their initial values [A].
 5. `paths()`           what current may flow between which terminals, for the checks of the circuit's graph.
 6. `current(ctx, k)`   the current into terminal k, as an expression [A].
 7. `contribute(ctx)`   what it adds to d/dt Q(x) + F(x, t) = 0: row n+ gets +i, row n- gets -i.
 8. `probe(ctx, name)`  what @name[..] reads.
 9. `account(ctx, book)`  energies and powers, so that a deck audits itself.
10. `excite(ctx)`       the amplitudes of its waveforms in a small-signal analysis, from AC on its line.
11. `noise(ctx)`       its sources of noise at the operating point, those aside that a device of the engine has;
                        `coloured(ctx)` those whose density is any function of frequency.
12. `analogue(net)`     its line in an ngspice deck.

Linear elements are constant stamps (`b.g`, `b.c`, `b.f_wave`), which the engine sums once; anything else goes through the
expression graph. Defaults and temperature rules are ngspice 39's, checked against its runs (tests/unit/circuit).
"""

from __future__ import annotations

from itertools import takewhile

from ..build_expr import extent, node_name
from ..diagnostics import Diagnostic, did_you_mean, instead, suggest
from ..expr import Node, evaluate
from ..syntax import LineError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any, ClassVar, Self, TypeVar

    from .._engine import Expr
    from ..assemble.accounts import Accounts
    from ..assemble.context import Context
    from ..build_elements import ElementCards
    from ..deck import Instance, Model, Waveform
    from ..diagnostics import Fix, Span
    from ..elaborate.bind import Level
    from ..source import Line, SourceFile
    from .net import Net

    P = TypeVar("P")
    Scalar = Expr | float
    Coloured = tuple[str, list[tuple[int, float]], Callable[[float], float]]

# two terminals and what may flow between them: "conducts", "voltage" (it holds one), "inductor", "blocks" (at DC),
# "drives" (a current that does not depend on the voltage)
Path = tuple[int, int, str]
CONDUCTS: tuple[Path, ...] = ((0, 1, "conducts"),)
VOLTAGE: tuple[Path, ...] = ((0, 1, "voltage"),)
DRIVES: tuple[Path, ...] = ((0, 1, "drives"),)

CURRENT_NAMES = ("i", "id", "current")  # of @name[..]
POWER_NAMES = ("p", "power")
# as the devices of the engine have them, and ngspice 39
BOLTZMANN = 1.38064852e-23  # J/K
ZERO_CELSIUS = 273.15  # K

_new = object.__new__
NOTHING: Any = type(type.__dict__)({})  # parameters of a plain element; nobody can put one in


class Param:
    """A word of a line or of a .model: unit, what stands where it is left out, meaning. Without a meaning: accepted as
    ngspice has it, and nothing depends on it."""

    __slots__ = ("default", "meaning", "unit", "words")

    def __init__(
        self,
        meaning: str = "",
        unit: str = "",
        default: float | None = None,
        words: tuple[str, ...] = (),
    ) -> None:
        self.meaning, self.unit, self.default = meaning, unit, default
        self.words = words  # one of them stands there, and no number


def named(**told: P) -> dict[str, P]:
    """What a class tells of words of a line or of a .model."""
    return told


def ignored(words: str) -> dict[str, Param]:
    """Words that ngspice knows and that mean nothing here."""
    return {word: Param() for word in words.split()}


M = {"m": Param("so many in parallel", default=1.0)}
TEMPERATURE = {
    "temp": Param("its temperature", "C"),
    "dtemp": Param("degrees above that of the circuit", "K", 0.0),
}
TC = {
    "tc1": Param("change with temperature", "1/K", 0.0),
    "tc2": Param("change with temperature, quadratic", "1/K^2", 0.0),
}


def the_last_holds(model: Model, table: Iterable[tuple[list[str], str, float, str]]) -> None:
    """Of several names of one parameter in a .model the last counts, as in ngspice; the others go."""
    for names, *_ in table:
        for name in [key for key in model.params if key in names][:-1]:
            del model.params[name]


class Element:
    """One element of a deck.

    R C L     value (float; AST when behavioural), model, params tc1 tc2 ic m temp dtemp scale l w ...
    V I       extra["dc"]: float|None, extra["ac"]: (mag, phase)|None, wave
    E G       extra["form"] "linear" (4 nodes, value = gain), "poly" (extra["dims"], ["controls"] =
              [(p, n)..], ["coeffs"]), "expr" (value AST), "table" (value AST, extra["table"] = [(x, y)..])
    F H       extra["form"] "linear" or "poly", extra["controls"] = [source names], value or extra["coeffs"]
    K         extra["inductors"] = [names], value
    B         extra["output"] "v" or "i", value AST
    S W       model, extra["initial"] "on"/"off"/None; W: extra["controls"] = [source name]
    D         model, params area m temp dtemp ic off

    `is_plain`: nothing in it is to be evaluated. Of a card that is nothing but words, `place` says where its name
    and its last word (the value or the model) stand in `file`; its spans are made from that when they are asked for.
    """

    __slots__ = (
        "_model_span", "_span", "_value_span", "extra", "file", "is_plain", "model", "model_name", "name", "nodes",
        "params", "place", "value", "wave",
    )  # fmt: skip

    # ---- what the class says ----

    letter: ClassVar[str]  # in lower case, as in `Element.letter` of every card
    what: ClassVar[str]
    form: ClassVar[str] = ""
    law: ClassVar[str] = ""
    unit: ClassVar[str] = ""  # of its value
    supported: ClassVar[bool] = True
    terminals: ClassVar[tuple[str, ...]] = ("n+", "n-")
    least: ClassVar[int | None] = None  # nodes that stand on the line at least; None: as many as terminals
    usual: ClassVar[int | None] = None  # nodes before the word that is taken for the model where none is one
    behind: ClassVar[tuple[str, ...]] = ()  # kinds of the words behind the nodes: "element", "model"
    plain: ClassVar[tuple[str, int, bool] | None] = None  # grammar rule, words, is the last one a number?
    has_word: ClassVar[bool] = False  # has a `take_words_alone` of its own
    positional: ClassVar[
        tuple[str, ...]
    ] = ()  # words behind nodes and model: "value", or parameters by place
    flags: ClassVar[tuple[str, ...]] = ()  # words that are 1 where they stand
    instance: ClassVar[dict[str, Param]] = {}
    model_types: ClassVar[tuple[str, ...]] = ()
    model_words: ClassVar[dict[str, Param]] = {}
    value_or_model: ClassVar[bool] = False  # a word in the value's place names a model or a parameter
    may_have_tc: ClassVar[bool] = False  # tc=2m 1u: a number behind it is tc2
    accounted: ClassVar[str] = "dissipated"  # or stored, supplied: what its `account` is about
    is_metered: ClassVar[bool] = False  # its current becomes an unknown where something reads it
    labels: ClassVar[frozenset[str]] = frozenset()  # words of its line whose values are texts for people
    current_name: ClassVar[str] = "i"  # of @name[..]; "" where the current is recorded as i(name) anyhow
    holds_voltage: ClassVar[bool] = False  # the row of its branch reads v+ - v- = value
    jumps: ClassVar[int] = 0  # how likely it is what made a node jump, for messages

    nodes: list[str]
    place: int | None
    file: SourceFile
    value: Any
    params: dict[str, Any]
    extra: dict[str, Any]
    wave: Waveform | None
    model: Model | None
    model_name: str | None
    _span: Span
    _value_span: Span | None
    _model_span: Span | None

    def __init__(self, name: str, nodes: list[str], span: Span, value: Any = None) -> None:
        self.name, self.nodes, self.value = name, nodes, value
        self.params, self.extra, self.wave, self.model_name, self.model = {}, {}, None, None, None
        self._span, self._value_span, self._model_span = span, None, None
        self.place, self.is_plain = None, False

    @classmethod
    def model_sort(cls) -> str:
        """What its .model is to be, for messages."""
        return cls.model_types[0].upper()

    @classmethod
    def model_hint(cls, of: str) -> str | None:
        """What to write where its .model is of another type."""
        return None

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        """The words of its .model that mean something: (names, unit, default or NaN, meaning); `of` one type."""
        return [
            ([key], p.unit, float("nan") if p.default is None else p.default, p.meaning)
            for key, p in cls.model_words.items()
            if p.meaning
        ]

    @classmethod
    def model_names(cls) -> frozenset[str] | None:
        """All words that its .model takes; None where others are taken in silence."""
        return frozenset(cls.model_words) if cls.model_words else None

    @classmethod
    def fewest(cls) -> int:
        return len(cls.terminals) if cls.least is None else cls.least

    # ---- reading ----

    @classmethod
    def of_line(cls, cards: ElementCards, rule: str, ch: list[Any], line: Line) -> Self | Instance:
        """The element of a line's tree. Raises LineError."""
        e = cls(ch[0].lower(), [], line.span(ch[0]))
        e.read(cards, rule, ch, line)
        return e

    def take_words_alone(self) -> None:
        """Of a card that came as words (`has_word`): what its value means, where that is not `value`."""

    def take_nodes(self, ch: list[Any], count: int) -> list[Any]:
        """The first words behind the name are nodes; returns what follows."""
        self.nodes = [node_name(n) for n in ch[1 : 1 + count]]
        return ch[1 + count :]

    def read(self, cards: ElementCards, rule: str, ch: list[Any], line: Line) -> None:
        """Nodes, a model where there are types of it, then positional parameters, flags and key=value."""
        if self.least is not None:
            # the first word that names a model ends the nodes: known when the models are, see `divide`
            rest = cards.params(ch[1:], line, self)
            self.extra["words"] = [
                cards.value(i, line) if i.__class__ is tuple else node_name(i) for i in rest
            ]
            self.extra["word_spans"] = [line.span_at(*extent(i)) for i in rest]
            return
        names = ch[1 : 1 + len(self.terminals)]
        if len(names) < len(self.terminals) or any(n.__class__ is tuple for n in names):
            raise cards.fail("E109", f"{ch[0]} has too few nodes", line, ch[0], self.hint)
        rest = self.take_nodes(ch, len(self.terminals))
        rest = cards.params(self.with_names(cards, rest, 1 if self.model_types else 0), line, self)
        if self.model_types and not self.value_or_model:
            if not rest or rest[0].__class__ is tuple:
                raise cards.fail("E109", f"{ch[0]} names no model", line, ch[0], self.hint)
            self.model_name, self.model_span = rest[0].lower(), line.span(rest[0])
            rest = rest[1:]
        missing = self.take_words(
            [cards.value(i, line) if i.__class__ is tuple else cards.word(i, line) for i in rest],
            [line.span_at(*extent(i)) for i in rest],
        )
        if missing:
            raise cards.fail("E109", f"{ch[0]} has no {missing[0]}", line, ch[0], self.hint)

    def with_names(self, cards: ElementCards, items: list[Any], first: int) -> list[Any]:
        """`area 3` as area=3, as ngspice reads it: from item `first` on, a parameter's name before a value."""
        if len(items) < first + 2:
            return items
        names = self.instance.keys() - set(self.flags)
        known = [i.__class__ is not tuple and i.lower() in names for i in items]
        if not any(known):
            return items
        found, at = items[:first], first
        while at < len(items):
            item, end = items[at], at + 1
            if known[at]:
                most = len(items) if item.lower() == "ic" and len(self.terminals) > 2 else at + 2
                while end < min(most, len(items)) and cards.is_value(items[end]) and not known[end]:
                    end += 1
            found.append(item if end == at + 1 else ("param", items[at:end]))
            at = end
        return found

    def take_words(self, words: list[Any], spans: list[Span]) -> list[str]:
        """What stands behind nodes and model: flags, names before their values, and values in the order of `positional`;
        returns what is missing of it. Raises LineError."""
        places, at = list(self.positional), 0
        while at < len(words):
            word, span = words[at], spans[at]
            at += 1
            if word in self.flags:
                self.params[word] = 1.0
            elif isinstance(word, str) and at < len(words) and not isinstance(words[at], str):
                most = len(words) if word == "ic" else at + 1
                values = [*takewhile(lambda w: not isinstance(w, str), words[at:most])]
                self.params[word] = values[0] if len(values) == 1 else values
                at += len(values)
            elif isinstance(word, str) or not places or places[0] in self.params:
                raise LineError(
                    Diagnostic("error", "E102", f"`{span.text}` does not fit here", span, self.hint)
                )
            elif (place := places.pop(0)) == "value":
                self.value, self.value_span = word, span
            else:
                self.params[place] = word
        return [place for place in places if place == "value"]

    @property
    def hint(self) -> str:
        return "form: " + self.form

    def _locate(self) -> None:
        """Makes the spans of a plain card."""
        place = self.place
        if place is None:
            return
        number, col, last = place >> 40, (place >> 20 & 0xFFFFF) + 1, place & 0xFFFFF
        word = self.file.word(number, col + last)
        self.place, self._span = None, self.file.word(number, col)
        # the last word is the model where there is no value
        has_model = self.value is None and "dc" not in self.extra
        self._value_span, self._model_span = (None, word) if has_model else (word, None)

    # properties, not __getattr__: with that one every other attribute would be slow to read
    @property
    def span(self) -> Span:
        self._locate()
        return self._span

    @property
    def value_span(self) -> Span | None:
        self._locate()
        return self._value_span

    @value_span.setter
    def value_span(self, span: Span | None) -> None:
        self._value_span = span

    @property
    def model_span(self) -> Span | None:
        self._locate()
        return self._model_span

    @model_span.setter
    def model_span(self, span: Span | None) -> None:
        self._model_span = span

    def __repr__(self) -> str:
        return f"<{self.name} {' '.join(self.nodes)} value={self.value} {dict(self.params)}>"

    # ---- one level ----

    def at_level(self, name: str, nodes: list[str]) -> Self:
        """The same element under another name between other nodes; its model is still to be found."""
        e = _new(self.__class__)
        e.name, e.nodes, e.place, e.is_plain = name, nodes, self.place, self.is_plain
        if self.place is not None:
            e.file = self.file
        else:
            e._span, e._value_span, e._model_span = self._span, self._value_span, self._model_span
        e.value, e.params, e.wave, e.extra = self.value, dict(self.params), self.wave, dict(self.extra)
        e.model_name, e.model = None, None
        return e

    def bind(self, level: Level) -> None:
        """Names in `extra` get the level's meaning, values that must be known before the run become numbers."""

    @property
    def is_behaviour(self) -> bool:
        """Is its value an expression, even where it is constant?"""
        return False

    @property
    def may_behave(self) -> bool:
        """May its value be an expression of what the run computes?"""
        return False

    @property
    def is_multiplied(self) -> bool:
        """Does the m= of a subcircuit's use count copies of it?"""
        return "m" in self.instance

    def wired(self) -> Sequence[str]:
        """Its terminals that are nodes of the circuit."""
        return self.nodes

    # ---- parameters ----

    def number(self, key: str, default: float = 0.0) -> float:
        """A parameter of the line; flags count as 1, lists by their first entry."""
        value = self.params.get(key, default)
        if isinstance(value, (tuple, list)):
            value = value[0] if value else default
        return float(value) if isinstance(value, (int, float)) else default

    def known(self) -> Iterable[str]:
        """Parameters that the line takes."""
        return self.instance

    def chosen(self, read: set[str]) -> Element:
        """Itself, or the same line as an element of another law; `read`: what the deck reads of it, as gd of @d1[gd]."""
        return self

    def check(self, ctx: Context) -> None:
        """Unknown names among the parameters: an error on the line (as in ngspice), a warning in a .model."""
        for name in self.params:
            if name not in (known := list(self.known())):
                near = suggest(name, known)
                own, fixes = self.meant(ctx, name)
                if own is None:
                    own = (
                        f"did you mean {near}=?"
                        if near
                        else f"it takes: {', '.join(known) or 'no parameters'}"
                    )
                    fixes = instead(self.span, name, near) if near else []
                ctx.sink.error("E307", f"a {self.what} takes no {name}=", self.span, own, fixes=fixes)
        if self.model is not None and (key := (type(self), self.model.name)) not in ctx.checked:
            ctx.checked.add(key)
            self._check_model(ctx, self.model)

    def meant(self, ctx: Context, name: str) -> tuple[str | None, list[Fix]]:
        """What to do instead of a parameter that an element of this kind has not."""
        return None, []

    def _check_model(self, ctx: Context, model: Model) -> None:
        words, at = self.model_names(), model.param_spans
        the_last_holds(model, self.model_table())
        numbers = {name for names, *_ in self.model_table() for name in names} | set(self.model_words)
        for name, choice in (
            (k, p.words) for k, p in self.model_words.items() if p.words and k in model.params
        ):
            numbers.discard(name)
            if (given := model.params[name]) not in choice:
                said = f"{name}= of .model `{model.name}` is none of {', '.join(choice)}: `{given}`"
                ctx.sink.error("E110", said, at.get(name, model.span))
                del model.params[name]
        for name in sorted(
            key for key, value in model.params.items() if isinstance(value, str) and key in numbers
        ):
            # who made the part, mfg=OnSemi, is nobody's business
            ctx.sink.error(
                "E110", f"{name}= of .model `{model.name}` is no number: `{model.params[name]}`",
                at.get(name, model.span), "write a number, or the name of a .param",
            )  # fmt: skip
            del model.params[name]
        for name in model.params if words is not None else ():
            if words is not None and name not in words and name != "level":
                ctx.sink.warning(
                    "W284", f".model `{model.name}`: a {self.what} takes no {name}=, it has no effect",
                    at.get(name, model.span), hint=did_you_mean(name, words, form="{}="),
                )  # fmt: skip

    def ic_unused(self, ctx: Context, instead: str) -> None:
        """ic= on the line counts under UIC alone, as in ngspice."""
        ctx.sink.warning(
            "W283", f"ic= of `{self.name}` has no effect: it counts only where .tran says uic", self.span,
            f"write uic behind .tran, or {instead}; without it the run starts from the operating point",
        )  # fmt: skip

    def temperature(self, ctx: Context) -> float:
        """The element's temperature [C]: its own `temp`, or the circuit's plus `dtemp`."""
        return self.number("temp") if "temp" in self.params else float(ctx.temp) + self.number("dtemp")

    def temperature_factor(self, ctx: Context) -> float:
        """1 + tc1 dT + tc2 dT^2, or 1.01^(tce dT); dT against the model's tnom."""
        if self.model is None and not self.params:
            return 1.0
        params: dict[str, Any] = self.model.params if self.model else {}
        pair = self.params.get("tc")
        pair = list(pair) if isinstance(pair, (tuple, list)) else [] if pair is None else [pair]

        def coefficient(key: str, place: int) -> float:
            if key in self.params:
                return self.number(key)
            if place < len(pair):
                return float(pair[place])
            return float(params.get(key, params.get(key + "r", 0.0)))  # tc1r: of resistors

        dt = self.temperature(ctx) - float(params.get("tnom", ctx.tnom))
        if "tce" in self.params or "tce" in params:
            return float(1.01 ** (coefficient("tce", 9) * dt))
        return 1.0 + dt * (coefficient("tc1", 0) + dt * coefficient("tc2", 1))

    # ---- the circuit's graph ----

    def branches(self, is_read: bool) -> Sequence[tuple[str, float]]:
        """Current unknowns of its own, as (name, initial value under UIC [A]); `is_read`: something reads its current."""
        return ((self.name, 0.0),) if self.is_metered and is_read else ()

    @property
    def has_series(self) -> bool:
        """Does its current follow from the voltage across a resistance of its own (`ctx.series`)?"""
        return False

    def paths(self) -> Sequence[Path]:
        return CONDUCTS

    def imposes(self, ctx: Context) -> bool:
        """Is what it holds or drives its own, and may it differ from zero at t = 0?"""
        return False

    def reads(self) -> list[str]:
        """Nodes that it only looks at."""
        return []

    # ---- equation (1) ----

    def contribute(self, ctx: Context) -> None:
        """The default of two terminals: `flow` from the first to the second."""
        self.inject(ctx, self.flow(ctx))

    def flow(self, ctx: Context) -> Expr:
        """Of two terminals: the current from the first through the element to the second [A]."""
        return ctx.b.x(ctx.branches[self.name])

    def current(self, ctx: Context, terminal: int = 0) -> Expr:
        """The current into a terminal [A]."""
        if terminal > 1:
            return ctx.b.const(0.0)  # of a node that is only read
        return -self.flow(ctx) if terminal else self.flow(ctx)

    def probe(self, ctx: Context, name: str) -> Expr | None:
        """@name[..]; None for what is not computed."""
        if name in CURRENT_NAMES:
            return self.current(ctx)
        if name in POWER_NAMES and len(self.nodes) > 1:
            return self.between(ctx) * self.current(ctx)
        return self.between(ctx) if name == "v" and len(self.nodes) > 1 else None

    def probes(self, ctx: Context) -> dict[str, str]:
        """What @name[..] reads, with its unit."""
        return dict.fromkeys(CURRENT_NAMES, "A") | dict.fromkeys(POWER_NAMES, "W") | {"v": "V"}

    def account(self, ctx: Context, book: Accounts) -> None:
        """Energies and powers. The default: it dissipates v i."""
        book.dissipates(self, self.between(ctx) * self.flow(ctx))

    def excite(self, ctx: Context) -> Sequence[tuple[int, complex]]:
        """(number of the waveform, complex amplitude) of what is its own and oscillates in a small-signal analysis."""
        return ()

    def noise(self, ctx: Context) -> Sequence[tuple[Any, ...]]:
        """Currents of noise from the first terminal to the second: (name behind that of the element, power density at 1 Hz
        [A^2/Hz], exponent of frequency with which it falls); from one unknown to another where a pair of these stands behind."""
        return ()

    def coloured(self, ctx: Context) -> Sequence[Coloured]:
        """Sources of noise whose density is no power of frequency: (name, rows of F with factors, density at a frequency
        [A^2/Hz])."""
        return ()

    def thermal(self, ctx: Context, conductance: Scalar) -> Scalar:
        """4 k T G, the power density of a conductance's current of noise [A^2/Hz]."""
        return 4.0 * BOLTZMANN * (self.temperature(ctx) + ZERO_CELSIUS) * conductance

    def quantity(self, ctx: Context) -> float | None:
        """Its value in SI units, of `unit`; None where it is no number."""
        return float(self.value) if isinstance(self.value, (int, float)) else None

    # ---- stamps that several share ----

    def between(self, ctx: Context) -> Expr:
        """The voltage from the first node to the second [V]."""
        return ctx.v(self.nodes[0], self.nodes[1])

    def inject(self, ctx: Context, i: Expr) -> None:
        """Current i from the first node through the element to the second."""
        p, n = ctx.node(self.nodes[0]), ctx.node(self.nodes[1])
        ctx.b.add_f(p, i)
        ctx.b.add_f(n, -i)

    def join(self, ctx: Context) -> tuple[int, int, int]:
        """The branch current in both nodes' rows; returns (branch row, n+, n-)."""
        p, n, br = ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), ctx.branches[self.name]
        ctx.b.g(p, br, 1.0)
        ctx.b.g(n, br, -1.0)
        return br, p, n

    def join_voltage(self, ctx: Context) -> int:
        """A voltage-defined branch: row F = v+ - v- - (what the caller adds); returns the branch row."""
        br, p, n = self.join(ctx)
        ctx.b.g(br, p, 1.0)
        ctx.b.g(br, n, -1.0)
        return br

    def expression(self, ctx: Context, holds: Callable[[], frozenset[str]] | None = None) -> Expr:
        """A behavioural value, with its tc1, tc2; reciproctc=1: divided by what they make. `holds`: see Context.compile."""
        value = ctx.compile(self.value, self.value_span or self.span, holds)
        factor = self.temperature_factor(ctx)
        if factor and self.number("reciproctc"):
            factor = 1.0 / factor
        return value if factor == 1.0 else factor * value

    # ---- its line for ngspice ----

    @property
    def model_for_ngspice(self) -> Model | None:
        """The .model that its line there names."""
        return self.model

    def analogue(self, net: Net) -> str:
        """A line of an ngspice deck. The default: nodes, value or model, parameters."""
        words = [net.head(self), *([] if self.value is None else [repr(float(self.value))])]
        return " ".join([*words, *([self.model.name] if self.model else [])]) + net.parameters(self)


def number_at(value: Any, level: Level) -> float:
    """A value of a line that must be known before the run. Raises ExprError."""
    return evaluate(value, level.scope) if isinstance(value, Node) else float(value)
