"""BODY: a rigid body with mass and inertia. Kinetic energy, and potential energy in gravity.

    T = m/2 v.v + 1/2 w.J w      v: velocity of the centre of mass, w: angular velocity in body axes
    V = -m g.r                   r: position of the centre of mass
Inertia about the centre of mass of the shapes (homogeneous):
    rod(l, w=0)   Jxx = m w^2/12, Jyy = m l^2/12, Jzz = m (l^2 + w^2)/12; Jzz = m l^2/12 for the thin rod
    box(w, h)     Jxx = m h^2/12, Jyy = m w^2/12, Jzz = m (w^2 + h^2)/12
    disc(r)       Jxx = Jyy = m r^2/4,            Jzz = m r^2/2
    polygon(..)   see shapes.py; with a depth box(w, h, d), and other solids: solids.py
"""

from __future__ import annotations

from math import sqrt

from ..opened import as_read
from . import looks, shape, shapes
from .base import Card, Default, Spec, sets

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..diagnostics import Sink
    from .base import Net, Param, Pen, Scalar, Scene


def start(origin: str, of: str) -> dict[str, Param]:
    """Parameters of where something free is, and how it moves, when a run begins."""
    where, how = f"start position of {origin}, free {of}", f"start velocity of {origin}, free {of}"
    turns = f"start angular velocity, free {of}; in space (wx,wy,wz) in its own axes"
    return {
        "x": Default(0.0, "m", where), "y": Default(0.0, "m", where),
        "angle": Default(0.0, "rad", f"start orientation, free {of}"),
        "vx": Default(0.0, "m/s", how), "vy": Default(0.0, "m/s", how), "omega": Default((0.0,), "rad/s", turns, "vector"),
        "z": Default(0.0, "m", f"{where} in space"),
        "rot": Default(None, "rad", "start orientation in space: a rotation vector, axis times angle", "vector"),
        "vz": Default(0.0, "m/s", f"{how} in space"),
    }  # fmt: skip


