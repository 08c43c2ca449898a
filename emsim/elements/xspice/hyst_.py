"""hyst: two lines, one on the way up and one on the way down."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, named, reading

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr


class Hysteresis(CodeModel):
    name = "hyst"
    what = "hysteresis"
    law = (
        "out_lower_limit to out_upper_limit while the input goes from in_low + hyst to in_high + hyst upwards, and back "
        "from in_high - hyst to in_low - hyst"
    )
    ports = (reading("in"), driving("out"))
    parameters = named(
        in_low=Word("input at the lower end", "", 0.0),
        in_high=Word("input at the upper end", "", 1.0),
        hyst=Word("half of the hysteresis", "", 0.1, least=0.0),
        out_lower_limit=Word("output at the lower end", "", 0.0),
        out_upper_limit=Word("output at the upper end", "", 1.0),
        input_domain=Word("corners are rounded so far on either side", "", 0.01),
        fraction=flag("input_domain is a part of in_high - in_low", True),
    )

    def check(self, seat: Seat) -> None:
        if seat["in_low"] >= seat["in_high"]:
            seat.wrong("in_high must be above in_low", "in_low")

    def build(self, seat: Seat) -> None:
        seat.drive("out", two_lines(seat, seat.read("in")))


def two_lines(seat: Seat, x: Expr) -> Expr:
    """What stands on the line that x is on."""
    b = seat.ctx.b
    low, high, half = seat["in_low"], seat["in_high"], seat["hyst"]
    ends = [seat["out_lower_limit"], seat["out_upper_limit"]]
    domain = seat["input_domain"] * (high - low if seat["fraction"] else 1.0)
    share = domain / (high - low)
    rising, falling = (seat.curve(x - at, [low, high], ends, True, share) for at in (half, -half))
    # on the falling line once the rising one has ended, and the other way round
    turned = b.flag(
        x - (high + half + domain), x - (low - half - domain), f"{seat.name} falling", 0, -1, "stays"
    )
    return b.select(turned, falling, rising)


MODEL = Hysteresis
