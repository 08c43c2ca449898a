"""slew: follows its input no faster than its slopes allow."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading

# it lags by this part of `range` at most, where the slope is the input's own
LAG = 1e-3


class Slew(CodeModel):
    name = "slew"
    what = "follower of limited slope"
    law = "out follows in, upwards by rise_slope at most, downwards by fall_slope"
    ports = (reading("in"), driving("out"))
    parameters = named(
        rise_slope=Word("largest slope upwards", "1/s", 1e9, least=1e-30),
        fall_slope=Word("largest slope downwards", "1/s", 1e9, least=1e-30),
        range=Word("so near to the input it turns to follow it", "", 0.1, least=1e-12),
    )

    def build(self, seat: Seat) -> None:
        ctx, b = seat.ctx, seat.ctx.b
        state = b.unknown(f"{seat.name}#out", "node", "", 0.0)
        out, zone = b.x(state), LAG * seat["range"]
        gap = (seat.read("in") - out) * (1.0 / zone)
        up, down = seat["rise_slope"], seat["fall_slope"]
        slope = b.select(ctx.kink(gap), up * ctx.min_(gap, b.const(1.0)), down * ctx.max_(gap, b.const(-1.0)))
        b.c(state, state, 1.0 / max(up, down))
        b.add_f(state, -slope * (1.0 / max(up, down)))
        seat.drive("out", out)


MODEL = Slew
