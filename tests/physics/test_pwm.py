"""Edges that are known: switches whose gates are sources turn exactly where the gate meets the threshold.

The motor on a PWM bridge has an exact solution (matrix exponentials from edge to edge): 20 000 periods, a load step.
"""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, reference, run

import emsim
from emsim import pipeline


@pytest.mark.slow
def test_motor_on_a_pwm_bridge():
    """Speed within 1e-6 of its range at the default accuracy, and little more than one step from edge to edge."""
    found = run(deck("coupled/ref_pwm_hbridge_motor"))
    ref = reference("pwm_hbridge_motor")
    for name, column in (("w", "omega(shaft)"), ("i", "i(m1)")):
        mine = np.array([found.at(column, t) for t in ref["time"]])
        assert np.abs(mine - ref[name]).max() <= 1e-6 * np.ptp(ref[name]), name
    assert found.stats["events"] == pytest.approx(40_000, abs=2)
    assert found.stats["steps"] < 60_000


CHOPPER = """chopper
V1 in 0 10
Vg g 0 PULSE(0 5 {delay} {ramp} {ramp} {3u-ramp} 10u)
S1 in out {gate} 0 sw
R1 out 0 1k
L1 out x 1m
R2 x 0 10
.param ramp=0.2u delay={-ramp/2}
.model sw SW(vt=2.5 vh={vh} ron=0.1 roff=10meg)
.tran 1u 100u
.options method=radau
.end
"""


def chopper(gate: str = "g", vh: str = "0", more: str = "") -> str:
    text = CHOPPER.replace("{gate}", gate).replace("{vh}", vh)
    return text.replace(".end", f"{more}\n.end")


def turns(text: str) -> list[tuple[float, bool]]:
    """When the switch turns, and to what."""
    assembly, planned = pipeline.prepare(pipeline.read(text))
    waves = pipeline.solve(assembly, planned)[0].waves
    switch = assembly.system.flag_names.index("s1")
    return [(t, bool(on)) for t, flag, on in waves.events if flag == switch]


@pytest.mark.parametrize("vh", ["0", "1"])
@pytest.mark.parametrize("gate", ["g", "h"])
def test_edges_lie_where_the_ramp_meets_the_threshold(vh: str, gate: str):
    """Directly from the source, and through a B source that passes it on; hysteresis moves up and down apart."""
    text = chopper(gate, vh, "Bh h 0 V={v(g) > -1 ? 2*v(g) - 2.5 : 0}" if gate == "h" else "")
    shift = 0.2e-6 * float(vh) / 5.0 / (2.0 if gate == "h" else 1.0)
    k = np.arange(10)
    up, down = 10e-6 * k + shift, 10e-6 * k + 3e-6 + shift
    events = turns(text)
    times_up = np.array([t for t, on in events if on])
    times_down = np.array([t for t, on in events if not on])
    assert np.abs(times_up[-9:] - up[-9:]).max() < 1e-18
    assert np.abs(times_down - down).max() < 1e-18


def test_the_gate_is_drawn_as_it_is():
    """No step ends on the corners of the ramp, yet the record has them, exactly."""
    found = emsim.run(chopper())
    t, gate = found.time, found["v(g)"]
    phase = np.mod(t + 0.1e-6, 10e-6)
    ideal = np.interp(phase, [0, 0.2e-6, 3e-6, 3.2e-6, 10e-6], [0, 5, 5, 0, 0])
    inner = (t > 0) & (t < 99.8e-6)
    assert np.abs(gate - ideal)[inner].max() < 1e-6
    for corner in (10e-6 - 0.1e-6, 10e-6 + 0.1e-6, 12.9e-6, 13.1e-6):
        assert np.abs(t - corner).min() < 1e-15
    assert (np.diff(t) > 0).all()


def test_a_gate_that_the_circuit_loads_is_followed():
    """A resistor at the gate makes its ramp part of the circuit; the edges stay where they are."""
    fine = ("\n.tran 1u", "\n.tran 0.1u")  # rows so near that what lies between them is not the question
    loaded, plain = emsim.run(chopper(more="Rg g 0 1k").replace(*fine)), emsim.run(chopper().replace(*fine))
    at = np.linspace(0, 100e-6, 77)
    for column in ("i(l1)", "v(x)"):
        a, b = (np.array([r.at(column, t) for t in at]) for r in (loaded, plain))
        assert np.abs(a - b).max() < 1e-4 * np.ptp(b)
    assert plain.stats["breakpoints"] <= 22  # 20 edges, no corners
    assert loaded.stats["breakpoints"] >= 55  # 20 edges, 40 corners less the first


def test_a_gate_that_jumps():
    """PWL with two values at one time: the switch turns there."""
    text = CHOPPER.replace(
        "PULSE(0 5 {delay} {ramp} {ramp} {3u-ramp} 10u)", "PWL(0 0 20u 0 20u 5 50u 5 50u 0)"
    )
    text = text.replace("{gate}", "g").replace("{vh}", "0")
    found = emsim.run(text)
    assert turns(text) == [(20e-6, True), (50e-6, False)]
    # L di/dt = 10 - (R + ron) i from 20 us on
    t = np.linspace(20.5e-6, 49.5e-6, 30)
    current = np.array([found.at("i(l1)", x) for x in t])
    ratio = 1000.0 / 1000.1
    r = 10 + 0.1 * ratio
    expected = 10 * ratio / r * (1 - np.exp(-r / 1e-3 * (t - 20e-6)))
    assert np.abs(current - expected).max() < 2e-4 * expected.max()
