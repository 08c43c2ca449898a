"""`.pss`: periods, waveforms, harmonics of oscillators against series, closed forms, long transients; and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

TIGHT = {"reltol": 1e-9, "vntol": 1e-12, "abstol": 1e-15}
VAN_DER_POL = "van der Pol\nC1 x 0 1 ic=0.5\nL1 x 0 1\nB1 x 0 I={mu}*(v(x)*v(x)*v(x)/3-v(x))\n"


def steady(deck: str, **options) -> emsim.Result:
    return emsim.run(f"{deck}\n.end\n", options=options or TIGHT)


def period(deck: str, **options) -> float:
    return float(steady(deck, **options).table("pss").stats["period"])


@pytest.mark.parametrize("mu", [0.02, 0.05, 0.1])
def test_a_weak_oscillator_has_the_period_and_amplitude_of_its_series(mu):
    found = steady(VAN_DER_POL.format(mu=mu) + ".pss 0.16 30 x 512 12 uic")
    # Andersen and Geer, SIAM J. Appl. Math. 42, 1982, 678: frequency and amplitude to the sixth power of mu
    omega = 1 - mu**2 / 16 + 17 * mu**4 / 3072 + 35 * mu**6 / 884736
    assert found.table("pss").stats["frequency"] == pytest.approx(omega / (2 * math.pi), rel=1e-9)
    largest = 2 + mu**2 / 96 - 1033 * mu**4 / 552960
    assert float(np.abs(found.table("pss")["v(x)"]).max()) == pytest.approx(largest, rel=1e-5)


@pytest.mark.parametrize(("mu", "known"), [(1.0, 6.6632868593231301897), (10.0, 19.07836956693939)])
def test_a_strong_oscillator_has_its_known_period(mu, known):
    assert period(VAN_DER_POL.format(mu=mu) + ".pss 0.1 30 x uic") == pytest.approx(known, rel=1e-9)


def test_what_a_period_leaves_of_a_disturbance_is_liouvilles_integral():
    # the divergence of the flow over a period: exp(integral mu (1 - v^2))
    found = steady(VAN_DER_POL.format(mu=0.3) + ".pss 0.16 30 x 2048 10 uic").table("pss")
    t, v = found["time"], found["v(x)"]
    inside = 0.3 * (1 - v**2)
    left = math.exp(float(np.sum(0.5 * (inside[1:] + inside[:-1]) * np.diff(t))))
    assert found.stats["multiplier"] == pytest.approx(left, rel=2e-3)


def test_waveforms_are_one_period_and_harmonics_are_theirs():
    found = steady(VAN_DER_POL.format(mu=1.0) + ".pss 0.15 30 x 64 20 uic")
    orbit, lines = found.table("pss"), found.table("pss harmonics")
    assert orbit["time"][0] == 0.0 and orbit["time"][-1] == pytest.approx(orbit.stats["period"], rel=1e-12)
    assert orbit["v(x)"][-1] == pytest.approx(orbit["v(x)"][0], abs=1e-7)
    assert np.allclose(lines["frequency"], np.arange(21) / orbit.stats["period"], rtol=1e-12)
    t = orbit["time"]
    made = sum(
        (z * np.exp(2j * np.pi * f * t)).real for f, z in zip(lines["frequency"], lines["v(x)"], strict=True)
    )
    assert np.abs(made - orbit["v(x)"]).max() < 2e-4
    assert np.abs(lines["v(x)"][::2]).max() < 1e-8  # an odd law has odd harmonics
    # of the coil: v = L di/dt
    assert np.allclose(lines["v(x)"], 2j * np.pi * lines["frequency"] * lines["i(l1)"], atol=1e-7)


RELAXATION = """a switch with hysteresis on RC
V1 s 0 5
RP s o 1k
R1 o a 10k
C1 a 0 10n
S2 o 0 a 0 sw
.model sw sw(vt=2.5 vh=0.5 ron=1m roff=1e12)
"""


def test_a_relaxation_oscillator_has_its_closed_form():
    low = 5 * 1e-3 / 1e3
    known = 10e-9 * (11e3 * math.log(3 / 2) + (10e3 + 1e-3) * math.log((3 - low) / (2 - low)))
    assert period(RELAXATION + ".pss 10k 1m a") == pytest.approx(known, rel=3e-8)


def test_a_block_on_a_belt_sticks_and_slips_with_its_known_period():
    deck = """A block on a belt
