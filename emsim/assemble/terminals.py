"""What .probe asks of terminals: vd(r1), vd(m1:d:s), vd(m1:d, m2:s), i(m1:s), i(x1:out), p(q1), p(x1), of elements and uses of
subcircuits. Columns have ngspice's names: vd_m1:d:s, i(m1:s), q1:power."""

from __future__ import annotations

from ..diagnostics import suggest
from ..elements.base import CURRENT_NAMES
from ..expr import Call, Name, Num
from .circuit import LETTERS

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .._engine import Expr
    from ..deck import Probe
    from .context import Context


class Part:
    """An element, or the use of a subcircuit: its terminals by name, and the nodes that they are at."""

    def __init__(self, ctx: Context, name: str) -> None:
        """Raises KeyError where the deck has no such thing."""
        own = ctx.element_name(name)
        self.ctx, self.name, self.element = ctx, name, ctx.elements.get(own)
        if self.element is not None:
            self.nodes = list(self.element.nodes)
            numbers = [str(k + 1) for k in range(len(self.nodes))]
            by_letter = self.element.letter in LETTERS
            self.terminals = (
                [t[0] for t in self.element.terminals[: len(self.nodes)]] if by_letter else numbers
            )
            return
        ports = next((ports for use, _, ports in ctx.flat.uses if use == name), None)
        if ports is None:
            raise KeyError(name)
        self.terminals, self.nodes = list(ports), list(ports.values())

    def place(self, terminal: str) -> int:
        """Of a terminal by its name or number. Raises ValueError."""
        if terminal in self.terminals:
            return self.terminals.index(terminal)
        if not terminal.isdecimal() or not 1 <= int(terminal) <= len(self.nodes):
            raise ValueError(
                f"`{self.name}` has no terminal `{terminal}`: it has {', '.join(self.terminals)}"
            )
        return int(terminal) - 1

    def called(self, terminal: str) -> str:
        return "0" if terminal == "0" else self.terminals[self.place(terminal)]

    def voltage(self, terminal: str) -> Expr:
        if terminal == "0" and "0" not in self.terminals:
            return self.ctx.b.const(0.0)
        return self.ctx.v(self.nodes[self.place(terminal)])

    def current(self, k: int) -> Expr:
        """Into a terminal: of a subcircuit what its elements take there. Raises ValueError where that is not told apart."""
        if self.element is not None:
            return self.element.current(self.ctx, k)
        node = self.nodes[k]
        if node in ("0", "gnd") or self.nodes.count(node) > 1:
            raise ValueError(f"what of the current at node `{node}` flows through `{self.name}` is not known")
        total = self.ctx.b.const(0.0)
        for e in self.ctx.elements.values():
            if e.name.startswith(self.name + "."):
                for j, at in enumerate(e.nodes):
                    if at == node:
                        total = total + e.current(self.ctx, j)
        return total

    def power(self) -> Expr:
        """What it takes: the sum of v i over its terminals."""
        total = self.ctx.b.const(0.0)
        for k, node in enumerate(self.nodes):
            if node not in ("0", "gnd"):
                total = total + self.ctx.v(node) * self.current(k)
        return total


def asked(probe: Probe) -> tuple[str, list[list[str]]]:
    """vd, i or p, and (device, terminal ..) of its words."""
    assert isinstance(probe.ast, Call)
    return probe.ast.fn, [arg.id.split(":") for arg in probe.ast.args if isinstance(arg, Name)]


def read(ctx: Context) -> set[str]:
    """Elements whose currents the deck asks for so."""
    found: set[str] = set()
    for probe in ctx.flat.probed:
        fn, words = asked(probe)
        for device, *_ in words if fn != "vd" else ():
            own = ctx.element_name(device)
            inner = {n for n in ctx.elements if n.startswith(device + ".")}
            found |= {own} if own in ctx.elements else inner
    return found


