"""Why an analysis stopped, in the deck's words: line of the worst residual, what was tried, what to try."""

from __future__ import annotations

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Waveforms
    from ..assemble import Assembly
    from ..diagnostics import Span
    from .base import Analysis, Computed

CODES = {
    "no convergence": "E410", "singular": "E411", "leaves branch": "E410", "not finite": "E412", "unfit": "E413",
    "too long": "E414", "contradiction": "E418", "blocked": "E418", "signal": "E419",
    "foreign": "E516",
}  # fmt: skip


RECORD_LESS = "record less: .save the signals that matter, a larger step on .tran, a shorter run"
METHODS = ("radau", "gear")  # what may still help, in this order
RUNAWAY = 1e3  # times what it was: something feeds itself


def explain(
    assembly: Assembly, analysis: Analysis | None, waves: Waveforms, names: Sequence[str] = ()
) -> list[Diagnostic]:
    """Diagnostics for the engine's failure report; `names`: what the columns behind the time are called."""
    failure = dict(waves.failure or {})
    kept = waves.value(waves.rows - 1, 0) if waves.rows else 0.0
    where = pose(assembly, waves, ["time", *names], waves.rows - 1)
    return explain_failure(assembly, analysis, failure, kept, _growth(failure, waves, names), where)


def pose(assembly: Assembly, waves: Waveforms | Computed, names: Sequence[str], row: int) -> str:
    """The first few coordinates of the machine in a row of columns with these names; "" where none was recorded."""
    at = {name: k for k, name in enumerate(names)}
    moving = [] if assembly.machine is None or row < 0 else assembly.machine.all_coordinates()
    shown = [c.q_name for c in moving if c.q_name in at][:4]
    return ", ".join(f"{name} = {waves.value(row, at[name]):.4g}" for name in shown)


def driven_loop(assembly: Assembly) -> str:
    """The loop of joints that a DRIVE moves, in words, or ""."""
    machine = assembly.machine
    if machine is None or not machine.rows or not machine.drives:
        return ""
    from ..assemble.closing import loops_of

    return f"the loop of joints {loops_of(machine, machine.rows)}"


def not_finite(found: list[tuple[str, float, float]], analysis: Analysis) -> Diagnostic:
    """For what `Run.gaps` found."""
    names = ", ".join(name for name, _, _ in found[:4]) + (", ..." if len(found) > 4 else "")
    when = analysis.place(found[0][2])
    why = f"not finite {when}: {'without a value' if found[0][1] != found[0][1] else 'infinite'}"
    hint = "limits around what is divided by, rooted or exponentiated there, or a start elsewhere"
    return Diagnostic(
        "error", "E412", f"{names} {'is' if len(found) == 1 else 'are'} {why}", analysis.card.span, hint
    )


