"""S and W: i = v/ron above threshold + |hysteresis|, v/roff below threshold - |hysteresis|, held in between."""

from __future__ import annotations

from .base import Element, Param
from .r import LEAST_RESISTANCE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from .._engine import Expr
    from ..assemble.context import Context
    from ..build_elements import ElementCards
    from ..reports.analogue import Net
    from ..source import Line


class Switch(Element):
    __slots__ = ()
    unit_letter: str  # of vt, vh, von, voff or it, ih, ion, ioff
    instance: ClassVar[dict[str, Param]] = {"on": Param("on at the start"), "off": Param("off at the start")}
    knows_on_at_rest: bool
    jumps = 11

    def read(self, cards: ElementCards, rule: str, ch: list[Any], line: Line) -> None:
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

    def control(self, ctx: Context) -> Expr:
        raise NotImplementedError

    def flow(self, ctx: Context) -> Expr:
        assert self.model is not None
        p = {key: value for key, value in self.model.params.items() if isinstance(value, (int, float))}
        unit = self.unit_letter
        at, half = p.get(unit + "t", 0.0), abs(p.get(unit + "h", 0.0))
        if unit + "on" in p and unit + "off" in p:  # PSpice's spelling
            on_at, off_at = p[unit + "on"], p[unit + "off"]
            at, half = 0.5 * (on_at + off_at), 0.5 * abs(on_at - off_at)
        elif p.get(unit + "h", 0.0) < 0:
            ctx.remark(
                "W286",
                f".model `{self.model.name}`: {unit}h is negative, its magnitude is taken: on above {at + half:g}, "
                f"off below {at - half:g}",
                self.model.param_spans.get(unit + "h", self.model.span),
                f"ngspice makes it on already above {at - half:g} on the way up, off below {at + half:g} on the way down",
            )
        control = self.control(ctx)
        if self.name not in ctx.flags:
            initial = {"on": 1, "off": 0}.get(self.extra.get("initial") or "", -1 if half == 0 else 0)
            down = control - (at - half) if half else None
            # of W's ON the operating point of ngspice knows nothing, only a start by UIC
            rest = -1 if half == 0 else int(self.knows_on_at_rest and initial == 1)
            ctx.flags[self.name] = ctx.b.flag(
                control - (at + half), down, self.name, initial, rest, "stays" if half else "arrival"
            )
        on = 1.0 / (p.get("ron", 1.0) or LEAST_RESISTANCE)
        off = 1.0 / (p.get("roff", 0.0) or 1.0 / ctx.gmin)
        return ctx.b.select(ctx.flags[self.name], ctx.b.const(on), ctx.b.const(off)) * self.between(ctx)

    def control_text(self, net: Net) -> str:
        return ""

    def analogue(self, net: Net) -> str:
        model = self.model.name if self.model else ""
        return f"{net.head(self)}{self.control_text(net)} {model} {self.extra.get('initial') or ''}".rstrip()
