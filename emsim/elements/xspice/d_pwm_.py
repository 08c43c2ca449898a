"""d_pwm: a digital clock whose duty follows a voltage."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, numbers, reading
from .d_osc_ import DELAYS, clock
from .pwl_ import pairs
from .square_ import is_within


class Modulator(CodeModel):
    name = "d_pwm"
    what = "digital clock whose duty follows its input"
    law = "each period out is 0 first and 1 for a duty of dc_array over cntl_array at its end; events are located exactly"
    ports = (reading("cntl_in"), driving("out", "d"))
    parameters = named(
        cntl_array=numbers("inputs, ascending", "", (-1.0, 1.0)),
        dc_array=numbers("duties there, straight lines between", "", (0.0, 1.0)),
        frequency=Word("frequency", "Hz", 1e6, least=1e-6),
        init_phase=Word("phase at the start", "deg", 0.0, least=-180.0, most=360.0),
        **DELAYS,
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "dc_array")

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        duty = ctx.clamp(seat.curve(seat.read("cntl_in"), seat["cntl_array"], seat["dc_array"]), 0.0, 1.0)
        phase = seat["frequency"] * ctx.b.time() + seat["init_phase"] / 360.0
        clock(seat, is_within(seat, phase, duty))


MODEL = Modulator
