"""sidiode: straight lines of a diode."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named

LATER = ("epsilon", "revepsilon", "ilimit", "revilimit")


class SimpleDiode(CodeModel):
    name = "sidiode"
    what = "diode of straight lines"
    law = "roff up to vfwd, ron above; below -vrev rrev"
    ports = (both("ds", "gd"),)
    parameters = named(
        roff=Word("resistance when off", "Ohm", 1.0, least=1e-12),
        ron=Word("resistance when on", "Ohm", 1.0, least=1e-12),
        rrev=Word("resistance in breakdown", "Ohm", None),
        vfwd=Word("forward voltage", "V", 0.0),
        vrev=Word("breakdown voltage", "V", 1e30),
        **{key: Word("not supported", "", None) for key in LATER},
    )

    def check(self, seat: Seat) -> None:
        for key in LATER:
            if seat[key]:
                seat.wrong(f"{key}= is not supported", key)

    def build(self, seat: Seat) -> None:
        ctx, v = seat.ctx, seat.read("ds")
        on, off = 1.0 / seat["ron"], 1.0 / seat["roff"]
        back = 1.0 / (seat["rrev"] or seat["ron"])
        forward, reverse = seat["vfwd"], seat["vrev"]
        zero = ctx.b.const(0.0)
        current = off * v + (on - off) * ctx.max_(v - forward, zero)
        if reverse < 1e29:
            current = current + (back - off) * ctx.min_(v + reverse, zero)
        seat.drive("ds", current)


MODEL = SimpleDiode
