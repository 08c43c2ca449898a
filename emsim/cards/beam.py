"""BEAM: a thin beam of n elements that bends as far as it likes, in the plane; Euler-Bernoulli, corotational.

It stands for n + 1 bodies without mass of their own, its nodes name.a, name.n1 .. name.b: joints hold them, forces pull them.
An element of length l0, chord l between its nodes, tangents of the beam there at angles a, b from the chord:

    strain   eps = (l - l0)/l0 + (2 a^2 - a b + 2 b^2)/30      the arc of a cubic is longer than its chord
    V        EA l0 eps^2/2 + 2 EI/l0 (a^2 + a b + b^2)         cubic deflection over the chord
    T        of the same cubic as it moves with its nodes
    weight   at the middle of the chord and l0 (a - b)/12 beside it
    d=       Kelvin-Voigt: stress E (eps + d eps'), in bending too
Strains are small, and so are a and b where elements are short; how far the whole beam turns and bends is free. Rotary inertia of
the section and shear are left out: the beam is thin. Crisfield, Non-linear finite element analysis of solids and structures 1, 7.
"""

from __future__ import annotations

from math import isfinite, pi

from ..deck import MachineCard, Ref
from ..opened import OpenNumber
from .base import Card, Default, Required, Spec, is_number
from .kinematics import dot

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Pen, Powers, Probes, Resistances, Scalar, Scene

MOST = 200  # elements: every node is placed from the first one
MOTION = ("x", "y", "angle", "vx", "vy", "omega")  # of a free beam, as of a free body


