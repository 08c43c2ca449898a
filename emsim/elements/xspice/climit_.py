"""climit: a limiter whose limits are inputs."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading
from .limit_ import LIMITS, limited


class ControlledLimit(CodeModel):
    name = "climit"
    what = "limiter whose limits are inputs"
    law = "out = gain (in + in_offset), between cntl_lower + lower_delta and cntl_upper - upper_delta"
    ports = (reading("in"), reading("cntl_upper"), reading("cntl_lower"), driving("out"))
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "", 1.0),
        upper_delta=Word("the upper limit lies so far below its input", "", 0.0),
        lower_delta=Word("the lower limit lies so far above its input", "", 0.0),
        limit_range=LIMITS["limit_range"],
        fraction=LIMITS["fraction"],
    )

    def build(self, seat: Seat) -> None:
        low = seat.read("cntl_lower") + seat["lower_delta"]
        high = seat.read("cntl_upper") - seat["upper_delta"]
        reach = seat["limit_range"] * (high - low) if seat["fraction"] else seat["limit_range"]
        value = seat["gain"] * (seat.read("in") + seat["in_offset"])
        seat.drive("out", limited(seat, value, low, high, reach))


MODEL = ControlledLimit
