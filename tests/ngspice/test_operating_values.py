"""@q1[gm] and the like over a sweep are those of ngspice, in every region; diodes beyond the plain law too."""

from __future__ import annotations

import re
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim

pytestmark = needs_ngspice

BFS17 = """.model m npn(is=0.48f nf=1.008 bf=99.655 vaf=90 ikf=0.19 ise=7.49f ne=1.762 nr=1.01 br=38.4 var=7 ikr=93.2m isc=0.2f
+ nc=1.042 rb=1.5 irb=0.1m rbm=1.2 re=0.5 rc=2.68 cje=1.325p vje=0.7 mje=0.22 fc=0.89
+ cjc=1.05p vjc=0.61 mjc=0.24 xcjc=0.4 tf=56.94p tr=1n
+ ptf=21 xtf=68.398 vtf=0.6 itf=0.7)"""
JUNCTION = "is=1e-14 n=1.1 rs=1 cjo=2p vj=0.7 m=0.4 tt=5n bv=20 ibv=1m"
CASES = {
    "bjt with excess phase": (
        f"V1 1 0 10\nRc 1 c 2k\nVb b 0 0\nQ1 c b 0 m\n{BFS17}", "vb 0.5 0.95 0.05", "q1", "gm go gpi gmu cpi cmu qbe qbc ic ib",
    ),
    "diode": (f"V1 1 0 0\nD1 1 0 m\n.model m d({JUNCTION})", "v1 -15 0.9 0.3", "d1", "id gd"),
    "diode with recombination": (
        f"V1 1 0 0\nD1 1 0 m\n.model m d({JUNCTION} isr=1e-9 nr=2)", "v1 0.05 0.9 0.05", "d1", "id",
    ),
    "diode with tunnelling and sidewall": (
        f"V1 1 0 0\nD1 1 0 m pj=3\n.model m d({JUNCTION} jsw=1e-15 jtun=1e-9 jtunsw=1e-10 ntun=25)",
        "v1 -3 0.8 0.1", "d1", "id gd",
    ),
    "diode by geometry": (
        "V1 1 0 0\nD1 1 0 m l=20u w=10u\n.model m d(level=3 is=1e-5 jsw=1e-10 cj=1e-3 n=1.05)", "v1 0.1 0.7 0.05", "d1", "id gd",
    ),
    "jfet": (
        "Vd d 0 3\nVg g 0 0\nJ1 d g 0 m\n.model m njf(vto=-2 beta=1m lambda=0.02 rd=10 rs=10)",
        "vg -2.5 0.2 0.1", "j1", "id gm gds",
    ),
    "mos1": (
        "Vd d 0 3\nVg g 0 0\nVb b 0 -1\nM1 d g 0 b m w=10u l=2u\n.model m nmos(vto=1 kp=50u gamma=0.4 phi=0.6 lambda=0.02)",
        "vg 0 5 0.25", "m1", "id gm gds gmbs",
    ),
}  # fmt: skip


def of_ngspice(text: str, columns: list[str], tmp_path) -> dict[str, np.ndarray]:
    (tmp_path / "deck.cir").write_text(text)
    printed = subprocess.run(
        ["ngspice", "-b", "deck.cir"], cwd=tmp_path, capture_output=True, text=True, timeout=60
    ).stdout
    found: dict[str, list[float]] = {}
    heads: list[str] = []
    for line in printed.splitlines():
        words = line.split()
        if words[:1] == ["Index"]:
            heads = words[2:]
        elif heads and re.match(r"\d+\s", line):
            for head, word in zip(heads, words[2:], strict=True):
                found.setdefault(head, []).append(float(word))
    return {name: np.array(found[name]) for name in columns}


