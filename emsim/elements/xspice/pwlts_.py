"""pwlts: straight lines through points in time."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, numbers
from .pwl_ import pairs

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class PwlOfTime(CodeModel):
    name = "pwlts"
    what = "straight lines through points in time"
    law = "out follows y_array over the times of x_array"
    ports = (driving("out"),)
    parameters: ClassVar[dict[str, Word]] = {
        "x_array": numbers("times, ascending", "s"),
        "y_array": numbers("outputs there"),
        "input_domain": Word("corners are rounded so far on either side", "", 0.01),
        "fraction": flag("input_domain is a part of the shorter line beside a corner", True),
        "limit": flag("beyond the ends the output is constant"),
    }

    def check(self, seat: Seat) -> None:
        pairs(seat, "x_array", "y_array")

    def build(self, seat: Seat) -> None:
        seat.drive("out", seat.curve(seat.ctx.b.time(), seat["x_array"], seat["y_array"], seat["limit"]))


MODEL = PwlOfTime
