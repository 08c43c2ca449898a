"""What a machine card is: a specification, and scalars that the compiler differentiates.

The duties of a card, all optional but the first. `s` is the scene (see `Scene` below); every result is an `Expr`.
 1. `spec`            the card word, its terminals and parameters with unit, default and meaning.
 2. `check(sink)`     rules between parameters; runs right after binding, reports through the sink.
 3. `prepare(s)`      rules that need the resolved terminals; allocates branch currents.
 4. `kinetic(s)`      kinetic energy T [J], a function of coordinates and speeds.
 5. `potential(s)`    potential energy V [J], a function of coordinates.
 6. `coenergy(s)`     electrical co-energy W' [J].
    The Lagrangian is L = T - V + W'; momenta are dL/du, forces dL/dq.
 7. `powers(s)`       list of (effort, flow): the power effort*flow brought INTO the machine [W]. The generalised force on each
                      coordinate is effort * d(flow)/du with the effort held constant.
 8. `stamp(s)`        the electrical side: currents and charges added to node and branch rows.
 9. `probes(s)`       what can be read by name, of PROBES below: {"torque": Expr, ...}; a function without
                      arguments where reading costs an unknown, so that it is made only when asked for.
10. `losses(s)`       power turned into heat [W], >= 0, for loss(); `stored(s)` electrical energy held [J];
                      `supplied(s)` power brought in from outside the deck [W]; `taken(s)` energy that impacts took [J].
11. `thermal(s)`      list of (word, resistance, flow): effort = -resistance*flow, and it fluctuates with 4 k T resistance; for
                      .noise. A damping with a speed, a resistance [Ohm] with a current, a conductance [S] with a voltage.
12. `analogue(net)`   its electrical counterpart in a one-dimensional machine (see `Net`).
13. `glyph(draw)`     its shapes in body frames, and the channels that change them (see `Pen`).
14. `laws(s)`         laws with modes (laws.py): friction, rigid stops; asked once, before anything is read.
15. `constraints(s)`  rows [(label, h, unit of its multiplier)], h = 0 of the coordinates; asked once, after prepare. With
                      `from_start` h stays what it is where the machine starts.
16. `velocities(s)`   rows [(label, w, unit of its multiplier)], w = 0, linear in the speeds.
17. `stands_for(raw)` other cards that come with it: bodies, joints; asked before it is bound.
No card writes a mass matrix or a force direction.
"""

from __future__ import annotations

from math import pi

