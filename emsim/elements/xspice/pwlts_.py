"""pwlts: straight lines through points in time."""

from __future__ import annotations

from .base import Seat, driving, named, numbers
from .pwl_ import Pwl

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr


class PwlOfTime(Pwl):
    name = "pwlts"
    what = "straight lines through points in time"
    law = "out follows y_array over the times of x_array; before and behind them as pwl does"
    ports = (driving("out"),)
    parameters = Pwl.parameters | named(x_array=numbers("times, ascending", "s"))

    def input(self, seat: Seat) -> Expr:
        return seat.ctx.b.time()


MODEL = PwlOfTime
