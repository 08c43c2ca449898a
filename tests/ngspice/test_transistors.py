"""Circuits of transistors under several methods, each against one tight run of ngspice: every signal within 0.5 % of its range.

Currents of sources at gates are left out: they jump where a source has a corner and where Meyer's capacitances have a kink, and
what either grid has there differs. Where ngspice's own slopes
are not those of its currents .ac is not compared.
"""

from __future__ import annotations

from functools import cache

import pytest
from support import needs_ngspice

import emsim
from emsim.interop import ngspice
from emsim.reports.compare import compare

pytestmark = [needs_ngspice, pytest.mark.ngspice]

NPN = (
    ".model n npn(is=1e-14 bf=200 vaf=100 rb=20 rc=2 re=0.2 cje=10p cjc=4p tf=0.4n tr=20n ise=1e-14 ikf=0.1)"
)
PNP = ".model p pnp(is=1e-14 bf=80 vaf=50 rb=20 rc=2 re=0.2 cje=10p cjc=4p tf=1n tr=20n)"
NMOS = ".model n nmos(vto=0.8 kp=50u lambda=0.02 gamma=0.4 phi=0.65 tox=20n cgso=0.2n cgdo=0.2n cj=0.3m)"
PMOS = ".model p pmos(vto=-0.8 kp=20u lambda=0.02 gamma=0.4 phi=0.65 tox=20n cgso=0.2n cgdo=0.2n cj=0.3m)"

DECKS = {
    "amplifier": f"""VCC vcc 0 12
VIN in 0 SIN(0 10m 10k) AC 1
C1 in b 1u
R1 vcc b 47k
R2 b 0 10k
RC vcc c 4.7k
RE e 0 1k
CE e 0 10u
Q1 c b e n
{NPN}
.tran 1u 400u
.op
.ac dec 5 10 100meg""",
    "mirror": f"""VCC vcc 0 10
R1 vcc ref 10k
Q1 ref ref 0 n
Q2 o ref 0 n 2
Q3 ref2 ref2 vcc p
R2 ref2 0 10k
Q4 o2 ref2 vcc p
VO o 0 SIN(5 4 10k 0 0 90)
RL o2 0 2k
{NPN}
{PNP}
.tran 1u 300u
.op""",
    "pair": f"""VCC vcc 0 12
VEE vee 0 -12
VIN in 0 SIN(0 50m 10k) AC 1
RC1 vcc c1 10k
RC2 vcc c2 10k
Q1 c1 in e n
Q2 c2 0 e n
Q3 e b3 vee n
Q4 b3 b3 vee n
RB 0 b3 10k
{NPN}
.tran 1u 300u
.op
.dc VIN -0.2 0.2 0.01
.ac dec 5 10 100meg""",
    "saturated switch": f"""VCC vcc 0 5
VIN in 0 PULSE(0 5 1u 10n 10n 4u 10u)
RB in b 4.7k
RC vcc c 1k
Q1 c b 0 n
{NPN}
.tran 20n 12u""",
    "inverter": f"""VDD vdd 0 5
VIN in 0 PULSE(0 5 1u 0.1u 0.1u 4u 10u)
M1 out in 0 0 n l=1u w=10u ad=20p as=20p
M2 out in vdd vdd p l=1u w=20u ad=40p as=40p
CL out 0 1p
{NMOS}
{PMOS}
.tran 20n 10u""",
    "nand": f"""VDD vdd 0 5
VA a 0 PULSE(0 5 10n 1n 1n 30n 60n)
VB b 0 PULSE(0 5 20n 1n 1n 40n 80n)
M1 y a x 0 n l=1u w=8u
M2 x b 0 0 n l=1u w=8u
M3 y a vdd vdd p l=1u w=8u
M4 y b vdd vdd p l=1u w=8u
CL y 0 50f
{NMOS}
{PMOS}
.tran 0.2n 100n""",
    "jfet switch": """VIN in 0 SIN(0 1 10k)
VG g 0 PULSE(-8 0 20u 1u 1u 100u 200u)
J1 in g out j
RL out 0 1k
.model j njf(vto=-3 beta=1m lambda=5m cgs=5p cgd=5p rd=5 rs=5)
.tran 1u 300u
.op""",
    "p-channel jfet": """VDD d 0 -12
VG g 0 SIN(0.5 0.4 10k)
J1 dd g 0 j
RD d dd 3k
.model j pjf(vto=-2 beta=1m lambda=5m cgs=5p cgd=5p)
.tran 1u 200u
.op""",
    "power switch": """VS vs 0 24
VG g 0 PULSE(0 10 0 50n 50n 5u 10u)
RG g gg 10
M1 d gg 0 m
RL vs d 10
.model m vdmos(vto=3 kp=20 rd=10m rs=5m rg=3 cgs=1n cgdmax=1n cgdmin=0.1n cjo=0.5n is=1p rb=5m)
.tran 20n 20u""",
    "h-bridge": """VS vs 0 24
VA ga 0 PULSE(0 10 0 50n 50n 20u 50u)
VB gb 0 PULSE(10 0 0 50n 50n 22u 50u)
VAH gah a PULSE(0 10 0 50n 50n 20u 50u)
VBH gbh b PULSE(10 0 0 50n 50n 22u 50u)
M1 vs gah a m
M2 b ga 0 m
M3 vs gbh b m
M4 a gb 0 m
L1 a x 200u
R1 x b 2
.model m vdmos(vto=3 kp=20 rd=10m rs=5m rg=3 cgs=1n cgdmax=1n cgdmin=0.1n cjo=0.5n is=1p rb=5m tt=50n)
.tran 0.5u 100u""",
    "mesfet": """VD d 0 5
VG g 0 SIN(-0.5 0.3 10k)
RD d x 500
Z1 x g 0 z
.model z nmf(vto=-1.3 beta=2m alpha=2 b=0.3 lambda=0.05 cgs=1p cgd=0.2p)
.tran 1u 300u
.op""",
}
METHODS = ("auto", "trap", "gear", "radau", "trbdf2")
# currents that charge gates jump where a source has a corner: what either grid has there is not compared
OF_GATES = ("i(vin)", "i(va)", "i(vb)", "i(vg)", "i(vah)", "i(vbh)", "i(vdd)")
# at its rows it is within 1e-4; one step goes over half of an edge without a row inside it, where a reader draws a cubic
BETWEEN_ROWS = {("jfet switch", "radau"): 0.007}


