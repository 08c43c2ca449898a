"""S: a switch that a voltage turns."""

from __future__ import annotations

from .base import Param, named
from .switches import Switch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Circuit, Expr
    from .net import Net


class VoltageSwitch(Switch):
    __slots__ = ()
    letter = "s"
    what = "voltage-controlled switch"
    form = "Sname n+ n- nc+ nc- model [on|off]"
    law = "v = ron i above vt + vh, v = roff i below vt - vh, held in between; with von and voff smooth between them, no memory"
    terminals = ("n+", "n-", "nc+", "nc-")
    behind = ("model",)
    unit_letter = "v"
    smooth_on = 1.0
    knows_on_at_rest = True
    model_types = ("sw", "vswitch")
    model_words = named(
        vt=Param("threshold", "V", 0.0), vh=Param("half of the hysteresis", "V", 0.0),
        ron=Param("resistance when on", "Ohm", 1.0), roff=Param("resistance when off", "Ohm"),
        von=Param("fully on there; with it the resistance turns smoothly", "V"), voff=Param("fully off there", "V"),
    )  # fmt: skip

    def take_control(self, ch: list[Any]) -> list[Any]:
        return self.take_nodes(ch, 4)

    def control(self, ctx: Circuit) -> Expr:
        return ctx.v(self.nodes[2], self.nodes[3])

    def control_formula(self, net: Net) -> str:
        return f"v({net.plain(self.nodes[2])},{net.plain(self.nodes[3])})"

    def reads(self) -> list[str]:
        return self.nodes[2:]
