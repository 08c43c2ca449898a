"""`.op static`: the machine comes to the rest that lies downhill from its start, or the run says that there is none."""

from __future__ import annotations

import math

import pytest

import emsim

COMB = """plates
BODY a m=1u
JOINT j 0 a slide
SPRING s j k=1
V1 n 0 {volts}
TRANSDUCER x n 0 j C={{1p/(1u-pos(j))*1u}}
.op static
.end
"""


def test_hanging_rod_with_a_load_and_a_spring():
    """Torque balance k q + (m g/2 + M g) l cos q = 0, the root next to the start; Newton's method alone lands two turns away."""
    r = emsim.run(
        "rod\nBODY a shape=rod(1) m=1\nJOINT j1 0 a pin\nSPRING s j1 k=2\nBODY c m=3\nJOINT w a(1,0) c weld\n"
        ".gravity 9.81\n.op static\n.end\n"
    )
    angle = float(r["angle(j1)"][-1])
    assert -math.pi / 2 < angle < 0
    assert 2 * angle + 9.81 * 3.5 * math.cos(angle) == pytest.approx(0, abs=1e-6)


def test_four_bar_settles_near_its_start():
    r = emsim.run(
        "loop\nBODY a shape=rod(1) m=1\nBODY b shape=rod(2) m=2\nBODY c shape=rod(1.5) m=1\n"
        "JOINT j1 0 a pin guess=80deg\nJOINT j2 a(1,0) b pin guess=-70deg\nJOINT j3 0(2,0) c pin guess=80deg\n"
        "JOINT j4 b(2,0) c(1.5,0) pin\nSPRING s j1 k=30\n.gravity 9.81\n.op static\n.print op fx(j4)\n.end\n"
    )
    assert abs(float(r["angle(j1)"][-1])) < math.pi
    assert abs(float(r["fx(j4)"][-1])) < 100


def test_plates_below_pull_in_and_above():
    """k q = v^2/2 C0 g/(g - q)^2 with C0 = 1 pF, g = 1 um: at 0.1 V q = 5e-9 m; above sqrt(8/27) V, where q would be g/3, the gap
    closes and there is no rest."""
    for volts in (0.1, 0.5, 0.544):
        q = float(emsim.run(COMB.format(volts=volts))["pos(j)"][-1])
        assert q < 1e-6 / 3 and q == pytest.approx(volts**2 / 2 * 1e-18 / (1e-6 - q) ** 2, rel=1e-6)
    for volts in (0.55, 0.6, 1, 10, 100, 1000):
        with pytest.raises(emsim.ConvergenceError, match="no equilibrium"):
            emsim.run(COMB.format(volts=volts))


def test_a_machine_without_stiffness_has_no_rest():
    with pytest.raises(emsim.ConvergenceError, match="no equilibrium"):
        emsim.run("fall\nBODY a m=1\nJOINT j 0 a slide axis=(0,1)\n.gravity 9.81\n.op static\n.end\n")


def test_op_reports_the_point_where_a_transient_starts():
    """A swinging rod: alpha = -3/2 g cos q / l; the pin carries weight and centripetal force (by hand)."""
    r = emsim.run(
        "rod\nBODY a shape=rod(1) m=1\nJOINT j1 0 a pin ic=(.3,5)\n.gravity 9.81\nB1 n 0 V={fy(j1)}\n"
        ".op\n.print op fx(j1) fy(j1) alpha(j1)\n.end\n"
    )
    q, u = 0.3, 5.0
    alpha = -1.5 * 9.81 * math.cos(q)
    ax = -0.5 * (alpha * math.sin(q) + u * u * math.cos(q))
    ay = 0.5 * (alpha * math.cos(q) - u * u * math.sin(q))
    assert float(r["alpha(j1)"][-1]) == pytest.approx(alpha, rel=1e-6)
    assert float(r["fx(j1)"][-1]) == pytest.approx(ax, rel=1e-6)
    assert float(r["fy(j1)"][-1]) == pytest.approx(ay + 9.81, rel=1e-6)
    assert float(r["v(n)"][-1]) == pytest.approx(ay + 9.81, rel=1e-6)


@pytest.mark.parametrize("upper, lower", [(100, 50), (1e3, 1e3), (10, 5), (1e5, 200)])
def test_masses_hang_on_springs_wherever_they_start(upper, lower):
    """Two masses on two springs (by hand: m g of what hangs below each, over its k). On slides that start at 0 the way gone
    so far bounds a step: the search was given up after forty of them, on its way."""
    r = emsim.run(
        "two masses\n.gravity 9.81\nBODY a m=1\nBODY b m=2\nJOINT ja 0 a slide axis=(0,1)\n"
        f"JOINT jb a b slide axis=(0,1)\nSPRING sa ja k={upper}\nSPRING sb jb k={lower}\n.op static\n.end\n"
    )
    assert float(r["pos(ja)"][-1]) == pytest.approx(-3 * 9.81 / upper, rel=1e-9)
    assert float(r["pos(jb)"][-1]) == pytest.approx(-2 * 9.81 / lower, rel=1e-9)


def test_voice_coil_of_rising_constant_comes_to_rest():
    """k q = i (K0 + K1 q), 1 A, from 10 mm off: q = 0.1/(1 - 0.1)."""
    r = emsim.run(
        "coil\nBODY b m=1m\nJOINT h 0 b slide ic=10m\nSPRING s h k=1\nTRANSDUCER c a 0 h K={0.1*(1+pos(h))}\n"
        "I1 0 a 1\nR1 a 0 1k\n.op static\n.end\n"
    )
    assert float(r["pos(h)"][-1]) == pytest.approx(1 / 9, rel=1e-9)