def text(name: str) -> str:
    return f"{name}\n{DECKS[name]}\n.end\n"


@cache
def tight(name: str) -> emsim.Result:
    deck = text(name)
    tran = next((line.split() for line in deck.splitlines() if line.startswith(".tran")), None)
    assert tran is not None
    step, stop = (emsim.units.spice_number(word) for word in tran[1:3])
    for reltol in (1e-6, 1e-5, 1e-4):
        try:
            return ngspice.run(ngspice.tightened(deck, ".", (step, 0.0, stop), stop / 20_000, reltol))
        except ngspice.NgspiceError:  # its steps become too small
            continue
    pytest.fail("ngspice finds no solution")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", DECKS)
def test_within_half_a_percent_of_the_tight_run(name, method):
    ours = emsim.run(text(name), method=method)
    found = compare(ours.plots, tight(name).plots)
    off = {
        f"{row.kind} {row.name}": row.maximum
        for row in found.rows
        if row.maximum > BETWEEN_ROWS.get((name, method), 0.005) and row.name not in OF_GATES
    }
    assert len(found.rows) >= 4 and not off, off


def test_gain_by_tf_is_the_slope_of_dc():
    ours = emsim.run(text("pair").replace(".end\n", ".tf v(c1) VIN\n.end\n"))
    gain = ours.table("tf")["transfer_function"][0]
    sweep = ours.table("dc")
    out, middle = sweep["v(c1)"], len(sweep) // 2
    slope = (out[middle + 1] - out[middle - 1]) / 0.02
    assert gain == pytest.approx(slope, rel=0.05) and gain < -50
