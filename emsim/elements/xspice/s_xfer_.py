"""s_xfer: a transfer function of s, in the controller's canonical form.

The operating point holds its integrators at int_ic, as in ngspice: a constant input does not make itself felt there.
"""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, numbers, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class TransferFunction(CodeModel):
    name = "s_xfer"
    what = "transfer function"
    law = "out = gain num(s)/den(s) (in + in_offset), coefficients from the highest power of s/denormalized_freq on"
    ports = (reading("in"), driving("out"))
    parameters: ClassVar[dict[str, Word]] = {
        "in_offset": Word("added to the input", "", 0.0),
        "gain": Word("gain", "", 1.0),
        "num_coeff": numbers("of the numerator, highest power first"),
        "den_coeff": numbers("of the denominator, highest power first"),
        "int_ic": numbers(
            "of the integrators at the operating point, that of the highest power first", "", (0.0,)
        ),
        "denormalized_freq": Word("the coefficients are of s divided by this", "rad/s", 1.0),
    }

    def check(self, seat: Seat) -> None:
        num, den = seat["num_coeff"], seat["den_coeff"]
        if not num or not den:
            seat.wrong("num_coeff and den_coeff must be given", "", "write num_coeff=[1] den_coeff=[1 1]")
        elif len(num) > len(den):
            seat.wrong("the numerator's degree is above the denominator's", "num_coeff")
        elif den[0] == 0.0:
            seat.wrong("the denominator's first coefficient is zero", "den_coeff")

    def build(self, seat: Seat) -> None:
        b = seat.ctx.b
        den = [a / seat["den_coeff"][0] for a in seat["den_coeff"]]
        num = [c / seat["den_coeff"][0] for c in seat["num_coeff"]]
        num = [0.0] * (len(den) - len(num)) + num
        u = seat["gain"] * (seat.read("in") + seat["in_offset"])
        n, w = len(den) - 1, seat["denormalized_freq"]
        # states of a chain of integrators, the first is the highest derivative but one
        x = [b.unknown(f"{seat.name}#{k}", "coordinate", "", seat.entry("int_ic", k, 0.0)) for k in range(n)]
        top = u
        for a, k in zip(den[1:], x, strict=True):
            top = top - a * b.x(k)
        for k, state in enumerate(x):
            b.c(state, state, 1.0 / w)
            b.add_f(state, -(top if k == 0 else b.x(x[k - 1])))
        out = num[0] * top
        for c, k in zip(num[1:], x, strict=True):
            out = out + c * b.x(k)
        seat.drive("out", out)


MODEL = TransferFunction
