"""adc_bridge: voltages become digital levels."""

from __future__ import annotations

from . import PARTS
from .base import READS, Seat, driving, reading
from .digital import Part, words


class AdcBridge(Part):
    name = "adc_bridge"
    what = PARTS["adc_bridge"][1]
    law = "0 up to in_low, 1 from in_high on, undefined between; crossings are located exactly"
    ports = (reading("in", *READS, is_list=True), driving("out", "d", is_list=True))
    parameters = words(PARTS["adc_bridge"][3])

    def build(self, seat: Seat) -> None:
        width = min(seat.width("in"), seat.width("out"))
        if seat.width("in") != seat.width("out"):
            seat.wrong(f"{seat.width('in')} voltages and {seat.width('out')} digital nodes")
        sensed = [
            (seat.sensed(seat.read("in", k), seat["in_low"], seat["in_high"]), False) for k in range(width)
        ]
        out = [seat.digital("out", k) for k in range(width)]
        delays = {key: [seat[key]] for key in ("rise_delay", "fall_delay")}
        seat.part(self.name, [sensed, out], delays)


MODEL = AdcBridge
