"""A deck that is altered between its runs: values of elements, models, parameters and options, without reading its text again.

An alteration acts on the flat deck; a changed .param, and `reset`, flatten the nested deck anew.
"""

from __future__ import annotations

from ..deck import Analysis, MachineCard, Param, Probe, Waveform
from ..diagnostics import Sink, did_you_mean
from ..draws import seeded
from ..elements import MODEL_TYPES, Element
from ..elements.passive import Passive
from ..expr import ExprError, Node
from .flatten import flatten

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from ..deck import Deck, Model
    from .flat import FlatDeck
    from .steps import Change

    Value = float | Sequence[float]

# a device's parameter that is its value; of sources `dc`
VALUES = {
    "r": ("resistance", "r", "value"), "c": ("capacitance", "c", "value", "cap"), "l": ("inductance", "l", "value", "ind"),
    "e": ("gain", "value"), "g": ("gain", "value"), "f": ("gain", "value"), "h": ("gain", "value"),
    "k": ("coupling", "k", "coefficient", "value"),
}  # fmt: skip
WAVES = ("pulse", "sin", "sine", "exp", "pwl", "sffm", "am")


class Altered:
    """A nested deck and what was changed of it.

    `options` stand above the deck's own; `wanted` are signals that every run records, where the deck has them.
    Errors are ExprError: E166 for what the deck does not have, E167 for what cannot be altered.
    """

    def __init__(
        self, deck: Deck, flat: FlatDeck | None = None, temp: object = None, seed: object = None
    ) -> None:
        self.deck, self.temp, self.seed = deck, temp, seed
        self.options: dict[str, Any] = {}
        self.saves: list[Probe] = []
        self.wanted: list[Probe] = []
        self.waiting: list[str] = []  # parameters that were altered since the last reset
        self._changes: list[Callable[[FlatDeck], None]] = []
        self._flat = flat
        self._seed, self._resets = (None if flat is None else flat.draws.seed), 0
        self._own = [] if flat is None else _own(flat)
        self._steps: list[Change] = []  # values of the deck's .step in the runs that follow
        self._places: dict[str, int] = {}
        self.title, self._defines = deck.title, dict(deck.defines)

    def flat(self) -> FlatDeck:
        """The flat deck as it stands. Raises DeckError where altered parameters make no sense."""
        flat = self._flat
        if flat is None:
            self.deck.sink = Sink()
            temp = self.options.get("temp", self.temp)
            seed = self.seed if self._seed is None else self._seed + self._resets
            flat = self._flat = flatten(self.deck, temp, seeded(seed), self._steps)
            self._places, self._own = {}, _own(flat)
            for change in self._changes:
                change(flat)
            if self._changes:
                flat.origin = None
        flat.options.update(self.options)
        for key in ("temp", "tnom"):
            if isinstance(value := self.options.get(key), float):
                setattr(flat, key, value)
        for step, value in self._steps:
            if step.kind == "temp":
                flat.temp = value
        flat.wanted = self.wanted
        flat.saves += [p for p in self.saves if p not in flat.saves]
        return flat

    def step(self, changes: Sequence[Change]) -> None:
        """The values of the deck's .step that the runs that follow have."""
        self._steps, self._flat = list(changes), None

    def analyses(self) -> list[Analysis]:
        """Those of the deck's own dot cards."""
        self.flat()
        return self._own

    # ---- changes ----

    def _change(self, change: Callable[[FlatDeck], None]) -> None:
        change(self.flat())
        self.flat().origin = None
        self._changes.append(change)

    def alter(self, device: str, parameter: str | None, value: Value) -> None:
        """A value of an element or a machine card: its main one where `parameter` is None."""
        self._change(lambda flat: self._alter(flat, device.lower(), parameter and parameter.lower(), value))

    def alter_model(self, model: str, parameter: str, value: float) -> None:
        self._change(lambda flat: _alter_model(flat, model.lower(), parameter.lower(), value))

    def alter_parameter(self, name: str, value: float, subckt: str | None = None) -> None:
        """A .param of the top level, or one of a subcircuit: of its line, or a .param in it."""
        name = name.lower()
        if subckt is not None:
            found = next(
                (c for c in self.deck.body if c.__class__.__name__ == "Subckt" and c.name == subckt.lower()),
                None,
            )
            known: list[str] = (
                []
                if found is None
                else [*found.params, *(p.name for p in found.body if isinstance(p, Param))]
            )
            if found is None or name not in known:
                what = (
                    f"the subcircuit `{subckt}` has no parameter `{name}`"
                    if found
                    else f"no subcircuit is called `{subckt}`"
                )
                raise ExprError("E166", what, None, did_you_mean(name, known))
            found.altered[name] = value
        else:
            own = self.flat().params
            if name not in own and name not in self.deck.params:
                hint = did_you_mean(name, own, "parameters: " + (", ".join(own) or "none"))
                raise ExprError("E166", f"the deck has no parameter `{name}`", None, hint)
            self.deck.defines[name] = value
        self.waiting.append(name)
        self._flat = None

    def set_option(self, name: str, value: Any) -> None:
        self.options[name.lower()] = value
        if name.lower() == "temp" and self._flat is not None and self._flat.reads_temper:
            self._flat = None

    def reset(self) -> None:
        """The deck as it was written, with altered parameters, and new random values."""
        self._resets += 1
        self._changes.clear()
        self.waiting.clear()
        self._flat = None

    def reread(self) -> None:
        """The deck as its text has it: altered parameters, too, are as written."""
        self.deck.defines.clear()
        self.deck.defines.update(self._defines)
        for card in self.deck.body:
            if card.__class__.__name__ == "Subckt":
                card.altered.clear()
        self.reset()

    # ---- elements ----

    def element(self, name: str, flat: FlatDeck | None = None) -> Element | None:
        """An element by its flat name, or as ngspice calls it: r.x1.r1 is x1.r1."""
        flat = flat or self.flat()
        if not self._places:
            self._places = {e.name: k for k, e in enumerate(flat.elements)}
        name = name.lower()
        spelt = name if name in self._places else name[2:] if name[1:2] == "." else name
        at = self._places.get(spelt)
        return None if at is None else flat.elements[at]

    def _alter(self, flat: FlatDeck, device: str, parameter: str | None, value: Value) -> None:
        element = self.element(device, flat)
        if element is None:
            card = next((k for k, c in enumerate(flat.machine) if c.name == device), None)
            if card is not None:
                flat.machine[card] = altered_card(flat.machine[card], parameter, _one(value))
                return
            raise ExprError(
                "E166",
                f"the deck has no element `{device}`",
                None,
                did_you_mean(device, [*self._places, *(c.name for c in flat.machine)]),
            )
        flat.elements[self._places[element.name]] = altered_element(element, parameter, value)

    def value(self, device: str, parameter: str) -> float | list[float] | None:
        """The value of @device[parameter] or @model[parameter] as the deck states it; None for what it does not."""
        flat, e = self.flat(), self.element(device)
        if e is None:
            model = flat.models.get(device)
            found = None if model is None else model.params.get(parameter)
            return float(found) if isinstance(found, (int, float)) else None
        return stated(e, parameter)


