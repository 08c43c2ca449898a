"""Which columns a run gives, with their names and units.

Nothing asked for: every node voltage, every branch current, and what the machine offers (joint
coordinates, coupling forces). `.save` narrows that; `.save all` keeps it, and `.save allv`, as in ngspice. `.probe` adds:
`.probe`, alone or with `alli`, the currents of all elements. `.options savecurrents` adds those that are no unknowns, as
`@r1[i]`. What `.print` asks for is always there.
"""

from __future__ import annotations

from ..diagnostics import suggest
from ..expr import MEASURED, MECHANICAL, SIGNAL, Binary, Call, Cond, Name, Node, Num, Unary, to_text
from ..functions import IN_SOURCES, KNOWN, OF_COLUMNS, SAME
from ..units import product, quotient
from .circuit import LETTERS, all_currents, lists_word, probes_currents
from .context import Output

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Mapping, Sequence

    from ..deck import Print
    from ..diagnostics import Span
    from .context import Context

UNITS = {
    "v": "V", "i": "A", "p": "W", "power": "W", "loss": "W", "supplied": "W", "energy": "J", "ke": "J", "pe": "J",
    "angle": "rad", "omega": "rad/s", "alpha": "rad/s^2", "pos": "m", "vel": "m/s", "acc": "m/s^2",
    "x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s",
    "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2",
    "fx": "N", "fy": "N", "fz": "N", "mx": "N m", "my": "N m", "mz": "N m", "force": "N", "torque": "N m",
    "id": "A", "iq": "A",
    "gap": "m", "slip": "m/s", "friction": "N", "rolling": "N m", "drilling": "N m", "impulse": "N s",
    "tension": "N", "length": "m", "temp": "K", "mmf": "A", "pressure": "Pa", "heat": "W", "flux": "Wb", "flow": "m^3/s",
    "cph": "rad", "cphase": "rad",
    **{name: f.unit for name, f in KNOWN.items() if f.unit not in ("", SAME)},
}  # fmt: skip
KEEPS_UNIT = tuple(name for name, f in IN_SOURCES.items() if f.unit == SAME)
# no source computes them
AFTERWARDS = ("db", *OF_COLUMNS)
# the letters behind v and i of SPICE's words for them
WORDS = {"m": "mag", "p": "ph", "r": "re", "i": "im", "db": "db"}


def columns(ctx: Context, word: str, axis: str = "", whole: bool = True) -> list[Output]:
    """What an analysis records behind its axis: what is saved, and what the .print and .meas cards of that name ask for. Not
    `whole`: the engine gives quantities alone, and expressions follow from these, as where columns are complex."""
    asked = [output for card in ctx.flat.prints if card.kind == word for output in _asked(ctx, card)]
    found: dict[str, Output] = {}
    for output in (*saved(ctx).values(), *asked, *measured(ctx, word, axis)):
        for one in _split(ctx, output, whole):
            found.setdefault(one.name, one)
    found.pop(axis, None)  # there is that column, the first
    return list(found.values())


def printed(ctx: Context, columns: Mapping[str, Sequence[Output]]) -> list[tuple[str, list[str]]]:
    """(analysis, names of columns) of each .print of these analyses; `columns`: what each of them records."""
    found = []
    for card in ctx.flat.prints:
        if card.kind in columns:
            own = {output.name for output in columns[card.kind]}
            names = [output.name for output in _asked(ctx, card, own)]
            if names or not card.items:
                found.append((card.kind, names))
    return found


def _asked(ctx: Context, card: Print, own: Container[str] = ()) -> Iterator[Output]:
    for text, ast in card.items:
        if isinstance(ast, Name) and ast.id in own:
            yield Output(ast.id, "", None)
            continue
        if isinstance(ast, Name) and ast.id == "all":
            yield from saved(ctx).values()
        elif not _left_out(ctx, ast, ast.span or card.span):
            yield column(ctx, text, ast, card.span)


def measured(ctx: Context, word: str, axis: str = "") -> list[Output]:
    """The quantities that the .meas and .four cards of an analysis read, a column each."""
    found: dict[str, Output] = {}
    for card in (*ctx.flat.measures, *ctx.flat.fours):
        if card.analysis != word:
            continue
        for node in card.expressions():
            for leaf in _quantities(_in_words(ctx, node)):
                if isinstance(leaf, Name) and leaf.id in (axis, "last"):
                    continue
                one = column(ctx, to_text(leaf), leaf, leaf.span or card.span)
                found.setdefault(one.name, one)
    return list(found.values())