class Body(Card):
    spec = Spec(
        "BODY",
        "BODY name m= [j=] [com=(x,y)] [shape=rod(l)/box(w,h[,d])/disc(r)/polygon(x1,y1,..)/ball(r)/capsule(l,r)/"
        "cylinder(r,h)/ellipsoid(a,b,c)/hull(x1,y1,z1,..)] "
        "[look=ball(r)/wheel(r)/gear(r,z)/wagon(l,h)/plate(w,h)/stl(file)] "
        "[x= y= angle= vx= vy= omega=, in space z= vz= rot= omega=(wx,wy,wz)] [fixed=yes]",
        terminals="",
        mark=("m", "shape", "fixed"),
        meaning="a rigid body",
        meant={"mass": "m={}", "j": "m=0 j={}", "inertia": "m=0 j={}"},
        laws={"T": "m v^2/2 + J omega^2/2", "V": "-m g.r"},
        m=Default(0.0, "kg", "the mass", least=0.0),
        j=Default(
            None,
            "kg m^2",
            "the inertia about the centre of mass: Jzz or (Jxx,Jyy,Jzz[,Jxy,Jxz,Jyz])",
            "vector",
        ),
        com=Default(None, "m", "the centre of mass in body axes; follows from shape", "vector"),
        shape=Default(
            None,
            "m",
            "rod(l[,w]) or capsule(l,r) along +x from the origin, others centred, polygon(x1,y1,..), hull(x1,y1,z1,..)",
            "shape",
        ),
        look=Default(None, "", f"its picture alone: {looks.FORM}", "shape"),
        fixed=Default(False, "", "fixed to the ground at x, y, angle", "flag"),
        **start("the origin", "bodies"),
    )
    m: float
    j: tuple[float, ...] | None
    com: tuple[float, ...] | None
    shape: Any
    look: Any
    fixed: bool
    x: float
    y: float
    angle: float
    vx: float
    vy: float
    omega: Any  # a number, about z, once it has been checked
    z: float
    rot: tuple[float, ...] | None
    vz: float

    @classmethod
    def marked(cls, code: str) -> bool:
        return super().marked(code) and not sets(code, ("v", "i"))  # a source has those

    def check(self, sink: Sink) -> None:
        self._motion(sink)
        self.inertia: tuple[float, ...] = (0.0,) * 6  # Jxx Jyy Jzz Jxy Jxz Jyz about the centre of mass
        self.outline: shapes.Shape | None = None
        self.spatial_inertia = False  # are Jxx and Jyy known?
        centre: tuple[float, ...] = (0.0, 0.0, 0.0)
        if self.shape is not None:
            self.outline = shapes.read(self.shape, f"BODY {self.name}", self.place("shape"), sink)
            if self.outline is None:
                return
            self.inertia = (*(self.m * j for j in self.outline.inertia), 0.0, 0.0)[:6]
            centre = self.outline.centre
            self.spatial_inertia = True
        self.looks = None
        if self.look is not None:
            self.looks = looks.read(self.look, f"BODY {self.name}", self.place("look"), sink)
            if self.looks is None:
                return
        if self.com is not None:
            if len(self.com) not in (2, 3):
                sink.error("E232", f"com= of BODY {self.name} has two or three components", self.place("com"))
                return
            centre = self.com
        self.centre = (*centre, 0.0)[:3]
        if self.j is not None:
            self._explicit_inertia(self.j, sink)
        if not self.given("m") and not self.fixed:
            sink.error(
                "E230",
                f"BODY {self.name} needs m= (the mass, kg)",
                self.span,
                f"the form is: {self.spec.form}",
            )

    def _motion(self, sink: Sink) -> None:
        """Where it starts, in space."""
        if self.rot is not None and len(self.rot) != 3:
            sink.error("E232", f"rot= of BODY {self.name} has three components", self.place("rot"))
            self.rot = None
        if len(self.omega) not in (1, 3):
            sink.error("E232", f"omega= of BODY {self.name} has one or three components", self.place("omega"))
        if self.given("rot") and self.given("angle"):
            said = f"BODY {self.name} has rot= and angle=: each says how it stands"
            sink.error("E240", said, self.place("rot"), "leave one of them out")
        self.spins = self.omega if len(self.omega) == 3 else (0.0, 0.0, self.omega[0])
        self.omega = self.spins[2]
        self.in_space = bool(self.z or self.vz) or self.rot is not None or any(self.spins[:2])

    def _explicit_inertia(self, j: tuple[float, ...], sink: Sink) -> None:
        """j= wins over the shape."""
        if len(j) not in (1, 3, 6):
            sink.error("E232", f"j= of BODY {self.name} has one, three or six components", self.place("j"))
            return
        if any(v < 0.0 for v in j[:3]):
            sink.error("E238", f"j= of BODY {self.name} is negative; an inertia cannot be", self.place("j"))
            return
        if len(j) == 1:
            self.inertia = (*self.inertia[:2], j[0], 0.0, 0.0, 0.0)
        else:
            self.inertia = (*j, 0.0, 0.0, 0.0)[:6]
            self.spatial_inertia = True

    def kinetic(self, s: Scene) -> Scalar | None:
        frame = s.frame(self.name)
        w = frame.spin()
        jx, jy, jz, jxy, jxz, jyz = self.inertia
        energy = 0.5 * self.m * frame.speed_squared(self.centre)
        energy = energy + 0.5 * (jx * (w[0] * w[0]) + jy * (w[1] * w[1]) + jz * (w[2] * w[2]))
        if jxy or jxz or jyz:
            energy = energy + jxy * (w[0] * w[1]) + jxz * (w[0] * w[2]) + jyz * (w[1] * w[2])
        return energy

    def potential(self, s: Scene) -> Scalar | None:
        if self.m == 0.0 or not any(s.gravity):
            return None
        r = s.frame(self.name).point(self.centre).pos
        g = s.gravity
        return -self.m * (g[0] * r[0] + g[1] * r[1] + g[2] * r[2])

    def glyph(self, draw: Pen) -> None:
        """What it looks like, or its shape; without them what joins its centre of mass to everything fastened to it."""
        sizes = [getattr(a, "value", a) for a in getattr(self.shape, "args", ())]
        kind = getattr(self.shape, "fn", "bones")
        if self.looks is not None:
            kind, sizes = self.looks
            if kind == "stl":
                surface, box = draw.mesh(self.look.args[0].id, *sizes)
                draw.add("mesh", self, at=draw.on(self.name), mesh=surface, box=box)
                return
            draw.add(
                {"plate": "box", "gear": "toothed"}.get(kind, kind), self, at=draw.on(self.name), sizes=sizes
            )
        elif self.outline is not None and (kind == "polygon" or self.outline.leaves_plane):
            shape.outline(draw, self, self.name, self.outline)
        elif kind == "bones":
            at = draw.on(self.name, self.centre)
            known = not draw.planar and self.m > 0.0 and not any(self.inertia[3:])
            inertia = [self.m, *self.inertia[:3]] if known else None
            m, j = as_read(self.m), as_read(self.inertia[2])
            draw.add(
                kind, self, at=at, to=draw.attached(self.name), spin=draw.wheel(self.name), inertia=inertia,
                planar=draw.planar, gyration=sqrt(2 * j / m) if m and j else 0.0,
            )  # fmt: skip
        else:
            draw.add(kind, self, at=draw.on(self.name), sizes=sizes)

    def analogue(self, net: Net) -> None:
        """A capacitor to ground; weight as a current, that of a pendulum as one that depends on its angle."""
        node = net.node(self.name)
        if node == "0":
            return
        g = net.gravity
        if net.turns(self.name):
            rx, ry = net.lever(self.name, self.centre)
            net.add(
                f"C_{node} {node} 0 {self.inertia[2] + self.m * (rx * rx + ry * ry)!r}",
                f"inertia of {self.name}",
            )
            if self.m and (g[0] or g[1]) and (rx or ry):
                weight = net.moment(self.name, self.centre, *(repr(self.m * c) if c else "0" for c in g[:2]))
                net.add(f"Bg_{node} 0 {node} i='{weight}'", "weight")
            return
        net.add(f"C_{node} {node} 0 {self.m!r}", f"mass of {self.name}")
        along = sum(a * b for a, b in zip(g, net.direction(self.name), strict=True))
        if self.m and along:
            net.add(f"Ig_{node} 0 {node} {self.m * along!r}", "weight")
