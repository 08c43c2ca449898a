"""F: i = gain i(Vsource), or a polynomial of several."""

from __future__ import annotations

from .base import M
from .controlled import ByCurrent


class CurrentByCurrent(ByCurrent):
    __slots__ = ()
    letter = "f"
    what = "current-controlled current source"
    form = "Fname n+ n- Vsource gain, or POLY(n) Vsource .. coefficients"
    law = "i = gain i(Vsource)"
    instance = M
    gives_voltage = False
    jumps = 6
