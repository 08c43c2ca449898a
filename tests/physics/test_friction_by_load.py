"""FRICTION mu=: by the load of the joint itself, against closed forms and a second formulation."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import emsim

G = 9.81
EVERY = ("auto", "radau", "esdirk", "trbdf2", "gear", "trap", "dop853")

INCLINE = """block on an incline
.gravity {g}
BODY m m=2 j=1
JOINT s 0 m slide axis=({x},{y}) ic=(0,{v})
FRICTION f s mu={mu} {more}
.options reltol={reltol:g} method={method}
.tran 10m {until}
.print tran force(f) mode(f)
.end
"""


def incline(angle: float, v: float, mu: float, more: str = "", method: str = "auto", until: float = 1.5):
    return emsim.run(
        INCLINE.format(
            g=G,
            x=math.cos(angle),
            y=math.sin(angle),
            v=v,
            mu=mu,
            more=more,
            method=method,
            until=until,
            reltol=1e-7,
        )
    )


@pytest.mark.parametrize("method", EVERY)
def test_a_block_slides_up_an_incline_and_back(method):
    """a = -g (sin + mu cos) upwards, -g (sin - mu cos) back: mu < tan."""
    angle, v, mu = math.pi / 6, 3.0, 0.3
    r = incline(angle, v, mu, method=method)
    up, down = (G * (math.sin(angle) + sign * mu * math.cos(angle)) for sign in (1, -1))
    turn, top = v / up, v * v / (2 * up)
    tolerance = 1e-3 if method == "trap" else 2e-5
    assert r["pos(s)"][-1] == pytest.approx(top - 0.5 * down * (1.5 - turn) ** 2, abs=tolerance)
    assert r["mode(f)"][-1] == -1.0
    assert r["force(f)"][-1] == pytest.approx(mu * 2 * G * math.cos(angle), rel=1e-6)


@pytest.mark.parametrize("method", EVERY)
def test_it_stays_at_the_top_where_mu_is_more_than_the_slope(method):
    angle, v, mu = 0.4, 2.0, 0.5
    r = incline(angle, v, mu, method=method)
    up = G * (math.sin(angle) + mu * math.cos(angle))
    tolerance = 1e-3 if method == "trap" else 2e-5
    assert r["pos(s)"][-1] == pytest.approx(v * v / (2 * up), abs=tolerance)
    assert r["mode(f)"][-1] == 0.0 and abs(r["vel(s)"][-1]) < 1e-12
    assert r["force(f)"][-1] == pytest.approx(2 * G * math.sin(angle), rel=1e-6)


@pytest.mark.parametrize(("slope", "goes"), [(0.49, False), (0.51, True)])
def test_what_rests_is_held_by_mus(slope, goes):
    """It lets go at tan = mus and then slides with mu."""
    r = incline(math.atan(slope), 0.0, 0.3, "mus=0.5", until=1.0)
    a = G * (slope - 0.3) / math.sqrt(1 + slope**2)
    assert r["pos(s)"][-1] == pytest.approx(-0.5 * a if goes else 0.0, abs=1e-5)


@pytest.mark.parametrize("method", EVERY)
def test_a_wheel_coasts_to_rest_on_its_pin(method):
    """J dw/dt = -mu m g radius, exactly to rest."""
    r = emsim.run(
        f"""wheel
.gravity {G}
BODY w m=5 j=0.1
JOINT p 0 w pin ic=(0,8)
FRICTION f p mu=0.2 radius=20m
.options reltol=1e-7 method={method}
.tran 10m 6
.print tran torque(f) mode(f) fx(p) fy(p)
.end
"""
    )
    brake = 0.2 * 5 * G * 0.02
    assert r["angle(p)"][-1] == pytest.approx(0.1 * 64 / (2 * brake), rel=1e-4)
    assert abs(r["omega(p)"][-1]) < 1e-12 and r["mode(f)"][-1] == 0.0
    early = int(np.searchsorted(np.asarray(r.time), 2.0))
    assert r["torque(f)"][early] == pytest.approx(-brake, rel=1e-7)
    assert abs(r.energy.residual) < 1e-4


def test_a_slide_in_space_counts_both_directions_across_it():
    r = emsim.run(
        """slide in space
