"""`.noise` against ngspice: spectra and totals, of every source by its name; and against closed forms, machines among them."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.interop.ngspice import named_alike
from emsim.outputs import raw
from emsim.outputs.text import lines

K, Q, T = 1.38064852e-23, 1.6021766208e-19, 300.15
TIGHT = ".options reltol=1e-9 abstol=1e-18 vntol=1e-15"

DECKS = {
    "divider with a junction and a switch": """noise
v1 in 0 dc 1 ac 1
r1 in out 1k
r2 out 0 2k noisy=0
c1 out 0 1n
d1 out 0 dm
.model dm d is=1e-14 kf=1e-15 af=1 rs=10 cjo=1p
s1 out 0 in 0 sw1
.model sw1 sw vt=2 roff=5k
.noise v(out) v1 dec 5 1 1meg 1
""",
    "subcircuits, temperatures, several in parallel": """noise
v1 in 0 dc 2 ac 1
x1 in out cell
.subckt cell a b
r1 a b 1k m=3 dtemp=50
d1 b 0 dm
r2 b c 5k dtemp=-20 tc1=1m
c2 c 0 100p
.ends
.model dm d is=1e-13 n=1.5 kf=2e-14 af=1.2 rs=4
.temp 40
.noise v(out) v1 oct 3 10 100k 1
""",
    "1/f of a resistor, a current source, two nodes": """noise
i1 0 in dc 1m ac 1
r1 in out rf l=100u w=10u
r2 out 0 1k
r3 in 0 3k
c1 out 0 10n
.model rf r rsh=100 kf=1e-20 af=1.8 ef=1.1 lf=0.9 wf=1.1
.noise v(in,out) i1 lin 21 100 10k 1
""",
    "controlled sources and a coil": """noise
v1 in 0 ac 1
r1 in a 1k
e1 b 0 a 0 5
r2 b c 600
l1 c out 1m
g1 out 0 a 0 1m
r3 out 0 50
w1 out 0 v1 ws
.model ws csw it=1 ih=0.1 ron=1 roff=10k
.noise v(out) v1 dec 4 100 10meg 1
""",
    "a bipolar stage": """noise
vcc vcc 0 12
v1 in 0 ac 1
cin in b 10u
r1 vcc b 68k
r2 b 0 12k
rc vcc c 4.7k
re e 0 1k
ce e 0 100u
q1 c b e qm
cl c out 10u
rl out 0 100k
.model qm npn is=1e-14 bf=150 vaf=80 rb=200 rc=5 re=1 cje=10p cjc=4p tf=0.4n kf=1e-14 af=1.1
.noise v(out) v1 dec 5 10 100meg 1
""",
    "a MOS stage": """noise
vdd vdd 0 5
v1 in 0 dc 1.5 ac 1
rd vdd d 10k
m1 d in 0 0 nm w=20u l=1u
cl d 0 1p
.model nm nmos level=1 vto=0.7 kp=100u lambda=0.02 rd=50 rs=20 kf=1e-26 af=1 cgso=1n cgdo=1n tox=20n
.noise v(d) v1 dec 5 10 100meg 1
""",
    "a JFET stage": """noise
vdd vdd 0 12
v1 in 0 ac 1
cin in g 1u
rg g 0 1meg
rd vdd d 3.3k
rs s 0 1k
cs s 0 100u
j1 d g s jm
.model jm njf vto=-2 beta=1m lambda=0.01 rd=10 rs=10 cgs=3p cgd=2p kf=1e-16 af=1.1 is=1e-14
.noise v(d) v1 dec 5 10 100meg 1
""",
    "every third point": """noise
v1 in 0 dc 1 ac 1
r1 in out 1k
c1 out 0 1u
.noise v(out) v1 dec 5 1 10k 3
""",
    "totals alone": """noise
