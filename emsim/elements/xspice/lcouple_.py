"""lcouple: a winding between a circuit and a magnetic one."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named


class Winding(CodeModel):
    name = "lcouple"
    what = "winding on a core"
    law = "magnetomotive force = num_turns i, v = num_turns d/dt flux; on the magnetic side forces are voltages, flux is current"
    ports = (both("l", "hd"), both("mmf_out", "hd"))
    parameters = named(num_turns=Word("turns", "", 1.0))

    def build(self, seat: Seat) -> None:
        turns = seat["num_turns"]
        # the flux that goes into the magnetic circuit comes out of this one's first node
        slope = seat.ctx.ddt(-turns * seat.read("mmf_out"), f"{seat.name}#flux")
        seat.drive("l", slope)
        seat.drive("mmf_out", turns * seat.read("l"))


MODEL = Winding