from ..diagnostics import Diagnostic, Fix, Span, did_you_mean, instead, suggest
from ..expr import Node
from ..opened import OpenNumber
from ..units import UNITS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any, Protocol

    from .._engine import Builder, Expr
    from ..deck import MachineCard, Model, Ref
    from ..diagnostics import Sink, Span
    from .domains import Shared
    from .laws import Law
    from .shapes import Shape

    Scalar = Expr | float
    Powers = list[tuple[Scalar, Scalar]]
    Resistances = list[tuple[str, Scalar, Scalar]]
    Probes = dict[str, Scalar | Callable[[], Scalar]]

    class JointView(Protocol):
        """A joint as cards see it; `q` and `u` are its one coordinate and speed, B relative to A."""

        name: str
        a: str  # the body A
        pa: tuple[float, ...]  # its place on A, in A's axes [m]

        @property
        def direction(self) -> tuple[float, ...]: ...  # its axis in the axes of A
        @property
        def q(self) -> Expr: ...
        @property
        def u(self) -> Expr: ...
        @property
        def us(self) -> Sequence[Expr]: ...  # all of its speeds, one or several at right angles
        @property
        def rotary(self) -> bool: ...  # q is an angle [rad]; otherwise a displacement [m]

    class PointView(Protocol):
        """A point of a body in world axes: position [m] and velocity [m/s], three components each."""

        @property
        def pos(self) -> Sequence[Scalar]: ...
        @property
        def vel(self) -> Sequence[Scalar]: ...

    class BodyView(Protocol):
        """A body in world axes; `spin` is the angular velocity in its own axes [rad/s]."""

        name: str

        @property
        def omega(self) -> Sequence[Scalar]: ...
        def angle(self) -> Scalar | None: ...  # about z with full turns [rad]; None where it turns otherwise
        def point(self, local: tuple[float, ...]) -> PointView: ...
        def speed_squared(self, local: tuple[float, ...]) -> Scalar: ...
        def spin(self) -> Sequence[Scalar]: ...
        def direction(self, local: Sequence[float]) -> Sequence[Scalar]: ...  # in world axes

    class Scene(Protocol):
        """What the compiler offers to a card."""

        b: Builder
        sink: Sink
        models: dict[str, Model]
        gravity: tuple[float, float, float]
        bodies: dict[str, Any]
        couplings: dict[str, Any]

        def joint(self, name: str) -> JointView: ...
        def frame(self, name: str) -> BodyView: ...
        def compile(self, value: Any, span: Span) -> Expr: ...  # number, expression or Waveform
        def compile_energy(self, value: Any, span: Span, own: Own) -> Expr: ...  # to be differentiated
        def beyond_coordinates(self, value: Any, e: Expr) -> str: ...  # what else an energy reads
        def speeds(self, joint: str) -> list[Expr]: ...  # all speeds of a joint
        def add_f(self, row: int, e: Scalar) -> None: ...  # to F of a row, of equation (1); -1 is ground
        def add_q(self, row: int, e: Scalar) -> None: ...  # to Q of a row
        def v(self, plus: int, minus: int) -> Expr: ...  # node voltage difference [V]
        def branch(self, name: str) -> int: ...  # a new branch current [A]
        def derivative(self, name: str, unit: str, of: Expr) -> Expr: ...  # d(of)/dt as an unknown
        def distance(self, p: PointView, q: PointView) -> tuple[Expr, Expr]: ...  # [m], [m/s]
        def abs(self, e: Scalar) -> Expr: ...
        def minimum(self, a: Scalar, b: Scalar) -> Expr: ...
        def maximum(self, a: Scalar, b: Scalar) -> Expr: ...
        def public(self, e: Scalar) -> Expr: ...  # in unknowns, for what is not differentiated
        def rate(self, e: Scalar) -> Expr: ...  # of an expression of coordinates: de/dt along the motion
        def body_of(self, card: Card, terminal: str) -> BodyView: ...  # of a point terminal
        def clamp(self, e: Scalar, lo: float, hi: float, name: str, warn: str) -> Expr: ...
        def told(self, e: Scalar, name: str, warn: str) -> Expr: ...  # a flag, e > 0; the run says so
        def at_start(self, es: Sequence[Scalar]) -> list[float]: ...  # of coordinates; for laws

        in_space: bool

        @property
        def domains(self) -> Shared: ...

        def parts(self, name: str | None = None) -> list[tuple[str, str, Shape]]: ...  # (name, body, shape)
        def joined(self, a: str, b: str) -> bool: ...  # does a joint join two bodies?
        def is_still(self, body: str) -> bool: ...
        def reaction(self, name: str, place: int = 0) -> Expr: ...  # of a GEAR, a DRIVE, a card's row
        def load(self, joint: JointView) -> Expr | None: ...  # how its parts press on each other [N]

    class Pen(Protocol):
        """What a card draws on, see assemble/drawing.py. A place is [body, x, y, z] in the body's axes [m]."""

        @property
        def m(self) -> Scene: ...
        @property
        def planar(self) -> bool: ...
        def channel(self, name: str, unit: str, value: Scalar) -> str | float: ...  # `#k`, or the number
        def on(self, body: str, local: Sequence[float] = ...) -> list[float]: ...
        def terminal(self, card: Card, label: str) -> list[float]: ...  # the place of a point terminal
        def joint(self, name: str) -> dict[str, Any]: ...  # a, b, joint, axis, q, zero
        def wheel(self, body: str) -> float: ...  # room for a bare inertia, drawn as a wheel, or 0
        def mesh(self, file: str, metres: float = ...) -> tuple[int, list[list[float]]]: ...
        def attached(self, body: str) -> list[list[float]]: ...  # where joints and points are
        def add(self, kind: str, card: Card, **what: Any) -> None: ...

    class Net(Protocol):
        """The analogue circuit, see reports/analogue.py: speed is voltage, force and torque are currents."""

        def add(self, line: str, why: str = "") -> None: ...
        def across(
            self, joint: str
        ) -> tuple[str, str]: ...  # nodes of B and A: their difference is the speed
        def coordinate(self, joint: str) -> str: ...  # the voltage that is the coordinate
        def value(self, joint: str) -> tuple[float, float]: ...  # coordinate and speed at the start
        def node(self, body: str) -> str: ...  # of a body's speed
        def turns(self, body: str) -> bool: ...
        def direction(self, body: str) -> tuple[float, float, float]: ...  # of a sliding body
        def lever(self, body: str, point: tuple[float, ...]) -> tuple[float, float]: ...  # from the axis
        def moment(self, body: str, point: tuple[float, ...], fx: str, fy: str) -> str: ...
        def located(self, card: Card, label: str) -> tuple[str, tuple[float, ...]]: ...
        def terminal_node(self, card: Card, label: str) -> str: ...  # of an electrical terminal
        def initial_current(self, name: str) -> float: ...
        def voltage(self, node: str, value: Any, factor: float) -> None: ...  # a source that holds it
        def current(
            self, name: str, into: str, out_of: str, value: Any, why: str = "", factor: float = 1.0
        ) -> None: ...
        def expression(self, ast: Any) -> str: ...
        def refuse(self, card: Card, why: str = "") -> None: ...

        @property
        def gravity(self) -> tuple[float, float, float]: ...


