"""dac_bridge: digital levels become voltages, in straight lines from one to the next."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, named, reading


class DacBridge(CodeModel):
    name = "dac_bridge"
    what = "bridge from digital nodes to voltages"
    law = "follows its level at the slope (out_high - out_low)/t_rise upwards, (out_high - out_low)/t_fall downwards"
    ports = (reading("in", "d", is_list=True), driving("out", is_list=True))
    parameters = named(
        out_low=Word("output at 0", "", 0.0),
        out_high=Word("output at 1", "", 1.0),
        out_undef=Word("output where the level is undefined; otherwise the mean of out_low and out_high"),
        input_load=Word(),
        t_rise=Word("time from out_low to out_high", "s", 1e-9, least=1e-12),
        t_fall=Word("time from out_high to out_low", "s", 1e-9, least=1e-12),
    )

    def check(self, seat: Seat) -> None:
        # a voltage between ground and ground has no row: as a current it moves nothing either, as in ngspice
        for end in seat.at["out"]:
            if end.type in ("v", "vd") and end.nodes[0] == end.nodes[1]:
                end.type = "i"

    def build(self, seat: Seat) -> None:
        if seat.width("in") != seat.width("out"):
            return seat.wrong(f"{seat.width('in')} digital nodes and {seat.width('out')} voltages")
        b = seat.ctx.b
        low, high = seat["out_low"], seat["out_high"]
        undefined = seat["out_undef"] if seat.given("out_undef") else 0.5 * (low + high)
        for k in range(seat.width("in")):
            levels, times = (low, high, undefined), (seat["t_rise"], seat["t_fall"])
            ramp = b.digital_ramp(seat.digital("in", k), levels, times)
            seat.drive("out", b.wave_expr(ramp), k)
        return None


MODEL = DacBridge
