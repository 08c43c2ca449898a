"""rolling= and drilling= of CONTACT: friction against turning over each other, where parts touch at one place.

Across the normal and about it a moment of up to a length times the force with which the parts press, against the turning:
exact, as friction against sliding is (touch.py), on top of it, and in the instant of an impact too. In space rolling is one law
of two directions. Sliding and spinning do not weaken each other's friction, as they do on a patch (Contensou 1963).
"""

from __future__ import annotations

from .base import Default
from .kinematics import dot, is_zero, subtract
from .round import nonzero
from .touch import Touching, rubbing

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .base import Probes, Scalar, Scene
    from .laws import Relay
    from .meeting import Part
    from .round import Round
    from .touch import Rigid, Touch

    Turns = tuple[
        list[Scalar], Scalar
    ]  # across the normal, in one direction or two at right angles; about it

TURNING: dict[str, Any] = {
    "rolling": Default(0.0, "m", "against rolling: moment by the force of the contact", least=0.0),
    "drilling": Default(0.0, "m", "against turning about the normal: moment by that force", least=0.0),
}
IDLE = {
    "mu": "slide along each other",
    "rolling": "roll on each other",
    "drilling": "turn about the normal",
}


def turning(
    a: Sequence[Scalar], b: Sequence[Scalar], ways: Sequence[Sequence[Scalar]], normal: Sequence[Scalar]
) -> Turns:
    """How a part with the angular velocity a turns over one with b [rad/s]: along `ways` across the normal, and about it."""
    turn = subtract(a, b)
    if is_zero(turn[0]) and is_zero(turn[1]) and is_zero(normal[2]):
        return nonzero(turn, [(0.0, 0.0, 1.0)]), 0.0
    return nonzero(turn, ways), dot(turn, normal)


def of_round(card: Round, s: Scene) -> Turns:
    """The same of P's part over Q's; the card has met."""
    p, q = s.body_of(card, "p").omega, s.body_of(card, "q").omega
    return turning(p, q, card.ways(s), card.normal)


class Turning(Touching):
    """Touches that may also resist turning."""

    rolling: float
    drilling: float

    def check_places(self, s: Scene, a: Part, b: Part, count: int) -> None:
        """Two shapes that touch at several places have no one moment."""
        key = "rolling" if self.rolling else "drilling"
        if count > 1 and getattr(self, key):
            named = f"{a[2].kind}(..) of {a[0]} and {b[2].kind}(..) of {b[0]}"
            said = f"{key}= of CONTACT {self.name}: {named} touch at several places"  # type: ignore[attr-defined]
            hint = "it is for what touches at one place: balls, ellipsoids on a plane, discs in the plane"
            s.sink.error("E240", said, self.place(key), hint)  # type: ignore[attr-defined]

    def set_turns(self, turns: Turns, place: Touch | Rigid) -> None:
        """At a place of touch."""
        rolls, drill = turns
        if self.rolling:
            self.turns["rolling"] += rubbing(rolls, place, self.rolling, self.rolling, "N m")
        if self.drilling and not is_zero(drill):
            self.turns["drilling"] += rubbing([drill], place, self.drilling, self.drilling, "N m")

    def turn_probes(self, s: Scene) -> Probes:
        """Moments on the first part, where there is one place of touch; of two directions their size."""
        found: Probes = {}
        for word, laws in self.turns.items():
            efforts: list[Scalar] = [law.effort for law in laws]
            if efforts:
                moment = efforts[0] if len(efforts) == 1 else s.b.call("hypot", *efforts)
                found[word] = s.b.select(self.places[0][1].on, moment, 0.0)
        return found

    def tell_idle(self, s: Scene, laws: dict[str, list[Relay]]) -> None:
        """N233: which friction has no motion to act against."""
        for key, found in laws.items():
            if getattr(self, key) and not found:
                what = f"{self.spec.word} {self.name}"  # type: ignore[attr-defined]
                said = f"{key}= of {what} has no effect: its parts cannot {IDLE[key]}"
                s.sink.note("N233", said, self.place(key))  # type: ignore[attr-defined]