.gravity 0 -3 -4
BODY m m=2 j=(1,1,1)
JOINT s 0 m slide axis=(1,0,0) ic=(0,3)
FRICTION f s mu=0.3
.options reltol=1e-8
.tran 10m 1
.print tran force(f)
.end
"""
    )
    assert r["pos(s)"][-1] == pytest.approx(3 - 0.5 * 0.3 * 5, rel=1e-7)
    assert r["force(f)"][-1] == pytest.approx(-3.0, rel=1e-7)


def test_a_push_within_the_cone_of_friction_moves_nothing():
    """At an angle b from the guide's normal: tan b < mu holds however hard it is, tan b > mu lets it go."""
    for b, holds in ((0.25, True), (0.35, False)):
        r = emsim.run(
            f"""push
.gravity 0
BODY m m=1 j=1
JOINT s 0 m slide axis=(1,0)
FRICTION f s mu=0.3
FORCE push m dir=({math.sin(b)},{-math.cos(b)}) 100
.options reltol=1e-7
.tran 1m 0.2
.print tran mode(f) force(f)
.end
"""
        )
        a = 100 * (math.sin(b) - 0.3 * math.cos(b))
        assert r["pos(s)"][-1] == pytest.approx(0.0 if holds else 0.5 * a * 0.04, abs=1e-7)
        assert abs(r["force(f)"][-1]) == pytest.approx(100 * min(math.sin(b), 0.3 * math.cos(b)), rel=1e-6)


CRANK = """slider-crank coasting to rest, its piston rubs by its own load
.gravity 9.81
BODY crank m=1 j=0.01
BODY rod shape=rod(0.3) m=0.5
BODY p m=1 j=1e-3
JOINT a 0 crank pin ic=(0.5,30)
JOINT b crank(0.1,0) rod pin
JOINT c rod(0.3,0) p pin
JOINT s 0 p slide axis=(1,0) {cut}
FRICTION f s {friction}
.options reltol={reltol:g} method={method}
.tran 1m 4
.end
"""
FOUND = Path(__file__).parent / "refs" / "fric_slider_crank_mu.csv"


@pytest.mark.parametrize("method", ["auto", "radau"])
@pytest.mark.parametrize(("reltol", "error"), [(1e-5, 5e-5), (1e-7, 1e-7), (1e-9, 1e-8)])
def test_slider_crank_coasts_to_rest(method, reltol, error):
    """The guide's load follows from the motion and from the friction; at 30 events in the closed loop the error falls with
    the tolerance (reference: refs/fric_slider_crank_mu, another formulation)."""
    with FOUND.open() as f:
        lines = [line for line in f if not line.startswith("#")]
    rows = np.array([[float(v) for v in row] for row in csv.reader(lines[1:])])
    r = emsim.run(CRANK.format(cut="", friction="mu=0.15", reltol=reltol, method=method))
    assert np.abs(r.at("angle(a)", rows[:, 0]) - rows[:, 1]).max() < error
    assert r.stats["events"] < 45 and abs(r["omega(a)"][-1]) < 1e-4
    assert abs(r.energy.residual) < max(1e-6, 10 * reltol)


def test_a_card_reads_what_a_joint_transmits_that_closes_a_loop():
    """Read before there were multipliers it ended in an internal error."""
    by_hand, by_card = (
        emsim.run(CRANK.format(cut="", friction=friction, reltol=1e-7, method="auto"))
        for friction in ("fc={0.15*abs(fy(s))}", "mu=0.15")
    )
    assert by_hand["angle(a)"][-1] == pytest.approx(by_card["angle(a)"][-1], abs=1e-6)


@pytest.mark.parametrize(
    ("joint", "card", "code", "words"),
    [
        ("pin", "mu=0.3", "E230", "radius="), ("weld", "mu=0.3", "E2", ""), ("pin", "", "E", ""),
    ],
)  # fmt: skip
def test_a_load_that_is_none_is_told(joint, card, code, words):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"t\nBODY m m=1 j=1\nJOINT h 0 m {joint}\nFRICTION f h {card}\n.tran 1m 1\n.end\n")
    said = [d for d in error.value.diagnostics if d.severity == "error"]
    assert said[0].code.startswith(code) and words in said[0].message, said
