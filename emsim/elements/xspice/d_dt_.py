"""d_dt: differentiator."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading
from .limit_ import FREE, limited, ordered


class Differentiator(CodeModel):
    name = "d_dt"
    what = "differentiator"
    law = "out = gain d/dt in + out_offset, between its limits"
    ports = (reading("in"), driving("out"))
    parameters = named(
        gain=Word("gain", "s", 1.0),
        out_offset=Word("added to the output", "", 0.0),
        **FREE,
    )

    def check(self, seat: Seat) -> None:
        ordered(seat)

    def build(self, seat: Seat) -> None:
        slope = seat.ctx.ddt(seat.read("in"), f"{seat.name}#slope")
        value = seat["gain"] * slope + seat["out_offset"]
        low, high = seat["out_lower_limit"], seat["out_upper_limit"]
        seat.drive("out", limited(seat, value, low, high, seat["limit_range"]))


MODEL = Differentiator