def _split(ctx: Context, output: Output, whole: bool) -> list[Output]:
    """A column that follows from others behind the quantities that it reads; any other one alone."""
    ast = output.ast
    if ast is None or _is_quantity(ast) or (whole and output.expr is not None):
        return [output]
    read = [column(ctx, to_text(leaf), leaf, leaf.span) for leaf in _quantities(ast)]
    return [*read, Output(output.name, output.unit, None, ast)]


def _quantities(ast: Node) -> Iterator[Node]:
    if _is_quantity(ast):
        yield ast
    elif not (isinstance(ast, Call) and ast.fn == MEASURED):
        for part in _operands(ast):
            yield from _quantities(part)


def _is_quantity(ast: Node) -> bool:
    """Is this one thing that the equations give, rather than what is made of such?"""
    if isinstance(ast, Call):
        return ast.fn in MECHANICAL
    return isinstance(ast, Name) and ast.id != "pi"


def _of_columns(ast: Node) -> bool:
    """Is there a function that no source knows?"""
    return (isinstance(ast, Call) and ast.fn in AFTERWARDS) or any(
        _of_columns(part) for part in _operands(ast)
    )


def _operands(ast: Node) -> list[Node]:
    if isinstance(ast, Call):
        return ast.args
    return [part for key in "cab" if isinstance(part := getattr(ast, key, None), Node)]


def _in_words(ctx: Context, ast: Node) -> Node:
    """SPICE's vdb(a,b), vp(a), im(v1) ... in the words of signals.py: db(v(a,b)), ph(v(a)), mag(i(v1))."""
    if not isinstance(ast, Call):
        return ast
    args = [_in_words(ctx, arg) for arg in ast.args]
    quantity, word = ast.fn[:1], WORDS.get(ast.fn[1:])
    if word is None or quantity not in "vi" or not all(isinstance(a, (Name, Num)) for a in args):
        return Call(ast.fn, args, ast.at)
    if quantity == "i" and ctx.element_name(repr(args[0])) not in ctx.elements:
        return Call(ast.fn, args, ast.at)  # im(a): the imaginary part of a node's voltage
    return Call(word, [Call(quantity, args, ast.at)], ast.at)


def saved(ctx: Context) -> dict[str, Output]:
    """What every analysis records, by name."""
    if ctx.saved is None:
        ctx.saved = _find_saved(ctx)
    return ctx.saved


def _find_saved(ctx: Context) -> dict[str, Output]:
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
        found = _saved(ctx, probe.text, probe.ast, probe.span) or _stated(ctx, probe.text, probe.ast)
        if found is None:
            ignored.append(probe.text)
        else:
            saved.setdefault(found.name, found)
    if ignored:
        ctx.sink.note("N284", f"device parameters are not recorded: {', '.join(ignored[:8])}")

    if ctx.flat.probed:
        from .terminals import probed

        for name, unit, expr in probed(ctx):
            saved.setdefault(name, Output(name, unit, expr))
    if all_currents(ctx):
        for output in currents(ctx):
            saved.setdefault(output.name, output)

    # power that appears from nowhere in a motor is always on record: the run speaks of it
    for name, power in ctx.machine.imbalances if ctx.machine is not None else ():
        saved[f"imbalance({name})"] = Output(f"imbalance({name})", "W", power)

    for probe in ctx.flat.wanted:
        if _is_there(ctx, probe.ast):
            output = column(ctx, probe.text, probe.ast, probe.span)
            saved.setdefault(output.name, output)
    for probe in ctx.flat.also:
        name = probe.ast.id if isinstance(probe.ast, Name) else ""
        # what an analysis alone has is found, or missed, when it has run
        if name not in ("all", "time") and not (name and ctx.names_own and name not in ctx.nodes):
            output = column(ctx, probe.text, probe.ast, probe.span)
            saved.setdefault(output.name, output)
    return saved


def _stated(ctx: Context, text: str, ast: Node) -> Output | None:
    """What the line of a device states, @r1[resistance] or @v1[dc]: the same in every row."""
    from ..elaborate.altered import VALUES, stated

    if not (isinstance(ast, Name) and ast.id.startswith("@")):
        return None
    device, _, parameter = ast.id[1:].rstrip("]").partition("[")
    element = ctx.elements.get(ctx.element_name(device))
    value = None if element is None else stated(element, parameter)
    if element is None or not isinstance(value, float):
        return None
    unit = element.unit if parameter in VALUES.get(element.letter, ()) else ""
    known = element.instance.get(parameter)
    return Output(text, unit or (known.unit if known else ""), ctx.b.const(value))


def _is_there(ctx: Context, ast: Node) -> bool:
    """Does the deck have what a command of .control reads? Where it has not, the command tells."""
    if isinstance(ast, Name) and ast.id.startswith("@"):
        from .terminals import device_value

        device, _, parameter = ast.id[1:].rstrip("]").partition("[")
        return device_value(ctx, device, parameter) is not None
    return ctx.machine is not None and isinstance(ast, Call)


