"""Binding: one card of the nested deck becomes a card of the flat deck at its level.

Names get their prefix or what the port is tied to, parameters become numbers, and an expression that reads the
solution keeps only that.
"""

from __future__ import annotations

from ..deck import MachineCard, Ref, Waveform
from ..diagnostics import Sink
from ..expr import Call, ExprError, Name, Node, Num, Scope, evaluate, fold, is_constant, to_text
from ..traced import number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Value
    from ..diagnostics import Placed, Span
    from ..elements import Element
    from .models import Models
    from .scope import DeckScope

_UNUSED = (False, "")
# the arguments of a machine card that are words, not names
_WORD_ARGS = {"JOINT": 2}


class Level:
    """The top of the deck, or one use of a subcircuit: prefix `x1.`, ports tied to names of the level above."""

    def __init__(
        self,
        prefix: str,
        scope: DeckScope,
        ports: dict[str, Ref],
        globals: set[str],
        sink: Sink,
        mult: float = 1.0,
        used_at: Placed | None = None,
        above: Level | None = None,
        words: dict[str, str] | None = None,
    ) -> None:
        self.prefix = prefix
        self.scope = scope
        self.ports = ports
        self.globals = globals
        self.sink = sink
        self.mult = mult
        self.used_at = used_at
        self.above = above
        self.words = words or {}  # terminal -> the word that stands for it on the X line
        self.uses: dict[str, tuple[bool, str]] = {}  # terminal -> (is it a node?, the card that says so)
        scope.prefix = prefix
        scope.prober = self.probe

    def node(self, name: str, span: Span | None) -> str:
        """The flat name of a node."""
        if name in self.globals:
            return name
        tied = self.ports.get(name)
        if tied is None:
            return self.prefix + name
        if tied.point is not None:
            raise ExprError(
                "E136",
                f"the terminal `{name}` is used as a node, but a point of a body is tied to it",
                span if self.used_at is None else self.used_at.span,
            )
        return tied.name

    def use(self, name: str, as_node: bool, card: str) -> None:
        """Note what a terminal stands for, here and in the levels above. Raises ExprError on a mix-up."""
        if not as_node:
            name = name.partition(".")[0]
        tied = self.ports.get(name)
        if tied is None or tied.name in self.globals or tied.name == "gnd":  # ground is in both worlds
            return
        known, first = self.uses.setdefault(name, (as_node, card))
        if known == as_node and first != card:
            return  # noted before
        if known != as_node:
            node, other = (card, first) if as_node else (first, card)
            raise ExprError(
                "E136",
                f"the terminal `{name}` is a node for {node} and a mechanical thing for {other}",
                None if self.used_at is None else self.used_at.span,
                "a terminal is one or the other; take two terminals",
            )
        if self.above is not None and name in self.words:
            self.above.use(self.words[name], as_node, card)

    def ref(self, ref: Ref) -> Ref:
        """The flat form of a body, point, joint or node. What comes through a terminal stands on the X line."""
        name, point = self.place(ref.name, ref)
        at = self.ports[ref.name].at if ref.name in self.ports else ref.at
        if ref.point is not None:
            if point is not None:
                raise ExprError("E136", f"`{ref.name}` is a point already; it has no points", ref.span)
            point = tuple(bind_value(v, self.scope) for v in ref.point)
        return Ref(name, point, at)

    def place(self, name: str, where: Placed | MachineCard) -> tuple[str, tuple[Any, ...] | None]:
        """(flat name, point tied to it) of `arm`, `arm.tip`, `0`, a joint."""
        if name in self.globals:
            return name, None
        head, dot, tail = name.partition(".")
        tied = self.ports.get(head)
        if tied is None:
            return self.prefix + name, None
        if dot and tied.point is not None:
            raise ExprError("E136", f"`{head}` is a point; it has no point `{tail}`", where.span)
        return tied.name + dot + tail, tied.point

    def probe(self, call: Call) -> Node:
        """v(a), i(v1), angle(hinge), x(arm(0.3,0)): the names in it in their flat form."""
        if not self.prefix and call.fn == "v":  # the names of the top level are flat
            return call
        args: list[Node] = []
        for arg in call.args:
            if (
                call.fn[0] == "v"
                and call.fn in ("v", "vm", "vp", "vr", "vi", "vdb")
                and isinstance(arg, Name)
            ):
                if arg.id in self.ports:
                    self.use(arg.id, True, to_text(call))
                args.append(Name(self.node(arg.id, None), arg.at))
            elif call.fn == "i" and isinstance(arg, Name):
                # ngspice calls the source v1 of x1 v.x1.v1
                known = arg.id[2:] if arg.id[1:3] == ".x" and arg.id[0] != "x" else arg.id
                args.append(Name(self.prefix + known, arg.at))
            elif isinstance(arg, Name):
                if arg.id.partition(".")[0] in self.ports:
                    self.use(arg.id, False, to_text(call))
                name, point = self.place(arg.id, arg)
                args.append(Name(name, arg.at) if point is None else Call(name, _numbers(point), arg.at))
            elif isinstance(arg, Call):
                if arg.fn in self.ports:
                    self.use(arg.fn, False, to_text(call))
                name, point = self.place(arg.fn, arg)
                if point is not None:
                    raise ExprError("E136", f"`{arg.fn}` is a point already; it has no points", arg.span)
                args.append(Call(name, arg.args, arg.at))
            else:
                args.append(arg)
        return Call(call.fn, args, call.at)


