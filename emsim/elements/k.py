"""K: mutual inductance M = k sqrt(Li Lj) between every pair of the named inductors."""

from __future__ import annotations

from ..build_expr import extent
from ..expr import Node
from .base import Element, Param
from .l import Inductor

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from .._engine import Expr
    from ..assemble.accounts import Accounts
    from ..assemble.context import Context
    from ..build_elements import ElementCards
    from ..elaborate.bind import Level
    from ..reports.analogue import Net
    from ..source import Line


class Coupling(Element):
    __slots__ = ()
    accounted = "stored"
    letter = "k"
    what = "mutual inductance"
    form = "Kname Lname Lname [Lname ..] coupling"
    law = "M = k sqrt(L1 L2), flux linkage L1 i1 + M i2"
    terminals = ()
    behind = ("element", "element")
    instance: ClassVar[dict[str, Param]] = {"k": Param("coupling coefficient")}

    def read(self, cards: ElementCards, rule: str, ch: list[Any], line: Line) -> None:
        rest = cards.params(ch[1:], line, self)
        if "k" in self.params:
            rest.append(ch[-1])
        if len(rest) < 3:
            raise cards.fail("E109", f"{ch[0]} needs two inductors and a coupling", line, ch[0], self.hint)
        for item in rest[:-1]:
            if not isinstance(item, str):
                raise cards.fail("E109", f"{ch[0]} needs the names of inductors here", line, item, self.hint)
        self.extra["inductors"] = [str(r.lower()) for r in rest[:-1]]
        self.value_span = line.span_at(*extent(rest[-1]))
        self.value = (
            self.params.pop("k") if "k" in self.params else cards.number(rest[-1], line, "the coupling")
        )

    def bind(self, level: Level) -> None:
        self.extra["inductors"] = [level.prefix + name for name in self.extra["inductors"]]

    def paths(self) -> tuple[()]:
        return ()

    def contribute(self, ctx: Context) -> None:
        k = self.value if isinstance(self.value, (int, float)) else 1.0
        if abs(k) > 1.0:
            ctx.sink.error(
                "E284", f"coupling `{self.name}` of {k:g} is more than complete", self.value_span or self.span,
                hint="the coefficient lies between -1 and 1",
            )  # fmt: skip
            return
        coils: list[tuple[int, float]] = []
        for name in self.extra["inductors"]:
            coil = ctx.elements.get(ctx.element_name(name, "L"))
            if not isinstance(coil, Inductor):
                names = [x.name for x in ctx.elements.values() if isinstance(x, Inductor)]
                said = f"`{self.name}` couples `{name}`, which is no inductor of this deck"
                ctx.unknown("E285", said, name, names, self.span)
            elif isinstance(coil.value, Node):
                ctx.sink.error(
                    "E284", f"`{self.name}` couples `{coil.name}`, whose inductance is an expression", self.span,
                    hint="mutual inductance needs constant inductances",
                )  # fmt: skip
            else:
                coils.append((ctx.branches[coil.name], coil.quantity(ctx)))
        for i, (row, li) in enumerate(coils):
            for col, lj in coils[i + 1 :]:
                if col == row:
                    ctx.sink.error(
                        "E284", f"`{self.name}` couples a coil with itself", self.span, "name two coils"
                    )
                    continue
                if li * lj < 0:
                    ctx.sink.error("E284", f"`{self.name}` couples inductances of opposite sign", self.span)
                    continue
                if li > 0:
                    ctx.coupled[row, col] = ctx.coupled.get((row, col), 0.0) + k
                m = k * (li * lj) ** 0.5
                ctx.b.c(row, col, m)
                ctx.b.c(col, row, m)

    def flow(self, ctx: Context) -> Expr:
        return ctx.b.const(0.0)

    def account(self, ctx: Context, book: Accounts) -> None:
        if not isinstance(self.value, (int, float)):
            return
        names = [ctx.element_name(n, "L") for n in self.extra["inductors"]]
        coils = [coil for name in names if isinstance(coil := ctx.elements.get(name), Inductor)]
        for k, first in enumerate(coils):
            for second in coils[k + 1 :]:
                m = self.value * (first.quantity(ctx) * second.quantity(ctx)) ** 0.5
                book.holds(self, m * first.flow(ctx) * second.flow(ctx))

    def analogue(self, net: Net) -> str:
        coils = [net.name_of(name) for name in self.extra["inductors"]]
        return f"{net.head(self)} {' '.join(coils)} {float(self.value)!r}"
