"""CLOCK: when blocks are computed, t = offset + k period, k = 0, 1, ..; what is computed at a tick is seen `delay` later."""

from __future__ import annotations

from .base import Card, Default, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink


class Clock(Card):
    spec = Spec(
        "CLOCK",
        "CLOCK name freq= or period= [offset=0] [delay=0], or CLOCK name of= every= [skip=0] [delay=0]",
        terminals="",
        mark=("freq", "period", "every"),
        meaning="ticks that blocks are computed at",
        laws={"k": "t = offset + k period"},
        freq=Default(None, "Hz", "ticks a second", above=0.0),
        period=Default(None, "s", "time from tick to tick", above=0.0),
        offset=Default(0.0, "s", "time of the first tick", least=0.0),
        of=Default(None, "", "clock that it goes with", kind="word"),
        every=Default(None, "", "ticks of that clock from tick to tick", least=1.0),
        skip=Default(0.0, "", "ticks of that clock before its first one", least=0.0),
        delay=Default(
            0.0, "s", "time from a tick until circuit and machine see what was computed", least=0.0
        ),
    )
    freq: float | None
    period: float | None
    offset: float
    of: str | None
    every: float | None
    skip: float
    delay: float

    def check(self, sink: Sink) -> None:
        pace = [key for key in ("freq", "period", "every") if self.given(key)]
        if len(pace) > 1 or (self.every is None) != (self.of is None):
            twice = f"CLOCK {self.name} is given a pace twice"
            said = twice if len(pace) > 1 else f"CLOCK {self.name} needs of= and every= together"
            sink.error("E390", said, self.place(pace[-1]), f"the form is: {self.spec.form}")
        for key in ("every", "skip"):
            value = getattr(self, key)
            if value is not None and value != round(value):
                said = f"{key}= of CLOCK {self.name} is {value:g}; it counts ticks"
                sink.error("E390", said, self.place(key), "a whole number")
        if self.of is not None and self.given("offset"):
            said = f"CLOCK {self.name} has its first tick from `{self.of}`"
            sink.error("E390", said, self.place("offset"), "skip= counts its ticks")