def _numbers(point: tuple[Any, ...]) -> list[Node]:
    return [p if isinstance(p, Node) else Num(float(p)) for p in point]


# ---- elements ----


def bind_element(e: Element, level: Level, models: Models) -> Element:
    """The element at its level. Raises ExprError; a model that is not found goes to the sink."""
    flat = e.at_level(level.prefix + e.name, [level.node(n, None) for n in e.nodes])
    for n in e.nodes:
        if n in level.ports and not level.uses.get(n, _UNUSED)[0]:
            level.use(n, True, e.name)
    if not e.is_plain:
        _bind_values(flat, e, level)
    if "tol" in flat.params:
        _tolerance(flat, level)
    if level.mult != 1.0 and e.is_multiplied:
        own = flat.params.get("m", 1.0)
        flat.params["m"] = level.mult * (own if isinstance(own, float) else 1.0)
    value = models.parameter(e, level)
    if value is not None:
        flat.value, flat.value_span, flat.model_name = value, e.model_span, None
    elif e.model_name is not None:
        flat.model_name = e.model_name
        flat.model = models.of_element(flat, level)
    elif "words" in e.extra:
        models.of_device(flat, level)
    return flat


def _tolerance(flat: Element, level: Level) -> None:
    """The value of a part that may be off, where a sweep asks for such values."""
    percent = flat.params["tol"]
    if not isinstance(percent, float) or not 0.0 <= percent < 100.0:
        raise ExprError(
            "E363", f"`{flat.name}` cannot be off by {percent:g} %", flat.span, "tol=5% is 5 per cent"
        )
    factor = level.scope.draws.tolerance(flat.name, 0.01 * percent, flat.span)
    if level.scope.draws.tolerances:
        scale = flat.params.get("scale", 1.0)
        flat.params = {**flat.params, "scale": factor * (scale if isinstance(scale, float) else 1.0)}


def _bind_values(flat: Element, e: Element, level: Level) -> None:
    """Value, parameters and waveform become numbers, or what the run has to evaluate."""
    scope = level.scope
    if e.params:
        flat.params = {key: _param(value, scope) for key, value in e.params.items()}
    if isinstance(e.value, Node):
        flat.value = behaviour(e.value, scope, e.is_behaviour)
        if isinstance(flat.value, Node) and not e.may_behave:
            raise ExprError("E125", "this value has to be known before the run", e.value_span)
    if e.wave is not None:
        flat.wave = bind_wave(e.wave, scope)
    if flat.extra:
        flat.bind(level)


def _number(value: Any, scope: Scope) -> float:
    return evaluate(value, scope) if isinstance(value, Node) else number(value)


def _param(value: Any, scope: Scope) -> Any:
    if isinstance(value, list):
        return [_param(v, scope) for v in value]
    return evaluate(value, scope) if isinstance(value, Node) else value


