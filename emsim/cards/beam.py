"""BEAM: a thin beam of n elements that bends as far as it likes, in the plane or in space; Euler-Bernoulli, corotational.

It stands for n + 1 bodies without mass of their own, its nodes name.a, name.n1 .. name.b: joints hold them, forces pull them.
An element of length l0, chord l between its nodes, tangents of the beam there at angles a, b from the chord:

    strain   eps = (l - l0)/l0 + (2 a^2 - a b + 2 b^2)/30      the arc of a cubic is longer than its chord
    V        EA l0 eps^2/2 + 2 EI/l0 (a^2 + a b + b^2)         cubic deflection over the chord
    arc=     a = -bow/2, b = bow/2 and the chord of that arc, l0 sin(bow/2)/(bow/2), are without strain
    T        of r = (1 - x) p + x q + l0 (x (1 - x)^2 (t_p - e) - x^2 (1 - x) (t_q - e)), e along the chord, t the tangents
    weight   at the middle of it, (p + q)/2 + l0 (t_p - t_q)/12
    d=       Kelvin-Voigt: stress E (eps + d eps'), in bending too
In space V is that of rod.py, and T has rho (Iy + Iz) omega^2/2 about the tangent beside it. Strains are small, and so are a and b
where elements are short; how far the whole beam turns and bends is free. Rotary inertia about other axes and shear are left out:
the beam is thin. Crisfield, Non-linear finite element analysis of solids and structures 1, 7.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, isfinite, pi, sin, tanh

from ..deck import MachineCard, Ref
from ..opened import OpenNumber
from .base import Card, Default, Required, Spec, is_number
from .body import start
from .kinematics import cross, dot, scale, subtract
from .rod import Rod, sinc

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import Pen, Powers, Probes, Resistances, Scalar, Scene

MOST = 200  # elements: every node is placed from the first one
MOTION = ("x", "y", "z", "angle", "rot", "vx", "vy", "vz", "omega")  # of a free beam, as of a free body


class Beam(Card):
    spec = Spec(
        "BEAM",
        "BEAM name l= [n=8] [arc=] e= rho= section=rect(b,h)/round(d)/tube(d,t) [g=] [d= [noisy=yes]] "
        "[x= y= angle= vx= vy= omega=, in space z= vz= rot= omega=(wx,wy,wz)]  "
        "or ei= ea= rhoa= [eiy= gj=] in place of e= rho= section= [g=]",
        terminals="",
        mark=("section", "ei"),
        meaning="a thin beam that bends largely, with g= in space; its ends are bodies: name.a, name.b",
        meant={"length": "l={}"},
        laws={
            "T": "rhoa v^2/2 over its length",
            "V": "EA eps^2/2 + EI kappa^2/2 over its length, in space GK twist^2/2",
            "P": "d (EA eps'^2 + EI kappa'^2) over its length",
        },
        l=Required("m", "its length", above=0.0),
        n=Default(8.0, "", "how many elements", least=1.0),
        arc=Default(
            0.0, "rad", "the angle that it turns through from end to end where nothing bends it, to the left"
        ),
        e=Default(None, "Pa", "modulus of elasticity", above=0.0),
        rho=Default(None, "kg/m^3", "density", above=0.0),
        section=Default(
            None, "m", "rect(b,h), h along y of the beam, b along z; round(d); tube(d,t), t the wall", "shape"
        ),
        g=Default(None, "Pa", "modulus of rigidity, in space", above=0.0),
        ei=Default(None, "N m^2", "stiffness in bending, about z", above=0.0),
        ea=Default(None, "N", "stiffness along", above=0.0),
        rhoa=Default(None, "kg/m", "mass over length", above=0.0),
        eiy=Default(
            None, "N m^2", "stiffness in bending about y, in space; ei= where it is not given", above=0.0
        ),
        gj=Default(None, "N m^2", "stiffness in twisting, in space", above=0.0),
        d=Default(0.0, "s", "damping: stress is E (eps + d eps')", least=0.0),
        noisy=Default(False, "", "its thermal noise counts in .noise", "flag"),
        **start("name.a", "beams"),
    )
    l: float  # noqa: E741
    n: float
    arc: float
    e: float | None
    rho: float | None
    section: Any
    g: float | None
    eiy: float | None
    gj: float | None
    omega: tuple[float, ...]
    ei: float | None
    ea: float | None
    rhoa: float | None
    d: float
    noisy: bool

    @classmethod
    def stands_for(cls, raw: MachineCard) -> list[MachineCard]:
        """Its nodes: bodies that are free against the first one, at first in a line or an arc. None where l=, n= or arc= is
        wrong."""
        sizes = [
            raw.params.get("n", cls.spec.params["n"].default),
            raw.params.get("l"),
            raw.params.get("arc", 0.0),
        ]
        n, length, arc = (float(v) if is_number(v) or isinstance(v, OpenNumber) else 0.0 for v in sizes)
        if (
            not 1.0 <= n <= MOST
            or not n.is_integer()
            or not length > 0.0
            or not isfinite(length)
            or not abs(arc) < n
        ):
            return []
        bow = arc / n  # of an element
        names = cls.nodes(raw.name, int(n))
        moves = {key: raw.params[key] for key in MOTION if key in raw.params}
        found, here = [], (0.0, 0.0)
        for k, name in enumerate(names):
            params: dict[str, Any] = {"m": 0.0, "j": (0.0, 0.0, 0.0), **(moves if k == 0 else {})}
            found.append(MachineCard("BODY", name, [], params, None, raw.span, raw.param_spans))
            if k:
                words = [Ref(word, None, raw.span) for word in (names[0], name, "free")]
                chord = length / n * sinc(0.5 * bow)
                here = (here[0] + chord * cos((k - 0.5) * bow), here[1] + chord * sin((k - 0.5) * bow))
                at: dict[str, Any] = {"guess": (*here, bow * k)}
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
        self.bow = float(self.arc) / self.count if self.count else 0.0  # of an element
        if not abs(self.bow) < 1.0:
            said = f"arc= of {what} bends each of its elements by {self.bow:.3g} rad; an element is bent by less than 1"
            sink.error("E238", said, self.place("arc"), "more elements: n=")
        whole = [key for key in ("ei", "ea", "rhoa") if getattr(self, key) is not None]
        parts = [key for key in ("e", "rho", "section") if getattr(self, key) is not None]
        other = [key for key in (("g",) if whole else ("eiy", "gj")) if getattr(self, key) is not None]
        # about z, along, mass over length, about y, twisting
        self.stiffness: tuple[float, ...] = (1.0,) * 5
        self.twisting = self.gj if whole else self.g
        if len(whole) == 3 and not parts and not other:
            self.stiffness = (
                self.ei,
                self.ea,
                self.rhoa,
                self.ei if self.eiy is None else self.eiy,
                1.0 if self.gj is None else self.gj,
            )  # type: ignore[assignment]
        elif len(parts) == 3 and not whole and not other:
            area, about_z, about_y, twist = self._of_section(what, sink)
            assert self.e is not None and self.rho is not None
            e = self.e
            self.stiffness = (
                e * about_z,
                e * area,
                self.rho * area,
                e * about_y,
                (1.0 if self.g is None else self.g) * twist,
            )
        else:
            said = f"{what} needs all of e=, rho=, section=, or all of ei=, ea=, rhoa="
            if other:
                said = (
                    f"{other[0]}= of {what} goes with {'e=, rho=, section=' if whole else 'ei=, ea=, rhoa='}"
                )
            sink.error("E230", said, self.span, f"the form is: {self.spec.form}")

    def _of_section(self, what: str, sink: Sink) -> tuple[float, float, float, float]:
        """Area [m^2], second moments of area about z and y and Saint-Venant's constant of torsion [m^4]."""
        kind = getattr(self.section, "fn", "")
        sizes = [getattr(a, "value", 0.0) for a in getattr(self.section, "args", ())]
        if sizes and all(is_number(v) and v > 0.0 for v in sizes):
            first, *others = sizes
            if kind == "rect" and len(others) == 1:
                (b, h), (thin, wide) = sizes, sorted(sizes)
                # Timoshenko and Goodier, Theory of elasticity, art. 109; the terms left out are below 1e-6 of it
                rest = sum(tanh(k * pi * wide / (2.0 * thin)) / k**5 for k in (1, 3, 5, 7, 9))
                twist = wide * thin**3 / 3.0 * (1.0 - 192.0 / pi**5 * thin / wide * rest)
                return b * h, b * h**3 / 12.0, h * b**3 / 12.0, twist
            bore = first - 2.0 * others[0] if kind == "tube" and len(others) == 1 else 0.0
            if (kind == "round" and not others) or bore > 0.0:
                second = pi * (first**4 - bore**4) / 64.0
                return pi * (first**2 - bore**2) / 4.0, second, second, 2.0 * second
        said = f"section= of {what} is rect(b,h), round(d) or tube(d,t), of sizes above 0"
        sink.error(
            "E232", said, self.place("section"), "of a tube d is the outer diameter, t the wall below d/2"
        )
        return 1.0, 1.0, 1.0, 1.0

    def leaves_plane(self) -> bool:
        return any(self.given(key) for key in ("g", "gj", "eiy", "z", "vz", "rot")) or len(self.omega) > 1

    def prepare(self, s: Scene) -> None:
        self.names = self.nodes(self.name, self.count)
        self.frames = [s.frame(name) for name in self.names]
        self.at = [frame.point((0.0, 0.0, 0.0)) for frame in self.frames]
        self.l0, self.along = self.l / self.count, (1.0, 0.0, 0.0)
        self.elements: list[Any] = []
        if s.in_space and self.twisting is None:
            said = f"BEAM {self.name} twists, as the machine leaves the plane, and nothing says how stiff it is then"
            s.sink.error(
                "E230", said, self.span, "g= of its material (modulus of rigidity, Pa), or gj= (N m^2)"
            )
            return
        for k in range(self.count):
            part = self.at[k : k + 2], self.frames[k : k + 2], (self.l0, self.bow), self.stiffness
            self.elements.append(Rod(s, *part) if s.in_space else Element(s, *part))

    def kinetic(self, s: Scene) -> Scalar | None:
        """Of the cubic through the nodes along their tangents, and of the turn of its section about it."""
        mass, total = self.stiffness[2] * self.l0, s.b.const(0.0)
        turns = [cross(frame.omega, frame.direction(self.along)) for frame in self.frames]
        for k, one in enumerate(self.elements):
            v, w = self.at[k].vel, self.at[k + 1].vel
            apart = subtract(w, v)
            swing = scale(1.0 / one.chord, subtract(apart, scale(dot(one.way, apart), one.way)))  # e'
            t, u = (scale(self.l0, subtract(turn, swing)) for turn in turns[k : k + 2])
            linear = (dot(v, v) + dot(v, w) + dot(w, w)) / 6.0
            mixed = 3.0 * (dot(v, t) - dot(w, u)) + 2.0 * (dot(w, t) - dot(v, u))
            cubic = 2.0 * (dot(t, t) + dot(u, u)) - 3.0 * dot(t, u)
            total = total + mass * (linear + mixed / 60.0 + cubic / 420.0)
        if s.in_space:
            ei, ea, _, eiy, _ = self.stiffness
            for p, q in pairwise(frame.spin()[0] for frame in self.frames):
                total = total + mass * (ei + eiy) / ea / 6.0 * (p * p + p * q + q * q)
        return total

    def potential(self, s: Scene) -> Scalar | None:
        total, g = s.b.const(0.0), s.gravity
        for _, k, strain in self._strains():
            total = total + 0.5 * k * strain * strain
        if any(g):
            mass = self.stiffness[2] * self.l0
            heights = [dot(g, point.pos) for point in self.at]
            leans = [dot(g, frame.direction(self.along)) for frame in self.frames]
            for k in range(self.count):
                middle = 0.5 * (heights[k] + heights[k + 1]) + self.l0 / 12.0 * (leans[k] - leans[k + 1])
                total = total - mass * middle
        return total

    def _strains(self) -> list[tuple[str, float, Expr]]:
        """Of all elements: (word, stiffness, strain)."""
        return [
            (f"{word} {k}", stiff, strain)
            for k, one in enumerate(self.elements, 1)
            for word, stiff, strain in one.strains
        ]

    def _damped(self, s: Scene) -> Resistances:
        """(name, resistance, flow) of all elements."""
        if not self.d:
            return []
        return [(word, self.d * k, s.rate(strain)) for word, k, strain in self._strains()]

    def powers(self, s: Scene) -> Powers:
        return [(-r * flow, flow) for _, r, flow in self._damped(s)]

    def losses(self, s: Scene) -> Scalar | None:
        return sum((r * flow * flow for _, r, flow in self._damped(s)), s.b.const(0.0)) if self.d else None

    def thermal(self, s: Scene) -> Resistances:
        return self._damped(s) if self.noisy else []

    def probes(self, s: Scene) -> Probes:
        """force(beam,k): with which element k is pulled along; torque(beam,k): the bending moment in its middle, above 0 where
        it bends to the left. In space that is mz(beam,k), beside my(beam,k) and the moment that twists it, mx(beam,k)."""

        def stress(k: float, strain: Expr) -> Expr:
            return k * (strain + self.d * s.rate(strain)) if self.d else k * strain

        found: Probes = {}
        for k, one in enumerate(self.elements, 1):
            found |= {f"force,{k}": stress(*one.pull), f"torque,{k}": stress(*one.moments[-1])}
            if s.in_space:
                found |= {
                    f"m{axis},{k}": stress(*moment) for axis, moment in zip("xyz", one.moments, strict=True)
                }
        return found

    def glyph(self, draw: Pen) -> None:
        draw.add("beam", self, nodes=[draw.on(name) for name in self.names], third=self.l0 / 3.0)


