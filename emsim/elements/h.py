"""H: v = gain i(Vsource), or a polynomial of several."""

from __future__ import annotations

from .base import named
from .controlled import ByCurrent


class VoltageByCurrent(ByCurrent):
    __slots__ = ()
    letter = "h"
    what = "current-controlled voltage source"
    form = "Hname n+ n- Vsource gain, or POLY(n) Vsource .. coefficients"
    law = "v = gain i(Vsource)"
    instance = named()
    gives_voltage = True
    current_name = ""
    holds_voltage = True
    jumps = 7

    def reads_currents(self) -> bool:
        return True
