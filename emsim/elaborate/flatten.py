"""Flattening: includes, conditions and subcircuits dissolve; what remains is one list of everything.

A `Level` is the top or one use of a subcircuit: it knows the prefix of names and what its ports are tied to.
Cards are visited twice: `expand` declares parameters, functions, models and subcircuits (so that they may be used
before the line that defines them) and settles .if; `emit` turns what is left into the flat deck.
"""

from __future__ import annotations

import os

from ..build import parse_expression
from ..deck import (
    Analysis,
    Conditional,
    Deck,
    Dot,
    Func,
    Include,
    Instance,
    MachineCard,
    Measure,
    Model,
    Param,
    Print,
    Probe,
    Subckt,
    Unread,
)
from ..diagnostics import Fix, OutsideError, did_you_mean, instead, suggest
from ..draws import SEED, Draws
from ..elements import MODEL_TYPES, Element
from ..expr import Call, ExprError, Name, Node, Num, evaluate, fold
from ..source import Line, NoCollection
from ..syntax import LineError
from ..traced import number
from ..units import ABSOLUTE_ZERO, spice_leftover, spice_number
from .bind import Level, bind_element, bind_machine_card
from .flat import FlatDeck
from .models import Models
from .scope import DeckScope, as_float

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from ..diagnostics import Span
    from ..elements.modules import Module
    from .files import Files
    from .steps import Change

CLOCKED = ("CLOCK", "BLOCK", "PWM", "FMU")
BLOCKS = ("BLOCK", "PWM", "FMU")  # that have signals

MAX_LEVELS = 60
MAX_INSTANCES = 1_000_000
STANDARD_GRAVITY = 9.80665


def flatten(
    deck: Deck, temp: object = None, draws: Draws | None = None, changes: Sequence[Change] = ()
) -> FlatDeck:
    """The flat deck, with the `changes` of a step. Raises DeckError with everything that is wrong in the text, its numbers and
    its names (OutsideError when nothing but missing files is wrong). `temp` [C] stands above the deck's own, `draws` of random
    values above its seed."""
    with NoCollection():
        flat = _Flattener(deck, temp, draws, changes).run()
        flat.origin = Origin(deck, temp, draws, changes)
    errors = [d for d in flat.sink.diagnostics if d.severity == "error"]
    if errors and all(d.code.startswith("E5") for d in errors):
        raise OutsideError(flat.sink.diagnostics)
    flat.sink.raise_if_errors()
    return flat


class Origin:
    """What a flat deck was made from."""

    __slots__ = ("changes", "deck", "defines", "draws", "temp")

    def __init__(self, deck: Deck, temp: object, draws: Draws | None, changes: Sequence[Change]) -> None:
        self.deck, self.defines, self.temp, self.draws, self.changes = (
            deck,
            dict(deck.defines),
            temp,
            draws,
            tuple(changes),
        )


