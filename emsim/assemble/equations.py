"""From scalars to rows of equation (1), by differentiation alone.

    L = T - V + W'                          all cards' energies
    coordinate row   Q = q                  F = -N (u - N^T (dh/dq)^T mu),  N = 1 unless the kind of joint says otherwise
    momentum row     Q = p = dL/du          F = -dL/dq - sum effort d(flow)/du - d(sum lambda dh/dt)/du
    (with N not 1:   dL/dq becomes N^T dL/dq, and F has the kind's gyration(u, p))
    lambda row       Q = 0                  F = dh/dt, or a u - b of a row of speeds, which has no mu
    mu row           Q = 0                  F = h
Laws with modes add their powers and rows as loops do (laws.py).
(GGL, the stabilised index-2 form of Gear, Gupta and Leimkuhler.) Virtual and prescribed motions get the
momentum expressions too: d/dt p + F of such a motion is the force that keeps it what it is (reactions.py).
"""

from __future__ import annotations

from . import alike, laws

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from ..cards.base import Scalar
    from .mechanism import Mechanism


def multipliers(m: Mechanism) -> None:
    """Unknowns of all rows; those of speeds come last, so that a mu behind a lambda is of the same row."""
    for of_speeds in (False, True):
        for row in m.rows:
            if row.of_speeds is of_speeds:
                label = f"{row.owner},{row.place + 1}"
                row.row = m.b.unknown(f"lambda({label})", "lambda", row.unit, 0.0)
                row.mu_row = -1 if of_speeds else m.b.unknown(f"mu({label})", "mu", "", 0.0)
        for row in () if of_speeds else m.norms:
            row.mu_row = m.b.unknown(f"mu({row.owner},norm)", "mu", "", 0.0)


def kinetic(m: Mechanism) -> Expr:
    """T of all cards, before symbols are replaced [J]. In space velocities may be carried down the tree in world axes or in the
    bodies' own, where positions do not come into them: what momenta and forces of inertia cost says which."""
    plain = total(m, [card.kinetic(m) for card in m.active])
    if not m.in_space:
        return plain
    for frame in m.frames.values():
        frame.in_own_axes = True
    own = total(m, [card.kinetic(m) for card in m.active])
    reads = [*(c.u for c in m.motions), *(c.q for c in m.places)]
    if _cost(m, own, reads) < _cost(m, plain, reads):
        return own
    for frame in m.frames.values():
        frame.in_own_axes = False
    return plain


def _cost(m: Mechanism, energy: Expr, reads: Sequence[Expr]) -> int:
    return m.b.count(m.public_all(m.b.grad(energy, reads)))


def lagrangian(m: Mechanism) -> Expr:
    energies = [card.potential(m) for card in m.active]
    co = [card.coenergy(m) for card in m.active]
    return m.kinetic - total(m, energies) + total(m, co)


def total(m: Mechanism, terms: Sequence[Scalar | None]) -> Expr:
    result = m.b.const(0.0)
    for term in terms:
        if term is not None:
            result = result + term
    return result


def contribute(m: Mechanism) -> None:
    """Add every row of the machine to the builder."""
    b = m.b
    # the state, then motions that only their reaction needs
    places, motions = m.places, m.motions
    qs = [c.q for c in (*places, *m.given)] + [v.s for v in m.virtuals]
    us = [c.u for c in motions] + [c.u for c in m.given] + [v.rate for v in m.virtuals]

    # energies
    whole = lagrangian(m)
    p = b.grad(whole, us)
    force = _on_speeds(m, b.grad(whole, qs))
    for group in m.groups:
        at = [motions.index(c) for c in group.speeds]
        for k, e in zip(
            at, group.kind.gyration([c.u for c in group.speeds], [p[k] for k in at]), strict=True
        ):
            force[k] = force[k] - e

    # powers
    if (power := _of_powers(m, us)) is not None:
        force = [f + g for f, g in zip(force, power, strict=True)]

    # loops
    drift: list[Expr] = [b.const(0.0)] * len(us)
    drifts = m.row_rates(m.rows)
    if m.rows or m.laws:
        rates, positions = alike.powers(m, [law for _, law in m.laws])
        for row, rate in zip(m.rows, drifts, strict=True):
            rates = rates + b.x(row.row) * rate
            if not row.of_speeds:
                positions = positions + b.x(row.mu_row) * row.h
        force = [f + g for f, g in zip(force, b.grad(rates, us), strict=True)]
        drift = _on_speeds(m, b.grad(positions, qs))

    # symbols take their values
    n = len(us)
    rows = [*p, *force, *drift, *drifts, *(row.h for row in m.rows)]
    rows = m.public_all(rows)
    p, force, drift = rows[:n], rows[n : 2 * n], rows[2 * n : 3 * n]
    rates_and_gaps = rows[3 * n :]
    m.momentum = {id(c): (p[k], force[k]) for k, c in enumerate([*motions, *m.given, *m.virtuals])}
    m.operations = b.count(rows)

    _add_rows(m, p, force, drift, rates_and_gaps)
    laws.contribute(m)

    # the electrical side
    for card in m.ctx.in_turn(m.active):
        card.stamp(m)


def _of_powers(m: Mechanism, us: list[Expr]) -> list[Expr] | None:
    """Generalised forces of the cards' powers: efforts are held constant by symbols while the sum is differentiated."""
    b = m.b
    flows, efforts = b.const(0.0), []
    for card in m.ctx.in_turn(m.active):
        for effort, flow in card.powers(m):
            symbol = b.symbol()
            m.efforts.append((card, effort, flow))
            efforts.append((symbol, effort))
            flows = flows + symbol * flow
    return b.substitute(b.grad(flows, us), efforts) if efforts else None


def _add_rows(
    m: Mechanism, p: list[Expr], force: list[Expr], drift: list[Expr], rates_and_gaps: list[Expr]
) -> None:
    """Momenta, forces and loops into the rows of places, speeds and multipliers."""
    b, places, motions, count = m.b, m.places, m.motions, len(m.rows)
    for c in places:
        b.c(c.row, c.row, 1.0)
    for k, c in enumerate(motions):
        if c.row >= 0:
            b.g(c.row, c.speed_row, -1.0)
            if drift[k].value != 0.0:
                b.add_f(c.row, drift[k])
        b.add_q(c.speed_row, p[k])
        b.add_f(c.speed_row, -force[k])
    for group in m.groups:
        corrected = [c.u - drift[motions.index(c)] for c in group.speeds]
        for c, rate in zip(group.places, group.rates(corrected), strict=True):
            b.add_f(c.row, -rate)
    for row in m.norms:
        b.add_f(row.mu_row, row.h)
        for c, slope in zip(places, b.grad(row.h, [c.q for c in places]), strict=True):
            if slope.value != 0.0:
                b.add_f(c.row, b.x(row.mu_row) * slope)
    for c in m.given:
        if c.row >= 0:  # a prescribed speed: the coordinate is its integral
            b.c(c.row, c.row, 1.0)
            b.add_f(c.row, -m.public(c.u))
    for k, row in enumerate(m.rows):
        b.add_f(row.row, rates_and_gaps[k])
        if not row.of_speeds:
            b.add_f(row.mu_row, rates_and_gaps[count + k])


def _on_speeds(m: Mechanism, by_place: list[Expr]) -> list[Expr]:
    """From own coordinates to own speeds; prescribed and virtual motions are their own."""
    count = len(m.places)
    return [*m.on_speeds(by_place[:count]), *by_place[count:]]