class Own:
    """Free symbols for a card's own voltage, currents and coordinates, by joint, while its energy is compiled."""

    __slots__ = ("card", "coordinates", "currents", "voltage")

    def __init__(
        self, card: str, voltage: Expr | None, currents: list[Expr], coordinates: dict[str, Expr]
    ) -> None:
        self.card, self.voltage, self.currents, self.coordinates = card, voltage, currents, coordinates

    @property
    def electrical(self) -> list[Expr]:
        return self.currents if self.voltage is None else [self.voltage, *self.currents]


HUGE = 1e150  # squares of more than that are beyond what floating point holds

# words of force(c) torque(c) i(c) v(c) gap(c) hits(c) .. that `probes` may answer, with their units
PROBES = {
    "force": "N", "torque": "N m", "i": "A", "v": "V", "p": "W", "power": "W", "id": "A", "iq": "A", "gap": "m",
    "slip": "m/s", "friction": "N", "rolling": "N m", "drilling": "N m", "mode": "", "hits": "", "impulse": "N s",
    "tension": "N", "length": "m", "heat": "W", "flux": "Wb", "flow": "m^3/s", "mx": "N m", "my": "N m", "mz": "N m",
}  # fmt: skip


class Param:
    """One parameter. kind: number, formula (or expression), value (or waveform), vector, word, shape, flag, heat, owner."""

    __slots__ = ("above", "default", "kind", "least", "meaning", "required", "unit", "words")

    def __init__(
        self,
        required: bool,
        default: Any,
        unit: str,
        meaning: str,
        kind: str,
        least: float | None,
        above: float | None,
        words: tuple[str, ...],
    ) -> None:
        self.required = required
        self.default = default
        self.unit = unit
        self.meaning = meaning
        self.kind = kind
        self.least = least  # smallest value allowed
        self.above = above  # the value must be greater than this
        self.words = words


def Required(
    unit: str,
    meaning: str,
    kind: str = "number",
    least: float | None = None,
    above: float | None = None,
    words: tuple[str, ...] = (),
) -> Param:
    """A parameter that must be given."""
    return Param(True, None, unit, meaning, kind, least, above, words)


def Default(
    default: Any,
    unit: str,
    meaning: str,
    kind: str = "number",
    least: float | None = None,
    above: float | None = None,
    words: tuple[str, ...] = (),
) -> Param:
    """A parameter that may be left out."""
    return Param(False, default, unit, meaning, kind, least, above, words)


