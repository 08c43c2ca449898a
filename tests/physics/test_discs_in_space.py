"""CONTACT axis=: a thin disc on a plane in space; corners, and peaks of friction that change."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim
from emsim import pipeline

G, R, M = 9.81, 0.1, 1.0
COIN = """a thin coin on a rough table
.gravity 0 0 -9.81
BODY w m=1 j=(2.5m,5m,2.5m) z={z!r} rot=({lean},0,0) {more}
CONTACT c w 0 line=(0,0,1) r=0.1 axis=(0,1,0) mu={mu} e=0
.options reltol=1e-8 method={method}
.tran 10m {until}
.print tran e0(w) e1(w) z(w) vx(w) force(c)
.end
"""


@pytest.mark.parametrize("method", ["auto", "radau", "esdirk", "gear"])
def test_a_coin_that_leans_falls(method):
    """It turns about the point of its rim: (J + m r^2) a'' = m g r sin a. As a ball it stood for ever."""
    lean = 0.37
    r = emsim.run(COIN.format(z=R * math.cos(lean), lean=lean, more="", mu=1, until=0.1, method=method))
    a, w, inertia, n = lean, 0.0, 2.5e-3 + M * R * R, 20000
    h = 0.1 / n
    for _ in range(n):  # leapfrog
        half = w + 0.5 * h * M * G * R * math.sin(a) / inertia
        a += h * half
        w = half + 0.5 * h * M * G * R * math.sin(a) / inertia
    assert a == pytest.approx(0.5207, abs=1e-4)
    assert 2 * math.atan2(r["e1(w)"][-1], r["e0(w)"][-1]) == pytest.approx(a, abs=1e-5)
    assert r["z(w)"][-1] == pytest.approx(R * math.cos(a), abs=1e-6)


def test_a_disc_on_a_smooth_table_falls_on_the_spot():
    """Without friction its centre goes straight down, and energy is kept: m z'^2/2 + J a'^2/2 = m g (z0 - z), z = r cos a."""
    lean = 0.37
    r = pipeline.run(
        COIN.format(z=R * math.cos(lean), lean=lean, more="", mu=0, until=0.1, method="auto"), energy=True
    )
    assert np.abs(r["vx(w)"]).max() < 1e-9
    assert r.energy.share < 1e-6


@pytest.mark.parametrize("lean", [0.2, 0.6])
def test_a_disc_that_rolls_in_a_circle_goes_on_with_its_lean(lean):
    """Euler's disc, its centre at rest: w lies along the diameter through the point of touch, of the size W cos a, and the moment
    m g r sin a of the table turns J1 w round with the rate W:  W^2 = m g r/(J1 cos a)."""
    rate = math.sqrt(M * G * R / (2.5e-3 * math.cos(lean)))
    more = f"omega=(0,0,{rate * math.cos(lean)!r})"
    deck = COIN.format(z=R * math.cos(lean), lean=lean, more=more, mu=2, until=0.3, method="auto")
    r = pipeline.run(deck, energy=True)
    np.testing.assert_allclose(r["z(w)"], R * math.cos(lean), rtol=2e-5)
    np.testing.assert_allclose(r["force(c)"][1:], M * G, rtol=1e-3)
    assert r.energy.share < 1e-6


def test_a_wheel_meets_the_corner_of_a_curb():
    """About the corner angular momentum is kept: rq=0 was refused."""
    r = emsim.run(
        "t\n.gravity 9.81\nBODY w m=10 j=0.2 x=-0.5 y=0.2 vx=3 omega=-15\nCONTACT road w 0 line=(0,1) r=0.2 mu=1 e=0\n"
        "CONTACT curb w 0(0,0.05) rq=0 r=0.2 mu=1 e=0\n.options reltol=1e-8\n.tran 1m 0.2\n.end\n"
    )
    hit = (
        int(np.argmax(r["hits(curb)"] > 0))
        if "hits(curb)" in r.names
        else int(np.argmax(r["omega(w)"] > -14.9))
    )
    # (j w + m v (r - h)) / (j + m r^2)
    assert r["omega(w)"][hit] == pytest.approx(-(0.2 * 15 + 10 * 3 * 0.15) / (0.2 + 10 * 0.04), rel=2e-2)


def test_a_peak_of_friction_may_change():
    """A clutch whose normal force falls, with 1.1 times as much to break away: fs= was a number alone."""
    deck = (
        "t\nBODY a m=0 j=1\nJOINT ja 0 a pin\nTORQUE t ja tau={10*time}\n"
        "FRICTION c ja fc={4-time} fs={1.1*(4-time)}\n.options reltol=1e-8\n.tran 1m 0.4\n.meas tran goes when omega(ja)=1u\n"
        ".end\n"
    )
    assert emsim.run(deck).measures["goes"] == pytest.approx(4.4 / 11.1, abs=1e-4)
