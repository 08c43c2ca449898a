"""What the steps of a transient told about its method, in the deck's words and with what to use instead.

The engine follows excited modes from burst to burst of steps (engine/integrate/src/monitor.rs) and hands over numbers; a
warning is worth it from a hundredth on: of an amplitude, of a period, of a signal.
"""

from __future__ import annotations

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from ..assemble import Assembly
    from ..diagnostics import Span
    from ..elements import Element
    from .base import Analysis

WORTH = 0.01  # share of an amplitude, of a period, of a signal that deserves a word
SMALL = 0.1  # an oscillation of less of the signal must lose more
OPEN = 1e-6  # m, rad: a loop that has come open
STIFF = 0.5  # share of the steps
FOLLOWED = 0.85  # share of the run that passes for all of it
# loss or lateness over a run grows as this power of the step
POWERS = {"trap": 2, "gear": 3, "trbdf2": 3}
EXPLICIT = ("rk45", "dop853")


def teach(assembly: Assembly, watch: dict[str, Any], end: float) -> None:
    """Adds at most one warning of each kind to the deck's sink. `end`: of the run [s]."""
    sink, method = assembly.flat.sink, assembly.options["method"]
    damped, late = watch.get("damped"), watch.get("late")
    if damped and damped["left"] * damped["loss"] * min(1.0, damped["share"] / SMALL) >= WORTH:
        what, span = oscillator(assembly, damped)
        # of what dies, by itself or by the method, until when its loss weighs most
        time = (
            "this run" if damped["left"] > 0.9 and whole(damped, end) else f"{damped['cycles']:.0f} periods"
        )
        sink.warning(
            "W410",
            f"{what} at {hertz(damped['period'])} with {damped['steps']:.0f} steps a period; {method} takes about "
            f"{percent(damped['loss'])} of its amplitude over {time}",
            span,
            "a numerical loss, not one of the deck: " + instead(assembly.options, damped, damped["loss"]),
        )
    elif late and late["left"] * abs(late["late"]) * min(1.0, 6.3 * late["share"]) >= WORTH:
        what, span = oscillator(assembly, late)
        off = f"{abs(late['late']):.2g} of a period {'late' if late['late'] > 0 else 'early'}"
        sink.warning(
            "W411",
            f"{what} at {hertz(late['period'])} with {late['steps']:.0f} steps a period; with {method} it is about "
            f"{off} after "
            + (
                f"the {late['cycles']:.0f} periods of this run"
                if whole(late, end)
                else f"{late['cycles']:.0f} periods"
            ),
            span,
            instead(assembly.options, late, abs(late["late"])),
        )
    if "ringing" in watch:
        unknown, t, share = watch["ringing"]
        where, lines = locate(assembly, unknown)
        sink.warning(
            "W412",
            f"{where} rings from step to step by {100 * share:.2g} % of its largest value, from about t = {t:.3g} s on",
            lines[0][0] if lines else None,
            f"{method} keeps for ever what it does not resolve; method=radau or gear damps it at once, and so does "
            "a small resistance where a capacitor or an inductor meets an ideal source",
        )
    if "second" in watch:
        where, lines = locate(assembly, watch["second"])
        sink.warning(
            "W416",
            f"{where} follows from the second derivative of a source, which no method computes: its values are errors "
            "of steps over their lengths",
            lines[0][0] if lines else None,
            "write that derivative as an expression of time, or put the resistance there that makes the first one a state",
        )
    if "open" in watch and watch["open"][1] > OPEN:
        row, gap = watch["open"]
        where, lines = locate(assembly, row)
        sink.warning(
            "W413",
            f"the loop closed by {where} has come open by {gap:.2g} (m or rad): a constraint that is kept only in its "
            "derivative drifts",
            lines[0][0] if lines else None,
            "leave projection=0 away, or use method=radau",
        )
    if method in EXPLICIT and watch.get("stiff", 0.0) > STIFF:
        sink.warning(
            "W414",
            f"stability, not accuracy, set {percent(watch['stiff'])} of the steps of {method}",
            None,
            "something dies out much faster than the run shows; method=radau steps over it",
        )


def whole(mode: dict[str, Any], end: float) -> bool:
    """Whether a mode was followed over about the whole run: only then are its figures those of the run."""
    return bool(mode["cycles"] * mode["period"] > FOLLOWED * end)


