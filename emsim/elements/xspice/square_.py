"""square: an oscillator of two levels whose frequency follows its input."""

from __future__ import annotations

import math

from .base import CodeModel, Seat, Word, driving, named, reading
from .pwl_ import pairs
from .sine_ import CONTROL, controlled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr


def is_within(seat: Seat, phase: Expr, share: Expr | float) -> Expr:
    """Made of flags: is a phase, in periods, within that share at the end of its period?

    Each flag turns every half period, however small the share is, so that no step passes over it.
    """
    ctx = seat.ctx
    begins = ctx.flag(ctx.b.call("sin", 2.0 * math.pi * (phase + share)))
    # false where the period begins, so that it begins with what is low
    off = ctx.flag(-ctx.b.call("sin", 2.0 * math.pi * phase))
    small, large = begins * off, begins + off - begins * off
    if isinstance(share, (int, float)):
        return large if share > 0.5 else small
    return ctx.b.select(ctx.kink(share - 0.5), large, small)


class Square(CodeModel):
    name = "square"
    what = "square oscillator whose frequency follows its input"
    law = "each period out is low first and high for the duty_cycle at its end, in straight lines of rise_time and fall_time"
    ports = (reading("cntl_in"), driving("out"))
    parameters = named(
        **CONTROL,
        out_low=Word("low output", "", -1.0),
        out_high=Word("high output", "", 1.0),
        duty_cycle=Word("part of the period in which it is high", "", 0.5, least=1e-6, most=0.999999),
        rise_time=Word("time of a rise", "s", 1e-9, least=1e-12),
        fall_time=Word("time of a fall", "s", 1e-9, least=1e-12),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "freq_array")

    def build(self, seat: Seat) -> None:
        b, duty = seat.ctx.b, seat["duty_cycle"]
        high = is_within(seat, seat.phase(controlled(seat), 0.0), duty)
        node, _ = b.digital_node(f"{seat.name}#high")
        b.digital_senses(node, high, b.const(0.0))
        ends = (seat["out_low"], seat["out_high"], seat["out_low"])
        ramp = b.digital_ramp((node, False), ends, (seat["rise_time"], seat["fall_time"]))
        seat.drive("out", b.wave_expr(ramp))


MODEL = Square
