"""FLANGE: a place of a body that moves with its modes: x + phi_1 q_1 + phi_2 q_2 + .., turned by psi_1 q_1 + psi_2 q_2 + ..

It stands for a body without mass, name.at, that joints hold and forces pull. Rows hold it where the modes say, in the axes of its
body: R^T (r - r0) = sum phi q, and the turn, small, as the antisymmetric part of its rotation.
"""

from __future__ import annotations

from ..deck import MachineCard, Ref
from .base import Card, Required, Spec
from .kinematics import dot, subtract

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import JointView, Pen, PointView, Scalar, Scene

AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


class Flange(Card):
    spec = Spec(
        "FLANGE",
        "FLANGE name body(x,y) mode1.q [mode2.q ..] shape=(ux,uy,rz, ..), three of each mode, or six: (ux,uy,uz,rx,ry,rz, ..)",
        terminals="p:point q1:joint | p:point q1:joint q2:joint",
        mark=("shape",),
        meaning="a place of a body that moves with its modes; it is a body, name.at",
        laws={"q": "place and turn are those of the body and the sum of shape q"},
        shape=Required(
            "", "how the place moves [m] and turns [rad] where a mode's coordinate is 1", "vector"
        ),
    )
    shape: tuple[float, ...]
    p: PointView

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        """A place, and as many modes as there are, one at least."""
        return [[("p", "point"), *((f"q{k}", "joint") for k in range(1, max(2, len(raw.args))))]]

    @classmethod
    def stands_for(cls, raw: MachineCard) -> list[MachineCard]:
        part = f"{raw.name}.at"
        found = [MachineCard("BODY", part, [], {"m": 0.0, "j": (0.0, 0.0, 0.0)}, None, raw.span, {})]
        if raw.args:
            words = [raw.args[0], Ref(part, None, raw.span), Ref("free", None, raw.span)]
            found.append(MachineCard("JOINT", f"{raw.name}.j", words, {}, None, raw.span, {}))
        return found

    def check(self, sink: Sink) -> None:
        count = len(self.terminals) - 1
        each = len(self.shape) // count
        if len(self.shape) != count * each or each not in (3, 6):
            said = f"shape= of FLANGE {self.name} has {len(self.shape)} numbers for {count} mode(s)"
            sink.error(
                "E232", said, self.place("shape"), "of each mode (ux,uy,rz), or in space (ux,uy,uz,rx,ry,rz)"
            )
            return
        parts = [self.shape[k * each : (k + 1) * each] for k in range(count)]
        self.shapes = [part if each == 6 else (part[0], part[1], 0.0, 0.0, 0.0, part[2]) for part in parts]

    def leaves_plane(self) -> bool:
        return any(any(part[2:5]) for part in self.shapes)

    def prepare(self, s: Scene) -> None:
        joints: list[JointView] = [getattr(self, f"q{k + 1}") for k in range(len(self.shapes))]
        self.moved = [
            sum((part[k] * joint.q for part, joint in zip(self.shapes, joints, strict=True)), s.b.const(0.0))
            for k in range(6)
        ]
        # the second order of a turn that is larger is above 2 % of it
        much = dot(self.moved[3:], self.moved[3:]) - 0.2**2
        said = f"FLANGE {self.name} turned by more than 0.2 rad: modes hold for small deformations, a BEAM for large ones"
        if any(any(part[3:]) for part in self.shapes):
            s.told(much, f"{self.name} far", said)

    def constraints(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        base, own = s.body_of(self, "p"), s.frame(f"{self.name}.at")
        gap = subtract(own.point((0.0, 0.0, 0.0)).pos, self.p.pos)
        axes, turned = [base.direction(a) for a in AXES], [own.direction(a) for a in AXES]
        plane = base.angle() is not None and own.angle() is not None
        rows: list[tuple[str, Scalar, str]] = [
            (f"shift {'xyz'[k]}", dot(axes[k], gap) - self.moved[k], "N") for k in range(2 if plane else 3)
        ]
        if plane:
            return [*rows, ("turn z", own.angle() - base.angle() - self.moved[5], "N m")]  # type: ignore[operator]
        for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
            turn = 0.5 * (dot(axes[i], turned[j]) - dot(axes[j], turned[i]))
            rows.append((f"turn {'xyz'[k]}", turn - self.moved[3 + k], "N m"))
        return rows

    def glyph(self, draw: Pen) -> None:
        """A line from the body's origin, along the body's x where the place lies on it."""
        base = draw.m.body_of(self, "p").name
        _, x, y, z = draw.terminal(self, "p")
        third = x / 3.0 if x > 0.0 and not y and not z else 0.0
        draw.add("beam", self, nodes=[draw.on(base), draw.on(f"{self.name}.at")], third=third)
