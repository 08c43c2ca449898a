"""`.tran ... uic`: a junction behind a series resistance starts with the voltage of its terminals. It started without any
charge: the collector of a saturated transistor was off by 3.4 V."""

from __future__ import annotations

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop import ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]

SATURATED = """saturated transistor
Vcc vcc 0 5
R1 vcc c 1k
C1 b 0 100p
Rb b 0 100k
Q1 c b 0 q
C2 c 0 1p
.ic v(b)=0.75 v(c)=0.1
.model q NPN(is=10f bf=200 br=4 {} cje=8p cjc=5p tf=5n tr=50n)
.tran 0.1n 100n uic
.save v(b) v(c)
.end
"""
DECKS = {
    "base resistance": SATURATED.format("rb=200"),
    "three resistances": SATURATED.format("rb=50 rbm=20 rc=20 re=1"),
    "diode": """diode
V1 a 0 1
R1 a b 1k
D1 b 0 d
C1 b 0 10p
.ic v(b)=0.7
.model d D(is=1f rs=50 cjo=20p tt=5n)
.tran 0.1n 100n uic
.save v(b)
.end
""",
    "MOSFET": """MOSFET
Vdd vdd 0 5
M1 d g 0 0 n l=1u w=100u ad=1n as=1n
R1 vdd d 1k
Rg g 0 10k
C1 g 0 1p
.ic v(g)=3 v(d)=4
.model n nmos(vto=.7 kp=1e-4 rd=30 rs=10 cj=1m tox=20n)
.tran 0.05n 50n uic
.save v(d) v(g)
.end
""",
}


@pytest.mark.parametrize("name", DECKS)
def test_a_junction_starts_with_the_voltage_of_its_terminals(name):
    ours = emsim.run(DECKS[name])
    theirs = ngspice.run(ngspice.tightened(DECKS[name], ".", ours.main.grid, 1e-11, 1e-6))
    time = np.asarray(ours.time)
    at = np.linspace(0.0, time[-1], 400)[1:]
    for column in [column for column in ours.names if column.startswith("v(")]:
        mine, wanted = (np.interp(at, np.asarray(r.time), np.asarray(r[column])) for r in (ours, theirs))
        assert np.abs(mine - wanted).max() < 2e-3 * max(np.ptp(wanted), 0.1), column
