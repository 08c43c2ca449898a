"""gain."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading


class Gain(CodeModel):
    name = "gain"
    what = "gain"
    law = "out = gain (in + in_offset) + out_offset"
    ports = (reading("in"), driving("out"))
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "", 1.0),
        out_offset=Word("added to the output", "", 0.0),
    )

    def build(self, seat: Seat) -> None:
        seat.drive("out", seat["gain"] * (seat.read("in") + seat["in_offset"]) + seat["out_offset"])


MODEL = Gain
