"""Energy accounts as elements and cards fill them in: who supplies, stores and dissipates, as expressions."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import Element

IMPULSIVE = ("DRIVE", "FRICTION")  # cards whose power goes with the forces in joints, those of impacts too
SUPPLIED, DISSIPATED, STORED = "supplied", "dissipated", "stored"


class Entry:
    """One term of an account. Of a power [W] the integral counts, of an energy [J] the difference of its ends."""

    __slots__ = ("expr", "kind", "name", "power", "word")

    def __init__(self, name: str, word: str, kind: str, expr: Expr, power: bool) -> None:
        self.name, self.word, self.kind, self.expr, self.power = name, word, kind, expr, power


class Accounts:
    """All entries of a deck; `open` names what cannot be accounted for, so that no balance is claimed."""

    __slots__ = ("engine", "entries", "open")

    def __init__(self, engine: bool = True) -> None:
        self.engine = engine  # does the engine keep those of devices?
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

    def lost(self, e: Element, energy: Expr) -> None:
        """Heat that there has been [J], where it is a function of the state."""
        self.energy(e.name, e.letter.upper(), DISSIPATED, energy)

    def stores(self, e: Element, power: Expr) -> None:
        self.power(e.name, e.letter.upper(), STORED, power)

    def holds(self, e: Element, energy: Expr) -> None:
        self.energy(e.name, e.letter.upper(), STORED, energy)

    @property
    def powers(self) -> list[Entry]:
        return [e for e in self.entries if e.power]

    def expressions(self) -> tuple[list[Expr], list[Expr], list[int]]:
        """Of the powers and of the energies, and which of the powers work in impulses."""
        powers = self.powers
        impulsive = [k for k, e in enumerate(powers) if e.word in IMPULSIVE]
        return [e.expr for e in powers], [e.expr for e in self.energies], impulsive

    @property
    def energies(self) -> list[Entry]:
        return [e for e in self.entries if not e.power]
