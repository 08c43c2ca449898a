"""What a code model is: one class, which says its connections, its parameters and what it adds to equation (1).

The duties of a code model, by who asks; `seat` is what stands in one place of a circuit (Seat):

 1. `name what law ports parameters`   its words, for messages, `emsim help`, editors and the reference.
 2. `check(seat)`    rules between its parameters, reports through `seat.wrong`.
 3. `build(seat)`    what its outputs are: `seat.drive(port, expression)`, with `seat.read(port)`, `seat[parameter]`.

Between the words of an A line and that lies a.py. Types of connections are XSPICE's:

    v  i  g  h     against ground: voltage, current, voltage in and current out, current in and voltage out
    vd id gd hd    the same between two nodes
    vnam           the current of a voltage source
    d              digital
"""

from __future__ import annotations

from ..base import Param
from ..base import named as named

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Any, ClassVar

    from ...diagnostics import Span
    from ..contract import Circuit, Expr

    Scalar = Expr | float

READS = ("v", "vd", "i", "id", "vnam")
DRIVES = ("v", "vd", "i", "id")
BOTH = ("gd", "g", "hd", "h")
DIGITAL = ("d",)


class Port:
    """A connection: its name, what it may be (the first is what it is where the line does not say), whether it is a list,
    whether it may be left open (`null`), and whether the model reads it, drives it, or both."""

    __slots__ = ("drives", "is_list", "is_open", "least", "name", "reads", "types")

    def __init__(
        self,
        name: str,
        types: tuple[str, ...] = READS,
        reads: bool = True,
        drives: bool = False,
        is_list: bool = False,
        is_open: bool = False,
        least: int = 1,
    ) -> None:
        self.name, self.types, self.reads, self.drives = name, types, reads, drives
        self.is_list, self.is_open, self.least = is_list, is_open, least


def reading(name: str, *types: str, is_list: bool = False, is_open: bool = False, least: int = 1) -> Port:
    return Port(name, types or READS, is_list=is_list, is_open=is_open, least=least)


def driving(name: str, *types: str, is_list: bool = False, is_open: bool = False) -> Port:
    return Port(name, types or DRIVES, False, True, is_list, is_open)


def both(name: str, *types: str, is_open: bool = False) -> Port:
    return Port(name, types or BOTH, True, True, is_open=is_open)


class Word(Param):
    """A parameter: meaning, unit, default, bounds, and what it is: number, flag, list, text."""

    __slots__ = ("kind", "least", "most", "otherwise", "strict")

    def __init__(
        self,
        meaning: str = "",
        unit: str = "",
        default: float | None = None,
        kind: str = "number",
        least: float = float("-inf"),
        most: float = float("inf"),
        otherwise: tuple[float, ...] | None = None,
    ) -> None:
        super().__init__(meaning, unit, default)
        self.kind, self.least, self.most = kind, least, most
        self.otherwise = otherwise  # a list's default

    def told(self) -> str:
        """Its default as tables show it."""
        if self.kind == "flag":
            return "TRUE" if self.default else "FALSE"
        if self.kind == "list":
            return f"[{' '.join(f'{v:g}' for v in self.otherwise)}]" if self.otherwise else "-"
        return "-" if self.default is None else f"{self.default:g}"


def flag(meaning: str, default: bool = False) -> Word:
    return Word(meaning, "", float(default), "flag")


def numbers(meaning: str, unit: str = "", otherwise: tuple[float, ...] | None = None) -> Word:
    return Word(meaning, unit, None, "list", otherwise=otherwise)


def text(meaning: str) -> Word:
    return Word(meaning, "", None, "text")


class CodeModel:
    name: ClassVar[str]
    what: ClassVar[str]
    law: ClassVar[str] = ""
    ports: ClassVar[tuple[Port, ...]]
    parameters: ClassVar[dict[str, Word]] = {}

    @classmethod
    def form(cls) -> str:
        words = [f"[{p.name} ...]" if p.is_list else p.name for p in cls.ports]
        return f"Aname {' '.join(words)} model"

    def check(self, seat: Seat) -> None:
        """What is wrong with its parameters."""

    def build(self, seat: Seat) -> None:
        raise NotImplementedError


class Connection:
    """One end: its type, its nodes (two, ground included; a digital one; none of a source), the source, inverted by ~?"""

    __slots__ = ("inverted", "nodes", "source", "span", "type")

    def __init__(
        self, type: str, nodes: tuple[str, ...], source: str, inverted: bool, span: Span | None
    ) -> None:
        self.type, self.nodes, self.source, self.inverted, self.span = type, nodes, source, inverted, span


