"""What a D line is where its .model or the deck asks for more than the law that is written in the engine."""

from __future__ import annotations

import math

from .base import TEMPERATURE, Element, M, Param
from .compiled import Compiled
from .words import Written

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar

    from .base import Path
    from .contract import Circuit, Expr
    from .net import Net

# words of the complete module alone (devices/diode.va), where they are not 0, ...
OF_THE_MODULE = frozenset(("isr", "jtun", "jtunsw"))
# ... and of LTspice's diode of straight lines
OF_LINES = {
    "ron": Param("straight lines: resistance when on", "Ohm"), "roff": Param("... when off (1/gmin)", "Ohm"),
    "vfwd": Param("... voltage from which it is on (0)", "V"), "vrev": Param("... of breakdown (none)", "V"),
    "rrev": Param("... resistance in breakdown (ron)", "Ohm"), "ilimit": Param("... most current when on (none)", "A"),
    "revilimit": Param("... most current in breakdown (none)", "A"),
    "epsilon": Param("... width of the parabola between off and on (0)", "V"),
    "revepsilon": Param("... of that before breakdown (0)", "V"),
}  # fmt: skip
# of the line
INSTANCE = {
    **M, **TEMPERATURE, "area": Param("factor on the currents and charges of the model", default=1.0),
    "ic": Param(), "off": Param("off at the start"), "thermal": Param("its own heat warms it, by rth0 and cth0 of the .model"),
    "pj": Param("perimeter, in units of the model's", default=1.0),
    "l": Param("length, of level 3", "m"), "w": Param("width, of level 3", "m"),
    "lm": Param("length of the metal, of level 3", "m"), "wm": Param("width of the metal, of level 3", "m"),
    "lp": Param("length of the poly, of level 3", "m"), "wp": Param("width of the poly, of level 3", "m"),
}  # fmt: skip
# limits that only warn, what self-heating reads, and who made it
HARMLESS = frozenset(
    """nlev fv_max bv_max id_max te_max pd_max rth0 cth0 mfg vendor type iave ipk ipeak vpk irms diss icrating vcrating""".split()
)


def become(e: Element, kind: type[Element]) -> Element:
    """The same line as an element of another class."""
    other = kind.__new__(kind)
    for slot in Written.__slots__:
        if hasattr(e, slot):  # a plain line has not all of them
            setattr(other, slot, getattr(e, slot))
    return other


def wanted(e: Element, read: set[str]) -> type[Element] | None:
    """The class that computes this diode, if it is not its own; `read`: values of its operating point that the deck reads."""
    words = e.model.params if e.model is not None else {}
    if OF_LINES & words.keys():
        return BentDiode if words.get("epsilon") or words.get("revepsilon") else LinesDiode
    if "thermal" in e.params:
        return ThermalDiode
    level = words.get("level", 1)
    if level not in (1, 2, 3) and _is_public(level):
        return PublicDiode
    if level == 3 or any(words.get(key) for key in OF_THE_MODULE) or read & OPERATING:
        return ModuleDiode
    return None


def _is_public(level: object) -> bool:
    """Whether a level is one of a public model (JUNCAP200), or was added; the plain diode refuses others."""
    from . import added, public

    if not isinstance(level, (int, float)) or level != level:
        return False
    return bool(public.of_level("d", int(level))) or added.of_level("d", int(level)) is not None


OPERATING = frozenset(("vd", "gd", "cd", "qd", "charge", "capcur"))  # outputs of the module


class ModuleDiode(Compiled):
    """devices/diode.va: recombination, tunnelling, geometry; its operating point can be read."""

    __slots__ = ()
    letter = "d"
    what = "diode"
    terminals: ClassVar[tuple[str, ...]] = ("anode", "cathode")
    sorts: ClassVar[dict[str, tuple[str, float]]] = {"d": ("diode", 1.0)}
    model_types = ("d",)
    instance = INSTANCE
    currents: ClassVar[tuple[str, ...]] = ("id", "ik")
    aliases: ClassVar[dict[str, str]] = {"charge": "qd"}
    charging: ClassVar[dict[str, str]] = {"capcur": "qd"}
    current_name = "id"
    harmless = Compiled.harmless | HARMLESS


class PublicDiode(ModuleDiode):
    """A public model, by its level (public.py)."""

    __slots__ = ()
    levels: ClassVar[dict[int, str]] = {3: "diode"}


