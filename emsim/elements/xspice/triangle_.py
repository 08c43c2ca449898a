"""triangle: an oscillator of straight lines whose frequency follows its input."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading
from .pwl_ import pairs
from .sine_ import CONTROL, controlled


class Triangle(CodeModel):
    name = "triangle"
    what = "triangle oscillator whose frequency follows its input"
    law = "out rises from out_low to out_high in the duty_cycle of a period, and falls in the rest"
    ports = (reading("cntl_in"), driving("out"))
    parameters = named(
        **CONTROL,
        out_low=Word("lowest output", "", -1.0),
        out_high=Word("highest output", "", 1.0),
        duty_cycle=Word("part of the period in which it rises", "", 0.5, least=1e-6, most=0.999999),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "freq_array")

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        low, high, duty = seat["out_low"], seat["out_high"], seat["duty_cycle"]
        phase = seat.phase(controlled(seat), 0.0)
        part = phase - ctx.floor_(phase)
        share = ctx.b.select(ctx.kink(part - duty), (1.0 - part) * (1.0 / (1.0 - duty)), part * (1.0 / duty))
        seat.drive("out", low + (high - low) * share)


MODEL = Triangle