class _Flattener:
    def __init__(
        self, deck: Deck, temp: object = None, draws: Draws | None = None, changes: Sequence[Change] = ()
    ) -> None:
        self.deck, self.changes, self.draws = deck, changes, draws
        # the temperature of a step stands above all others
        self.temp_above = next((value for step, value in changes if step.kind == "temp"), temp)
        self.sink = deck.sink
        self.flat = FlatDeck(deck.title, deck.sink)
        self.heated = False  # by a .temp
        self.flat.sources.append(deck.file)
        self.flat.named = deck.named
        self.files: Files | None = None
        self.conditions = 0  # within each other
        self.models = Models(self.flat)
        self.globals: set[str] = {"0"}
        self.chains: dict[int, tuple[str, ...]] = {}  # Subckt -> files open where it is defined
        self.active: list[Subckt] = []
        self.counts: dict[int, int] = {}  # Subckt -> instances in one of it
        self.names: dict[str, Element | Instance] = {}
        self.machine_names: dict[str, Span] = {}

    def run(self) -> FlatDeck:
        top = Level("", DeckScope(self.sink, draws=self.draws), {}, self.globals, self.sink)
        self.define(top.scope)
        top.scope.opened = self.deck.outside
        self.deck.params = top.scope.exprs
        # declare, settle conditions, then emit
        path = self.deck.file.path
        cards = self.expand(self.deck.body, top.scope, (os.path.realpath(path),) if path else ())
        if self.changes:
            from .steps import change_models

            change_models(top.scope, self.changes)
        self.unknown_defines(top.scope)
        if self.draws is None:
            top.scope.draws.seed = self.seed(cards, top.scope)
        top.scope.temper = self.temperature(cards, top.scope)
        top.scope.check_all()
        self.flat.params = top.scope.values
        if self.deck.asked is not None:
            cards = [*(card for card in cards if card.__class__ is not Analysis), *self.deck.asked]
        # options first: scale decides which bin of a model an element takes
        cards.sort(key=lambda card: card.__class__ is not Dot or card.kind != "options")
        self.emit(cards, top)
        self.currents_of_both()
        if self.flat.steps or self.changes:
            from .steps import change_elements, check

            change_elements(self.flat, self.changes, top.scope.models)
            check(self.flat.steps, self.sink)
        if self.changes:  # one of the runs: nothing is left to step
            self.flat.steps = []
        for name in top.scope.models:
            try:
                self.models.at(name, top.scope)
            except ExprError as error:
                top.scope.report(error)
        units = any(card.kind == "FMU" for card in self.flat.clocked)
        if not (
            self.flat.elements or self.flat.machine or units or self.flat.commands or self.sink.has_errors
        ):
            self.sink.error("E128", "the deck is empty: it has no element and no machine card")
        self.flat.reads_temper = top.scope.read_temper
        self.flat.draws = top.scope.draws
        return self.flat

    # ---- parameters given from outside ----

    def define(self, scope: DeckScope) -> None:
        for key, given in self.deck.defines.items():
            name = key.lower()
            if isinstance(given, (int, float)):
                value: float | None = number(given)
            else:  # 4.7kohm is a number, 2*pi begins as one
                value = spice_number(str(given)) if not spice_leftover(str(given)) else None
            if value is not None:
                scope.values[name] = value
                continue
            try:
                scope.values[name] = evaluate(parse_expression(str(given), f"-D {key}"), scope)
            except LineError as error:
                self.sink.add(error.diagnostic)
            except ExprError as error:
                scope.report(error)

        # a parameter that is stepped need not be defined
        for card in self.deck.body:
            if card.__class__ is Dot and card.kind == "step":
                from .steps import stepped_parameter

                found = stepped_parameter(card.items)
                if found is not None:
                    first = found[1] if isinstance(found[1], Node) else float(found[1])
                    scope.exprs.setdefault(found[0], Param(found[0], first, card.span))
        for step, value in self.changes:
            if step.kind == "param":
                scope.values[step.name] = value

    def unknown_defines(self, scope: DeckScope) -> None:
        for key in self.deck.defines:
            if key.lower() not in scope.exprs:
                near, known = suggest(key, scope.exprs), ", ".join(scope.exprs)
                others = f"parameters: {known}" if known else "the deck has no .param"
                self.sink.warning(
                    "W126",
                    f"no .param of the deck is called `{key}`",
                    hint=f"did you mean `{near}`?" if near else others,
                )

    def temperature(self, cards: list[Any], scope: DeckScope) -> float:
        """What `temper` is in parameters: nothing sweeps the temperature, so it is a constant. Errors are told later."""
        if isinstance(self.temp_above, (int, float)):
            return float(self.temp_above)
        dots = [card for card in cards if card.__class__ is Dot]
        found: Any = self.flat.temp
        for card in dots:
            if card.kind == "options":
                found = next((value for key, value, _ in card.items if key == "temp"), found)
        # .temp stands above .options temp=, wherever it stands
        found = next((card.items[0] for card in reversed(dots) if card.kind == "temp"), found)
        try:
            return as_float(found, scope)
        except (ExprError, ValueError):
            return self.flat.temp

    def seed(self, cards: list[Any], scope: DeckScope) -> int:
        """Of random values. What is no whole number is said where options are checked."""
        options = (
            item for card in cards if card.__class__ is Dot and card.kind == "options" for item in card.items
        )
        found = next((value for key, value, _ in reversed(list(options)) if key == "seed"), SEED)
        try:
            return abs(int(as_float(found, scope)))
        except (ExprError, TypeError, ValueError, OverflowError):
            return SEED

    # ---- first visit: declarations, includes, conditions ----

    def expand(self, cards: list[Any], scope: DeckScope, chain: tuple[str, ...]) -> list[Any]:
        out: list[Any] = []
        conditions = self.declare(cards, scope, chain, out)
        if not conditions:
            return out
        settled: list[Any] = []
        for card in out:
            if card.__class__ is tuple:
                conditional, its_chain = card
                if self.conditions >= MAX_LEVELS:
                    said = f"conditions are nested more than {MAX_LEVELS} deep"
                    self.sink.error("E104", said, conditional.span, "give what hangs on conditions a .subckt")
                    continue
                self.conditions += 1
                settled += self.expand(self.branch(conditional, scope), scope, its_chain)
                self.conditions -= 1
            else:
                settled.append(card)
        return settled

    def declare(self, cards: list[Any], scope: DeckScope, chain: tuple[str, ...], out: list[Any]) -> bool:
        """Puts names into the scope and the other cards into `out`; True when conditions are among them."""
        conditions = False
        for card in cards:
            kind = card.__class__
            if isinstance(card, Element):
                out.append(card)
            elif kind is Param:
                scope.exprs[card.name] = card
            elif kind is Func:
                scope.funcs[card.name] = card
            elif kind is Model:
                known = scope.models.get(card.name)
                if known is not None and known.span != card.span:
                    self.sink.warning(
                        "W142", f"a second .model is called `{card.name}`; the first one is used", card.span,
                        labels=[(known.span, "the first one")],
                    )  # fmt: skip
                else:
                    scope.models[card.name] = card
            elif kind is Subckt:
                self.declare_subckt(card, scope, chain)
            elif kind is Include:
                inner, its_chain = self.included(card, chain)
                conditions = self.declare(inner, scope, its_chain, out) or conditions
            elif kind is Conditional:
                out.append((card, chain))
                conditions = True
            elif kind is Dot and card.kind == "global":
                self.globals.update(card.items)
            elif kind is Dot and card.kind == "hdl":
                self.reader.modules(card, self.flat.modules)
            else:
                if kind is MachineCard and card.kind in BLOCKS:
                    scope.blocks.add(card.name)
                out.append(card)
        return conditions

    @property
    def reader(self) -> Files:
        if self.files is None:
            from .files import Files

            self.files = Files(self.sink, self.flat.sources, self.deck.named)
        return self.files

    def included(self, card: Include, chain: tuple[str, ...]) -> tuple[list[Any], tuple[str, ...]]:
        return self.reader.cards(card, chain)

    def declare_subckt(self, card: Subckt, scope: DeckScope, chain: tuple[str, ...]) -> None:
        known = scope.subckts.get(card.name)
        if known is not None and known[0].span != card.span:
            self.sink.error(
                "E134",
                f"a second .subckt is called `{card.name}`",
                card.span,
                labels=[(known[0].span, "the first one")],
            )
            return
        ports = set()
        for port in card.ports:
            if port in ports:
                self.sink.error("E134", f"`{card.name}` has two terminals called `{port}`", card.span)
            ports.add(port)
        scope.subckts[card.name] = (card, scope)
        self.chains[id(card)] = chain

    def branch(self, conditional: Conditional, scope: DeckScope) -> list[Any]:
        for condition, cards in conditional.branches:
            try:
                if condition is None or evaluate(condition, scope):
                    return cards
            except ExprError as error:
                scope.report(error)
                return []
        return []

    # ---- second visit ----

    def emit(self, cards: list[Any], level: Level) -> None:
        elements: list[Any] = self.flat.elements
        names = self.names
        is_top = not level.prefix
        for card in cards:
            kind = card.__class__
            try:
                if isinstance(card, Element):
                    # most lines of a big deck: nothing to evaluate, nothing to rename
                    if not (is_top and card.is_plain):
                        card = bind_element(card, level, self.models)
                    elif card.model_name is not None:
                        if self.models.parameter(card, level) is not None:
                            card = bind_element(card, level, self.models)
                        else:
                            card.model = self.models.of_element(card, level)
                    first = names.setdefault(card.name, card)
                    if first is not card:
                        self.twice("element", card.name, first.span, card.span)
                        continue
                    elements.append(card)
                elif kind is Instance:
                    self.instance(card, level)
                elif kind is MachineCard:
                    self.machine_card(card, level)
                elif kind is Unread:
                    self.sink.add(card.diagnostic)
                elif kind is Analysis:
                    args = [as_float(a, level.scope) if isinstance(a, Node) else a for a in card.args]
                    self.flat.analyses.append(Analysis(card.kind, args, card.flags, card.span))
                elif kind is Print:
                    # sens(v(b),r1) in .print sens is the name of a column
                    items = [
                        (
                            text,
                            ast if isinstance(ast, Call) and ast.fn == card.kind else self.output(ast, level),
                        )
                        for text, ast in card.items
                    ]
                    self.flat.prints.append(Print(card.kind, items, card.span))
                elif kind is Measure:
                    from .measures import bind_measure

                    others = [c.name for c in cards if c.__class__ is Measure]
                    bound = bind_measure(card, level, others)
                    (self.flat.fours if card.clauses[0].word == "four" else self.flat.measures).append(bound)
                elif kind is Dot:
                    self.dot(card, level)
            except ExprError as error:
                level.scope.report(error)

    def twice(self, what: str, name: str, first: Span, span: Span) -> None:
        fixes = []
        if span.text.lower() == name:  # not within a subcircuit that stands twice
            stem = span.text.rstrip("0123456789")
            taken = {**self.names, **self.machine_names}
            free = next(f"{stem}{k}" for k in range(2, len(taken) + 3) if f"{stem}{k}".lower() not in taken)
            fixes = [Fix(span, free, f"call it `{free}`")]
        self.sink.error(
            "E135",
            f"a second {what} is called `{name}`",
            span,
            labels=[(first, "the first one")],
            fixes=fixes,
        )

    def machine_card(self, card: MachineCard, level: Level) -> None:
        element = self.models.spice_reading(card, level)
        if element is not None:
            self.emit([element], level)
            return
        if card.kind in CLOCKED:
            from .clocked import bind_clocked

            bound, sources = bind_clocked(card, level)
        else:
            bound, sources = bind_machine_card(card, level, self.models), []
            if isinstance(look := bound.params.get("look"), Call) and look.fn == "stl":
                self.reader.mesh(bound, look, self.flat.meshes)
            self._hull_of_file(bound)
        if bound.name in self.machine_names:
            self.twice("mechanical thing", bound.name, self.machine_names[bound.name], bound.span)
            return
        self.machine_names[bound.name] = bound.span
        (self.flat.clocked if card.kind in CLOCKED else self.flat.machine).append(bound)
        for source in sources:
            if self.names.setdefault(source.name, source) is not source:
                self.twice("element", source.name, self.names[source.name].span, source.span)
            else:
                self.flat.elements.append(source)

    def _hull_of_file(self, bound: MachineCard) -> None:
        """`shape=stl(part.stl[,metres])` becomes the hull of its points."""
        shape = bound.params.get("shape")
        if not isinstance(shape, Call) or shape.fn != "stl":
            return
        self.reader.mesh(bound, shape, self.flat.meshes, "shape")
        found = bound.params.get("shape")
        if not isinstance(found, Call):
            return
        mesh, metres = found.args[0], getattr(found.args[1], "value", None) if len(found.args) > 1 else 1.0
        assert isinstance(mesh, Name)  # as the reader left it
        points = None
        said = "stl(file[,metres]) takes what one unit of the file is in metres, greater than zero"
        if isinstance(metres, float) and 0.0 < metres < float("inf"):
            from ..cards.hulls import Hull

            try:
                points = Hull(self.flat.meshes[mesh.id].scaled(metres).places()).corners
            except ValueError as error:
                said = f"the surface in stl(..) has no inside: {error}"
        if points is None:
            self.sink.error("E232", said, bound.param_spans["shape"])
            del bound.params["shape"]
            return
        bound.params["shape"] = Call("hull", [Num(v) for p in points for v in p], shape.at)

    def currents_of_both(self) -> None:
        """A machine card with nodes in the circuit and an element of its name: i(name) would be of either."""
        from ..cards import CARDS

        for card in self.flat.machine:
            element = self.names.get(card.name)
            if element is not None and any(
                kind == "node" for form in CARDS[card.kind].spec.forms for _, kind in form
            ):
                self.twice("thing with a current", card.name, element.span, card.span)

    def output(self, ast: Node, level: Level) -> Node:
        """What .print, .save and .probe name: a bare name stays one."""
        if isinstance(ast, Name):
            return ast if ast.id in ("all", "alli", "allv") else Name(level.node(ast.id, ast.span), ast.at)
        from .measures import OfResults

        return fold(ast, OfResults(level))

    # ---- subcircuits ----

    def instance(self, card: Instance, level: Level) -> None:
        name = level.prefix + card.name
        if name in self.names:
            self.twice("element", name, self.names[name].span, card.span)
            return
        self.names[name] = card
        found = level.scope.find_subckt(card.of.name)
        if found is None and (module := self.module(card)) is not None:
            return self.of_module(card, level, module.parameters)
        if found is None:
            near = suggest(card.of.name, level.scope.all_subckts())
            hint = f"did you mean `{near}`?" if near else "a .subckt or an .include that holds it is missing"
            fixes = instead(card.of.span, card.of.name, near) if near else []
            if not near:
                from ..slips import ideal_amplifier

                more, fixes = ideal_amplifier(card)
                hint += more
            if (model := level.scope.find_model(card.of.name)) is not None:
                kind = MODEL_TYPES.get(model[0].type)
                letter = f": begin the line with {kind.letter.upper()}" if kind is not None else ""
                hint = f"`{card.of.name}` is a .model of type {model[0].type.upper()}{letter}"
            self.sink.error(
                "E130", f"no subcircuit is called `{card.of.name}`", card.of.span, hint, fixes=fixes
            )
            return
        subckt, home = found
        if len(card.refs) != len(subckt.ports):
            self.sink.error(
                "E131",
                f"`{card.name}` has {len(card.refs)} terminals, the subcircuit `{subckt.name}` {len(subckt.ports)}",
                card.span,
                f"form: {card.name} {' '.join(subckt.ports)} {subckt.name}",
                labels=[(subckt.span, "defined here")],
            )
            return
        if subckt in self.active:
            ring = " -> ".join([*(s.name for s in self.active), subckt.name])
            self.sink.error("E132", f"the subcircuit `{subckt.name}` contains itself: {ring}", card.span)
            return
        if not self.active and self.count(subckt, home) > MAX_INSTANCES:
            said = f"`{card.name}` comes to {self.count(subckt, home):.2g} subcircuits, {MAX_INSTANCES:,} are the most"
            self.sink.error("E132", said, card.span, "every level multiplies what the next one holds")
            return
        if len(self.active) >= MAX_LEVELS:
            said = f"`{subckt.name}` stands more than {MAX_LEVELS} subcircuits deep"
            self.sink.error("E132", said, card.span, "no more than that can contain each other")
            return
        scope = self.inner_scope(card, subckt, level, home)
        mult = level.mult
        if "m" in card.params and "m" not in subckt.params:
            mult *= scope.values["m"]
        ports, words = {}, {}
        for port, ref in zip(subckt.ports, card.refs, strict=True):
            ports[port], words[port] = level.ref(ref), ref.name
        self.flat.uses.append((name, subckt.name, {port: ref.name for port, ref in ports.items()}))
        inner = Level(name + ".", scope, ports, self.globals, self.sink, mult, card, level, words)
        self.active.append(subckt)
        try:
            self.emit(self.expand(subckt.body, scope, self.chains.get(id(subckt), ())), inner)
        finally:
            self.active.pop()

    def module(self, card: Instance) -> Module | None:
        """The module of Verilog-A that an X line names: of .hdl, or added once."""
        name = card.of.name.lower()
        return self.flat.modules.get(name) or self.flat.added.by_name(name, card.of.span)

    def of_module(self, card: Instance, level: Level, known: dict[str, Any]) -> None:
        """X on a module: what N is with a .model of it, whose parameters stand on the line."""
        from ..elements.compiled import Compiled
        from ..elements.n import OfModule

        kind = card.of.name.lower()
        own = {key for key in card.params if key in Compiled.instance and key not in known}
        e = OfModule(card.name, card.nodes, card.span)
        e.params = {key: value for key, value in card.params.items() if key in own}
        e.model_name, e.model_span = f"{card.name}:{kind}", card.of.span
        params = {key: value for key, value in card.params.items() if key not in own}
        level.scope.models[e.model_name] = Model(e.model_name, kind, params, card.span)
        self.flat.elements.append(bind_element(e, level, self.models))

    def count(self, subckt: Subckt, home: DeckScope, level: int = 0) -> int:
        """Instances that one of a subcircuit comes to at least: what conditions add is not known yet."""
        known = self.counts.get(id(subckt))
        if known is None:
            known = self.counts[id(subckt)] = 1  # in a ring, which is a mistake of its own
            inner = [home.find_subckt(c.of.name) for c in subckt.body if isinstance(c, Instance)]
            if level < MAX_LEVELS:
                known += sum(self.count(*found, level + 1) for found in inner if found is not None)
            self.counts[id(subckt)] = known
        return known

    def inner_scope(self, card: Instance, subckt: Subckt, level: Level, home: DeckScope) -> DeckScope:
        """Given values are computed where the X line stands, defaults inside."""
        scope = DeckScope(self.sink, level.scope, home)
        for key, value in subckt.params.items():
            scope.exprs[key] = Param(key, value, subckt.span)
        for key, value in card.params.items():
            try:
                scope.values[key] = as_float(value, level.scope)
            except ExprError as error:
                if error.code == "E385" and isinstance(value, Node):
                    scope.exprs[key] = Param(key, fold(value, level.scope), card.span)
                    continue
                level.scope.report(error)
                scope.values[key] = 1.0
            inner = key in (p.name for p in subckt.body if p.__class__ is Param)
            if key not in subckt.params and not inner and key != "m":
                self.sink.warning(
                    "W133",
                    f"the subcircuit `{subckt.name}` has no parameter `{key}`",
                    card.span,
                    did_you_mean(
                        key, subckt.params, "its parameters: " + (", ".join(subckt.params) or "none")
                    ),
                )
        scope.values.update(subckt.altered)
        return scope

    # ---- dot cards ----

    def dot(self, card: Dot, level: Level) -> None:
        flat, scope = self.flat, level.scope
        if card.kind in ("ic", "nodeset"):
            target = flat.ics if card.kind == "ic" else flat.nodesets
            for node, value, span in card.items:
                target.append((level.node(node, span), as_float(value, scope), span))
        elif card.kind in ("save", "probe", "also"):
            out = {"save": flat.saves, "probe": flat.probes, "also": flat.also}[card.kind]
            flat.probed += [p for p in card.items if p.of_terminals]
            out += [
                Probe(p.text, self.output(p.ast, level), p.span) for p in card.items if not p.of_terminals
            ]
        elif card.kind == "fmu":
            for key, probes in card.items.items():
                out = flat.fmu.setdefault(key, [])
                is_out = key == "out"
                out += [Probe(p.text, self.output(p.ast, level) if is_out else p.ast, p.span) for p in probes]
        elif card.kind == "options":
            for key, value, span in card.items:
                flat.option_spans[key] = span
                flat.options[key] = as_float(value, scope) if isinstance(value, Node) else value
                above = key == "temp" and self.heated
                if key in ("temp", "tnom") and not above and not isinstance(flat.options[key], (str, bool)):
                    setattr(flat, key, float(flat.options[key]))
        elif card.kind == "step":
            from .steps import read

            if (step := read(card, scope, self.sink)) is not None:
                # .temp stands outermost
                flat.steps.insert(
                    len([s for s in flat.steps if s.kind != "temp" or step.kind == "temp"]), step
                )
        elif card.kind == "temp":
            values = [as_float(value, scope) for value in card.items]
            flat.temp = values[0]
            self.heated = True
            if len(values) > 1:
                from .steps import Step

                flat.steps.append(Step("temp", "temp", values, card.span, unit="C"))
            if flat.temp < ABSOLUTE_ZERO:
                hint = f"temperatures are in Celsius, {ABSOLUTE_ZERO:g} or more"
                self.sink.error("E293", f".temp {flat.temp:g} is below absolute zero", card.span, hint)
        elif card.kind == "gravity":
            g = [as_float(v, scope) for v in card.items]
            if len(g) == 1 and g[0] < 0.0:
                said = f".gravity {g[0]:g} pulls upwards: the number counts downwards, along -y"
                hint = f".gravity {-g[0]:g} pulls down; along a direction: .gravity 0 {-g[0]:g}"
                self.sink.warning("W243", said, card.span, hint)
            if len(g) < 2:
                g = [0.0, -(g[0] if g else STANDARD_GRAVITY), 0.0]
            flat.gravity = (g[0], g[1], g[2] if len(g) > 2 else 0.0)
        elif card.kind == "view":
            from .viewed import viewed

            flat.views.append(viewed(card, scope, self.sink))
        elif card.kind == "control":
            lines, analyses = card.items
            flat.commands = sorted([*flat.commands, *lines], key=_place)  # as they stand, files within files
            known = [(a.kind, a.args, a.flags) for a in flat.analyses]
            for a in analyses:
                args = [as_float(v, scope) if isinstance(v, Node) else v for v in a.args]
                if (a.kind, args, a.flags) not in known:
                    flat.commanded.append(Analysis(a.kind, args, a.flags, a.span))
                    flat.analyses.append(flat.commanded[-1])


def _place(line: Line) -> list[int]:
    """The line's number, behind those of the .include's that lead to it."""
    numbers, at = [line.number], line.file.included_from
    while at is not None:
        numbers.insert(0, at.line)
        at = at.file.included_from
    return numbers
