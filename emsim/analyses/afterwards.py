"""What a run has to say besides its columns: limits that were reached, power that came from nowhere."""

from __future__ import annotations

import math

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Waveforms
    from ..assemble import Assembly
    from ..diagnostics import Span
    from .base import Analysis, Computed, Run


# A free motion of several coordinates is run once more with a reltol that is FINER times as small; where that changes a column
# by more than SHARE of its range at some time of the print grid, errors of the tolerance's size have grown too much.
FINER, SHARE = 10.0, 0.03
KNOWN = 10.0  # tolerances of its size: nearer two runs need not be
# where no column of these moves further all stands still, but for rounding
STILL, MOTION = 1e-9, ("m", "rad", "m/s", "rad/s")
RELTOL = 1e-3  # where the deck says nothing
TRAPEZOIDS = 1e-4  # trap is told of what it does not hold below
FREE = 2  # degrees of freedom: with one, errors shift the phase and no more
MOST = 5000  # rows of a run that is short enough to be run twice
WORK = 1e5  # steps times unknowns of such a run: it takes some hundredths of a second
SMALLER = "the results around there are wrong by as much; take a smaller reltol, or another .options method="
ZERO = 1e-20  # divisors below this make results of no sense

NOTHING = (
    1e-15  # m, rad, and per second: a nucleus wide; a part that rests in its stop is that far off by rounding
)


def remarks(assembly: Assembly, run: Run) -> None:
    """Adds warnings and notes to the deck's sink."""
    _domains(assembly, run)
    _said(assembly)
    waves: Any = run.waves
    if waves.hanging is not None:
        row, *found = waves.hanging
        at = run.analysis.place(waves.value(row, 0)) if run.kind == "dc" else "at the operating point"
        hangs(assembly, at, *found)
    if (found := getattr(waves, "unstable", None)) is not None:
        ends = run.kind == "tran" and not found[3]
        said = (
            "the run ends at rest where the circuit does not stay"
            if ends
            else "the operating point is unstable"
        )
        unstable(assembly, run.analysis, said, found)
    if any(run.waves.watch.values()):
        from .watch import teach

        rows = run.waves.rows
        teach(assembly, run.waves.watch, run.waves.value(rows - 1, 0) if rows else 0.0)
    if run.kind == "tran":
        _start(assembly, run)
        _second_order(assembly)
        _conditions(assembly, run)
        _short_steps(assembly, run)
        if run.waves.status != "failed":
            _invariants(assembly, run)
    if assembly.machine is None:
        return
    _limits(assembly, run)
    _openings(assembly, run)
    over_time = run.axis is not None and run.axis.name == "time"
    if over_time or run.kind == "op":
        _pulls(assembly, run, over_time)
    if run.kind == "tran" and run.waves.status == "ok":
        _amplified(assembly, run)
    if over_time and run.waves.rows > 1:
        _imbalances(assembly, run)


def _said(assembly: Assembly) -> None:
    """Messages of the deck's FMUs, each once."""
    if not assembly.ctx.unpacked:
        return
    by_card: dict[str, dict[str, int]] = {}
    for name, text in assembly.system.said():
        texts = by_card.setdefault(name, {})
        texts[text] = texts.get(text, 0) + 1
    for name, texts in by_card.items():
        card = next(c for c in assembly.flat.clocked if c.name == name)
        told = [text + (f" ({times} times)" if times > 1 else "") for text, times in texts.items()]
        said = f"the FMU {name} says: {'; '.join(told)}"
        if card.params.get("log") == "yes":
            assembly.flat.sink.note("N386", said, card.span)
        else:
            assembly.flat.sink.warning("W386", said, card.span, "log=yes tells all that it says")


def unstable(
    assembly: Assembly, analysis: Analysis, said: str, found: tuple[int, float, float, bool]
) -> None:
    """A rest that the least disturbance leads away from: an operating point, the start of a transient, or its end."""
    from .failure import locate

    unknown, grows, turns, at_start = found
    where, _ = locate(assembly, assembly.system.names[unknown])
    if at_start:
        said += ", and roundings decide which way the run goes from there"
    how = "grows" if not grows else f"grows e-fold in {1.0 / grows:.3g} s"
    if turns:
        how += f", at {turns / (2.0 * math.pi):.3g} Hz"
    start = "off on a device" if not turns else "a source that begins with a step, ic= with uic"
    assembly.flat.sink.note(
        "N403",
        f"{said}: the least disturbance {how}, most at {where}",
        analysis.card.span,
        f"in nature noise is enough; here {start}, .ic or .nodeset v(node)= a little aside leads away",
    )


