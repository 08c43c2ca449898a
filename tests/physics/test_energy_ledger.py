"""The ledger's residual is the error of the solution: it falls with the tolerance, and it sees what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

import emsim
from emsim import pipeline

ROOT = Path(__file__).resolve().parents[2]
MACHINES = [
    "coupled/cart_pole", "coupled/pendulum_servo", "coupled/ref_slider_crank", "coupled/ref_linear_pot",
    "coupled/comb_drive", "coupled/voice_coil", "mechanical/ref_four_bar", "mechanical/ref_double_pendulum",
    "mechanical/ref_msl_planar_fourbar", "mechanical/bricard", "mechanical/driven_slider_crank",
    "mechanical/lead_screw", "paper/motor_pendulum_kp30",
]  # fmt: skip


@pytest.mark.parametrize("deck", MACHINES)
def test_every_machine_balances(deck: str) -> None:
    path = str(ROOT / f"netlists/{deck}.cir")
    coarse, fine = pipeline.run(path, reltol=1e-3).energy, pipeline.run(path, reltol=1e-6).energy
    assert coarse.balanced
    assert coarse.share < 1e-4
    assert fine.share < 1e-7
    assert sum(x.stored for x in coarse.lines) == pytest.approx(coarse.stored)


@pytest.mark.parametrize(
    "deck", ["buck_converter", "boost_converter", "diode_bridge", "transformer", "lc_uic"]
)
def test_circuits_with_diodes_and_switches_balance(deck: str) -> None:
    ledger = pipeline.run(str(ROOT / f"netlists/electrical/{deck}.cir"), reltol=1e-6, energy=True).energy
    assert ledger.balanced
    assert ledger.share < 1e-4


DIODES = [
    "bench/multiplier4", "electrical/boost_converter", "electrical/buck_converter", "electrical/clipper",
    "electrical/diode_bridge", "electrical/diode_recovery", "electrical/flyback",
    "electrical/halfwave_rectifier", "electrical/multiplier10", "electrical/peak_detector",
    "electrical/snubber", "electrical/voltage_doubler", "electrical/zener_regulator",
]  # fmt: skip


@pytest.mark.parametrize("method", ["auto", "radau", "esdirk", "trbdf2", "trap", "gear"])
@pytest.mark.parametrize("deck", DIODES)
def test_diodes_balance_at_loose_tolerances_under_every_method(deck: str, method: str) -> None:
    """Between the stages of a step a polynomial overshoots into the exponential, and within a tolerance of 300 V a diode's
    current is anything: the account goes by the stages, and these are solved until the currents fit. (Dissipation was
    up to a million times what it is.)"""
    found = pipeline.run(str(ROOT / f"netlists/{deck}.cir"), reltol=1e-3, method=method, energy=True)
    assert found.energy.balanced
    assert found.energy.share < 3e-3
    assert not [d for d in found.diagnostics if d.code == "W415"]


def test_diodes_of_an_h_bridge_balance_under_gear() -> None:
    path = str(ROOT / "netlists/coupled/slider_crank_hbridge.cir")
    flat = pipeline.read(path)
    assembly, planned = pipeline.prepare(flat, {"method": "gear", "reltol": 1e-3}, True)
    planned[-1].tstop = 0.05
    assert pipeline.deliver(assembly, pipeline.solve(assembly, planned)).energy.share < 1e-3


@pytest.mark.parametrize(("method", "share"), [("radau", 1e-7), ("esdirk", 1e-6), ("gear", 1e-6)])
def test_the_residual_of_a_rectifier_falls_with_the_tolerance(method: str, share: float) -> None:
    path = str(ROOT / "netlists/electrical/peak_detector.cir")
    tight = pipeline.run(path, reltol=1e-6, method=method, energy=True).energy
    loose = pipeline.run(path, reltol=1e-3, method=method, energy=True).energy
    assert tight.share < share
    assert tight.share < 0.1 * loose.share


def test_energy_of_a_junction_is_a_function_of_its_voltage() -> None:
    """A current draws charge out of a junction; what it then holds is the integral of v dq, in closed form with
    q = 2 cjo vj (1 - sqrt(1 - v/vj))."""
    text = "j\nI1 0 a PWL(0 0 1n 0 1u -2u)\nD1 a 0 d\n.model d D(is=1e-18 cjo=1p vj=0.8 m=0.5)\n.tran 10n 1u\n.end\n"
    found = pipeline.run(text, reltol=1e-7, method="radau", energy=True)
    v = float(found["v(a)"][-1])
    assert v < -0.3
    a = 1 - v / 0.8
    held = 1e-12 * 0.8**2 * ((1 - a**0.5) / 0.5 - (1 - a**1.5) / 1.5)
    diode = next(x for x in found.energy.lines if x.name == "d1")
    assert diode.stored == pytest.approx(held, rel=1e-6)
    assert found.energy.share < 1e-5


def test_what_goes_back_and_forth_is_turned_over() -> None:
    """After whole periods a capacitor holds what it held: the residual is a part of what went through it meanwhile."""
    found = pipeline.run(str(ROOT / "netlists/hard/capacitor_loop.cir"), energy=True)
    # C = 2u + 0.75u at 1 V, four times up or down a period, three periods
    assert found.energy.turnover == pytest.approx(12 * 0.5 * 2.75e-6, rel=0.05)
    assert found.energy.share < 1e-4


def test_closed_forms_of_a_resistor_capacitor_and_source() -> None:
    """Charging C through R from V: the source gives C V^2, half is heat, half is stored, whatever R is."""
    deck = "rc\nV1 in 0 10\nR1 in a 1k\nC1 a 0 1u ic=0\n.tran 10u 30m uic\n.end\n"
    ledger = pipeline.run(deck, reltol=1e-8, energy=True, options={"method": "radau"}).energy
    found = {x.name: x for x in ledger.lines}
    assert found["v1"].supplied == pytest.approx(1e-4, rel=1e-7)
    assert found["r1"].dissipated == pytest.approx(5e-5, rel=1e-7)
    assert found["c1"].stored == pytest.approx(5e-5, rel=1e-9)


def test_falling_mass_and_spring() -> None:
    """A mass dropped on a spring without damping: at any time m g h has become m v^2/2 + k x^2/2."""
    deck = """drop
