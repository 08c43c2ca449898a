"""Starts of machines: modes are decided alike for every analysis; what rests at an end or on a threshold."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

ON_STOP = """mass held on its end, a second one on a spring above it
.gravity 9.81
BODY a m=1
BODY b m=1
JOINT x 0 a slide axis=(0,1)
JOINT y a b slide axis=(0,1) ic=-0.0981
SPRING s y k=100
STOP e x min=0 e=0
FORCE f b dir=(0,1) {{ac}}
V1 ac 0 0 ac 1
.end
""".replace("{{ac}}", "{v(ac)}")
ROLLING = """cylinder at rest in the bottom of a bowl, rolls
.gravity 9.81
BODY d m=1 shape=disc(0.1) y=-0.4
CONTACT c d 0 rq=-0.5 r=0.1 mu=5 e=0
.end
"""


def run(deck: str, cards: str):
    return emsim.run(deck.replace(".end", cards + "\n.end"))


def codes(result) -> set[str]:
    return {d.code for d in result.diagnostics}


def test_a_stop_that_holds_is_closed_in_modes():
    """sqrt(k/m): the lower mass does not move (0, 0, 2.25 Hz before)."""
    r = run(ON_STOP, ".modes")
    np.testing.assert_allclose(r.table("modes")["frequency"], [10.0 / (2 * math.pi)], rtol=1e-6)
    assert "W306" not in codes(r)


def test_a_stop_that_holds_is_closed_in_small_signals():
    """1 N on the upper mass alone: 1/(k - m w^2), and the lower one rests."""
    r = run(ON_STOP, ".ac lin 3 1 3")
    w = 2 * math.pi * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(np.real(r["pos(y)"]), 1.0 / (100.0 - w * w), rtol=1e-6)
    assert np.abs(r["pos(x)"]).max() < 1e-12
    assert "W306" not in codes(r)


def test_an_operating_point_shows_what_a_transient_starts_with():
    r = run(ON_STOP, ".op\n.tran 1m 2m")
    assert r.table("op")["force(e)"][0] == pytest.approx(2 * 9.81, rel=1e-6)
    assert r.table("tran")["force(e)"][0] == pytest.approx(2 * 9.81, rel=1e-6)


def test_a_cylinder_that_rolls_rolls_in_modes():
    """sqrt(2 g/(3 (R - r))); it slides or lifts nowhere (five zeros before)."""
    frequency = run(ROLLING, ".modes").table("modes")["frequency"]
    assert frequency[-1] == pytest.approx(math.sqrt(2 * 9.81 / (3 * 0.4)) / (2 * math.pi), rel=1e-5)
    static = run(ROLLING, ".modes static").table("modes")["frequency"]
    assert frequency[-1] == pytest.approx(static[-1], rel=1e-6)


RELAY = """relay armature rests on its end; current begins at t = 0
.param ls=0.09 l0=1.2 g0=0.3m
BODY arm m=5m
JOINT x 0 arm slide axis=(1,0) ic=1.5m
SPRING ret x k=400 q0=4.5m
STOP ends x min=0.1m max=1.5m e=0.25
.func lx(q) {{l0/(1+q/g0)}}
TRANSDUCER coil a 0 x W={{ls*i(coil)-ls*ls/lx(pos(x))*(1-exp(-lx(pos(x))*i(coil)/ls))}}
R1 s a 60
Vs s 0 12
.options reltol={reltol:g}
.tran 50u 6m uic
.meas tran leaves when mode(ends)=0.5 fall=1
.end
"""


@pytest.mark.parametrize("reltol", [1e-6, 1e-8, 1e-9, 1e-12])
def test_an_armature_at_rest_on_its_end_starts_at_every_tolerance(reltol):
    """Flux linkage as a state, DOP853 at 1e-11: it leaves its end at 4.680175 ms. E418 at t = 0 below 1e-8 before."""
    r = emsim.run(RELAY.format(reltol=reltol))
    assert r.measures["leaves"] == pytest.approx(4.680175e-3, abs=2e-8)


def test_a_drive_into_a_stop_names_both():
    deck = "t\nBODY b m=1\nJOINT x 0 b slide axis=(1,0)\nDRIVE d x qd={0.1}\nSTOP s x max=0.05\n.tran 5m 1\n.end\n"
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run(deck)
    found = caught.value.diagnostics[-1]
    assert found.code == "E418"
    assert "DRIVE d" in found.message and "STOP s" in found.message and "0.5 s" in found.message


FAN = """induction motor direct on line with a fan
.model im induction p=2 rs=2.9338 rr=1.355 lm=0.14375 lss=5.87m lsr=5.87m j=1.1m
BODY fan m=0 j=4m
JOINT sh 0 fan pin
MOTOR m1 a b c sh model=im
DAMPER air sh c=0 c2=2.5e-4
Va a 0 SIN(0 {{230*sqrt(2)}} 50)
Vb b 0 SIN(0 {{230*sqrt(2)}} 50 0 0 -120)
Vc c 0 SIN(0 {{230*sqrt(2)}} 50 0 0 120)
.options reltol={reltol:g}
.tran 0.5m 50m uic
.end
"""
HALL = """brushless motor with Hall sensors on a bridge of six switches, from rest on the edge of one
.model bl bldc p=4 ke=20m r=0.4 l=0.3m j=10u b=20u
.model sw sw ron=20m roff=1meg vt=0.5 vh=0
.model dd d is=1n n=1.2 rs=10m
BODY rot m=0 j=30u
JOINT sh 0 rot pin
MOTOR m1 a b c sh model=bl
.func ha(k) {{sin(4*angle(sh)-k*2*pi/3) > 0 ? 1 : 0}}
Vd vp 0 24
Bha ha 0 V={{ha(0)}}
Bhb hb 0 V={{ha(1)}}
Bhc hc 0 V={{ha(2)}}
Bau gau 0 V={{v(ha)*(1-v(hb))}}
Bbu gbu 0 V={{v(hb)*(1-v(hc))}}
Bcu gcu 0 V={{v(hc)*(1-v(ha))}}
Bal gal 0 V={{(1-v(ha))*v(hb)}}
Bbl gbl 0 V={{(1-v(hb))*v(hc)}}
Bcl gcl 0 V={{(1-v(hc))*v(ha)}}
S1 vp a gau 0 sw
S2 vp b gbu 0 sw
S3 vp c gcu 0 sw
S4 a 0 gal 0 sw
S5 b 0 gbl 0 sw
S6 c 0 gcl 0 sw
D1 a vp dd
D2 b vp dd
D3 c vp dd
D4 0 a dd
D5 0 b dd
D6 0 c dd
.options reltol={reltol:g}
.tran 20u 5m uic
.end
"""


@pytest.mark.parametrize(
    ("deck", "reltol"), [(FAN, 1e-3), (FAN, 1e-6), (HALL, 1e-3), (HALL, 1e-5), (HALL, 1e-7)]
)
def test_a_start_from_rest_on_a_corner_is_silent(deck, reltol):
    """|w| w at w = 0, an angle on the edge of a sensor: W404 and W405 of motions below the tolerances before; steps that ended at
    peaks of what is noise there (E410, E414 at 1e-5); a start on either side of the edge, by a rounding (W406 at 1e-7)."""
    assert not {"W404", "W405", "W406"} & codes(emsim.run(deck.format(reltol=reltol)))


@pytest.mark.parametrize("method", ["auto", "radau", "gear"])
def test_a_current_that_is_a_small_part_of_a_flux_beside_a_magnet(method):
    """From rest at 1e-6 a phase current's tolerance, 1e-15 A, is below the rounding of L i + psi(angle), which Newton's method
    took from their sum, and not from the magnet's flux: E414 (1e17 steps), and auto changed its method a hundred times. The speed
    at 5 ms from a start a little behind the edge, for the sensor may turn half a microsecond late."""
    deck = HALL.format(reltol=1e-6).replace("reltol", f"method={method} reltol")
    r = emsim.run(deck)
    assert r["omega(sh)"][-1] == pytest.approx(81.27, rel=2e-4)
    assert len(r.stats["methods"]) <= 10


def test_a_tiny_motion_still_turns_its_flags():
    """A mass that swings by far less than the tolerance of lengths, on its own: the scale of what it reads is its own."""
    deck = (
        "t\nBODY b m=1\nJOINT x 0 b slide axis=(1,0) ic=(1n,0)\nSPRING s x k=100\nB1 a 0 V={pos(x) > 0 ? 1 : 0}\nR1 a 0 1\n"
        ".options reltol=1e-6\n.tran 10m 5\n.meas tran on avg v(a)\n.end\n"
    )
    assert emsim.run(deck).measures["on"] == pytest.approx(0.5, abs=0.04)


RING = """ring of three gears
BODY a m=0 j=1
BODY b m=0 j=1
BODY c m=0 j=1
JOINT ja 0 a pin ic=(0,1)
JOINT jb 0 b pin
JOINT jc 0 c pin
GEAR g1 ja jb ratio=2
GEAR g2 jb jc ratio=2
GEAR g3 jc ja ratio=0.25
TORQUE t ja tau=1
.options formulation={formulation}
.tran 1m 0.1
.end
"""


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_ring_of_gears_turns_in_every_formulation(formulation):
    """One gear of the ring follows from the others; E411 in absolute coordinates before."""
    r = emsim.run(RING.format(formulation=formulation))
    inertia = 1 + 1 / 4 + 1 / 16
    assert r["omega(ja)"][-1] == pytest.approx(1 + 0.1 / inertia, rel=1e-6)
    assert r["omega(jc)"][-1] == pytest.approx((1 + 0.1 / inertia) / 4, rel=1e-6)


def test_windings_on_a_shaft_that_a_drive_turns():
    """A trapezoid into a star of resistors: tops of 2 ke w R/(R + r) from phase to phase (E414 before)."""
    deck = (
        "t\n.model bl bldc p=4 ke=20m r=0.4 l=1u j=10u\nBODY rot m=0 j=30u\nJOINT sh 0 rot pin\nMOTOR m1 a b c sh model=bl\n"
        "DRIVE d sh q={{100*time}}\nRa a n 10\nRb b n 10\nRc c n 10\nRn n 0 1k\n.options method={}\n.tran 0.1m 20m\n.end\n"
    )
    for method in ("auto", "radau", "trap"):
        r = emsim.run(deck.format(method))
        across = r["v(a)"] - r["v(b)"]
        assert np.abs(across).max() == pytest.approx(4.0 * 10 / 10.4, rel=2e-3)
