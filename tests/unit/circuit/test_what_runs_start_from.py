"""Whatever a run starts from obeys the deck's limits and says what it is: W418, off, N403, uic (W291)."""

from __future__ import annotations

import numpy as np
import pytest
from circuit_decks import deck, remarks

import emsim

# a regulator with a limited error amplifier: its comparator has no operating point. 5.20 V over 4 to 6 ms by UIC with
# radau at reltol 1e-6, and by ngspice 39
BUCK = (
    "Vin in 0 15",
    "Vr rp 0 PULSE(0 1 0 19.8u 100n 100n 20u)",
    "Vref ref 0 2",
    "S1 in sw g 0 swm",
    "D1 0 sw dd",
    "L1 sw out 100u",
    "C1 out 0 47u",
    "R1 out 0 4",
    "Rf1 out fb 30k",
    "Rf2 fb 0 20k",
    "Eea e 0 VALUE={min(max(500*(v(ref)-v(fb)),0),0.9)}",
    "Re e c 10k",
    "Ce c 0 220n",
    "Bg g 0 V={v(c)>v(rp) ? 5 : 0}",
    ".model swm SW(vt=2.5 vh=.5 ron=50m roff=1meg)",
    ".model dd D(is=1e-9 rs=20m)",
    ".meas tran early avg v(out) from=4m to=6m",
)


@pytest.mark.parametrize("method", ["auto", "trap", "radau"])
def test_a_regulator_without_an_operating_point_starts_within_its_limits_and_says_so(method: str) -> None:
    r = emsim.run(deck(*BUCK, ".tran 2u 6m"), method=method)
    c = np.asarray(r["v(c)"])
    assert c.min() > -1e-3 and c.max() < 0.901
    assert r.measures["early"] == pytest.approx(5.20, abs=0.1)
    codes = [d.code for d in r.diagnostics]
    # (trap may find its comparator at the threshold for a while)
    assert codes == ["W418"] or (method == "trap" and codes == ["W418", "W405"])


def test_a_start_by_uic_needs_no_substitute() -> None:
    r = emsim.run(deck(*BUCK, ".tran 2u 6m uic"))
    assert r.measures["early"] == pytest.approx(5.20, abs=0.1)
    assert not r.diagnostics


LATCH = (
    "Vdd d 0 5",
    "R1 d a 10k",
    "R2 d b 10k",
    ".model nm nmos vto=1 kp=100u",
    ".model qn npn is=1e-16 bf=100",
    ".model jn njf vto=-1 beta=1m",
    ".op",
)


@pytest.mark.parametrize(("on", "off"), [("a", "b"), ("b", "a")])
def test_off_says_which_mosfet_of_a_latch_conducts(on: str, off: str) -> None:
    # v(on) from 10k to 5 V against 1 mA/V^2 ((5 - 1) v - v^2/2): 0.12382 V (ngspice 39: 0.1238)
    r = emsim.run(
        deck(
            *LATCH,
            f"M1 {on} {off} 0 0 nm w=10u l=1u",
            f"M2 {off} {on} 0 0 nm w=10u l=1u off",
        )
    )
    v = float(r[f"v({on})"][0])
    assert (5.0 - v) / 10e3 == pytest.approx(1e-3 * (4.0 * v - 0.5 * v * v), rel=1e-4)
    assert float(r[f"v({off})"][0]) == pytest.approx(5.0, abs=1e-6)
    assert not r.diagnostics


@pytest.mark.parametrize(("on", "off"), [("a", "b"), ("b", "a")])
def test_off_says_which_transistor_of_a_latch_conducts(on: str, off: str) -> None:
    bases = (f"Rb1 {off} x 47k", f"Rb2 {on} y 47k", f"Q1 {on} x 0 qn", f"Q2 {off} y 0 qn off")
    r = emsim.run(deck(*LATCH, *bases))
    assert float(r[f"v({on})"][0]) < 0.2
    assert float(r[f"v({off})"][0]) > 4.0


