"""Energy accounts: who supplies, stores and dissipates, as expressions; the engine integrates the powers.

    energy(end) - energy(start) = supplied - dissipated          what remains is the error of the solution

Elements: R, S, W dissipate v i; V, I and controlled sources supply -v i; C and L store C v^2/2 and L i^2/2, mutual
inductances M i1 i2; junction diodes are kept by the engine (heat v i(v), charge v dq), their series resistance here.
Cards: kinetic, potential and stored energies and losses as they state them; what they bring in by `supplied`. A DRIVE is
known by the equation of its own motion, d/dt p + F = effort; its work is [p u] - int (p du/dt - F u) dt.
"""

from __future__ import annotations

from ..elements import TABLE, between, branch_current, capacitance, inductance, number
from ..expr import Node

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..deck import Element
    from .context import Context
    from .machine import Machine

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
        _element(ctx, e, book)
    for name, (p, inner, gs) in ctx.series.items():
        drop = ctx.b.x(p) - ctx.b.x(inner) if p >= 0 else -ctx.b.x(inner)
        book.power(name, "D", DISSIPATED, gs * drop * drop)
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


def _element(ctx: Context, e: Element, book: Accounts) -> None:
    letter = e.letter.upper()
    if letter == "K":
        if not isinstance(e.value, (int, float)):
            return
        coils = [
            ctx.elements[name]
            for n in e.extra["inductors"]
            if (name := ctx.element_name(n, "L")) in ctx.elements
        ]
        for k, first in enumerate(coils):
            for second in coils[k + 1 :]:
                m = e.value * (inductance(ctx, first) * inductance(ctx, second)) ** 0.5
                i, j = branch_current(ctx, first), branch_current(ctx, second)
                book.energy(e.name, "K", STORED, m * i * j)
        return
    if letter == "D":
        return
    v = between(ctx, e)
    if letter == "C":
        if isinstance(e.value, Node):
            book.open.append(e.name)
        else:
            book.energy(e.name, letter, STORED, 0.5 * capacitance(ctx, e) * v * v)
    elif letter == "L":
        i = branch_current(ctx, e)
        if isinstance(e.value, Node):
            book.power(e.name, letter, STORED, number(e, "m", 1.0) * v * i)
        else:
            book.energy(e.name, letter, STORED, 0.5 * inductance(ctx, e) * i * i)
    elif letter in "RSW":
        book.power(e.name, letter, DISSIPATED, v * TABLE[letter].current(ctx, e))
    else:
        book.power(e.name, letter, SUPPLIED, -(v * TABLE[letter].current(ctx, e)))


def _machine(m: Machine, book: Accounts) -> None:
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
