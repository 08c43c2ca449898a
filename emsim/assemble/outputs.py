"""Which columns a run gives, with their names and units.

Nothing asked for: every node voltage, every branch current, and what the machine offers (joint
coordinates, coupling forces). `.save` narrows that; `.save all` keeps it, and `.save allv`, as in ngspice. `.probe` adds:
`.probe alli` the currents of all elements. `.options savecurrents` adds those that are no unknowns, as `@r1[i]`.
What `.print` asks for is always there.
"""

from __future__ import annotations

from ..diagnostics import suggest
from ..expr import Binary, Call, Cond, Name, Node, Num, Unary
from .circuit import all_currents, lists_word, probes_currents

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Span
    from .context import Context

UNITS = {
    "v": "V", "i": "A", "p": "W", "power": "W", "loss": "W", "energy": "J", "ke": "J", "pe": "J",
    "angle": "rad", "omega": "rad/s", "alpha": "rad/s^2", "pos": "m", "vel": "m/s", "acc": "m/s^2",
    "x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s",
    "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2",
    "fx": "N", "fy": "N", "fz": "N", "mx": "N m", "my": "N m", "mz": "N m", "force": "N", "torque": "N m",
    "gap": "m", "deg": "deg", "rpm": "rpm",
}  # fmt: skip
KEEPS_UNIT = ("abs", "min", "max", "limit")
RUNNABLE = ("op", "tran")


class Output:
    """One column: its name as users write it, its unit, and the expression."""

    __slots__ = ("expr", "name", "unit")

    def __init__(self, name: str, unit: str, expr: Expr) -> None:
        self.name, self.unit, self.expr = name, unit, expr

    def __repr__(self) -> str:
        return f"{self.name} [{self.unit}]"


def select(ctx: Context) -> tuple[dict[str, list[Output]], list[tuple[str, list[str]]]]:
    """Columns of every analysis kind that runs, and the (kind, names) of each .print."""
    saved: dict[str, Output] = {}
    saves = ctx.flat.saves
    asked = [*saves, *ctx.flat.probes]
    if not saves or lists_word(saves, "all", "allv"):
        for output in everything(ctx):
            saved.setdefault(output.name, output)
    ignored: list[str] = []
    for probe in asked:
        if isinstance(probe.ast, Name) and probe.ast.id in ("all", "allv", "alli", "none"):
            continue
        if _left_out(ctx, probe.ast, probe.span):
            continue
        found = _saved(ctx, probe.text, probe.ast, probe.span)
        if found is None:
            ignored.append(probe.text)
        else:
            saved.setdefault(found.name, found)
    if ignored:
        ctx.sink.note("N284", f"device parameters are not recorded: {', '.join(ignored[:8])}")

    if all_currents(ctx):
        for output in currents(ctx):
            saved.setdefault(output.name, output)

    # power that appears from nowhere in a motor is always on record: the run speaks of it
    for name, power in ctx.machine.imbalances if ctx.machine is not None else ():
        saved[f"imbalance({name})"] = Output(f"imbalance({name})", "W", power)

    for probe in ctx.flat.also:
        if not (isinstance(probe.ast, Name) and probe.ast.id in ("all", "time")):
            column = _column(ctx, probe.text, probe.ast, probe.span)
            saved.setdefault(column.name, column)

    kinds = {a.kind for a in ctx.flat.analyses if a.kind in RUNNABLE} or set(RUNNABLE)
    outputs = {kind: dict(saved) for kind in kinds}
    prints: list[tuple[str, list[str]]] = []
    for card in ctx.flat.prints:
        if card.kind not in kinds:
            continue
        names: list[str] = []
        for text, ast in card.items:
            if isinstance(ast, Name) and ast.id == "all":
                names += list(saved)
                continue
            if _left_out(ctx, ast, ast.span or card.span):
                continue
            column = _column(ctx, text, ast, card.span)
            outputs[card.kind].setdefault(column.name, column)
            names.append(column.name)
        if names or not card.items:
            prints.append((card.kind, names))
    if "tran" in outputs:
        outputs["tran"].pop("time", None)  # it has that column, the first
    return {kind: list(columns.values()) for kind, columns in outputs.items()}, prints


