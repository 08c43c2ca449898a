"""What a switch is told whose resistance follows its control: aswitch, pswitch."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, flag, named


class Controlled(CodeModel):
    parameters = named(
        cntl_off=Word("control where it is off", "", 0.0),
        cntl_on=Word("control where it is on", "", 1.0),
        r_off=Word("resistance when off", "Ohm", 1e12),
        r_on=Word("resistance when on", "Ohm", 1.0),
        log=flag("the law is that of the resistance's logarithm", True),
    )

    def check(self, seat: Seat) -> None:
        if seat["cntl_on"] == seat["cntl_off"]:
            seat.wrong("cntl_on and cntl_off are equal", "cntl_on")
        if min(seat["r_on"], seat["r_off"]) <= 0.0:
            seat.wrong("r_on and r_off must be positive", "r_on")
