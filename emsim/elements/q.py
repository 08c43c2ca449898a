"""Q: a bipolar transistor after Gummel and Poon (devices/bjt.va)."""

from __future__ import annotations

from .base import Param, named
from .compiled import Compiled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import ClassVar

    from .base import Path


class Bipolar(Compiled):
    __slots__ = ()
    letter = "q"
    what = "bipolar transistor"
    form = "Qname collector base emitter [substrate [tj]] model [area] [off] [ic=] [temp=] [m=]"
    law = "ic = (ibe - ibc)/qb - ..., charges of both junctions, resistances: the module bjt"
    terminals = ("collector", "base", "emitter", "substrate", "tj")
    least = 3
    usual = 3
    positional = ("area",)
    sorts = named(
        npn=("bjt", 1.0),
        pnp=("bjt", -1.0),
        lpnp=("bjt", -1.0),
    )
    levels: ClassVar[dict[int, str]] = {1: "bjt", 2: "bjt", 4: "vbic", 9: "vbic"}
    model_types = tuple(sorts)
    instance = named(
        **Compiled.instance, area=Param("area of the emitter, in units of the model's", default=1.0),
        areab=Param("area of the base (default: area)"), areac=Param("area of the collector (default: area)"),
    )  # fmt: skip
    current_name = "ic"
    currents = ("ic", "ib", "ie", "is")
    charging: ClassVar[dict[str, str]] = {f"c{q}": q for q in ("qbe", "qbc", "qbx", "qsub")}
    aliases = named(csub="capsub")
    may_lack = 1
    at_ground = True

    def paths(self) -> Sequence[Path]:
        own: list[Path] = [(0, 2, "conducts"), (1, 2, "conducts"), (1, 0, "conducts")]
        return [*own, (3, 0, "conducts")] if len(self.nodes) > 3 else own