class Beam(Card):
    spec = Spec(
        "BEAM",
        "BEAM name l= [n=8] e= rho= section=rect(b,h)/round(d)/tube(d,t) [d= [noisy=yes]] [x= y= angle= vx= vy= omega=]  "
        "or ei= ea= rhoa= in place of e= rho= section=",
        terminals="",
        mark=("section", "ei"),
        meaning="a thin beam that bends largely, in the plane; its ends are bodies: name.a, name.b",
        meant={"length": "l={}"},
        laws={
            "T": "rhoa v^2/2 over its length",
            "V": "EA eps^2/2 + EI kappa^2/2 over its length",
            "P": "d (EA eps'^2 + EI kappa'^2) over its length",
        },
        l=Required("m", "its length", above=0.0),
        n=Default(8.0, "", "how many elements", least=1.0),
        e=Default(None, "Pa", "modulus of elasticity", above=0.0),
        rho=Default(None, "kg/m^3", "density", above=0.0),
        section=Default(None, "m", "rect(b,h), h in the plane; round(d); tube(d,t), t the wall", "shape"),
        ei=Default(None, "N m^2", "stiffness in bending", above=0.0),
        ea=Default(None, "N", "stiffness along", above=0.0),
        rhoa=Default(None, "kg/m", "mass over length", above=0.0),
        d=Default(0.0, "s", "damping: stress is E (eps + d eps')", least=0.0),
        noisy=Default(False, "", "its thermal noise counts in .noise", "flag"),
        x=Default(0.0, "m", "start position of name.a, free beams"),
        y=Default(0.0, "m", "start position of name.a, free beams"),
        angle=Default(0.0, "rad", "start orientation, free beams"),
        vx=Default(0.0, "m/s", "start velocity of name.a, free beams"),
        vy=Default(0.0, "m/s", "start velocity of name.a, free beams"),
        omega=Default(0.0, "rad/s", "start angular velocity, free beams"),
    )
    l: float  # noqa: E741
    n: float
    e: float | None
    rho: float | None
    section: Any
    ei: float | None
    ea: float | None
    rhoa: float | None
    d: float
    noisy: bool

    @classmethod
    def stands_for(cls, raw: MachineCard) -> list[MachineCard]:
        """Its nodes: bodies that move in the plane against the first one, at first in a line. None where l= or n= is wrong."""
        sizes = [raw.params.get("n", cls.spec.params["n"].default), raw.params.get("l")]
        n, length = (float(v) if is_number(v) or isinstance(v, OpenNumber) else 0.0 for v in sizes)
        if not 1.0 <= n <= MOST or not n.is_integer() or not length > 0.0 or not isfinite(length):
            return []
        names = cls.nodes(raw.name, int(n))
        moves = {key: raw.params[key] for key in MOTION if key in raw.params}
        found = []
        for k, name in enumerate(names):
            params: dict[str, Any] = {"m": 0.0, **(moves if k == 0 else {})}
            found.append(MachineCard("BODY", name, [], params, None, raw.span, raw.param_spans))
            if k:
                words = [Ref(word, None, raw.span) for word in (names[0], name, "planar")]
                at: dict[str, Any] = {"guess": (length * k / n, 0.0, 0.0)}
                found.append(MachineCard("JOINT", f"{name}.j", words, at, None, raw.span, {}))
        return found

    @classmethod
    def nodes(cls, name: str, n: int) -> list[str]:
        return [f"{name}.a", *(f"{name}.n{k}" for k in range(1, n)), f"{name}.b"]

    def check(self, sink: Sink) -> None:
        what, self.count = f"BEAM {self.name}", int(self.n)
        if float(self.n) != self.count or self.count > MOST:
            said = f"n= of {what} is {float(self.n):g}; a beam has 1 to {MOST} whole elements"
            sink.error("E238", said, self.place("n"), "eight are enough for its first bends")
        whole = [key for key in ("ei", "ea", "rhoa") if getattr(self, key) is not None]
        parts = [key for key in ("e", "rho", "section") if getattr(self, key) is not None]
        if len(whole) == 3 and not parts:
            self.stiffness: Any = (self.ei, self.ea, self.rhoa)
        elif len(parts) == 3 and not whole:
            area, second = self._of_section(what, sink)
            assert self.e is not None and self.rho is not None
            self.stiffness = (self.e * second, self.e * area, self.rho * area)
        else:
            said = f"{what} needs all of e=, rho=, section=, or all of ei=, ea=, rhoa="
            sink.error("E230", said, self.span, f"the form is: {self.spec.form}")

    def _of_section(self, what: str, sink: Sink) -> tuple[float, float]:
        """Area [m^2] and second moment of area [m^4]."""
        kind = getattr(self.section, "fn", "")
        sizes = [getattr(a, "value", 0.0) for a in getattr(self.section, "args", ())]
        if sizes and all(is_number(v) and v > 0.0 for v in sizes):
            first, *others = sizes
            if kind == "rect" and len(others) == 1:
                return first * others[0], first * others[0] ** 3 / 12.0
            if kind == "round" and not others:
                return pi * first**2 / 4.0, pi * first**4 / 64.0
            if kind == "tube" and len(others) == 1 and 2.0 * others[0] < first:
                bore = first - 2.0 * others[0]
                return pi * (first**2 - bore**2) / 4.0, pi * (first**4 - bore**4) / 64.0
        said = f"section= of {what} is rect(b,h), round(d) or tube(d,t), of sizes above 0"
        sink.error(
            "E232", said, self.place("section"), "of a tube d is the outer diameter, t the wall below d/2"
        )
        return 1.0, 1.0

    def prepare(self, s: Scene) -> None:
        if s.in_space:
            said = f"BEAM {self.name} bends in the plane, and the machine leaves it"
            s.sink.error("E240", said, self.span, "in space: bodies with joints and springs between them")
        self.names = self.nodes(self.name, self.count)
        self.frames = [s.frame(name) for name in self.names]
        self.at = [frame.point((0.0, 0.0, 0.0)) for frame in self.frames]
        self.l0 = self.l / self.count
        self.elements = [Element(s, self, k) for k in range(self.count)]

    def kinetic(self, s: Scene) -> Scalar | None:
        mass = self.stiffness[2] * self.l0
        return sum((mass * one.kinetic() for one in self.elements), s.b.const(0.0))

    def potential(self, s: Scene) -> Scalar | None:
        (ei, ea, mass), total = self.stiffness, s.b.const(0.0)
        for one in self.elements:
            a, b = one.a, one.b
            total = total + 0.5 * ea * self.l0 * one.strain * one.strain
            total = total + 2.0 * ei / self.l0 * (a * a + a * b + b * b)
            if any(s.gravity[:2]):
                total = total - mass * self.l0 * dot(s.gravity[:2], one.centre())
        return total

    def _damped(self, s: Scene) -> Resistances:
        """(name, resistance, flow) of all elements: a^2 + a b + b^2 = (a - b)^2/4 + 3 (a + b)^2/4."""
        if not self.d:
            return []
        ei, ea, _ = self.stiffness
        found: Resistances = []
        for k, one in enumerate(self.elements, 1):
            found.append((f"along {k}", self.d * ea * self.l0, s.rate(one.strain)))
            found.append((f"even {k}", self.d * ei / self.l0, s.rate(one.a - one.b)))
            found.append((f"odd {k}", 3.0 * self.d * ei / self.l0, s.rate(one.a + one.b)))
        return found

    def powers(self, s: Scene) -> Powers:
        return [(-r * flow, flow) for _, r, flow in self._damped(s)]

    def losses(self, s: Scene) -> Scalar | None:
        return sum((r * flow * flow for _, r, flow in self._damped(s)), s.b.const(0.0)) if self.d else None

    def thermal(self, s: Scene) -> Resistances:
        return self._damped(s) if self.noisy else []

    def probes(self, s: Scene) -> Probes:
        """force(beam,k): with which element k is pulled along; torque(beam,k): the bending moment in its middle, above 0 where
        it bends to the left."""
        ei, ea, _ = self.stiffness
        found: Probes = {}
        for k, one in enumerate(self.elements, 1):
            pull, bend = ea * one.strain, ei / self.l0 * (one.b - one.a)
            if self.d:
                pull = pull + self.d * ea * s.rate(one.strain)
                bend = bend + self.d * ei / self.l0 * s.rate(one.b - one.a)
            found |= {f"force,{k}": pull, f"torque,{k}": bend}
        return found

    def glyph(self, draw: Pen) -> None:
        draw.add("beam", self, nodes=[draw.on(name) for name in self.names], third=self.l0 / 3.0)