class Seat:
    """One A line in its circuit."""

    def __init__(self, name: str, span: Span, model: Any, kind: type[CodeModel]) -> None:
        self.name, self.span, self.model, self.kind = name, span, model, kind
        self.at: dict[str, list[Connection]] = {}
        self.values: dict[str, Any] = {}
        self.ctx: Circuit
        # (of which nodes, current from the first to the second) of what takes or gives power
        self.flows: list[tuple[tuple[str, ...], Expr]] = []
        self._count = 0

    # ---- parameters ----

    def __getitem__(self, key: str) -> Any:
        """A parameter's value, or its default: float, bool, list, str; None where nothing was given and there is no default."""
        word = self.kind.parameters[key]
        value = self.values.get(key)
        if word.kind == "list":
            return list(word.otherwise or ()) if value is None else value
        if value is None:
            value = word.default
        if word.kind == "flag":
            return bool(value)
        if word.kind == "number" and value is not None:
            return min(max(value, word.least), word.most)
        return value

    def given(self, key: str) -> bool:
        return key in self.values

    def entry(self, key: str, k: int, default: float) -> float:
        """The k-th of a list; the default where it is shorter."""
        value = self[key]
        return float(value[k]) if k < len(value) else default

    def wrong(self, message: str, key: str = "", hint: str | None = None) -> None:
        """An error, at a parameter of the .model where that is known."""
        hint = hint or f"emsim help {self.kind.name} shows what it takes"
        span = self.model.param_spans.get(key, self.model.span)
        self.ctx.sink.error("E340", f"`{self.name}`, .model `{self.model.name}`: {message}", span, hint)

    # ---- connections ----

    def width(self, port: str) -> int:
        return len(self.at[port])

    def is_open(self, port: str) -> bool:
        return not self.at[port]

    def read(self, port: str, k: int = 0) -> Expr:
        """What stands at a connection: a voltage [V] or a current [A]."""
        return self._read(port, k)

    def all(self, port: str) -> list[Expr]:
        return [self._read(port, k) for k in range(self.width(port))]

    def _read(self, port: str, k: int) -> Expr:
        c, ctx = self.at[port][k], self.ctx
        if c.type == "vnam":
            return ctx.b.x(ctx.branches[c.source])
        if c.type in ("v", "vd", "g", "gd"):
            return ctx.v(*c.nodes)
        return ctx.b.x(ctx.branches[self.branch(port, k)])

    def branch(self, port: str, k: int) -> str:
        """The name of a connection's current: that of the line for the first one, the others' as in ngspice."""
        first = next(self._metered())
        number = [p.name for p in self.kind.ports].index(port)
        return self.name if first == (port, k) else f"{self.name}#branch_{number}_{k}"

    def branches(self) -> list[str]:
        """Currents that are unknowns: of what drives a voltage or reads a current."""
        return [self.branch(port, k) for port, k in self._metered()]

    def _metered(self) -> Iterator[tuple[str, int]]:
        for p in self.kind.ports:
            for k, c in enumerate(self.at[p.name]):
                if c.type in ("h", "hd") or c.type in (("v", "vd") if p.drives else ("i", "id")):
                    yield p.name, k

    def drive(self, port: str, value: Scalar, k: int = 0) -> None:
        """A connection is that voltage, or that current goes in at its first node and out at the second."""
        c, ctx = self.at[port][k], self.ctx
        b = ctx.b
        p, n = (ctx.node(node) for node in c.nodes)
        if c.type in ("i", "id", "g", "gd"):
            i = b.const(0.0) + value
            b.add_f(p, i)
            b.add_f(n, -i)
        else:
            br = self.join(port, k)
            b.add_f(br, -(b.const(0.0) + value))
            i = b.x(br)
        self.flows.append((c.nodes, i))

    def join(self, port: str, k: int) -> int:
        """The branch of a connection, whose row reads v(p) - v(n)."""
        c, ctx = self.at[port][k], self.ctx
        br, (p, n) = ctx.branches[self.branch(port, k)], (ctx.node(node) for node in c.nodes)
        for node, sign in ((p, 1.0), (n, -1.0)):
            ctx.b.g(node, br, sign)
            ctx.b.g(br, node, sign)
        return br

    def short(self) -> None:
        """Connections that only read a current hold no voltage."""
        for p in self.kind.ports:
            for k, c in enumerate(self.at[p.name]):
                if not p.drives and c.type in ("i", "id"):
                    self.join(p.name, k)

    # ---- digital connections ----

    def digital(self, port: str, k: int = 0) -> tuple[int, bool]:
        """(number of the node, is it inverted?)"""
        c = self.at[port][k]
        return self.ctx.digital[c.nodes[0]][0], c.inverted

    def part(self, kind: str, ports: list[list[tuple[int, bool]]], values: dict[str, list[float]]) -> None:
        """A digital part of the engine."""
        try:
            self.ctx.b.digital_part(kind, self.name, ports, values)
        except ValueError as trouble:
            self.wrong(str(trouble))

    def sensed(self, at: Expr, low: float, high: float) -> int:
        """A digital node that the equations decide: 0 up to `low`, 1 from `high` on, undefined between."""
        b = self.ctx.b
        self._count += 1
        node, _ = b.digital_node(f"{self.name}#{self._count}")
        above = b.flag(at - low, None, f"{self.name} above {low:g}")
        below = b.flag(high - at, None, f"{self.name} below {high:g}")
        b.digital_senses(node, above, below)
        return int(node)

    # ---- what several share ----

    def curve(
        self, x: Expr, xs: list[float], ys: list[float], clamped: bool = False, rounding: float = 0.0
    ) -> Expr:
        """Straight lines through points; beyond the ends along the last ones, or constant."""
        return self.ctx.table(x, list(zip(xs, ys, strict=True)), clamped, self.model.span, rounding)

    def phase(self, frequency: Expr, start: float) -> Expr:
        """Periods that have passed: the integral of a frequency [Hz]."""
        self._count += 1
        return self.ctx.idt(frequency, start, f"{self.name}#{self._count}")