class ThermalDiode(ModuleDiode):
    """devices/thermal_diode.va: its own heat warms it; the potential of a third node is by how many kelvin."""

    __slots__ = ()
    terminals = ("anode", "cathode", "tj")
    sorts: ClassVar[dict[str, tuple[str, float]]] = {"d": ("thermal_diode", 1.0)}
    may_lack = 1
    currents = ("id", "ik", "heat")

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if (
            self.module is not None
            and len(self.nodes) < 3
            and not (self.model and self.model.params.get("rth0"))
        ):
            said = f"`{self.name}`: nothing cools it: .model `{self.model_name}` has no rth0"
            ctx.sink.error(
                "E299",
                said,
                self.span,
                "rth0= is its thermal resistance [K/W], cth0= its heat capacity [J/K]",
            )

    def paths(self) -> tuple[Path, ...]:
        return (0, 1, "conducts"), *(((1, 2, "conducts"),) if len(self.nodes) > 2 else ())


class Lines(Element):
    """LTspice's diode of straight lines ("D. Diode" of its help): what its two classes share."""

    __slots__ = ()

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if self.model is None:
            return
        vfwd, vrev = self._number("vfwd", 0.0), self._number("vrev", math.inf)
        low = [key for key in ("ron", "roff", "rrev") if self._number(key, 1.0) <= 0.0]
        said = (
            f"{low[0]} must be positive"
            if low
            else "breakdown begins above vfwd"
            if vfwd + vrev < 0.0
            else ""
        )
        if said:
            ctx.sink.error(
                "E299",
                f".model `{self.model.name}`: {said}",
                self.model.span,
                None if low else "-vrev lies below vfwd",
            )

    def _number(self, key: str, default: float) -> float:
        assert self.model is not None
        value = self.model.params.get(key, default)
        return float(value) if isinstance(value, (int, float)) else default

    def analogue(self, net: Net) -> str:
        """Straight lines as an expression of ngspice."""
        ron, roff = self._number("ron", 1.0), self._number("roff", 1e12)
        p, n = map(net.plain, self.nodes[:2])
        v, off = f"v({p},{n})", 1.0 / roff
        forward = f"({v}-({self._number('vfwd', 0.0)!r}))"
        text = f"{off!r}*{v}+{self._bent_text(forward, 1.0 / ron - off, 'epsilon', 'ilimit')}"
        if (vrev := self._number("vrev", math.inf)) < math.inf:
            back = 1.0 / self._number("rrev", ron) - off
            text += "-" + self._bent_text(f"(-{v}-({vrev!r}))", back, "revepsilon", "revilimit")
        parallel = self.number("area", 1.0) * self.number("m", 1.0)
        return f"b{net.name_of(self.name)} {p} {n} i='{parallel!r}*({text})'"

    def _bent_text(self, v: str, g: float, width: str, limit: str) -> str:
        epsilon, most = self._number(width, 0.0), self._number(limit, 0.0)
        rises = f"{g!r}*max({v},0)"
        if epsilon > 0.0:
            rises = f"({v}<0 ? 0 : {v}<{epsilon!r} ? {0.5 * g / epsilon!r}*{v}*{v} : {g!r}*({v}-{0.5 * epsilon!r}))"
        return f"{most!r}*tanh(({rises})/{most!r})" if most > 0.0 else rises


class BentDiode(Lines, ModuleDiode):
    """devices/lines_diode.va: with parabolas between the lines nothing happens where one ends."""

    __slots__ = ()
    sorts: ClassVar[dict[str, tuple[str, float]]] = {"d": ("lines_diode", 1.0)}


class LinesDiode(Lines):
    """Corners where the lines meet: each is an event that the run stops at."""

    __slots__ = ()
    letter = "d"
    what = "diode"
    terminals = ("anode", "cathode")
    model_types = ("d",)
    instance = INSTANCE
    current_name = "id"

    @classmethod
    def model_names(cls) -> frozenset[str]:
        return frozenset(OF_LINES) | HARMLESS | ModuleDiode.harmless

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        return [([key], p.unit, math.nan, p.meaning) for key, p in OF_LINES.items()]

    def flow(self, ctx: Circuit) -> Expr:
        v, ron = self.between(ctx), self._number("ron", 1.0)
        off = 1.0 / self._number("roff", 1.0 / ctx.gmin)
        current = off * v + self._bent(ctx, v - self._number("vfwd", 0.0), 1.0 / ron - off, "ilimit")
        if (vrev := self._number("vrev", math.inf)) < math.inf:
            back = 1.0 / self._number("rrev", ron) - off
            current = current - self._bent(ctx, -v - vrev, back, "revilimit")
        return self.number("area", 1.0) * self.number("m", 1.0) * current

    def _bent(self, ctx: Circuit, v: Expr, g: float, limit: str) -> Expr:
        rises, most = g * ctx.max_(v, ctx.b.const(0.0)), self._number(limit, 0.0)
        return most * ctx.b.call("tanh", rises * (1.0 / most)) if most > 0.0 else rises
