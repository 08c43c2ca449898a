"""Small decks whose words ngspice reads in a way of its own: operating points and runs here and there."""

from __future__ import annotations

import re
import subprocess

import pytest
from support import needs_ngspice

import emsim

pytestmark = [needs_ngspice, pytest.mark.ngspice]


def here(body: str, names: list[str]) -> list[float]:
    """The last row of the run that the deck asks for."""
    result = emsim.run(f"deck\n{body}\n.end\n")
    return [float(result[name][-1]) for name in names]


def there(body: str, names: list[str]) -> list[float]:
    """The same of ngspice."""
    last = "" if ".op" in body else "[length({})-1]"
    shown = [f"print {n}{last.format(n)}" for n in names]
    lines = [".control", "set numdgt=12", "run", *shown, "quit", ".endc", ".end", ""]
    done = subprocess.run(
        ["ngspice", "-b"], input="\n".join(["deck", body, *lines]), capture_output=True, text=True, timeout=60
    )
    found = re.findall(r"^(?:[^=\n]*) = (\S+)$", done.stdout, re.MULTILINE)
    return [float(x) for x in found[-len(names) :]]


def agree(body: str, *names: str, within: float = 1e-6) -> None:
    assert here(body, list(names)) == pytest.approx(there(body, list(names)), rel=within, abs=1e-12)


SWITCHES = """V1 1 0 1
R1 1 a 1k
R2 1 b 1k
R3 1 c 1k
Vc m 0 {at}
Rm m m2 1
Vm m2 0 0
{letter}1 a 0 {control} x
{letter}2 b 0 {control} x ON
{letter}3 c 0 {control} x OFF
.model x {model}"""


@pytest.mark.parametrize("analysis", [".op", ".tran 1u 5u", ".tran 1u 5u UIC"])
@pytest.mark.parametrize("letter", ["S", "W"])
@pytest.mark.parametrize(("threshold", "at"), [(0, 0.5), (5, 3), (5, 4.5), (5, 7), (-5, -4.5), (-5, -3)])
def test_switches_between_their_thresholds(letter, threshold, at, analysis):
    control, model = ("m 0", "sw(vt={} vh=1") if letter == "S" else ("Vm", "csw(it={} ih=1")
    model = model.format(threshold) + " ron=1 roff=1meg)"
    body = SWITCHES.format(at=at, letter=letter, control=control, model=model)
    agree(f"{body}\n{analysis}", "v(a)", "v(b)", "v(c)")


def test_a_is_ampere():
    agree(
        "I1 0 a 1A\nR1 a 0 2Amp\nI2 0 b SIN(0 5a 1k)\nR2 b 0 {2a}\n.tran 1u 0.25m",
        "v(a)",
        "v(b)",
        within=1e-3,
    )


@pytest.mark.parametrize("temperature", [27, 85])
@pytest.mark.parametrize("side", ["jsw=3e-12 ns=1.5", "jsw=3e-12", "jsw=3e-12 ns=1.5 bv=20 ikf=1m"])
def test_sidewall_of_a_diode(side, temperature):
    lines = [
        f"V{k} {k} 0 {v}\nD{k} {k} 0 d area=2 pj=5 m=2" for k, v in enumerate((-20.2, -3, 0.3, 0.6, 0.8), 1)
    ]
    model = f".model d d(is=1e-14 n=1.1 cjo=1p {side})"
    body = "\n".join([*lines, model, f".options temp={temperature}", ".op"])
    agree(body, *(f"i(v{k})" for k in range(1, 6)))


