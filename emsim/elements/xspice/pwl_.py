"""pwl: straight lines through points."""

from __future__ import annotations

from itertools import pairwise

from .base import CodeModel, Seat, Word, driving, flag, named, numbers, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar

    from ..contract import Expr
    from .base import Port


class Pwl(CodeModel):
    name = "pwl"
    what = "straight lines through points"
    law = (
        "out follows y_array over x_array; beyond the ends along the last lines, or constant with limit=TRUE"
    )
    ports: ClassVar[tuple[Port, ...]] = (reading("in"), driving("out"))
    parameters = named(
        x_array=numbers("inputs, ascending"),
        y_array=numbers("outputs there"),
        input_domain=Word("corners are rounded so far on either side", "", 0.01),
        fraction=flag("input_domain is a part of the shorter line beside a corner", True),
        limit=flag("beyond the ends the output is constant"),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "x_array", "y_array")

    def build(self, seat: Seat) -> None:
        xs, ys = seat["x_array"], seat["y_array"]
        if seat["limit"]:
            # on both sides the line goes on level, and its corner is rounded like the others
            xs = [2 * xs[0] - xs[1], *xs, 2 * xs[-1] - xs[-2]]
            ys = [ys[0], *ys, ys[-1]]
        points, rounding, share = list(zip(xs, ys, strict=True)), seat["input_domain"], bool(seat["fraction"])
        curve = seat.ctx.table(self.input(seat), points, False, seat.model.span, rounding, share)
        seat.drive("out", curve)

    def input(self, seat: Seat) -> Expr:
        return seat.read("in")


def pairs(seat: Seat, xs: str, ys: str, least: int = 2) -> None:
    """Both lists are there, equally long, the first ascends."""
    x, y = seat[xs], seat[ys]
    if len(x) < least or len(x) != len(y):
        seat.wrong(
            f"{xs} has {len(x)} values and {ys} {len(y)}: as many of both are needed, {least} at least", xs
        )
    elif any(a >= b for a, b in pairwise(x)):
        seat.wrong(f"{xs} does not ascend", xs)


MODEL = Pwl
