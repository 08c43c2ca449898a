"""Gaps of TRANSDUCERs that have closed: where C(q) or L(q) has no finite value, and beyond which it is negative.

A force that grows as 1/gap^2 closes a gap in finite time where nothing stops the joint. What follows is no solution: steps
shrink to nothing, or one leaps over the pole and goes on with a negative inductance.
"""

from __future__ import annotations

from ..diagnostics import Diagnostic

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._engine import Waveforms
    from ..assemble import Assembly
    from ..cards.transducer import Transducer

NEAR = 0.05  # of the way gone: so near to the zero of the gap, a run that failed there failed for that
SEARCH = 60  # steps of Newton's method


def overlapping(flag: str) -> str | None:
    """What is wrong from where the flag of this name turns to 1; None of other flags."""
    name, _, what = flag.partition(" ")
    said = f"parts of CONTACT {name} are in each other: no edge stops what meets corner to corner"
    return said if what == "overlaps" else None


def closed(assembly: Assembly, waves: Waveforms, names: Sequence[str]) -> Diagnostic | None:
    """The first gap found closed: crossed, or reached by a run that failed."""
    from ..cards.transducer import Transducer

    machine = assembly.machine
    if machine is None or waves.rows < 2:
        return None
    for t, index, on in waves.events:
        said = overlapping(flag := assembly.system.flag_names[index]) if on else None
        if said:
            hint = "at a loose tolerance a smaller reltol; in the plane a disc(r) at such a corner is exact"
            span = machine.span_of(flag.split()[0])
            return Diagnostic("error", "E415", f"{said}; first at t = {t:.6g} s", span, hint)
    cards = (c for c in machine.couplings.values() if isinstance(c, Transducer) and c.form != "k")
    return next((found for card in cards if (found := _of(assembly, card, waves, names))), None)


def _of(assembly: Assembly, card: Transducer, waves: Waveforms, names: Sequence[str]) -> Diagnostic | None:
    m = assembly.machine
    joint = m.joints[card.joint.name]
    c = joint.coordinates[0] if len(joint.coordinates) == 1 else None
    if c is None or c.row < 0 or c.q_name not in names:
        return None
    column, rows = 1 + names.index(c.q_name), waves.rows
    start, last = waves.value(0, column), waves.value(rows - 1, column)
    farthest = max((waves.value(k, column) for k in range(rows)), key=lambda q: abs(q - start))
    capacity = m.public(card.capacity)
    if capacity.value is not None:
        return None
    state = list(m.found.x) + [0.0] * (assembly.system.n - len(m.found.x))

    def value(q: float) -> float:
        """C or L there."""
        state[c.row] = q
        return assembly.system.values([capacity], state, 0.0)[0]

    if not value(start) > 0.0:
        return None
    beyond = next((q for q in (farthest, last) if not value(q) > 0.0), None)
    if beyond is not None:
        pole = _crossing(value, start, beyond)
        row = next(
            (k for k in range(rows) if (waves.value(k, column) - pole) * (pole - start) >= 0.0), rows - 1
        )
        return _said(card, c.q_name, pole, c.unit, waves.value(row, 0))
    if waves.status != "failed":
        return None
    ahead = _ahead(value, last, abs(last - start))
    if ahead is None or not abs(ahead - last) < NEAR * abs(ahead - start):
        return None
    return _said(card, c.q_name, ahead, c.unit, waves.value(rows - 1, 0))


def _said(card: Transducer, coordinate: str, pole: float, unit: str, t: float) -> Diagnostic:
    what = "capacitance" if card.charge_like else "inductance"
    said = f"the gap of TRANSDUCER `{card.name}` has closed at t = {t:.6g} s: {coordinate} reached {pole:.6g} {unit}"
    hint = f"nothing holds {card.joint.name} off: a stop before {pole:.6g} {unit} (STOP with min= or max= and k=), or a weaker "
    hint += "field; what is recorded behind that time is no motion"
    said += f", where its {what} has no finite positive value"
    return Diagnostic("error", "E415", said, card.place(card.form), hint)


def _crossing(value: Callable[[float], float], low: float, high: float) -> float:
    """Between a positive value and one that is not: the pole, or the zero."""
    while (middle := 0.5 * (low + high)) not in (low, high):
        if value(middle) > 0.0:
            low = middle
        else:
            high = middle
    return middle


def _ahead(value: Callable[[float], float], q: float, way: float) -> float | None:
    """Where 1/C comes to zero, by Newton's method from q."""
    for _ in range(SEARCH):
        h = 1e-7 * (abs(q) + way)
        here = value(q)
        if here != here or abs(here) > 1e300:
            return q
        slope = (1.0 / value(q + h) - 1.0 / value(q - h)) / (2.0 * h)
        if not slope or slope != slope:
            return None
        step = 1.0 / (here * slope)
        q -= step
        if abs(step) < 1e-9 * (abs(q) + way):
            return q
    return None