def _start(assembly: Assembly, run: Run) -> None:
    """A transient that starts from a substitute of the operating point."""
    waves: Any = run.waves  # of a transient
    if waves.substitute is None:
        return
    k, holds = waves.substitute
    what, span = condition(assembly, k)
    element = assembly.ctx.elements.get(assembly.system.flag_names[k])
    how = ("on" if holds else "off") if element is not None else "true" if holds else "false"
    assembly.ctx.remark(
        "W418",
        f"there is no operating point: {what} contradicts itself or others. The run starts where it is {how}, with all that is "
        "continuous solved for",
        span,
        "uic starts from given values; .ic v(node)= gives a node of this start, .nodeset says where the point is sought",
    )


def _second_order(assembly: Assembly) -> None:
    """Trapezoids where more is asked for than they hold: with local errors of a tolerance tol, which go with h^3, errors of
    the run go with h^2, as tol^(2/3)."""
    options = assembly.options
    reltol = options.get("reltol", RELTOL)
    if options["method"] == "trap" and reltol < TRAPEZOIDS and "fixed_step" not in options:
        assembly.flat.sink.note(
            "N402",
            f"trap does not hold reltol={reltol:g}: its errors fall as reltol^(2/3), "
            f"so they are {(RELTOL / reltol) ** (1 / 3):.0f} times as many tolerances as at {RELTOL:g}",
            assembly.flat.option_spans.get("reltol"),
            "radau, or no .options method= at all, hold such tolerances",
        )


def hangs(assembly: Assembly, at: str, unknown: int, volts: float, amperes: float) -> None:
    """An operating point that is one by gmin alone: a node, its voltage, the most that gmin carries [A]."""
    from .failure import locate

    where, lines = locate(assembly, assembly.system.names[unknown])
    assembly.ctx.remark(
        "W408",
        f"only gmin holds {where} {at}: it carries {amperes:.3g} A, at {volts:.4g} V",
        lines[0][0] if lines else None,
        "without gmin there is no such point, and no other one was found: is a junction turned around, or a path for that "
        "current missing? .nodeset says where the point is looked for",
    )


def _domains(assembly: Assembly, run: Run) -> None:
    """Functions that were evaluated outside their domain, each once with its first time; divisors that were
    zero at the operating point."""
    domains, divisors = assembly.ctx.domains, assembly.ctx.divisors
    if not (domains or divisors) or not run.waves.rows:
        return
    names = assembly.system.flag_names
    first: dict[str, float] = {}
    if not run.uic:
        watched = [flag for flag, _, _ in domains.values()]
        watched += [e for quotient, by, _ in divisors.values() for e in (quotient, by)]
        start = assembly.system.op(watched, assembly.options)
        if start.status == "ok":
            first = {name: 0.0 for k, name in enumerate(domains, 1) if start.value(0, k) > 0.5}
            for k, (_, _, span) in enumerate(divisors.values()):
                at = 1 + len(domains) + 2 * k
                # 0/0 counts as 0 and needs no word
                if abs(start.value(0, at + 1)) < ZERO and abs(start.value(0, at)) > 1.0:
                    _divided_by_zero(assembly, span)
    for t, index, value in run.waves.events:
        if value and names[index] in domains:
            first.setdefault(names[index], t)
    for name, t in first.items():
        _, text, span = domains[name]
        hint = "keep its argument where it has a value, by max(.., 0) for instance"
        assembly.flat.sink.warning("W402", f"{text}; first at t = {t:.6g} s", span, hint)


def _conditions(assembly: Assembly, run: Run) -> None:
    """Flags that were not what their conditions say: stuck, or sliding along their threshold."""
    waves: Any = run.waves  # of a transient
    for t, k in waves.broken:
        what, span = condition(assembly, k)
        assembly.flat.sink.warning(
            "W404", f"{what} is not what it says, first at t = {t:.6g} s", span,
            hint="this is a fault of emsim, please report it with the deck; a smaller tmax on .tran may help",
        )  # fmt: skip
    for k in waves.chattering:
        what, span = condition(assembly, k)
        hint = "a hysteresis, or a capacitance behind it, says how fast it turns"
        if _pushes(assembly, span):
            hint = "dry friction is a card, which sticks exactly: FRICTION name joint fc=.. (and rigid ends are STOP, or CONTACT)"
        assembly.flat.sink.warning(
            "W405", f"{what} turns again and again: it is followed to 1e-4 of the run", span, hint
        )


