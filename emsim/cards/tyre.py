"""TYRE: a wheel's forces on the road by its slips, the Magic Formula (magic.py), with relaxation lengths.

P is where the tyre touches the road, on the part that carries the wheel and does not spin with it; d the wheel's heading, along=
of P's part laid on the road, a = n x d to its left. With v the velocity of P over Q's part, w the speed of the wheel's joint,

    Vx = v.d,  Vsx = Vx - r w,  Vsy = v.a
    u' = Vsx - |Vx| u/sigma_x,   kappa = -u/sigma_x             u, y: how far the tyre is bent [m]
    y' = Vsy - |Vx| y/sigma_y,   tan alpha = y/sigma_y          (Pacejka, chapter 7: the single contact point, linear)
so that slips are those of the steady state behind a way of some sigma, and have values at standstill, where the tyre is a
spring. Fx and Fy act on P along d and a, -r Fx on the joint: power Fx Vsx + Fy Vsy, which is what the tyre takes.
Without a joint the wheel rolls freely: no Fx.
"""

from __future__ import annotations

from . import magic
from .base import Card, Default, Spec, is_number
from .kinematics import cross, dot, is_zero, scale, subtract
from .round import unit

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import JointView, Pen, PointView, Powers, Probes, Scalar, Scene

LETTERS = ("b", "c", "d", "e")


