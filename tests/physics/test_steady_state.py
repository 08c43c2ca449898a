"""`.ss` against closed forms and long transients of filters, rectifiers, converters, machines; and what it refuses."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

import emsim

TIGHT = {"reltol": 1e-10, "vntol": 1e-12, "abstol": 1e-14}


def steady(deck: str, **options):
    result = emsim.run(f"{deck}\n.end\n", options=options)
    assert not [d for d in result.diagnostics if d.severity != "note"]
    return result.table("ss")


def settled(deck: str, card: str, **options):
    return emsim.run(f"{deck}\n{card}\n.end\n", options=options).tran


RECTIFIER = """rectifier
V1 a 0 SIN(0 10 50)
D1 a b D
R1 b 0 1k
C1 b 0 220u
Rs b c 10k
C2 c 0 100u
.model D D(IS=1e-12 RS=1)"""


def test_a_low_pass_is_its_transfer_function():
    table = steady("rc\nV1 a 0 SIN(0.5 1 1k 0.37m)\nR1 a b 1k\nC1 b 0 1u\n.ss 1u 1m", **TIGHT)
    gain = 1 / (1 + 2j * math.pi * 1e3 * 1e-3)
    t = table["time"]
    expected = 0.5 + (gain * np.exp(2j * math.pi * 1e3 * (t - 0.37e-3))).imag
    np.testing.assert_allclose(table["v(b)"], expected, atol=1e-8)
    assert t[0] == 0.0 and t[-1] == pytest.approx(1e-3, rel=1e-12)


def test_a_square_wave_into_rc_has_its_closed_form():
    table = steady("rc\nV1 a 0 PULSE(0 1 0.2m 1p 1p 0.5m 1m)\nR1 a b 10k\nC1 b 0 1u\n.ss 10u 1m", **TIGHT)
    low = (math.exp(-0.05) - math.exp(-0.1)) / (1 - math.exp(-0.1))
    assert np.interp(0.2e-3, table["time"], table["v(b)"]) == pytest.approx(low, rel=1e-7)
    # 0.1 of a time constant a period: a state that forgets itself slowly
    assert table.stats["multiplier"] == pytest.approx(math.exp(-0.1), rel=1e-3)


def test_a_rectifier_is_as_after_a_long_transient_in_a_hundredth_of_its_time():
    begun = time.process_time()
    result = emsim.run(
        f"{RECTIFIER}\n.ss 50u 20m\n.meas ss top max v(b)\n.meas ss mean avg v(c)\n.end\n", options=TIGHT
    )
    took = time.process_time() - begun
    found = result.table("ss")
    begun = time.process_time()
    long = emsim.run(
        f"{RECTIFIER}\n.tran 50u 40 39.98\n.meas tran top max v(b)\n.meas tran mean avg v(c)\n.end\n",
        options=TIGHT,
    )
    longer = time.process_time() - begun
    for ours, other in zip(result.measures.values(), long.measures.values(), strict=True):
        assert float(ours) == pytest.approx(float(other), rel=1e-8)
    for name in ("v(b)", "v(c)"):
        assert found[name][0] == pytest.approx(long.tran[name][0], rel=1e-8)
    assert found.stats["periods"] < 2000 / 20
    assert took < longer / 4  # in periods it is a hundredth; the rest is starting up


def test_a_driven_pendulum_is_as_after_a_long_transient():
    deck = """pendulum
.gravity 9.81
BODY bob m=1 com=(0.25,0) j=0
JOINT hinge 0 bob pin zero=-90deg damp=0.02
TORQUE t hinge tau=SIN(0 0.8 0.7)"""
    found = steady(f"{deck}\n.ss 5m {{1/0.7}}", **TIGHT)
    long = settled(deck, ".tran 5m {200/0.7} {199/0.7}", **TIGHT)
    for name in ("angle(hinge)", "omega(hinge)"):
        assert found[name][0] == pytest.approx(long[name][0], abs=1e-8)
    # what is lost in a period: exp(-c T/2J)
    assert found.stats["multiplier"] == pytest.approx(math.exp(-0.02 / 0.7 / (2 * 0.0625)), rel=2e-2)


def test_a_buck_converter_with_a_delayed_gate():
    deck = """buck
V1 in 0 12
Vg g 0 PULSE(0 5 3u 10n 10n 4u 10u)
S1 in x g 0 SW
D1 0 x D
L1 x out 100u
C1 out 0 100u
R1 out 0 5
.model SW SW(VT=2.5 VH=0.5 RON=50m ROFF=1meg)
.model D D(IS=1e-9 N=1 RS=20m)"""
    found = steady(f"{deck}\n.ss 0.05u 10u", **TIGHT)
    long = settled(deck, ".tran 0.1u 40m 39.99m", **TIGHT)
    assert found["v(out)"][0] == pytest.approx(long["v(out)"][0], rel=1e-9)
    assert found["i(l1)"][0] == pytest.approx(long["i(l1)"][0], rel=1e-7)


MOTOR = """motor
Vb vb 0 24
Vg g 0 PULSE(0 5 0 10n 10n {0.75/20k} 50u)
S1 vb a g 0 high
S4 b 0 g 0 high
S2 a 0 0 g low
S3 vb b 0 g low
.model high SW(vt=2.5 ron=20m roff=1g)
.model low SW(vt=-2.5 ron=20m roff=1g)
BODY rotor m=1 j=1e-4
JOINT shaft 0 rotor pin damp=1e-5
MOTOR m1 a b shaft kt=0.05 r=1 l=1m
TORQUE load shaft tau=-0.05"""


def test_a_motor_turns_on_and_is_periodic_all_the_same():
    found = steady(f"{MOTOR}\n.ss 0.5u 50u", **TIGHT)
    speed = found["omega(shaft)"]
    assert speed[-1] == pytest.approx(speed[0], rel=1e-10)
    turned = found["angle(shaft)"][-1] - found["angle(shaft)"][0]
    assert turned == pytest.approx(speed.mean() * 50e-6, rel=1e-4)
    # the place counts for nothing: what dies out is the speed, by J (r + 2 ron)/k^2
    assert found.stats["multiplier"] == pytest.approx(math.exp(-50e-6 / 0.0415), rel=1e-4)


def test_friction_that_sticks():
    deck = """stick and slip
