"""SHAPE: a further shape of a body or of the ground, to be touched and drawn. What BODY says of mass and inertia stays."""

from __future__ import annotations

from . import shapes
from .base import Card, Default, Spec
from .kinematics import perpendicular

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .base import Pen
    from .solids import Solid


class ShapeCard(Card):
    spec = Spec(
        "SHAPE",
        "SHAPE name body rod(l,w)/box(w,h[,d])/disc(r)/polygon(x1,y1,..) [at=(x,y)] [angle=], "
        "in space /ball(r)/capsule(l,r)/cylinder(r,h)/ellipsoid(a,b,c)/hull(x1,y1,z1,..)/plane(nx,ny,nz) [at=(x,y,z)] [rot=]",
        terminals="body:part kind:shape",
        mark=("at", "angle", "rot"),
        meaning="a further shape of a body, or of the ground 0, that CONTACT and pictures know",
        at=Default((0.0, 0.0), "m", "where the shape's origin is, in body axes", "vector"),
        angle=Default(0.0, "rad", "by which the shape is turned in the body"),
        rot=Default(None, "rad", "in space: by which it is turned, a rotation vector", "vector"),
    )
    at: tuple[float, ...]
    angle: float
    rot: tuple[float, ...] | None
    shape: shapes.Shape

    @classmethod
    def marked(cls, code: str) -> bool:
        """A fourth word such as box(1,2)."""
        words = code.replace("(", " ( ").split()[3:5]
        return len(words) == 2 and words[1] == "(" and words[0].lower() in shapes.KINDS

    @classmethod
    def mark_in_words(cls) -> str:
        *kinds, last = (f"{kind}(..)" for kind in shapes.KINDS)
        return f"its shape ({', '.join(kinds)} or {last}) as the fourth word"

    def check(self, sink: Sink) -> None:
        (_, _, body), (_, _, kind) = self.terminals
        self.body = body.name
        if len(self.at) not in (2, 3):
            sink.error("E232", f"at= of SHAPE {self.name} has two or three components", self.place("at"))
        elif self.rot is not None and len(self.rot) != 3:
            sink.error("E232", f"rot= of SHAPE {self.name} has three components", self.place("rot"))
        elif self.rot is not None and self.given("angle"):
            said = f"SHAPE {self.name} has rot= and angle=: each says how it is turned"
            sink.error("E240", said, self.place("rot"), "leave one of them out")
        elif (found := shapes.read(kind, f"SHAPE {self.name}", kind.span or self.span, sink)) is not None:
            self.shape = found.placed(self.at, self.angle, self.rot)

    def glyph(self, draw: Pen) -> None:
        outline(draw, self, self.body, self.shape)


def outline(draw: Pen, card: Card, body: str, shape: shapes.Shape) -> None:
    """A shape on its body: a disc as one, others by their corners; in space as a solid."""
    if shape.solid is not None and not draw.planar:
        _solid(draw, card, body, shape.solid)
    elif shape.kind == "disc":
        draw.add("disc", card, at=draw.on(body, shape.centre), sizes=[shape.radius])
    else:
        draw.add(
            "polygon", card, at=draw.on(body, shape.centre), to=[draw.on(body, p) for p in shape.corners]
        )


def _solid(draw: Pen, card: Card, body: str, solid: Solid) -> None:
    axes, sizes = [list(axis) for axis in solid.axes], list(solid.sizes)
    if solid.normal is not None:
        axes = [list(axis) for axis in (*perpendicular(solid.normal), solid.normal)]
    points = [[a - b for a, b in zip(p, solid.at, strict=True)] for p in solid.corners]
    draw.add(
        "solid", card, at=draw.on(body, solid.at), form=solid.kind, sizes=sizes, axes=axes, reach=solid.size,
        points=points, faces=[list(face) for face in solid.faces],
    )  # fmt: skip
