"""CLOCK, BLOCK, PWM and FMU at their level: names of signals are told from parameters, voltages that they set become sources."""

from __future__ import annotations

from ..deck import MachineCard
from ..elements import LETTERS
from ..expr import SIGNAL, Binary, Name, Node, Num, rewritten
from .bind import bind_value

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..elements import Element
    from .bind import Level


def bind_clocked(card: MachineCard, level: Level) -> tuple[MachineCard, list[Element]]:
    """The card at its level, and the sources that it brings. Raises ExprError."""
    name = level.prefix + card.name
    own = (
        {"ts", *(key.partition("[")[0] for key in card.params)} - {"clock"} if card.kind == "BLOCK" else set()
    )

    def known(node: Node) -> Node | None:
        if isinstance(node, Name) and node.id in own:
            return Name(f"{SIGNAL}{name}.{node.id}", node.at)
        return None

    def told(value: Any) -> Any:
        if not isinstance(value, Node):
            return value
        return rewritten(value, known)

    params: dict[str, Any] = {}
    spans = dict(card.param_spans)
    elements = []
    for key, value in card.params.items():
        if key.startswith("out v("):  # of an FMU
            nodes = [level.node(n, None) for n in key[6:-1].split(",")]
            signal = f"v({','.join(nodes)})"
            params[f"out {signal}"] = value
            spans[f"out {signal}"] = spans[key]
            elements.append(_source(f"{name}.{nodes[0]}", nodes, f"{name}.{signal}", spans[key]))
        elif key[:2] == "v(" and card.kind == "BLOCK":
            nodes = [level.node(n, None) for n in key[2:-1].split(",")]
            signal = f"v({','.join(nodes)})"
            spans[signal] = spans[key]
            made = bind_value(told(value), level.scope)
            whole = f"{name}.{signal}"
            if isinstance(made, Name):  # a signal as it is, with its value before the first tick
                whole = made.id.removeprefix(SIGNAL)
            else:
                params[signal] = made
            elements.append(_source(f"{name}.{nodes[0]}", nodes, whole, spans[key]))
        else:
            params[key] = bind_value(told(value), level.scope)
    args = [level.ref(r) for r in card.args]
    for which, ref in zip(("high", "low"), args, strict=False):
        source = _source(f"{name}.{which}", [ref.name], f"{name}.{which}", ref.span or card.span)
        volts = params.get("level", 1.0)
        source.value = Binary("*", Num(volts if isinstance(volts, float) else 1.0), source.value)
        elements.append(source)
    flat = MachineCard(
        card.kind, name, args, params, card.wave, card.span, spans, card.line, card.units, card.groups
    )
    return flat, elements


def _source(name: str, nodes: list[str], signal: str, span: Any) -> Element:
    """B: the voltage of nodes is a signal."""
    made: Element = LETTERS["b"](name, [*nodes, "0"][:2], span, Name(SIGNAL + signal))
    made.extra = {"form": "expr", "output": "v"}
    made.value_span = span
    return made