BODY  belt  m=1
BODY  block m=1
JOINT drum  0 belt slide axis=(1,0)
JOINT rail  0 block slide axis=(1,0) ic=(0,0.2)
JOINT touch belt block slide axis=(1,0) cut=yes
DRIVE run   drum q={0.2*time}
SPRING s    rail k=1
FRICTION f  touch fc={1/(1 + 3*abs(vel(rail) - 0.2))}
.pss 0.08 12 pos(rail)"""
    # binary128, as netlists/mechanical/stick_slip_belt.cir has it
    assert period(deck) == pytest.approx(12.00103129483058, rel=1e-8)


MOTOR = """A motor winds a spring, and a brake whose friction falls with speed lets go of it now and then
V1 a 0 0.065
MOTOR m a 0 shaft r=0.02 l=1m kt=0.05
BODY rotor m=0.1 j=1e-4
BODY drum m=0.5 j=2e-3
JOINT shaft 0 rotor pin
JOINT axle 0 drum pin
JOINT twist rotor drum pin cut=yes
SPRING s twist k=0.5
DAMPER d twist c=1e-3
FRICTION f axle fc={0.03 + 0.05/(1 + 5*abs(omega(axle)))}
"""


def test_a_motor_that_sticks_and_slips_is_as_after_a_long_transient():
    found = steady(MOTOR + ".pss 2 5 omega(axle)").table("pss")
    level = 0.5 * float(found["omega(axle)"].max())
    meas = f".meas tran p trig omega(axle) val={level} rise=20 targ omega(axle) val={level} rise=40"
    long = emsim.run(f"{MOTOR}.tran 1m 22\n{meas}\n.end\n", options=TIGHT).measures["p"]
    assert found.stats["period"] == pytest.approx(long / 20, rel=1e-8)


LONG = {
    "ring of inverters": ("""ring
VDD vdd 0 5
.model n nmos(vto=1 kp=100u lambda=0.01)
.model p pmos(vto=-1 kp=50u lambda=0.01)
.subckt inv a y vdd
MN y a 0 0 n w=10u l=1u
MP y a vdd vdd p w=20u l=1u
C y 0 50f
.ends
X1 a b vdd inv
X2 b c vdd inv
X3 c a vdd inv
.ic v(a)=0 v(b)=5 v(c)=0
""", ".pss 5g 2n a uic", ".tran 1p 6n uic", "a", 2.5),
    "Wien bridge": ("""Wien bridge, limited by diodes
R1 o x 10k
C1 x p 10n
R2 p 0 10k
C2 p 0 10n ic=10m
E1 o 0 p n 1e5
R3 n 0 10k
R4 o m 15k
R5 m n 6k
D1 m n d
D2 n m d
.model d d(is=1e-14)
""", ".pss 1.6k 2m o uic", ".tran 1u 40m uic", "o", 0.0),
    "Colpitts": ("""Colpitts, its supply switched on