def test_a_latch_in_the_middle_is_told_to_be_unstable() -> None:
    r = emsim.run(deck(*LATCH, "M1 a b 0 0 nm w=10u l=1u", "M2 b a 0 0 nm w=10u l=1u"))
    assert [d.code for d in r.diagnostics] == ["N403"]
    # with 1 pF at both nodes the difference of the two grows with s = (gm - gds - 1/R)/C
    r = emsim.run(
        deck(*LATCH, "M1 a b 0 0 nm w=10u l=1u", "M2 b a 0 0 nm w=10u l=1u", "C1 a 0 1p", "C2 b 0 1p")
    )
    v = float(r["v(a)"][0])
    grows = (1e-3 * (v - 1.0) - 1e-4) / 1e-12
    (note,) = r.diagnostics
    assert f"grows e-fold in {1.0 / grows:.3g} s" in note.message


@pytest.mark.parametrize("analysis", [".ac dec 1 1k 1meg", ".noise v(a) Vdd dec 1 1k 1meg", ".tf v(a) Vdd"])
def test_small_signals_about_a_rest_that_does_not_stay_are_told(analysis: str) -> None:
    cards = (
        *LATCH[:-1],
        "M1 a b 0 0 nm w=10u l=1u",
        "M2 b a 0 0 nm w=10u l=1u",
        "C1 a 0 1p",
        "C2 b 0 1p",
        "I1 0 a ac 1",
    )
    assert [d.code for d in emsim.run(deck(*cards, analysis)).diagnostics] == ["N403"]


def test_stable_circuits_with_gain_are_not_told() -> None:
    amplifier = ("E1 o 0 in x 1e5", "R1 o x 10k", "R2 x 0 1k", "C1 x 0 10p", "V1 in 0 1", "R3 o 0 1k")
    follower = ("Vc c 0 10", "Vb b 0 5", "Q1 c b e qn", "Re e 0 1k", "Ce e 0 1n")
    tank = ("L1 a 0 1m", "C9 a 0 1n", "G1 a 0 a 0 1u")
    model = ".model qn npn is=1e-16 bf=100 cje=1p cjc=1p tf=1n"
    for lines in (amplifier, (*follower, model), tank):
        for card in (".op", ".tran 1u 1m"):
            assert remarks(*lines, card) == []


RING = """ring of three inverters that starts with its supply, all alike
Vdd vdd 0 PULSE(0 5 1n 1n 1n 1 2)
.subckt inv a y v
MP y a v v pm w=8u l=1u ad=8p as=8p
MN y a 0 0 nm w=4u l=1u ad=4p as=4p
CL y 0 50f
.ends
X1 1 2 vdd inv
X2 2 3 vdd inv
X3 3 1 vdd inv
.model nm NMOS(vto=.8 kp=100u lambda=.04 tox=15n cgso=.3n cgdo=.3n)
.model pm PMOS(vto=-.8 kp=35u lambda=.05 tox=15n cgso=.3n cgdo=.3n)
{kick}
.tran 50p 60n
.meas tran swing pp v(1) from=30n to=60n
.end
"""


def test_a_ring_that_rests_at_half_its_supply_is_told_and_swings_when_it_is_kicked() -> None:
    at_rest = emsim.run(RING.format(kick=""))
    assert at_rest.measures["swing"] > 1.0 or "N403" in [d.code for d in at_rest.diagnostics]
    kicked = emsim.run(RING.format(kick="Ik 0 1 PULSE(0 10u 3n 1n 1n 1n 1)"))
    assert kicked.measures["swing"] == pytest.approx(4.66, abs=0.1)  # ngspice 39: 4.66
    assert not kicked.diagnostics


SETTLED = """an amplifier holds its output; all poles are damped, the fastest 1e7 times as fast as the slowest
Vin in 0 20
Q1 in b out tip31
R1 in b 2.2k
Q2 b f z small
D1 0 z zener
R2 out z 1.5k
R3 out f 4.7k
R4 f 0 6.2k
C1 out 0 10u
RL out 0 200
.model tip31 NPN(is=1p bf=100 vaf=100 ikf=2 rb=3 rc=0.1 cje=150p cjc=80p tf=20n tr=200n)
.model small NPN(is=10f bf=200 vaf=80 rb=20 cje=8p cjc=5p tf=0.5n tr=50n)
.model zener D(is=1f n=1 rs=5 bv=5.6 ibv=1m cjo=50p)
I9 0 b AC 1
.op
.pz b 0 b 0 vol pol
.end
"""