def explain_failure(
    assembly: Assembly,
    analysis: Analysis | None,
    failure: dict[str, Any],
    kept: float = 0.0,
    growth: str = "",
    where_it_stands: str = "",
) -> list[Diagnostic]:
    """The same for a bare report; points were kept up to the time `kept`, `growth` says what ran away, `where_it_stands` how the
    machine stood in the last of them."""
    kind = (failure := _of_unit(assembly, failure)).get("kind", "no convergence")
    if kind == "memory":
        said, hint = f"out of memory: there is no room for rows beyond t = {kept:.6g} s", RECORD_LESS
        return [Diagnostic("error", "E509", said, analysis.card.span if analysis else None, hint)]
    if kind == "unfit":
        return [_unfit(assembly, analysis, str(failure.get("why", "")))]
    if kind == "contradiction":
        from .afterwards import condition

        said, span = condition(assembly, int(failure["flag"]))
        point = "operating point" in failure.get("during", "")
        when = "at the operating point" if point else f"at t = {float(failure.get('t') or 0.0):.6g} s"
        hint = (
            "conditions that set each other off have no value; a small delay between them (R and C) gives one"
        )
        return [Diagnostic("error", CODES[kind], f"{said} contradicts itself or others {when}", span, hint)]
    if kind in ("blocked", "signal", "foreign"):
        return [{"blocked": _blocked, "signal": _signal, "foreign": _foreign}[kind](assembly, failure)]
    if kind == "too long":
        from .watch import too_long

        return [too_long(assembly, analysis, failure)]
    t, point = float(failure.get("t") or 0.0), "operating point" in failure.get("during", "")
    unknown = failure.get("row_name") or failure.get("unknown_name") or ""
    where, lines = locate(assembly, unknown)
    when = "at the operating point" if point else f"at t = {t:.6g} s" if t else "in the first step"
    what = _what(assembly, kind, unknown, where, when)
    if kind == "no convergence" and failure.get("h") and t:
        what = what.replace(when, f"{when} (step {failure['h']:.3g} s)")
    hints = []
    if failure.get("tried"):
        methods = [w.removeprefix("method ") for w in failure["tried"] if w.startswith("method ")]
        other = [w for w in failure["tried"] if not w.startswith("method ")]
        other += [f"method{'s' * (len(methods) > 1)} {', '.join(methods)}"] if methods else []
        hints.append(f"tried: {'; '.join(other)}")
    if kept and t and not point:
        hints.append(f"everything up to t = {kept:.6g} s is kept")
    mechanical, static = _mechanical(assembly, unknown), assembly.machine is not None and _static(analysis)
    if mechanical and static:
        what = f"no equilibrium was found: there is none, the machine is free to move, or the search fails, at {where}"
        hints.append(
            "to rest, the machine needs a SPRING or gravity that brings every joint back, and no constant torque "
            "or voltage that keeps one moving; .op without static holds it at ic="
        )
        if rolls := [name for name, card in assembly.machine.couplings.items() if card.spec.word == "ROLL"]:
            hints.append(
                f"on a slope there is none for what rolls ({', '.join(rolls)}): a SPRING, a STOP or FRICTION on its axle holds it"
            )
    elif mechanical and (point or not t):
        two_ways = [d.message for d in assembly.flat.sink.diagnostics if d.code == "W233"]
        hints += [f"{said}; implicit methods need one, method=auto goes on explicitly" for said in two_ways]
        hints.append(
            "try: ic= or guess= a little aside; where links lie in one line the machine could go two ways"
        )
    elif mechanical and (drives := _driving(assembly)):
        if loop := driven_loop(assembly):
            stands = f": {where_it_stands}" if where_it_stands else ""
            else_by = "" if assembly.options.get("method") == "auto" else "; method=auto may lead through it"
            hints.append(
                f"{loop} is near a change point, where links lie in one line and it could go on in another way{stands}{else_by}"
            )
        hints.append(
            f"a mechanism locks where its links come to lie in one line, and {' and '.join(drives)} goes on: no motion "
            "satisfies both\ntry: other lengths, a drive that turns back before, or a MOTOR or TORQUE in its place; the "
            "last rows show where it stands"
        )
    else:
        hints.append(growth or "try: " + _advice(assembly, failure, kind, point, unknown))
    span = lines[0][0] if lines else (analysis.card.span if analysis else None)
    return [Diagnostic("error", CODES.get(kind, "E410"), what, span, "\n".join(hints), lines)]


def _signal(assembly: Assembly, failure: dict[str, Any]) -> Diagnostic:
    """A clocked signal that is no number."""
    signal, t = str(failure.get("signal", "")), float(failure.get("t") or 0.0)
    block, _, name = signal.partition("#")[0].rpartition(".")
    card = next((c for c in assembly.flat.clocked if c.name == (block or signal)), None)
    span = None if card is None else card.param_spans.get(name, card.span)
    hint = "limit what is divided by there, and what grows from tick to tick: limit(x,lo,hi)"
    return Diagnostic(
        "error", CODES["signal"], f"`{signal}` is not finite at the tick at t = {t:.6g} s", span, hint
    )


