"""PWM: a timer. In each period of its clock it is on for the share `duty`, which it takes at the tick; its edges are exact."""

from __future__ import annotations

from .base import Card, Default, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

ALIGNED = ("centre", "left", "right")
# from when to when it is on, from the tick on
TIMES = {
    "centre": ("0.5*(1-duty)*ts", "0.5*(1+duty)*ts"),
    "left": ("0", "duty*ts"),
    "right": ("(1-duty)*ts", "ts"),
}


class Pwm(Card):
    spec = Spec(
        "PWM",
        "PWM name [high [low]] clock= duty={expression} [align=centre|left|right] [dead=0] [level=1]",
        terminals="|high:node|high:node low:node",
        mark=("duty",),
        meaning="a timer: on for a share of each period of its clock, with exact edges",
        laws={"k": "1 for duty ts of each period"},
        clock=Required("", "clock whose period it is", kind="word"),
        duty=Required(
            "", "share of the period for which it is on; 0 and less: never, 1 and more: always", kind="value"
        ),
        align=Default("centre", "", "where in the period it is on", kind="word", words=ALIGNED),
        dead=Default(0.0, "s", "time between one output's fall and the other one's rise", least=0.0),
        level=Default(1.0, "V", "of the nodes while they are on"),
    )
    clock: str
    duty: Any
    align: str
    dead: float
    level: float
