"""Iron that saturates, as part of the co-energy of a machine."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..base import Scalar, Scene


def saturates(s: Scene, square: Scalar, isat: float | None) -> Scalar:
    """What the co-energy of iron goes with, of i^2: half of it, and with isat isat^2 (S - 1), S^2 = 1 + (i/isat)^2.
    Its slope is i/S. One function of all currents that magnetise the same iron: they saturate it together."""
    if isat is None:
        return 0.5 * square
    return square / (1.0 + s.b.call("sqrt", 1.0 + square * (1.0 / (isat * isat))))
