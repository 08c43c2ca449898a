"""G: i = gain v(nc+, nc-), a polynomial, an expression or a table."""

from __future__ import annotations

from .controlled import ByVoltage


class CurrentByVoltage(ByVoltage):
    __slots__ = ()
    letter = "g"
    what = "voltage-controlled current source"
    form = (
        "Gname n+ n- nc+ nc- gain, POLY(n) .., VALUE={..},"
        " TABLE {..} = (x,y) .., LAPLACE {..} {H(s)}, or FREQ {..} = (f,dB,deg) .."
    )
    law = "i = gain v(nc+, nc-)"
    gives_voltage = False
    jumps = 8
