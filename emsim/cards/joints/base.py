"""What a kind of joint is. A kind is one class in one file, listed in `joints/__init__.py`; a joint of a deck is one object
of it, with the card's `axis` (a unit vector, fixed alike in both bodies), `zeros` and own parameters.

The duties, all but the first two with a default:
 1. `name`, `aliases`, `meaning`, `axis`, `params`   the words of the deck.
 2. `coordinates`, `speeds`    what the kind moves in. len(speeds) is the number of degrees of freedom.
 3. `start(values)`            coordinates from the numbers of ic=, guess=, zero=; `numbers` says how many there are.
 4. `rates(q, u)`              q' = N(q) u, linear in u. Where N is not the identity the speeds are quasi-velocities:
    `gyration(u, p)`           what they add to the equations of the momenta p = dL/du:  p' + gyration = N^T dL/dq + ...
    `norms(q)`                 rows on the coordinates alone that q' keeps, such as e.e - 1 of a quaternion.
 5. `move(frame, q, u, sign)`  carries B's frame along the tree, or A's from B with sign -1.
 6. `closure(b, fa, fb, d)`    where it is cut: [(label, h, unit of the multiplier)], h = 0 in every direction that is not free.
 7. `measure(b, fa, fb, d, near)`   where it is cut: its coordinates from the frames, angles within half a turn of `near`;
    `measure_speeds(fa, fb)`   its speeds, where they are no derivatives of coordinates.
 8. `leaves_plane()`           does it move bodies out of the plane z = const?
 9. `drawn`, `carries`         which shape shows it, and what it is in the electrical analogue.
`fa`, `fb` are the frames of A and B, `d` the vector from the joint's point on A to that on B, in world axes.
"""

from __future__ import annotations

import math

from ...diagnostics import Fix
from ..kinematics import cross, dot, settle, times

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from ..._engine import Builder, Expr
    from ...diagnostics import Sink
    from ..base import Card, Param
    from ..kinematics import Frame, Moving, Scalar, Vector

    Axis = tuple[float, float, float]
    Closure = list[tuple[str, Scalar, str]]

AXES: dict[str, Axis] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class Coord:
    """A coordinate or a speed: the function that reads it, and its unit. `along`: the axis of the elementary motion that it
    belongs to, x y z or the card's own, "axis"; "" where it is none."""

    __slots__ = ("along", "unit", "word")

    def __init__(self, word: str, unit: str, along: str = "") -> None:
        self.word, self.unit, self.along = word, unit, along

    @property
    def turns(self) -> bool:
        return self.unit.startswith("rad")


def unit_vector(card: Card, key: str, value: Sequence[float], sink: Sink) -> Axis:
    """The direction that a parameter gives; reports what is none."""
    if len(value) not in (2, 3):
        said, hint, fixes = f"{key}= of JOINT {card.name} has two or three components", None, []
        if len(value) == 1 and any(
            name == key and unit in ("deg", "rad") for name, _, _, unit, _ in card.raw.units
        ):
            c, s = (round(f(value[0]), 9) + 0.0 for f in (math.cos, math.sin))
            hint = f"a direction is a vector, not an angle: {key}=({c:.9g},{s:.9g})"
            fixes = [Fix(card.place(key), f"{key}=({c:.9g},{s:.9g})")]
        sink.error("E232", said, card.place(key), hint, fixes=fixes)
        return AXES["z"]
    x, y, z = (*value, 0.0)[:3]
    length = (x * x + y * y + z * z) ** 0.5
    if not length > 0.0:
        sink.error(
            "E232",
            f"{key}= of JOINT {card.name} has no direction",
            card.place(key),
            "for example axis=(1,0)",
        )
        return AXES["z"]
    return (x / length, y / length, z / length)


