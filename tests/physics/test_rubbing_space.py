"""CONTACT with mu= where parts slide in two directions: the circle of Coulomb's law, beside closed forms."""

from __future__ import annotations

from math import atan, cos, sin, tan

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import emsim

G = 9.81
R, M = 0.1, 1.3
BALL = 0.4 * M * R * R
KINDS = ["", "k=1meg c=300"]


def line_of(r, name: str):
    return next(line for line in r.energy.lines if line.name == name)


@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("mu", [0.4, 0.25])
def test_a_block_pushed_sideways_on_an_incline_turns_down(law, mu):
    """v' = g sin(a) down - mu g cos(a) v/|v|: from across the slope it turns down; with mu above tan(a) it comes to rest."""
    a = 0.3
    down, across = np.array([-cos(a), -sin(a), 0.0]), np.array([0.0, 0.0, 1.0])
    sinks = 2 * G * cos(a) / 1e6 if law else 0.0
    r = emsim.run(f"""a block pushed across a slope
.gravity 9.81
BODY block m=2 j=(0.01,0.01,0.01) x={sinks * sin(a)!r} y={-sinks * cos(a)!r} vz=2
CONTACT ground block 0 line=({-sin(a)!r},{cos(a)!r},0) mu={mu} {law}
.options reltol=1e-8
.tran 10m 2
.print tran x(block) y(block) z(block) vx(block) vy(block) vz(block) slip(ground) mode(ground) friction(ground)
.end
""")
    t = np.asarray(r.time)
    held = mu * G * cos(a)

    def rates(_, s):
        v = s[2:]
        return [*v, *(np.array([G * sin(a), 0.0]) - held * v / np.hypot(*v))]

    def rests(_, s):
        return np.hypot(*s[2:]) - 1e-6

    rests.terminal = True
    exact = solve_ivp(
        rates, (0, 2), [0, 0, 0, 2], "DOP853", rtol=1e-12, atol=1e-13, events=rests, dense_output=True
    )
    ends = exact.t[-1] if mu > tan(a) else 2.0
    assert (ends < 2) == (mu > tan(a))
    places = exact.sol(np.minimum(t, ends))
    x = np.array([r[f"{c}(block)"] for c in "xyz"])
    assert down @ x == pytest.approx(places[0], abs=2e-7)
    assert across @ x == pytest.approx(places[1], abs=2e-7)
    if mu > tan(a):
        assert r["mode(ground)"][-1] == 1 and r["slip(ground)"][-1] < 1e-9
        assert r["friction(ground)"][-1] == pytest.approx(2 * G * sin(a), rel=1e-6)
    else:
        assert r["mode(ground)"][-1] == 2
        assert r["friction(ground)"][-1] == pytest.approx(2 * held, rel=1e-6)


@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("way", [0.0, 0.4, 1.1, 2.9, 4.0, 5.5])
def test_a_block_is_held_up_to_the_edge_of_the_circle(law, way):
    """A slope that goes down in any direction holds what lies on it while mu > tan(a)."""
    a = 0.3
    n = [sin(a) * cos(way), cos(a), sin(a) * sin(way)]
    for more, stays in ((1e-6 if not law else 1e-4, True), (-1e-3, False)):
        mu, sinks = tan(a) * (1 + more), (2 * G * cos(a) / 1e6 if law else 0.0)
        r = emsim.run(f"""on a slope
.gravity 9.81
BODY block m=2 j=(0.01,0.01,0.01) x={-sinks * n[0]!r} y={-sinks * n[1]!r} z={-sinks * n[2]!r}
CONTACT ground block 0 line=({n[0]!r},{n[1]!r},{n[2]!r}) mu={mu!r} {law}
.options reltol=1e-7
.tran 10m 1
.print tran x(block) z(block) mode(ground) slip(ground)
.end
""")
        x, z = r["x(block)"][-1], r["z(block)"][-1]
        gone = G * (sin(a) - mu * cos(a)) / 2 * cos(a)
        if stays:
            assert np.hypot(x, z) < (1e-12 if not law else 1e-5) and r["mode(ground)"][-1] == 1
        else:
            assert [x, z] == pytest.approx(
                [gone * cos(way), gone * sin(way)], rel=1e-5 if not law else 1e-2, abs=1e-8
            )
            assert r["mode(ground)"][-1] == 2


