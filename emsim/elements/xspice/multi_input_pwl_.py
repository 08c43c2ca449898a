"""multi_input_pwl: the largest or the smallest of several voltages through a curve."""

from __future__ import annotations

from .base import CodeModel, Seat, driving, named, numbers, reading, text
from .pwl_ import pairs

MODELS = ("and", "or", "nand", "nor")


class MultiInputPwl(CodeModel):
    name = "multi_input_pwl"
    what = "smallest or largest input, through straight lines"
    law = "out follows y over x of the smallest input (and, nand) or of the largest (or, nor); whether that negates it, y says"
    ports = (reading("in", "vd", "id", "v", "i", is_list=True, least=2), driving("out", "vd", "id", "v", "i"))
    parameters = named(
        x=numbers("inputs, ascending", "", (0.0, 1.0)),
        y=numbers("outputs there", "", (0.0, 1.0)),
        model=text("and, or, nand, nor"),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "x", "y")
        if (seat["model"] or "and") not in MODELS:
            seat.wrong(f"model=`{seat['model']}` is none of {', '.join(MODELS)}", "model")

    def build(self, seat: Seat) -> None:
        kind, ctx = seat["model"] or "and", seat.ctx
        pick = ctx.min_ if kind in ("and", "nand") else ctx.max_
        value, *others = seat.all("in")
        for other in others:
            value = pick(value, other)
        out = seat.curve(value, seat["x"], seat["y"], True)
        seat.drive("out", out)


MODEL = MultiInputPwl