class JointKind:
    name: ClassVar[str]
    aliases: ClassVar[tuple[str, ...]] = ()
    meaning: ClassVar[str]  # what it lets B move against A
    axis_default: ClassVar[Axis | None] = None  # None: the kind has no axis=
    params: ClassVar[dict[str, Param]] = {}  # of this kind alone
    has_zero: ClassVar[bool] = True
    coordinates: ClassVar[tuple[Coord, ...]] = ()
    speeds: ClassVar[tuple[Coord, ...]] = ()
    quasi: ClassVar[bool] = False  # N is not the identity
    measures: ClassVar[tuple[Coord, ...]] = ()  # coordinates that nothing is computed by (../along.py)
    vectors: ClassVar[dict[str, tuple[int, ...]]] = {}  # speeds that are one vector, "": the joint's own
    main: ClassVar[int] = -1  # the coordinate that a single number of zero= or guess= is for
    in_tree: ClassVar[bool] = True  # False: always cut
    in_plane_only: ClassVar[bool] = False  # another kind stands for it in space
    length: float | None = None  # of a rod
    drawn: ClassVar[str] = "pin"  # pin slide rod weld none
    carries: ClassVar[str] = ""  # in the analogue: turn, slide, weld; "": it has none

    def __init__(self, card: Card) -> None:
        self.card = card
        for key in self.params:
            setattr(self, key, getattr(card, key))
        self.axis: Axis = (0.0, 0.0, 1.0)
        self.zeros: list[float] = []
        self.near: list[Scalar] = [0.0] * len(
            self.coordinates
        )  # where it is cut: angles are those within half a turn

    @classmethod
    def motions(cls) -> list[str]:
        """What each number of ic=, guess= and zero= measures: turn or slide."""
        return ["turn" if c.turns else "slide" for c in cls.coordinates]

    @property
    def numbers(self) -> int:
        """How many numbers say where the joint is."""
        return len(self.motions())

    def check(self, sink: Sink) -> None:
        """Rules between parameters."""

    def start(self, values: Sequence[float]) -> list[float] | None:
        """Coordinates from the numbers on the card; None where they do not fit."""
        return list(values) if len(values) == self.numbers else None

    def rates(self, q: Sequence[Expr], u: Sequence[Expr]) -> list[Scalar]:
        return list(u)

    def gyration(self, u: Sequence[Expr], p: Sequence[Expr]) -> list[Scalar]:
        return [0.0] * len(u)

    def norms(self, q: Sequence[Expr]) -> list[Scalar]:
        return []

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        """Carries the frame; the elementary motions that were passed on the way, in the order of the coordinates."""
        raise NotImplementedError

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        raise NotImplementedError

    def measure(self, b: Builder, fa: Frame, fb: Frame, d: Vector, near: Sequence[Scalar]) -> list[Scalar]:
        """Without zero=; [] where frames do not say."""
        return []

    def measure_speeds(self, fa: Frame, fb: Frame) -> list[Scalar] | None:
        return None

    def leaves_plane(self) -> bool:
        return True

    @property
    def unmeasured(self) -> bool:
        """Is its length that of the start, which is not known yet?"""
        return False

    def axis_of(self, along: str) -> Axis:
        return AXES.get(along, self.axis)


class Passed:
    """An elementary motion on the way along the tree: about or along `world`, an axis that turns with `omega`."""

    __slots__ = ("omega", "turns", "world")

    def __init__(self, turns: bool, world: Vector, omega: Vector) -> None:
        self.turns, self.world, self.omega = turns, world, omega

    def share(self, axis: Axis) -> tuple[Scalar, Scalar]:
        """The part of a virtual motion along a world axis that this coordinate takes, and its rate of change."""
        return settle(dot(self.world, axis)), settle(dot(cross(self.omega, self.world), axis))


class Chain(JointKind):
    """Elementary motions one after the other, A's first; each coordinate is one, its speed the derivative."""

    def move(self, moving: Moving, q: Sequence[Scalar], u: Sequence[Scalar], sign: float) -> list[Passed]:
        passed = []
        steps = list(zip(self.coordinates, q, u, self.zeros, strict=False))
        for c, value, speed, zero in steps if sign > 0 else steps[::-1]:
            axis = self.axis_of(c.along)
            passed.append(Passed(c.turns, times(moving.rot.matrix(), axis), moving.omega))
            (moving.turn if c.turns else moving.slide)(axis, sign * (value + zero), sign * speed)
        return passed if sign > 0 else passed[::-1]

    def leaves_plane(self) -> bool:
        axes = [(c.turns, self.axis_of(c.along)) for c in self.coordinates]
        return any(bool(x or y) if turns else bool(z) for turns, (x, y, z) in axes)
