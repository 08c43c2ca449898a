"""Physical domains beside circuit and mechanism, as data: what is across a branch, what goes through it, in which units.

Every domain has nodes of its own. A node is an unknown, the across quantity over that of ground, and its row is the balance of
what goes through:
    heat       temperature over that of the surroundings [K], heat [W]: what goes through is itself a power
    magnetic   magnetomotive force [kA], flux [mWb]
    hydraulic  pressure over that of the surroundings [kPa], flow [l/s]
In these units reluctances and hydraulic resistances are no giants, and across times through is joule or watt as in SI. What
decks say and read is in SI: A, Wb, Pa, m^3/s. The cards of a domain are in a file of its name.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Protocol

    from ..._engine import Expr
    from ...diagnostics import Span
    from ..base import Card, Scalar, Scene

    class Shared(Protocol):
        """Nodes of the other physical domains, and whose heat goes into them, see assemble/domains.py."""

        @property
        def surroundings(self) -> float: ...  # their temperature [K]
        @property
        def nominal(self) -> float: ...  # that numbers of models are for [K]
        def named(self, domain: str, name: str, where: Span) -> int: ...  # the unknown of a node
        def warm(self, owner: str, card: Card, where: Span) -> None: ...
        def heat_of(self, owner: str) -> Expr: ...  # [W]


class Domain:
    """`across` is the word that reads a node and `unit` what it is in, `through` and `through_unit` of a branch; `size`: of the
    unknown in `unit`; `card`: the word of its cards."""

    __slots__ = ("across", "card", "ground", "size", "through", "through_unit", "unit")

    def __init__(
        self, card: str, across: tuple[str, str], through: tuple[str, str], size: float, ground: str
    ) -> None:
        self.card, self.size, self.ground = card, size, ground
        self.across, self.unit = across
        self.through, self.through_unit = through


# kind of a terminal -> domain
DOMAINS = {
    "heat": Domain("HEAT", ("temp", "K"), ("heat", "W"), 1.0, "the surroundings"),
    "magnetic": Domain("MAGNETIC", ("mmf", "A"), ("flux", "Wb"), 1e3, "the zero of magnetomotive force"),
    "hydraulic": Domain("HYDRAULIC", ("pressure", "Pa"), ("flow", "m^3/s"), 1e3, "the surroundings"),
}
ACROSS = {domain.across: key for key, domain in DOMAINS.items()}


def level(s: Scene, domain: Domain, row: int) -> Expr:
    """The across quantity of a node [unit]: a temperature is absolute."""
    zero = s.domains.surroundings if domain.unit == "K" else 0.0
    return s.b.const(zero) if row < 0 else domain.size * s.b.x(row) + zero


def drop(s: Scene, domain: Domain, a: int, b: int) -> Expr:
    """Across from node a to node b [unit]."""
    return domain.size * s.v(a, b)


def inject(s: Scene, domain: Domain, a: int, b: int, through: Scalar) -> None:
    """What goes through a branch from node a to node b [through_unit]."""
    s.add_f(a, domain.size * through)
    s.add_f(b, -(domain.size * through))
