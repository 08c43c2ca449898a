"""Words and values of SPICE lines, for elements and dot cards; and an element as its line says it."""

from __future__ import annotations

from itertools import takewhile

from ..build_expr import expression, extent, ignored_letters, node_name
from ..diagnostics import Diagnostic, Fix, Sink
from ..expr import Bare, Num
from ..source import Line
from ..syntax import LineError
from ..traced import number
from ..units import infix, spice_leftover, spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any, ClassVar, Self, TypeVar

    from ..deck import Instance, Model, Waveform
    from ..diagnostics import Span
    from ..source import SourceFile
    from .contract import Level

    P = TypeVar("P")

INFINITE = float("inf")
_PLAIN: dict[str, float] = {}  # number words seen so far and their values


class Cards:
    """What the builders of elements, machine cards and dot cards share: errors and values."""

    sink: Sink

    def fail(self, code: str, message: str, line: Line, leaf: Any, hint: str | None = None) -> LineError:
        return LineError(Diagnostic("error", code, message, line.span_at(*extent(leaf)), hint))

    def second_value(self, what: str, line: Line, item: Any, hint: str | None = None) -> LineError:
        """A value where there is one already: a decimal comma, a unit apart, or one too many."""
        from ..slips import decimal_comma, unit_apart

        start, end = extent(item)
        slip = decimal_comma(line, start) or unit_apart(line, start, end)
        return self.fail("E102", what, line, item, hint) if slip is None else LineError(slip)

    # ---- values on electrical cards ----

    @staticmethod
    def is_value(item: Any) -> bool:
        """A word or something in braces, not a keyword or a waveform."""
        return bool(item[0] == "braced" if item.__class__ is tuple else item.type == "WORD")

    @staticmethod
    def are_numbers(values: list[Any]) -> bool:
        """Nothing in it is to be evaluated."""
        return not any(v is not None and v.__class__ is not float for v in values)

    def word(self, leaf: Any, line: Line) -> float | str:
        """A word: a number by SPICE's rule, or its lower-case text."""
        try:
            return _PLAIN[leaf]
        except KeyError:
            pass
        value = spice_number(leaf)
        if value is None:
            return str(leaf.lower())
        if value in (INFINITE, -INFINITE):
            raise self.fail("E110", "the number is too large", line, leaf)
        leftover = spice_leftover(leaf)
        dialect = line.file.dialect
        if leftover and dialect is not None and dialect.letter_as_dot and (meant := infix(leaf)) is not None:
            return spice_number(meant) or 0.0
        if leftover:
            if any(c in leftover.rstrip("+-") for c in "*/+-^()"):
                from ..slips import rated

                span, hint = line.span(leaf), f"write a calculation in braces: {{{leaf}}}"
                fixes = [Fix(span, f"{{{leaf}}}", hint)]
                said = f"`{leaf}` is not a number"
                raise LineError(rated(line, leaf) or Diagnostic("error", "E110", said, span, fixes=fixes))
            self.sink.add(ignored_letters(leaf, value, leftover, line))
        elif len(_PLAIN) < 100_000:
            _PLAIN[str(leaf)] = value
        return value

    def value(self, item: Any, line: Line) -> Any:
        """float, str or AST of a word or of something in braces or quotes."""
        if item.__class__ is tuple:
            node = expression(item, line)
            return node.value if isinstance(node, Num) else node
        return self.word(item, line)

    def number(self, item: Any, line: Line, what: str) -> Any:
        """float or AST; a bare word is the name of a parameter."""
        value = self.value(item, line)
        return Bare(value, what, (line, item.start_pos, item.end_pos)) if isinstance(value, str) else value

    def params(self, items: list[Any], line: Line, element: Written) -> list[Any]:
        """Takes key=value items into element.params; returns the other items in order."""
        rest: list[Any] = []
        after_tc = False
        for item in items:
            if after_tc and "tc2" not in element.params and rest and self.is_value(item):
                # tc=2m 1u behind the value: the spelling that ngspice takes
                value = self.value(item, line)
                if not isinstance(value, str):
                    element.params["tc2"] = value
                    continue
            after_tc = False
            if item.__class__ is tuple and item[0] in ("param", "named"):
                key = item[1][0].lower()
                if key in element.labels:
                    continue
                values = [self.number(v, line, f"{key}=") for v in item[1][1:]]
                if key == "tc":
                    element.params["tc1"] = values[0]
                    if len(values) > 1:
                        element.params["tc2"] = values[1]
                    after_tc = element.may_have_tc
                else:
                    element.params[key] = values[0] if len(values) == 1 else values
            else:
                rest.append(item)
        return rest


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


class Written:
    """One element of a deck, as its line says it.

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
    labels: ClassVar[frozenset[str]] = frozenset()  # words of its line whose values are texts for people

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
    def of_line(cls, cards: Cards, rule: str, ch: list[Any], line: Line) -> Self | Instance:
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

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
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

    def with_names(self, cards: Cards, items: list[Any], first: int) -> list[Any]:
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
        return number(value) if isinstance(value, (int, float)) else default

    def known(self) -> Iterable[str]:
        """Parameters that the line takes."""
        return self.instance