def _left_out(ctx: Context, ast: Node, span: Span) -> bool:
    """Whether a signal is of a node that the deck does not have: told, and left out, as in ngspice."""
    if isinstance(ast, Name) and not _is_quantity(ast.id) and not ast.id.endswith("#branch"):
        ast = Call("v", [ast], ast.at)
    if not isinstance(ast, Call) or ast.fn != "v":
        return False
    for arg in ast.args:
        if isinstance(arg, Name) and arg.id not in ctx.nodes and arg.id not in ("0", "gnd"):
            near = suggest(arg.id, ctx.nodes)
            ctx.sink.warning(
                "W287", f"no node is called `{arg.id}`: {ast!r} is left out", arg.span or span, near and f"did you mean `{near}`?"
            )  # fmt: skip
            return True
    return False


def everything(ctx: Context) -> list[Output]:
    """What is recorded when nothing is asked for."""
    x = ctx.b.x
    found = [Output(f"v({name})", "V", x(i)) for name, i in ctx.nodes.items()]
    found += [Output(f"i({name})", "A", x(i)) for name, i in ctx.branches.items()]
    if ctx.machine is not None:
        for name in ctx.machine.default_outputs():
            fn, _, of = name.rstrip(")").partition("(")
            ast = Call(fn, [Name(of)])
            found.append(Output(name, unit_of(ast), ctx.compile(ast, ctx.machine.span_of(of))))
    return found


def currents(ctx: Context) -> list[Output]:
    """Of every element the current into its first terminal: i(r1) for `.probe`, else @r1[i]."""
    from .behaviour import element_current

    probed = probes_currents(ctx)
    found = []
    for e in ctx.elements.values():
        current = element_current(ctx, e.name) if e.paths() else None
        if current is None or not (probed or e.current_name):
            continue
        found.append(Output(f"i({e.name})" if probed else f"@{e.name}[{e.current_name}]", "A", current))
    return found


def _saved(ctx: Context, text: str, ast: Node, span: Span) -> Output | None:
    """A column for one thing of .save; None for a device parameter that is not a current."""
    if isinstance(ast, Name) and ast.id.startswith("@"):
        from .behaviour import device_value

        device, _, parameter = ast.id[1:].rstrip("]").partition("[")
        if device_value(ctx, device, parameter) is None:
            return None
    return _column(ctx, text, ast, span)


def _is_quantity(name: str) -> bool:
    return name in ("time", "temper", "hertz") or name.startswith("@")


def _column(ctx: Context, text: str, ast: Node, span: Span) -> Output:
    if isinstance(ast, Name) and (ast.id in ctx.nodes or not _is_quantity(ast.id)):
        # a bare name is a node, name#branch a current, as in ngspice
        ast = (
            Call("i", [Name(ast.id[:-7], ast.span)], ast.span)
            if ast.id.endswith("#branch")
            else Call("v", [ast], ast.span)
        )
        text = repr(ast)
    elif isinstance(ast, Num):
        # nodes may be called 1, 2, 3
        name = f"{ast.value:g}"
        if name in ctx.nodes:
            ast = Call("v", [Name(name, ast.span)], ast.span)
            text = repr(ast)
    name = "".join(text.split()).lower().strip("{}'\"")
    return Output(name, unit_of(ast), ctx.compile(ast, ast.span or span))


def unit_of(ast: Node) -> str:
    """Unit of an expression where it is plain: calls, their sums and multiples; "" where it is not."""
    if isinstance(ast, Call):
        if ast.fn in KEEPS_UNIT and ast.args:
            return unit_of(ast.args[0])
        unit = UNITS.get(ast.fn)
        if unit is None:
            from ..cards.joints import WORDS

            unit = WORDS.get(ast.fn, "")
        return unit
    if isinstance(ast, Name):
        if ast.id.startswith("@"):
            return "A"
        return {"time": "s", "temper": "C", "hertz": "Hz"}.get(ast.id, "")
    if isinstance(ast, (Unary, Cond)):
        return unit_of(ast.a)
    if isinstance(ast, Binary):
        return unit_of_two(ast, unit_of(ast.a), unit_of(ast.b))
    return ""


def unit_of_two(ast: Binary, a: str, b: str) -> str:
    """Unit of an operation on quantities of these units; numbers take the unit of what they stand beside."""
    if ast.op in ("+", "-"):
        return a if a == b or isinstance(ast.b, Num) else b if isinstance(ast.a, Num) else ""
    if ast.op == "*" and isinstance(ast.a, Num):
        return b
    if ast.op in ("*", "/") and isinstance(ast.b, Num):
        return a
    if ast.op == "*" and {a, b} == {"V", "A"}:
        return "W"
    if ast.op == "/" and (a, b) == ("V", "A"):
        return "Ohm"
    return ""