class Tyre(Card):
    spec = Spec(
        "TYRE",
        "TYRE name P Q [joint r=] along=(dx,dy) fz= b=(Bx,By) c=(Cx,Cy) d=(Dx,Dy)/fz [e=(Ex,Ey)] sigma=(sx,sy)   or model= (or "
        "fnomin= pcx1= ..) of PAC2002 for b= c= d= e=",
        terminals="p:point q:point | p:point q:point spin:joint",
        mark=("fz",),
        meaning="a tyre on the road: the Magic Formula of its slips and its load",
        meant={"load": "fz={}", "n": "fz={}", "mu": "d=({},{})", "axis": "along={}"},
        laws={
            "P": "Fx Vsx + Fy Vsy; y(x) = D sin(C atan(B x - E (B x - atan(B x)))) of slips that follow within sigma",
        },
        along=Default((1.0, 0.0), "", "heading of the wheel, in the axes of P's body", "vector"),
        normal=Default((0.0, 0.0, 1.0), "", "normal of the road, in the axes of Q's body", "vector"),
        r=Default(
            None,
            "m",
            "rolling radius, with a joint; below 0 where the joint's positive turn rolls backwards",
        ),
        fz=Default(
            None, "N", "load: number or {expression}, such as {force(contact)}; below 0 it is 0", "value"
        ),
        b=Default(None, "", "stiffness factor B, along and across", "vector"),
        c=Default(None, "", "shape factor C", "vector"),
        d=Default(None, "", "peak factor D over the load: the peak's coefficient of friction", "vector"),
        e=Default((0.0, 0.0), "", "curvature factor E, at most 1", "vector"),
        sigma=Default(None, "m", "relaxation lengths, along and across", "vector"),
        model=Default(None, "", "a .model of type tyre with coefficients of PAC2002", "word"),
        fnomin=Default(None, "N", "PAC2002: the nominal load", above=0.0),
        r0=Default(None, "m", "PAC2002: the radius without load (UNLOADED_RADIUS)", above=0.0),
        **magic.parameters(),
    )
    along: tuple[float, ...]
    normal: tuple[float, ...]
    r: float | None
    fz: Any
    b: tuple[float, ...] | None
    c: tuple[float, ...] | None
    d: tuple[float, ...] | None
    e: tuple[float, ...]
    sigma: tuple[float, ...] | None
    model: str | None
    p: PointView
    q: PointView
    spin: JointView | None = None
    shortest = 1e-3  # of its radius: the relaxation length of a wheel without load, on which no force depends

    def check(self, sink: Sink) -> None:
        what = f"TYRE {self.name}"
        for key, sizes in (("along", (2, 3)), ("normal", (3,))):
            if len(getattr(self, key)) not in sizes or not any(getattr(self, key)):
                said = f"{key}= of {what} is a direction such as {'(1,0)' if key == 'along' else '(0,0,1)'}"
                sink.error("E232", said, self.place(key))
        if self.fz is None:
            sink.error("E230", f"{what} needs fz= (its load, N)", self.span, self.spec.form)
        elif is_number(self.fz) and self.fz < 0.0:
            sink.error("E238", f"fz= of {what} is {self.fz:g}; a road does not pull", self.place("fz"))
        for key in (*LETTERS, "sigma"):
            value = getattr(self, key)
            if value is not None and len(value) == 1:
                setattr(self, key, (value[0], value[0]))
            elif value is not None and len(value) != 2:
                sink.error(
                    "E232", f"{key}= of {what} is one number, or two: along and across", self.place(key)
                )
            elif value is not None and key != "e" and min(value) <= 0.0:
                sink.error("E238", f"{key}= of {what} must be greater than 0", self.place(key))
        if max(self.e) > 1.0:
            said = f"e= of {what} is above 1: the force would change its sign at large slips"
            sink.error("E238", said, self.place("e"))
        self._check_joint(what, sink)
        self._check_law(what, sink)

    def _check_joint(self, what: str, sink: Sink) -> None:
        has_joint = len(self.terminals) == 3
        if has_joint and not self.r:
            sink.error("E230", f"{what} needs r= (the rolling radius, m) beside its joint", self.span)
        elif not has_joint and self.r is not None:
            said = (
                f"r= of {what} belongs to the wheel's joint, a third name: without it the wheel rolls freely"
            )
            sink.error("E240", said, self.place("r"), self.spec.form)

    def _check_law(self, what: str, sink: Sink) -> None:
        fitted = self.model is not None or self.given("fnomin")
        letters = [key for key in LETTERS if self.given(key)]
        if fitted and letters:
            said = f"{what} has {letters[0]}= and coefficients of PAC2002: each says it all"
            sink.error("E240", said, self.place(letters[0]), "leave one of them out")
        elif not fitted and (missing := [key for key in ("b", "c", "d", "sigma") if not self.given(key)]):
            said = f"{what} needs {missing[0]}="
            sink.error("E230", said, self.span, f"the form is: {self.spec.form}")

    def leaves_plane(self) -> bool:
        """Not where the plane is the road, nor where it is seen from the side."""
        z = (*self.along, 0.0)[2] or (self.normal[2] if any(self.normal[:2]) else 0.0)
        return bool(z)

    # coefficients -------------------------------------------------------------------------------------

    def _coefficients(self, s: Scene) -> dict[str, float]:
        """Those of PAC2002 that are written, on the card or in its .model."""
        found = {key: float(getattr(self, key)) for key in magic.KEYS if getattr(self, key) is not None}
        if self.model is None:
            return found
        model = s.models.get(self.model)
        if model is None or model.type != "tyre":
            said = f"TYRE {self.name}: no .model of type tyre is named {self.model}"
            s.sink.error("E253", said, self.place("model"), f".model {self.model} tyre fnomin=.. makes it")
            return found
        for key, value in model.params.items():
            where = model.param_spans.get(key, model.span)
            if key not in magic.KEYS:
                said = f".model {model.name} tyre does not take {key}="
                s.sink.error("E231", said, where, "camber and moments of the tyre are not computed")
            elif not is_number(value):
                s.sink.error("E232", f"{key}= of .model {model.name} is not a number", where)
            else:
                found.setdefault(key, float(value))
        return found

    def _law(self, s: Scene) -> magic.Law | None:
        if self.b is not None and self.c is not None and self.d is not None:
            pairs = [(v[0], v[1]) for v in (self.b, self.c, self.d, self.e)]
            return magic.Plain(*pairs)
        given = self._coefficients(s)
        needed = ["fnomin", "r0", *magic.NOT_ZERO] if self.sigma is None else ["fnomin", *magic.NOT_ZERO]
        if self.sigma is None and not (given.get("ptx1") and given.get("pty1")):
            said = f"TYRE {self.name} needs sigma=, or ptx1= and pty1=: without a relaxation length it has no slip at standstill"
            s.sink.error("E230", said, self.span)
            return None
        for key in needed:
            if key == "pty2" and self.sigma is not None:
                continue
            if not given.get(key, 1.0 if key in magic.SCALES else 0.0):
                said = f"TYRE {self.name} needs {key}=, other than 0, of PAC2002's coefficients"
                s.sink.error("E230", said, self.place("model"))
                return None
        return magic.Fitted(given, given["fnomin"], given.get("r0", 0.0))

    # motion -------------------------------------------------------------------------------------------

    def prepare(self, s: Scene) -> None:
        self.efforts: list[Expr] = []
        self.flows: list[Expr] = []
        self.rows: list[int | None] = []
        self.lengths: list[Scalar] = []
        self.law: magic.Law | None = None
        law = self._law(s)
        n = s.body_of(self, "q").direction(unit(self.normal))
        a = cross(n, s.body_of(self, "p").direction(unit(self.along)))
        if law is None or all(map(is_zero, a)):
            if law is not None:
                said = f"the heading along= of TYRE {self.name} stands upright on the road"
                s.sink.error("E232", said, self.place("along"), "normal= is the normal of the road")
            return
        if s.in_space:
            a = scale(1.0 / s.b.call("sqrt", s.b.const(0.0) + dot(a, a)), a)
        heading = cross(a, n)
        away = subtract(self.p.pos, self.q.pos)
        v = subtract(subtract(self.p.vel, self.q.vel), cross(s.body_of(self, "q").omega, away))
        zero = s.b.const(0.0)
        ahead, side = zero + dot(v, heading), zero + dot(v, a)
        along = zero if self.spin is None else ahead - (self.r or 0.0) * self.spin.u
        self.flows = [along, side]
        # how far it is bent: nothing where it rolls freely, or cannot go sideways
        self.rows = [
            None if flow.value == 0.0 else s.b.unknown(f"{self.name}#{word}", "coordinate", "m", 0.0)
            for word, flow in zip("uy", self.flows, strict=True)
        ]
        self.ahead, self.law = ahead, law

    def _made(self, s: Scene) -> list[Expr]:
        """Forces along and across; the load may be what a CONTACT carries, which cards do not know while they prepare."""
        if self.law is None or self.efforts:
            return self.efforts
        load = s.compile(self.fz, self.place("fz"))
        self.load = load if load.value is not None else s.maximum(load, 0.0)
        if self.sigma is not None:
            self.lengths = [*self.sigma]
        else:
            assert isinstance(self.law, magic.Fitted)
            shortest = self.shortest * self.law.radius
            self.lengths = [s.maximum(x, shortest) for x in self.law.lengths(s, self.load)]
        zero = s.b.const(0.0)
        u, y = (
            zero if row is None else s.b.x(row) / length
            for row, length in zip(self.rows, self.lengths, strict=True)
        )
        found = self.law.forces(s, -u, y, self.load)
        self.efforts = [zero if row is None else f for row, f in zip(self.rows, found, strict=True)]
        return self.efforts

    def stamp(self, s: Scene) -> None:
        self._made(s)
        for row, flow, length in zip(self.rows, self.flows, self.lengths, strict=True):
            if row is not None:
                bent = s.b.x(row)
                s.add_q(row, bent)
                s.add_f(row, s.public(s.abs(self.ahead) / length * bent - flow))

    def powers(self, s: Scene) -> Powers:
        pairs = zip(self._made(s), self.flows, strict=True)
        return [(f, v) for f, v in pairs if v.value != 0.0]

    def losses(self, s: Scene) -> Scalar | None:
        """What the slips take, and what the bent tyre holds for a while."""
        return -sum((f * v for f, v in self.powers(s)), s.b.const(0.0))

    def probes(self, s: Scene) -> Probes:
        """force: the load; friction: along, across to the left, and both; slip: speeds over the road."""
        efforts = self._made(s)
        found: Probes = {"force": self.load}
        for word, parts in (("friction", efforts), ("slip", self.flows)):
            found.update({f"{word},{k + 1}": part for k, part in enumerate(parts)})
            found[word] = s.b.call("hypot", *parts)
        found["power"] = sum((f * v for f, v in self.powers(s)), s.b.const(0.0))
        return found

    def glyph(self, draw: Pen) -> None:
        """The wheel's heading, as a blade's."""
        draw.add("knife", self, at=draw.terminal(self, "p"), along=list(unit(self.along)))
