"""C: q = C v in both nodes' charge rows. C={..} is the incremental capacitance, i = C dv/dt, as in ngspice; Q={..} is
the charge itself (LTspice: of x, its own voltage)."""

from __future__ import annotations

from ..expr import Call, Name, Node
from .base import Param, Path, ignored, named
from .passive import FILAMENT, LENGTH, OF_MODEL, SCALED, WIDTH, Passive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .contract import Accounts, Circuit, Expr


EPS0 = 8.8541878128e-12  # [F/m]


class Capacitor(Passive):
    __slots__ = ()
    accounted = "stored"
    letter = "c"
    what = "capacitor"
    form = "Cname n+ n- value [ic=] [m=], C={expression} or Q={expression}"
    law = "i = d/dt (C v), energy C v^2/2"
    unit = "F"
    quantity_name = "capacitance"
    value_names = ("cap", "capacitance")
    plain = ("capacitor", 4, True)
    instance = named(
        **SCALED, ic=Param("value at the start of a run with uic", "V"), l=LENGTH, w=WIDTH,
        cap=Param("capacitance", "F"), capacitance=Param("capacitance", "F"),
    )  # fmt: skip
    model_types = ("c", "cap")
    model_words = named(
        c=Param("capacitance", "F"), cap=Param("capacitance", "F"), cj=Param("capacitance per area", "F/m^2"),
        cjsw=Param("capacitance per edge", "F/m"),
        defw=Param("width where none is given", "m", FILAMENT), narrow=Param("etched off the width", "m", 0.0),
        short=Param("etched off the length", "m", 0.0), thick=Param("thickness of the dielectric, in place of cj", "m"),
        di=Param("relative permittivity of the dielectric", default=3.9), **OF_MODEL, **ignored("defl bv_max"),
    )  # fmt: skip
    jumps = 3
    big = (1e-12, "F", "femtofarad", "farad", "")

    def from_model(self, p: dict[str, Any]) -> float:
        cj = p.get("cj", p.get("di", 3.9) * EPS0 / p["thick"] if p.get("thick") else 0.0)
        if "l" in self.params and (cj or p.get("cjsw")):
            length = self.number("l") - p.get("short", 0.0)
            width = self.number("w", p.get("defw", FILAMENT)) - p.get("narrow", 0.0)
            return float(cj * length * width + 2 * p.get("cjsw", 0.0) * (length + width))
        return float(p.get("cap", p.get("c", 0.0)))

    def quantity(self, ctx: Circuit) -> float:
        """C [F] of a constant capacitor, `m` included."""
        return self.scaled(ctx) * self.number("m", 1.0)

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if (
            self.value is None
            and self.model is not None
            and not {"c", "cap", "cj", "cjsw", "thick"} & set(self.model.params)
        ):
            said = f"`{self.name}` has no capacitance, neither on its line nor in .model `{self.model.name}`: 0 F, as in ngspice"
            ctx.sink.warning("W293", said, self.span, "write a number after the nodes, or c= into the .model")
        if "ic" in self.params and isinstance(self.value, Node):
            said = f"ic= of `{self.name}` has no effect, its capacitance or charge is an expression"
            ctx.sink.warning("W283", said, self.span, "set the voltage of its nodes: .ic v(node)=value")
        elif "ic" in self.params and ctx.starts_at_rest():
            self.ic_unused(ctx, f".ic v({self.nodes[0]})={self.number('ic'):g}")

    def paths(self) -> tuple[Path, ...]:
        return ((0, 1, "blocks"),)

    def itself(self) -> Node:
        return Call("v", [Name(name) for name in self.nodes])

    def charge(self, ctx: Circuit) -> Expr:
        if isinstance(self.value, Node):
            return self.number("m", 1.0) * self.expression(ctx)
        return self.quantity(ctx) * self.between(ctx)

    def contribute(self, ctx: Circuit) -> None:
        p, n, b = ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), ctx.b
        self.judge_capital(ctx)
        if isinstance(self.value, Node):
            if self.is_whole:
                q = self.charge(ctx)
                b.add_q(p, q)
                b.add_q(n, -q)
            else:
                self.inject(ctx, self.flow(ctx))
            return
        if self.value is not None and not self.params and self.model is None:
            b.capacitance(p, n, self.value)
            return
        c = self.quantity(ctx)
        b.capacitance(p, n, c)
        if "ic" in self.params:
            # UIC: the charge that turns the nodes' initial voltages into the capacitor's own
            dq = c * (self.number("ic") - (ctx.initial(self.nodes[0]) - ctx.initial(self.nodes[1])))
            b.ic_charge(p, dq)
            b.ic_charge(n, -dq)

    def flow(self, ctx: Circuit) -> Expr:
        if isinstance(self.value, Node) and not self.is_whole:
            rate = ctx.ddt(self.between(ctx), f"{self.name}#dv")
            return self.number("m", 1.0) * self.expression(ctx) * rate
        return ctx.ddt(self.charge(ctx), f"{self.name}#i")

    def account(self, ctx: Circuit, book: Accounts) -> None:
        if isinstance(self.value, Node):
            book.open.append(self.name)
        else:
            v = self.between(ctx)
            book.holds(self, 0.5 * self.quantity(ctx) * v * v)
