"""From cards to things with names: bodies, points, joints, couplings; who names what, and what is wrong."""

from __future__ import annotations

from copy import copy

from ..cards import CARDS, along, quantities
from ..diagnostics import Fix, instead, suggest
from ..expr import Node, Scope, evaluate, names
from ..opened import OpenNumber
from .domains import Domains
from .scene import FREE, JointState
from .tree import GROUND

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from ..cards.base import Card
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from ..cards.joint import Joint
    from ..cards.joints.base import JointKind
    from ..cards.shape import ShapeCard
    from ..cards.shapes import Shape
    from ..deck import MachineCard, Ref
    from ..diagnostics import Span
    from .context import Context

ORIGIN = (0.0, 0.0, 0.0)


class Binding:
    """The machine cards of a deck, bound and named. `broken` after an error."""

    def __init__(self, ctx: Context) -> None:
        self.ctx = ctx
        self.b = ctx.b
        self.sink = ctx.sink
        self.models = ctx.flat.models
        self.gravity: tuple[float, float, float] = ctx.flat.gravity or ORIGIN
        self.broken = False
        self.failed: set[str] = set()  # names of cards with errors: what refers to them stays silent
        # cards by role
        self.bodies: dict[str, Body] = {}
        self.points: dict[str, tuple[str, tuple[float, ...]]] = {}
        self.couplings: dict[str, Card] = {}
        self.shapes: dict[str, ShapeCard] = {}
        self.drives: list[Drive] = []
        self.gears: list[Gear] = []
        self.joints: dict[str, JointState] = {}
        self.domains = Domains(self)
        self._bind()

    def _bind(self) -> None:
        """Cards to their specifications, one table a role; names unique among mechanical things."""
        taken: dict[str, Card] = {}
        joint_cards: list[Joint] = []
        for raw, stands_in in self._cards():
            card: Any = CARDS[raw.kind].variant(raw, self.models)(raw, self.sink)
            card.drawn = not stands_in
            if stands_in and card.name in taken:
                said = (
                    f"a second mechanical thing is called `{card.name}`: {stands_in} has a part of that name"
                )
                self._fail("E135", said, taken[card.name].span)
            if not card.ok:
                self.broken = True
                self.failed.add(card.name)
            taken[card.name] = card  # the front end has seen that names are unique
            if card.name in (GROUND, "gnd"):
                said = f"{raw.kind} {card.name}: {card.name} is the ground"
                self._fail("E234", said, card.span, "give it another name")
            elif not card.ok:
                continue
            elif raw.kind == "BODY":
                self.bodies[card.name] = card
            elif raw.kind == "POINT":
                self.points[card.name] = (card.body, card.local)
            elif raw.kind == "SHAPE":
                self.shapes[card.name] = card
            elif raw.kind == "JOINT":
                joint_cards.append(card)
            else:
                self.couplings[card.name] = card
                if raw.kind == "DRIVE":
                    self.drives.append(card)
                elif raw.kind == "GEAR" and card.backlash is None:  # play leaves both coordinates
                    self.gears.append(card)
        for name, (body, _) in self.points.items():
            if body != GROUND and body not in self.bodies:
                said = f"POINT {name}: no body is named {body}"
                self._fail_name("E235", said, body, self.bodies, taken[name].span)
        for name, shape in self.shapes.items():
            if shape.body != GROUND and shape.body not in self.bodies:
                said = f"SHAPE {name}: no body is named {shape.body}"
                self._fail_name("E235", said, shape.body, [GROUND, *self.bodies], shape.terminals[0][2].span)
        for card in joint_cards:
            self._tie(card)
        for card in self.couplings.values():
            self._check_terminals(card)
        for card in taken.values():
            if not quantities.check(card, self._motions(card), self.sink):
                self.broken = True

    def _cards(self) -> Iterator[tuple[MachineCard, str]]:
        """The deck's, then those that come with them, and with whom."""
        deck = [self._opened(raw) for raw in self.ctx.flat.machine]
        yield from ((raw, "") for raw in deck)
        for raw in deck:
            yield from ((part, f"{raw.kind} {raw.name}") for part in CARDS[raw.kind].stands_for(raw))

    def _opened(self, raw: MachineCard) -> MachineCard:
        """The card with what comes from outside as open numbers, where it wants plain ones."""
        inputs, kind = self.ctx.flat.inputs, CARDS[raw.kind].variant(raw, self.models)
        if inputs is None:
            return raw
        params: dict[str, Any] = dict(raw.params)
        for key, value in raw.params.items():
            if not isinstance(value, Node) or key not in kind.spec.params:
                continue
            of = set(names(value))
            if kind.spec.params[key].kind in ("number", "formula") and of and of <= inputs.keys():
                place = raw.param_spans.get(key, raw.span)
                start = evaluate(value, Scope(inputs))
                params[key] = OpenNumber(self.ctx.compile(value, place), start, frozenset(of), inputs)
        card = copy(raw)
        card.params = params
        return card

    def _motions(self, card: Card) -> list[str]:
        """What the joint that a card is, or sits on, does in each coordinate: turn or slide."""
        kind: JointKind | None = getattr(card, "kind", None) if card.spec.word == "JOINT" else None
        for _, what, ref in card.terminals:
            joint, word = along.found(self.joints, ref.name)
            if what in ("joint", "turnable") and joint is not None:
                kind = joint.kind
                if word and not along.misfit(kind, word, card.acts_on):
                    return ["turn" if along.turns(kind, word) else "slide"]
                break
        return [] if kind is None else kind.motions()

    def _tie(self, card: Joint) -> None:
        """The two ends of a joint."""
        ends = [self._locate_ref(ref, f"JOINT {card.name}") for _, _, ref in card.terminals[:2]]
        if ends[0] is None or ends[1] is None:
            self.failed.add(card.name)
            return
        if ends[0][0] == ends[1][0]:
            hint = "a joint ties two bodies, or a body to the ground 0; parts of one body need none"
            self._fail("E237", f"JOINT {card.name} ties {ends[0][0]} to itself", card.span, hint)
            return
        self.joints[card.name] = JointState(card, ends[0], ends[1])

    def _check_terminals(self, card: Card) -> None:
        """Do the names on a coupling exist, and are they of the right kind?"""
        what = f"{card.spec.word} {card.name}"
        for _, kind, ref in card.terminals:
            if kind == "joint" or (kind == "turnable" and ref.name not in self.bodies):
                joint, word = along.found(self.joints, ref.name)
                if joint is None:
                    known = [*self.joints, *self.bodies] if kind == "turnable" else [*self.joints]
                    is_body = ref.name in self.bodies
                    is_what = " is a body, not a joint" if is_body else " is no joint of this deck"
                    on = [name for name, j in self.joints.items() if ref.name in (j.b, j.a)]
                    if is_body and on and kind == "joint":
                        hint = f"{ref.name} hangs on {' and '.join(on)}: name the joint"
                        fixes = [Fix(ref.span, name) for name in on]
                        self._fail("E236", f"{what}: {ref.name}{is_what}", ref.span, hint, fixes)
                        continue
                    self._fail_name("E236", f"{what}: {ref.name}{is_what}", ref.name, known, ref.span)
                elif along.misfit(joint.kind, word, card.acts_on):
                    said = f"{what} needs a pin or a slide, with one coordinate; {joint.name} is a {joint.kind.name}"
                    self._fail("E241", said, ref.span, along.choice(joint.name, joint.kind, card.acts_on))
            elif kind == "point":
                self._locate_ref(ref, what)
            elif kind == "part" and not self.parts(ref.name):
                self._no_part(ref, what)
        self._check_ends(card, what)

    def _no_part(self, ref: Ref, what: str) -> None:
        """E235: what a CONTACT of shapes names has none."""
        if ref.name == GROUND or ref.name in self.bodies:
            is_what = "the ground" if ref.name == GROUND else f"BODY {ref.name}"
            hint = f"SHAPE floor {ref.name} box(w,h) at=(x,y) gives it one"
            if ref.name in self.bodies:
                hint = "give the body shape=, or a card SHAPE name body box(w,h)"
            hint += "; of a point or a line without ends say line= or rq="
            self._fail("E235", f"{what}: {is_what} has no shape that could be touched", ref.span, hint)
        else:
            known = [*self.bodies, *self.shapes]
            said = f"{what}: no body or shape is named {ref.name}"
            self._fail_name("E235", said, ref.name, known, ref.span)

    def parts(self, name: str | None = None) -> list[tuple[str, str, Shape]]:
        """(name, body, shape) of a body and what SHAPE adds to it, of one SHAPE, or of all."""
        own = [(n, n, body.outline) for n, body in self.bodies.items() if body.outline is not None]
        own += [(n, card.body, card.shape) for n, card in self.shapes.items() if card.ok]
        return [part for part in own if name is None or name in part[:2]]

    def joined(self, a: str, b: str) -> bool:
        """Does a joint join the two bodies? One that stands for a free body holds nothing."""
        return any({a, b} == {joint.a, joint.b} for key, joint in self.joints.items() if key[:1] != FREE)

    def is_still(self, body: str) -> bool:
        return body == GROUND or self.bodies[body].fixed

    def _check_ends(self, card: Card, what: str) -> None:
        """Does what acts on bodies act between two, or on one that can move?"""
        on_bodies = ("point", "turnable")
        refs = [ref for _, kind, ref in card.terminals if kind in on_bodies and ref.name not in self.joints]
        ends = [self.locate(ref.name, ORIGIN[:2] if ref.point is not None else None) for ref in refs]
        names = [end[0] for end in ends if end is not None]
        if not names or len(names) < len(ends):
            return
        if len(names) == 2 and names[0] == names[1]:
            self._fail(
                "E237",
                f"{what} ties {names[0]} to itself",
                card.span,
                "its points are on one body, so its length never changes; it acts between two bodies, or a body and the ground 0",
            )
        elif all(name == GROUND or (name in self.bodies and self.bodies[name].fixed) for name in names):
            rest = ["the ground" if name == GROUND else f"{name}, which is fixed" for name in names]
            said = f"{what} has no effect: it acts on {' and '.join(rest)}"
            self.sink.warning("W238", said, refs[0].span, "name a body that can move")

    def _locate_ref(self, ref: Ref, what: str) -> tuple[str, tuple[float, ...]] | None:
        """(body, point in its axes) of a word on a card."""
        local = None
        if ref.point is not None:
            if len(ref.point) not in (2, 3) or not all(isinstance(v, (int, float)) for v in ref.point):
                self._fail("E246", f"{what}: a point has two or three numbers, {ref.name}(x,y)", ref.span)
                return None
            local = tuple(float(v) for v in ref.point)
        found = self.locate(ref.name, local)
        if found is None:
            self.broken = True
            known = ["0 (the ground)", *self.bodies, *self.points]
            if ref.name in self.joints:
                self._fail("E235", f"{what}: {ref.name} is a joint; a body or point is needed here", ref.span)
            else:
                said = f"{what}: no body or point is named {ref.name}"
                self._fail_name("E235", said, ref.name, known, ref.span)
        return found

    def locate(self, name: str, local: tuple[float, ...] | None) -> tuple[str, tuple[float, ...]] | None:
        """A body's origin, its point (x,y[,z]), a named point, or name.com."""
        if name == GROUND or name in self.bodies:
            return name, ((*local, 0.0)[:3] if local is not None else ORIGIN)
        if local is not None:
            return None
        if name in self.points:
            return self.points[name]
        owner, dot_, last = name.rpartition(".")
        if dot_ and last == "com" and owner in self.bodies:
            return owner, self.bodies[owner].centre
        return None

    def _fail(
        self, code: str, message: str, span: Span | None, hint: str | None = None, fixes: Sequence[Fix] = ()
    ) -> None:
        self.broken = True
        self.sink.error(code, message, span, hint, fixes=fixes)

    def _fail_name(self, code: str, message: str, word: str, known: Any, span: Span | None) -> None:
        self.broken = True
        if word in self.failed or word.rpartition(".")[0] in self.failed:
            return
        close, listed = suggest(word, known), ", ".join(list(known)[:8])
        hint = f"did you mean {close}?" if close else f"there are: {listed}" if listed else None
        self._fail(code, message, span, hint, instead(span, word, close) if close else [])
