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


@pytest.mark.parametrize("analysis", [".op", ".tran 1u 5u"])
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
