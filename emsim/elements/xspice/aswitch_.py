"""aswitch: a resistance by a control, that goes on beyond cntl_on and cntl_off, but for limit=TRUE, as in ngspice."""

from __future__ import annotations

import math

from .base import Seat, both, flag, named, reading
from .switched import Controlled

TYPE_CHECKING = False
if TYPE_CHECKING:
    pass

LEAST = 1e-9  # Ohm, of a resistance that would go below


class AnalogueSwitch(Controlled):
    name = "aswitch"
    what = "switch whose resistance follows its control"
    law = "r_off at cntl_off, r_on at cntl_on, a line of the logarithm or (log=FALSE) of the resistance through both"
    ports = (reading("cntl_in"), both("out", "gd"))
    parameters = named(
        **Controlled.parameters,
        limit=flag("the resistance stays between r_on and r_off"),
    )

    def build(self, seat: Seat) -> None:
        ctx = seat.ctx
        on, off = seat["r_on"], seat["r_off"]
        share = (seat.read("cntl_in") - seat["cntl_off"]) * (1.0 / (seat["cntl_on"] - seat["cntl_off"]))
        if seat["limit"]:
            share = ctx.clamp(share, 0.0, 1.0)
        if seat["log"]:
            logarithm = math.log(off) + (math.log(on) - math.log(off)) * share
            resistance = ctx.b.call("exp", ctx.max_(logarithm, ctx.b.const(math.log(LEAST))))
        else:
            resistance = ctx.max_(off + (on - off) * share, ctx.b.const(LEAST))
        seat.drive("out", seat.read("out") / resistance)


MODEL = AnalogueSwitch
