"""Events on steps: named after what went wrong."""

from __future__ import annotations

import numpy as np
import pytest
from support import run

SWITCH = """a switch that opens just where a step ended
V1 n1 0 PWL(0 0 5.92841e-05 5 8.89261e-05 -3 0.00014821 1)
R1 n1 n2 46.9483
R2 n2 n3 21
C2 n2 0 1.43238e-07
C3 n3 0 2.87368e-08
S1 0 n3 n1 0 sm
.model sm SW(vt=0.7 vh=0.3 ron=5.32444 roff=10meg)
.tran {step:.6g} 0.000177852
.end
"""


@pytest.mark.parametrize("method", ["trap", "gear", "radau"])
@pytest.mark.parametrize("step", np.linspace(2.9e-7, 3.1e-7, 9))
def test_no_time_slips_at_an_event_on_the_start_of_a_step(method, step):
    """The state moved by a step while time stood still: the source's own voltage was one step ahead."""
    r = run(SWITCH.format(step=step), f"method={method}")
    t, v = np.asarray(r.time), np.asarray(r["v(n1)"])
    exact = np.interp(t, [0, 5.92841e-05, 8.89261e-05, 0.00014821, 1], [0, 5, -3, 1, 1])
    assert np.abs(v - exact).max() < 1e-6 * 8
    # states do not jump: at most one step's charge between two points
    out = np.asarray(r["v(n2)"])
    rate = 5 / 46.9483 / 1.43238e-07  # V/s, more than anything here can drive
    assert np.all(np.abs(np.diff(out)) <= 3 * rate * np.diff(t) + 1e-6)


def test_a_constant_control_does_not_hang():
    """A switch whose control folds to a constant waited for its own lock."""
    r = run("t\nV1 a 0 1\nR1 a b 1k\nS1 b 0 0 0 sw\n.model sw SW(vt=-1 ron=1k)\n.tran 1u 10u\n.end\n")
    assert r["v(b)"][-1] == pytest.approx(0.5)


@pytest.mark.parametrize("reltol", ["1e-3", "1e-7"])
def test_linear_circuits_choose_sensible_radau_steps(reltol):
    """The error estimate read the charges of the guess, not of the solution: every step was refused once and
    a tank took a hundred times too many."""
    r = run("t\nC1 a 0 1u IC=1\nL1 a 0 1m\n.tran 1m 2m UIC\n.end\n", f"method=radau reltol={reltol}")
    assert r.stats["rejected"] <= 5 and r.stats["steps"] < {"1e-3": 400, "1e-7": 4000}[reltol], r.stats


def test_uic_values_belong_to_time_zero():
    """The initial point was taken at the end of the short step that finds it: a current of v h/L at t = 0."""
    r = run("t\nC1 a 0 1u IC=1\nL1 a 0 1m\n.tran 10m 20m 0 10u UIC\n.end\n", "method=radau reltol=1e-9")
    assert abs(r["i(l1)"][0]) < 1e-12 and r["v(a)"][0] == pytest.approx(1, abs=1e-11)


def test_ddt_of_a_nonlinear_flux_is_under_error_control():
    """An unknown that stands under d/dt only inside ddt() was outside Newton's norm: 1 % of flux was lost."""
    text = """t
V1 a 0 SIN(0 1.25 0.15915494309189535 0 0 90)
Bs a 0 V={ddt(0.5*i(bs)+1.5*0.2517*atan(i(bs)/0.2517))}
Bp psi 0 V={0.5*i(bs)+1.5*0.2517*atan(i(bs)/0.2517)}
.tran 20m 6.28 UIC
.end
"""
    r = run(text, "method=radau")
    assert np.abs(np.asarray(r["v(psi)"]) - 1.25 * np.sin(np.asarray(r.time))).max() < 1e-4


KICKED = """a four-bar, kicked: the torque of 20 N m rises and falls within a microsecond
.gravity 9.81
BODY a shape=rod(1) m=1
BODY b shape=rod(2) m=2
BODY c shape=rod(1.5) m=1.5
JOINT j1 0 a pin guess=60deg
JOINT j2 a(1,0) b pin guess=-40deg
JOINT j3 b(2,0) c pin guess=-80deg
JOINT j4 0(2,0) c(1.5,0) pin
TORQUE tq j1 tau=PULSE(0 20 0.3 1u 1u 0.2 5)
.print tran fx(j1) fy(j4) alpha(j1) torque(tq)
.tran 10m 0.6
.end
"""


