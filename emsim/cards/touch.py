"""Where two parts may press on each other: an elastic law of the gap between them, for STOP and CONTACT.

With d = -gap the depth, d' its rate and k d^n the elastic force:
    V = k d^(n+1)/(n+1)                                 while d > 0, nothing else
    c=  N = k d^n + c d', the damper's part never more than the spring's: it neither pulls nor jumps
    e=  N = k d^n (1 + z d'/v),  z(1 + e) = ln((1 + z)/(1 - e z)),  v the speed at which the parts met
The second gives a mass against a wall exactly e times its speed back, whatever the speed, k and n: with y = d'/v along the
touch, y dy/(1 + z y) = -(k/m v^2) d^n dd, whose two sides are zero over the touch where y ends at -e. (The well known
z = 1.5 (1 - e) is that for e near 1.)

Where the parts may also slide along each other, with mu=: friction |T| <= mu N against the slip (mus N while they stick), of
rigid parts also in the instant of an impact.
"""

from __future__ import annotations

from itertools import chain
from math import log1p

from .base import Default
from .laws import Corner, Relay, Slip, joined

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Card, Powers, Probes, Scalar, Scene
    from .laws import Edge, Law

# parameters of an elastic law, with the unit of a force over that of a length or angle
LAW: dict[str, Any] = {
    "k": Default(None, "N/m or N m/rad", "stiffness; without it the parts are rigid", above=0.0),
    "c": Default(0.0, "N s/m or N m s/rad", "damping while they touch; it never pulls", least=0.0),
    "e": Default(None, "", "coefficient of restitution: speed after by speed before", least=0.0),
    "n": Default(1.0, "", "exponent of the elastic force k d^n, 1.5 for spheres", least=1.0),
}  # fmt: skip
FRICTION: dict[str, Any] = {
    "mu": Default(0.0, "", "coefficient of friction while the parts slide along each other", least=0.0),
    "mus": Default(None, "", "coefficient that must be overcome to start; mu unless given", least=0.0),
}
NOTHING = 1e-200  # [m^2] keeps the slope of a power at depth 0; steps go a little beyond
SLOW = 1e-6  # [m/s, rad/s] parts that meet more slowly are damped as if they met with this


def check(card: Card, k: float | None, c: float, e: float | None, sink: Sink) -> None:
    """Rules between k=, c=, e=."""
    what = f"{card.spec.word} {card.name}"
    if e is not None and e > 1.0:
        said = f"e= of {what} is {e:g}: parts that meet would part with more energy than they had"
        sink.error("E238", said, card.place("e"), "e lies between 0, no rebound, and 1, no loss")
    elif e is not None and k is not None and e == 0.0:
        said = f"{what}: an elastic touch with e=0 would have to stop within no time"
        sink.error("E238", said, card.place("e"), "e= above 0, or c=, or leave out k=: rigid parts")
    if card.given("c") and card.given("e"):
        said = f"{what} has both c= and e=: each says how much a touch damps"
        sink.error("E240", said, card.place("c"), "leave one of them out")
    for key in ("c", "n"):
        if card.given(key) and k is None:
            said = f"{key}= of {what} belongs to k=: without it the parts are rigid"
            sink.error("E240", said, card.place(key), "give k=, or leave it out")


def check_friction(card: Card, mu: float, mus: float | None, sink: Sink) -> None:
    if mus is not None and mus < mu:
        said = f"mus= of {card.spec.word} {card.name} is {mus:g}, less than mu= {mu:g}: "
        said += "what slides would be held more than what rests"
        sink.error(
            "E238", said, card.place("mus"), "mus= is for parts that stick to each other, the larger one"
        )


def damping_of(e: float) -> float:
    """z of the law above, 0 for e = 1: the root of z(1 + e) = ln((1 + z)/(1 - e z)) in (0, 1/e)."""
    if e >= 1.0:
        return 0.0
    low, high = 0.0, 1.0 / e
    for _ in range(200):
        z = 0.5 * (low + high)
        if z in (low, high):
            break
        # concave at first, then to infinity: below its root it is negative
        if log1p(z) - log1p(-e * z) < z * (1.0 + e):
            low = z
        else:
            high = z
    return 0.5 * (low + high)


class Touch:
    """One place of touch; `gap` [m or rad] before symbols are replaced. `count` touches have begun."""

    def __init__(
        self,
        s: Scene,
        name: str,
        gap: Scalar,
        k: float,
        c: float,
        e: float | None,
        n: float,
    ) -> None:
        self.gap, self.k, self.n = gap, k, n
        self.rate = s.rate(gap)
        depth = s.public(-gap)
        self.on = s.b.flag(depth, None, f"{name} touches", -1)
        # touches that had begun by the last event, and whether there was one then
        count, before = s.b.memory(f"{name} hits"), s.b.memory(f"{name} touched")
        self.count = count + self.on * (1.0 - before)
        s.b.keep(count, self.count)
        s.b.keep(before, self.on)
        elastic = -k * gap
        if n != 1.0:
            elastic = elastic * s.b.call("pow", gap * gap + NOTHING, 0.5 * (n - 1.0))
        if e is not None and e < 1.0:
            met = s.b.memory(f"{name} speed")
            s.b.keep(met, s.b.select(self.on, met, s.public(-self.rate)))
            damped = elastic * (damping_of(e) / s.b.call("hypot", met, SLOW)) * -self.rate
            damped = s.maximum(s.b.select(self.on, damped, 0.0), -elastic)
        elif c:
            damped = s.maximum(s.minimum(-c * self.rate, elastic), -elastic)
        else:
            damped = s.b.const(0.0)
        self.elastic, self.damped = s.b.select(self.on, elastic, 0.0), s.b.select(self.on, damped, 0.0)

    @property
    def force(self) -> Expr:
        """With which the parts press on each other, 0 or more."""
        return self.elastic + self.damped

    def energy(self, s: Scene) -> Expr:
        square = self.gap * self.gap
        power = square if self.n == 1.0 else s.b.call("pow", square + NOTHING, 0.5 * (self.n + 1.0))
        return s.b.select(self.on, power * (self.k / (self.n + 1.0)), 0.0)