class Element:
    """Between nodes k and k + 1; in the axes of its chord."""

    def __init__(self, s: Scene, beam: Beam, k: int) -> None:
        self.l0 = beam.l0
        p, q = beam.at[k], beam.at[k + 1]
        self.p, self.q = p, q
        d = [q.pos[0] - p.pos[0], q.pos[1] - p.pos[1]]
        chord = self.chord = s.b.call("sqrt", s.b.const(0.0) + dot(d, d))
        self.way = [d[0] / chord, d[1] / chord]
        tangents = [beam.frames[j].direction((1.0, 0.0, 0.0)) for j in (k, k + 1)]
        self.a, self.b = (self._from_chord(s, t) for t in tangents)
        self.spins = [beam.frames[j].omega[2] for j in (k, k + 1)]
        a, b = self.a, self.b
        self.strain: Expr = (chord - self.l0) / self.l0 + (2.0 * a * a - a * b + 2.0 * b * b) / 30.0

    def _from_chord(self, s: Scene, tangent: Any) -> Expr:
        x, y = self.way
        return s.b.call("atan2", x * tangent[1] - y * tangent[0], x * tangent[0] + y * tangent[1])

    def centre(self) -> list[Scalar]:
        beside = self.l0 / 12.0 * (self.a - self.b)
        across = (-self.way[1], self.way[0])
        return [
            0.5 * (i + j) + beside * n for i, j, n in zip(self.p.pos[:2], self.q.pos[:2], across, strict=True)
        ]

    def kinetic(self) -> Scalar:
        """Over its mass: of r = chord + w n, w = l0 (a N2 + b N4); its velocity has w' across the chord, -w chi' along it."""
        x, y = self.way
        v, w = self.p.vel, self.q.vel
        along = [x * u[0] + y * u[1] for u in (v, w)]
        across = [x * u[1] - y * u[0] for u in (v, w)]
        turns = (across[1] - across[0]) / self.chord  # chi'
        back = [-self.l0 * turns * angle for angle in (self.a, self.b)]
        beside = [self.l0 * (spin - turns) for spin in self.spins]
        return half_square(along, back) + half_square(across, beside)


def half_square(u: list[Any], k: list[Any]) -> Any:
    """Half the mean square over an element of u1 (1 - x) + u2 x + k1 N2 + k2 N4, N2 = x (1 - x)^2, N4 = -x^2 (1 - x)."""
    linear = (u[0] * u[0] + u[0] * u[1] + u[1] * u[1]) / 6.0
    mixed = u[0] * (3.0 * k[0] - 2.0 * k[1]) + u[1] * (2.0 * k[0] - 3.0 * k[1])
    cubic = 2.0 * (k[0] * k[0] + k[1] * k[1]) - 3.0 * k[0] * k[1]
    return linear + mixed / 60.0 + cubic / 420.0
