"""pswitch: a resistance by a control, smooth between two ends, as PSpice has it."""

from __future__ import annotations

import math

from .base import CodeModel, Seat, Word, both, flag, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class SmoothSwitch(CodeModel):
    name = "pswitch"
    what = "switch with a smooth resistance, as in PSpice"
    law = "the resistance is a cubic of the control between r_off at cntl_off and r_on at cntl_on (log=TRUE: its logarithm)"
    ports = (reading("cntl_in", "vd", "id", "v", "i"), both("out", "gd"))
    parameters: ClassVar[dict[str, Word]] = {
        "cntl_off": Word("control where it is off", "", 0.0),
        "cntl_on": Word("control where it is on", "", 1.0),
        "r_off": Word("resistance when off", "Ohm", 1e12),
        "r_on": Word("resistance when on", "Ohm", 1.0),
        "log": flag("the logarithm of the resistance is the cubic", True),
    }

    def check(self, seat: Seat) -> None:
        if seat["cntl_on"] == seat["cntl_off"]:
            seat.wrong("cntl_on and cntl_off are equal", "cntl_on")
        if min(seat["r_on"], seat["r_off"]) <= 0.0:
            seat.wrong("r_on and r_off must be positive", "r_on")

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        low, high, off, on = seat["cntl_off"], seat["cntl_on"], seat["r_off"], seat["r_on"]
        x = ctx.clamp((seat.read("cntl_in") - 0.5 * (low + high)) * (1.0 / (high - low)), -0.5, 0.5)
        share = 1.5 * x - 2.0 * x * x * x
        if seat["log"]:
            resistance = ctx.b.call("exp", 0.5 * math.log(on * off) + math.log(on / off) * share)
        else:
            resistance = 0.5 * (on + off) + (on - off) * share
        seat.drive("out", seat.read("out") / resistance)


MODEL = SmoothSwitch
