"""pswitch: a resistance by a control, smooth between two ends, as PSpice has it."""

from __future__ import annotations

import math

from .base import Seat, Word, both, named, reading
from .switched import Controlled


class SmoothSwitch(Controlled):
    name = "pswitch"
    what = "switch with a smooth resistance, as in PSpice"
    law = "the resistance is a cubic of the control between r_off at cntl_off and r_on at cntl_on (log=TRUE: its logarithm)"
    ports = (reading("cntl_in", "gd", "g", "vd", "v", "id", "i"), both("out", "gd"))

    parameters = named(
        **Controlled.parameters,
        r_cntl_in=Word("resistance between the ends of cntl_in", "Ohm", 1e12),
    )

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        low, high, off, on = seat["cntl_off"], seat["cntl_on"], seat["r_off"], seat["r_on"]
        x = ctx.clamp((seat.read("cntl_in") - 0.5 * (low + high)) * (1.0 / (high - low)), -0.5, 0.5)
        share = 1.5 * x - 2.0 * x * x * x
        if seat["log"]:
            resistance = ctx.b.call("exp", 0.5 * math.log(on * off) + math.log(on / off) * share)
        else:
            resistance = 0.5 * (on + off) + (on - off) * share
        if seat.at["cntl_in"][0].type in ("g", "gd"):
            seat.drive("cntl_in", seat.read("cntl_in") * (1.0 / seat["r_cntl_in"]))
        seat.drive("out", seat.read("out") / resistance)


MODEL = SmoothSwitch
