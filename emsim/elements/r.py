"""R: i = v / R(T), a number, a model's sheet resistance, or an expression."""

from __future__ import annotations

from ..expr import Node
from .base import Param, ignored, named
from .passive import FILAMENT, LENGTH, OF_MODEL, SCALED, WIDTH, Passive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..source import Line
    from .contract import Cards, Circuit, Expr

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
    instance = named(
        **SCALED, ac=Param("resistance to small signals", "Ohm"), l=LENGTH, w=WIDTH,
        resistance=Param("resistance", "Ohm"),
        noisy=Param("0: it makes no noise", default=1.0), noise=Param("noisy= by another name"),
    )  # fmt: skip
    model_types = ("r", "res")
    model_words = named(
        r=Param("resistance", "Ohm"), res=Param("resistance", "Ohm"), resistance=Param("resistance", "Ohm"),
        rsh=Param("sheet resistance", "Ohm"),
        l=LENGTH, w=WIDTH, defw=Param("width where none is given", "m", FILAMENT),
        narrow=Param("etched off the width", "m", 0.0), short=Param("etched off the length", "m", 0.0),
        **OF_MODEL, **ignored("bv_max"), kf=Param("1/f noise: kf |i|^af / (l^lf w^wf f^ef)", default=0.0),
        **{key: Param(f"1/f noise: exponent of the {of}", default=by)
           for key, of, by in (("af", "current", 2.0), ("lf", "length", 1.0), ("wf", "width", 1.0), ("ef", "frequency", 1.0))},
        dw=Param("narrow= by another name", "m", 0.0), dlr=Param("short= by another name", "m", 0.0),
        tc1r=OF_MODEL["tc1"], tc2r=OF_MODEL["tc2"], tce=SCALED["tce"],
    )  # fmt: skip
    jumps = 1
    big = (1.0, "M", "milliohm", "megohm", "Meg")

    def from_model(self, p: dict[str, Any]) -> float | None:
        if p.get("rsh"):
            length, width = self.squares(p)
            return float(p["rsh"] * length / width) if width else None
        return float(p.get("r", p.get("res", p.get("resistance", 0.0))))

    def squares(self, p: dict[str, Any]) -> tuple[float, float]:
        """Length and width of its film [m]; both ends and both edges are over-etched."""
        length = self.number("l", p.get("l", FILAMENT)) - 2 * p.get("short", p.get("dlr", 0.0))
        edge = p.get("narrow", p.get("dw", 0.0))
        return length, self.number("w", p.get("w", p.get("defw", FILAMENT))) - 2 * edge

    def no_value(self, cards: Cards, ch: list[Any], line: Line) -> None:
        if line.file.sheet is not None:  # a value that its owner has still to write
            super().no_value(cards, ch, line)
        said = f"{ch[0]} has no value, taken as 1 mOhm as in ngspice"
        cards.sink.warning("W281", said, line.span(ch[0]), self.hint)
        self.value = LEAST_RESISTANCE

    def quantity(self, ctx: Circuit) -> float:
        """R [ohm] of a constant resistor, one of the `m` that stand in parallel: with m=0 none does."""
        r = self.scaled(ctx)
        if r == 0.0:
            self.warn_of_zero(ctx)
            r = LEAST_RESISTANCE
        return r

    def warn_of_zero(self, ctx: Circuit) -> None:
        ctx.sink.warning(
            "W281", f"`{self.name}` has 0 ohm, taken as 1 mOhm as in ngspice", self.value_span or self.span,
            hint="use a voltage source of 0 V for an ideal connection",
        )  # fmt: skip

    def contribute(self, ctx: Circuit) -> None:
        if isinstance(self.value, Node):
            self.inject(ctx, self.flow(ctx))
            return
        self.judge_capital(ctx)
        # most elements of a big deck are a number between two nodes
        plain = self.value and not self.params and self.model is None
        if not plain and self.params.get("ac"):
            self.inject(ctx, self.flow(ctx))
            return
        g = 1.0 / self.value if plain else self.number("m", 1.0) / self.quantity(ctx)
        ctx.b.conductance(ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), g)

    def noise(self, ctx: Circuit) -> list[tuple[str, Expr | float, float]]:
        """Thermal; 1/f by the parameters of its model. None of an expression, as in ngspice."""
        if isinstance(self.value, Node) or not self.number("noisy", self.number("noise", 1.0)):
            return []
        m, p = self.number("m", 1.0), self.model.params if self.model is not None else {}
        g = self._conductance(ctx)
        length, width = self.squares(p)
        flicker: Expr | float = 0.0
        if kf := p.get("kf", 0.0):
            one = ctx.b.call("abs", g * self.between(ctx)) / m
            area = length ** p.get("lf", 1.0) * width ** p.get("wf", 1.0)
            flicker = m * kf / area * one ** p.get("af", 2.0)
        return [("thermal", self.thermal(ctx, g), 0.0), ("1overf", flicker, p.get("ef", 1.0))]

    def _conductance(self, ctx: Circuit) -> Expr | float:
        """Of a constant resistor [S]; with `ac` another one to small signals."""
        g = self.number("m", 1.0) / self.quantity(ctx)
        if not self.params.get("ac"):
            return g
        small = g * self.nominal(ctx) / self.number("ac")
        return g + (small - g) * ctx.small_signals()

    def flow(self, ctx: Circuit) -> Expr:
        m = self.number("m", 1.0)
        if not isinstance(self.value, Node):
            return self.between(ctx) * self._conductance(ctx)
        r = self.expression(ctx)
        if r.value == 0.0:
            self.warn_of_zero(ctx)
            r = ctx.b.const(LEAST_RESISTANCE)
        return m * self.between(ctx) / r
