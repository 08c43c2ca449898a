"""The Magic Formula of tyres (H. B. Pacejka, Tire and Vehicle Dynamics): forces of a wheel from its slips and its load.

    y(x) = D sin(C atan(B x - E (B x - atan(B x))))            B C D its slope at 0, D its peak, C its shape, E its curvature
Slips as of the TYDEX W axes, y to the left: kappa = -Vsx/|Vx|, tan alpha = Vsy/|Vx|, so that Fy is below 0 where alpha is above.

By B C D E (`Plain`), both slips at once as one, rho^2 = kappa^2 + tan^2 alpha:
    Fx = kappa/rho yx(rho),    Fy = -tan(alpha)/rho yy(rho)
By the coefficients of PAC2002 (`Fitted`; the formulas of MSC Adams/Tire's help for PAC2002, without camber), dfz = Fz/Fz0 - 1:
    Fx0: C = PCX1, D = Fz (PDX1 + PDX2 dfz), E = (PEX1 + PEX2 dfz + PEX3 dfz^2)(1 - PEX4 sgn kappa),
         B C D = Fz (PKX1 + PKX2 dfz) exp(PKX3 dfz), of kappa + PHX1 + PHX2 dfz, plus Fz (PVX1 + PVX2 dfz)
    Fy0: C = PCY1, D = Fz (PDY1 + PDY2 dfz), E = (PEY1 + PEY2 dfz)(1 - PEY3 sgn alpha),
         B C D = PKY1 Fz0 sin(2 atan(Fz/(PKY2 Fz0))), of alpha + PHY1 + PHY2 dfz, plus Fz (PVY1 + PVY2 dfz)
    Fx = G(alpha) Fx0, Fy = G(kappa) Fy0 + SV(kappa), G a cosine of the same form, 1 at no slip
    relaxation lengths: Fz (PTX1 + PTX2 dfz) exp(PTX3 dfz) R0/Fz0,   PTY1 sin(2 atan(Fz/(PTY2 Fz0))) R0
B is taken from B C D as a quotient in which Fz cancels: a wheel without load has one too. Scale factors L.. multiply what their
names say.
"""

from __future__ import annotations

from .base import Default

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping

    from .._engine import Expr
    from .base import Param, Scalar, Scene

SHAPES = {
    "pcx1": "shape of Fx", "pdx1": "peak friction along, nominal load", "pdx2": "... with the load",
    "pex1": "curvature of Fx", "pex2": "... with the load", "pex3": "... with its square", "pex4": "... driving, braking",
    "pkx1": "slip stiffness over the load", "pkx2": "... with the load", "pkx3": "... in its exponent",
    "phx1": "horizontal shift of Fx", "phx2": "... with the load", "pvx1": "vertical shift of Fx over the load",
    "pvx2": "... with the load",
    "rbx1": "slope of what side slip takes from Fx", "rbx2": "... with kappa", "rcx1": "shape of it", "rex1": "curvature of it",
    "rex2": "... with the load", "rhx1": "shift of it",
    "ptx1": "relaxation length along, over the load", "ptx2": "... with the load", "ptx3": "... in its exponent",
    "pcy1": "shape of Fy", "pdy1": "peak friction across at the nominal load", "pdy2": "... with the load",
    "pey1": "curvature of Fy", "pey2": "... with the load", "pey3": "... between the sides",
    "pky1": "largest cornering stiffness over the nominal load", "pky2": "load at which it is largest, over the nominal one",
    "phy1": "horizontal shift of Fy", "phy2": "... with the load", "pvy1": "vertical shift of Fy over the load",
    "pvy2": "... with the load",
    "rby1": "slope of what slip along takes from Fy", "rby2": "... with alpha", "rby3": "... its shift", "rcy1": "shape of it",
    "rey1": "curvature of it", "rey2": "... with the load", "rhy1": "shift of it", "rhy2": "... with the load",
    "rvy1": "side force by slip along, over the load", "rvy2": "... with the load", "rvy4": "... with alpha",
    "rvy5": "... its shape in kappa", "rvy6": "... its slope in kappa",
    "pty1": "relaxation length across, over the radius", "pty2": "load at which it is largest, over the nominal one",
}  # fmt: skip
SCALES = {
    "lfzo": "nominal load", "lcx": "shape of Fx", "lmux": "peak of Fx", "lex": "curvature of Fx", "lkx": "slip stiffness",
    "lhx": "horizontal shift of Fx", "lvx": "vertical shift of Fx", "lxal": "what side slip takes from Fx",
    "lcy": "shape of Fy", "lmuy": "peak of Fy", "ley": "curvature of Fy", "lky": "cornering stiffness",
    "lhy": "horizontal shift of Fy", "lvy": "vertical shift of Fy", "lyka": "what slip along takes from Fy",
    "lvyka": "side force by slip along", "lsgkp": "relaxation length along", "lsgal": "relaxation length across",
}  # fmt: skip
KEYS = ("fnomin", "r0", *SHAPES, *SCALES)  # of a .model
# whose products divide something
NOT_ZERO = ("pcx1", "pdx1", "pcy1", "pdy1", "pky2", "pty2", "lfzo", "lcx", "lmux", "lcy", "lmuy")


