"""V: row v+ - v- - e(t)."""

from __future__ import annotations

from .base import VOLTAGE, Param, Path, named
from .independent import DISTORTION, Independent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Accounts, Circuit

ROUNDING = 1e-15  # sin(pi) is not quite 0


class VoltageSource(Independent):
    __slots__ = ()
    accounted = "supplied"
    letter = "v"
    what = "voltage source"
    form = Independent.form.format("V")
    law = "v = e(t)"
    unit = "V"
    instance = named(
        portnum=Param("number of a port, which has the resistance z0 in series"),
        z0=Param("resistance of a port", "Ohm", 0.0),
        pwr=Param("power of a port's wave, which transients do not have yet", "W", 1e-3),
        freq=Param("its frequency", "Hz"), phase=Param("its phase", "deg"), **DISTORTION,
    )  # fmt: skip
    current_name = ""
    holds_voltage = True
    jumps = 5

    @property
    def is_multiplied(self) -> bool:
        return False

    def branches(self, is_read: bool) -> tuple[tuple[str, float]]:
        return ((self.name, 0.0),)

    def paths(self) -> tuple[Path, ...]:
        return VOLTAGE

    def imposes(self, ctx: Circuit) -> bool:
        return abs(ctx.value_at_start(self)) > ROUNDING * self._amplitude()

    def _amplitude(self) -> float:
        return max((abs(float(a)) for a in self.wave.args), default=0.0) if self.wave is not None else 0.0

    def contribute(self, ctx: Circuit) -> None:
        br = self.join_voltage(ctx)
        rise = ctx.rise()
        if rise is None:
            ctx.b.f_wave(br, ctx.wave(self), -1.0)
        else:
            ctx.b.add_f(br, -(ctx.b.wave_expr(ctx.wave(self)) * rise))
        if "portnum" in self.params:
            ctx.b.g(br, br, -self.number("z0"))

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if {"pwr", "freq", "phase"} & set(self.params) and any(a.kind == "tran" for a in ctx.flat.analyses):
            said = f"`{self.name}`: the wave that pwr= and freq= of a port ask for is not supported in a transient"
            ctx.sink.error("E113", said, self.span, "write SIN(0 sqrt(4*pwr*z0) freq 0 0 90)")

    def account(self, ctx: Circuit, book: Accounts) -> None:
        book.supplies(self, -(self.between(ctx) * self.flow(ctx)))
