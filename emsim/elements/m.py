"""M: a MOSFET: Shichman and Hodges (devices/mos1.va), levels 2, 3, 6 (mos2.va, ..), BSIM3, BSIM4, power MOSFETs (vdmos.va)."""

from __future__ import annotations

from .base import Element, Param, named
from .compiled import Compiled
from .diodes import become

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any, ClassVar

    from .base import Path
    from .contract import Circuit

# options that stand for what the line leaves out
DEFAULTS = {"l": "defl", "w": "defw", "ad": "defad", "as": "defas"}


class Mosfet(Compiled):
    __slots__ = ()
    letter = "m"
    what = "MOSFET"
    form = "Mname drain gate source [bulk] model [l=] [w=] [ad=] [as=] [pd=] [ps=] [nrd=] [nrs=] [off] [ic=] [temp=] [m=]"
    law = "id = kp w/l (vgs - vt - vds/2) vds (1 + lambda vds) below saturation: the module of its level"
    terminals = ("drain", "gate", "source", "bulk", "tj", "tcase", "t7", "t8")
    least = 3
    usual = 4
    sorts = named(
        nmos=("mos1", 1.0), pmos=("mos1", -1.0),
        vdmos=("vdmos", 1.0), vdmosn=("vdmos", 1.0), vdmosp=("vdmos", -1.0),
        nsoi=("bsimsoi", 1.0), psoi=("bsimsoi", -1.0),
    )  # fmt: skip
    levels: ClassVar[dict[int, str]] = {
        1: "mos1", 2: "mos2", 3: "mos3", 6: "mos6", 8: "bsim3", 9: "mos3", 14: "bsim4", 49: "bsim3", 54: "bsim4",
    }  # fmt: skip
    model_types = tuple(sorts)
    words_of_model = frozenset(("nchan", "pchan"))
    instance: ClassVar[dict[str, Param]] = {
        **Compiled.instance,
        "l": Param("length of the channel", "m", 1e-4), "w": Param("width of the channel", "m", 1e-4),
        "ad": Param("area of the drain", "m^2", 0.0), "as": Param("area of the source", "m^2", 0.0),
        "pd": Param("perimeter of the drain", "m", 0.0), "ps": Param("perimeter of the source", "m", 0.0),
        "thermal": Param("its own heat warms it, by rthjc, rthca and cthj of a VDMOS"),
        "nrd": Param("squares of the drain", "", 1.0), "nrs": Param("squares of the source", "", 1.0),
    }  # fmt: skip
    flags = ("off", "thermal")
    current_name = "id"
    currents: ClassVar[tuple[str, ...]] = ("id", "ig", "is", "ib")
    charging = named(cqbd="qbd", cqbs="qbs")
    aliases = named(
        gmb="gmbs", cbd="capbd", cbs="capbs", rd="rd_t", rs="rs_t", cbd0="bottom_d", cbs0="bottom_s",
        cbdsw0="side_d", cbssw0="side_s",
    )  # fmt: skip

    def chosen(self, read: set[str]) -> Element:
        is_power = self.model is not None and self.model.type in ThermalMosfet.sorts
        return become(self, ThermalMosfet) if "thermal" in self.params and is_power else self

    def check(self, ctx: Circuit) -> None:
        if "thermal" in self.params and not isinstance(self, ThermalMosfet):
            said = (
                f"`{self.name}`: of a MOSFET, a VDMOS alone is warmed by its own heat with the word `thermal`"
            )
            ctx.sink.error(
                "E307",
                said,
                self.span,
                "models that heat themselves otherwise have a parameter for it: shmod, swself, ..",
            )
        super().check(ctx)

    def sense(self) -> float:
        """Of a p channel as of an n channel, as in ngspice."""
        return self.sign * self.polarity()

    def paths(self) -> Sequence[Path]:
        own: list[Path] = [(0, 2, "conducts"), (1, 2, "blocks")]
        junctions: list[Path] = [(3, 2, "conducts"), (3, 0, "conducts")]
        return [*own, *(junctions if len(self.nodes) > 3 else [])]

    def polarity(self) -> float:
        assert self.model is not None
        return -1.0 if self.model.type == "vdmos" and self.model.params.get("pchan") else 1.0

    def given(self, ctx: Circuit) -> dict[str, Any]:
        assert self.module is not None
        found = super().given(ctx)
        for key, option in DEFAULTS.items():
            value = ctx.flat.options.get(option)
            if key not in found and key in self.module.parameters and isinstance(value, (int, float)):
                found[key] = float(value)
        scale = ctx.flat.options.get("scale", 1.0)
        if isinstance(scale, (int, float)) and scale != 1.0:
            powers = {"l": 1, "w": 1, "pd": 1, "ps": 1, "ad": 2, "as": 2}
            found = {key: value * scale ** powers.get(key, 0) for key, value in found.items()}
        return found


class ThermalMosfet(Mosfet):
    """devices/thermal_vdmos.va: its own heat warms it; the potentials of tj and tc are by how many kelvin."""

    __slots__ = ()
    form = "Mname drain gate source [tj tc] model thermal"
    sorts: ClassVar[dict[str, tuple[str, float]]] = {
        word: ("thermal_vdmos", sign) for word, (name, sign) in Mosfet.sorts.items() if name == "vdmos"
    }
    may_lack = 2
    currents = ("id", "ig", "is", "heat", "ic")

    def paths(self) -> Sequence[Path]:
        own: list[Path] = [(0, 2, "conducts"), (1, 2, "blocks")]
        return [*own, *((2, k, "conducts") for k in range(3, len(self.nodes)))]