def stepped(run: Run) -> list[float]:
    """Times at which the modes of friction and contacts were found by a short step."""
    waves: Any = run.waves  # of a transient
    times: list[float] = waves.short_steps
    return times


def _short_steps(assembly: Assembly, run: Run) -> None:
    """Where modes of friction and contacts did not follow from their events."""
    waves: Any = run.waves  # of a transient
    first: dict[str, list[float]] = {}
    for t, k in waves.jams:
        first.setdefault(assembly.system.flag_names[k].split()[1], []).append(t)
    for name, times in first.items():
        card = assembly.machine.couplings[name]
        said = f"{card.spec.word} {name} jams at t = {times[0]:.6g} s: no finite force keeps it sliding with so much friction"
        often = f"so {len(times)} times; " if len(times) > 1 else ""
        hint = f"its slip stops at once; {often}with less mu= it does not, and elastic parts (k=) show that instant"
        assembly.flat.sink.warning("W421", said, card.place("mu"), hint)
    if times := stepped(run):
        when = f"{len(times)} times, first at t = {times[0]:.6g} s"
        said = f"friction and contacts changed too often to be followed one by one, {when}"
        hint = "there they took a short step together, of first order; a smaller reltol makes it shorter"
        assembly.flat.sink.warning("W420", said, hint=hint)


def _pushes(assembly: Assembly, span: Span | None) -> bool:
    """Does the place lie on a card that acts on the machine?"""
    cards = [] if assembly.machine is None else [*assembly.machine.couplings.values()]
    return span is not None and any(
        card.spec.word in ("FORCE", "TORQUE")
        and (card.span.file, card.span.line) <= (span.file, span.line)
        and any(
            at is not None and at.line == span.line and at.file == span.file
            for at in card.raw.param_spans.values()
        )
        for card in cards
    )


def _invariants(assembly: Assembly, run: Run) -> None:
    """Rows of the equations that did not hold: nodes, laws of branches, loops; each with its worst time."""
    waves: Any = run.waves  # of a transient
    if not waves.unbalanced:
        return
    from .failure import locate

    names, kinds = assembly.system.names, assembly.system.kinds
    loops = {} if assembly.machine is None else {row.mu_row: row for row in assembly.machine.loop_rows}
    drifts = "open" in waves.watch  # told by itself, where closures are kept in their derivatives alone
    # what only the meters of a drawing make plain: not of the run as it is without one
    metered = {
        n for e in assembly.ctx.elements.values() if e.name in assembly.ctx.aside for n in (e.name, *e.nodes)
    }
    laws = {} if assembly.machine is None else {law.row: (card, law) for card, law in assembly.machine.laws}
    for row, first, worst, left, bound, charge in waves.unbalanced:
        if names[row].partition("#")[0] in metered or names[row] in metered:
            continue
        when = f"first at t = {first:.6g} s, most at {worst:.6g} s"
        allowed = f"where the tolerances allow {bound:.2g}"
        where, lines = locate(assembly, names[row])
        span = lines[0][0] if lines else None
        if charge:
            said = f"the charge of {where}, which nothing carries away, has changed by {abs(left):.3g} C"
            assembly.flat.sink.warning("W406", f"{said}, {allowed}, {when}", span, SMALLER)
        elif row in laws:
            card, law = laws[row]
            said = f"the law of {card.spec.word} {card.name}: {abs(left):.3g} {law.unit}"
            said += ", or of its motion where it holds, is left over"
            assembly.flat.sink.warning("W406", f"{said}, {allowed}, {when}", card.span, SMALLER)
        elif kinds[row] in ("mu", "lambda"):
            if drifts or abs(left) < NOTHING:
                continue
            loop = loops.get(row)
            span = span if loop is None else assembly.machine.span_of(loop.owner)
            what = "is open by" if kinds[row] == "mu" else "opens at"
            unit = "" if loop is None else " m" if loop.unit == "N" else " rad"
            said = f"the loop closed by {where if loop is None else loop.owner} {what} {abs(left):.3g}{unit}"
            assembly.flat.sink.warning("W407", f"{said}, {allowed}, {when}", span, SMALLER)
        else:
            what, unit = (
                ("the currents of", "A do not cancel")
                if kinds[row] == "node"
                else ("the law of", "V are left over")
            )
            assembly.flat.sink.warning(
                "W406", f"{what} {where}: {abs(left):.3g} {unit}, {allowed}, {when}", span, SMALLER
            )