@pytest.mark.parametrize("method", ["trap", "gear", "radau", "trbdf2", "esdirk", "dop853"])
def test_forces_beside_a_corner_are_those_of_their_own_time(method):
    """Reactions in a row just before a corner were those after it (radau), and right after it rounding over a step of no length,
    3e5 N for 7 N (esdirk, trbdf2). At one position and speed both are linear in the torque: with what it does at the ends of the
    rise, every row on the way is known."""
    names = "fx(j1)", "fy(j4)", "alpha(j1)"
    r = run(KICKED, f"method={method} reltol=1e-5")
    for start, low in ((0.3, 0.0), (0.500001, 20.0)):
        # nothing has moved within three microseconds
        near = (r.time >= start - 1.5e-6) & (r.time <= start + 1e-6)
        assert near.sum() >= 4 and r["torque(tq)"][near][0] == pytest.approx(low, abs=1e-9)
        after = np.searchsorted(r.time, start + 1e-6 + 1e-12)
        before = np.flatnonzero(near)[0]
        for name in names:
            y = np.asarray(r[name])
            slope = (y[after] - y[before]) / (20 - 2 * low)
            exact = y[before] + slope * (r["torque(tq)"][near] - low)
            assert np.abs(y[near] - exact).max() < 2e-3 * abs(20 * slope), name
    # ... and these ends are right: the run without a kick goes on as this one was before its
    free = run(KICKED.replace("PULSE(0 20", "PULSE(0 0"), f"method={method} reltol=1e-5")
    for name in names:
        assert r.at(name, 0.3 - 1e-9) == pytest.approx(free.at(name, 0.3 - 1e-9), rel=2e-3)


@pytest.mark.parametrize("method", ["trap", "gear", "radau", "trbdf2", "esdirk"])
@pytest.mark.parametrize("torque", ["time>0.3 ? 20 : 0", "angle(j1)<0.9 ? 20 : 0"])
def test_forces_after_an_event_are_no_rounding(method, torque):
    """Gear and trbdf2 began where one step of no length had left the multipliers, fifteen times the forces' range away. The
    explicit method, whose forces are functions of the state, tells what they are."""
    text = KICKED.replace("tau=PULSE(0 20 0.3 1u 1u 0.2 5)", f"tau={{{torque}}}")
    r, exact = run(text, f"method={method} reltol=1e-3"), run(text, "method=dop853 reltol=1e-9")
    jump = np.flatnonzero(np.diff(r["torque(tq)"]) > 10)[0] + 1
    near = r.time[jump : jump + 4]
    own = exact.time[np.flatnonzero(np.diff(exact["torque(tq)"]) > 10)[0] + 1]
    for name in ("fx(j1)", "fy(j4)", "alpha(j1)"):
        there = exact.at(name, own + (near - near[0]))
        assert np.abs(r[name][jump : jump + 4] - there).max() < 1e-2 * np.ptp(exact[name]), name


@pytest.mark.parametrize("method", ["radau", "esdirk"])
def test_forces_in_the_shortest_of_steps_are_no_rounding(method):
    """After a corner of 10 ns steps begin at 0.1 ns. Nothing moves in that time: the side force on the piston was off by a
    twentieth, for the positions' rounding was divided by the square of a ten-thousandth of it."""
    r = run(
        "crank\nBODY crank shape=rod(50m) m=0.1\nBODY conrod shape=rod(200m) m=0.2\nBODY piston m=0.3 j=1m\n"
        "JOINT shaft 0 crank pin ic=(0.5,10)\nJOINT big crank(50m,0) conrod pin guess=-10deg\n"
        "JOINT small conrod(200m,0) piston pin\nJOINT bore 0 piston slide axis=(1,0)\n"
        "MOTOR m a 0 shaft kt=0.05 r=1\nV1 a 0 PULSE(0 12 0.5m 10n 10n 0.5m 1m)\n"
        ".print tran fy(bore)\n.tran 50u 5m\n.end\n",
        f"method={method}",
    )
    first = (r.time > 0) & (r.time < 1e-6)
    force = np.asarray(r["fy(bore)"])
    assert first.sum() >= 5 and np.ptp(force[first]) < 0.01 * np.ptp(force)


@pytest.mark.parametrize("method", ["trap", "gear", "trbdf2", "esdirk", "radau", "dop853"])
def test_an_event_lies_where_the_repeated_step_says_and_not_where_its_inside_said(method):
    # a node that follows a source is not what limits steps: trap took its zero off a parabola, 90 us late at any tolerance
    lines = (
        "V1 a 0 SIN(0 1 50)",
        "R1 a m 1k",
        "R2 m 0 1k",
        "B1 b 0 V={v(m)>0 ? 5 : 0}",
        "R3 b c 1k",
        "C3 c 0 1u",
    )
    r = run("\n".join(["comparator", *lines, ".tran 5m 0.2", ".end"]), f"method={method} reltol=1e-6")
    t, v = np.asarray(r.time), np.asarray(r["v(b)"])
    edges = t[1:][np.abs(np.diff(v)) > 1]
    np.testing.assert_allclose(edges[-18:], 0.01 * np.round(edges[-18:] / 0.01), rtol=0, atol=2e-8)