VCC vcc 0 PULSE(0 12 0 1u)
L1 vcc c 10u
RL vcc c 20k
Q1 c b e qn
C1 c e 1n
C2 e 0 1n
RE e 0 1k
VB b 0 PULSE(0 5 0 1u)
.model qn npn(is=1f bf=100 vaf=80 cje=2p cjc=1p tf=0.2n)
""", ".pss 2meg 20u c", ".tran 1n 40u", "c", 12.0),
}  # fmt: skip


@pytest.mark.parametrize("name", LONG)
def test_an_oscillator_is_as_after_a_long_transient(name):
    deck, card, tran, node, level = LONG[name]
    first, last = (20, 30) if "ring" in name else (50, 60)
    found = period(deck + card)
    meas = f".meas tran p trig v({node}) val={level} rise={first} targ v({node}) val={level} rise={last}"
    long = emsim.run(f"{deck}{tran}\n{meas}\n.end\n", options={**TIGHT, "reltol": 1e-10}).measures["p"]
    assert found == pytest.approx(long / (last - first), rel=1e-8)


def test_a_bias_that_takes_a_thousand_periods_is_found_in_some_dozens():
    deck = LONG["Colpitts"][0].replace("VB b 0 PULSE(0 5 0 1u)", "R1 vcc b 10k\nR2 b 0 10k\nCB b 0 100n")
    found = steady(deck + ".pss 2.2meg 5u c").table("pss")
    assert found.stats["returns"] < 100 and 0.99 < found.stats["multiplier"] < 1.0
    # where it begins it ends: the bias too
    assert abs(found["v(b)"][-1] - found["v(b)"][0]) < 1e-8


def test_several_crossings_a_period_are_one_period():
    # a third harmonic so large that the signal comes up through its mean thrice
    deck = (
        VAN_DER_POL.format(mu=0.5)
        + "C3 y 0 1\nL3 y 0 {1/9.6}\nR3 y 0 4\nB3 0 y I=0.6*v(x)*v(x)*v(x)\nB2 z 0 V=v(x)+3*v(y)\n"
    )
    assert period(deck + ".pss 0.16 60 z uic") == pytest.approx(period(deck + ".pss 0.16 60 x uic"), rel=1e-8)


def told(deck: str) -> str:
    with pytest.raises((emsim.ConvergenceError, emsim.DeckError)) as error:
        steady(deck)
    return error.value.diagnostics[0].code


def test_what_is_driven_is_told_to_take_ss():
    assert told("driven\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.pss 1k 1m b") == "E440"


@pytest.mark.parametrize(
    "deck",
    [
        "at rest\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.pss 1k 1m b",
        "rings down\nC1 x 0 1 ic=1\nL1 x 0 1\nR1 x 0 20\n.pss 0.16 0 x uic",
    ],
)
def test_what_does_not_oscillate_is_told(deck):
    assert told(deck) == "E442"


@pytest.mark.parametrize(
    "card", [".pss", ".pss 1k 1m", ".pss -1 0 x", ".pss 1k 0 x 2", ".pss 1k 0 x 64 0", ".pss 1k -1m x"]
)
def test_a_card_that_makes_no_sense_is_refused(card):
    assert told("x\nC1 x 0 1\nL1 x 0 1\n" + card) == "E305"


def test_commands_have_it():
    deck = VAN_DER_POL.format(mu=1.0)
    found = emsim.run(
        f"{deck}.control\npss 0.15 30 x 64 5 uic\nprint frequency[1]\nsetplot pss1\nmeas pss top max v(x)\n.endc\n.end\n",
        options=TIGHT,
    )
    first, second = found.output.splitlines()[:2]
    assert float(first.rpartition("=")[2]) == pytest.approx(1 / 6.6632868593, rel=1e-5)
    assert float(second.split("=")[1].split()[0]) == pytest.approx(2.00862, rel=1e-4)


BARE = """astable of transistors that store no charge
Vcc vcc 0 9
R1 vcc c1 1k
R2 vcc b2 15.6k
R3 vcc b1 15.6k
R4 vcc c2 1k
C1 c1 b2 10u ic=8
C2 c2 b1 10u ic=-0.5
Q1 c1 b1 0 q
Q2 c2 b2 0 q
.model q NPN(is=10f bf=200)
.tran 1m 0.5 uic
.meas tran first when v(c1)=4.5 cross=1
.meas tran fourth when v(c1)=4.5 cross=4
.end
"""


def test_transistors_that_store_no_charge_have_to_jump_and_a_charge_at_every_node_lets_them() -> None:
    """The message names what mends it; how small the charge is does not matter. ngspice 39: 0.115932 and 0.444403 s."""
    with pytest.raises(emsim.ConvergenceError) as stopped:
        emsim.run(BARE)
    assert ".options cshunt=1f" in stopped.value.diagnostics[0].hint
    times = [emsim.run(BARE.replace(".tran", f".options cshunt={c}\n.tran")).measures for c in ("1f", "1p")]
    assert times[0]["first"] == pytest.approx(times[1]["first"], rel=2e-5)
    assert [times[0]["first"], times[0]["fourth"]] == pytest.approx([0.115932, 0.444403], rel=3e-4)
