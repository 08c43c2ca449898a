"""F: i = gain i(Vsource), or a polynomial of several."""

from __future__ import annotations

from .base import M, Param
from .controlled import ByCurrent

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import ClassVar


class CurrentByCurrent(ByCurrent):
    __slots__ = ()
    letter = "f"
    what = "current-controlled current source"
    form = "Fname n+ n- Vsource gain, or POLY(n) Vsource .. coefficients"
    law = "i = gain i(Vsource)"
    instance: ClassVar[dict[str, Param]] = M
    gives_voltage = False
    jumps = 6
