"""What passes a threshold and comes back within one step is an event: balls that fly past each other, conditions, laws."""

from __future__ import annotations

from math import acos, cos, hypot, sin, sqrt

import numpy as np
import pytest

import emsim

RADIUS, SPEED, END = 0.1, 3.0, 8.0

BALLS = """a ball flies past another and touches it
BODY a m=1 j=0.004 x={x} y=0 vx=3
BODY b m=2 j=0.004 x=0 y={y}
CONTACT c a b rq=0.1 r=0.1 {law}
.options reltol=1e-6 method={method}
.tran 1 8
.print tran x(a) y(a) x(b) y(b) vx(a) vy(a) hits(c)
.end
"""


def balls(t0: float, depth: float) -> tuple[float, np.ndarray]:
    """Of an elastic impact: offset of the paths, positions of both at the end.

    t0 is when the centres would be nearest, depth by how much the balls would then overlap.
    """
    y = 2 * RADIUS - depth
    x = -sqrt((2 * RADIUS) ** 2 - y * y)
    impact = t0 + x / SPEED
    normal = np.array([-x, y]) / (2 * RADIUS)
    push = 2 * SPEED * normal[0] / (1 / 1 + 1 / 2) * normal
    left = END - impact
    a = np.array([x, 0.0]) + (np.array([SPEED, 0.0]) - push) * left
    return y, np.concatenate([a, np.array([0.0, y]) + push / 2 * left])


@pytest.mark.parametrize("depth", [1e-1, 1e-3, 1e-5])
@pytest.mark.parametrize("method", ["auto", "radau", "esdirk", "trbdf2", "gear", "trap"])
def test_balls_that_pass_within_a_step_meet(method, depth):
    """A step covers some diameters: at its places nothing tells that the balls have met."""
    for t0 in np.linspace(3.0, 3.8, 7):
        y, end = balls(t0, depth)
        r = emsim.run(BALLS.format(x=-SPEED * t0, y=y, law="e=1", method=method))
        assert r["hits(c)"][-1] == 1, t0
        got = [r[name][-1] for name in ("x(a)", "y(a)", "x(b)", "y(b)")]
        assert got == pytest.approx(end, abs=3e-5), t0
        assert hypot(r["vx(a)"][-1], r["vy(a)"][-1]) < SPEED


@pytest.mark.parametrize("method", ["auto", "dop853", "rk45", "radau"])
def test_balls_that_give_way_meet_too(method):
    """An elastic contact is a condition of a smooth force; explicit methods take it as well."""
    y, end = balls(3.17, 0.1)
    r = emsim.run(BALLS.format(x=-SPEED * 3.17, y=y, law="k=1e9", method=method))
    got = [r[name][-1] for name in ("x(a)", "y(a)", "x(b)", "y(b)")]
    # the normal turns while they touch, for pi sqrt(m/k)
    assert got == pytest.approx(end, abs=1e-2)


def test_balls_that_just_miss_do_not_meet():
    for method in ("auto", "gear", "esdirk"):
        r = emsim.run(BALLS.format(x=-9.5, y=2 * RADIUS + 1e-5, law="e=1", method=method))
        assert r["hits(c)"][-1] == 0 and r["x(a)"][-1] == pytest.approx(3 * END - 9.5, rel=1e-6)


PEAKS = """a tank peaks above a threshold, which something counts
L1 a 0 1 ic=0
C1 a 0 1 ic=1
{counts}
C2 sum 0 1 ic=0
.options reltol={reltol} method={method}
.tran 1 31 0 1 uic
.print tran v(sum) v(a)
.end
"""
COUNTS = {
    "condition": "B1 0 sum I=v(a)>0.999 ? 1 : 0",
    "kink": "B1 0 sum I=1e3*max(v(a)-0.999,0)",
    "switch": "V1 on 0 1\nS1 on in a 0 closes\nG1 0 sum in 0 1\nR1 in 0 1k\n.model closes sw(vt=0.999 vh=0 ron=1m roff=1e12)",
}


@pytest.mark.parametrize("kind", COUNTS)
@pytest.mark.parametrize("method", ["auto", "dop853", "rk45", "radau", "esdirk", "trbdf2", "gear", "trap"])
def test_peaks_within_a_step_are_counted(method, kind):
    """v(a) = cos t is above 0.999 for 2 acos 0.999, one time in 70: half a peak at the start, four whole ones."""
    half = acos(0.999)
    share = 1e3 * (sqrt(1 - 0.999**2) - 0.999 * half) if kind == "kink" else half
    r = emsim.run(PEAKS.format(method=method, counts=COUNTS[kind], reltol=1e-6))
    assert r["v(sum)"][-1] == pytest.approx(9 * share, rel=1e-2)


WHEEL = """a wheel that is turned to and fro
BODY wheel m=1 j=1
JOINT axle 0 wheel pin ic=({angle},{speed})
TORQUE drive axle tau={{-{torque}(time)}}
{law}
.options reltol=1e-9 method={method}
.tran 1 6
.print tran omega(axle) angle(axle)
.end
"""
IMPLICIT = ["auto", "radau", "esdirk", "trbdf2", "gear", "trap"]
BACK = acos(-0.999)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_wheel_that_would_turn_back_for_a_moment_is_held(method):
    """Its speed would be cos t + 0.999. A freewheel holds it until its torque turns, at pi; then it is cos t + 1."""
    r = emsim.run(
        WHEEL.format(angle=0, speed=1.999, torque="sin", law="FREEWHEEL law axle dir=1", method=method)
    )
    assert r["omega(axle)"][-1] == pytest.approx(cos(6.0) + 1, abs=2e-5)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_wheel_that_would_turn_back_for_a_moment_sticks(method):
    """As it comes to rest a torque of 0.04 N m is less than what lets it go."""
    law = "FRICTION law axle fc=1e-6 fs=10"
    r = emsim.run(WHEEL.format(angle=0, speed=1.999, torque="sin", law=law, method=method))
    assert r["omega(axle)"][-1] == pytest.approx(0, abs=1e-7)


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_wheel_that_would_pass_its_stop_for_a_moment_is_stopped(method):
    """Its angle would be cos t + 0.999. It loses its speed at 0, and its torque takes it away from there.

    The speed at which it arrives is 0.04, by how much it would pass is 0.001: an error of the angle comes out 60 times as large.
    """
    law = "STOP law axle min=0 e=0"
    r = emsim.run(WHEEL.format(angle=1.999, speed=0, torque="cos", law=law, method=method))
    assert r["angle(axle)"][-1] == pytest.approx(cos(6.0) + 0.999 + sin(BACK) * (6 - BACK), abs=3e-4)