@pytest.mark.parametrize("case", CASES)
def test_values_of_the_operating_point_are_those_of_ngspice(case, tmp_path):
    lines, sweep, device, names = CASES[case]
    columns = [f"@{device}[{name}]" for name in names.split()]
    options = ".options reltol=1e-9 abstol=1e-16 gmin=1e-14"
    text = f"operating point\n{lines}\n{options}\n.save {' '.join(columns)}\n.dc {sweep}\n"
    theirs = of_ngspice(
        f"{text}.control\nrun\nset width=500\nprint {' '.join(columns)}\n.endc\n.end\n", columns, tmp_path
    )
    ours = emsim.run(f"{text}.end\n")
    for name in columns:
        size = np.max(np.abs(theirs[name]))
        # what one junction's exponential has in place of ngspice's limits and gmin is told apart by the floor
        np.testing.assert_allclose(ours[name], theirs[name], rtol=2e-4, atol=1e-7 * size, err_msg=name)


def test_a_resistor_has_another_value_to_small_signals():
    """ac= was taken and had no effect."""
    deck = """partition
V1 1 0 dc 1 ac 1
R1 1 2 5k
R2 2 0 5k ac=15k
R3 2 0 10 ac=30 m=2 tc1=1m temp=127 scale=1k
.save v(2) i(r2) @r2[p]
.end
"""
    r = emsim.run(deck, analyses=[".op"])
    small = 1 / (1 / 15e3 + 2 / 33e3)
    plain = 1 / (1 / 5e3 + 2 / 11e3)
    assert r["v(2)"][0] == pytest.approx(plain / (5e3 + plain), rel=1e-9)
    r = emsim.run(deck, analyses=[".ac dec 1 10 100"])
    np.testing.assert_allclose(r["v(2)"], small / (5e3 + small), rtol=1e-9)
    np.testing.assert_allclose(r["i(r2)"], small / (5e3 + small) / 15e3, rtol=1e-9)
    # Nyquist: a resistance makes the noise that belongs to it (ngspice takes that of the operating point)
    r = emsim.run(deck, analyses=[".noise v(2) v1 dec 1 10 100"])
    g = 300.15 * (1 / 5e3 + 1 / 15e3) + 400.15 * 2 / 33e3
    size = np.sqrt(4 * 1.380649e-23 * g) / (1 / 5e3 + 1 / small)
    np.testing.assert_allclose(r["onoise_spectrum"], size, rtol=1e-6)  # constants of ngspice


def test_noise_at_one_frequency_has_no_total():
    r = emsim.run("one\nV1 1 0 dc 0 ac 1\nR1 1 2 1k\nR2 2 0 1k\n.noise v(2) v1 lin 1 1k 1k\n.end\n")
    assert r["onoise_spectrum"][0] == pytest.approx(np.sqrt(4 * 1.380649e-23 * 300.15 * 500), rel=1e-6)
    assert "onoise_total" not in r.names


LINES = "ron=0.1 roff=1k vfwd=0.6 vrev=3 rrev=2"


@pytest.mark.parametrize(
    "more, at",
    [
        ("", {-4.0: -0.004 - 0.499, -1.0: -1e-3, 0.5: 5e-4, 1.6: 1.6e-3 + 9.999}),
        ("epsilon=0.2", {0.7: 7e-4 + 9.999 * 0.01 / 0.4, 0.8: 8e-4 + 0.9999, 1.6: 1.6e-3 + 9.999 * 0.9}),
        ("revepsilon=0.5 revilimit=1", {-3.25: -3.25e-3 - np.tanh(0.499 * 0.0625), -9.0: -9e-3 - np.tanh(0.499 * 5.75)}),
        ("ilimit=2", {1.6: 1.6e-3 + 2 * np.tanh(9.999 / 2), 0.65: 6.5e-4 + 2 * np.tanh(0.49995 / 2)}),
    ],
)  # fmt: skip
def test_ltspices_diode_of_straight_lines(more, at):
    for volts, amps in at.items():
        r = emsim.run(f"lines\nV1 1 0 {volts}\nD1 1 0 m\n.model m d({LINES} {more})\n.op\n.end\n")
        assert r["i(v1)"][0] == pytest.approx(-amps, rel=1e-9), volts