def condition(assembly: Assembly, k: int) -> tuple[str, Span | None]:
    """What a flag is called, and where it stands."""
    name = assembly.system.flag_names[k]
    element = assembly.ctx.elements.get(name)
    span = element.span if element is not None else assembly.ctx.conditions.get(k)
    if element is not None:
        return f"the switch {name}", span
    # "CONTACT floor 1 slides", of a law with modes
    of_law = assembly.machine is not None and name.count(" ") > 1
    card = assembly.machine.couplings.get(name.split()[1]) if of_law else None
    if card is not None:
        return f"{card.spec.word} {card.name}", card.span
    return f"the condition `{span.text}`" if span is not None else "a condition", span


def _divided_by_zero(assembly: Assembly, span: Span | None) -> None:
    what = f"`{span.text}`" if span is not None else "a divisor"
    assembly.ctx.remark(
        "W403",
        f"{what} is divided by, and it is 0 at the operating point",
        span,
        "x/0 counts as x/1e-32, as in ngspice; keep the divisor away from zero",
    )


def _amplified(assembly: Assembly, run: Run) -> None:
    """Motions that amplify errors: a body that flips about its middle axis, a double pendulum, a ball on an edge."""
    machine, options = assembly.machine, assembly.options
    if machine.found.dof < FREE or run.waves.rows > MOST or run.grid is None:
        return
    if run.waves.stats["steps"] * len(assembly.system.names) > WORK:
        return
    from array import array

    from .base import recorded

    names, units, exprs = recorded(assembly, run.analysis)
    tstep, tstop, tstart = run.grid
    asked = float(options.get("reltol", RELTOL))
    reltol = asked / FINER
    again = assembly.system.tran(
        tstep, tstop, tstart=tstart, uic=run.uic, outputs=exprs, options_={**options, "reltol": reltol}, drawn=False
    )  # fmt: skip
    if again.status != "ok":
        return

    def column(waves: Waveforms | Computed, k: int) -> array[float]:
        values = array("d")
        values.frombytes(waves.column(k))
        return values

    moves = [column(again, k) for k, unit in enumerate(units, 1) if unit in MOTION]
    if moves and max(max(values) - min(values) for values in moves) < STILL:
        return
    row_at = {t: row for row, t in enumerate(column(again, 0))}
    pairs = [(row, row_at[t]) for row, t in enumerate(column(run.waves, 0)) if t in row_at]
    # the motion itself; a moment about a pin's own axis is rounding, and amplifies nothing
    motions = {name for c in machine.all_coordinates() for name in (c.q_name, c.u_name)}
    watched = [k for k, name in enumerate(names) if name in motions] or range(len(names))
    finest = {k: column(again, k + 1) for k in watched}
    ranges = {k: max(finer) - min(finer) for k, finer in finest.items()}
    # ways count as turns at the machine's length
    length = float(options.get("length") or 1.0)
    lever = {k: 1.0 if units[k].startswith("rad") else length for k in watched}
    widest: dict[str, float] = {}
    for k, span in ranges.items():
        rate = units[k].partition("/")[2]
        widest[rate] = max(span / lever[k], widest.get(rate, 0.0))
    worst, at, name = 0.0, 0.0, ""
    for k, finer in finest.items():
        ours = column(run.waves, k + 1)
        span = ranges[k] or max(ours) - min(ours)
        # what does not move beside others, or beside itself, is known to the tolerance
        size = max(*map(abs, finer), widest[units[k].partition("/")[2]] * lever[k])
        for i, j in pairs:
            apart = abs(ours[i] - finer[j])
            if apart > KNOWN * asked * size and apart > worst * span:
                worst, at, name = apart / span, run.waves.value(i, 0), names[k]
    if worst > SHARE:
        said = f"the motion amplifies errors {worst / asked:.2g}-fold: with reltol={reltol:g} in place of {asked:g}, {name} "
        said += f"differs by {100 * worst:.2g} % of its range at t = {at:.4g} s"
        hint = f"take a smaller reltol, {reltol / 100:g} for instance, until nothing changes; chaos is known for a while only"
        assembly.flat.sink.warning("W417", said, None, hint)


def driven_linkage(assembly: Assembly, run: Run) -> str:
    """Where links of a driven loop lie in one line, forces in it are not determined: the loop, and the pose in which it was
    fastest; "" without such a loop."""
    from .failure import driven_loop, pose

    loop = driven_loop(assembly)
    if not loop:
        return ""
    machine = assembly.machine
    at = {name: k for k, name in enumerate(run.names)}
    moving = [c for c in machine.all_coordinates() if c.q_name in at and c.u_name in at]
    if not moving:
        return ""
    fastest, row = 0.0, 0
    for c in moving:
        for k in range(run.waves.rows):
            speed = abs(run.waves.value(k, at[c.u_name]))
            if speed > fastest:
                fastest, row = speed, k
    return (
        f"{loop} is driven: beside a change point, where links lie in one line, its forces are hardly determined, and with them "
        f"the work of the drive (fastest at t = {run.waves.value(row, 0):.4g} s: {pose(assembly, run.waves, run.names, row)}); "
        "method=auto has them"
    )