def parameters() -> dict[str, Param]:
    """The coefficients of PAC2002 as parameters of a card, by their standard names."""
    found = {key: Default(None, "", f"PAC2002: {meaning}") for key, meaning in SHAPES.items()}
    found.update(
        {key: Default(None, "", f"PAC2002: scales the {meaning}") for key, meaning in SCALES.items()}
    )
    return found


class Law:
    """Forces along and across, to the left [N], and relaxation lengths [m], for slips kappa and t = tan alpha."""

    def forces(self, s: Scene, kappa: Expr, t: Expr, fz: Scalar) -> tuple[Expr, Expr]:
        raise NotImplementedError


class Plain(Law):
    """By B C D E, a pair each, along and across; D over the load."""

    def __init__(self, b: Pair, c: Pair, d: Pair, e: Pair) -> None:
        self.rows = list(zip(b, c, d, e, strict=True))

    def forces(self, s: Scene, kappa: Expr, t: Expr, fz: Scalar) -> tuple[Expr, Expr]:
        # where nothing slips the quotient of y and rho has a value too
        rho = s.b.call("sqrt", kappa * kappa + t * t + 1e-24)
        along, across = (fz * d * sine(s, c, bend(s, b * rho, e)) / rho for b, c, d, e in self.rows)
        return along * kappa, -across * t


