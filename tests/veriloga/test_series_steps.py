"""What a node behind a series resistance asks of the steps: the same of every device, whatever its law is written in."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

BRIDGE = """a bridge on a smoothing capacitor
.model m {kind}(is=10n n=1.7 rs=30m cjo=50p)
V1 p q SIN(0 17 50)
Rw p a 0.5
{letter}1 a o m
{letter}2 q o m
{letter}3 0 a m
{letter}4 0 q m
C1 o 0 1m
R1 o 0 100
R2 q 0 1meg
.tran 0.1m 60m
.end
"""
INVERTER = """a MOSFET that switches a resistor, its channel behind {rs} ohm
.model n nmos(level=1 vto=1 kp=1 rd={rs} rs={rs} cgso=1n cgdo=0.1n cbd=100p)
V1 d 0 12
V2 g 0 PULSE(0 8 1u 50n 50n 4u 10u)
Rg g gi 10
Rl d o 10
M1 o gi 0 0 n l=1u w=10u
.tran 10n 40u
.end
"""


def test_a_diode_as_a_module_takes_the_steps_of_the_element():
    element = emsim.run(BRIDGE.format(kind="d", letter="D"))
    module = emsim.run(BRIDGE.format(kind="diode", letter="N"))
    assert module.stats["steps"] < 1.1 * element.stats["steps"]


@pytest.mark.parametrize("rs", [1e-3, 0.1])
def test_small_resistances_cost_few_steps_and_no_accuracy(rs):
    without = emsim.run(INVERTER.format(rs=0))
    run, tight = (emsim.run(INVERTER.format(rs=rs), reltol=reltol) for reltol in (None, 1e-7))
    assert run.stats["steps"] < 1.5 * without.stats["steps"]
    times = np.linspace(0.0, 40e-6, 4001)
    off = np.array([run.at("v(o)", t) for t in times]) - np.array([tight.at("v(o)", t) for t in times])
    assert np.sqrt(np.mean(off**2)) < 12e-3  # reltol of 12 V
