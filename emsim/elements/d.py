"""D: the engine's junction diode; temperature scaling and the inner node of rs are its business. Where the .model asks for
more, the line is an element of diodes.py."""

from __future__ import annotations

import math

from ..build_expr import node_name
from ..units import spice_number
from .base import Element
from .diodes import HARMLESS, INSTANCE, OF_LINES, become, wanted
from .modules import shipped

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from ..source import Line
    from .contract import Accounts, Cards, Circuit


class Diode(Element):
    __slots__ = ()
    _table: ClassVar[list[tuple[list[str], str, float, str]]] = []  # `model_table`, once it is made
    letter = "d"
    what = "diode"
    form = "Dname anode cathode model [area] [off] [ic=], or Dname anode cathode [tj] model thermal"
    law = "i = is (exp(v/(n vt)) - 1), with breakdown, series resistance and charge from the .model"
    terminals = ("anode", "cathode")
    behind = ("model",)
    plain = ("diode", 4, False)
    positional = ("area",)
    flags = ("off", "thermal")
    instance = INSTANCE
    model_types = ("d",)
    is_metered = True
    current_name = "id"
    jumps = 10

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        words = [w.lower() for w in ch[1:] if w.__class__ is not tuple]
        # Dname anode cathode [tj] model thermal: the model is the last word that is no flag and no number
        more = "thermal" in words and len(ch) > 5 and ch[4].__class__ is not tuple
        if more and ch[4].lower() not in self.instance and spice_number(ch[4]) is None:
            super().read(cards, rule, [*ch[:3], *ch[4:]], line)
            self.nodes.append(node_name(ch[3]))
            return
        super().read(cards, rule, ch, line)

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if self.number("ic") and any("uic" in analysis.flags for analysis in ctx.flat.analyses):
            said, hint = (
                f"ic= of `{self.name}` (charge at the start) is not supported yet",
                ".ic v(node)=value sets its nodes",
            )
            ctx.sink.error("E297", said, self.span, hint)

    def chosen(self, read: set[str]) -> Element:
        kind = wanted(self, read)
        return self if kind is None else become(self, kind)

    @classmethod
    def model_table(cls, of: str = "") -> list[tuple[list[str], str, float, str]]:
        """Those of the law, then those that make another element of it (diodes.py), which have no default here."""
        if cls._table:
            return cls._table
        from .._engine import device_parameters

        own = device_parameters("d")
        known = {name for names, *_ in own for name in names}
        module = shipped("diode")
        rows = module.rows() if module is not None else []
        others = [(names, unit, math.nan, said) for names, unit, _, said in rows if not known & set(names)]
        lines = [([key], p.unit, math.nan, p.meaning) for key, p in OF_LINES.items()]
        cls._table += [*own, *others, *lines]
        return cls._table

    @classmethod
    def model_names(cls) -> frozenset[str]:
        return HARMLESS | {name for names, *_ in cls.model_table() for name in names}

    @property
    def has_series(self) -> bool:
        rs = self.model.params.get("rs") if self.model is not None else None
        return isinstance(rs, (int, float)) and rs > 0

    def contribute(self, ctx: Circuit) -> None:
        assert self.model is not None
        model = {
            key: float(value) for key, value in self.model.params.items() if isinstance(value, (int, float))
        }
        instance: dict[str, float] = {
            key: self.number(key) for key in ("area", "m", "pj", "w", "l") if key in self.params
        }
        p, n = ctx.node(self.nodes[0]), ctx.node(self.nodes[1])
        br = ctx.branch(self.name)
        if br is not None:
            # its current is asked for: a 0 V branch stands before the anode
            inner = ctx.inner_node(self.name + "#anode")
            ctx.b.g(p, br, 1.0)
            ctx.b.g(inner, br, -1.0)
            ctx.b.g(br, p, 1.0)
            ctx.b.g(br, inner, -1.0)
            p = inner
        if self.params.get("off"):
            ctx.b.off(self.name)
        try:
            temp, tnom = self.temperature(ctx), model.get("tnom", ctx.tnom)
            for _, inner, conductance in ctx.b.device("d", self.name, (p, n), model, instance, temp, tnom):
                ctx.series[self.name] = (p, inner, conductance)
        except ValueError as trouble:
            span = self.model.param_spans.get(str(trouble).partition("=")[0], self.model.span)
            # by the law of the band gap a small vj falls below zero in the heat; currents hold no vj
            cold = str(trouble).endswith("at its temperature") and model.get("tlevc") != 1.0
            hint = "tlevc=1 in the .model keeps vj and cjo as they are given" if cold else None
            ctx.sink.error("E299", f"`{self.name}`, .model `{self.model.name}`: {trouble}", span, hint)

    def account(self, ctx: Circuit, book: Accounts) -> None:
        """The engine keeps heat v i(v) and charge v dq of the junction; the series resistance is said here.
        At an instant: all that goes in."""
        if not book.engine:
            book.dissipates(self, self.between(ctx) * self.flow(ctx))
            return
        if self.name in ctx.series:
            p, inner, gs = ctx.series[self.name]
            drop = ctx.b.x(p) - ctx.b.x(inner) if p >= 0 else -ctx.b.x(inner)
            book.dissipates(self, gs * drop * drop)
