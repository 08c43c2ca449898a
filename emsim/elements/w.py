"""W: a switch that the current of a voltage source turns."""

from __future__ import annotations

from .base import Param, named
from .controlled import current_of, sum_of
from .switches import Switch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Circuit, Expr, Level
    from .net import Net


class CurrentSwitch(Switch):
    __slots__ = ()
    letter = "w"
    what = "current-controlled switch"
    form = "Wname n+ n- Vsource model [on|off]"
    law = "as S, by the current of Vsource: it, ih"
    behind = ("element", "model")
    unit_letter = "i"
    smooth_on = 1e-3
    knows_on_at_rest = False
    model_types = ("csw", "iswitch")
    model_words = named(
        it=Param("threshold", "A", 0.0), ih=Param("half of the hysteresis", "A", 0.0),
        ron=Param("resistance when on", "Ohm", 1.0), roff=Param("resistance when off", "Ohm"),
        ion=Param("fully on there; with it the resistance turns smoothly", "A"), ioff=Param("fully off there", "A"),
    )  # fmt: skip

    def take_control(self, ch: list[Any]) -> list[Any]:
        rest = self.take_nodes(ch, 2)
        self.extra["controls"] = [rest[0].lower()]
        return rest[1:]

    def bind(self, level: Level) -> None:
        self.extra["controls"] = [level.prefix + name for name in self.extra["controls"]]

    def control(self, ctx: Circuit) -> Expr:
        return sum_of(ctx, [(current_of(ctx, self, self.extra["controls"][0]), 1.0)])

    def control_formula(self, net: Net) -> str:
        return f"i({net.name_of(self.extra['controls'][0])})"

    def control_text(self, net: Net) -> str:
        return " " + net.name_of(self.extra["controls"][0])
