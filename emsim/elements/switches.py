"""S and W.

SPICE's law: i = v/ron above threshold + |hysteresis|, v/roff below threshold - |hysteresis|, held in between.

PSpice's (a .model with von and voff, of type vswitch or iswitch): a resistance without memory, its logarithm a cubic
of the control c (PSpice A/D Reference Guide, "Voltage-Controlled Switch"):

    ln R = ln sqrt(ron roff) + ln(ron/roff) (3/2 x - 2 x^3),   x = (c - (von + voff)/2)/(von - voff) within -1/2 .. 1/2

With von < voff it is on at the lower control.
"""

from __future__ import annotations

import math

from .base import Element, Param, named
from .r import LEAST_RESISTANCE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..deck import Model
    from ..source import Line
    from .contract import Cards, Circuit, Expr
    from .net import Net


class Switch(Element):
    __slots__ = ()
    smooth_on: float  # von, ion where not given
    unit_letter: str  # of vt, vh, von, voff or it, ih, ion, ioff
    instance = named(on=Param("on at the start"), off=Param("off at the start"))
    knows_on_at_rest: bool
    jumps = 11

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        rest = self.take_control(ch)
        self.model_name, self.model_span = rest[0].lower(), line.span(rest[0])
        self.extra["initial"] = None
        for item in cards.params(rest[1:], line, self):
            if item not in ("on", "off", "ON", "OFF", "On", "Off"):
                raise cards.fail("E102", f"`{item}` does not fit here", line, item, self.hint)
            self.extra["initial"] = item.lower()

    def take_control(self, ch: list[Any]) -> list[Any]:
        """What controls it, into `nodes` or `extra`; returns what follows."""
        raise NotImplementedError

    def control(self, ctx: Circuit) -> Expr:
        raise NotImplementedError

    def flow(self, ctx: Circuit) -> Expr:
        return self.conductance(ctx) * self.between(ctx)

    def noise(self, ctx: Circuit) -> list[tuple[str, Expr | float, float]]:
        return [("", self.thermal(ctx, self.conductance(ctx)), 0.0)]

    def conductance(self, ctx: Circuit) -> Expr:
        assert self.model is not None
        p = {key: value for key, value in self.model.params.items() if isinstance(value, (int, float))}
        unit = self.unit_letter
        if self.is_smooth:
            return self.smooth_conductance(ctx, p)
        at, half = p.get(unit + "t", 0.0), abs(p.get(unit + "h", 0.0))
        if p.get(unit + "h", 0.0) < 0:
            ctx.remark(
                "W286",
                f".model `{self.model.name}`: {unit}h is negative, its magnitude is taken: on above {at + half:g}, "
                f"off below {at - half:g}",
                self.model.param_spans.get(unit + "h", self.model.span),
                f"ngspice makes it on already above {at - half:g} on the way up, off below {at + half:g} on the way down",
            )
        control = ctx.by_hand(self.name, self.control(ctx))
        if self.name not in ctx.flags:
            initial = {"on": 1, "off": 0}.get(self.extra.get("initial") or "", -1 if half == 0 else 0)
            down = control - (at - half) if half else None
            # of W's ON the operating point of ngspice knows nothing, only a start by UIC
            rest = -1 if half == 0 else int(self.knows_on_at_rest and initial == 1)
            ctx.flags[self.name] = ctx.b.flag(
                control - (at + half), down, self.name, initial, rest, "stays" if half else "arrival"
            )
        on = 1.0 / (p.get("ron", 1.0) or LEAST_RESISTANCE)
        roff = p.get("roff", 0.0)
        off = 1.0 / roff if roff else ctx.gmin
        return ctx.b.select(ctx.flags[self.name], ctx.b.const(on), ctx.b.const(off))

    def closed(self, ctx: Circuit) -> Expr:
        """More than a half where it is closed."""
        if self.is_smooth and self.model is not None:
            on, off, _, _ = self.turns(self.model.params)
            return (self.control_by_hand(ctx, on, off) - off) / (on - off)
        self.conductance(ctx)
        return ctx.flags[self.name]

    @property
    def is_smooth(self) -> bool:
        """Does its model state PSpice's law?"""
        if self.model is None:
            return False
        given, unit = self.model.params.keys(), self.unit_letter
        hysteresis = not given.isdisjoint((unit + "t", unit + "h"))
        return not given.isdisjoint((unit + "on", unit + "off")) or (
            self.model.type == self.model_types[1] and not hysteresis
        )

    @property
    def model_for_ngspice(self) -> Model | None:
        return None if self.is_smooth else self.model

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if not self.is_smooth or self.model is None:
            return
        p, unit, model = self.model.params, self.unit_letter, self.model
        if self.extra.get("initial"):
            said = f"{self.extra['initial']} of `{self.name}` has no effect, a {model.type} has no memory"
            ctx.sink.warning("W283", said, self.span)
        for key in (unit + "t", unit + "h"):
            if key in p:
                ctx.remark(
                    "W284", f".model `{model.name}`: {key}= has no effect beside {unit}on and {unit}off",
                    model.param_spans.get(key, model.span),
                    f"{unit}t and {unit}h make a switch with hysteresis, {unit}on and {unit}off one that turns smoothly",
                )  # fmt: skip
        on, off, ron, roff = self.turns(p)
        trouble = (
            f"{unit}on and {unit}off are equal" if on == off
            else "ron and roff must be positive" if min(ron, roff) <= 0.0 else ""
        )  # fmt: skip
        if trouble:
            ctx.sink.error("E299", f"`{self.name}`, .model `{model.name}`: {trouble}", model.span)
            model.params.update({unit + "on": 1.0, unit + "off": 0.0, "ron": 1.0, "roff": 1e6})

    def turns(self, p: dict[str, Any]) -> tuple[float, float, float, float]:
        """von, voff, ron, roff of PSpice's law, with its defaults."""
        unit = self.unit_letter
        return (
            p.get(unit + "on", self.smooth_on), p.get(unit + "off", 0.0), p.get("ron", 1.0), p.get("roff", 1e6)
        )  # fmt: skip

    def smooth_conductance(self, ctx: Circuit, p: dict[str, Any]) -> Expr:
        on, off, ron, roff = self.turns(p)
        control = self.control_by_hand(ctx, on, off)
        x = ctx.clamp((control - 0.5 * (on + off)) / (on - off), -0.5, 0.5)
        middle, span = 0.5 * math.log(ron * roff), math.log(ron / roff)
        return ctx.b.call("exp", -middle - span * (1.5 * x - 2.0 * x * x * x))

    def control_by_hand(self, ctx: Circuit, on: float, off: float) -> Expr:
        return ctx.by_hand(self.name, self.control(ctx), 1.0 if on > off else -1.0)

    def control_formula(self, net: Net) -> str:
        """What controls it, in an expression of ngspice."""
        raise NotImplementedError

    def control_text(self, net: Net) -> str:
        return ""

    def analogue(self, net: Net) -> str:
        if self.is_smooth and self.model is not None:
            # ngspice has no such law: its conductance as an expression
            on, off, ron, roff = self.turns(self.model.params)
            middle, span = 0.5 * math.log(ron * roff), math.log(ron / roff)
            c = f"(({self.control_formula(net)})-({0.5 * (on + off)!r}))/({on - off!r})"
            x = f"min(max({c},-0.5),0.5)"
            p, n = map(net.plain, self.nodes[:2])
            exponent = f"({-middle!r})-({span!r})*{x}*(1.5-2*{x}*{x})"
            return f"b{net.name_of(self.name)} {p} {n} i='v({p},{n})*exp({exponent})'"
        model = self.model.name if self.model else ""
        return f"{net.head(self)}{self.control_text(net)} {model} {self.extra.get('initial') or ''}".rstrip()