def test_a_rectifier_of_straight_lines():
    """Half a wave of 5 V less 0.6 V into 100 Ohm behind 0.1 Ohm: what is on is on between the crossings of 0.6 V."""
    deck = """rectifier
V1 1 0 sin(0 5 1k)
D1 1 2 m
R1 2 0 100
.model m d(ron=0.1 roff=1g vfwd=0.6)
.options reltol=1e-6
.tran 10u 1m
.meas tran mean avg v(2) from=0 to=1m
.end
"""
    r = emsim.run(deck)
    first = np.arcsin(0.12)
    mean = (5 * 2 * np.cos(first) - 0.6 * (np.pi - 2 * first)) / (2 * np.pi) * 100 / 100.1
    assert r.measures["mean"] == pytest.approx(mean, rel=1e-5)
    assert not r.diagnostics


def test_a_transconductance_is_the_slope_of_the_current():
    """Also where an excess phase puts a lag between base and collector: it was 0 there."""
    bare = re.sub(r"\b(rb|rbm|re|rc)=\S+", r"\1=0", BFS17)  # without series resistances
    deck = (
        f"slope\nVc c 0 5\nVb b 0 {{v}}\nQ1 c b 0 m\n{bare}\n.save @q1[gm] @q1[ic]\n.op\n.param v=0.7\n.end\n"
    )
    here, up, down = (emsim.run(deck, defines={"v": str(v)}) for v in (0.7, 0.7001, 0.6999))
    slope = (up["@q1[ic]"][0] - down["@q1[ic]"][0]) / 2e-4
    assert here["@q1[gm]"][0] == pytest.approx(slope, rel=1e-5)


BETWEEN_EQUAL_ENDS = {
    "mos1": "M1 d g 0 0 m w=10u l=2u\n.model m nmos(vto=1 kp=50u gamma=0.4 lambda=0.02)",
    "mos1, p": "M1 d g 0 0 m w=10u l=2u\n.model m pmos(vto=-1 kp=50u)",
    "mos2": "M1 d g 0 0 m w=10u l=2u\n.model m nmos(level=2 vto=1 kp=50u tox=40n nsub=1e16)",
    "mos3": "M1 d g 0 0 m w=10u l=2u\n.model m nmos(level=3 vto=1 kp=50u tox=40n nsub=1e16)",
    "mos6": "M1 d g 0 0 m w=10u l=2u\n.model m nmos(level=6 vto=1 kc=50u)",
    "jfet": "J1 d g 0 m\n.model m njf(vto=-5 beta=1m)",
    "jfet2": "J1 d g 0 m\n.model m njf(level=2 vto=-5 beta=1m)",
    "mesfet": "Z1 d g 0 m\n.model m nmf(vto=-5 beta=1m)",
    "vdmos": "M1 d g 0 m\n.model m vdmos(vto=1 kp=1)",
}


@pytest.mark.parametrize("device", BETWEEN_EQUAL_ENDS.values(), ids=BETWEEN_EQUAL_ENDS)
def test_a_transistor_without_a_voltage_between_its_ends_conducts(device, tmp_path):
    """The slope of the current at vds = 0 is that beside it: the wire from 1 A into the drain has dv/di of both."""
    gate = "-3" if "pmos" in device else "0" if "njf" in device or "nmf" in device else "3"
    text = f"small signal\nVg g 0 {gate}\nI1 0 d 0 AC 1\n{device}\n.ac lin 1 1m 1m\n.print ac vr(d)\n.end\n"
    beside = text.replace("I1 0 d 0", "I1 0 d 1n")
    (tmp_path / "at.cir").write_text(text)
    (tmp_path / "beside.cir").write_text(beside)
    at, near = (emsim.run(tmp_path / f"{name}.cir").ac["v(d)"][0].real for name in ("at", "beside"))
    assert at == pytest.approx(near, rel=1e-3)
    if "level=6" in device:
        return  # without small signals in ngspice
    assert at == pytest.approx(of_ngspice(text, ["vr(d)"], tmp_path)["vr(d)"][0], rel=1e-3)