def stated(e: Element, parameter: str) -> float | list[float] | None:
    """@element[parameter] as its line and its .model state it; a capacitance counts those in parallel, as in ngspice."""
    if parameter in VALUES.get(e.letter, ()) and parameter not in e.params:
        value = e.value
        if value is None and isinstance(e, Passive) and e.model is not None:
            value = e.from_model(e.model.params)
        number = float(value) if isinstance(value, (int, float)) else None
        return number * e.number("m", 1.0) if number is not None and e.letter == "c" else number
    if e.letter in "vi":
        ac = e.extra.get("ac") or (0.0, 0.0)
        own = {"dc": e.extra.get("dc") or 0.0, "acmag": ac[0], "acphase": ac[1]}
        if parameter in own:
            return float(own[parameter])
        if e.wave is not None and parameter.replace("sine", "sin") == e.wave.kind:
            return [float(a) for a in e.wave.args]
    found = e.params.get(parameter)
    if found is None and parameter in e.instance:
        found = e.instance[parameter].default
    return float(found) if isinstance(found, (int, float)) else None


def _own(flat: FlatDeck) -> list[Analysis]:
    return [a for a in flat.analyses if a not in flat.commanded]


def _one(value: Value) -> float:
    if isinstance(value, (int, float)):
        return float(value)
    if len(value) != 1:
        raise ExprError("E167", f"one number is needed here, not {len(value)}")
    return float(value[0])


