"""oneshot: a pulse for every edge of its clock."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, named, numbers, reading
from .pwl_ import pairs

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..contract import Expr


class OneShot(CodeModel):
    name = "oneshot"
    what = "pulse for every edge of its clock, as long as its input says"
    law = (
        "an edge of clk through clk_trig: after rise_delay out rises in rise_time, stays for the width and fall_delay, "
        "falls in fall_time"
    )
    ports = (reading("clk"), reading("cntl_in", is_open=True), reading("clear", is_open=True), driving("out"))
    parameters = named(
        cntl_array=numbers("inputs, ascending", "", (0.0,)),
        pw_array=numbers("widths there, straight lines between and beyond", "s", (1e-6,)),
        clk_trig=Word("where the clock triggers", "", 0.5),
        pos_edge_trig=flag("triggers on the way up (FALSE: down)", True),
        out_low=Word("low output", "", 0.0),
        out_high=Word("high output", "", 1.0),
        rise_time=Word("time of a rise", "s", 1e-9, least=1e-12),
        rise_delay=Word("from the trigger to the rise", "s", 1e-9, least=0.0),
        fall_delay=Word("from the end of the width to the fall", "s", 1e-9, least=0.0),
        fall_time=Word("time of a fall", "s", 1e-9, least=1e-12),
        retrig=flag("a trigger during a pulse begins its width anew"),
    )

    def check(self, seat: Seat) -> None:
        pairs(seat, "cntl_array", "pw_array", 1)

    def build(self, seat: Seat) -> None:
        ctx, b = seat.ctx, seat.ctx.b
        name, sign = seat.name, 1.0 if seat["pos_edge_trig"] else -1.0
        if seat.is_open("cntl_in") or len(seat["pw_array"]) == 1:
            width = b.const(seat["pw_array"][0])
        else:
            width = ctx.max_(
                seat.curve(seat.read("cntl_in"), seat["cntl_array"], seat["pw_array"]), b.const(0.0)
            )
        on = ctx.flag(sign * (seat.read("clk") - seat["clk_trig"]))
        # memories keep what was just before the last event: whether the clock was over its threshold, the time, the width there
        was, when, wide, begin, last, lasts = (
            b.memory(f"{name} {word}") for word in ("was", "when", "wide", "begin", "last", "lasts")
        )
        b.keep(was, on)
        b.keep(when, b.time())
        b.keep(wide, width)
        up, rises, stays, falls = seat["rise_delay"], seat["rise_time"], seat["fall_delay"], seat["fall_time"]
        # before the first event all of them are 0: an edge counts when it comes, and where no pulse lasts any more
        whole = up + rises + stays + falls
        idle = positive(seat, when - last - lasts - whole)
        first = 1.0 - positive(seat, begin)
        edge = on * (1.0 - was) * positive(seat, when)
        free = first + (1.0 - first) * idle
        taken = edge if seat["retrig"] else edge * free
        # a trigger during a pulse puts off its fall; one before it rises begins it anew
        anew = (
            edge * (free + (1.0 - free) * (1.0 - positive(seat, when - begin - up)))
            if seat["retrig"]
            else taken
        )
        begun, fallen = b.select(anew, when, begin), b.select(taken, when, last)
        width_now = b.select(taken, wide, lasts)
        if not seat.is_open("clear"):
            # while it is high nothing comes, and what was there is gone
            cleared = ctx.flag(seat.read("clear") - seat["clk_trig"])
            nothing = b.const(0.0)
            begun, fallen = b.select(cleared, nothing, begun), b.select(cleared, nothing, fallen)
        b.keep(begin, begun)
        b.keep(last, fallen)
        b.keep(lasts, width_now)
        up_at = up + rises
        down_at = width_now + (up_at + stays)
        rise = ctx.clamp((b.time() - begun - up) * (1.0 / rises), 0.0, 1.0)
        fall = ctx.clamp((b.time() - fallen - down_at) * (1.0 / falls), 0.0, 1.0)
        share = b.select(positive(seat, begun), rise - fall, b.const(0.0))
        seat.drive("out", seat["out_low"] + (seat["out_high"] - seat["out_low"]) * share)


def positive(seat: Seat, e: Expr) -> Expr:
    """1 where what is made of memories is above zero, else 0."""
    sign = seat.ctx.b.call("sgn", e)
    return 0.5 * (sign * sign + sign)


MODEL = OneShot
