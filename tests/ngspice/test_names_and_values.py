"""Parameters of element lines without an equals sign, `area 3`: as ngspice reads them, and as the line with the sign."""

from __future__ import annotations

import pytest
from control_runs import agree
from support import needs_ngspice

import emsim
from emsim.diagnostics import DeckError

MODELS = """.param lp=3u
.model rm r rsh=100
.model cm c cj=1m
.model dm d is=1e-14 rs=1
.model qm npn
.model nm nmos kp=1m
.model jm njf
.model zm nmf
"""

THERE = {
    "R1 1 0 1k tc1 0.01 temp 50": "@r1[resistance] @r1[tc1] @r1[temp] @r1[i]",
    "R1 1 0 1k dtemp 10 tc1 1m tc2 2u m 2 noisy 0": "@r1[dtemp] @r1[tc2] @r1[m] @r1[i]",
    "R1 1 0 rm l 20u w lp": "@r1[l] @r1[w] @r1[i]",
    "R1 1 0 resistance 1k tc1 0.01 temp 50": "@r1[i]",
    "R1 1 3 1k\nC1 3 0 1u ic 2 m 3": "@c1[ic] @c1[m]",
    "R1 1 3 1k\nL1 3 0 1u ic 2 m 3": "@l1[ic] @l1[m]",
    "T1 1 0 3 0 z0 50 td 1n\nR1 3 0 1": "@t1[z0] @t1[td] v(3)",
    "R1 1 3 1k\nD1 3 0 dm off area 3": "@d1[area] v(3)",
    "J1 1 2 0 jm area 2": "@j1[area] @j1[id]",
    "J1 1 2 0 jm 2 m 4": "@j1[m] @j1[id]",
    "R1 1 3 1k\nZ1 3 2 0 zm area 2": "v(3)",
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("line", THERE)
def test_a_name_before_a_value_is_its_parameter(line, tmp_path):
    agree(f"V1 1 0 5\nV2 2 0 -0.5\n{line}\n{MODELS}", f"op\nprint {THERE[line]}", tmp_path)


WITH_SIGN = {
    "D1 3 0 dm area 3 off": "D1 3 0 dm area=3 off",
    "D1 3 0 dm 2 off temp 30": "D1 3 0 dm 2 off temp=30",
    "Q1 3 2 0 qm area 3 m 2": "Q1 3 2 0 qm area=3 m=2",
    "Q1 3 2 0 qm 2 off m 3": "Q1 3 2 0 qm 2 off m=3",
    "M1 3 2 0 0 nm l 2u w 10u ad {1p}": "M1 3 2 0 0 nm l=2u w=10u ad=1p",
    "M1 3 2 0 0 nm w 10u l lp ic 1,2,3": "M1 3 2 0 0 nm l=3u w=10u ic=1,2,3",
    # a node and a model may have a parameter's name
    "M1 3 2 0 l nm l=2u w 10u\nRl l 0 1": "M1 3 2 0 0 nm l=2u w=10u",
    "X1 3 2 s m=2\n.subckt s 3 2\nQ1 3 2 0 qm m 3\n.ends": "Q1 3 2 0 qm m=6",
    "R2 3 0 w 10u\n.model w r": "R2 3 0 10u",
}


@pytest.mark.parametrize("line", WITH_SIGN)
def test_it_is_the_line_with_the_sign(line):
    head = f"words\nV1 1 0 5\nV2 2 0 0.7\nR1 1 3 1k\n{MODELS}"
    one, other = (emsim.run(f"{head}{text}\n.op\n.end\n") for text in (line, WITH_SIGN[line]))
    assert one["v(3)"][-1] == other["v(3)"][-1]


@pytest.mark.parametrize(
    ("line", "code", "said"),
    [
        ("Q1 1 2 0 qm area", "E102", "area"),
        ("Q1 1 2 0 qm aera 3", "E307", "aera="),
        ("D1 1 0 dm area 3 4", "E102", "4"),
        ("M1 1 2 0 0 nm l there", "E102", "l"),
        ("R1 1 0 1k tc1", "E140", "tc1"),
        ("C1 1 0 1u ic there", "E110", "there"),
    ],
)
def test_what_is_no_pair_is_told(line, code, said):
    with pytest.raises(DeckError) as error:
        emsim.run(f"words\nV1 1 0 5\nV2 2 0 1\n{MODELS}{line}\n.op\n.end\n")
    found = error.value.diagnostics[0]
    assert found.code == code and said in found.message + str(found)