@pytest.mark.parametrize("law", ["", "e=0.4", *KINDS[1:]])
@pytest.mark.parametrize(
    ("v", "w"), [((5, 0), (0, 0, 0)), ((3, -1), (20, 7, 30)), ((2, 0), (-30, 0, 20)), ((0, 0), (5, 2, -9))]
)
def test_a_ball_with_spins_comes_to_roll(law, v, w):
    """While it slides its path is a parabola, v = v0 - mu g t u/|u|; it rolls from 2 |u|/(7 mu g) on, with v0 - 2/7 u."""
    mu = 0.2
    v, w = np.array([v[0], 0.0, v[1]]), np.array(w, dtype=float)
    u = v + np.cross(w, [0, -R, 0])
    sinks = M * G / 1e6 if law.startswith("k") else 0.0
    r = emsim.run(f"""a ball on a floor
.gravity 9.81
BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) y={R - sinks!r} vx={v[0]} vz={v[2]} omega=({w[0]},{w[1]},{w[2]})
CONTACT floor ball 0 line=(0,1,0) r={R} mu={mu} {law}
.options reltol=1e-7
.tran 10m 3
.print tran x(ball) z(ball) vx(ball) vz(ball) slip(floor) mode(floor) friction(floor)
.end
""")
    t = np.asarray(r.time)
    rolls = 2 * np.hypot(u[0], u[2]) / (7 * mu * G)
    slowed = mu * G * u / np.linalg.norm(u)
    early = np.minimum(t, rolls)
    place = np.outer(v, t) - np.outer(slowed, early * t - early**2 / 2)
    error = 2e-6 if law.startswith("k") else 1e-7
    assert r["x(ball)"] == pytest.approx(place[0], abs=error)
    assert r["z(ball)"] == pytest.approx(place[2], abs=error)
    assert [r["vx(ball)"][-1], r["vz(ball)"][-1]] == pytest.approx((v - 2 / 7 * u)[[0, 2]], abs=error)
    assert r["slip(floor)"][-1] < 1e-9 and r["friction(floor)"][-1] < 1e-5
    assert r["mode(floor)"][-1] == 1 and r["mode(floor)"][1] == 2
    assert line_of(r, "floor").dissipated == pytest.approx(M * (u @ u) / 7, rel=1e-5)
    assert abs(r.energy.residual) < 1e-5


def test_a_ball_that_rolls_goes_on_rolling():
    r = emsim.run(f"""rolling
.gravity 9.81
BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) y={R} vx=0.3 vz=0.4 omega=({0.4 / R!r},0,{-0.3 / R!r})
CONTACT floor ball 0 line=(0,1,0) r={R} mu=0.01
.options reltol=1e-6
.tran 1 100
.print tran x(ball) z(ball) mode(floor) slip(floor)
.end
""")
    t = np.asarray(r.time)
    for x, v in (("x(ball)", 0.3), ("z(ball)", 0.4)):
        assert r[x] == pytest.approx(v * t, rel=1e-8, abs=1e-8)
    assert np.all(np.asarray(r["mode(floor)"]) == 1) and np.max(r["slip(floor)"]) < 1e-10