class Spec:
    """A card's specification: the reference page, validation and help are made from it.

    `terminals` lists the forms, such as "joint:joint | p:point q:point": attribute name and kind
    (node, joint, body, point, kind) of each word after the card's name. `laws` tell readers what the
    card brings, as formulas in its parameters: energies T V W and heat P, `i` its electrical side, `q` a constraint.
    `mark`: parameters of which a line has one where it is this card, and no element. `meant`: what people write, and what it is
    called here; "" is a value without a name.
    """

    __slots__ = ("form", "forms", "laws", "mark", "meaning", "meant", "params", "word")

    def __init__(
        self,
        word: str,
        form: str,
        terminals: str,
        mark: tuple[str, ...],
        meaning: str,
        laws: dict[str, str] | None = None,
        meant: dict[str, str] | None = None,
        **params: Param,
    ) -> None:
        self.word = word
        self.form = form
        self.forms = [
            [(t.partition(":")[0], t.partition(":")[2]) for t in alternative.split()]
            for alternative in terminals.split("|")
        ]
        self.mark = mark
        self.meaning = meaning
        self.laws = laws or {}
        self.meant = meant or {}
        self.params = params


class Card:
    """One card of the deck, bound to its specification: parameters are attributes, terminals are resolved."""

    spec: Spec
    valued = False  # its second and later words can be a value: FORCE push tip 3
    beyond = ""  # what takes more words than it does
    from_start = False  # its constraints hold what they are at the start
    drawn = True  # has it a shape of its own? What another card stands for has none
    limits = "widen range=, or keep the joint inside of it"  # what mends that a number has come to its end in a run
    acts_on = ""  # what of a joint it acts on: its coordinate; "one": by its word; "several": a vector of speeds too (along.py)
    grouped = False  # names stand in parentheses behind its own: the nodes of several windings

    @classmethod
    def marked(cls, code: str) -> bool:
        """Whether a line that begins with its word is meant as the card, and not as a SPICE element. `code`: without comments."""
        return sets(code, cls.spec.mark)

    @classmethod
    def mark_in_words(cls) -> str:
        """What `marked` looks for, in words."""
        *keys, last = (f"{key}=" for key in cls.spec.mark)
        return f"{', '.join(keys)} or {last}" if keys else last

    @classmethod
    def variant(cls, raw: MachineCard, models: dict[str, Model]) -> type[Card]:
        """The class that a card of this word is of, where its .model decides."""
        return cls

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        return cls.spec.forms  # what its words may be, (terminal, kind) each

    @classmethod
    def stands_for(cls, raw: MachineCard) -> list[MachineCard]:
        return []

    def __init__(self, raw: MachineCard, sink: Sink) -> None:
        self.raw = raw
        self.name = raw.name
        self.span = raw.span
        self.terminals: list[tuple[str, str, Ref]] = []
        self.ok = bind(self, raw, sink)
        if self.ok:
            before = sink_errors(sink)
            self.check(sink)
            self.ok = sink_errors(sink) == before

    def given(self, name: str) -> bool:
        return name in self.raw.params  # was the parameter written on the card?

    def place(self, name: str) -> Span:
        return self.raw.param_spans.get(name, self.span)  # of a parameter in the deck, or of the card

    def check(self, sink: Sink) -> None:
        """Rules between parameters."""

    def leaves_plane(self) -> bool:
        """Does it push or turn free bodies out of the plane z = const, whatever its points are?"""
        return False

    def prepare(self, s: Scene) -> None:
        """Rules between terminals; branches."""

    def kinetic(self, s: Scene) -> Scalar | None:
        return None

    def potential(self, s: Scene) -> Scalar | None:
        return None

    def coenergy(self, s: Scene) -> Scalar | None:
        return None

    def powers(self, s: Scene) -> Powers:
        return []

    def stamp(self, s: Scene) -> None:
        """The electrical side."""

    def probes(self, s: Scene) -> Probes:
        return {}

    def laws(self, s: Scene) -> list[Law]:
        return []

    def constraints(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return []

    def velocities(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        return []

    def node_currents(self, s: Scene) -> Sequence[Scalar] | None:
        """Into its nodes, in their order [A]; None: i(name) into the first one, and out of the second."""
        return None

    def losses(self, s: Scene) -> Scalar | None:
        return None

    def taken(self, s: Scene) -> Scalar | None:
        return None

    def stored(self, s: Scene) -> Scalar | None:
        return None

    def supplied(self, s: Scene) -> Scalar | None:
        return None

    def thermal(self, s: Scene) -> Resistances:
        return []

    def glyph(self, draw: Pen) -> None:
        """Shapes."""

    def analogue(self, net: Net) -> None:
        net.refuse(self)


def sets(code: str, keys: tuple[str, ...]) -> bool:
    """Whether one of the keys is set in the code: `key =`, but no `==`."""
    pieces = code.lower().split("=")
    last = len(pieces) - 1
    return any(
        piece.split()[-1:] in [[key] for key in keys] and (pieces[k + 1] or k + 1 == last)
        for k, piece in enumerate(pieces[:-1])
    )


def sink_errors(sink: Sink) -> int:
    """How many errors have been reported so far, one told before as well."""
    return sink.error_count


def bind(card: Card, raw: MachineCard, sink: Sink) -> bool:
    """Put the raw card's words and parameters on `card` as its spec says; False after an error."""
    spec, before = card.spec, sink_errors(sink)

    # terminals: the form with as many words as the card has
    possible = card.forms(raw)
    forms = [f for f in possible if len(f) == len(raw.args)]
    if not forms:
        wanted = " or ".join(str(len(f)) for f in possible)
        units = [ref for ref in raw.args if ref.name in UNITS]
        sink.error(
            "E233",
            f"{spec.word} {raw.name} has {len(raw.args)} terminal(s) where {wanted} are needed",
            units[0].span if units else raw.span,
            hint=f"a unit stands right behind its number, as in 90{units[0].name}"
            if units
            else f"the form is: {spec.form}" + card.beyond * (len(raw.args) > max(map(len, possible))),
        )
    else:
        card.terminals = [(name, kind, ref) for (name, kind), ref in zip(forms[0], raw.args, strict=True)]

    # parameters
    wave_taken = raw.wave is None
    for key, value in raw.params.items():
        param = spec.params.get(key)
        if param is None:
            sink.add(_not_taken(raw, key, spec))
            continue
        setattr(card, key, _convert(card, raw, key, param, value, sink))
    for key, param in spec.params.items():
        if key in raw.params:
            continue
        if param.kind == "value" and not wave_taken and (key in ("value", "tau") or param.required):
            setattr(card, key, raw.wave)
            wave_taken = True
        elif param.required:
            sink.error(
                "E230",
                f"{spec.word} {raw.name} needs {key}= ({param.meaning}, {param.unit or 'a word'})",
                raw.span,
                hint=f"the form is: {spec.form}",
            )
        else:
            setattr(card, key, param.default)
    if not wave_taken:
        sink.error(
            "E231", f"{spec.word} {raw.name} does not take a waveform", raw.span, f"the form is: {spec.form}"
        )
    return sink_errors(sink) == before


# what people call parameters, where the card has the other
PARAMETERS = {
    "jrotor": "j", "jm": "j", "inertia": "j", "mass": "m", "resistance": "r", "ra": "r", "rm": "r", "inductance": "l", "la": "l",
    "km": "kt", "ratio": "gear", "n": "ratio", "friction": "b", "damping": "c", "stiffness": "k", "lo": "min", "hi": "max",
    "lower": "min", "upper": "max", "length": "l0", "angle": "q", "speed": "qd",
}  # fmt: skip


def _not_taken(raw: MachineCard, key: str, spec: Spec) -> Diagnostic:
    """E231: a parameter that the card has not."""
    span, named = raw.param_spans.get(key, raw.span), PARAMETERS.get(key, "")
    close = named if named in spec.params and named not in raw.params else suggest(key, spec.params)
    hint = f"did you mean {close}=?" if close else f"the form is: {spec.form}"
    fixes = instead(span, key, close) if close else []
    what = "a value without a name" if key == "value" else f"parameter {key}="
    if key == "value" and (place := _after_comma(raw)) is not None:
        hint, fixes = "a list stands in parentheses, (1,2); decimals have a dot, 0.2", place
    return Diagnostic(
        "error", "E231", f"{spec.word} {raw.name} does not take {what}", span, hint, fixes=fixes
    )


def _after_comma(raw: MachineCard) -> list[Fix] | None:
    """Where the value without a name follows a comma, ic=1,2 or m=0,2: what mends it, if it was a decimal one."""
    at, line = raw.param_spans.get("value"), raw.line
    if at is None or line is None or not line.single:
        return None
    before = line.text[: at.col - line.col]
    if before.rstrip()[-1:] != ",":
        return None
    if not before[-2:-1].isdigit():
        return []
    return [Fix(Span(at.file, at.line, at.col - 1, at.col), ".", "write a dot for the comma")]


def in_braces(value: object) -> str | None:
    """The hint where a word stands for a number: a calculation, a parameter's name, a dash that is no minus."""
    word = next((v for v in value if isinstance(v, str)), "") if isinstance(value, tuple) else value
    if not isinstance(word, str) or not word:
        return None
    plain = word.replace("\u2212", "-").replace("\u2013", "-")
    if plain != word:
        return f"its dash is no minus sign: write `{plain}`"
    return f"a parameter or a calculation stands in braces: {{{word}}}"


def is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _convert(card: Card, raw: MachineCard, key: str, param: Param, value: Any, sink: Sink) -> Any:
    """The value in the kind the spec asks for; reports and returns the default when it does not fit."""
    where, what = raw.param_spans.get(key, raw.span), f"{key}= of {raw.kind} {raw.name}"
    value = _with_pi(value)
    if {"value": True, "formula": isinstance(value, Node), "shape": not is_number(value)}.get(param.kind):
        return value
    if param.kind in ("word", "flag", "heat", "owner"):
        word = str(int(value)) if is_number(value) and float(value).is_integer() else word_of(value)
        if param.kind == "flag":
            if word in ("yes", "true", "on", "1"):
                return True
            if word in ("no", "false", "off", "0"):
                return False
            sink.error("E232", f"{what} is yes or no", where)
            return param.default
        if word is None or (param.words and word not in param.words):
            said = f"{what} is one of: {', '.join(param.words)}" if param.words else f"{what} is a name"
            sink.error("E232", said, where, did_you_mean(word or "", param.words, form="{}"))
            return param.default
        return word
    if param.kind == "vector":
        values = value if isinstance(value, tuple) else (value,)
        if all(is_number(v) for v in values):
            computable = all(_computable(float(v), what, where, sink) for v in values)
            return tuple(float(v) for v in values) if computable else param.default
        sink.error("E232", f"{what} is a list of numbers such as (1,0)", where, in_braces(value))
        return param.default
    if isinstance(value, OpenNumber):
        return value if limit(param, key, value, f"{raw.kind} {raw.name}", where, sink) else param.default
    if not is_number(value):
        got = "a list" if isinstance(value, tuple) else "an expression that changes while the deck runs"
        if isinstance(value, str):
            got = f"the word {value!r}"
        sink.error(
            "E232", f"{what} is a number ({param.unit or 'no unit'}), not {got}", where, in_braces(value)
        )
        return param.default
    number = float(value)
    return number if limit(param, key, number, f"{raw.kind} {raw.name}", where, sink) else param.default


def limit(param: Param, key: str, number: float | OpenNumber, of: str, where: Span, sink: Sink) -> bool:
    """Says where a number is out of its parameter's range; False where it is none at all."""
    what = f"{key}= of {of}"
    if not isinstance(number, OpenNumber) and not _computable(number, what, where, sink):
        return False
    meaning = param.meaning.partition(";")[0]  # what it is, without what follows when it is left out
    if param.least is not None and number < param.least:
        sink.error("E238", f"{what} is {number:g}; {meaning} cannot be below {param.least:g}", where)
    elif param.above is not None and number <= param.above:
        sink.error("E238", f"{what} is {number:g}; {meaning} must be greater than {param.above:g}", where)
    return True


def _computable(number: float, what: str, where: Span, sink: Sink) -> bool:
    if number != number or number in (float("inf"), float("-inf")):
        sink.error("E232", f"{what} is not a finite number", where)
    elif abs(number) > HUGE:
        sink.error("E232", f"{what} is {number:g}: nothing can be computed with its square", where)
    else:
        return True
    return False


def _with_pi(value: Any) -> Any:
    """`pi` and `-pi` as numbers, also in lists: range=(0,pi)."""
    if isinstance(value, tuple):
        return tuple(map(_with_pi, value))
    return {"pi": pi, "-pi": -pi}.get(value, value) if isinstance(value, str) else value


def word_of(value: Any) -> str | None:
    """The plain word of a value: a string or a bare name of an expression."""
    name = value if isinstance(value, str) else getattr(value, "id", None)
    return name if isinstance(name, str) else None
