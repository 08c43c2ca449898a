"""core: a magnetic core, flux over magnetomotive force."""

from __future__ import annotations

from itertools import pairwise

from .base import CodeModel, Seat, Word, both, flag, named, numbers
from .hyst_ import Hysteresis, two_lines
from .pwl_ import pairs


class Core(CodeModel):
    name = "core"
    what = "magnetic core"
    law = (
        "flux = area B(H), H = magnetomotive force / length; the voltage is the force [A turns], the current the flux [Wb]. "
        "mode=2: hyst's two lines, from force to flux, area and length unread as in ngspice; a core with its losses: emsim help K"
    )
    ports = (both("mc", "gd"),)
    parameters = named(
        h_array=numbers("field strengths, ascending", "A/m"),
        b_array=numbers("flux densities there", "T"),
        area=Word("cross-section", "m^2"),
        length=Word("mean length of the path", "m"),
        input_domain=Word("corners are rounded so far on either side", "", 0.01),
        fraction=flag("input_domain is a part of the shorter line beside a corner", True),
        mode=Word("1: straight lines through points, 2: hysteresis", "", 1.0),
        in_low=Hysteresis.parameters["in_low"],
        in_high=Hysteresis.parameters["in_high"],
        hyst=Hysteresis.parameters["hyst"],
        out_lower_limit=Hysteresis.parameters["out_lower_limit"],
        out_upper_limit=Hysteresis.parameters["out_upper_limit"],
    )

    def check(self, seat: Seat) -> None:
        if seat["mode"] == 2.0:
            Hysteresis().check(seat)
            return
        if seat["mode"] != 1.0:
            seat.wrong(f"mode={seat['mode']:g} is not supported", "mode", "1, or 2 for hysteresis")
            return
        pairs(seat, "h_array", "b_array")
        for key in ("area", "length"):
            if not seat[key] or seat[key] <= 0.0:
                seat.wrong(f"{key}= is missing, or not positive", key)

    def build(self, seat: Seat) -> None:
        if seat["mode"] == 2.0:
            seat.drive("mc", two_lines(seat, seat.read("mc")))
            return
        hs, bs = seat["h_array"], seat["b_array"]
        shortest = min(b - a for a, b in pairwise(hs))
        share = seat["input_domain"] if seat["fraction"] else min(seat["input_domain"] / shortest, 0.5)
        field = seat.read("mc") * (1.0 / seat["length"])
        seat.drive("mc", seat["area"] * seat.curve(field, hs, bs, False, share))


MODEL = Core
