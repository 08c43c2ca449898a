"""The decks of CONTACT between shapes: box_stack, stairs, dominoes, ratchet."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from outlines import apart, box, placed
from test_shapes import TOLERANCES, G, never_rises

import emsim

DECKS = Path(__file__).parents[2] / "netlists" / "mechanical"


def run(name: str, reltol: float, also: str = "energy()"):
    return emsim.run(DECKS / f"{name}.cir", reltol=reltol, also=also)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_boxes_fall_on_each_other_and_stand(reltol, error):
    """Boxes fall 10, 30, 50, 70 mm: at rest the sum of all forces is (4 + 3 + 2 + 1) m g, and impacts took m g 160 mm."""
    r = run("box_stack", reltol)
    assert r["force(touch)"][-1] == pytest.approx(10 * G, rel=1e-6)
    for k in range(1, 5):
        assert r[f"y(b{k})"][-1] == pytest.approx(0.1 * k - 0.05, abs=error)
    lost = next(line.dissipated for line in r.energy.lines if line.name == "touch")
    assert lost == pytest.approx(G * 0.16, rel=error) and never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_box_tumbles_down_stairs(reltol, error):
    """It turns at omega and flies past the top stair until its lowest corner is on the next one: y0 - g t^2/2 is that corner's
    height over 0.3 m. No stair is entered, and it ends flat."""
    r = run("stairs", reltol, "energy() vx(block) omega(block)")
    corners = box(0.1, 0.08)

    def lowest(t: float) -> float:
        a = 0.4 - 12 * t
        return 0.6 - G * t * t / 2 + min(sin(a) * x + cos(a) * y for x, y in corners) - 0.3

    low, high = 0.1, 0.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if lowest(middle) > 0.0 else (low, middle)
    t = np.asarray(r.time)
    first = int(np.flatnonzero(np.asarray(r["hits(touch)"]) >= 1)[0])
    assert t[first] == pytest.approx(high, abs=0.1 * error)
    x, y, angle = (np.asarray(r[f"{q}(block)"]) for q in ("x", "y", "angle"))
    body = placed(corners, x, y, angle)
    for w, h, px, py in (
        (3, 0.2, 1.5, -0.1),
        (0.3, 0.15, 0.75, 0.075),
        (0.3, 0.3, 0.45, 0.15),
        (0.3, 0.45, 0.15, 0.225),
    ):
        assert apart(placed(box(w, h, px, py), *np.zeros((3, len(t)))), body).min() > -1e-6
    # by radau and esdirk with impacts of 1e-9 and 1e-11 of a step, extrapolated to none: both give this to 1e-10
    assert x[-1] == pytest.approx(0.8229031432, abs=max(error, 1e-8))
    assert angle[-1] / (pi / 2) == pytest.approx(-5, abs=1e-6) and never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_dominoes_fall_in_order(reltol, error):
    """d1 turns about its foot, sticking, w^2 = w0^2 + 2 m g R (cos b0 - cos b)/J, until its corner is at the face of d2: where
    h sin a = gap. Then nothing is in each other, and all are down."""
    r = run(
        "dominoes", reltol, "energy() omega(d1) " + " ".join(f"{q}(d{k})" for k in range(1, 5) for q in "xy")
    )
    a = np.arcsin(0.012 / 0.044)
    b0, arm = atan2(0.004, 0.022), hypot(0.004, 0.022)
    j = (0.008**2 + 0.044**2) / 3
    w = sqrt(100 + 2 * G * arm * (cos(b0) - cos(a - b0)) / j)
    angle, t = np.asarray(r["angle(d1)"]), np.asarray(r.time)
    before = t[angle > -a + 1e-6][-1]
    assert r.at("omega(d1)", before) ** 2 == pytest.approx(
        100 + 2 * G * arm * (cos(b0) - cos(-r.at("angle(d1)", before) - b0)) / j, rel=error
    )
    assert abs(r.at("omega(d1)", before)) == pytest.approx(w, rel=0.02)
    falls = [t[np.asarray(r[f"angle(d{k})"]) < -0.05][0] for k in range(1, 5)]
    assert falls == sorted(falls) and all(r[f"angle(d{k})"][-1] < -1.0 for k in range(1, 5))
    bodies = [
        placed(box(0.008, 0.044), *(np.asarray(r[f"{q}(d{k})"]) for q in ("x", "y", "angle")))
        for k in range(1, 5)
    ]
    assert all(apart(one, other).min() > -1e-6 for k, one in enumerate(bodies) for other in bodies[k + 1 :])
    assert never_rises(r, reltol)


@pytest.mark.parametrize(("reltol", "error"), TOLERANCES)
def test_a_ratchet_is_held_by_a_tooth(reltol, error):
    """Held, the pawl's right corner (w/2, y) is on a radial face at the angle atan2(w/2, y) from the top, and its left one on the
    slope of the tooth before, a line from (0, ro) to ri (sin s, cos s) in its own axes."""
    r = run("ratchet", reltol)
    half, ri, ro, s = 0.003, 0.03, 0.04, pi / 4

    def beyond(y: float) -> float:
        turn = atan2(half, y) - s  # of the slope's tooth, clockwise
        u, v = cos(turn) * -half - sin(turn) * y, sin(turn) * -half + cos(turn) * y
        side = (ri * sin(s), ri * cos(s) - ro)
        return side[0] * (v - ro) - side[1] * u

    low, high = 0.025, 0.04
    assert beyond(low) < 0.0 < beyond(high)
    for _ in range(60):
        y = 0.5 * (low + high)
        low, high = (low, y) if beyond(y) > 0.0 else (y, high)
    assert r["pos(guide)"][-1] == pytest.approx(y + 0.02, abs=0.1 * error)
    assert (-r["angle(main)"][-1]) % s == pytest.approx(atan2(half, y), abs=error)
    assert abs(r["omega(main)"][-1]) < 1e-9 and r["angle(main)"].min() < -1.5


def test_a_foot_that_turns_round_is_held():
    """The last of ten dominoes is leant on while its foot stops sliding and is held: not thousands of turns to and fro."""
    parts = [f"BODY d{k} m=0.01 shape=box(0.008,0.044) x={0.02 * k:g} y=0.022" for k in range(10)]
    parts[0] += " omega=-10 vx=0.22 vy=0.04"
    head = f"t\n.gravity {G}\nSHAPE floor 0 box(4,0.2) at=(0.3,-0.1)\n"
    tail = "\nCONTACT touch all e=0 mu=0.3\n.tran 1m 0.37\n.save energy() angle(d9)\n.end\n"
    r = emsim.run(head + "\n".join(parts) + tail)
    assert np.count_nonzero(np.asarray(r.time) > 0.35) < 300 and never_rises(r, 1e-3)
    assert r["angle(d9)"][-1] < -0.05
