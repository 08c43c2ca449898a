"""JOINT: ties a point of A to a point of B; its coordinates are B relative to A.

What a kind of joint is stands in joints/KIND.py; here is what all kinds have in common. At coordinate 0 plus `zero=` the two
frames are aligned. Along the spanning tree a joint supplies coordinates; where it closes a loop it says which directions stay
free (assemble/loops.py). `damp=` takes damp * u^2 watts in each of its speeds.
"""

from __future__ import annotations

from .base import Card, Default, Spec
from .joints import ALIASES, KINDS
from .joints.base import AXES, unit_vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Net, Param, Pen, Powers, Scalar, Scene
    from .joints.base import Axis, JointKind


def _own_params() -> dict[str, Param]:
    """Parameters that single kinds have."""
    return {key: param for kind in KINDS.values() for key, param in kind.params.items()}


class Joint(Card):
    spec = Spec(
        "JOINT",
        "JOINT name A B kind [axis=(x,y[,z])] [zero=] [ic=q or (q,qd)] [guess=] [cut=yes] [damp=]",
        terminals="a:point b:point kind:kind",
        mark=("kind",),
        meaning="a joint between two bodies; kinds: " + " ".join(KINDS),
        meant={},
        laws={"P": "damp u^2"},
        axis=Default(None, "", "the axis of a pin or slide, for example, in the frames of A and B", "vector"),
        zero=Default((0.0,), "rad or m", "where the coordinate is 0, measured from aligned frames", "vector"),
        ic=Default(None, "rad or m, and per second", "coordinate and speed at the start, held", "vector"),
        guess=Default(None, "rad or m", "about where the coordinate is when the loops have closed", "vector"),
        cut=Default(False, "", "this joint is the one cut in its loop", "flag"),
        damp=Default(0.0, "N m s/rad or N s/m", "viscous damping", least=0.0),
        **_own_params(),
    )
    axis: tuple[float, ...] | None
    zero: tuple[float, ...]
    ic: tuple[float, ...] | None
    guess: tuple[float, ...] | None
    cut: bool
    damp: float

    @classmethod
    def marked(cls, code: str) -> bool:
        # the kind stands behind its name and its two ends; either may have a place in parentheses
        words = "".join(part.rpartition(")")[2] for part in code.split("(")).replace(",", " ").split()
        kind, ends = "".join(words[4:5]).lower(), "".join(words[1:4])
        return ALIASES.get(kind, kind) in KINDS and "=" not in ends

    @classmethod
    def mark_in_words(cls) -> str:
        *kinds, last = KINDS
        return f"its kind ({', '.join(kinds)} or {last}) as the fourth word"

    def check(self, sink: Sink) -> None:
        ref = self.terminals[2][2]
        # the grammar knows a JOINT by its kind
        self.kind: JointKind = KINDS[ALIASES.get(ref.name, ref.name)](self)
        for key in _own_params():
            if self.given(key) and key not in self.kind.params:
                self._not_taken(key, sink)
        self.direction = self.kind.axis = self._axis(sink)
        self.kind.check(sink)
        if not self.kind.in_plane_only:
            self.settle(self.kind, sink)

    def settle(self, kind: JointKind, sink: Sink) -> None:
        """The kind that it is in this scene, and where it starts."""
        self.kind = kind
        self._starts(sink)

    def _not_taken(self, key: str, sink: Sink) -> None:
        article = "an" if self.kind.name[0] in "aeiou" else "a"
        sink.error(
            "E240", f"{article} {self.kind.name} joint (JOINT {self.name}) has no {key}=", self.place(key)
        )

    def _axis(self, sink: Sink) -> Axis:
        """The axis as a unit vector."""
        default = self.kind.axis_default
        if self.axis is not None and default is None:
            self._not_taken("axis", sink)
        axis = self.axis if self.axis is not None else default
        return AXES["z"] if axis is None else unit_vector(self, "axis", axis, sink)

    def _starts(self, sink: Sink) -> None:
        """zero=, ic= and guess= as coordinates."""
        kind = self.kind
        if self.given("zero") and not kind.has_zero:
            self._not_taken("zero", sink)
        self.zeros = kind.zeros = self._placed("zero", self.zero, sink)
        count, degrees = len(kind.coordinates), len(kind.speeds)
        numbers = kind.numbers if count else 0
        self.start: list[float | None] = [None] * count  # held coordinates
        self.speed: list[float | None] = [None] * degrees  # held speeds
        self.search: list[float] = (
            kind.start([0.0] * numbers) or [] if count else []
        )  # where the search starts
        if self.guess is not None:
            if not count:
                self._not_taken("guess", sink)
                return
            self.search = self._placed("guess", self.guess, sink)
        if self.ic is None:
            return
        if count == 0:
            sink.error(
                "E240",
                f"a {kind.name} joint (JOINT {self.name}) has no coordinate for ic=",
                self.place("ic"),
            )
        elif len(self.ic) in (numbers, numbers + degrees):
            self.start = [*(kind.start(self.ic[:numbers]) or [])]
            if len(self.ic) > numbers:
                self.speed = [*self.ic[numbers:]]
        else:
            sink.error(
                "E232",
                f"ic= of JOINT {self.name} has {len(self.ic)} values; "
                f"a {kind.name} takes {numbers} or {numbers + degrees}",
                self.place("ic"),
                hint="the coordinates, then the speeds: ic=(q,qd)",
            )

    def _placed(self, key: str, given: tuple[float, ...], sink: Sink) -> list[float]:
        """Coordinates from numbers on the card; a single number is for the kind's main coordinate."""
        numbers = self.kind.numbers
        values = list(given)
        if len(given) == 1 and numbers > 1:
            values = [0.0] * numbers
            values[self.kind.main] = given[0]
        if numbers and (found := self.kind.start(values)) is not None:
            return found
        if not numbers and len(given) == 1:
            return values
        sink.error(
            "E232",
            f"{key}= of JOINT {self.name} has {len(given)} values; it takes {numbers}",
            self.place(key),
        )
        return self.kind.start([0.0] * numbers) or []

    def guessed(self, k: int) -> bool:
        """Does guess= say something of coordinate k?"""
        if self.guess is None:
            return False
        count = len(self.kind.coordinates)
        return len(self.guess) > 1 or k == self.kind.main % count

    def powers(self, s: Scene) -> Powers:
        if self.damp == 0.0:
            return []
        return [(-self.damp * u, u) for u in s.speeds(self.name)]

    def losses(self, s: Scene) -> Scalar | None:
        if self.damp == 0.0:
            return None
        return sum((self.damp * u * u for u in s.speeds(self.name)), s.b.const(0.0))

    def glyph(self, draw: Pen) -> None:
        draw.add("joint", self, **draw.joint(self.name))

    def analogue(self, net: Net) -> None:
        if self.damp:
            b, a = net.across(self.name)
            net.add(f"Rd_{self.name} {b} {a} {1.0 / self.damp!r}", "damping")
