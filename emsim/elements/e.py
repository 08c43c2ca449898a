"""E: v = gain v(nc+, nc-), a polynomial, an expression or a table."""

from __future__ import annotations

from .controlled import ByVoltage


class VoltageByVoltage(ByVoltage):
    __slots__ = ()
    letter = "e"
    what = "voltage-controlled voltage source"
    form = (
        "Ename n+ n- nc+ nc- gain, POLY(n) .., VALUE={..},"
        " TABLE {..} = (x,y) .., LAPLACE {..} {H(s)}, or FREQ {..} = (f,dB,deg) .."
    )
    law = "v = gain v(nc+, nc-)"
    gives_voltage = True
    current_name = ""
    holds_voltage = True
    jumps = 9
