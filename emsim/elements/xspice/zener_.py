"""zener."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, flag, named

VOLTAGE = 0.026  # V, of the forward exponential at any temperature, as in ngspice


class Zener(CodeModel):
    name = "zener"
    what = "zener diode"
    law = (
        "i = i_sat (exp(v/(n_forward 26 mV)) - 1) + i_rev v/v_breakdown "
        "- i_breakdown exp(-(v + v_breakdown)/(i_breakdown r_breakdown))"
    )
    ports = (both("z", "gd"),)
    parameters = named(
        v_breakdown=Word("breakdown voltage", "V", None, least=1e-6),
        i_breakdown=Word("current at breakdown", "A", 2e-2, least=1e-9),
        i_sat=Word("saturation current", "A", 1e-12, least=1e-15),
        n_forward=Word("emission coefficient", "", 1.0, least=0.1),
        r_breakdown=Word("slope at breakdown", "Ohm", 1.0, least=1e-30),
        i_rev=Word("leakage at the breakdown voltage", "A", 1e-6),
        limit_switch=flag("limiting of Newton's steps in ngspice; has no effect"),
    )

    def check(self, seat: Seat) -> None:
        if seat["v_breakdown"] is None:
            seat.wrong("v_breakdown= is missing")

    def build(self, seat: Seat) -> None:
        if seat["v_breakdown"] is None:
            return
        b, v = seat.ctx.b, seat.read("z")
        knee, i = seat["v_breakdown"], seat["i_breakdown"]
        forward = seat["i_sat"] * (b.call("exp", v * (1.0 / (seat["n_forward"] * VOLTAGE))) - 1.0)
        back = i * b.call("exp", (v + knee) * (-1.0 / (i * seat["r_breakdown"])))
        seat.drive("z", forward + (seat["i_rev"] / knee) * v - back)


MODEL = Zener
