"""delay: what the input was a while ago."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, flag, named, reading


class Delay(CodeModel):
    name = "delay"
    what = "delay line"
    law = "out(t) = in(t - delay)"
    ports = (
        reading("in", "v", "vd"),
        reading("cntl", "v", "vd", "i", "id", is_open=True),
        driving("out", "v", "vd"),
    )
    parameters = named(
        delay=Word("the delay", "s", 0.0, least=0.0),
        buffer_size=Word(),
        has_delay_cntl=flag("the delay is an input"),
        delmin=Word("the delay where the input is 0", "s", 0.0),
        delmax=Word("the delay where the input is 1", "s", 0.0),
    )

    def check(self, seat: Seat) -> None:
        if seat["has_delay_cntl"]:
            seat.wrong("a delay that changes is not supported", "has_delay_cntl", "delay=... is constant")

    def build(self, seat: Seat) -> None:
        x = seat.read("in")
        seat.drive("out", seat.ctx.delay(x, seat["delay"], f"{seat.name}#late") if seat["delay"] > 0.0 else x)


MODEL = Delay
