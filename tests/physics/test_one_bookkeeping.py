"""energy(), loss() and supplied() are the ledger at an instant: circuit and machine in one book."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

BEHIND_A_DIODE = """motor behind a diode, a resistor and a capacitor beside it
BODY rotor m=1 j=1e-4
JOINT s 0 rotor pin
DAMPER b s c=1e-5
Vs in 0 SIN(0 12 50)
D1 in a dd
R2 a 0 500
C1 a 0 1u
MOTOR m a 0 s kt=0.05 r=1 l=1m j=1e-5 b=2e-5
.model dd D(is=1e-12 rs=0.1)
.options reltol=1e-6
.tran 10u 60m
.save all energy() loss() supplied() power(m)
.end
"""
DRIVEN = """a driven double pendulum with damping
.gravity 9.81
BODY a shape=rod(0.3) m=0.2
BODY b shape=rod(0.2) m=0.3
JOINT h 0 a pin damp=1e-3
JOINT k a(0.3,0) b pin damp=1e-3
DRIVE d h q={sin(3*time)}
.options reltol=1e-7
.tran 2m 2
.save all energy() loss() supplied()
.end
"""
SWITCHED = """a switch and a coil, a capacitor of a voltage and a coil of a current
Vp c 0 PULSE(0 1 1m 1u 1u 2m 5m)
Vs in 0 12
S1 in a c 0 sw
D1 0 a dd
L1 a b 1m
L2 b e L={1m/(1+i(l2)**2)}
C1 e 0 10u
C2 e 0 C={1u*(1+v(e)**2/100)}
R1 e 0 10
.model sw SW(vt=0.5 ron=0.1 roff=1e6)
.model dd D(is=1e-12 rs=0.1)
.options reltol=1e-6
.tran 1u 12m
.print tran energy() loss() supplied() v(e)
.end
"""


def columns(deck: str) -> tuple[emsim.Result, dict[str, np.ndarray]]:
    r = emsim.run(deck)
    return r, {name: np.asarray(r[name]) for name in r.names}


@pytest.mark.parametrize("deck", [BEHIND_A_DIODE, DRIVEN, SWITCHED])
def test_loss_and_energy_leave_out_what_the_circuit_does(deck):
    """At every row: energy() has grown by what was supplied less what was lost."""
    _, c = columns(deck)
    net = c["supplied()"] - c["loss()"]
    flowed = np.concatenate(([0.0], np.cumsum(0.5 * (net[1:] + net[:-1]) * np.diff(c["time"]))))
    turned_over = np.trapezoid(np.abs(c["supplied()"]), c["time"])
    assert c["energy()"] - c["energy()"][0] == pytest.approx(flowed, abs=2e-3 * turned_over)


def test_loss_of_a_motor_behind_a_diode_is_a_third_short_of_the_ledger():
    r, c = columns(BEHIND_A_DIODE)
    assert np.trapezoid(c["loss()"], c["time"]) == pytest.approx(r.energy.dissipated, rel=1e-4)
    assert np.trapezoid(c["supplied()"], c["time"]) == pytest.approx(r.energy.supplied, rel=1e-4)
    assert c["energy()"][-1] - c["energy()"][0] == pytest.approx(r.energy.stored, rel=1e-4)


def test_torque_times_speed_is_not_the_power_of_a_motor_with_friction():
    _, c = columns(BEHIND_A_DIODE)
    assert c["torque(m)"] * c["omega(s)"] == pytest.approx(c["power(m)"], rel=1e-12, abs=1e-15)


def test_a_source_that_reads_loss_heats_a_thermal_node():
    """loss() inside the equations: R = 10 Ohm at 10 V gives 10 W, 1 J/K: 10 K a second."""
    deck = "t\nV1 a 0 10\nR1 a 0 10\nB1 0 th I={loss()}\nCth th 0 1\n.tran 1m 0.1 uic\n.end\n"
    assert float(emsim.run(deck)["v(th)"][-1]) == pytest.approx(1.0, rel=1e-6)


def test_a_resistor_that_reads_its_own_loss_is_a_circle():
    deck = "t\nV1 a 0 10\nR1 a 0 R={10+loss()}\n.tran 1m 0.1\n.end\n"
    with pytest.raises(emsim.DeckError, match="part of what decides it"):
        emsim.run(deck)
