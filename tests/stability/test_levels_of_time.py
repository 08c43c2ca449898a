"""What is a function of time: levels that are reached, edges too short for two times, corners nearer than a step.

Right values are closed forms of the sources' own corners.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk"]


def quiet(r: emsim.Result, *codes: str) -> None:
    assert not [d for d in r.diagnostics if d.code in codes], r.diagnostics


def test_a_comparator_on_a_sine_beside_a_square_wave_of_its_frequency():
    """W404 and W405 were told of it; the duty is acos(0.9)/pi."""
    r = emsim.run(
        """t
V2 c 0 PULSE(0 1 0 1u 1u 49u 100u)
R2 c d 1k
C2 d 0 10n
V4 g 0 SIN(0 1 10k)
B5 h 0 V={v(g)>0.9 ? 1 : 0}
R5 h i 1k
C5 i 0 10u
.tran 100u 20m
.meas tran duty avg v(h)
.end"""
    )
    quiet(r, "W404", "W405")
    assert r.measures["duty"] == pytest.approx(math.acos(0.9) / math.pi, rel=1e-5)


def test_edges_shorter_than_two_times_turn_switches_where_they_are():
    """Edges of 1 ps, a second into the run: switches turned 15 us late; W406 told of rounding of time."""
    r = emsim.run(
        """t
Vg g 0 PULSE(-1 1 1.4 1p 1p 30u 50u)
Vin in 0 24
S1 in sw g 0 swm
S2 sw 0 0 g swm
Rl sw 0 1
.model swm sw(vt=0 ron=0.05 roff=1e9)
.tran 50u 1.402
.meas tran mean avg v(sw) from=1.401 to=1.402
.end"""
    )
    quiet(r, "W404", "W406")
    assert r.measures["mean"] == pytest.approx(24 / 1.05 * 0.6, rel=1e-6)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("near", ["1e-30", "1e-22", "1e-19"])
def test_times_of_rows_never_fall_where_corners_are_nearer_than_a_step(near, method):
    r = emsim.run(
        f"t\nI1 0 a PWL(0 0.5 {near} 0 2m 1 10m 1)\nL1 a 0 1m\nR1 a 0 1k\n.options method={method}\n.tran 0.1m 5m\n.end"
    )
    assert np.all(np.diff(np.asarray(r.time)) >= 0)


def test_a_level_that_is_reached_and_held_is_crossed_once():
    """Rounding on the plateau counted as crossings: the second one came 128 us behind the first, the rise took 13.8 us."""
    r = emsim.run(
        """t
Vp p 0 PULSE(0 2 100u 10u 20u 300u 1m)
Rp p q 1k
Cp q 0 47n
.tran 1u 5m
.meas tran first when v(p)=2
.meas tran second when v(p)=2 rise=2
.meas tran edge trig v(p) val=0 rise=1 targ v(p) val=2 rise=1
.end"""
    )
    found = r.measures
    assert found["first"] == pytest.approx(110e-6, rel=1e-9)
    assert found["second"] == pytest.approx(1110e-6, rel=1e-9)
    assert found["edge"] == pytest.approx(10e-6, rel=1e-9)


def test_an_undefined_level_is_midway():
    """It was 0.5 V whatever out_low and out_high are; ngspice 39 gives their mean."""
    r = emsim.run(
        """t
V1 a 0 PWL(0 0 1u 0 1.1u 1.5 3u 1.5 3.1u 5 5u 5)
A1 [a] [d] ad
A2 [d] [o] da
.model ad adc_bridge(in_low=1 in_high=2)
.model da dac_bridge(out_low=0 out_high=5)
R1 o 0 1k
.tran 10n 5u
.end"""
    )
    assert r.at("v(o)", 2e-6) == pytest.approx(2.5)


@pytest.mark.parametrize("reltol", ["1e-6", "1e-7"])
def test_radau_renews_its_jacobian_beside_an_edge(reltol):
    """An expression of a source beside jumps: steps became shorter down to none (E414), for the Jacobian was kept."""
    r = emsim.run(
        f"""t
Vs s 0 SIN(0 1 1k)
Vp p 0 PULSE(0 1 235.76u 1p 1p 28.49u 1m)
B1 g 0 V={{v(p)>0.5 ? 5 : 0}}
Rg g o 1k
Cg o 0 1n
Ex x 0 VALUE={{v(s)*v(s)*v(s)}}
.options method=radau reltol={reltol}
.tran 10u 20m
.end"""
    )
    assert r.at("v(x)", 10.1e-3) == pytest.approx(math.sin(0.2 * math.pi) ** 3, abs=1e-5)
