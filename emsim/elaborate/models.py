"""Models: the .model that an element names, evaluated once at the level that holds it."""

from __future__ import annotations

from ..build import reread_as_element
from ..cards import CARDS
from ..deck import MachineCard, Model
from ..diagnostics import Diagnostic, instead, suggest
from ..elements import LETTERS, MODEL_TYPES, Element
from ..expr import Node, evaluate
from ..syntax import LineError
from ..units import spice_number
from .flat import FlatDeck

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .bind import Level
    from .scope import DeckScope

# shorter names are those of elements
LEAST_WORD = 4

# A lines of LTspice's, and what says the same
LTSPICE_PARTS = {
    "inv": "B1 q 0 V={v(in) > 0.5 ? 0 : 1}", "buf": "B1 q 0 V={v(in) > 0.5 ? 1 : 0}",
    "and": "B1 q 0 V={v(a) > 0.5 && v(b) > 0.5 ? 1 : 0}", "or": "B1 q 0 V={v(a) > 0.5 || v(b) > 0.5 ? 1 : 0}",
    "xor": "B1 q 0 V={(v(a) > 0.5) != (v(b) > 0.5) ? 1 : 0}",
    "schmitt": "a switch: S1 q vdd in 0 sw with .model sw SW(vt=0.5 vh=0.2)",
    "schmtbuf": "a switch: S1 q vdd in 0 sw with .model sw SW(vt=0.5 vh=0.2)",
    "schmtinv": "a switch: S1 q 0 in 0 sw with .model sw SW(vt=0.5 vh=0.2)",
    "dflop": "a code model between bridges: d_dff", "srflop": "a code model between bridges: d_srlatch",
    "ota": "G1 0 out in+ in- gm", "varistor": "B1 a b I={sgn(v(a,b))*(abs(v(a,b))/100)^30}",
    "modulate": "B1 q 0 V={sin(2*pi*idt(v(fm)))}", "samplehold": "the code model between bridges, or a switch and a capacitor",
    "counter": "a code model between bridges: d_fdiv",
}  # fmt: skip

TINY = 1e-12  # lengths that differ by less are one [m]

# what a .model may say of its elements: PSpice's temperatures, and what multiplies a value
OF_ELEMENTS = {"t_abs": "temp", "t_rel_global": "dtemp", "scale": "scale"}
SPELLINGS = {"t_measured": "tnom", "tref": "tnom"}


def _bins(scope: DeckScope, name: str) -> list[str]:
    """Models name.1, name.2, ... in the order of the text."""
    start = name + "."
    return [m for m in scope.all_models() if m.startswith(start) and m[len(start) :].isdigit()]


