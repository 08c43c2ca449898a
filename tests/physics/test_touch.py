"""STOP and CONTACT with a stiffness: what a touch gives back, and that it never pulls."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.cards.touch import damping_of

WALL = """a mass against a wall
BODY ball m=0.3
JOINT way 0 ball slide axis=(1,0) ic=(1,-{v})
{card} k=20k e={e} n={n}
.options reltol=1e-9
.tran 0.1 {until}
.print tran vel(way) force(w) gap(w) hits(w) mode(w)
.end
"""


@pytest.mark.parametrize(
    ("e", "z"), [(0.9, 0.166481951), (0.7, 0.634828281), (0.5, 1.432750533), (0.3, 3.087081981), (1.0, 0.0)]
)
def test_the_damping_that_a_restitution_asks_for(e, z):
    assert damping_of(e) == pytest.approx(z, abs=1e-9)


@pytest.mark.parametrize(
    "card", ["STOP w way min=0", "CONTACT w ball 0 line=(1,0)", "CONTACT w ball 0(-2,0) rq=2"]
)
@pytest.mark.parametrize(
    ("e", "n", "v"), [(0.9, 1, 2.0), (0.7, 1.5, 0.1), (0.5, 2, 30.0), (0.3, 1, 1.0), (1, 1, 1.0)]
)
def test_a_wall_gives_back_that_share_of_the_speed(card, e, n, v):
    r = emsim.run(WALL.format(card=card, e=e, n=n, v=v, until=3.0 / v))
    assert r["vel(way)"][-1] == pytest.approx(e * v, rel=1e-7)
    assert np.min(r["force(w)"]) > -1e-8 and r["hits(w)"][-1] == 1.0 and r["mode(w)"][-1] == 0.0


def test_a_damper_that_a_touch_has_does_not_pull():
    """With k d + c d' alone the last part of the touch would hold the mass back."""
    deck = WALL.format(card="STOP w way min=0", e=1, n=1, v=1.0, until=3.0).replace(" e=1", " c=200")
    r = emsim.run(deck)
    assert np.min(r["force(w)"]) > -1e-8
    assert 0.0 < r["vel(way)"][-1] < 0.5


def test_a_ball_in_a_ring_stays_inside():
    r = emsim.run("""ball in a ring
.gravity 9.81
BODY ball m=0.2 j=1e-4 x=0.3 y=0
CONTACT ring ball 0 r=0.1 rq=-0.6 k=1meg e=1
.options reltol=1e-8
.tran 10m 3
.print tran x(ball) y(ball) gap(ring) energy()
.end
""")
    assert np.min(r["gap(ring)"]) > -0.01 and np.max(np.hypot(r["x(ball)"], r["y(ball)"])) < 0.51
    assert np.ptp(r["energy()"]) < 1e-6


def test_balls_that_meet_share_their_momentum():
    """A head-on collision: v1' = (m1 - e m2) v/(m1 + m2), v2' = (1 + e) m1 v/(m1 + m2)."""
    r = emsim.run("""two balls
BODY a m=1 j=1m vx=2
BODY b m=3 j=3m x=1
CONTACT hit b a r=0.2 rq=0.3 k=100k e=0.6 n=1.5
.options reltol=1e-9
.tran 10m 1
.print tran vx(a) vx(b) hits(hit)
.end
""")
    assert r["vx(a)"][-1] == pytest.approx((1 - 0.6 * 3) * 2 / 4, rel=1e-6)
    assert r["vx(b)"][-1] == pytest.approx(1.6 * 2 / 4, rel=1e-6)


def test_the_balance_of_energy_counts_what_a_touch_takes():
    r = emsim.run(WALL.format(card="STOP w way min=0", e=0.5, n=1, v=2.0, until=1.5))
    line = next(x for x in r.energy.lines if x.name == "w")
    assert line.dissipated == pytest.approx(0.5 * 0.3 * 2.0**2 * (1 - 0.5**2), rel=1e-6)
    assert abs(r.energy.residual) < 1e-8


@pytest.mark.parametrize(
    ("card", "code", "words"),
    [
        ("STOP w way min=1 max=0 k=1", "E238", "nothing is left between them"),
        ("STOP w way min=0 k=1 e=1.2", "E238", "part with more energy"),
        ("STOP w way min=0 k=1 e=0.5 c=1", "E240", "both c= and e="),
        ("STOP w way min=0 c=1", "E240", "belongs to k="),
        ("STOP w way min=0 k=-1", "E238", "must be greater"),
        ("CONTACT w ball 0(0,0) k=1", "E230", "line=, a straight part, and rq="),
        ("SHAPE f 0 box(1,1) at=(0,-9)\nCONTACT w ball f k=1", "E235", "has no shape that could be touched"),
        ("CONTACT w ball 0 k=1 line=(0,0)", "E232", "direction"),
        ("CONTACT w ball 0 k=1 rq=-1 r=2", "E238", "does not go into a ring"),
    ],
)  # fmt: skip
def test_a_touch_that_cannot_be_is_told(card, code, words):
    deck = WALL.format(card=card + ";", e=1, n=1, v=1, until=1)
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(deck)
    said = [d for d in error.value.diagnostics if d.severity == "error"]
    assert [d.code for d in said] == [code] and words in said[0].message, said


@pytest.mark.parametrize("reltol", [1e-3, 1e-5, 1e-8])
def test_a_damped_touch_asks_for_its_sign_while_parts_touch(reltol: float) -> None:
    """Two events a touch, and one where its damper would pull; none while the parts are apart."""
    r = emsim.run(
        "two stops\n.gravity 9.81\nBODY b m=1 j=0 com=(0,-1)\nJOINT p 0 b pin ic=.6\n"
        "STOP s p min=-0.1 max=0.7 k=1e5 e=0.5\n.save all hits(s)\n"
        f".options reltol={reltol}\n.tran 1m 10\n.end\n"
    )
    assert not r.diagnostics
    assert r["hits(s)"][-1] == 6
    assert r.stats["events"] <= 3 * 6
    assert abs(r["angle(p)"][-1] + 0.0123212179) < 10 * reltol
