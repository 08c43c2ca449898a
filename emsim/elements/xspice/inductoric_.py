"""inductoric: an inductor with a current at the start."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named


class Inductor(CodeModel):
    name = "inductoric"
    what = "inductor with a current at the start"
    law = "v = l d/dt i; the operating point holds the current at ic"
    ports = (both("ind", "gd"),)
    parameters = named(
        l=Word("inductance", "H", None, least=1e-30),
        ic=Word("current at the start", "A", 0.0),
    )

    def check(self, seat: Seat) -> None:
        if seat["l"] is None:
            seat.wrong("l= is missing")

    def build(self, seat: Seat) -> None:
        if seat["l"] is not None:
            seat.drive(
                "ind", seat.ctx.idt(seat.read("ind") * (1.0 / seat["l"]), seat["ic"], f"{seat.name}#i")
            )


MODEL = Inductor