def altered_element(element: Element, parameter: str | None, value: Value) -> Element:
    """A copy with another value. Raises ExprError."""
    fresh = element.at_level(element.name, element.nodes)
    fresh.model_name, fresh.model = element.model_name, element.model
    _set(fresh, parameter, value)
    return fresh


def _set(e: Element, parameter: str | None, value: Value) -> None:
    if e.letter in "vi":
        if parameter in ("ac", "acmag", "acphase"):
            magnitude, phase = e.extra.get("ac") or (0.0, 0.0)
            numbers = [float(value)] if isinstance(value, (int, float)) else [float(v) for v in value]
            if parameter == "acphase":
                e.extra["ac"] = (magnitude, _one(value))
            else:
                e.extra["ac"] = (numbers[0], numbers[1] if numbers[1:] else phase)
            return
        if parameter in WAVES:
            args = [float(value)] if isinstance(value, (int, float)) else [float(v) for v in value]
            if parameter == "pwl" and len(args) % 2:
                raise ExprError(
                    "E167",
                    "PWL needs pairs of time and value",
                    None,
                    f"alter @{e.name}[pwl] = [ t1 v1 t2 v2 ]",
                )
            span = e.span if e.wave is None else e.wave.span
            e.wave = Waveform(parameter.replace("sine", "sin"), args, {}, span)
            return
        if parameter in (None, "dc", "value"):
            e.extra["dc"] = _one(value)
            return
    elif parameter is None or (parameter in VALUES.get(e.letter, ()) and parameter not in e.params):
        if e.letter not in VALUES or isinstance(e.value, Node):
            words = ", ".join(e.instance)
            raise ExprError(
                "E167",
                f"`{e.name}` has no single value",
                None,
                f"name a parameter: alter {e.name} {words or 'name'} = ..",
            )
        e.value, e.model_name = _one(value), e.model_name
        return
    if parameter not in e.known():
        known = [*VALUES.get(e.letter, ()), *e.known()]
        hint = did_you_mean(str(parameter), known, "it has: " + (", ".join(known) or "none"))
        raise ExprError("E166", f"a {e.what} has no parameter `{parameter}`", None, hint)
    e.params = {**e.params, str(parameter): _one(value)}
    e.is_plain = False


def altered_card(card: MachineCard, parameter: str | None, value: float) -> MachineCard:
    if parameter is None or (parameter not in card.params and parameter != "value"):
        hint = "it has: " + ", ".join(k for k, v in card.params.items() if isinstance(v, (int, float)))
        raise ExprError(
            "E166", f"the {card.kind} `{card.name}` has no `{parameter or 'value'}` on its line", None, hint
        )
    params = {**card.params, parameter: value}
    return MachineCard(
        card.kind, card.name, card.args, params, card.wave, card.span, card.param_spans, card.line, card.units
    )


def _alter_model(flat: FlatDeck, name: str, parameter: str, value: float) -> None:
    model: Model | None = flat.models.get(name)
    if model is None:  # a device stands for its model
        owner = next((e for e in flat.elements if e.name == name and e.model_name), None)
        model = None if owner is None else owner.model or flat.models.get(owner.model_name or "")
    if model is None:
        hint = did_you_mean(name, flat.models, "models: " + (", ".join(flat.models) or "none"))
        raise ExprError("E166", f"the deck has no .model `{name}`", None, hint)
    kind = MODEL_TYPES.get(model.type)
    known = None if kind is None else kind.model_names()
    if known is not None and parameter not in known:
        hint = did_you_mean(parameter, known, "it has: " + ", ".join(sorted(known)))
        raise ExprError(
            "E166", f"a model of type {model.type.upper()} has no parameter `{parameter}`", None, hint
        )
    model.params[parameter] = value