def _of_unit(assembly: Assembly, failure: dict[str, Any]) -> dict[str, Any]:
    """The same failure; that of an FMU where one could not be evaluated."""
    refused = assembly.system.unevaluated() if assembly.ctx.unpacked else []
    if not refused or failure.get("kind") in ("foreign", "unfit"):
        return failure
    return {**failure, "kind": "foreign", "card": refused[0][0], "said": refused[0][1]}


def _foreign(assembly: Assembly, failure: dict[str, Any]) -> Diagnostic:
    """An FMU that does not go on."""
    name, t = str(failure.get("card", "")), float(failure.get("t") or 0.0)
    card = next((c for c in assembly.flat.clocked if c.name == name), None)
    file = "" if card is None else f" ({card.params['file']})"
    said = f"the FMU {name}{file} fails at t = {t:.6g} s: {failure.get('said', '')}"
    hint = "log=yes shows all that it says; what was computed up to there is kept"
    return Diagnostic("error", CODES["foreign"], said, None if card is None else card.span, hint)


def _blocked(assembly: Assembly, failure: dict[str, Any]) -> Diagnostic:
    """A DRIVE that goes on where a rigid end is."""
    from .afterwards import condition

    said, span = condition(assembly, int(failure["flag"]))
    drives = [card for card in assembly.flat.machine if card.kind == "DRIVE"]
    names = " and ".join(f"DRIVE {card.name}" for card in drives) or "prescribed motion"
    when = f"at t = {float(failure.get('t') or 0.0):.6g} s"
    hint = (
        "a DRIVE moves its joint whatever is in the way: let it turn back before, give the end a stiffness (k=), or a MOTOR or "
        "TORQUE in place of the DRIVE, which can be stopped"
    )
    lines = [(card.span, "moves on") for card in drives[:3]]
    return Diagnostic("error", CODES["blocked"], f"{names} runs into {said} {when}", span, hint, lines)


def _what(assembly: Assembly, kind: str, unknown: str, where: str, when: str) -> str:
    """The failure in one line."""
    if kind == "singular":
        if _mechanical(assembly, unknown):
            return f"nothing determines the motion at {where} {when}"
        quantity = "voltage of" if unknown in assembly.ctx.nodes else "current of"
        return f"nothing determines the {quantity} {where} {when}" if where else f"no unique solution {when}"
    if kind == "not finite":
        return f"a value is not finite {when}" + (f", at {where}" if where else "")
    if kind == "leaves branch":
        return f"the closed loop goes over to another way of moving {when}: the motion jumps at {where}"
    return f"no convergence {when}" + (f", worst at {where}" if where else "")


