"""Prescribed motion: what the coordinates of a DRIVE are, and whether they can be.

q= is differentiated twice: a corner in it is a jump of the speed, a jump a body in two places. So it has neither. qd= may
have corners, which are jumps of a finite torque; where it jumps itself, the torque is without bound for no time: the
run goes on with the new speed, and what that cost is in no account.
"""

from __future__ import annotations

from math import pi

from .coordinates import AGREE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..cards.drive import Drive
    from ..deck import Waveform
    from .mechanism import Mechanism
    from .scene import Coordinate

POINTS = 200  # at which a speed is looked at
JUMP = 1e-3  # of the largest speed: between neighbours, and still there when they have come together


def prescribe(m: Mechanism) -> None:
    """What the driven coordinates are, once frames exist: pairs (symbol, value) for substitution."""
    symbols = [e for c in m.given for e in (c.q, c.u)]
    for c in m.given:
        drive = c.drive
        assert drive is not None
        if drive.qd is not None:
            q, u = m.b.x(c.row), m.compile(drive.qd, drive.place("qd"))
            if any(m.b.depends(u, symbols)):
                m.sink.error(
                    "E251",
                    f"qd= of DRIVE {drive.name} depends on the motion it prescribes, or on that of another DRIVE",
                    drive.place("qd"),
                    "what follows the motion is a MOTOR, a SPRING or a DAMPER",
                )
        else:
            q, u = function_of_time(m, drive)
        if drive.qd is not None and not any(m.b.depends(u, symbols)):
            _jumps(m, drive, u)
        _agree_at_start(m, c, q, u)
        m.pairs += [(c.q, q), (c.u, u)]
    m.pairs += [(e, m.b.const(0.0)) for v in m.virtuals for e in (v.s, v.rate)]


def _agree_at_start(m: Mechanism, c: Coordinate, q: Expr, u: Expr) -> None:
    """ic= of a driven joint may only repeat what the drive says at t = 0."""
    drive, card = c.drive, m.joints[c.of].card
    assert drive is not None
    for what, e, held, start in (
        ("coordinate", q, c.held, c.start),
        ("speed", u, c.held_speed, c.start_speed),
    ):
        if not held or (what == "coordinate" and drive.qd is not None):  # the integral starts anywhere
            continue
        states = [m.b.x(i) for i in m.unknowns_so_far()]
        if any(m.b.depends(e, states)):
            m.sink.warning(
                "W235",
                f"the speed in ic= of {c.of} has no effect: DRIVE {drive.name} prescribes it",
                card.place("ic") if card.given("ic") else drive.span,
                "give the position alone",
            )
            continue
        value = m.b.eval([e], [], 0.0)[0]
        if abs(value - start) > AGREE * (1.0 + abs(value)):
            m.sink.error(
                "E244",
                f"ic= and DRIVE {drive.name} disagree: {what} {start:g} and {value:g} of {c.of} at the start",
                card.place("ic") if card.given("ic") else drive.span,
                "leave the ic= out: the drive says where the joint is",
            )


def function_of_time(m: Mechanism, drive: Drive) -> tuple[Expr, Expr]:
    """q(t) and its derivative."""
    if hasattr(drive.q, "args") and hasattr(drive.q, "kind"):
        q = _smooth_wave(m, drive, drive.q)
    else:
        q = m.compile(drive.q, drive.place("q"))
    symbols = [e for c in m.given for e in (c.q, c.u)]
    states = [m.b.x(i) for i in m.unknowns_so_far()]
    if any(m.b.depends(q, states + symbols)):
        m.sink.error(
            "E251",
            f"q= of DRIVE {drive.name} depends on more than time, so its speed is not known",
            drive.place("q"),
            "prescribe the speed with qd=, or use a MOTOR or a SPRING that follows",
        )
        return m.b.const(0.0), m.b.const(0.0)
    if any(m.b.depends(q, list(m.ctx.flags.values()))):
        m.sink.error(
            "E251",
            f"q= of DRIVE {drive.name} has corners or jumps, where its speed is not known",
            drive.place("q"),
            "conditions, min, max, abs, floor, pwl and the like are not smooth: prescribe the speed with qd=, which may "
            "have corners",
        )
        return m.b.const(0.0), m.b.const(0.0)
    return q, m.b.tangent([q], [(m.b.time(), 1.0)])[0]


def _smooth_wave(m: Mechanism, drive: Drive, wave: Waveform) -> Expr:
    """SIN as a formula: vo + va exp(-theta t) sin(2 pi f t + phase), which it is where there is no delay."""
    from .waves import resolve

    kind, args = resolve(wave, m.ctx.times, m.sink)
    if kind == "sin" and args[3] <= 0.0:
        vo, va, f, td, theta, phase = args
        t, call = m.b.time() - td, m.b.call
        swing = va * call("sin", (2.0 * pi * f) * t + phase * (pi / 180.0))
        return vo + (swing * call("exp", -theta * t) if theta else swing)
    why = "a waveform has corners, where its speed is not known"
    if kind == "sin":
        why = f"SIN has a corner at the end of its delay, {args[3]:g} s"
    m.sink.error(
        "E251",
        f"q= of DRIVE {drive.name} is SIN without delay, or an expression of time; {why}",
        drive.place("q"),
        "a waveform can drive the speed: qd=",
    )
    return m.b.const(0.0)


def _jumps(m: Mechanism, drive: Drive, u: Expr) -> None:
    """A speed that jumps, as far as a look at the times of the run finds it; one of anything but time is not known."""
    kinks = list(m.ctx.flags.values())
    if not any(m.b.depends(u, kinks)) or any(m.b.depends(u, [m.b.x(i) for i in m.unknowns_so_far()])):
        return

    def at(t: float) -> float:
        return m.b.eval([u], [], t)[0]

    last = m.ctx.times[1]
    values = [at(last * k / POINTS) for k in range(POINTS + 1)]
    least = JUMP * max(map(abs, values))
    for k in range(POINTS):
        low, high = last * k / POINTS, last * (k + 1) / POINTS
        a, b = values[k], values[k + 1]
        for _ in range(40):  # into the half that holds more of the change
            if not abs(b - a) > least:
                break
            middle = 0.5 * (low + high)
            c = at(middle)
            low, high, a, b = (low, middle, a, c) if abs(c - a) > abs(b - c) else (middle, high, c, b)
        else:
            m.jumping.add(drive.name)
            m.sink.warning(
                "W237",
                f"qd= of DRIVE {drive.name} jumps at t = {high:.6g} s, from {a:.4g} to {b:.4g}: "
                "no finite force does that",
                drive.place("qd"),
                "what the jump costs is in no account of energy; a ramp, or a tanh, has a force that can be known",
            )
            return
