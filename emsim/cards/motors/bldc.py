"""MOTOR of type bldc: three phases whose magnets give voltages with flat tops.

    W' = l sum i_k^2/2 + ke/p sum i_k F(e_k),   e_k = p th - k 120 deg
    l di_k + r i_k + ke f(e_k) w = v_k - v_star,    torque = ke sum i_k f(e_k)
f = F' is the trapezoid: 0 at 0, 1 from 30 to 150 degrees, odd; its corners are events. F is a linear function of the angle on the
flats and a parabola on the ramps; as functions of s = sin e and c = cos e, without counting turns:
    s > 1/2: -atan2(c, s)     s < -1/2: -atan2(c, -s)     between: +-(3/pi a^2 - 5 pi/12), a = atan2(s, +-c), + where c > 0
"""

from __future__ import annotations

from math import pi

from ..base import Default, Spec
from ..domains.warmth import MAGNETS
from .base import SHAFT, Phase, Windings, star

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..._engine import Expr
    from ..base import Scene


class Bldc(Windings):
    of_type = "bldc"
    needs = ("p", "ke", "l")
    spec = Spec(
        "MOTOR",
        "MOTOR name a b c [n] joint model=m   with .model m bldc p= ke= r= l= (or kt= rtt= ltt=) [j=] ..",
        terminals="na:node nb:node nc:node joint:joint | na:node nb:node nc:node nn:node joint:joint",
        mark=("model",),
        meaning="a brushless direct-current machine: three phases, trapezoidal back-EMF",
        laws={
            "T": "j (w + w_A)^2/2, w = gear u",
            "W": "l sum i^2/2 + ke/p sum i F(p th - k 120)",
            "P": "r sum i^2 + b w^2 + tc |w|",
            "i": "l di/dt + r i + ke f(p th - k 120) w = v - v_star, torque ke sum f i",
        },
        p=Default(None, "", "pairs of poles", above=0.0),
        ke=Default(None, "V s/rad (V s/m)", "volts of a phase per speed, on the flat top"),
        kt=Default(None, "N m/A (N/A)", "in place of ke: torque per ampere through two phases, 2 ke"),
        r=Default(0.0, "Ohm", "resistance of a phase", least=0.0),
        rtt=Default(None, "Ohm", "in place of r: from terminal to terminal, 2 r", least=0.0),
        l=Default(None, "H", "inductance of a phase less the mutual one", above=0.0),
        ltt=Default(None, "H", "in place of l: from terminal to terminal, 2 l", above=0.0),
        **MAGNETS,
        **SHAFT,
    )  # fmt: skip
    p: float
    ke: float
    kt: float | None
    r: float
    rtt: float | None
    l: float  # noqa: E741
    ltt: float | None
    na: int
    nb: int
    nc: int
    nn: int | None = None

    def _read_model(self, s: Scene) -> None:
        if self.model is not None:
            self._from_model(s)
        for one, other in (("ke", "kt"), ("r", "rtt"), ("l", "ltt")):
            self.either(s, one, other, f"{other} is two phases in series, twice {one}")
            if getattr(self, other) is not None:
                setattr(self, one, 0.5 * getattr(self, other))
        self._ask(s)

    def phases(self) -> list[Phase]:
        return star(self.na, self.nb, self.nc, self.nn, self.r)

    def coenergy_of(self, s: Scene, i: list[Expr], phases: list[Expr], th: Expr) -> Expr:
        energy = s.b.const(0.0)
        for k, current in enumerate(phases):
            energy = energy + (0.5 * self.l) * current * current
            energy = energy + (self.ke / self.p) * current * self._linkage(s, k, th)
        return energy

    def _linkage(self, s: Scene, k: int, th: Expr) -> Expr:
        """F of phase k. What chooses its pieces looks at the real angle, `th` stands for it."""
        b, shift = s.b, 2.0 * pi / 3.0 * k

        def parts(angle: Expr) -> tuple[Expr, Expr]:
            e = self.p * angle - shift
            return b.call("sin", e), b.call("cos", e)

        sin, cos = parts(th)
        at, along = (s.public(x) for x in parts(self.angle))
        kinks = ((at - 0.5, "top"), (-0.5 - at, "bottom"), (along, "rises"))
        top, bottom, rises = (
            b.flag(e, None, f"{self.name} {k} {word}", -1, law="stays") for e, word in kinks
        )
        up, down = b.call("atan2", sin, cos), b.call("atan2", sin, -cos)
        low = 5.0 * pi / 12.0
        ramps = b.select(rises, (3.0 / pi) * up * up - low, low - (3.0 / pi) * down * down)
        flats = b.select(bottom, -b.call("atan2", cos, -sin), ramps)
        return b.select(top, -b.call("atan2", cos, sin), flats)
