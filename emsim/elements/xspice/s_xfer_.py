"""s_xfer: a transfer function of s, in the controller's canonical form.

The operating point holds its integrators at int_ic, as in ngspice: a constant input does not make itself felt there.
"""

from __future__ import annotations

from ..transfer import chain
from .base import CodeModel, Seat, Word, driving, named, numbers, reading


class TransferFunction(CodeModel):
    name = "s_xfer"
    what = "transfer function"
    law = "out = gain num(s)/den(s) (in + in_offset), coefficients from the highest power of s/denormalized_freq on"
    ports = (reading("in"), driving("out"))
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "", 1.0),
        num_coeff=numbers("of the numerator, highest power first"),
        den_coeff=numbers("of the denominator, highest power first"),
        int_ic=numbers(
            "of the integrators at the operating point, that of the highest power first", "", (0.0,)
        ),
        denormalized_freq=Word("the coefficients are of s divided by this", "rad/s", 1.0),
    )

    def check(self, seat: Seat) -> None:
        num, den = seat["num_coeff"], seat["den_coeff"]
        if not num or not den:
            seat.wrong("num_coeff and den_coeff must be given", "", "write num_coeff=[1] den_coeff=[1 1]")
        elif len(num) > len(den):
            seat.wrong("the numerator's degree is above the denominator's", "num_coeff")
        elif den[0] == 0.0:
            seat.wrong("the denominator's first coefficient is zero", "den_coeff")

    def build(self, seat: Seat) -> None:
        n, w = len(seat["den_coeff"]) - 1, seat["denormalized_freq"]
        scales = [w**-k for k in range(n + 1)]
        den, num = (
            [c / seat["den_coeff"][0] * scale for c, scale in zip(reversed(seat[key]), scales, strict=False)]
            for key in ("den_coeff", "num_coeff")
        )
        u = seat["gain"] * (seat.read("in") + seat["in_offset"])
        # int_ic begins with the highest derivative but one
        starts = [seat.entry("int_ic", n - 1 - k, 0.0) for k in range(n)]
        z = chain(seat.ctx, seat.name, u, den, scales, ("coordinate", ""), starts)
        terms = (c / scale * term for c, scale, term in zip(num, scales, z, strict=False))
        seat.drive("out", sum(terms, seat.ctx.b.const(0.0)))


MODEL = TransferFunction