class Element:
    """Between two nodes, in the plane. `strains`: (word, stiffness, strain), V = sum of stiffness strain^2/2;
    a^2 + a b + b^2 = (a - b)^2/4 + 3 (a + b)^2/4. `pull`, `moments`: (stiffness, strain)."""

    def __init__(
        self, s: Scene, ends: Any, frames: Any, rest: tuple[float, float], stiffness: Sequence[float]
    ) -> None:
        ei, ea, (p, q), (l0, bow) = stiffness[0], stiffness[1], ends, rest
        d = [q.pos[0] - p.pos[0], q.pos[1] - p.pos[1]]
        chord = s.b.call("sqrt", s.b.const(0.0) + dot(d, d))
        x, y = d[0] / chord, d[1] / chord
        self.chord, self.way = chord, [x, y, 0.0]
        tangents = [frame.direction((1.0, 0.0, 0.0)) for frame in frames]
        a, b = (s.b.call("atan2", x * t[1] - y * t[0], x * t[0] + y * t[1]) for t in tangents)
        along = chord / l0 - sinc(0.5 * bow) + (2.0 * a * a - a * b + 2.0 * b * b - 1.25 * bow * bow) / 30.0
        self.strains = [
            ("along", ea * l0, along),
            ("even", ei / l0, b - a - bow),
            ("odd", 3.0 * ei / l0, a + b),
        ]
        self.pull, self.moments = (ea, along), [(ei / l0, b - a - bow)]