PARAMETERS = ".param rv=2k vv=3 gain=5 cv=1u lv=2m kk=0.5 warm=2m\n"
WORDS = {
    "R V E": ("V1 1 0 vv\nR1 1 2 rv\nR2 2 0 1k\nE1 3 0 2 0 gain\nR3 3 0 1k\n.op", "v(2)", "v(3)"),
    "a .param before a .model": ("V1 1 0 1\nR1 1 0 rv\n.model rv r(r=500)\n.op", "i(v1)"),
    "of the circuit before a .model within": (
        ".subckt s a b\nR1 a b rv\n.model rv r(r=7)\n.ends\nV1 1 0 1\nX1 1 0 s\n.op", "i(v1)",
    ),
    "of a subcircuit": (".subckt s a b r=3\nR1 a b r\n.ends\nV1 1 0 1\nX1 1 0 s r=rv\n.op", "i(v1)"),
    "a .model where there is no .param": ("V1 1 0 1\nR1 1 0 rm\n.model rm r(r=500)\n.op", "i(v1)"),
    "F G H POLY": (
        "V1 1 0 1\nR1 1 0 1\nF1 0 2 V1 gain\nR2 2 0 1\nG1 0 3 1 0 gain\nR3 3 0 1\nH1 4 0 V1 gain\nR4 4 0 1\n"
        "E1 5 0 POLY(1) 1 0 vv gain\nR5 5 0 1\n.op", "v(2)", "v(3)", "v(4)", "v(5)",
    ),
    "PULSE": ("V1 1 0 PULSE(0 vv 0 1u 1u 1 2)\nR1 1 2 rv\nC1 2 0 cv\n.tran 10u 2m", "v(2)"),
    "PWL": ("V1 1 0 PWL(0 0 1m vv)\nR1 1 2 rv\nC1 2 0 cv\n.tran 10u 2m", "v(2)"),
    "C IC L K": (
        "R1 1 0 rv\nC1 1 0 cv IC=vv\nI1 0 2 PULSE(0 1 0 1m 1m 5m)\nL1 2 0 lv\nR2 2 0 1\nL2 3 0 lv\nR3 3 0 1\n"
        "K1 L1 L2 kk\n.tran 10u 2m uic", "v(1)", "v(3)",
    ),
    "tc1": ("V1 1 0 1\nR1 1 0 1k tc1=warm\n.temp 127\n.op", "i(v1)"),
    "SINE": ("V1 1 0 SINE(1 2 1k)\nR1 1 2 1k\nC1 2 0 100n\n.tran 1u 1.3m", "v(2)"),
    "gain=": ("V1 s 0 2\nE1 1 0 s 0 gain=3\nR1 1 0 1\nVm s x 0\nRx x 0 1\nF1 0 2 Vm gain=3\nR2 2 0 1\n.op", "v(1)", "v(2)"),
    "k=": (
        "I1 0 2 PULSE(0 1 0 1m 1m 5m)\nL1 2 0 2m\nR2 2 0 1\nL2 3 0 2m\nR3 3 0 1\nK1 L1 L2 k=0.5\n.tran 10u 2m", "v(3)",
    ),
    "brackets and commas": (
        "V1 (s 0) 1\nR1 (s b) 1k, tc=1m\nR2 b,0,1k\nE1 (e 0) (s,0) 3\nR3 e 0 1\nB1 (f, 0) V=2*v(s)\nR4 f 0 1\n"
        "F1 (0 g) V1 2\nR5 g 0 1\n.subckt two a b\nR1 a b 2\n.ends\nX1 (s 0) two\nL1 (s h) 1m\nR6 h,0 1\n.temp 127\n.op",
        "v(b)", "v(e)", "v(f)", "v(g)", "i(v1)", "v(h)",
    ),
    "temper": (".param r={1k*(1+4m*(temper-27))}\nV1 1 0 1\nR1 1 0 {r}\nB1 2 0 V=temper*r\nR2 2 0 1\n.temp 127\n.op",
               "i(v1)", "v(2)"),
    "temper after .options": (".param rt={1k*(1+4m*(temper-27))}\nV1 1 0 1\nR1 1 0 {rt}\n.options temp=127\n.op", "i(v1)"),
    "DC alone": ("V1 1 0 DC\nR1 1 0 1\nV2 2 0 DC AC 1\nR2 2 0 1\n.op", "v(1)", "v(2)"),
    "DC alone, then a wave": ("V1 1 0 DC SIN(1 2 1k)\nR1 1 2 1k\nC1 2 0 100n\n.tran 1u 1.3m", "v(2)"),
    "PWL r": ("V1 1 0 PWL(0 0 1m 1 2m 0) r 0\nR1 1 2 1k\nC1 2 0 100n\n.tran 10u 5.5m", "v(2)"),
    "PWL r td": ("V1 1 0 PWL(0 0 1m 1 2m 0) r 0 td 1m\nR1 1 2 1k\nC1 2 0 100n\n.tran 10u 5.5m", "v(2)"),
    "PWL r within": ("V1 1 0 PWL(0 0 1m 1 2m 0 r 0)\nR1 1 2 1k\nC1 2 0 100n\n.tran 10u 5.5m", "v(2)"),
}  # fmt: skip


@pytest.mark.parametrize("title", WORDS)
def test_words(title):
    body, *names = WORDS[title]
    agree(PARAMETERS + body, *names, within=2e-3 if ".tran" in body else 1e-6)


@pytest.mark.parametrize(
    "more", ["dw=0.2u", "narrow=0.2u", "dlr=0.2u", "short=0.2u", "tc1r=0.2", "tc1r=1m tc2r=10u"]
)
def test_resistor_models(more):
    agree(f"V1 1 0 1\nR1 1 0 m l=10u w=2u\n.model m r(rsh=100 {more})\n.temp 127\n.op", "i(v1)")


def test_operating_points_know_nothing_of_ic():
    agree("V1 a 0 5\nR1 a b 1k\nR2 b 0 1k\nC1 b 0 1u\n.ic v(b)=1\n.op", "v(b)")


@pytest.mark.parametrize(
    "names", ["js=1e-12 is=1e-15", "is=1e-15 js=1e-12", "is=1e-13 js=1e-12 is=1e-15", "rs=5 trs=1m trs1=9m"]
)
def test_of_two_names_of_one_parameter_the_last_holds(names):
    """The first name of the table held, whatever came last."""
    agree(f"I1 0 a 1m\nD1 a 0 d\n.model d d({names} n=1.2)\n.temp 60\n.op", "v(a)", within=1e-4)


@pytest.mark.parametrize("names", ["vto=1 vt0=2", "vt0=2 vto=1"])
def test_of_two_names_of_one_parameter_of_a_transistor_the_last_holds(names):
    agree(f"I1 0 d 1m\nM1 d d 0 0 m\n.model m nmos({names} kp=1m)\n.op", "v(d)")