def test_a_rest_of_damped_modes_is_not_told_to_be_unstable() -> None:
    r = emsim.run(SETTLED)
    poles = [complex(r.plots[1][name][0]) for name in r.plots[1].names]
    assert len(poles) > 4 and all(pole.real < 0 for pole in poles)
    assert not r.diagnostics


def test_a_run_that_starts_between_the_states_of_a_latch_is_told() -> None:
    cards = (*LATCH[:-1], "M1 a b 0 0 nm w=10u l=1u", "M2 b a 0 0 nm w=10u l=1u", "C1 a 0 1p", "C2 b 0 1p")
    kick = "I1 0 a PULSE(0 1u 1n 1n 1n 5n 1)"
    r = emsim.run(deck(*cards, kick, ".tran 0.1n 100n"))
    assert [d.code for d in r.diagnostics] == ["N403"] and "roundings decide" in r.diagnostics[0].message
    assert float(r["v(a)"][-1]) > 4.0 and float(r["v(b)"][-1]) < 0.3
    # beside a circuit of another pace, which has steps of its own, too
    other = ("V9 p 0 SIN(0 1 50k)", "R9 p q 1k", "D9 q r dd", "C9 r 0 1u", "R8 r 0 1k", ".model dd d is=1n")
    r = emsim.run(deck(*cards, kick.replace("5n 1)", "5n 20n)"), *other, ".tran 0.1n 20u"))
    assert [d.code for d in r.diagnostics] == ["N403"]
    assert "node `a`" in r.diagnostics[0].message or "node `b`" in r.diagnostics[0].message
    # one that starts in a state is not
    assert not emsim.run(deck(*cards, kick, ".nodeset v(a)=5 v(b)=0", ".tran 0.1n 100n")).diagnostics


CHARGED = (
    "V1 in 0 SIN(1 2 1k 0 0 30)",
    "R1 in a 1k",
    "C1 a 0 100n ic=-1",
    "D1 a g dd",
    "R4 g 0 1k",
    "C4 g 0 100n",
    ".ic v(g)=0.5",
    ".tran 1u 3m uic",
)


@pytest.mark.parametrize("model", ["is=1e-12", "is=1e-12 cjo=1p", "is=1e-12 tt=1n", "is=1e-12 rs=1"])
def test_capacitors_and_nodes_each_have_their_own_initial_value(model: str) -> None:
    # 0.26144 V at 76.51 us, 0.92728 V at 200 us: scipy's Radau at 1e-9, ngspice 39
    r = emsim.run(deck(*CHARGED, f".model dd D({model})"), reltol=1e-6)
    assert float(r["v(a)"][0]) == pytest.approx(-1.0, abs=1e-6)
    assert float(r["v(g)"][0]) == pytest.approx(0.5, abs=1e-6)
    if "rs" not in model:
        assert r.at("v(g)", 76.51e-6) == pytest.approx(0.26144, abs=2e-4)
        assert r.at("v(g)", 200e-6) == pytest.approx(0.92728, abs=2e-3)


def test_initial_values_that_contradict_each_other_are_told() -> None:
    def said(*lines: str) -> list[str]:
        return [d.code for d in emsim.run(deck(*lines, "R1 a 0 1k", ".tran 1u 10u uic")).diagnostics]

    assert said("C1 a 0 1u ic=1", "C2 a 0 1u ic=2") == ["W291"]
    assert said("C1 a 0 1u ic=1", ".ic v(a)=2") == ["W291"]
    assert said("C1 a b 1u ic=1", "C2 b 0 1u ic=2", "C3 a 0 1u ic=3") == []
    assert said("C1 a 0 1u ic=1", ".ic v(a)=1") == []
