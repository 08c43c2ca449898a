"""divide."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, named, reading


class Divide(CodeModel):
    name = "divide"
    what = "quotient"
    law = "out = out_gain num_gain (num + num_offset) / (den_gain (den + den_offset)) + out_offset, the divisor kept from zero"
    ports = (reading("num"), reading("den"), driving("out"))
    parameters = named(
        num_offset=Word("added to the dividend", "", 0.0),
        num_gain=Word("gain of the dividend", "", 1.0),
        den_offset=Word("added to the divisor", "", 0.0),
        den_gain=Word("gain of the divisor", "", 1.0),
        den_lower_limit=Word("the divisor's least magnitude", "", 1e-10, least=1e-10),
        den_domain=Word("above its least magnitude it turns smoothly within so much", "", 1e-10, least=1e-10),
        fraction=flag("den_domain is a part of the limit"),
        out_gain=Word("gain of the quotient", "", 1.0),
        out_offset=Word("added to the output", "", 0.0),
    )

    def build(self, seat: Seat) -> None:
        ctx, b = seat.ctx, seat.ctx.b
        num = seat["num_gain"] * (seat.read("num") + seat["num_offset"])
        den = seat["den_gain"] * (seat.read("den") + seat["den_offset"])
        limit = seat["den_lower_limit"]
        domain = seat["den_domain"] * (limit if seat["fraction"] else 1.0)
        positive = ctx.flag(den) if den.value is None else b.const(float(den.value >= 0.0))
        size = b.select(positive, den, -den)
        # constant up to limit - domain, a straight line from limit + domain on, a parabola between
        s = size - (limit - domain)
        curve = limit + (1.0 / (4.0 * domain)) * (s * s)
        kept = b.select(ctx.kink(size - (limit + domain)), size, b.select(ctx.kink(s), curve, b.const(limit)))
        seat.drive("out", seat["out_gain"] * (num / b.select(positive, kept, -kept)) + seat["out_offset"])


MODEL = Divide
