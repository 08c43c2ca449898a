"""U: a line of resistance and capacitance, as ngspice's lumps of it: from both ends inwards resistors that grow by the factor k
from one to the next, with a capacitor behind each to the third node."""

from __future__ import annotations

import math

from .base import Element, Param, Path, named

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any

    from .contract import Accounts, Circuit, Expr
    from .net import Net

FEWEST = 3  # lumps
SLOW = 35.0  # a line of so small a phase at fmax has no more of them


class RcLine(Element):
    __slots__ = ()
    letter = "u"
    what = "RC line"
    form = "Uname n1 n2 ground model l= [n=]"
    law = "lumps of r and c from both ends inwards, growing by the factor k of the model"
    terminals = ("n1", "n2", "ground")
    behind = ("model",)
    instance = named(
        l=Param("length", "m"), n=Param("number of lumps; without it by fmax of the model"),
    )  # fmt: skip
    model_types = ("urc",)
    model_words = named(
        k=Param("factor from one lump to the next", default=1.5), fmax=Param("largest frequency", "Hz", 1e9),
        rperl=Param("resistance of a length", "Ohm/m", 1000.0), cperl=Param("capacitance of a length", "F/m", 1e-15),
        isperl=Param("saturation current of a length, of diodes in place of capacitors", "A/m"),
        rsperl=Param("series resistance of these diodes", "Ohm/m"),
    )  # fmt: skip

    def check(self, ctx: Circuit) -> None:
        super().check(ctx)
        assert self.model is not None
        if "isperl" in self.model.params:
            span = self.model.param_spans.get("isperl", self.model.span)
            said = f".model `{self.model.name}`: isperl= (diodes of an RC line) is not supported yet"
            ctx.sink.error("E297", said, span, "leave it out for capacitors")
        if not self.number("l") > 0.0:
            ctx.sink.error("E281", f"`{self.name}` has no l=, which must be positive", self.span, self.hint)
        if not self._of_model("k") > 1.0:
            ctx.sink.error("E299", f".model `{self.model.name}`: k= must be greater than 1", self.model.span)

    def _of_model(self, key: str) -> float:
        assert self.model is not None
        return float(self.model.params.get(key, self.model_words[key].default or 0.0))

    def lumps(self) -> Iterator[tuple[float, float]]:
        """Resistance and capacitance of each, from the ends inwards; the last capacitor stands alone between both sides."""
        length, k = self.number("l"), self._of_model("k")
        r, c = length * self._of_model("rperl"), length * self._of_model("cperl")
        phase = 2.0 * math.pi * self._of_model("fmax") * r * c
        count = FEWEST
        if "n" in self.params:
            count = max(int(self.number("n")), 1)
        elif phase >= SLOW:
            count = max(FEWEST, int(math.log(phase * ((k - 1.0) / k) ** 2) / math.log(k)))
        first_r = 0.5 * r * (k - 1.0) / (k**count - 1.0)
        first_c = c / (2.0 * (k ** (count - 1) - 1.0) / (k - 1.0) + k ** (count - 1))
        for j in range(count):
            yield first_r * k**j, first_c * k**j

    def paths(self) -> tuple[Path, ...]:
        return ((0, 1, "conducts"), (0, 2, "blocks"))

    def contribute(self, ctx: Circuit) -> None:
        lumps = list(self.lumps())
        low, high, ground = map(ctx.node, self.nodes)
        parts: list[tuple[str, float, int, int]] = []
        for j, (r, c) in enumerate(lumps, 1):
            lo = ctx.inner_node(f"{self.name}#lo{j}")
            hi = lo if j == len(lumps) else ctx.inner_node(f"{self.name}#hi{j}")
            parts += [(f"rlo{j}", 1.0 / r, low, lo), (f"rhi{j}", 1.0 / r, high, hi)]
            parts += [
                (f"c{side}{j}", c, node, ground) for side, node in {hi: ("hi", hi), lo: ("lo", lo)}.values()
            ]
            low, high = lo, hi
        for word, value, p, n in parts:
            (ctx.b.capacitance if word[0] == "c" else ctx.b.conductance)(p, n, value)
        self.extra["parts"] = parts

    def _across(self, ctx: Circuit, p: int, n: int) -> Expr:
        plus, minus = (ctx.b.x(k) if k >= 0 else ctx.b.const(0.0) for k in (p, n))
        return plus - minus

    def current(self, ctx: Circuit, terminal: int = 0) -> Expr:
        (_, g, p, n), (_, far_g, far_p, far_n) = self.extra["parts"][:2]
        one, two = g * self._across(ctx, p, n), far_g * self._across(ctx, far_p, far_n)
        return (one, two, -(one + two))[min(terminal, 2)]

    def flow(self, ctx: Circuit) -> Expr:
        return self.current(ctx)

    def noise(self, ctx: Circuit) -> list[Any]:
        parts = self.extra["parts"]
        return [(word, self.thermal(ctx, g), 0.0, (p, n)) for word, g, p, n in parts if word[0] == "r"]

    def account(self, ctx: Circuit, book: Accounts) -> None:
        for word, value, p, n in self.extra["parts"]:
            square = self._across(ctx, p, n) * self._across(ctx, p, n)
            if word[0] == "c":
                book.holds(self, 0.5 * value * square)
            else:
                book.dissipates(self, value * square)

    def analogue(self, net: Net) -> str:
        model = self.model.name if self.model is not None else ""
        return f"{net.head(self)} {model}{net.parameters(self)}"
