"""Energy accounts: who supplies, stores and dissipates, as expressions; the engine integrates the powers.

    energy(end) - energy(start) = supplied - dissipated          what remains is the error of the solution

Elements say theirs in `account` (elements/<letter>.py); junction diodes are kept by the engine (heat v i(v), charge v dq).
Cards: kinetic, potential and stored energies and losses as they state them; what they bring in by `supplied`. A DRIVE is
known by the equation of its own motion, d/dt p + F = effort; its work is [p u] - int (p du/dt - F u) dt.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..elements import Element
    from .context import Context
    from .mechanism import Mechanism

SUPPLIED, DISSIPATED, STORED = "supplied", "dissipated", "stored"


class Entry:
    """One term of an account. Of a power [W] the integral counts, of an energy [J] the difference of its ends."""

    __slots__ = ("expr", "kind", "name", "power", "word")

    def __init__(self, name: str, word: str, kind: str, expr: Expr, power: bool) -> None:
        self.name, self.word, self.kind, self.expr, self.power = name, word, kind, expr, power


class Accounts:
    """All entries of a deck; `open` names what cannot be accounted for, so that no balance is claimed."""

    __slots__ = ("entries", "open")

    def __init__(self) -> None:
        self.entries: list[Entry] = []
        self.open: list[str] = []

    def power(self, name: str, word: str, kind: str, expr: Expr | None) -> None:
        if expr is not None and expr.value != 0.0:
            self.entries.append(Entry(name, word, kind, expr, True))

    def energy(self, name: str, word: str, kind: str, expr: Expr | None) -> None:
        if expr is not None and expr.value is None:
            self.entries.append(Entry(name, word, kind, expr, False))

    # what elements say of themselves
    def supplies(self, e: Element, power: Expr) -> None:
        self.power(e.name, e.letter.upper(), SUPPLIED, power)

    def dissipates(self, e: Element, power: Expr) -> None:
        self.power(e.name, e.letter.upper(), DISSIPATED, power)

    def stores(self, e: Element, power: Expr) -> None:
        self.power(e.name, e.letter.upper(), STORED, power)

    def holds(self, e: Element, energy: Expr) -> None:
        self.energy(e.name, e.letter.upper(), STORED, energy)

    @property
    def powers(self) -> list[Entry]:
        return [e for e in self.entries if e.power]

    @property
    def energies(self) -> list[Entry]:
        return [e for e in self.entries if not e.power]


def accounts(ctx: Context) -> Accounts:
    """The entries of a whole deck; made before the builder compiles."""
    book = Accounts()
    for e in ctx.elements.values():
        e.account(ctx, book)
    if ctx.machine is not None and not ctx.machine.broken:
        _machine(ctx.machine, book)
    shunt = ctx.options.get("gshunt", 0.0) + (
        1.0 / ctx.options["rshunt"] if ctx.options.get("rshunt") else 0.0
    )
    for name, row in ctx.nodes.items():
        v = ctx.b.x(row) if row >= 0 else ctx.b.const(0.0)
        if shunt:
            book.power(name, "shunt", DISSIPATED, shunt * v * v)
        if ctx.options.get("cshunt"):
            book.energy(name, "shunt", STORED, 0.5 * ctx.options["cshunt"] * v * v)
    return book


def _machine(m: Mechanism, book: Accounts) -> None:
    for card in m.active:
        word = card.spec.word
        for part in (card.kinetic(m), card.stored(m), card.potential(m)):
            if part is not None:
                book.energy(card.name, word, STORED, m.public(part))
        losses, supply = card.losses(m), card.supplied(m)
        if losses is not None:
            book.power(card.name, word, DISSIPATED, m.public(losses))
        if supply is not None:
            book.power(card.name, word, SUPPLIED, m.public(supply))
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
    for row in m.rows:
        # a constraint that moves by itself works: lambda dh/dt, driven coordinates (symbols here) held
        moved = m.b.tangent([row.h], [(m.b.time(), 1.0)])[0]
        book.power(row.owner, "DRIVE", SUPPLIED, m.public(-(m.b.x(row.row) * moved)))
