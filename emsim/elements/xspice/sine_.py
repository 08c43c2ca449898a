"""sine: an oscillator whose frequency follows its input."""

from __future__ import annotations

import math

from .base import CodeModel, Seat, Word, driving, named, numbers, reading
from .pwl_ import pairs

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr

CONTROL = {
    "cntl_array": numbers("inputs, ascending", "", (0.0, 1.0)),
    "freq_array": numbers("frequencies there, straight lines between and beyond", "Hz", (1.0, 1e3)),
}
LEAST_FREQUENCY = 1e-16  # Hz


def controlled(seat: Seat, port: str = "cntl_in") -> Expr:
    """The frequency that an input asks for [Hz]: straight lines, those at the ends go on; never below zero."""
    ctx = seat.ctx
    wanted = seat.curve(seat.read(port), seat["cntl_array"], seat["freq_array"])
    if min(seat["freq_array"]) == max(seat["freq_array"]):
        return wanted
    return ctx.max_(wanted, ctx.b.const(LEAST_FREQUENCY))


class Sine(CodeModel):
    name = "sine"
    what = "sine oscillator whose frequency follows its input"
    law = "out goes between out_low and out_high as sin(2 pi of the integral of the frequency)"
    ports = (reading("cntl_in"), driving("out"))
    parameters = named(
        **CONTROL,
        out_low=Word("lowest output", "", -1.0),
        out_high=Word("highest output", "", 1.0),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "freq_array")

    def build(self, seat: Seat) -> None:
        low, high = seat["out_low"], seat["out_high"]
        angle = 2.0 * math.pi * seat.phase(controlled(seat), 0.0)
        seat.drive("out", 0.5 * (high + low) + 0.5 * (high - low) * seat.ctx.b.call("sin", angle))


MODEL = Sine
