"""aswitch: a resistance by a control, which nothing limits: beyond cntl_on and cntl_off it goes on, as in ngspice."""

from __future__ import annotations

import math

from .base import CodeModel, Seat, Word, both, flag, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


LEAST = 1e-9  # Ohm, of a line that would go below


class AnalogueSwitch(CodeModel):
    name = "aswitch"
    what = "switch whose resistance follows its control"
    law = "r_off at cntl_off, r_on at cntl_on, a line of the logarithm or (log=FALSE) of the resistance through both"
    ports = (reading("cntl_in"), both("out", "gd"))
    parameters: ClassVar[dict[str, Word]] = {
        "cntl_off": Word("control where it is off", "", 0.0),
        "cntl_on": Word("control where it is on", "", 1.0),
        "r_off": Word("resistance when off", "Ohm", 1e12),
        "r_on": Word("resistance when on", "Ohm", 1.0),
        "log": flag("between the two the logarithm of the resistance is linear", True),
    }

    def check(self, seat: Seat) -> None:
        if seat["cntl_on"] == seat["cntl_off"]:
            seat.wrong("cntl_on and cntl_off are equal", "cntl_on")
        if min(seat["r_on"], seat["r_off"]) <= 0.0:
            seat.wrong("r_on and r_off must be positive", "r_on")

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        on, off = seat["r_on"], seat["r_off"]
        share = (seat.read("cntl_in") - seat["cntl_off"]) * (1.0 / (seat["cntl_on"] - seat["cntl_off"]))
        if seat["log"]:
            resistance = ctx.b.call("exp", math.log(off) + (math.log(on) - math.log(off)) * share)
        else:
            resistance = ctx.max_(off + (on - off) * share, ctx.b.const(LEAST))
        seat.drive("out", seat.read("out") / resistance)


MODEL = AnalogueSwitch
