"""R: i = v / R(T), a number, a model's sheet resistance, or an expression."""

from __future__ import annotations

from ..expr import Node
from .base import Param, ignored
from .passive import FILAMENT, LENGTH, OF_MODEL, SCALED, WIDTH, Passive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from .._engine import Expr
    from ..assemble.context import Context
    from ..build_elements import ElementCards
    from ..source import Line

LEAST_RESISTANCE = 1e-3  # what ngspice makes of 0 ohm [ohm]


class Resistor(Passive):
    __slots__ = ()
    letter = "r"
    what = "resistor"
    form = "Rname n+ n- value [tc=tc1,tc2] [m=], or Rname n+ n- R={expression}"
    law = "i = v/R"
    unit = "Ohm"
    quantity_name = "resistance"
    value_names = ("resistance",)
    plain = ("resistor", 4, True)
    instance: ClassVar[dict[str, Param]] = {
        **SCALED, **ignored("ac"), "l": LENGTH, "w": WIDTH, "resistance": Param("resistance", "Ohm"),
    }  # fmt: skip
    model_types = ("r", "res")
    model_words: ClassVar[dict[str, Param]] = {
        "r": Param("resistance", "Ohm"), "res": Param("resistance", "Ohm"), "rsh": Param("sheet resistance", "Ohm"),
        "l": LENGTH, "w": WIDTH, "defw": Param("width where none is given", "m", FILAMENT),
        "narrow": Param("etched off the width", "m", 0.0), "short": Param("etched off the length", "m", 0.0),
        **OF_MODEL, **ignored("kf af wf lf ef bv_max"),
        "dw": Param("narrow= by another name", "m", 0.0), "dlr": Param("short= by another name", "m", 0.0),
        "tc1r": OF_MODEL["tc1"], "tc2r": OF_MODEL["tc2"], "tce": SCALED["tce"],
    }  # fmt: skip
    jumps = 1

    def from_model(self, p: dict[str, Any]) -> float | None:
        if p.get("rsh"):
            # sheet resistance times squares; both ends and both edges are over-etched
            length = self.number("l", p.get("l", FILAMENT)) - 2 * p.get("short", p.get("dlr", 0.0))
            edge = p.get("narrow", p.get("dw", 0.0))
            width = self.number("w", p.get("w", p.get("defw", FILAMENT))) - 2 * edge
            return float(p["rsh"] * length / width) if width else None
        return float(p.get("r", p.get("res", 0.0)))

    def no_value(self, cards: ElementCards, ch: list[Any], line: Line) -> None:
        said = f"{ch[0]} has no value, taken as 1 mOhm as in ngspice"
        cards.sink.warning("W281", said, line.span(ch[0]), self.hint)
        self.value = LEAST_RESISTANCE

    def quantity(self, ctx: Context) -> float:
        """R [ohm] of a constant resistor, one of the `m` that stand in parallel: with m=0 none does."""
        r = self.scaled(ctx)
        if r == 0.0:
            self._zero(ctx)
            r = LEAST_RESISTANCE
        return r

    def _zero(self, ctx: Context) -> None:
        ctx.sink.warning(
            "W281", f"`{self.name}` has 0 ohm, taken as 1 mOhm as in ngspice", self.value_span or self.span,
            hint="use a voltage source of 0 V for an ideal connection",
        )  # fmt: skip

    def contribute(self, ctx: Context) -> None:
        if isinstance(self.value, Node):
            self.inject(ctx, self.flow(ctx))
            return
        # most elements of a big deck are a number between two nodes
        plain = self.value and not self.params and self.model is None
        g = 1.0 / self.value if plain else self.number("m", 1.0) / self.quantity(ctx)
        ctx.b.conductance(ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), g)

    def flow(self, ctx: Context) -> Expr:
        m = self.number("m", 1.0)
        if not isinstance(self.value, Node):
            return self.between(ctx) * (m / self.quantity(ctx))
        r = self.expression(ctx)
        if r.value == 0.0:
            self._zero(ctx)
            r = ctx.b.const(LEAST_RESISTANCE)
        return m * self.between(ctx) / r
