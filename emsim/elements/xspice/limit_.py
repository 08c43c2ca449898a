"""limit."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, named, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr
    from .base import Scalar

LIMITS = {
    "out_lower_limit": Word("the output's least value", "", 0.0),
    "out_upper_limit": Word("the output's largest value", "", 1.0),
    "limit_range": Word("on either side of a limit the output turns within so much", "", 1e-6),
    "fraction": flag("limit_range is a part of the distance of the limits"),
}
# of what runs free unless it is told where to stop
FREE = {key: Word(f"{LIMITS[key].meaning}; none: no limit") for key in ("out_lower_limit", "out_upper_limit")}
FREE["limit_range"] = LIMITS["limit_range"]


def limited(seat: Seat, value: Expr, low: Scalar | None, high: Scalar | None, reach: Scalar) -> Expr:
    """`value` between limits, rounded by a parabola within `reach` of each."""
    ctx, b = seat.ctx, seat.ctx.b
    reach = b.const(0.0) + reach
    zero = reach.value == 0.0

    def below(x: Expr, top: Scalar) -> Expr:
        s = x - (top - reach)
        bend = x if zero else x - (s * s) / (4.0 * reach)
        return b.select(ctx.kink(x - (top + reach)), b.const(0.0) + top, b.select(ctx.kink(s), bend, x))

    # each limit sees the value as it came, as in ngspice
    out = value if high is None else below(value, high)
    if low is None:
        return out
    over = -below(-value, -low)
    middle = value if high is None else b.select(ctx.kink(value - 0.5 * (low + high)), out, over)
    return over if high is None else middle


class Limit(CodeModel):
    name = "limit"
    what = "limiter"
    law = "out = gain (in + in_offset), between out_lower_limit and out_upper_limit"
    ports = (reading("in"), driving("out"))
    parameters = named(
        in_offset=Word("added to the input", "", 0.0),
        gain=Word("gain", "", 1.0),
        **LIMITS,
    )

    def check(self, seat: Seat) -> None:
        ordered(seat)

    def build(self, seat: Seat) -> None:
        low, high = seat["out_lower_limit"], seat["out_upper_limit"]
        reach = seat["limit_range"] * (high - low if seat["fraction"] else 1.0)
        value = seat["gain"] * (seat.read("in") + seat["in_offset"])
        seat.drive("out", limited(seat, value, low, high, reach))


def ordered(seat: Seat) -> None:
    low, high = seat["out_lower_limit"], seat["out_upper_limit"]
    if low is not None and high is not None and low > high:
        seat.wrong(f"out_lower_limit = {low:g} is above out_upper_limit = {high:g}", "out_lower_limit")


MODEL = Limit
