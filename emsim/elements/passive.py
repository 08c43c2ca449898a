"""R, L and C: a number, a model or an expression in one place; temperature, geometry, multiplier."""

from __future__ import annotations

from ..build_expr import expression, extent, node_name, renamed
from ..diagnostics import Fix
from ..expr import OWN, Name, Node, Num, rewritten
from ..traced import number
from .base import TC, TEMPERATURE, Element, M, Param, ignored

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, ClassVar

    from ..source import Line
    from .contract import Cards, Circuit, Expr
    from .net import Net

FILAMENT = 10e-6  # default width and length of R and C models [m]

SCALED = {
    **M, **TEMPERATURE, **TC, "tce": Param("exponential change with temperature", "%/K", 0.0),
    "scale": Param("factor on the value", default=1.0),
    "tol": Param("how far it may be off, for emsim sweep", "%"), **ignored("bv_max pwr v irms ipk"),
}  # fmt: skip
LENGTH, WIDTH = Param("length, with a model", "m"), Param("width, with a model", "m")
OF_MODEL = {
    "tc1": TC["tc1"], "tc2": TC["tc2"], "tnom": Param("temperature of the parameters", "C"),
}  # fmt: skip


class Passive(Element):
    __slots__ = ()
    value_or_model = True
    may_have_tc = True
    labels = frozenset(("mfg", "pn", "type"))  # of LTspice's data base of parts
    quantity_name: str  # "resistance", for messages
    value_names: ClassVar[tuple[str, ...]]  # words that give the value by name

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        self.nodes = [node_name(ch[1]), node_name(ch[2])]
        # the value or the model comes first, or a word that names the value
        first = 0 if len(ch) > 3 and ch[3].__class__ is not tuple and ch[3].lower() in self.value_names else 1
        for item in cards.params(self.with_names(cards, ch[3:], first), line, self):
            if item.__class__ is tuple:
                node = expression(item if item[0] == "braced" else item[1][1], line)
                if item[0] in ("own_q", "own_flux"):
                    self.extra["whole"] = True
                    dialect = line.file.dialect
                    if item[0] == "own_flux" or (dialect is not None and dialect.own_quantity):
                        node = renamed(node, "x", OWN)
                value: Any = node.value if isinstance(node, Num) else node
            else:
                value = cards.word(item, line)
                if isinstance(value, str):
                    if value in ("off", "noiseless"):
                        if value == "noiseless":
                            self.params["noisy"] = 0.0
                        continue
                    if self.model_name is not None:
                        raise cards.fail("E102", f"`{item}` does not fit here", line, item, self.hint)
                    self.model_name, self.model_span = value, line.span(item)
                    continue
            if self.value is not None:
                raise cards.second_value(f"{ch[0]} has a second value here", line, item, self.hint)
            self.value, self.value_span = value, line.span_at(*extent(item))
        for key in self.value_names:
            if key in self.params:  # it stands above a value without a name, as in ngspice
                self.value, self.value_span = self.params.pop(key), self.span
        if self.value is None and self.model_name is None:
            self.no_value(cards, ch, line)
        self.is_plain = cards.are_numbers([self.value, *self.params.values()]) and "tol" not in self.params

    def no_value(self, cards: Cards, ch: list[Any], line: Line) -> None:
        raise cards.fail("E109", f"{ch[0]} has no value", line, ch[2], self.hint)

    @property
    def may_behave(self) -> bool:
        return True

    def from_model(self, p: dict[str, Any]) -> float | None:
        """What the parameters of a model make of it, or None."""
        raise NotImplementedError

    def nominal(self, ctx: Circuit) -> float:
        """The value on the line, or what the model makes of it; an error when there is neither."""
        if isinstance(self.value, (int, float)):
            return number(self.value)
        value = self.from_model(self.model.params if self.model else {})
        if value is None:
            ctx.sink.error(
                "E281", f"`{self.name}` has no {self.quantity_name}", self.span,
                hint="write a number after the nodes"
                + (f", or into .model `{self.model.name}`" if self.model else ""),
            )  # fmt: skip
            return 1.0
        return value

    # a capital that is small: below which value it may stand, what it makes, what was meant, what to write
    big: ClassVar[tuple[float, str, str, str, str]] = (0.0, "", "", "", "")

    def judge_capital(self, ctx: Circuit) -> None:
        """W112: SPICE knows no capitals. A resistor of 1M has 1 milliohm, a capacitor of 1F 1 femtofarad."""
        below, letter, made, meant, written = self.big
        if not isinstance(self.value, float) or not self.value < below or (span := self.value_span) is None:
            return
        digits = span.text[:-1]
        if span.text[-1:] == letter and digits.replace(".", "", 1).isdigit():
            said = f"`{span.text}` is {digits} {made}, not {digits} {meant}: SPICE knows no capitals"
            ctx.sink.warning("W112", said, span, fixes=[Fix(span, digits + written)])

    @property
    def is_whole(self) -> bool:
        """Is the expression the charge or the flux linkage, not what changes with a volt or an ampere?"""
        return bool(self.extra.get("whole"))

    def itself(self) -> Node:
        """What LTspice's `x` reads in that expression."""
        raise NotImplementedError

    def with_itself(self) -> Node:
        """The value, with what it reads of the element itself in place of `x`."""
        assert isinstance(self.value, Node)
        return rewritten(self.value, lambda n: self.itself() if isinstance(n, Name) and n.id == OWN else None)

    def expression(self, ctx: Circuit, holds: Callable[[], frozenset[str]] | None = None) -> Expr:
        self.value = self.with_itself() if isinstance(self.value, Node) else self.value
        return super().expression(ctx, holds)

    def scaled(self, ctx: Circuit) -> float:
        return self.nominal(ctx) * self.temperature_factor(ctx) * self.number("scale", 1.0)

    def analogue(self, net: Net) -> str:
        if isinstance(self.value, Node):
            key = "q" if self.is_whole else self.letter
            return f"{net.head(self)} {key}='{net.expression(self.with_itself())}'{net.parameters(self)}"
        return super().analogue(net)
