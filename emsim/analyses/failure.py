"""Why an analysis stopped, in the deck's words: line of the worst residual, what was tried, what to try."""

from __future__ import annotations

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Waveforms
    from ..assemble import Assembly
    from ..deck import Analysis
    from ..diagnostics import Span

CODES = {
    "no convergence": "E410",
    "singular": "E411",
    "not finite": "E412",
    "unfit": "E413",
    "too long": "E414",
}


def explain(assembly: Assembly, analysis: Analysis | None, waves: Waveforms) -> list[Diagnostic]:
    """Diagnostics for the engine's failure report."""
    return explain_failure(assembly, analysis, dict(waves.failure or {}), waves.rows)


def explain_failure(
    assembly: Assembly, analysis: Analysis | None, failure: dict[str, Any], rows: int
) -> list[Diagnostic]:
    """The same for a bare report; `rows` points were kept."""
    kind = failure.get("kind", "no convergence")
    if kind == "unfit":
        return [_unfit(assembly, analysis, str(failure.get("why", "")))]
    if kind == "too long":
        from .watch import too_long

        return [too_long(assembly, analysis, failure)]
    t, during = float(failure.get("t") or 0.0), failure.get("during") or "transient"
    at_start = "operating point" in during or t == 0.0
    where, lines = locate(assembly, failure.get("row_name") or failure.get("unknown_name") or "")
    when = "at the operating point" if at_start else f"at t = {t:.6g} s"
    step = f" (step {failure['h']:.3g} s)" if failure.get("h") and not at_start else ""
    what = {
        "singular": f"the equations have no unique solution {when}",
        "not finite": f"a value is not finite {when}",
    }.get(kind, f"no convergence {when}{step}")
    span = lines[0][0] if lines else (analysis.span if analysis else None)
    if where:
        what += f", worst at {where}"
    hints = []
    if failure.get("tried"):
        hints.append(f"tried: {', '.join(failure['tried'])}")
    if rows and not at_start:
        hints.append(f"everything up to t = {t:.6g} s is kept")
    unknown = failure.get("unknown_name") or failure.get("row_name") or ""
    mechanical, static = _mechanical(assembly, unknown), assembly.machine is not None and _static(analysis)
    if mechanical and static:
        what = f"the machine has no equilibrium, or is free to move, at {where}"
    locked = mechanical and not at_start and _driven_loop(assembly)
    if locked:
        hints.append(
            "where links come to lie in one line a mechanism locks, and a DRIVE that goes on has no solution; "
            "look at the last rows, and at the lengths"
        )
    if not (mechanical and at_start):
        hints.append("try: " + _advice(kind, at_start, assembly))
    if static:
        hints.append(
            "to rest, the machine needs a SPRING or gravity that brings every joint back, and no constant torque "
            "or voltage that keeps one moving; .op without static holds it at ic="
        )
    elif mechanical and at_start:
        hints.append(
            "try: ic= or guess= a little aside; where links lie in one line the machine could go two ways"
        )
    return [Diagnostic("error", CODES.get(kind, "E410"), what, span, "\n".join(hints), lines)]


def _unfit(assembly: Assembly, analysis: Analysis | None, why: str) -> Diagnostic:
    """The method cannot do the deck: what stands in its way, by name, and what can."""
    method = assembly.options.get("method", "this method")
    quoted = why.split("`")[1::2]  # names of unknowns stand in backquotes
    lines = [place for name in quoted[:3] for place in locate(assembly, name)[1][:1]]
    span = lines[0][0] if lines else (analysis.span if analysis else None)
    hint = "try: .options method=radau, or gear; implicit methods need no such solution"
    return Diagnostic(
        "error", CODES["unfit"], f"method {method} cannot do this deck: {why}", span, hint, lines
    )


def _advice(kind: str, at_start: bool, assembly: Assembly) -> str:
    if kind == "singular":
        return "a path to ground for every node, and a small resistance in every loop of voltages"
    if kind == "not finite":
        return "limits around what is divided by, rooted or exponentiated there"
    if at_start:
        return ".nodeset near the expected voltages, or UIC with initial conditions"
    other = "radau" if assembly.options.get("method") != "radau" else "gear"
    return f"a smaller tmax on .tran, .options method={other}, or a looser reltol"


def _static(analysis: Analysis | None) -> bool:
    return analysis is not None and ("static" in analysis.flags or "static" in analysis.args)


def _mechanical(assembly: Assembly, unknown: str) -> bool:
    """Is the unknown one of the machine's?"""
    kinds = dict(zip(assembly.system.names, assembly.system.kinds, strict=True))
    return assembly.machine is not None and kinds.get(unknown) in ("coordinate", "speed", "lambda", "mu")


def _driven_loop(assembly: Assembly) -> bool:
    """Is there a closed loop of joints that a DRIVE can force?"""
    loops = assembly.machine is not None and assembly.machine.report().get("loops")
    return bool(loops) and any(card.kind == "DRIVE" for card in assembly.flat.machine)


def locate(assembly: Assembly, unknown: str) -> tuple[str, list[tuple[Span, str]]]:
    """What an unknown is called in the deck, and the lines that have to do with it."""
    ctx, flat = assembly.ctx, assembly.flat
    if not unknown:
        return "", []
    element = ctx.elements.get(unknown) or ctx.elements.get(unknown.partition("#")[0])
    if unknown in ctx.nodes:
        touching = [e for e in ctx.elements.values() if unknown in e.nodes]
        # sources and switches first: they are what jumps
        touching.sort(key=lambda e: "BSWDEGHFVICLR".find(e.letter.upper()))
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
