"""JOINT: ties a point of A to a point of B; its coordinate is B relative to A.

A kind is a list of elementary motions of B against A, each with one coordinate: a slide along, or a turn
about, an axis that is fixed in both bodies. At coordinate 0 plus `zero=` the two frames are aligned. Along
the spanning tree the motions supply coordinates; where a joint closes a loop they say which directions stay
free (assemble/loops.py). `damp=` takes damp * u^2 watts in each of its coordinates.
"""

from __future__ import annotations

from ..diagnostics import suggest
from .base import Card, Default, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Net, Pen, Powers, Scalar, Scene

# kind -> motions: (slide or turn, axis); "axis" is the card's axis=
KINDS: dict[str, tuple[tuple[str, str], ...]] = {
    "pin": (("turn", "axis"),),
    "slide": (("slide", "axis"),),
    "weld": (),
    "planar": (("slide", "x"), ("slide", "y"), ("turn", "z")),
    "free": (("slide", "x"), ("slide", "y"), ("turn", "z")),
    "pinslot": (("slide", "axis"), ("turn", "z")),
    "rod": (),
}
ALIASES = {"revolute": "pin", "prismatic": "slide"}
LATER = ("ball", "universal", "cylinder", "screw")
DEFAULT_AXIS = {
    "pin": (0.0, 0.0, 1.0),
    "weld": (0.0, 0.0, 1.0),
    "slide": (1.0, 0.0, 0.0),
    "pinslot": (1.0, 0.0, 0.0),
}


class Joint(Card):
    spec = Spec(
        "JOINT",
        "JOINT name A B kind [axis=(x,y[,z])] [zero=] [ic=q or (q,qd)] [guess=] [cut=yes] [damp=]",
        terminals="a:point b:point kind:kind",
        mark=("kind",),
        meaning="a joint between two bodies; kinds: pin slide weld free planar pinslot rod",
        laws={"P": "damp u^2"},
        axis=Default(None, "", "the axis of a pin, slide or pinslot, in the frames of A and B", "vector"),
        zero=Default((0.0,), "rad or m", "where the coordinate is 0, measured from aligned frames", "vector"),
        ic=Default(None, "rad or m, and per second", "coordinate and speed at the start, held", "vector"),
        guess=Default(None, "rad or m", "about where the coordinate is when the loops have closed", "vector"),
        cut=Default(False, "", "this joint is the one cut in its loop", "flag"),
        damp=Default(0.0, "N m s/rad or N s/m", "viscous damping", least=0.0),
        l=Default(None, "m", "the length of a rod; the distance of its ends at the start", above=0.0),
    )
    axis: tuple[float, ...] | None
    zero: tuple[float, ...]
    ic: tuple[float, ...] | None
    guess: tuple[float, ...] | None
    cut: bool
    damp: float
    l: float | None  # noqa: E741

    def check(self, sink: Sink) -> None:
        ref = self.terminals[2][2]
        word = ALIASES.get(ref.name, ref.name)
        if word in LATER:
            sink.error(
                "E239",
                f"joint kind {ref.name} (JOINT {self.name}) is not supported yet",
                ref.span,
                f"supported are: {', '.join(KINDS)}",
            )
            return
        if word not in KINDS:
            close = suggest(ref.name, [*KINDS, *ALIASES])
            sink.error(
                "E239",
                f"JOINT {self.name}: {ref.name} is not a kind of joint",
                ref.span,
                f"did you mean {close}?" if close else f"kinds are: {', '.join(KINDS)}",
            )
            return
        self.kind = word
        self.direction = self._axis(sink)
        self._starts(sink)

    def _axis(self, sink: Sink) -> tuple[float, float, float]:
        """The axis as a unit vector."""
        axis = self.axis if self.axis is not None else DEFAULT_AXIS.get(self.kind, (0.0, 0.0, 1.0))
        if self.axis is not None and self.kind not in DEFAULT_AXIS:
            sink.error("E240", f"a {self.kind} joint (JOINT {self.name}) has no axis=", self.place("axis"))
        if len(axis) not in (2, 3):
            sink.error("E232", f"axis= of JOINT {self.name} has two or three components", self.place("axis"))
            return (0.0, 0.0, 1.0)
        x, y, z = (*axis, 0.0)[:3]
        length = (x * x + y * y + z * z) ** 0.5
        if not length > 0.0:
            sink.error(
                "E232",
                f"axis= of JOINT {self.name} has no direction",
                self.place("axis"),
                "for example axis=(1,0)",
            )
            return (0.0, 0.0, 1.0)
        if self.kind == "pinslot" and z != 0.0:
            sink.error(
                "E232", f"axis= of a pinslot (JOINT {self.name}) lies in the plane", self.place("axis")
            )
        return (x / length, y / length, z / length)

    def _starts(self, sink: Sink) -> None:
        """zero=, ic= and guess= per coordinate."""
        count = len(KINDS[self.kind])
        self.zeros = self._per_coordinate("zero", self.zero, max(count, 1), sink)
        self.start: list[float | None] = [None] * count  # held coordinates
        self.speed: list[float | None] = [None] * count  # held speeds
        self.search: list[float] = [0.0] * count  # where the search starts
        if self.guess is not None:
            self.search = self._per_coordinate("guess", self.guess, count, sink)
        if self.ic is None:
            return
        if count == 0:
            sink.error(
                "E240", f"a {self.kind} joint (JOINT {self.name}) has no coordinate for ic=", self.place("ic")
            )
        elif len(self.ic) == count:
            self.start = list(self.ic)
        elif len(self.ic) == 2 * count:
            self.start, self.speed = list(self.ic[:count]), list(self.ic[count:])
        else:
            sink.error(
                "E232",
                f"ic= of JOINT {self.name} has {len(self.ic)} values; "
                f"a {self.kind} takes {count} or {2 * count}",
                self.place("ic"),
                hint="the coordinates, then the speeds: ic=(q,qd)",
            )

    def _per_coordinate(self, key: str, given: tuple[float, ...], count: int, sink: Sink) -> list[float]:
        """One value a coordinate; a single one is that of a turn (planar, free) or of the slide (pinslot)."""
        if len(given) == count:
            return list(given)
        if len(given) == 1:
            values = [0.0] * count
            if count:
                values[0 if self.kind == "pinslot" else -1] = given[0]
            return values
        sink.error(
            "E232", f"{key}= of JOINT {self.name} has {len(given)} values; it takes {count}", self.place(key)
        )
        return [0.0] * count

    def powers(self, s: Scene) -> Powers:
        if self.damp == 0.0:
            return []
        return [(-self.damp * u, u) for u in s.speeds(self.name)]

    def losses(self, s: Scene) -> Scalar | None:
        if self.damp == 0.0:
            return None
        total = s.b.const(0.0)
        for u in s.speeds(self.name):
            total = total + self.damp * u * u
        return total

    def glyph(self, draw: Pen) -> None:
        draw.add("joint", self, **draw.joint(self.name))

    def analogue(self, net: Net) -> None:
        if self.damp:
            b, a = net.across(self.name)
            net.add(f"Rd_{self.name} {b} {a} {1.0 / self.damp!r}", "damping")
