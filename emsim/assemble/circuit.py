"""The circuit's part of the assembly: nodes and branches, every element's stamps, the forced start."""

from __future__ import annotations

from ..cards import CARDS
from ..diagnostics import did_you_mean
from ..expr import Binary, Call, Cond, Name, Node, Unary

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from ..deck import Probe
    from ..elements import Element
    from .context import Context

LETTERS = "mqjz"  # whose terminals ngspice calls by letters; those of others have numbers


def allocate(ctx: Context) -> None:
    """Nodes in order of appearance, then one current unknown per voltage-defined element."""
    flat, sink = ctx.flat, ctx.sink
    ctx.ics = {name: value for name, value, _ in flat.ics}
    unsupported: dict[str, list[Element]] = {}
    nodes = ctx.nodes
    parameters = _parameters_read(ctx)
    for k, e in enumerate(flat.elements):
        if not e.supported:
            unsupported.setdefault(e.what, []).append(e)
            continue
        if e.model is not None and (other := e.chosen(parameters.get(e.name, set()))) is not e:
            flat.elements[k] = e = other
        if e.params or e.model is not None or e.wave is not None:
            e.check(ctx)
        ctx.elements[e.name] = e
        for name in e.wired():
            if name not in nodes:
                ctx.node(name)
        for name in e.reads():
            ctx.node(name)
    for what, elements in unsupported.items():
        names = ", ".join(f"`{e.name}`" for e in elements[:3]) + (" ..." if len(elements) > 3 else "")
        word, hint = elements[0].span.text.lower(), None
        if word.upper() in CARDS:
            from ..marks import missing_mark

            hint = missing_mark(word)
        sink.error("E297", f"{names}: {what} is not supported yet", elements[0].span, hint)

    _kinds_differ(ctx)
    _loose_shafts(ctx)
    read = set(ctx.elements) if all_currents(ctx) else _currents_read(ctx)
    also: set[str] = set()
    probed = probes_currents(ctx)
    if ctx.flat.probed:
        from .terminals import read as asked

        also = asked(ctx)
    for e in ctx.elements.values():
        needed = e.name in read or e.name in also or (ctx.is_drawn and not e.has_series)
        for name, initial in e.branches(needed):
            told = e.name in read and (e.letter not in LETTERS or not probed)
            if not told and (e.is_metered or name not in dict(e.branches(False))):
                ctx.aside.add(name)
            ctx.new_branch(name, initial)


def _kinds_differ(ctx: Context) -> None:
    """A node is digital or one of the equations."""
    for name in [name for name in ctx.digital if name in ctx.nodes]:
        e = next((e for e in ctx.elements.values() if name in (*e.nodes, *e.reads())), None)
        ctx.sink.error(
            "E342", f"node `{name}` is digital, and `{e.name if e else name}` takes it for a voltage", e.span if e else None,
            "between the two stands an A line: adc_bridge makes a voltage digital, dac_bridge the other way round",
        )  # fmt: skip


def _loose_shafts(ctx: Context) -> None:
    """Mechanical terminals of modules at nodes where nothing else is, in a deck with joints: one was meant, perhaps."""
    joints = [card.name for card in ctx.flat.machine if card.kind == "JOINT"]
    if not joints:
        return
    from ..elements.compiled import Compiled

    modules = [e for e in ctx.elements.values() if isinstance(e, Compiled)]
    loose = [(e, name) for e in modules for name in e.units() if name not in joints]
    if not loose:
        return
    at = [name for e in ctx.elements.values() for name in e.wired()]
    for e, name in loose:
        if ctx.node(name) >= 0 and at.count(name) == 1:
            ctx.remark(
                "W289",
                f"`{e.name}`: no joint is called `{name}`, and nothing else is at a node of that name",
                e.span,
                did_you_mean(name, joints, f"there are: {', '.join(joints[:8])}"),
            )


def lists_word(probes: Iterable[Probe], *words: str) -> bool:
    """Is one of these words, as it stands, among what `.save` or `.probe` lists?"""
    return any(isinstance(p.ast, Name) and p.ast.id in words for p in probes)


def probes_currents(ctx: Context) -> bool:
    """`.probe alli`, `.probe` alone, `.save alli`?"""
    return lists_word(ctx.flat.probes, "all", "alli") or lists_word(ctx.flat.saves, "alli")


def all_currents(ctx: Context) -> bool:
    """Is the current of every element asked for, so or by `.options savecurrents`?"""
    return bool(ctx.flat.options.get("savecurrents")) or probes_currents(ctx)


def _currents_read(ctx: Context) -> set[str]:
    """Names in i(...) anywhere in the deck, and in @name[...] of .save."""
    found: set[str] = set()
    for ast in _expressions(ctx):
        for call in _calls(ast):
            if call.fn == "i" and len(call.args) == 1 and isinstance(call.args[0], Name):
                found.add(ctx.element_name(call.args[0].id))
            elif call.fn == "i" and len(call.args) == 1:
                found.add(repr(call.args[0]))
            elif call.fn == "loss" and not call.args:
                found.update(e.name for e in ctx.elements.values() if e.is_metered)
        for name, _ in _device_values(ast):
            found.add(ctx.element_name(name))
    return found


def _parameters_read(ctx: Context) -> dict[str, set[str]]:
    """Element -> parameters of it that the deck reads: d1 -> {gd} of @d1[gd]."""
    found: dict[str, set[str]] = {}
    for ast in _expressions(ctx):
        for name, parameter in _device_values(ast):
            found.setdefault(name, set()).add(parameter)
    return found