def _left_out(ctx: Context, ast: Node, span: Span) -> bool:
    """Whether a signal is of a node that the deck does not have: told, and left out, as in ngspice."""
    if isinstance(ast, Name) and ast.id.removeprefix(SIGNAL) in ctx.signals:
        return False
    if isinstance(ast, Name) and not _is_word(ast.id) and not ast.id.endswith("#branch"):
        ast = Call("v", [ast], ast.at)
    if not isinstance(ast, Call) or ast.fn != "v":
        return False
    if ctx.machine is not None and ctx.machine.probe("v", ast.args, ast.span or span) is not None:
        return False  # the voltage of a card of the machine
    for arg in ast.args:
        if (
            isinstance(arg, Name)
            and arg.id not in ctx.nodes
            and arg.id not in ctx.digital
            and arg.id not in ("0", "gnd")
        ):
            near = suggest(arg.id, [*ctx.nodes, *ctx.digital])
            ctx.sink.warning(
                "W287", f"no node is called `{arg.id}`: {ast!r} is left out", arg.span or span, near and f"did you mean `{near}`?"
            )  # fmt: skip
            return True
    return False


def everything(ctx: Context) -> list[Output]:
    """What is recorded when nothing is asked for."""
    x = ctx.b.x
    found = [Output(f"v({name})", "V", x(i)) for name, i in ctx.nodes.items()]
    found += [Output(f"v({name})", "", level) for name, (_, level) in ctx.digital.items()]
    found += [
        Output(name, "", e)
        for name, e in ctx.signals.items()
        if e.value is None and not {"#", "("} & set(name)
    ]
    found += [Output(f"i({name})", "A", x(i)) for name, i in ctx.branches.items() if name not in ctx.aside]
    if ctx.machine is not None:
        for name in ctx.machine.default_outputs():
            fn, _, of = name.rstrip(")").partition("(")
            card, _, part = of.partition(",")
            ast = Call(fn, [Name(card), Num(float(part))] if part else [Name(card)])
            found.append(Output(name, unit_of(ast), ctx.compile(ast, ctx.machine.span_of(card))))
    return found


def currents(ctx: Context) -> list[Output]:
    """Of every element the current into its first terminal: i(r1) for `.probe`, else @r1[i]. `.probe` has them at every
    terminal of transistors and of subcircuits too."""
    from . import terminals

    probed = probes_currents(ctx)
    found = [Output(name, "A", expr) for name, expr in terminals.currents(ctx)] if probed else []
    for e in ctx.elements.values():
        if probed and e.letter in LETTERS:
            continue
        current = terminals.element_current(ctx, e.name) if e.paths() else None
        if current is None or not (probed or e.current_name):
            continue
        found.append(Output(f"i({e.name})" if probed else f"@{e.name}[{e.current_name}]", "A", current))
    return found


def _saved(ctx: Context, text: str, ast: Node, span: Span) -> Output | None:
    """A column for one thing of .save; None for a device parameter that is not a current."""
    if isinstance(ast, Name) and ast.id.startswith("@"):
        from .terminals import device_value

        device, _, parameter = ast.id[1:].rstrip("]").partition("[")
        if device_value(ctx, device, parameter) is None:
            return None
    return column(ctx, text, ast, span)


def _is_word(name: str) -> bool:
    return name in ("time", "temper", "hertz") or name.startswith("@")


def column(ctx: Context, text: str, ast: Node, span: Span) -> Output:
    """The column of something as users write it: a node by its name, a quantity, an expression."""
    if isinstance(ast, Name) and ast.id not in ctx.nodes and ast.id.removeprefix(SIGNAL) in ctx.signals:
        text = repr(ast)
    elif isinstance(ast, Name) and (ast.id in ctx.nodes or not _is_word(ast.id)):
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
    ast = _in_words(ctx, ast)
    unit = unit_of(ast)
    if isinstance(ast, Name) and ast.id.startswith("@"):
        from .terminals import device_unit

        unit = device_unit(ctx, ast.id)
    return Output(name, unit, None if _of_columns(ast) else ctx.compile(ast, ast.span or span), ast)


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
    """Unit of an operation on quantities of these units; in sums numbers take the unit of what they stand beside."""
    if ast.op in ("+", "-"):
        return a if a == b or isinstance(ast.b, Num) else b if isinstance(ast.a, Num) else ""
    if ast.op == "*":
        return product(a, b)
    if ast.op == "/":
        return quotient(a, b)
    if ast.op == "**" and isinstance(ast.b, Num) and ast.b.value in (1.0, 2.0, 3.0):
        found = a
        for _ in range(int(ast.b.value) - 1):
            found = product(found, a)
        return found
    return ""
