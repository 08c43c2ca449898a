"""J: a junction field-effect transistor (devices/jfet.va, level 2: devices/jfet2.va)."""

from __future__ import annotations

from .base import Param, named
from .compiled import Compiled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from .base import Path


class Jfet(Compiled):
    __slots__ = ()
    letter = "j"
    what = "JFET"
    form = "Jname drain gate source model [area] [off] [ic=] [temp=] [m=]"
    law = "id = beta (vgs - vto)^2 (1 + lambda vds) in saturation, two junctions: the module jfet"
    terminals = ("drain", "gate", "source")
    least = 3
    usual = 3
    positional = ("area",)
    sorts = named(njf=("jfet", 1.0), pjf=("jfet", -1.0))
    levels: ClassVar[dict[int, str]] = {1: "jfet", 2: "jfet2"}
    model_types = tuple(sorts)
    instance = named(
        **Compiled.instance, area=Param("area, in units of the model's", default=1.0),
    )  # fmt: skip
    current_name = "id"
    currents = ("id", "ig", "is")
    charging = named(cqgs="qgs", cqgd="qgd")

    def sense(self) -> float:
        """Of a p channel as of an n channel, as in ngspice."""
        return self.sign * self.polarity()

    def paths(self) -> Sequence[Path]:
        return [(0, 2, "conducts"), (1, 2, "conducts"), (1, 0, "conducts")]
