"""How large a machine is: the largest length and the largest mass that its cards state.

The absolute tolerances of lengths, velocities and forces are shares of them (engine/dae/src/tolerances.rs), so that a comb
drive of micrometres and a crane of tens of metres are both held to what they are made of. Lengths are what cards have in
metres: shapes, points on bodies, coordinates of slides, ends of stops, rests of springs. What is only reached while the deck runs
is not known here; the relative tolerance follows it.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from ..cards.base import Card
    from .mechanism import Mechanism

EITHER = ("m or rad", "rad or m", "rad or m, and per second")  # of a slide in metres


class Scale:
    """`length` [m] and `mass` [kg] with the cards that state them; 0 and "" where none does."""

    __slots__ = ("length", "length_of", "mass", "mass_of")

    def __init__(self) -> None:
        self.length = self.mass = 0.0
        self.length_of = self.mass_of = ""

    def seen(self, length: float, card: Card) -> None:
        if self.length < abs(length) < float("inf"):
            self.length, self.length_of = abs(length), f"{card.spec.word} {card.name}"


def scale(m: Mechanism) -> Scale:
    found = Scale()
    for name, body in m.bodies.items():
        if body.m > found.mass:
            found.mass, found.mass_of = body.m, f"BODY {name}"
        for value in _lengths(body, False):
            found.seen(value, body)
    for joint in m.joints.values():
        for value in (*joint.pa, *joint.pb, *_lengths(joint.card, not joint.rotary)):
            found.seen(value, joint.card)
    for card in m.couplings.values():
        joints = [m.joints[ref.name] for _, _, ref in card.terminals if ref.name in m.joints]
        for value in _lengths(card, any(not j.rotary for j in joints)):
            found.seen(value, card)
    return found


def _lengths(card: Card, slides: bool) -> Iterator[float]:
    """Numbers in metres on a card; `slides`: its coordinate is a displacement."""
    for name, param in card.spec.params.items():
        if not card.given(name) or not (param.unit == "m" or (slides and param.unit in EITHER)):
            continue
        value: Any = getattr(card, name)
        if param.kind == "shape":
            value = tuple(getattr(a, "value", a) for a in getattr(value, "args", ()))
        elif name == "ic" and isinstance(value, tuple):
            value = value[:1]  # then comes the speed
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, (int, float)):
                yield float(number)
    for _, kind, ref in card.terminals:
        if kind == "point":
            yield from (float(c) for c in ref.point or () if isinstance(c, (int, float)))
