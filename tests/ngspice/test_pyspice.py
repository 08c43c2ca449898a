"""A PySpice Circuit through emsim.run, beside the same circuit through PySpice's own shared ngspice."""

from __future__ import annotations

import numpy as np
import pytest
from support import needs_ngspice

import emsim

PySpice = pytest.importorskip("PySpice")

pytestmark = [needs_ngspice, pytest.mark.ngspice]


def low_pass():
    from PySpice.Spice.Netlist import Circuit
    from PySpice.Unit import u_kOhm, u_ms, u_ns, u_s, u_uF, u_V

    circuit = Circuit("RC low-pass")
    circuit.PulseVoltageSource(
        "in", "in", circuit.gnd, initial_value=u_V(0), pulsed_value=u_V(1), pulse_width=u_s(1), period=u_s(2),
        delay_time=u_ms(0), rise_time=u_ns(100), fall_time=u_ns(100),
    )  # fmt: skip
    circuit.R("1", "in", "out", u_kOhm(1))
    circuit.C("1", "out", circuit.gnd, u_uF(1))
    return circuit


def test_circuit_object_runs():
    """The Circuit itself carries no analysis: .tran is added as raw SPICE."""
    circuit = low_pass()
    circuit.raw_spice += ".tran 50u 5m\n"
    result = emsim.run(circuit)
    t = np.asarray(result.time)
    assert np.abs(np.asarray(result["v(out)"]) - (1 - np.exp(-t / 1e-3))).max() < 2e-3


def test_agrees_with_the_shared_library():
    circuit = low_pass()
    circuit.raw_spice += ".tran 50u 5m\n"
    result = emsim.run(circuit)
    try:
        simulator = low_pass().simulator(temperature=27, nominal_temperature=27, simulator="ngspice-shared")
        analysis = simulator.transient(step_time=50e-6, end_time=5e-3)
    except OSError as error:  # the library of this machine cannot be loaded
        pytest.skip(f"no shared ngspice: {error}")
    t, v = np.array(analysis.time, dtype=float), np.array(analysis["out"], dtype=float)
    mine = np.interp(t, np.asarray(result.time), np.asarray(result["v(out)"]))
    assert len(t) > 50 and np.abs(mine - v).max() < 5e-3
