"""What random machines found: false alarms where a joint stands still, and starts that two formulations read differently."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

# let go from rest, damped by c u + c2 u |u|: |u| has its kink where it starts
FROM_REST = """two arms let go
.gravity 9.81
BODY b0 m=1.891 j=29.992m com=(-0.125,0.272)
JOINT j0 0(-0.213,0.078) b0(0,0.211) pin ic=(-0.849,0)
BODY b1 m=1.664 j=9.572m com=(0.004,0.201)
JOINT j1 b0(0.167,0.02) b1(-0.177,-0.185) pinslot axis=(1,-0.249) ic=(0.024,-0.54,0,0)
JOINT shut b1(0.146,0.21) 0(0.21189703229708626,-0.44112889276325917) pin
DAMPER d j0 c=0.192 c2=0.092
TORQUE t b0 tau={0.3*cos(8*time)}
.tran 10m 0.5
"""
# a rod between two bodies that a pin holds together already: the pin cannot turn
LOCKED = """an arm that its strut locks
.gravity 9.81
BODY b0 m=1.9 j=6m com=(-0.06,-0.29)
JOINT j0 0(0.1,0.2) b0(-0.25,0) slide axis=(1,1.3) ic=(0.02,0)
BODY b1 m=0.6 j=22m com=(0.17,0.1)
JOINT j1 b0(-0.13,0.15) b1(0.2,0.28) pin ic=(-0.05,0)
BODY b2 m=0.74 j=25m com=(0.125,-0.02)
JOINT j2 b0(0.2,-0.14) b2(0.1,0.18) pin ic=(0.094,0)
JOINT shut b2(0,0.26) b0(0.76,0.63) rod
SPRING s0 b2(0.28,-0.29) b1(0.7,0.7) k=55 l0=0.07
DAMPER d {damped} c=0.1 c2=0.06
.tran 10m 0.5
"""


def warned(deck: str, options: str) -> set[str]:
    r = emsim.run(f"{deck}.options {options}\n.end\n")
    return {d.code for d in r.diagnostics if d.severity == "warning"}


@pytest.mark.parametrize("method", ["auto", "gear", "trbdf2", "radau", "dop853", "gauss4"])
@pytest.mark.parametrize("reltol", [1e-4, 1e-10])
def test_a_kink_at_the_start_is_called_a_broken_condition(method, reltol):
    if reltol == 1e-10 and method in ("gear", "trbdf2", "gauss4"):
        reltol = 1e-7
    assert not warned(FROM_REST, f"method={method} reltol={reltol:g}")


@pytest.mark.parametrize("method", ["auto", "gear", "trbdf2", "radau"])
@pytest.mark.parametrize("damped", ["j0", "j2"])
def test_rounding_of_a_locked_joint_is_called_amplified_or_a_broken_condition(method, damped):
    for reltol in (1e-4, 1e-8):
        assert not warned(LOCKED.format(damped=damped), f"method={method} reltol={reltol:g}") & {
            "W404",
            "W417",
        }


def test_a_body_that_flies_on_straight_amplifies_nothing():
    """Its speeds do not change: what differs between two tolerances is all the range they have."""
    deck = "t\nBODY b m=2 j=10m com=(0.1,0.2)\nJOINT j 0 b planar ic=(0.1,0.2,0.3,1,-2,3)\n.tran 10m 0.5\n"
    for method in ("gear", "trbdf2", "auto"):
        assert not warned(deck, f"method={method} reltol=1e-4")


def test_maximal_coordinates_start_elsewhere_where_guesses_contradict_a_gear():
    """j2 follows j1: its guess says nothing, in both."""
    deck = """t
.gravity 2.779 -9.81 2.11
BODY b0 m=1.57 j=(15m,17m,27m) com=(0,-0.07,-0.17)
JOINT j0 0(0.133,-0.163,0.267) b0(0.241,-0.282,-0.285) ball guess=(0.075,0.79,-0.214)
BODY b1 m=0.6 j=(10m,11m,16m) com=(0,0,-0.16)
JOINT j1 b0(0.078,0.134,-0.122) b1(0.146,0.237,0.284) pin axis=(1,1.869,0.031) guess=0.001
BODY b2 m=1.95 j=(17m,23m,26m) com=(0,0.265,-0.064)
JOINT j2 b1(-0.037,0.005,0.167) b2(0.013,-0.064,-0.006) pin axis=(1,-1.826,0.814) guess=-0.847
JOINT shut b2(-0.199,-0.164,-0.293) 0(0.58,0.868,0.719) rod
GEAR g j2 j1 ratio=0.7
.options reltol=1e-8 formulation={}
.tran 10m 0.3
.print tran angle(j1) angle(j2)
.end
"""
    joint, absolute = (emsim.run(deck.format(word)) for word in ("joint", "absolute"))
    for name in ("angle(j1)", "angle(j2)"):
        assert np.asarray(absolute[name])[[0, -1]] == pytest.approx(
            np.asarray(joint[name])[[0, -1]], abs=1e-6
        )
