"""int: integrator."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading
from .limit_ import FREE, ordered


class Integrator(CodeModel):
    name = "int"
    what = "integrator"
    law = "d/dt out = gain (in + in_offset), out_ic at the start; stops at its limits"
    ports = (reading("in"), driving("out"))
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "1/s", 1.0),
        **FREE,
        out_ic=Word("output at the start", "", 0.0),
    )

    def check(self, seat: Seat) -> None:
        ordered(seat)

    def build(self, seat: Seat) -> None:
        ctx, b = seat.ctx, seat.ctx.b
        rate = seat["gain"] * (seat.read("in") + seat["in_offset"])
        state = b.unknown(f"{seat.name}#out", "coordinate", "", seat["out_ic"])
        at = b.x(state)
        driven = rate
        # at a limit it stands while what drives it goes further that way
        for limit, sign in ((seat["out_upper_limit"], 1.0), (seat["out_lower_limit"], -1.0)):
            if limit is not None:
                outside = ctx.kink(sign * (at - limit))
                further = ctx.flag(sign * driven)
                rate = b.select(outside * further, b.const(0.0), rate)
        b.c(state, state, 1.0)
        b.add_f(state, -rate)
        seat.drive("out", at)


MODEL = Integrator