def _openings(assembly: Assembly, run: Run) -> None:
    """Rows of loops that were left out as redundant and have come open, each joint once with its first time."""
    openings = assembly.machine.openings
    names = assembly.system.flag_names
    said: set[str] = set()
    for t, index, value in run.waves.events if openings else ():
        row = openings.get(names[index]) if value else None
        if row is not None and row.owner not in said:
            said.add(row.owner)
            text = f"the loop closed by {row.owner} has come open, first at t = {t:.6g} s: what it holds in its direction "
            text += f"`{row.label}` followed from the other joints where the machine starts, and does not any more"
            hint = "start it in another pose, away from a change point: ic= or guess= a little aside"
            assembly.flat.sink.warning("W413", text, assembly.machine.span_of(row.owner), hint)


def _pulls(assembly: Assembly, run: Run, over_time: bool) -> None:
    """Supports that ROLL keeps though the wheel would lift off, of those whose force is among the columns."""
    for name, card in assembly.machine.couplings.items():
        if card.spec.word != "ROLL" or f"force({name})" not in run.names:
            continue
        found = assembly.system.quantities(assembly.options)
        least = max((value for _, _, option, value, _ in found if option == "forcetol"), default=0.0)
        at = run.names.index(f"force({name})")
        forces = [run.waves.value(k, at) for k in range(run.waves.rows)]
        rounding = least + RELTOL * max(map(abs, forces), default=0.0)
        row = next((k for k, force in enumerate(forces) if force < -rounding), None)
        if row is not None:
            when = f", first at t = {run.waves.value(row, 0):.6g} s" if over_time else ""
            said = f"ROLL {name} pulls its parts together with {-forces[row]:.3g} N{when}: a wheel would lift off there"
            hint = "CONTACT with mu= in its place lets it lift off; or load the wheel more"
            assembly.flat.sink.warning("W422", said, card.span, hint)


def _limits(assembly: Assembly, run: Run) -> None:
    """Flags that carry a warning and turned 1 during the run, each once with its first time."""
    from ..cards.base import Card

    warnings: dict[str, str] = assembly.machine.flag_warnings
    if not warnings:
        return
    names = assembly.system.flag_names
    said: set[str] = set()
    for t, index, value in run.waves.events:
        text = warnings.get(names[index]) if value else None
        if text is not None and text not in said:
            said.add(text)
            card = names[index].rpartition(" ")[0]
            where = assembly.machine.span_of(card)
            hint = getattr(assembly.machine.couplings.get(card), "limits", Card.limits)
            if _turned_by_motor(assembly, card):
                hint += "\na loop that turns a motor until its pot agrees has the wrong sign where it runs to the end: "
                hint += "exchange the ends of range=, or the motor's terminals"
            assembly.flat.sink.warning("W401", f"{text}, first at t = {t:.6g} s", where, hint)


def _turned_by_motor(assembly: Assembly, name: str) -> bool:
    """Does a MOTOR turn the joint whose card this is?"""
    cards = assembly.machine.couplings
    joint = getattr(cards.get(name), "joint", None)
    return joint is not None and any(c.spec.word == "MOTOR" and c.joint is joint for c in cards.values())


def _imbalances(assembly: Assembly, run: Run) -> None:
    """Mean and largest power that a motor with kt != ke makes or loses."""
    for name, _ in assembly.machine.imbalances:
        column = f"imbalance({name})"
        if column not in run.names:
            continue
        from array import array

        power, time = array("d"), array("d")
        power.frombytes(run.waves.column(run.names.index(column)))
        time.frombytes(run.waves.column(0))
        work = sum(0.5 * (power[k] + power[k - 1]) * (time[k] - time[k - 1]) for k in range(1, len(time)))
        span, largest = time[-1] - time[0], max(power, key=abs)
        mean = work / span if span > 0 else 0.0
        made = "appear from nowhere" if mean > 0 else "vanish"
        assembly.flat.sink.note(
            "N401",
            f"kt and ke of `{name}` differ, so power does not balance in it: "
            f"{abs(mean):.4g} W {made} on average, {largest:.4g} W at most",
            assembly.machine.span_of(name),
            hint="in SI units kt and ke of a motor are one number; give one of them to balance the energy",
        )