def _growth(failure: dict[str, Any], waves: Waveforms, names: Sequence[str]) -> str:
    """What ran away, where the last value of the worst unknown dwarfs all that it was in the first nine tenths."""
    unknown = failure.get("row_name") or failure.get("unknown_name") or ""
    shown = next((n for n in (unknown, f"v({unknown})", f"i({unknown})") if n in names), None)
    if shown is None or waves.rows < 3:
        return ""
    column, last = 1 + names.index(shown), waves.rows - 1
    early = (k * last // 200 for k in range(200))
    until = 0.9 * waves.value(last, 0)
    before = max((abs(waves.value(k, column)) for k in early if waves.value(k, 0) <= until), default=0.0)
    now = abs(waves.value(last, column))
    if not now > RUNAWAY * before > 0.0:
        return ""
    return (
        f"{shown} ran away, from at most {before:.2g} to {now:.2g} in the last tenth of what is kept: it feeds itself, or "
        "what drives it has no bound\n"
        "try: a loss, or a limit (min, max) in what drives it"
    )


def _unfit(assembly: Assembly, analysis: Analysis | None, why: str) -> Diagnostic:
    """The method cannot do the deck: what stands in its way, by name, and what can."""
    method = assembly.options.get("method", "this method")
    quoted = why.split("`")[1::2]  # names of unknowns stand in backquotes
    lines = [place for name in quoted[:3] for place in locate(assembly, name)[1][:1]]
    span = lines[0][0] if lines else (analysis.card.span if analysis else None)
    hint = "try: .options method=radau, or none at all: emsim then chooses by itself"
    said = f"method {method} cannot do this deck: {why}"
    return Diagnostic("error", CODES["unfit"], said, span, hint, lines)


def _advice(assembly: Assembly, failure: dict[str, Any], kind: str, point: bool, unknown: str) -> str:
    if kind == "singular":
        return (
            "a path to ground for every node, a small resistance in every loop of voltages; what conducts must not "
            "cancel, as a negative resistance and a positive one of the same size do"
        )
    if kind == "not finite":
        return "limits around what is divided by, rooted or exponentiated there"
    if point:
        return (
            ".nodeset near the expected voltages, or UIC with initial conditions; it may be that there is no such "
            "point, where a source asks for more than the rest can give"
        )
    tried = " ".join(failure.get("tried") or ())
    others = [f".options method={m}" for m in METHODS if m not in tried][:1]
    if unknown in assembly.ctx.nodes:
        touching = [e for e in assembly.ctx.elements.values() if unknown in e.nodes]
        if not any(role == "blocks" for e in touching for *_, role in e.paths()):
            said = f"a small capacitor from node `{unknown}` to ground: nothing there stores charge, and where no "
            others.insert(0, said + "voltage fits any more it has to jump")
        elif not point:
            others.insert(
                0, ".options cshunt=1f, a charge at every node: what switches without one has to jump"
            )
    return ", or ".join([*others, "a smaller tmax on .tran, or a looser reltol"])


def _static(analysis: Analysis | None) -> bool:
    return analysis is not None and (bool(getattr(analysis, "static", False)))


def _mechanical(assembly: Assembly, unknown: str) -> bool:
    """Is the unknown one of the machine's, or what a DRIVE gives it?"""
    if assembly.machine is None:
        return False
    kinds = dict(zip(assembly.system.names, assembly.system.kinds, strict=True))
    drives = [card.name for card in assembly.flat.machine if card.kind == "DRIVE"]
    given = any(unknown in (f"torque({name})", f"force({name})") for name in drives)
    moves = kinds.get(unknown) in ("coordinate", "speed", "lambda", "mu")
    return given or moves or unknown in assembly.machine.derivatives


def _driving(assembly: Assembly) -> list[str]:
    """The DRIVEs of a machine with a closed loop of joints that they can force."""
    if assembly.machine is None or not assembly.machine.report().get("loops"):
        return []
    return [f"DRIVE `{card.name}`" for card in assembly.flat.machine if card.kind == "DRIVE"]


def locate(assembly: Assembly, unknown: str) -> tuple[str, list[tuple[Span, str]]]:
    """What an unknown is called in the deck, and the lines that have to do with it."""
    ctx, flat = assembly.ctx, assembly.flat
    if not unknown:
        return "", []
    element = ctx.elements.get(unknown) or ctx.elements.get(unknown.partition("#")[0])
    if unknown in ctx.nodes:
        touching = [e for e in ctx.elements.values() if unknown in e.nodes]
        # sources and switches first: they are what jumps
        touching.sort(key=lambda e: -e.jumps)
        lines = [(e.span, f"at node `{unknown}`") for e in touching[:3]]
        cards = [c for c in flat.machine if any(ref.name == unknown for ref in c.args)]
        lines += [(c.span, f"at node `{unknown}`") for c in cards[:1]]
        return f"node `{unknown}`", lines
    if element is not None:
        return f"`{element.name}`", [(element.span, "here")]
    # angle(hinge), lambda(x, small), i(m1): the card named in the brackets
    inside = unknown.partition("(")[2].rstrip(")")
    words = {unknown, *inside.replace(" ", "").split(",")}
    for card in flat.machine:
        if card.name in words:
            return f"{card.kind} `{card.name}`", [(card.span, "here")]
    return f"`{unknown}`", []