class Rigid:
    """The same without a stiffness: a corner of laws.py, closed or open, with impacts."""

    def __init__(self, gap: Scalar, e: float | None, unit: str, edge: Edge | None = None) -> None:
        self.gap = gap
        self.law = Corner(gap, 0.0 if e is None else e, unit, edge)

    @property
    def on(self) -> Expr:
        return self.law.closed

    @property
    def count(self) -> Expr:
        return self.law.hits

    @property
    def force(self) -> Expr:
        return self.law.effort


class Touching:
    """What cards with touches have in common: each with the sign of its force in `force` of the card, elastic or rigid."""

    touches: list[tuple[float, Touch]]
    corners: list[tuple[float, Rigid]]
    slips: list[Relay]
    turns: dict[str, list[Relay]]  # resisting.py

    def set_gaps(self, s: Scene, gaps: list[tuple[float, str, Scalar]], unit: str) -> None:
        """(sign, name, gap) of every place of touch; `unit` of its force. The law's parameters are attributes of the card."""
        k, c, e, n = (getattr(self, key) for key in LAW)
        self.touches, self.corners, self.slips = [], [], []
        self.turns = {"rolling": [], "drilling": []}
        for sign, name, gap in gaps:
            if k is None:
                self.corners.append((sign, Rigid(gap, e, unit)))
            else:
                self.touches.append((sign, Touch(s, name, gap, k, c, e, n)))

    def set_slips(self, slips: list[Scalar], place: Touch | Rigid, mu: float, mus: float | None) -> None:
        """Speed [m/s] of the parts along each other at a place of touch, in one direction or two at right angles."""
        if mu or mus:
            self.slips += rubbing(slips, place, mu, mu if mus is None else mus, "N")

    @property
    def places(self) -> list[tuple[float, Touch | Rigid]]:
        return [*self.touches, *self.corners]

    def laws(self, s: Scene) -> list[Law]:
        return [*(corner.law for _, corner in self.corners), *self.slips, *chain(*self.turns.values())]

    def taken(self, s: Scene) -> Scalar | None:
        """Kinetic energy that impacts have taken so far [J]."""
        return _sum(s, [corner.law.lost for _, corner in self.corners]) if self.corners else None

    def potential(self, s: Scene) -> Scalar | None:
        if not self.touches:
            return None
        return _sum(s, [touch.energy(s) for _, touch in self.touches])

    def powers(self, s: Scene) -> Powers:
        return [(touch.damped, touch.rate) for _, touch in self.touches if touch.damped.value != 0.0]

    def losses(self, s: Scene) -> Scalar | None:
        rubs = [*self.slips, *chain(*self.turns.values())]
        if not self.touches and not rubs:
            return None
        rubbed = [-(law.effort * law.flow) for law in rubs if law.flow is not None]
        return _sum(s, [*(-(touch.damped * touch.rate) for _, touch in self.touches), *rubbed])

    def touch_probes(self, s: Scene, word: str) -> Probes:
        gaps = [place.gap for _, place in self.places]
        found: Probes = {
            word: _sum(s, [sign * place.force for sign, place in self.places]),
            "gap": lambda: s.minimum(*gaps) if len(gaps) == 2 else gaps[0],
            "hits": _sum(s, [place.count for _, place in self.places]),
            "mode": _sum(s, [sign * place.on for sign, place in self.places]),
            "power": _sum(s, [touch.force * touch.rate for _, touch in self.touches]),
        }
        if self.corners:
            found["impulse"] = _sum(s, [sign * corner.law.impulse for sign, corner in self.corners])
        if self.slips:
            law, on = self.slips[0], self.places[0][1].on
            flows = [slip.flow for slip in self.slips if slip.flow is not None]
            efforts: list[Scalar] = [slip.effort for slip in self.slips]
            if len(self.slips) == 2:
                flows, efforts = [s.b.call("hypot", *flows)], [s.b.call("hypot", *efforts)]
            found["friction"], found["slip"] = s.b.select(on, efforts[0], 0.0), flows[0]
            found["mode"] = on * s.b.select(law.slides, s.b.select(law.mode, 2.0 * law.mode, 1.0), 1.0)
        return found


def rubbing(flows: list[Scalar], place: Touch | Rigid, mu: float, mus: float, unit: str) -> list[Relay]:
    """Friction at a place of touch against speeds in one direction, or in two at right angles as one law."""
    if isinstance(place, Rigid):
        found: list[Relay] = [Slip(flow, place.law, mu, mus, unit) for flow in flows]
    else:
        found = [Relay(flow, mu * place.force, mus * place.force, unit, place.on) for flow in flows]
    return joined(found)


def _sum(s: Scene, terms: list[Expr]) -> Expr:
    return sum(terms, s.b.const(0.0))