def probed(ctx: Context) -> Iterator[tuple[str, str, Expr]]:
    """(name, unit, expression) of each; what the deck does not have is told, and left out, as in ngspice."""
    for probe in ctx.flat.probed:
        fn, words = asked(probe)
        try:
            parts = [Part(ctx, device) for device, *_ in words]
            yield _column(fn, words, parts)
        except KeyError as error:
            name = str(error.args[0])
            if any(card.name == name for card in ctx.flat.machine) and fn in ("i", "p"):
                winding = [Num(float(w)) for w in words[0][1:] if w.isdecimal()]
                ast = Call(fn, [Name(name, probe.span), *winding], probe.span)
                yield repr(ast).replace(" ", ""), "A" if fn == "i" else "W", ctx.compile(ast, probe.span)
                continue
            near = suggest(name, [*ctx.elements, *(use for use, *_ in ctx.flat.uses)])
            ctx.sink.warning(
                "W287", f"`{probe.text}` is left out: the deck has no `{name}`", probe.span, near and f"did you mean `{near}`?"
            )  # fmt: skip
        except ValueError as error:
            ctx.sink.warning("W287", f"`{probe.text}` is left out: {error}", probe.span)


def currents(ctx: Context) -> Iterator[tuple[str, Expr]]:
    """(name, expression) of the current into every terminal of transistors and of subcircuits, for `.probe` of all: i(q1:c),
    i(x1:out), i(x2) of two terminals. Of a subcircuit's terminal at ground nothing is told."""
    uses = [name for name, *_ in ctx.flat.uses]
    for name in [*(e.name for e in ctx.elements.values() if e.letter in LETTERS), *uses]:
        part = Part(ctx, name)
        for k, terminal in enumerate(part.terminals[:1] if len(part.nodes) == 2 else part.terminals):
            try:
                yield f"i({name}:{terminal})" if len(part.nodes) != 2 else f"i({name})", part.current(k)
            except ValueError:
                continue


def _column(fn: str, words: list[list[str]], parts: list[Part]) -> tuple[str, str, Expr]:
    first, own = parts[0], words[0]
    if fn == "p" and len(own) == 1:
        return f"{first.name}:power", "W", first.power()
    if fn == "i" and len(own) < 3:
        k = first.place(own[1]) if own[1:] else 0
        called = f"{first.name}:{first.terminals[k]}" if own[1:] else first.name
        return f"i({called})", "A", first.current(k)
    if fn == "vd" and len(parts) == 2 and len(own) == len(words[1]) == 2:
        a, b = (part.called(word[1]) for part, word in zip(parts, words, strict=True))
        across = first.voltage(own[1]) - parts[1].voltage(words[1][1])
        return f"v(vd_{first.name}:{a}_{parts[1].name}:{b})", "V", across
    if fn == "vd" and len(parts) == 1 and len(own) in (1, 3):
        ends = own[1:] or ["1", "2"]
        called = ":".join(first.called(end) for end in own[1:])
        name = f"v(vd_{first.name}{':' if called else ''}{called})"
        return name, "V", first.voltage(ends[0]) - first.voltage(ends[1])
    raise ValueError("forms: vd(r1) vd(m1:d:s) vd(m1:d, m2:s) i(m1:s) p(q1)")


# ---- currents and operating values of whole elements, as columns and behavioural sources read them ----


def device_value(ctx: Context, device: str, parameter: str) -> Expr | None:
    """@device[parameter]; of a coupling of the machine its current. None for what is not computed."""
    element = ctx.elements.get(ctx.element_name(device))
    if element is not None:
        return element.probe(ctx, parameter)
    return element_current(ctx, device) if parameter in CURRENT_NAMES else None


def device_unit(ctx: Context, word: str) -> str:
    """Unit of @device[parameter]."""
    device, _, parameter = word[1:].rstrip("]").partition("[")
    element = ctx.elements.get(ctx.element_name(device))
    return "A" if element is None else element.probes(ctx).get(parameter, "A")


def element_current(ctx: Context, name: str) -> Expr | None:
    """Current into the first terminal of an element or coupling; None when there is no such thing."""
    name = ctx.element_name(name)
    index = ctx.branch(name)
    if index is not None:
        return ctx.b.x(index)
    element = ctx.elements.get(name)
    if element is None:
        return None
    return element.current(ctx)
