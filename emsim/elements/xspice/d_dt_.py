"""d_dt: differentiator."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading
from .limit_ import limited, ordered


class Differentiator(CodeModel):
    name = "d_dt"
    what = "differentiator"
    law = "out = gain d/dt in + out_offset, between its limits"
    ports = (reading("in"), driving("out"))
    parameters = named(
        gain=Word("gain", "s", 1.0),
        out_offset=Word("added to the output", "", 0.0),
        out_lower_limit=Word("the output's least value; none: no limit"),
        out_upper_limit=Word("the output's largest value; none: no limit"),
        limit_range=Word("on either side of a limit the output turns within so much", "", 1e-6),
    )

    def check(self, seat: Seat) -> None:
        ordered(seat)

    def build(self, seat: Seat) -> None:
        slope = seat.ctx.ddt(seat.read("in"), f"{seat.name}#slope")
        value = seat["gain"] * slope + seat["out_offset"]
        low, high = seat["out_lower_limit"], seat["out_upper_limit"]
        seat.drive("out", limited(seat, value, low, high, seat["limit_range"]))


MODEL = Differentiator
