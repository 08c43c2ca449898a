"""L: flux linkage L i in the branch row, minus the branch voltage. L={..} is incremental: v = L(x) di/dt;
flux={..} is the flux linkage itself, of x, its own current, as in LTspice."""

from __future__ import annotations

from ..diagnostics import DeckError, Diagnostic
from ..expr import Binary, Call, Name, Node, Num
from .base import Param, Path, ignored, named
from .cores import MU0
from .passive import OF_MODEL, SCALED, Passive

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..source import Line
    from .contract import Accounts, Cards, Circuit
    from .net import Net


class Inductor(Passive):
    __slots__ = ()
    accounted = "stored"
    letter = "l"
    what = "inductor"
    form = "Lname n+ n- value [ic=] [m=], L={expression} or flux={expression of x}"
    law = "v = d/dt (L i), energy L i^2/2"
    unit = "H"
    quantity_name = "inductance"
    value_names = ("ind", "inductance")
    plain = ("inductor", 4, True)
    instance = named(
        **SCALED, ic=Param("value at the start of a run with uic", "A"), ind=Param("inductance", "H"),
        inductance=Param("inductance", "H"), **ignored("nt"),
    )  # fmt: skip
    model_types = ("l", "ind")
    model_words = named(
        ind=Param("inductance", "H"), l=Param("inductance", "H"), **OF_MODEL, **ignored("csect dia length nt mu"),
    )  # fmt: skip
    jumps = 2

    def from_model(self, p: dict[str, Any]) -> float | None:
        value = p.get("ind", p.get("l")) if "nt" not in self.params else None  # turns of a coil of known size
        return None if value is None else float(value)

    def quantity(self, ctx: Circuit) -> float:
        """L [H] of a constant inductor, `m` included."""
        return self.scaled(ctx) / (self.number("m", 1.0) or 1.0)

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        if "m" in self.params and not self.number("m"):
            hint = "m= counts coils in parallel: leave the line out"
            ctx.sink.error("E281", f"`{self.name}` with m=0 has no inductance", self.span, hint)

    def no_value(self, cards: Cards, ch: list[Any], line: Line) -> None:
        own = [key for key in ("hc", "bs", "br") if key in self.params]
        if own:
            raise cards.fail(
                "E109",
                f"{ch[0]} has no value: {', '.join(f'{k}=' for k in own)} are of LTspice's core",
                line,
                ch[2],
                self._as_core(ch[0]),
            )
        super().no_value(cards, ch, line)

    def _as_core(self, name: str) -> str:
        """LTspice's core as windings on one. Its largest loop, B = Bs (H +- Hc)/(|H +- Hc| + Hc (Bs/Br - 1)) + mu0 H, is that of
        a play cell pinned by Hc."""
        p = {"lg": 0.0, "n": 1.0, **self.params}
        known = all(isinstance(p.get(key), float) for key in ("hc", "bs", "br", "a", "lm", "lg", "n"))
        if not known or not 0.0 < p["br"] < p["bs"]:
            return "write a core as K1 L1 1 core1 and .model core1 CORE(ms= a= k= c= area= path= ..), L1 in turns: emsim help K"
        return (
            f"write {name} n+ n- {p['n']:g} with K1 {name} 1 core1 and .model core1 CORE(law=play cells=1 c=0 "
            f"ms={p['bs'] / MU0:.6g} a={p['hc'] * (p['bs'] / p['br'] - 1.0):.6g} k={p['hc']:g} area={1e4 * p['a']:g} "
            f"path={1e2 * p['lm']:g} gap={1e2 * p['lg']:g}): the same largest loop, smaller ones are other ones; emsim help K"
        )

    @classmethod
    def model_hint(cls, of: str) -> str | None:
        return (
            "windings of a core stand in a K line: K1 L1 1 model, their values are turns"
            if of == "core"
            else None
        )

    def itself(self) -> Node:
        return Binary("/", Call("i", [Name(self.name)]), Num(self.number("m", 1.0) or 1.0))

    def branches(self, is_read: bool) -> tuple[tuple[str, float]]:
        return ((self.name, self.number("ic")),)

    def paths(self) -> tuple[Path, ...]:
        return ((0, 1, "inductor"),)

    def contribute(self, ctx: Circuit) -> None:
        br, p, n = self.join(ctx)
        b = ctx.b
        b.g(br, p, -1.0)
        b.g(br, n, 1.0)
        if self.name in ctx.wound:  # the core says its flux
            return
        if isinstance(self.value, Node):
            if self.is_whole:
                b.add_q(br, self.expression(ctx))
            else:
                scale = 1.0 / (self.number("m", 1.0) or 1.0)
                b.add_f(br, scale * self.expression(ctx) * ctx.ddt(b.x(br), f"{self.name}#di"))
            return
        b.c(br, br, self.quantity(ctx))
        if "ic" in self.params and ctx.starts_at_rest() and self.name not in ctx.starting:
            self.ic_unused(ctx, "set the node voltages by .ic")

    def account(self, ctx: Circuit, book: Accounts) -> None:
        if self.name in ctx.wound:
            return
        i = self.flow(ctx)
        if isinstance(self.value, Node):
            book.stores(self, self.between(ctx) * i)  # the current is that of all m coils
        else:
            book.holds(self, 0.5 * self.quantity(ctx) * i * i)

    def analogue(self, net: Net) -> str:
        if isinstance(self.value, Node):
            if self.is_whole:
                said = f"flux= of `{self.name}` has no counterpart in ngspice"
                raise DeckError(
                    Diagnostic("error", "E311", said, self.span, "write L={..}, the slope of the flux")
                )
            return f"{net.head(self)} l='{net.expression(self.value)}'{net.parameters(self)}"
        return super().analogue(net) + f" ic={net.initial_current(self.name)!r}"