class Fitted(Law):
    """By coefficients of PAC2002: `given` has those that are not 0 (of scale factors: not 1)."""

    def __init__(self, given: Mapping[str, float], nominal: float, radius: float) -> None:
        self.given, self.radius = given, radius
        self.nominal = nominal * self["lfzo"]

    def __getitem__(self, key: str) -> float:
        return self.given.get(key, 1.0 if key in SCALES else 0.0)

    def by_load(self, stem: str, dfz: Scalar, scale: str = "") -> Scalar:
        """p1 + p2 dfz, times a scale factor."""
        found = self[f"{stem}1"] + self[f"{stem}2"] * dfz
        return found * self[scale] if scale else found

    def forces(self, s: Scene, kappa: Expr, t: Expr, fz: Scalar) -> tuple[Expr, Expr]:
        b, dfz = s.b, fz * (1.0 / self.nominal) - 1.0
        alpha = b.call("atan", t)
        along = fz * self._along(s, kappa, dfz) * self._by_side_slip(s, kappa, alpha, dfz)
        peak = self.by_load("pdy", dfz, "lmuy")
        across = fz * self._across(s, alpha, dfz, peak) * self._by_slip_along(s, kappa, alpha, dfz)
        if self["rvy1"] or self["rvy2"]:
            size = fz * peak * self.by_load("rvy", dfz) * b.call("cos", b.call("atan", self["rvy4"] * alpha))
            turned = b.call("sin", self["rvy5"] * b.call("atan", self["rvy6"] * kappa))
            across = across + size * turned * self["lvyka"]
        return along, across

    def _along(self, s: Scene, kappa: Expr, dfz: Scalar) -> Expr:
        """Fx0/Fz."""
        c, d = self["pcx1"] * self["lcx"], self.by_load("pdx", dfz, "lmux")
        e = (self.by_load("pex", dfz) + self["pex3"] * (dfz * dfz)) * self["lex"]
        slope = self.by_load("pkx", dfz, "lkx") * s.b.call("exp", self["pkx3"] * dfz)
        x = slope / (c * d) * (kappa + self.by_load("phx", dfz, "lhx"))
        bent = bend(s, x, e, self["pex4"])
        return d * sine(s, c, bent) + self.by_load("pvx", dfz, "lvx") * self["lmux"]

    def _across(self, s: Scene, alpha: Expr, dfz: Scalar, d: Scalar) -> Expr:
        """Fy0/Fz. sin(2 atan x) = 2 x/(1 + x^2), and x has Fz as a factor."""
        c, e = self["pcy1"] * self["lcy"], self.by_load("pey", dfz, "ley")
        over = (dfz + 1.0) * (1.0 / self["pky2"])
        slope = 2.0 * self["pky1"] / self["pky2"] * self["lky"] / (1.0 + over * over)
        x = slope / (c * d) * (alpha + self.by_load("phy", dfz, "lhy"))
        # sgn alpha is that of x where the slope is above 0
        bent = bend(s, x, e, self["pey3"] if self["pky1"] * self["pdy1"] > 0.0 else -self["pey3"])
        return d * sine(s, c, bent) + self.by_load("pvy", dfz, "lvy") * self["lmuy"]

    def _by_side_slip(self, s: Scene, kappa: Expr, alpha: Expr, dfz: Scalar) -> Scalar:
        if not self["rcx1"] or not self["rbx1"]:
            return 1.0
        slope = self["rbx1"] * self["lxal"] * s.b.call("cos", s.b.call("atan", self["rbx2"] * kappa))
        return _weight(s, slope, self["rcx1"], self.by_load("rex", dfz), alpha, self["rhx1"])

    def _by_slip_along(self, s: Scene, kappa: Expr, alpha: Expr, dfz: Scalar) -> Scalar:
        if not self["rcy1"] or not self["rby1"]:
            return 1.0
        shifted = self["rby2"] * (alpha - self["rby3"])
        slope = self["rby1"] * self["lyka"] * s.b.call("cos", s.b.call("atan", shifted))
        return _weight(s, slope, self["rcy1"], self.by_load("rey", dfz), kappa, self.by_load("rhy", dfz))

    def lengths(self, s: Scene, fz: Scalar) -> tuple[Scalar, Scalar]:
        """Relaxation lengths [m], along and across."""
        dfz = fz * (1.0 / self.nominal) - 1.0
        grown = s.b.call("exp", self["ptx3"] * dfz)
        along = fz * self.by_load("ptx", dfz, "lsgkp") * grown * (self.radius * self["lfzo"] / self.nominal)
        over = (dfz + 1.0) * (1.0 / self["pty2"])
        across = (
            2.0 * over / (1.0 + over * over) * (self["pty1"] * self.radius * self["lfzo"] * self["lsgal"])
        )
        return along, across


def bend(s: Scene, x: Expr, e: Scalar, lopsided: float = 0.0) -> Expr:
    """B x - E (B x - atan(B x)), E times 1 - lopsided sgn x."""
    rest = x - s.b.call("atan", x)
    return x - e * (rest - lopsided * s.abs(rest) if lopsided else rest)


def sine(s: Scene, c: float, bent: Expr) -> Expr:
    return s.b.call("sin", c * s.b.call("atan", bent))


def _weight(s: Scene, slope: Expr, c: float, e: Scalar, x: Expr, shift: Scalar) -> Expr:
    """G: the cosine at x + shift over that at the shift alone."""

    def cosine(at: Scalar) -> Expr:
        return s.b.call("cos", c * s.b.call("atan", bend(s, slope * at, e)))

    return cosine(x + shift) / cosine(shift)


if TYPE_CHECKING:
    Pair = tuple[float, float]