class Models:
    """Finds and evaluates models; every one that is found stands in `flat.models` under its flat name."""

    def __init__(self, flat: FlatDeck) -> None:
        self.flat = flat
        self.sink = flat.sink
        self.of_elements: dict[str, dict[str, Any]] = {}  # flat name -> what the model says of its elements

    def at(self, name: str, scope: DeckScope) -> Model | None:
        """The model of that name as seen from a scope, with numbers for parameters."""
        found = scope.find_model(name)
        if found is None:
            return None
        card, owner = found
        flat_name = owner.prefix + card.name
        known = self.flat.models.get(flat_name)
        if known is not None:
            return known
        model = Model(flat_name, card.type, {}, card.span, card.param_spans)
        self.flat.models[flat_name] = model
        params = dict(card.params)
        if card.type.startswith("ako:"):
            self._inherit(model, card, params, owner)
        kind = MODEL_TYPES.get(model.type)
        if kind is not None and kind.value_or_model:
            model.type = kind.model_types[0]
        # a parameter of a module from .hdl keeps its name: tref is one of MEXTRAM's
        own = {key for module in self.flat.modules.values() for key in module.parameters}
        own = own.intersection(SPELLINGS) if kind is not None else set(SPELLINGS)
        for key, value in params.items():
            if isinstance(value, Node):
                value = evaluate(value, owner)
            elif isinstance(value, str) and (named := owner.lookup(value)) is not None:
                value = named  # a .param's name, without braces as in ngspice
            elif isinstance(value, list):
                value = [evaluate(v, owner) if isinstance(v, Node) else v for v in value]
            if key not in own:
                key = SPELLINGS.get(key, key)
            model.params.pop(key, None)  # of two names of one parameter the last holds
            model.params[key] = value
        said = [key for key in OF_ELEMENTS if key in model.params]
        if said and kind is not None and (kind.value_or_model or "scale" not in said):
            self.of_elements[flat_name] = {OF_ELEMENTS[key]: model.params.pop(key) for key in said}
        return model

    def _inherit(self, model: Model, card: Model, params: dict[str, Any], owner: DeckScope) -> None:
        """.model new ako:base d (...)"""
        base = self.at(card.type[4:], owner)
        if base is None:
            self.sink.error("E140", f"no .model is called `{card.type[4:]}`", card.span)
            return
        params.pop(base.type, None)
        model.type = base.type
        model.params.update(base.params)

    def parameter(self, e: Element, level: Level) -> float | None:
        """The value of the .param that stands where R, C, L have a value or a .model. As in ngspice it goes first."""
        if e.model_name is None or e.value is not None or not e.value_or_model:
            return None
        return level.scope.lookup(e.model_name)

    def of_element(self, e: Element, level: Level) -> Model | None:
        """The model of R C L D S W; problems go to the sink."""
        name = e.model_name
        assert name is not None
        model = self.at(name, level.scope) or self._of_its_bin(e, name, level)
        if model is None:
            self._missing(e, name, level)
            return None
        accepted = e.model_types
        if accepted and model.type not in accepted:
            self.sink.error(
                "E141",
                f"`{e.name}` needs a model of type {e.model_sort()}, `{name}` is {model.type.upper()}",
                e.model_span or e.span,
                e.model_hint(model.type),
                labels=[(model.span, "defined here")],
            )
            return None
        if (said := self.of_elements.get(model.name)) is not None:
            own = {key: value for key, value in said.items() if key != "scale"}
            if "temp" in e.params or "dtemp" in e.params:  # the line stands above the model
                own = {}
            if "scale" in said:
                own["scale"] = e.number("scale", 1.0) * float(said["scale"])
            e.params = {**e.params, **own}
        return model

    def _of_its_bin(self, e: Element, name: str, level: Level) -> Model | None:
        """Of the models name.1, name.2, ... the first that holds l and w, as in ngspice: lmin <= l <= lmax, likewise w.
        Bins are in metres; option scale makes metres of l and w. With wnflag=1 a bin is one of the width of a finger."""
        bins = [m for word in _bins(level.scope, name) if (m := self.at(word, level.scope)) is not None]
        if not bins:
            return None
        options = self.flat.options
        scale = float(options.get("scale", 1.0))
        size = {key: scale * e.number(key, float(bins[0].params.get(key, 1e-4))) for key in ("l", "w")}
        if e.number("wnflag", float(options.get("wnflag", 0.0))):
            size["w"] /= e.number("nf", 1.0)

        def fits(model: Model, key: str) -> bool:
            low, high = (
                float(model.params.get(key + end, bound)) for end, bound in (("min", 0.0), ("max", 1e30))
            )
            return low - TINY <= size[key] < high + TINY

        for model in bins:
            if fits(model, "l") and fits(model, "w"):
                return model
        said = f"`{e.name}` has l = {size['l']:g}, w = {size['w']:g}: no bin of `{name}` holds these"
        self.sink.error(
            "E143", said, e.model_span or e.span, f"{len(bins)} models {name}.* say lmin lmax wmin wmax"
        )
        return bins[0]

    def _missing(self, e: Element, name: str, level: Level) -> None:
        if e.value_or_model and e.value is None:
            near = suggest(name, level.scope.names())
            hint = f"a .model {name} {e.letter.upper()}(...) is missing, or a value"
            self.sink.error(
                "E140",
                f"`{name}` is no number, no .param and no .model",
                e.model_span or e.span,
                f"did you mean `{near}`?" if near else hint,
                fixes=instead(e.model_span, name, near) if near else [],
            )
            return
        from ..mistakes import line_at, other_card
        from ..slips import unit_apart

        line, place = line_at(e.span), e.model_span or e.span
        meant = other_card(line)
        if meant is None and e.value is not None:
            start = place.col - e.span.col if place.line == e.span.line else 0
            meant = unit_apart(line, start, start + len(name))
        if meant is not None:
            self.sink.add(meant)
            return
        candidates = level.scope.all_models()
        near = suggest(name, candidates)
        word, said, at = e.span.text.lower(), f"no .model is called `{name}`", place
        fixes = instead(at, name, near) if near else []
        if word.upper() in CARDS:
            from ..marks import missing_mark

            hint = missing_mark(word)
            if word == "joint":
                from ..cards.joints import KINDS

                kind = suggest(name, KINDS)
                fixes = instead(at, name, kind) if kind else []
                hint = f"did you mean `{kind}`? {hint}" if kind else hint
            said = f"this is no {word.upper()} card, and no .model is called `{name}` for a SPICE element"
        elif level.scope.find_subckt(name) is not None:
            hint = f"`{name}` is a subcircuit: begin the line with X"
        elif (inside := level.scope.subckt_with_model(name)) is not None:
            hint = f"the .model {name} in .subckt {inside} is known there alone: put it outside"
        elif e.letter == "a" and name in LTSPICE_PARTS:
            said = f"`{name.upper()}` is a part of LTspice's; an A line names a .model here"
            hint, fixes = f"write {LTSPICE_PARTS[name]}; emsim help code_models lists what A lines do", []
        elif near:
            hint = f"did you mean `{near}`?"
            if len(e.model_types) > 1 and (found := level.scope.find_model(near)) is not None:
                hint += f" It is of type {found[0].type.upper()}"
        elif len(word) >= LEAST_WORD and word.isalpha() and (card := suggest(word, map(str.lower, CARDS))):
            said = f"this is no {card.upper()} card, and no .model is called `{name}` for a SPICE element"
            hint = f"did you mean `{card.upper()}`?"
        else:
            wanted = (e.model_types or ("type",))[0].upper()
            hint = f"add .model {name} {wanted}(...), or the .include that holds it"
        self.sink.error("E140", said, at, hint, fixes=fixes)

    # ---- letters with a varying number of nodes ----

    def of_device(self, e: Element, level: Level) -> None:
        """Where the number of nodes varies, the first word that names a model ends them. Others keep their words."""
        words: list[Any] = e.extra["words"]
        spans = e.extra["word_spans"]
        first = e.least
        if not first:
            return
        for i in range(first, len(words)):
            word = words[i]
            if isinstance(word, str) and (
                level.scope.find_model(word) is not None or _bins(level.scope, word)
            ):
                e.model_name, e.model_span = word, spans[i]
                e.model = self.of_element(e, level)
                e.nodes = [level.node(str(w), s) for w, s in zip(words[:i], spans, strict=False)]
                e.extra["words"] = words[i + 1 :]
                e.extra["word_spans"] = spans[i + 1 :]
                if e.supported:
                    self._words_behind(e, level)
                return
        at = min(e.usual or first, len(words) - 1)
        if at < first - 1 or not words or level.scope.find_model(str(words[at])) is not None:
            from ..mistakes import line_at, other_card

            meant = other_card(line_at(e.span))
            self.sink.add(
                meant or Diagnostic("error", "E109", f"`{e.name}` has too few nodes", e.span, e.hint)
            )
            return
        e.model_span = spans[at]
        self._missing(e, str(words[at]), level)

    def _words_behind(self, e: Element, level: Level) -> None:
        """What stands behind the model: numbers, flags, and names before values, which may be names of parameters."""
        words: list[float | str] = []
        for w in e.extra["words"]:
            value = (
                evaluate(w, level.scope)
                if isinstance(w, Node)
                else spice_number(w)
                if isinstance(w, str)
                else w
            )
            if value is None and words and isinstance(words[-1], str) and words[-1] not in e.flags:
                value = level.scope.lookup(w)  # the name of a parameter
            if words[-1:] == ["m"] and value is not None and e.is_multiplied:
                value *= level.mult
            words.append(w if value is None else value)
        try:
            e.take_words(words, e.extra["word_spans"])
        except LineError as error:
            self.sink.add(error.diagnostic)
        if not e.fewest() <= len(e.nodes) <= len(e.terminals):
            self.sink.error(
                "E109",
                f"`{e.name}` has too {'few' if len(e.nodes) < e.fewest() else 'many'} nodes",
                e.span,
                e.hint,
            )

    # ---- machine cards that SPICE can read as well ----

    def spice_reading(self, card: MachineCard, level: Level) -> Element | None:
        """The element, when a .model of the SPICE type fits the line: then the SPICE reading wins."""
        accepted = LETTERS[card.kind[0].lower()].model_types
        if not accepted or card.line is None:
            return None
        for ref in card.args:
            found = level.scope.find_model(ref.name) if ref.point is None else None
            if found is None or found[0].type not in accepted:
                continue
            element = reread_as_element(card.line, self.sink)
            if element is None:
                continue
            at = element.extra.get("words", [])
            if element.model_name == ref.name or ref.name in at[element.least or 0 :]:
                self.sink.note(
                    "N137",
                    f"read as SPICE element {card.kind[0]}, because a .model fits, not as a {card.kind} card",
                    card.span,
                    "rename the model or the joint to make it a machine card",
                    labels=[(found[0].span, "this model")],
                )
                return element
        return None