def _device_values(ast: Any) -> Iterator[tuple[str, str]]:
    """(d1, id) of @d1[id], anywhere in an expression."""
    if isinstance(ast, Name):
        if ast.id.startswith("@"):
            name, _, parameter = ast.id[1:].rstrip("]").partition("[")
            yield name, parameter
        return
    parts = ast.args if isinstance(ast, Call) else [getattr(ast, key, None) for key in ("c", "a", "b")]
    for part in parts:
        if isinstance(part, Node):
            yield from _device_values(part)


def _expressions(ctx: Context) -> Iterator[Node]:
    flat = ctx.flat
    for e in flat.elements:
        if isinstance(e.value, Node):
            yield e.value
    for card in flat.machine:
        for value in card.params.values():
            for part in value if isinstance(value, tuple) else (value,):
                if isinstance(part, Node):
                    yield part
    for p in flat.prints:
        for _, ast in p.items:
            yield ast
    for measure in (*flat.measures, *flat.fours):
        yield from measure.expressions()
    for probe in (*flat.saves, *flat.probes, *flat.also, *flat.wanted):
        yield probe.ast


def _calls(ast: Any) -> Iterator[Call]:
    if isinstance(ast, Call):
        yield ast
        for arg in ast.args:
            yield from _calls(arg)
    elif isinstance(ast, Binary):
        yield from _calls(ast.a)
        yield from _calls(ast.b)
    elif isinstance(ast, Unary):
        yield from _calls(ast.a)
    elif isinstance(ast, Cond):
        yield from _calls(ast.c)
        yield from _calls(ast.a)
        yield from _calls(ast.b)


def contribute(ctx: Context) -> None:
    """Every element's stamps; then shunts asked for by options, and the forced starting values."""
    if any("uic" in a.flags for a in ctx.flat.analyses if a.kind == "tran"):
        from .initial import voltages

        ctx.given = voltages(ctx)
        for name, volts in ctx.given.items():
            ctx.b.given(ctx.nodes[name], volts)
    for e in ctx.in_turn(ctx.elements.values()):
        e.contribute(ctx)
    _couplings_possible(ctx)
    shunt = ctx.options.get("gshunt", 0.0) + (
        1.0 / ctx.options["rshunt"] if ctx.options.get("rshunt") else 0.0
    )
    for row in ctx.nodes.values():
        if shunt:
            ctx.b.g(row, row, shunt)
        if ctx.options.get("cshunt"):
            ctx.b.c(row, row, ctx.options["cshunt"])
    _forces(ctx)


def _couplings_possible(ctx: Context) -> None:
    """The coupling coefficients of all inductors, 1 on the diagonal, are a positive semidefinite matrix, or
    else some currents have negative energy. A warning, as in ngspice."""
    rows = sorted({row for pair in ctx.coupled for row in pair})
    groups: list[set[int]] = []
    for pair in ctx.coupled:
        joined = set(pair).union(*(g for g in groups if g & set(pair)))
        groups = [g for g in groups if not g & joined] + [joined]
    name = {row: coil for coil, row in ctx.branches.items()}
    for group in groups:
        order = [row for row in rows if row in group]
        matrix = [
            [1.0 if a == b else ctx.coupled.get((a, b), 0.0) + ctx.coupled.get((b, a), 0.0) for b in order]
            for a in order
        ]
        if not _semidefinite(matrix):
            missing = [
                f"{name[a]} {name[b]}" for k, a in enumerate(order) for b in order[k + 1 :]
                if (a, b) not in ctx.coupled and (b, a) not in ctx.coupled
            ]  # fmt: skip
            coils = ", ".join(f"`{name[row]}`" for row in order[:6]) + (" ..." if len(order) > 6 else "")
            ctx.sink.warning(
                "W285",
                f"the couplings of {coils} contradict each other: some currents in them would have a negative energy",
                ctx.elements[name[order[0]]].span,
                hint=f"no K couples {' nor '.join(missing[:3])}, which counts as 0: windings on one core need one K line "
                "with all of them, or a K for every pair"
                if missing
                else "three coils that are coupled by 0.9, 0.9 and -0.9 cannot exist; "
                "check signs and sizes of the coefficients",
            )


def _semidefinite(matrix: list[list[float]], slack: float = 1e-9) -> bool:
    """Cholesky's factors of matrix + slack exist; changes the matrix."""
    n = len(matrix)
    for k in range(n):
        pivot = matrix[k][k] + slack
        if pivot <= 0.0:
            return False
        for i in range(k + 1, n):
            factor = matrix[i][k] / pivot
            for j in range(k + 1, n):
                matrix[i][j] -= factor * matrix[k][j]
    return True


def _forces(ctx: Context) -> None:
    """.ic and .nodeset: rows forced while the operating point is sought."""
    for entries, kind in ((ctx.flat.ics, "ic"), (ctx.flat.nodesets, "nodeset")):
        for name, value, span in entries:
            row = ctx.nodes.get(name)
            if row is not None:
                ctx.b.force(row, float(value), kind)
            elif name not in ("0", "gnd"):
                said = f"no node is called `{name}`: this .{kind} has no effect"
                ctx.sink.warning("W294", said, span, did_you_mean(name, ctx.nodes))