def too_long(assembly: Assembly, analysis: Analysis | None, failure: dict[str, Any]) -> Diagnostic:
    """The run was refused because of its cost."""
    steps, seconds = float(failure["steps"]), float(failure["seconds"])
    message = f"this run would need about {steps:.0e} steps ({duration(seconds)})"
    span = analysis.card.span if analysis else None
    hint = "something asks for steps that are too short for a run of this length"
    if assembly.options["method"] in EXPLICIT:
        hint += "; where that has died out long ago, method=radau steps over it"
    if failure.get("unknown_name"):
        mode = {"unknown": failure["unknown_name"], "period": failure["period"]}
        what, place = oscillator(assembly, mode)
        hint = "give it a loss that lets it die, leave it out, or shorten the run"
        source = next((e for e in assembly.ctx.elements.values() if _drives(e, mode["period"])), None)
        if source is not None:
            what, place = f"`{source.name}` oscillates", source.span
            hint = (
                f"lower the frequency of `{source.name}`, shorten the run, or put what it stands for (a mean, an "
                "envelope) in its place"
            )
        message += (
            f": {what} at {hertz(mode['period'])} and does not die away, at {failure['steps_per_period']:.0f} "
            "steps a period"
        )
        span = place or span
    allow = 10.0 ** len(f"{steps:.0f}")
    hint += f"; to run it all the same: .options maxsteps={allow:.0e}"
    return Diagnostic("error", "E414", message, span, hint)


def _drives(e: Element, period: float) -> bool:
    """Is the element a sine source of that period?"""
    return (
        e.wave is not None
        and e.wave.kind.lower() == "sin"
        and len(e.wave.args) > 2
        and abs(e.wave.args[2] * period - 1) < 0.05
    )


def _roles(e: Element) -> list[str]:
    return [role for *_, role in e.paths()]


def locate(assembly: Assembly, unknown: str) -> tuple[str, list[tuple[Span, str]]]:
    from .failure import locate as found

    return found(assembly, unknown)


def oscillator(assembly: Assembly, mode: dict[str, Any]) -> tuple[str, Span | None]:
    """`the tank l1-c1 rings`, `JOINT hinge swings`, and the place."""
    unknown = mode["unknown"]
    where, lines = locate(assembly, unknown)
    span = lines[0][0] if lines else None
    kinds = dict(zip(assembly.system.names, assembly.system.kinds, strict=True))
    if kinds.get(unknown) in ("coordinate", "speed"):
        return f"{where} swings", span
    elements = assembly.ctx.elements
    own = elements.get(unknown)
    nodes = {n for n in (own.nodes if own is not None else [unknown]) if n != "0"}
    touching = [e for e in elements.values() if nodes & set(e.nodes)]
    stores = ("inductor", "blocks")  # roles of a coil and of a capacitor
    pair = [next((e for e in touching if role in _roles(e)), None) for role in stores]
    for k, role in enumerate(stores):
        if own is not None and role in _roles(own):
            pair[k] = own
    if pair[0] is not None and pair[1] is not None:
        return f"the tank {pair[0].name}-{pair[1].name} rings", pair[0].span
    return f"{where} oscillates", span


def instead(options: dict[str, Any], mode: dict[str, Any], off: float) -> str:
    """What to use: a better method where there is one, the step and the tolerance that leave a hundredth."""
    method, reltol = options["method"], float(options.get("reltol", 1e-3))
    if method == "gear" and float(options.get("maxord", 5)) < 2:
        return "use method=radau, or leave maxord=1 away"
    power = POWERS.get(method)
    if power is None or (method == "gear" and float(options.get("maxord", 5)) > 2):
        return "use a tighter reltol"
    part = (WORTH / off) ** (1 / power)
    # the steps of these methods go with the cube root of the tolerance
    text = f"use method=radau, or a reltol of {reltol * part**3:.1g}"
    # gear falls back to order 1 now and then, whatever the step
    return (
        text
        if method == "gear"
        else text + f", or a tmax of {mode['period'] / mode['steps'] * part:.2g} s on .tran"
    )


def hertz(period: float) -> str:
    f = 1 / period
    for scale, unit in ((1e9, "GHz"), (1e6, "MHz"), (1e3, "kHz")):
        if f >= 0.9995 * scale:
            return f"{f / scale:.3g} {unit}"
    return f"{f:.3g} Hz"


def percent(x: float) -> str:
    return f"{100 * x:.2g} %" if x < 0.995 else "all"


def duration(seconds: float) -> str:
    for scale, unit in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * scale:
            return f"about {seconds / scale:.2g} {unit} at this speed"
    return f"about {f'{seconds:.2g}' if seconds < 10 else f'{seconds:.0f}'} s at this speed"
