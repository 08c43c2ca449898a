"""Closed loops: what a cut joint, a rod, a gear or a drive that finds no coordinate demands of the others; and rows of speeds.

h(q, t) = 0 for every direction in which the joint cannot move, B relative to A. Rows that fold to the
constant 0 are dropped: in a planar scene these are the out-of-plane ones. The multiplier of a row is the
force in the direction of growing h, so it acts on B from A.

A row of speeds is a(q) u - b(t) = 0, what rolls or cuts: no position is behind it, so it has no mu. Its power is
lambda (a u - b).
"""

from __future__ import annotations

from ..cards.kinematics import constant

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..cards.kinematics import Scalar

CLOSED = 1e-12  # a constant closure row below this is zero


class Row:
    """One constraint: h as it stands before symbols are replaced, a u - b where it is one of speeds; `row` and `mu_row` are its
    unknowns. What is `measured` holds h at what it is where the machine starts."""

    __slots__ = ("h", "label", "measured", "mu_row", "of_speeds", "owner", "place", "row", "unit")

    def __init__(self, owner: str, place: int, label: str, h: Expr, unit: str) -> None:
        self.owner = owner  # name of the joint, gear or drive
        self.place = place  # which row of the owner
        self.label = label
        self.h = h
        self.unit = unit  # of the multiplier: N or N m
        self.of_speeds = self.measured = False
        self.row = self.mu_row = -1


def sort_out(rows: list[tuple[str, Scalar, str]]) -> tuple[list[int], int, str]:
    """(places of rows that stay, number that folded to zero, largest constant that is not zero, with its unit)."""
    stay, folded, gap, text = [], 0, 0.0, ""
    for k, (_, h, unit) in enumerate(rows):
        value = constant(h)
        if value is None:
            stay.append(k)
        elif abs(value) < CLOSED:
            folded += 1
        elif abs(value) > gap:
            gap = abs(value)
            text = f"{gap:.3g} {'m' if unit == 'N' else 'rad'}"
    return stay, folded, text


class Start:
    """What was found: state `x`, `dof`, `moved` [(name, from, to)], `redundant` rows, `singular` there."""

    __slots__ = ("dof", "moved", "redundant", "singular", "x")

    def __init__(self) -> None:
        self.x: list[float] = []
        self.dof = 0
        self.moved: list[tuple[str, float, float]] = []
        self.redundant: list[Row] = []
        self.singular = False
