"""capacitoric: a capacitor with a voltage at the start."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named


class Capacitor(CodeModel):
    name = "capacitoric"
    what = "capacitor with a voltage at the start"
    law = "i = c d/dt v; the operating point holds the voltage at ic"
    ports = (both("cap", "hd"),)
    parameters = named(
        c=Word("capacitance", "F", None, least=1e-30),
        ic=Word("voltage at the start", "V", 0.0),
    )

    def check(self, seat: Seat) -> None:
        if seat["c"] is None:
            seat.wrong("c= is missing")

    def build(self, seat: Seat) -> None:
        if seat["c"] is not None:
            seat.drive(
                "cap", seat.ctx.idt(seat.read("cap") * (1.0 / seat["c"]), seat["ic"], f"{seat.name}#v")
            )


MODEL = Capacitor
