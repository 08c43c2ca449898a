"""rod: a massless bar of fixed length between two points. Without l= its length is measured once the other loops of the
start have closed (assemble/closing.py)."""

from __future__ import annotations

from ..base import Default
from ..kinematics import dot, settle
from .base import JointKind

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar

    from ..._engine import Builder
    from ...diagnostics import Sink
    from ..base import Param
    from ..kinematics import Frame, Vector
    from .base import Closure


class Rod(JointKind):
    name = "rod"
    meaning = "everything that keeps the distance of its points"
    params: ClassVar[dict[str, Param]] = {
        "l": Default(None, "m", "the length of a rod; the distance of its ends at the start", above=0.0)
    }
    in_tree = False
    has_zero = False
    drawn = "rod"
    l: float | None  # noqa: E741

    def check(self, sink: Sink) -> None:
        self.length = self.l

    @property
    def unmeasured(self) -> bool:
        return self.length is None

    def closure(self, b: Builder, fa: Frame, fb: Frame, d: Vector) -> Closure:
        length = b.call("sqrt", settle(dot(d, d)))
        return [("length", length - (self.length or 0.0), "N")]

    def leaves_plane(self) -> bool:
        return False
