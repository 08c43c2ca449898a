"""aswitch: a resistance by a control, which nothing limits: beyond cntl_on and cntl_off it goes on, as in ngspice."""

from __future__ import annotations

import math

from .base import Seat, both, reading
from .switched import Controlled

LEAST = 1e-9  # Ohm, of a line that would go below


class AnalogueSwitch(Controlled):
    name = "aswitch"
    what = "switch whose resistance follows its control"
    law = "r_off at cntl_off, r_on at cntl_on, a line of the logarithm or (log=FALSE) of the resistance through both"
    ports = (reading("cntl_in"), both("out", "gd"))

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
