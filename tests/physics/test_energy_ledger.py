"""The ledger's residual is the error of the solution: it falls with the tolerance, and it sees what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

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


def test_what_has_no_account_is_named() -> None:
    ledger = pipeline.run(
        "q\nV1 a 0 SIN(0 1 1k)\nC1 a 0 Q={1u*v(a)**3}\nR1 a 0 1k\n.tran 10u 1m\n.end\n", energy=True
    ).energy
    assert ledger.open == ["c1"]
    assert "not accounted for: c1" in ledger.summary()
    assert ledger.to_dict()["residual"] is None