v1 in 0 dc 1 ac 1
r1 in out 1k
c1 out 0 1u
.noise v(out) v1 dec 5 1 10k
""",
}  # fmt: skip


def oracle(tmp_path, text: str) -> list:
    (tmp_path / "deck.cir").write_text(text)
    command = ["ngspice", "-b", "-r", "out.raw", "deck.cir"]
    subprocess.run(command, cwd=tmp_path, capture_output=True, timeout=60, stdin=subprocess.DEVNULL)
    return named_alike(raw.read(str(tmp_path / "out.raw"))).plots


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", DECKS)
def test_spectra_and_totals_as_ngspice(tmp_path, name):
    text = DECKS[name] + TIGHT + "\n.end\n"
    ours, theirs = emsim.run(text).plots, oracle(tmp_path, text)
    assert [t.plotname for t in ours] == [t.plotname for t in theirs]
    assert [t.kind for t in ours] == ["noise", "integrated noise"]
    for a, b in zip(ours, theirs, strict=True):
        assert {n for n in a.names if not n.startswith("inoise_total")} == set(b.names) and len(a) == len(b)
        for column in b.names:
            x, y = a.column(column), b.column(column)
            assert np.abs(x - y).max() <= 1e-4 * np.abs(y).max(), column


def test_kt_over_c():
    r = emsim.run("kT/C\nv1 a 0 0\nr1 a b 10k\nc1 b 0 1n\n.noise v(b) v1 dec 200 1 1g\n.end\n")
    total = r.table("integrated noise").column("onoise_total")[0]
    assert total == pytest.approx(math.sqrt(K * T / 1e-9), rel=1e-3)  # what lies beyond 1 GHz
    f = r.table("noise").column("frequency")
    density = 4 * K * T * 10e3 / (1 + (2 * np.pi * f * 1e-5) ** 2)
    np.testing.assert_allclose(r.table("noise").column("onoise_spectrum"), np.sqrt(density), rtol=1e-12)


def test_the_total_at_the_source_is_the_integral_of_its_spectrum():
    r = emsim.run("x\nv1 a 0 0\nr1 a b 1k\nc1 b 0 1u\n.noise v(b) v1 dec 5 1 10k\n.end\n")
    total = r.table("integrated noise")["inoise_total"][0]
    assert total == pytest.approx(math.sqrt(4 * K * T * 1e3 * (10e3 - 1)), rel=1e-12)


def test_two_diodes_are_one_of_twice_the_area():
    """(ngspice 39 counts area and m of rs twice.)"""
    deck = "x\ni1 0 a dc 1m ac 1\n{}\n.model dm d is=1e-13 rs=10 kf=1e-14 af=1.5\n.noise v(a) i1 lin 1 1k 1k 1\n.end\n"
    two = emsim.run(deck.format("d1 a 0 dm\nd2 a 0 dm")).table("noise")["onoise_spectrum"]
    one = emsim.run(deck.format("d1 a 0 dm m=2")).table("noise")["onoise_spectrum"]
    assert one == pytest.approx(two, rel=1e-9)


def test_a_capacitor_divider_hands_noise_on():
    """The rows of its middle node are summed with others: what goes into it goes into the sum."""
    deck = "floating\nv1 a 0 0\nr1 a b 1k\nc1 b c 1n\nc2 c 0 1n\nc3 c d 2n\nc4 d 0 2n\nr2 c d 1meg\n"
    r = emsim.run(deck + ".noise v(d) v1 lin 1 1meg 1meg 1\n.end\n")
    w, g = 2 * np.pi * 1e6, 1e-6
    y = np.array(
        [[1e-3 + 1j * w * 1e-9, -1j * w * 1e-9, 0],
         [-1j * w * 1e-9, 1j * w * 4e-9 + g, -1j * w * 2e-9 - g],
         [0, -1j * w * 2e-9 - g, 1j * w * 4e-9 + g]]
    )  # fmt: skip
    z = np.linalg.inv(y)
    table = r.table("noise")
    first = abs(z[2, 0]) * math.sqrt(4 * K * T * 1e-3)
    second = abs(z[2, 1] - z[2, 2]) * math.sqrt(4 * K * T * g)
    assert table["onoise_r1"][0] == pytest.approx(first, rel=1e-6)
    assert table["onoise_r2"][0] == pytest.approx(second, rel=1e-6)


OSCILLATOR = """a mass on a spring in its own heat bath
BODY b m=1m
JOINT j 0 b slide axis=(1,0)
SPRING s j k=10
DAMPER d j c=0.02 {noisy}
v1 a 0 0
r1 a 0 1
FORCE f b.p dir=(1,0) {{v(a)}}
POINT b.p 0 0
.noise pos(j) v1 dec 2000 0.001 100k 1
.end
"""


def test_equipartition_of_a_damped_mass():
    """k <x^2> = k_B T, whatever the damping."""
    r = emsim.run(OSCILLATOR.format(noisy="noisy=yes"))
    total = r.table("integrated noise").column("onoise_total_d")[0]
    assert 10 * total**2 == pytest.approx(K * T, rel=1e-4)
    assert r.table("noise").unit("onoise_d") == "m/sqrt(Hz)"


def test_a_damper_makes_no_noise_where_it_is_not_asked_for():
    r = emsim.run(OSCILLATOR.format(noisy=""))
    assert "onoise_d" not in r.table("noise")


def test_the_winding_of_a_motor_and_a_pot():
    """Behind its resistance a motor is a mass: at a frequency the shaft's speed by the winding's noise in closed form."""
    r = emsim.run(
        "motor\nv1 a 0 0\nMOTOR m a 0 j kt=0.1 r=2 l=1m\nBODY rotor m=1 j=1m\nJOINT j 0 rotor pin\n"
        ".noise omega(j) v1 lin 1 3 3 1\n.end\n"
    )
    s = 2j * np.pi * 3
    gain = 0.1 / ((2 + s * 1e-3) * s * 1e-3 + 0.01)
    assert r.table("noise")["onoise_m"][0] == pytest.approx(abs(gain) * math.sqrt(4 * K * T * 2), rel=1e-9)


@pytest.mark.parametrize(
    "card",
    [
        ".noise v(b) v1",
        ".noise v(b) dec 10 1 1k",
        ".noise v(b) v1 dec 10 0 1k",
        ".noise v(b) v1 lin 10 0 1k",
        ".noise v(b) v1 log 10 1 1k",
        ".noise v(b) v1 dec 10 1 1k 1 2",
    ],
)
def test_what_is_no_card_of_noise(card):
    with pytest.raises(emsim.DeckError, match="E305"):
        emsim.run(f"x\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1n\n{card}\n.end\n")


def test_an_unknown_source_is_named():
    with pytest.raises(emsim.DeckError, match="E309"):
        emsim.run("x\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1n\n.noise v(b) v2 dec 10 1 1k\n.end\n")


def test_print_of_its_own_columns():
    deck = (
        "x\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1n\n.noise v(b) v1 dec 1 1 1k 1\n"
        ".print noise onoise_spectrum onoise_total nothing\n.end\n"
    )
    r = emsim.run(deck)
    text = "\n".join(lines(r))
    assert "onoise_spectrum" in text and "onoise_total = " in text and "nothing" not in text
    assert [d.code for d in r.diagnostics] == ["W287"]
