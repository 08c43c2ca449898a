"""summer."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, numbers, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr


def terms(seat: Seat) -> list[Expr]:
    """gain (in + offset) of every input."""
    return [
        seat.entry("in_gain", k, 1.0) * (x + seat.entry("in_offset", k, 0.0))
        for k, x in enumerate(seat.all("in"))
    ]


class Summer(CodeModel):
    name = "summer"
    what = "sum"
    law = "out = out_gain (sum of in_gain (in + in_offset)) + out_offset"
    ports = (reading("in", is_list=True, least=2), driving("out"))
    parameters = named(
        in_offset=numbers("added to each input"),
        in_gain=numbers("gain of each input, 1 where none is given"),
        out_gain=Word("gain of the sum", "", 1.0),
        out_offset=Word("added to the output", "", 0.0),
    )

    def build(self, seat: Seat) -> None:
        total = sum(terms(seat), seat.ctx.b.const(0.0))
        seat.drive("out", seat["out_gain"] * total + seat["out_offset"])


MODEL = Summer
