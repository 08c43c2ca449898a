"""potentiometer."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, flag, named


class Potentiometer(CodeModel):
    name = "potentiometer"
    what = "potentiometer"
    law = "r position from r0 to the wiper, the rest from there to r1; log=TRUE: r 10^(-position log_multiplier)"
    ports = (both("r0", "g", "gd"), both("wiper", "g", "gd"), both("r1", "g", "gd"))
    parameters = named(
        position=Word("of the wiper, 0 at r0, 1 at r1", "", 0.5, least=0.0, most=1.0),
        log=flag("logarithmic"),
        r=Word("whole resistance", "Ohm", 1e5, least=1e-6),
        log_multiplier=Word("decades between the ends of a logarithmic one", "", 1.0),
    )

    def build(self, seat: Seat) -> None:
        whole, at = seat["r"], seat["position"]
        first = whole * (10.0 ** (-at * seat["log_multiplier"]) if seat["log"] else at)
        least = 1e-9 * whole  # of a wiper at an end
        ends = [seat.read(port) for port in ("r0", "wiper", "r1")]
        one = (ends[0] - ends[1]) * (1.0 / max(first, least))
        other = (ends[1] - ends[2]) * (1.0 / max(whole - first, least))
        seat.drive("r0", one)
        seat.drive("wiper", other - one)
        seat.drive("r1", -other)


MODEL = Potentiometer
