"""Energy accounts: who supplies, stores and dissipates, as expressions; the engine integrates the powers.

    energy(end) - energy(start) = supplied - dissipated          what remains is the error of the solution

Elements say theirs in `account` (elements/<letter>.py); junction diodes are kept by the engine (heat v i(v), charge v dq).
`whole` reads the same book at one instant: d/dt energy() = supplied() - loss(). What goes into a junction's charge is there
part of what the diode takes, v i; the ledger, which knows the junction, counts it as stored.
Cards: kinetic, potential and stored energies and losses as they state them; what they bring in by `supplied`. A DRIVE is
known by the equation of its own motion, d/dt p + F = effort; its work is [p u] - int (p du/dt - F u) dt.
"""

from __future__ import annotations

from ..elements.accounts import DISSIPATED, STORED, SUPPLIED, Accounts

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Span
    from .context import Context
    from .mechanism import Mechanism


def accounts(ctx: Context) -> Accounts:
    """The entries of a whole deck; made before the builder compiles."""
    book = Accounts()
    for e in ctx.elements.values():
        e.account(ctx, book)
    if ctx.machine is not None and not ctx.machine.broken:
        _machine(ctx.machine, book)
    _shunts(ctx, book)
    _led_away(ctx, book)
    return book


def _shunts(ctx: Context, book: Accounts) -> None:
    """Conductance and capacitance that options lay from every node to ground."""
    shunt = ctx.options.get("gshunt", 0.0) + (
        1.0 / ctx.options["rshunt"] if ctx.options.get("rshunt") else 0.0
    )
    for name, row in ctx.nodes.items():
        v = ctx.b.x(row) if row >= 0 else ctx.b.const(0.0)
        if shunt:
            book.power(name, "shunt", DISSIPATED, shunt * v * v)
        if ctx.options.get("cshunt"):
            book.energy(name, "shunt", STORED, 0.5 * ctx.options["cshunt"] * v * v)


def _led_away(ctx: Context, book: Accounts) -> None:
    """Heat that goes into nodes of heat is no loss."""
    if ctx.machine is not None and not ctx.machine.broken:
        ctx.machine.domains.led_away(book)


WHOLE = {"energy": STORED, "loss": DISSIPATED, "supplied": SUPPLIED}


def whole(ctx: Context, fn: str, span: Span | None) -> Expr:
    """energy(): what circuit and machine hold [J]; loss(): what they turn into heat [W]; supplied(): what comes in [W]."""
    key, kind = f"{fn}()", WHOLE[fn]
    if key in ctx.wholes:
        return ctx.wholes[key]
    if key in ctx.summing:
        ctx.sink.error("E255", f"{key} is part of what decides it", span, "break the circle of expressions")
        return ctx.b.const(0.0)
    ctx.summing.add(key)
    book = Accounts(engine=False)
    try:
        for e in ctx.elements.values():
            if e.accounted == kind:  # what the others do may read this very sum
                e.account(ctx, book)
        if ctx.machine is not None and not ctx.machine.broken:
            _cards(ctx.machine, book)
            if fn == "supplied":
                _drives_now(ctx.machine, book)
        _shunts(ctx, book)
        _led_away(ctx, book)
    finally:
        ctx.summing.discard(key)
    result = ctx.b.const(0.0)
    for entry in book.entries:
        if entry.kind == kind and entry.power == (fn != "energy"):
            result = result + entry.expr
    if fn == "energy":
        for entry in book.entries:  # of no function of the state: what has flowed in since the start
            if entry.kind == STORED and entry.power:
                result = result + ctx.idt(entry.expr, 0.0, f"energy({entry.name})")
        for e in (ctx.elements[name] for name in book.open if name in ctx.elements):
            result = result + ctx.idt(e.between(ctx) * e.flow(ctx), 0.0, f"energy({e.name})")
    ctx.wholes[key] = result
    return result


def _drives_now(m: Mechanism, book: Accounts) -> None:
    for drive in m.drives:
        power = drive.probes(m)["power"]
        book.power(drive.name, "DRIVE", SUPPLIED, m.public(power() if callable(power) else power))


def _machine(m: Mechanism, book: Accounts) -> None:
    _cards(m, book)
    _drives(m, book)


def _cards(m: Mechanism, book: Accounts) -> None:
    for card in m.active:
        word = card.spec.word
        for part in (card.kinetic(m), card.stored(m), card.potential(m)):
            if part is not None:
                book.energy(card.name, word, STORED, m.public(part))
        losses, supply, taken = card.losses(m), card.supplied(m), card.taken(m)
        if taken is not None:
            book.energy(card.name, word, DISSIPATED, m.public(taken))
        if losses is not None:
            book.power(card.name, word, DISSIPATED, m.public(losses))
        if supply is not None:
            book.power(card.name, word, SUPPLIED, m.public(supply))


def _drives(m: Mechanism, book: Accounts) -> None:
    for c in m.given:
        if c.drive is None:
            continue
        p, force = m.momentum[id(c)]
        u = m.public(c.u)
        rate = m.time_derivative(u)
        if rate is None or c.drive.name in m.jumping:  # the work of an impulse is no integral
            book.open.append(c.drive.name)
            continue
        book.energy(c.drive.name, "DRIVE", SUPPLIED, p * u)
        book.power(c.drive.name, "DRIVE", SUPPLIED, -(p * rate) - force * u)
    for row in (row for row in m.rows if not row.of_speeds):
        # a constraint that moves by itself works: lambda dh/dt, driven coordinates (symbols here) held
        moved = m.b.tangent([row.h], [(m.b.time(), 1.0)])[0]
        book.power(row.owner, "DRIVE", SUPPLIED, m.public(-(m.b.x(row.row) * moved)))