def behaviour(node: Node, scope: Scope, always: bool = False) -> float | Node:
    """A number where the expression is one, else what is left of it for the run."""
    if not always and is_constant(node):
        try:
            return evaluate(node, scope)
        except ExprError as error:
            if error.code not in ("E120", "E125", "E385"):  # a .func in it may read the solution
                raise
    folded = fold(node, scope)
    return folded.value if isinstance(folded, Num) and not always else folded


def bind_wave(wave: Waveform, scope: Scope) -> Waveform:
    return Waveform(
        wave.kind,
        [_number(a, scope) for a in wave.args],
        {key: _number(v, scope) for key, v in wave.params.items()},
        wave.span,
    )


# ---- machine cards ----


def bind_machine_card(card: MachineCard, level: Level, models: Models) -> MachineCard:
    """The machine card at its level. Raises ExprError."""
    from ..cards import CARDS

    if level.mult != 1.0 and card.kind != "POINT":
        where = level
        while where.above is not None and where.above.mult == where.mult:
            where = where.above
        raise ExprError(
            "E138",
            f"m={level.mult:g} cannot multiply the {card.kind} {level.prefix}{card.name}",
            None if where.used_at is None else where.used_at.span,
            "m= counts electrical elements in parallel; write one X line for each machine",
        )
    word_at = _WORD_ARGS.get(card.kind, -1)
    args = [r if i == word_at else level.ref(r) for i, r in enumerate(card.args)]
    name = level.prefix + card.name
    if card.kind == "POINT":  # `arm.tip`: the body may come through a terminal
        name, tied = level.place(card.name, card)
        if tied is not None:
            raise ExprError("E136", f"`{card.name.partition('.')[0]}` is a point, not a body", card.span)
    params: dict[str, Value] = {}
    for key, value in card.params.items():
        if key == "model" and isinstance(value, (str, Name)):
            word = value if isinstance(value, str) else value.id
            model = models.at(word, level.scope)
            params[key] = word if model is None else model.name
        elif (kind := _names_thing(card, key)) and isinstance(value, (str, Name)):
            word = value if isinstance(value, str) else value.id
            params[key] = level.prefix + word if kind == "owner" else level.place(word, card)[0]
        elif key in ("shape", "look", "section") and isinstance(
            value, Call
        ):  # the card judges what it is called
            named = value.args[:1] if value.fn == "stl" else []  # a file, no number
            numbers = [Num(_number(a, level.scope), a.at) for a in value.args[len(named) :]]
            params[key] = Call(value.fn, [*named, *numbers], value.at)
        else:
            params[key] = bind_value(value, level.scope)
    wave = None if card.wave is None else bind_wave(card.wave, level.scope)
    flat = MachineCard(
        card.kind, name, args, params, wave, card.span, card.param_spans, card.line, card.units, card.groups
    )
    if level.ports:
        forms = CARDS[card.kind].variant(flat, models.flat.models).forms(flat)
        _note_uses(card, forms, level, word_at)
    return flat


def _names_thing(card: MachineCard, key: str) -> str:
    """Whether a parameter names a node of another domain, "heat", or an element or card, "owner"."""
    from ..cards import CARDS

    param = CARDS[card.kind].spec.params.get(key)
    return param.kind if param is not None and param.kind in ("heat", "owner") else ""


def _note_uses(card: MachineCard, forms: list[list[tuple[str, str]]], level: Level, word_at: int) -> None:
    """Which terminals of the subcircuit the card takes for nodes, and which for mechanical things."""
    form: list[tuple[str, str]] = next((f for f in forms if len(f) == len(card.args)), [])
    for i, ((_, kind), ref) in enumerate(zip(form, card.args, strict=False)):
        if i != word_at:
            level.use(ref.name, kind == "node", f"{card.kind} {card.name}")


def bind_value(value: Any, scope: Scope) -> Any:
    """A value of a machine card: tuples and shapes item by item, expressions as far as they are constant."""
    if isinstance(value, tuple):
        return tuple(bind_value(v, scope) for v in value)
    if isinstance(value, Waveform):
        return bind_wave(value, scope)
    if isinstance(value, Node):
        return behaviour(value, scope)
    return value