@pytest.mark.parametrize(
    ("mu", "w"),
    [(0.5, (20, 5, 30)), (0.05, (20, 5, 30)), (0.5, (0, 0, -30)), (0.02, (60, 3, -80)), (0.3, (0, 9, 0))],
)
def test_a_ball_thrown_with_spins(mu, w):
    """Poisson's law in two phases: in each the impulse along the floor stops the slip or is mu times the one across."""
    e, v = 0.8, np.array([2.0, -3.0, 1.0])
    w = np.array(w, dtype=float)
    r = emsim.run(f"""ball
BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) y=0.4 vx={v[0]} vy={v[1]} vz={v[2]} omega=({w[0]},{w[1]},{w[2]})
CONTACT floor ball 0 line=(0,1,0) r={R} mu={mu} e={e}
.tran 10m 0.15
.print tran vx(ball) vy(ball) vz(ball) ke() impulse(floor)
.end
""")
    easy, along = 1 / M + R * R / BALL, np.zeros(3)
    slip = v + np.cross(w, [0, -R, 0])
    slip[1] = 0.0
    for across in (M * -v[1], e * M * -v[1]):
        size = np.linalg.norm(slip)
        push = -slip / size * min(mu * across, size / easy) if size > 1e-12 else np.zeros(3)
        slip, along = slip + easy * push, along + push
    expected = v + along / M
    assert [r["vx(ball)"][-1], r["vz(ball)"][-1]] == pytest.approx([expected[0], expected[2]], abs=1e-9)
    assert r["vy(ball)"][-1] == pytest.approx(-e * v[1], rel=1e-12)
    after = w + np.cross([0, -R, 0], along) / BALL
    kept = M * (expected[0] ** 2 + (e * v[1]) ** 2 + expected[2] ** 2) / 2 + BALL * (after @ after) / 2
    assert r["ke()"][-1] == pytest.approx(kept, rel=1e-9)
    lost = r["ke()"][0] - r["ke()"][-1]
    assert lost > 0 and line_of(r, "floor").dissipated == pytest.approx(lost, rel=1e-9)


def test_billiard_balls_throw_each_other_in_space():
    """One that spins about any axis meets one at rest head on, e = 1: the other goes off at atan(mu) at most."""
    m, r_, v, mu = 0.17, 0.028, 2.0, 0.06
    j, w = 0.4 * m * r_ * r_, np.array([10.0, 60.0, 45.0])
    r = emsim.run(f"""two balls
BODY cue m={m} j=({j!r},{j!r},{j!r}) vx={v} omega=({w[0]},{w[1]},{w[2]})
BODY object m={m} j=({j!r},{j!r},{j!r}) x=0.2
CONTACT c cue object r={r_} rq={r_} mu={mu} e=1
.tran 1m 0.15
.print tran vx(cue) vy(cue) vz(cue) vx(object) vy(object) vz(object)
.end
""")
    slip = np.cross(w, [r_, 0, 0])
    size = np.linalg.norm(slip)
    along = min(mu * m * v, size / (2 / m + 2 * r_ * r_ / j))
    assert r["vx(object)"][-1] == pytest.approx(v, rel=1e-9) and abs(r["vx(cue)"][-1]) < 1e-9
    thrown = along / m * slip / size
    assert [r["vy(object)"][-1], r["vz(object)"][-1]] == pytest.approx(thrown[1:], rel=1e-9)
    assert [r["vy(cue)"][-1], r["vz(cue)"][-1]] == pytest.approx(-thrown[1:], rel=1e-9)
    assert np.hypot(*thrown[1:]) <= tan(atan(mu)) * v * (1 + 1e-12)


def test_a_ball_in_a_bowl_rolls_around():
    """Around the axis at a polar angle p: with the inertia of rolling 7/5 m, (7/5) W^2 (D sin p) = g tan p and no spin across."""
    big, p = 0.6, 0.5
    d = big - R
    turns = (G / (1.4 * d * cos(p))) ** 0.5
    v = turns * d * sin(p)
    r = emsim.run(f"""around a bowl
.gravity 9.81
BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) x={d * sin(p)!r} y={-d * cos(p)!r} vz={v!r}
+ omega=({v / R * cos(p)!r},{v / R * sin(p)!r},0)
CONTACT bowl ball 0 r={R} rq={-big} mu=0.9
.options reltol=1e-8
.tran 10m 2
.print tran x(ball) y(ball) z(ball) slip(bowl) energy() friction(bowl) force(bowl) mode(bowl)
.end
""")
    t = np.asarray(r.time)
    assert r["x(ball)"] == pytest.approx(d * sin(p) * np.cos(turns * t), abs=1e-6)
    assert r["z(ball)"] == pytest.approx(d * sin(p) * np.sin(turns * t), abs=1e-6)
    assert r["friction(bowl)"] == pytest.approx(M * G * sin(p) * (1 - 1 / 1.4), rel=1e-5)
    assert np.all(np.asarray(r["mode(bowl)"]) == 1) and np.ptp(r["energy()"]) < 1e-6
