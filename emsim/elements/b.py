"""B: a voltage or a current that is an expression of voltages, currents, time and the machine."""

from __future__ import annotations

from ..build_expr import expression, extent
from .controlled import Controlled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..source import Line
    from .contract import Cards
    from .net import Net


class Behavioural(Controlled):
    __slots__ = ()
    letter = "b"
    what = "behavioural source"
    form = "Bname n+ n- V={expression}, or I={expression} [Laplace=H(s)]"
    law = "v or i = an expression of voltages, currents, time and the machine"
    holds_voltage = True
    jumps = 13

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        self.extra["form"] = "expr"
        for item in cards.params(self.take_transform(self.take_nodes(ch, 2), line), line, self):
            if self.value is not None:
                raise cards.fail("E102", f"{ch[0]} has a second V= or I= here", line, item)
            self.extra["output"] = item[1][0].lower()
            self.value = expression(item[1][1], line)
            self.value_span = line.span_at(*extent(item[1][1]))
        if self.value is None:
            raise cards.fail("E109", f"{ch[0]} has no V= or I=", line, ch[0], self.hint)

    @property
    def gives_voltage(self) -> bool:
        return bool(self.extra.get("output", "v") == "v")

    def analogue(self, net: Net) -> str:
        return f"{net.head(self)} {self.extra['output']}='{net.expression(self.value)}'{net.parameters(self)}"
