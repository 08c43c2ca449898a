"""The diode's law is written twice, in the engine and as devices/diode.va; here they are one.

They differed: in breakdown with a sidewall (ibv is a current of the bottom alone), at temperatures with n other than 1 (the
sidewall's saturation current follows ns, which is 1 where it is not given), and in gmin of devices in parallel. ngspice confirms
the engine's.
"""

from __future__ import annotations

import random

import pytest
from support import needs_ngspice

import emsim
from emsim.interop import ngspice

COUNT = 40
# chooses the module, and carries nothing
MODULE = " isr=1e-40 nr=2"
TAIL = [".options reltol=1e-6 abstol=1e-15", ".op", ".end", ""]


def cards() -> list[tuple[str, str, float]]:
    """Random .models, words of the line, voltages."""
    r, found = random.Random(3), []
    for _ in range(COUNT):
        words = {"is": f"{10 ** r.uniform(-15, -12):.4g}", "n": f"{r.choice([1, r.uniform(1, 1.6)]):.4g}"}
        words["jsw"] = f"{10 ** r.uniform(-16, -12):.4g}"
        # a current that is far above the leakage, so that breakdown's voltage does not hang on when its iteration ends
        words["bv"], words["ibv"] = f"{r.uniform(3, 8):.4g}", f"{10 ** r.uniform(-4, -2):.4g}"
        optional = {"ns": f"{r.uniform(1, 2):.4g}", "nbv": f"{r.uniform(1, 2):.4g}", "tcv": "2m", "tlev": "1"}
        optional |= {"ikf": "10m", "ikr": "20m", "tnom": "40", "xti": "2", "eg": "0.8", "rs": "2"}
        words |= {k: v for k, v in optional.items() if r.random() < 0.4}
        line = f"area={r.choice([1, 2.5])} pj={r.choice([0, 2, 7])} m={r.choice([1, 3])}"
        bv = float(words["bv"])
        volts = r.choice([-2, -0.02, 0.55, 0.65, 0.01 - bv, -bv - r.uniform(-0.2, 0.15)])
        found.append((" ".join(f"{k}={v}" for k, v in words.items()), line, volts))
    return found


def bench(more: str, temp: float) -> str:
    lines = ["diodes"]
    for k, (card, line, volts) in enumerate(cards()):
        lines += [f".model d{k} D({card}{more})", f"V{k} n{k} 0 {volts}", f"D{k} n{k} 0 d{k} {line}"]
    return "\n".join([*lines, f".temp {temp}", *TAIL])


@pytest.mark.parametrize("temp", [-40, 27, 50, 125])
def test_the_module_carries_what_the_engine_s_law_carries(temp):
    built_in, module = emsim.run(bench("", temp)).table("op"), emsim.run(bench(MODULE, temp)).table("op")
    for k, of in enumerate(cards()):
        name = f"i(v{k})"
        assert module[name][0] == pytest.approx(built_in[name][0], rel=1e-5, abs=1e-14), of


@needs_ngspice
@pytest.mark.ngspice
def test_and_what_ngspice_says_of_them():
    text = bench("", 50)
    ours, theirs = emsim.run(text).table("op"), ngspice.run(text).plots[0]
    for k, of in enumerate(cards()):
        name = f"i(v{k})"
        assert ours[name][0] == pytest.approx(theirs[name][0], rel=1e-4, abs=1e-13), of


def test_breakdown_with_a_sidewall():
    """1.00494 mA is ngspice 39's."""
    table = emsim.run("""breakdown of a diode with a sidewall, without and with recombination
V1 a 0 -6
R1 a b 1k
D1 b 0 d1
V2 c 0 -6
R2 c d 1k
D2 d 0 d2
.model d1 D(is=1e-14 jsw=1e-15 pj=2 bv=5)
.model d2 D(is=1e-14 jsw=1e-15 pj=2 bv=5 isr=1e-30 nr=2)
.temp 50
.op
.end
""").table("op")
    assert table["i(v1)"][0] == pytest.approx(1.00494e-3, rel=1e-5)
    assert table["i(v2)"][0] == pytest.approx(1.00494e-3, rel=1e-5)


def test_the_least_base_resistance_that_is_not_given_has_its_own_temperature_law():
    """ngspice takes rb for rbm, with rbm's coefficients trm1 and trm2: -37.61637 mA (ngspice 39)."""
    table = emsim.run("""rb at two temperatures
Vc c 0 3
Vb b 0 0.7
Q1 c b 0 q temp=90
.model q npn(is=1e-14 bf=150 vaf=60 ikf=0.1 rb=50 trb1=1e-3 re=0.5 rc=1)
.op
.end
""").table("op")
    assert table["i(vc)"][0] == pytest.approx(-37.61637e-3, rel=1e-6)
