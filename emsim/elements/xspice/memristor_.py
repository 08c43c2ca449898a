"""memristor: a resistance that remembers what voltage has been across it, above a threshold.

    dR/dt = f(v) while R is between rmin and rmax,    f(v) = beta v + (alpha - beta)/2 (|v + vt| - |v - vt|)         (1)

Pershin and Di Ventra, "SPICE model of memristive devices with threshold", Radioengineering 22 (2013) 485.
"""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named


class Memristor(CodeModel):
    name = "memristor"
    what = "resistance that remembers"
    law = "i = v/R, dR/dt = beta v beyond the threshold and alpha v below it, between rmin and rmax"
    ports = (both("memris", "gd"),)
    parameters = named(
        rmin=Word("least resistance", "Ohm", 10.0, least=1e-9),
        rmax=Word("largest resistance", "Ohm", 1e4),
        rinit=Word("resistance at the start", "Ohm", 7e3),
        alpha=Word("how fast it changes below the threshold", "Ohm/(V s)", 0.0),
        beta=Word("how fast it changes beyond", "Ohm/(V s)", 1e13),
        vt=Word("threshold", "V", 1.6),
    )

    def check(self, seat: Seat) -> None:
        if not seat["rmin"] <= seat["rinit"] <= seat["rmax"]:
            seat.wrong(f"rinit={seat['rinit']:g} is not between rmin and rmax", "rinit")

    def build(self, seat: Seat) -> None:
        ctx, b, v = seat.ctx, seat.ctx.b, seat.read("memris")
        alpha, beta, vt = seat["alpha"], seat["beta"], seat["vt"]
        rate = beta * v + 0.5 * (alpha - beta) * (ctx.abs_(v + vt) - ctx.abs_(v - vt))
        state = b.unknown(f"{seat.name}#r", "coordinate", "Ohm", seat["rinit"])
        r = b.x(state)
        # at a bound it stands while what changes it goes further that way
        up = ctx.flag(rate)
        for bound, further in ((seat["rmax"], up), (seat["rmin"], 1.0 - up)):
            beyond = ctx.kink(r - bound if bound == seat["rmax"] else bound - r)
            rate = b.select(beyond * further, b.const(0.0), rate)
        b.c(state, state, 1.0)
        b.add_f(state, -rate)
        seat.drive("memris", v / r)


MODEL = Memristor
