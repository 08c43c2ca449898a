"""Laws with modes, as cards state them (duty `laws`): between an effort, which becomes an unknown, and a flow, which is linear
in the speeds, with a convex dissipation potential or the indicator of an inequality.

    Relay(flow, bound, stick)    effort = -bound sgn(flow); at rest anything up to stick     Coulomb friction, clutches, brakes
    Corner(gap, e)               0 <= gap, 0 <= effort, one of them is 0; restitution e      rigid stops
    OneWay(flow)                 0 <= flow, 0 <= effort, one of them is 0                    freewheels
    Slip(flow, corner, mu, mus)  a relay whose bound is mu times the effort of a corner      friction where rigid parts touch
    joined(relays)               one law of two or three directions: their length within the bound         both, in space

A stop is an ideal diode, friction a limiter of current. The power effort * flow goes into the machine: forces follow by
differentiation. The engine knows when a mode ends and which follow (engine/dae/src/modes.rs); no card writes event logic. Once
the compiler has seen it, a law has its `effort`, and flags of its mode.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from .base import Scalar


class Edge:
    """To which of several edges a gap is. `held`: a flag, the number while the corner is closed, else 0; `which`: the number at a
    point, 0 where none can press; `past`: above 0 the corner has passed the end of the edge that is held."""

    __slots__ = ("held", "past", "which")

    def __init__(self, held: Expr, which: Expr, past: Expr) -> None:
        self.held, self.which, self.past = held, which, past


class Law:
    """What laws have in common; `form` is the engine's word. Expressions before symbols are replaced."""

    __slots__ = (
        "across", "bound", "e", "edge", "effort", "flags", "flow", "form", "gap", "normal", "pair", "powers", "row", "second",
        "stick", "unit", "way", "where",
    )  # fmt: skip

    def __init__(
        self,
        form: str,
        flow: Scalar | None,
        bound: Scalar,
        stick: Scalar,
        gap: Scalar | None,
        e: float,
        unit: str,
    ) -> None:
        self.form, self.flow, self.bound, self.stick, self.gap, self.e = form, flow, bound, stick, gap, e
        self.unit = unit  # of the effort
        self.where: Expr | None = None  # a flag: without it there is no effort, and no mode to be left
        self.normal: tuple[Law, float, float] | None = (
            None  # by whose effort it is bounded: mu, and mus at rest
        )
        self.edge: Edge | None = None  # of a corner to one of several edges
        self.across: list[Law] = [self]  # all of a law with several directions
        self.pair: object = None  # what laws of a pair of parts have in common, slips by their corner
        # by the compiler
        self.powers: tuple[Expr, Expr] | None = None  # of a pair, at its first law (assemble/alike.py)
        self.row = self.second = -1  # unknowns: the effort, and of a corner the correction of positions
        self.effort: Expr
        self.way: Expr  # with several directions: by what its bound is multiplied where it slides
        self.flags: list[Expr]


class Relay(Law):
    def __init__(
        self, flow: Scalar, bound: Scalar, stick: Scalar, unit: str, where: Expr | None = None
    ) -> None:
        super().__init__("relay", flow, bound, stick, None, 0.0, unit)
        self.where = where

    @property
    def slides(self) -> Expr:
        return self.flags[0]

    @property
    def share(self) -> Expr:
        """-effort by bound where it slides: 1 or -1; where others hold the same motion, -effort by stick. With several
        directions: what it was at the last event."""
        return self.flags[1]

    @property
    def mode(self) -> Expr:
        """0 sticks, -1 and 1 slide; with several directions 1."""
        return self.flags[2]


class Slip(Relay):
    """Friction where a corner presses; the corner comes before it."""

    def __init__(self, flow: Scalar, corner: Corner, mu: float, mus: float, unit: str) -> None:
        super().__init__(flow, 0.0, 0.0, unit)
        self.normal = corner, mu, mus


def joined(relays: list[Relay]) -> list[Relay]:
    """As one law: flows along directions at right angles, bounds alike."""
    for relay in relays:
        relay.across = [*relays]
    return relays


class Inequality(Law):
    """A law that opens and closes, and that may be closed by an impact."""

    @property
    def closed(self) -> Expr:
        return self.flags[0]

    @property
    def hits(self) -> Expr:
        return self.flags[1]

    @property
    def impulse(self) -> Expr:
        return self.flags[2]

    @property
    def lost(self) -> Expr:
        """Kinetic energy that impacts have taken [J]."""
        return self.flags[3]


class Corner(Inequality):
    def __init__(self, gap: Scalar, e: float, unit: str, edge: Edge | None = None) -> None:
        super().__init__("corner", None, 0.0, 0.0, gap, e, unit)
        self.edge = edge


class OneWay(Inequality):
    def __init__(self, flow: Scalar, unit: str) -> None:
        super().__init__("one way", flow, 0.0, 0.0, None, 0.0, unit)
