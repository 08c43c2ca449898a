"""ilimit: an amplifier whose current is limited, between the rails that feed it."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, both, named, reading
from .limit_ import limited


class CurrentLimit(CodeModel):
    name = "ilimit"
    what = "amplifier with limited current and rails"
    law = (
        "gain (in + in_offset) between the rails, behind r_out_source or r_out_sink; the current within the limits comes from "
        "pos_pwr or goes to neg_pwr"
    )
    ports = (
        reading("in"),
        both("pos_pwr", "g", "gd", is_open=True),
        both("neg_pwr", "g", "gd", is_open=True),
        both("out", "g", "gd"),
    )
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "", 1.0),
        r_out_source=Word("resistance of the output that gives current", "Ohm", 1.0, least=1e-9),
        r_out_sink=Word("resistance of the output that takes current", "Ohm", 1.0, least=1e-9),
        i_limit_source=Word("most current that it gives; none: no limit", "A"),
        i_limit_sink=Word("most current that it takes; none: no limit", "A"),
        v_pwr_range=Word("at a rail the output turns within so much", "V", 1e-6),
        i_source_range=Word("at the limit of what it gives the current turns within so much", "A", 1e-9),
        i_sink_range=Word("at the limit of what it takes the current turns within so much", "A", 1e-9),
        r_out_domain=Word(),
    )

    def build(self, seat: Seat) -> None:
        ctx, b = seat.ctx, seat.ctx.b
        rails = [None if seat.is_open(port) else seat.read(port) for port in ("neg_pwr", "pos_pwr")]
        wanted = seat["gain"] * (seat.read("in") + seat["in_offset"])
        inner = limited(seat, wanted, rails[0], rails[1], seat["v_pwr_range"])
        over = inner - seat.read("out")
        gives = ctx.kink(over)
        free = over * b.select(gives, b.const(1.0 / seat["r_out_source"]), b.const(1.0 / seat["r_out_sink"]))
        most, least = seat["i_limit_source"], seat["i_limit_sink"]
        given = limited(seat, free, None, most, seat["i_source_range"])
        taken = limited(seat, free, None if least is None else -least, None, seat["i_sink_range"])
        current = b.select(gives, given, taken)
        seat.drive("out", -current)
        for port, share in (
            ("pos_pwr", b.select(gives, current, b.const(0.0))),
            ("neg_pwr", b.select(gives, b.const(0.0), current)),
        ):
            if not seat.is_open(port):
                seat.drive(port, share)


MODEL = CurrentLimit
