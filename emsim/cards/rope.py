"""ROPE: a rope over places of bodies and ground: it pulls, cannot push, slides over points and pulleys, is wound on drums.

Between places that hold it, the two ends and those of grip=, each stretch has a length l of its own (wrapping.py) and one
tension along all of it: nothing rubs. gap = length - l is how slack it is:

    without k=   0 <= gap, 0 <= tension, one of them is 0; taut with an impact, e times the speed comes back      (laws.py)
    with k=      tension = k d^n + c d', d = -gap above 0, the damper never more than the spring                   (touch.py)

Forces and torques are tension * d(gap)/du. Where a stretch ends at a round place it is wound there: r times the turn of the body
over that of the tangent leaves or reaches it, so a body held by grip= turns with the rope, and a drum winds it.
"""

from __future__ import annotations

from . import touch
from .base import Card, Default, Own, Spec
from .kinematics import constant, dot, perpendicular
from .round import unit
from .touch import Touching
from .wrapping import NEAR, AtStart, Moving, Stretch, number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..deck import MachineCard
    from ..diagnostics import Sink
    from .base import Pen, PointView, Probes, Scalar, Scene
    from .laws import Law
    from .wrapping import Course, Flat


class Rope(Touching, Card):
    spec = Spec(
        "ROPE",
        "ROPE name P1 P2 [P3 ..] slack=0 (or length=) [r=(0,r2,..)] [grip=k] [pay={}] [axis=] [e=0]  or with k= [c= or e=] [n=1]",
        terminals="p1:point p2:point | p1:point p2:point p3:point",
        mark=("slack", "length"),
        meaning="a rope over points and pulleys, that pulls and goes slack",
        meant={"l": "length={}", "l0": "length={}"},
        laws={
            "q": "l <= length, l over all places; after it goes taut e times the speed before it",
            "V": "with k=: k d^(n+1)/(n+1), d = l - length while it is taut",
            "P": "with k=: c l'^2 while it is taut, or that which gives back e times the speed",
        },
        slack=Default(
            None,
            "m",
            "how much longer it is than its way at the start; of each stretch where several differ",
            "vector",
        ),
        length=Default(
            None,
            "m",
            "its length, with what is on pulleys; of each stretch between places that hold it",
            "vector",
        ),
        r=Default(
            None,
            "m",
            "radius at each place, 0 at a point; above 0 it goes round counter-clockwise on its way, below 0 clockwise",
            "vector",
        ),
        grip=Default(
            (),
            "",
            "numbers of places between the ends where it does not slide: the pulley turns with it",
            "vector",
        ),
        pay=Default(
            None,
            "m",
            "how much is paid out, an expression of coordinates, from the start on: a winch that is not on its way",
            "value",
        ),
        axis=Default(None, "", "in space: the axis of the pulleys, in world axes", "vector"),
        **touch.LAW,
    )
    limits = "start it elsewhere, or end the run before; a STOP keeps a load off its pulley"
    slack: tuple[float, ...] | None
    length: tuple[float, ...] | None
    r: tuple[float, ...] | None
    grip: tuple[float, ...]
    pay: Any
    axis: tuple[float, ...] | None
    k: float | None
    c: float
    e: float | None
    n: float

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        """As many places as there are, two at least."""
        return [[(f"p{k + 1}", "point") for k in range(max(2, len(raw.args)))]]

    def check(self, sink: Sink) -> None:
        what, count = f"ROPE {self.name}", len(self.terminals)
        if (self.slack is None) == (self.length is None):
            said = f"{what} needs one of slack=, beyond its way at the start, and length="
            sink.error("E230", said, self.span, self.spec.form)
        self.radii = (0.0,) * count if self.r is None else self.r
        if len(self.radii) != count:
            said = f"r= of {what} has {len(self.radii)} number(s) for {count} places"
            sink.error("E232", said, self.place("r"), "one for each place, 0 at a point: r=(0,0.1,0)")
        wrong = next((g for g in self.grip if g not in range(2, count)), None)
        if wrong is not None:
            said = f"grip= of {what} names place {wrong:g}; between its ends it has places 2 to {count - 1}"
            sink.error("E238", said, self.place("grip"), "the ends are held as they are")
        self.holds = [1, *sorted({int(g) for g in self.grip}), count]  # places that hold it
        stretches = len(self.holds) - 1
        for key, values in (("slack", self.slack), ("length", self.length)):
            if values is not None and len(values) not in ({1, stretches} if key == "slack" else {stretches}):
                said = f"{key}= of {what} has {len(values)} numbers; it has {stretches} stretch(es) between places that hold it"
                sink.error("E232", said, self.place(key), "one for each stretch, from the first place on")
            elif values is not None and min(values) < 0.0:
                said = f"{key}= of {what} is {min(values):g}; a length cannot be below 0"
                sink.error("E238", said, self.place(key))
        if self.pay is not None and stretches > 1:
            said = f"pay= of {what} is for one stretch: with grip= it has {stretches}"
            sink.error("E240", said, self.place("pay"), "two ropes, each with its own")
        if self.axis is not None and (len(self.axis) != 3 or not any(self.axis)):
            sink.error("E232", f"axis= of {what} has three components, such as (0,0,1)", self.place("axis"))
        touch.check(self, self.k, self.c, self.e, sink)

    def leaves_plane(self) -> bool:
        return self.axis is not None and any(self.axis[:2])

    def prepare(self, s: Scene) -> None:
        what = f"ROPE {self.name}"
        self.spots: list[PointView] = [getattr(self, label) for label, _, _ in self.terminals]
        if not s.in_space or not any(self.radii):
            return
        if self.axis is None:
            said = f"{what} has pulleys in a machine that leaves the plane: their axis is not known"
            s.sink.error("E230", said, self.span, "axis=(0,0,1), in world axes: they turn about it")
            return
        held = next((k for k in self.holds if self.radii[k - 1] != 0.0), None)
        if held is not None:
            said = f"{what} is held by a pulley, place {held}, in a machine that leaves the plane"
            s.sink.error(
                "E240", said, self.place("r"), "in space a rope slides over its pulleys and ends at points"
            )
        for k, (label, _, ref) in enumerate(self.terminals):
            if self.radii[k] and any(
                constant(c) is None for c in s.body_of(self, label).direction(unit(self.axis))
            ):
                said = f"{what}: the axis of its pulley on {ref.name} does not keep its direction as that body moves"
                s.sink.error(
                    "E240", said, self.span, "pulleys are on the ground or on what turns about axis= alone"
                )

    def _flat(self, s: Scene, place: list[Scalar]) -> tuple[Flat, Scalar]:
        """A place in the plane of the pulleys, and across it."""
        axis = (0.0, 0.0, 1.0) if self.axis is None or not s.in_space else unit(self.axis)
        one, other = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)) if axis == (0.0, 0.0, 1.0) else perpendicular(axis)
        return (dot(place, one), dot(place, other)), dot(place, axis)

    def _stretches(self, s: Scene, places: list[list[Scalar]]) -> list[Stretch]:
        flat = [self._flat(s, place) for place in places]
        found = []
        for i, j in zip(self.holds, self.holds[1:], strict=False):
            part = flat[i - 1 : j]
            centres, heights = [centre for centre, _ in part], [height for _, height in part]
            found.append(Stretch(s, centres, heights, self.radii[i - 1 : j], i))
        return found

    def _wound(self, s: Scene, course: Course, start: Course, at: tuple[int, int]) -> Scalar:
        """How much more is wound at its ends than at the start."""
        total: Scalar = 0.0
        for sign, k, tangent, first in zip((1.0, -1.0), at, course.tangents, start.tangents, strict=True):
            if tangent is None or first is None:
                continue
            turn = s.body_of(self, self.terminals[k - 1][0]).angle()
            assert turn is not None  # in the plane
            total = total + sign * self.radii[k - 1] * ((tangent - first) - (turn - s.at_start([turn])[0]))
        return total

    def laws(self, s: Scene) -> list[Law]:
        """Its gaps, now that the start is known."""
        what, start = f"ROPE {self.name}", AtStart(s)
        count = len(self.spots)
        numbers = s.at_start([c for place in self.spots for c in place.pos])
        at_start: list[list[Scalar]] = [[*numbers[3 * k : 3 * k + 3]] for k in range(count)]
        first = [stretch.measure(start) for stretch in self._stretches(s, at_start)]
        for i, j in start.close:
            round_one = self.radii[i - 1] or self.radii[j - 1]
            said = (
                f"place {i} of {what} lies in the pulley at place {j}"
                if round_one
                else f"places {i} and {j} of {what} coincide"
            )
            s.sink.error(
                "E257",
                f"{said} at the start: no free part is between them",
                self.span,
                "start a body elsewhere",
            )
        for k in start.off:
            said = f"{what} would leave its pulley at place {k}, beside another one, already at the start"
            s.sink.error(
                "E238", said, self.place("r"), "above 0 it goes round counter-clockwise, below 0 clockwise"
            )
        moving = Moving(s, self.name, what, start)
        places = [[*place.pos] for place in self.spots]
        self.courses = [stretch.measure(moving) for stretch in self._stretches(s, places)]
        paid = self._paid(s)
        gaps: list[tuple[float, str, Scalar]] = []
        for k, (course, begun) in enumerate(zip(self.courses, first, strict=True)):
            whole = course.length + self._wound(s, course, begun, (self.holds[k], self.holds[k + 1]))
            gap = self._given(s, k, number(begun.length)) + paid - whole
            if constant(gap) is not None:
                s.sink.error("E240", f"{what} has no effect: nothing moves its places apart", self.span)
            gaps.append((1.0, f"{self.name} {k + 1}", s.b.const(0.0) + gap))
        self.set_gaps(s, gaps, "N")
        return super().laws(s)

    def _paid(self, s: Scene) -> Scalar:
        """What has been paid out since the start."""
        if self.pay is None:
            return 0.0
        paid = s.compile_energy(self.pay, self.place("pay"), Own(self.name, None, [], {}))
        other = s.beyond_coordinates(self.pay, paid)
        if other:
            said = f"pay= of ROPE {self.name} reads {other}: a drum pays out by where it stands"
            s.sink.error(
                "E252", said, self.place("pay"), "an expression of coordinates, pay={-0.1*angle(axle)}"
            )
            return 0.0
        return paid - s.at_start([paid])[0]

    def _given(self, s: Scene, k: int, way: float) -> float:
        """The length of a stretch; `way`: what it measures at the start [m]."""
        if self.length is None:
            assert self.slack is not None
            return way + self.slack[k if len(self.slack) > 1 else 0]
        length = self.length[k]
        if self.k is None and length < way - NEAR:
            said = f"length= of ROPE {self.name} is {length:g} m, and its way at the start is {way:.9g} m"
            s.sink.error(
                "E258", said, self.place("length"), "slack=0 has it as long as its way; with k= it stretches"
            )
            return way
        return max(length, way) if self.k is None else length

    def probes(self, s: Scene) -> Probes:
        """tension, gap, mode (1 taut), length without what is wound; with grip= tension(rope,k) .. of its stretches."""
        if len(self.courses) == 1:
            found = self.touch_probes(s, "tension")
            return {**found, "length": self.courses[0].length}
        found = {"length": sum((course.length for course in self.courses), s.b.const(0.0))}
        for k, ((_, place), course) in enumerate(zip(self.places, self.courses, strict=True)):
            found |= {f"tension,{k + 1}": place.force, f"gap,{k + 1}": place.gap, f"mode,{k + 1}": place.on}
            found |= {f"hits,{k + 1}": place.count, f"length,{k + 1}": course.length}
        return found

    def glyph(self, draw: Pen) -> None:
        single = len(self.courses) == 1
        stretches: list[dict[str, Any]] = []
        for k, course in enumerate(self.courses):
            own = self.name if single else f"{self.name},{k + 1}"
            force: Expr = self.places[k][1].force
            at = range(self.holds[k] - 1, self.holds[k + 1])
            lies = [
                draw.channel(f"lies({self.name},{j + 1})", "", on)
                for j, on in zip(at, course.lies, strict=True)
            ]
            places = [draw.terminal(self, self.terminals[j][0]) for j in at]
            radii = [self.radii[j] for j in at]
            tension = draw.channel(f"tension({own})", "N", force)
            stretches.append({"places": places, "radii": radii, "lies": lies, "tension": tension})
        draw.add("rope", self, stretches=stretches, unit="N")
