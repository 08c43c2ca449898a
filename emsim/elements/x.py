"""X: the use of a subcircuit; elaborate/flatten.py puts its cards in its place."""

from __future__ import annotations

from ..build_expr import expression, extent, machine_value, node_name, parts
from ..deck import Instance, Ref
from .base import Element

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..source import Line
    from .contract import Cards


class Use(Element):
    __slots__ = ()
    letter = "x"
    what = "subcircuit"
    form = "Xname node .. subcircuit [parameter=value ..]"
    law = "the cards of .subckt, with its nodes, bodies and joints in place of the terminals"
    terminals = ()

    @classmethod
    def of_line(cls, cards: Cards, rule: str, ch: list[Any], line: Line) -> Instance:
        refs: list[Ref] = []
        params: dict[str, Any] = {}
        for item in ch[1:]:
            if item.__class__ is not tuple:
                if item.lower() not in ("params:", "param:"):
                    refs.append(Ref(node_name(item), None, (line, item.start_pos, item.end_pos)))
            elif item[0] == "point":
                inner = item[1]
                point = tuple(machine_value(v, line) for v in parts(inner[1:]))
                refs.append(Ref(inner[0].lower(), point, line.span_at(*extent(item))))
            else:
                params[str(item[1][0].lower().removeprefix("params:"))] = expression(item[1][1], line)
        if not refs:
            raise cards.fail("E109", f"{ch[0]} names no subcircuit", line, ch[0], "form: " + cls.form)
        of = refs.pop()
        return Instance(ch[0].lower(), params, (line, ch[0].start_pos, ch[0].end_pos), refs, of)