BODY b m=1
JOINT g 0 b slide
FRICTION f g fc=2
SPRING k g k=100
FORCE d b dir=(1,0) SIN(0 5 1)"""
    found = steady(f"{deck}\n.ss 5m 1", **TIGHT)
    long = settled(deck, ".tran 5m 20 19", **TIGHT)
    assert found["pos(g)"][0] == pytest.approx(long["pos(g)"][0], rel=1e-8)


def test_a_closed_loop():
    deck = """slider crank
.gravity 9.81
BODY crank shape=rod(30m) m=20m
BODY conrod shape=rod(100m) m=30m
BODY piston shape=box(30m,20m) m=0.2
JOINT shaft 0 crank pin ic=20deg
JOINT big crank(30m,0) conrod pin
JOINT small conrod(100m,0) piston pin
JOINT bore 0 piston slide axis=(1,0) damp=2
SPRING k shaft k=0.5
DAMPER d shaft c=0.002
TORQUE t shaft tau=SIN(0 0.1 5)"""
    found = steady(f"{deck}\n.ss 1m 0.2", **TIGHT)
    long = settled(deck, ".tran 1m 30 29.8", **TIGHT)
    assert found["angle(shaft)"][0] == pytest.approx(long["angle(shaft)"][0], abs=1e-7)


def test_a_state_that_is_there_only_by_chance_is_told():
    deck = """upright
.gravity 9.81
BODY bob m=1 com=(0.25,0) j=0
JOINT hinge 0 bob pin zero=90deg damp=0.02
TORQUE t hinge tau=SIN(0 0.001 10)
.ss 0.5m 0.1
.end
"""
    result = emsim.run(deck)
    assert [d.code for d in result.diagnostics] == ["W440"]
    rate = (-0.02 + math.sqrt(0.02**2 + 4 * 0.0625 * 9.81 * 0.25)) / (2 * 0.0625)
    assert result.table("ss").stats["multiplier"] == pytest.approx(math.exp(0.1 * rate), rel=1e-3)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("V1 a 0 SIN(0 1 1.5k)", "its frequency is 1500 Hz"),
        ("V1 a 0 SIN(0 1 1k 0 10)", "dies out"),
        ("V1 a 0 EXP(0 1 1u 1u)", "does not repeat at all"),
        ("V1 a 0 PULSE(0 1 0 1n 1n 1u 0.3m)", "its period is 0.0003 s"),
        ("V1 a 0 PULSE(0 1 0 1n 1n 1u 0.5m 3)", "ends after 3 pulses"),
        ("V1 a 0 PWL(0 0 0.5m 1 1m 0)", "r=0"),
        ("V1 a 0 AM(1 0 1.3k 10k 0)", "1300 Hz"),
        ("B1 a 0 V=sin(2*pi*1.3k*time)", "is another one a period of 0.001 s later"),
        ("V1 a 0 SIN(0 1 1k)\nT1 a 0 b 0 z0=50 td=1u\nR2 b 0 50", "state of lines"),
    ],
)
def test_what_does_not_repeat_is_refused(lines, said):
    with pytest.raises((emsim.DeckError, emsim.ConvergenceError), match="E440") as told:
        emsim.run(f"x\n{lines}\nR1 a 0 1k\n.ss 1u 1m\n.end\n")
    assert any(said in d.message for d in told.value.diagnostics)


def test_waveforms_that_repeat_begin_in_the_middle():
    deck = """phases
V1 a 0 PWL(0 0 0.2m 1 0.5m -1 1m 0) r=0 td=0.3m
V2 b 0 PULSE(0 1 2.7m 0.1m 0.1m 0.2m 0.5m)
V3 c 0 AM(1 0 1k 5k 1.3m)
R1 a 0 1
R2 b 0 1
R3 c 0 1"""
    found = steady(f"{deck}\n.ss 1u 1m")
    long = settled(deck, ".tran 1u 6m 5m")
    at = np.linspace(0.013e-3, 0.987e-3, 79)
    for name in ("v(a)", "v(b)", "v(c)"):
        ours = np.interp(at, found["time"], found[name])
        np.testing.assert_allclose(ours, np.interp(at + 5e-3, long["time"], long[name]), atol=2e-3)


def test_harmonics_and_control():
    result = emsim.run(f"{RECTIFIER}\n.ss 50u 20m\n.four 50 v(b)\n.end\n")
    (spectrum,) = result.spectra
    assert spectrum.signal == "v(b)" and spectrum.harmonics[0].magnitude == pytest.approx(8.96, abs=0.01)
    told = emsim.run(f"{RECTIFIER}\n.control\nss 50u 20m\nmeas ss top max v(b)\nprint top\n.endc\n.end\n")
    assert "top = 9.332" in told.output