.gravity 9.81
BODY m m=2
JOINT s 0 m slide axis=(0,1) ic=(0,0)
SPRING k s k=50 q0=0
.tran 10m 0.7
.end
"""
    ledger = pipeline.run(deck, reltol=1e-8).energy
    found = {x.name: x for x in ledger.lines}
    x = float(pipeline.run(deck, reltol=1e-8)["pos(s)"][-1])
    assert found["k"].stored == pytest.approx(25 * x * x, rel=1e-6)
    assert found["m"].stored == pytest.approx(-25 * x * x, rel=1e-6)
    assert ledger.supplied == ledger.dissipated == 0.0


def test_unequal_motor_constants_are_seen_as_a_supply() -> None:
    """kt and ke of the paper differ: the machine eats power, and the ledger says where."""
    ledger = pipeline.run(str(ROOT / "netlists/paper/motor_pendulum_kp30.cir"), reltol=1e-6).energy
    motor = next(x for x in ledger.lines if x.name == "m1")
    assert motor.supplied != 0.0
    assert ledger.share < 1e-9


def test_a_damping_method_is_told_by_its_residual() -> None:
    """Backward Euler on a lossless tank takes energy that no element has."""
    deck = "tank\nL1 a 0 1m ic=1\nC1 a 0 1u ic=0\n.tran 1u 1m uic\n.options method=gear maxord=1 fixed_step=2u\n.end\n"
    ledger = pipeline.run(deck, energy=True).energy
    assert ledger.dissipated == 0.0
    assert ledger.residual < -0.5 * 0.5e-3  # more than half of L i^2/2 is gone
    assert "unexplained" in ledger.summary()
    said = [d for d in pipeline.run(deck, energy=True).diagnostics if d.code == "W415"]
    assert len(said) == 1
    assert f"{abs(ledger.residual):.2g} J went without a cause" in said[0].message
    better = pipeline.run(deck.replace("method=gear maxord=1 fixed_step=2u", "method=radau"), energy=True)
    assert "W415" not in {d.code for d in better.diagnostics}


def test_what_has_no_account_is_named() -> None:
    ledger = pipeline.run(
        "q\nV1 a 0 SIN(0 1 1k)\nC1 a 0 Q={1u*v(a)**3}\nR1 a 0 1k\n.tran 10u 1m\n.end\n", energy=True
    ).energy
    assert ledger.open == ["c1"]
    assert "not accounted for: c1" in ledger.summary()
    assert ledger.to_dict()["residual"] is None


@pytest.mark.parametrize("method", ["auto", "radau", "esdirk", "trbdf2", "trap", "gear"])
def test_the_work_of_a_drive_is_no_matter_of_steps(method: str) -> None:
    """The rotor swings to and fro with 62 J, of which the circuit knows nothing: integrated over its steps they left 0.4 J of the
    drive's work without a cause under gear, a sixth of what the generator made into heat."""
    deck = (
        "generator\nBODY w m=1 j=1m\nJOINT h 0 w pin\nDRIVE d h q={2*sin(2*pi*3*time)+0.3*sin(2*pi*17*time)}\n"
        "MOTOR m a 0 h kt=0.1 r=1 b=1u\nRL a 0 4\nBc c 0 V={v(a)>1 ? 5 : 0}\nRc c 0 1k\n.tran 1m 1\n.end\n"
    )
    energy = pipeline.run(deck, method=method).energy
    assert energy.balanced
    assert abs(energy.residual) < 1e-8 * energy.dissipated
    assert energy.stored == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("reltol, share", [(1e-3, 3e-4), (1e-5, 1.5e-4), (1e-6, 1e-4)])
def test_steps_without_an_explicit_stage_are_accounted_by_their_weights(reltol: float, share: float) -> None:
    path = str(ROOT / "netlists/electrical/buck_converter.cir")
    found = pipeline.run(path, reltol=reltol, method="esdirk", energy=True).energy
    assert found.share < share, found.share


@pytest.mark.parametrize("method", ["auto", "radau", "trbdf2", "esdirk"])
def test_what_stands_still_neither_makes_energy_nor_amplifies_errors(method: str) -> None:
    """A body where its spring has no force: rounding, 1e-31 J of it, was energy without a cause (W415, W417)."""
    found = emsim.run(
        "at rest\nBODY a m=1 x=0.3 y=0.4 j=1\nSPRING s 0 a k=1e5 l0=0.5\nDAMPER d 0 a c=3\n"
        f".options gravity=0 method={method}\n.tran 10m 1\n.end\n"
    )
    assert not {d.code for d in found.diagnostics} & {"W415", "W417"}
