"""mult."""

from __future__ import annotations

from .base import CodeModel, Seat, driving, reading
from .summer_ import Summer, terms


class Mult(CodeModel):
    name = "mult"
    what = "product"
    law = "out = out_gain (product of in_gain (in + in_offset)) + out_offset"
    ports = (reading("in", is_list=True, least=2), driving("out"))
    parameters = Summer.parameters

    def build(self, seat: Seat) -> None:
        product = seat.ctx.b.const(1.0)
        for term in terms(seat):
            product = product * term
        seat.drive("out", seat["out_gain"] * product + seat["out_offset"])


MODEL = Mult
