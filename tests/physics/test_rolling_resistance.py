"""rolling= and drilling= of CONTACT: moments up to a length times the normal force, beside closed forms."""

from __future__ import annotations

from math import atan, cos, hypot, sin, tan

import numpy as np
import pytest
from machines import problems

import emsim

G = 9.81
R, M, B = 0.1, 1.3, 2e-3
BALL = 0.4 * M * R * R
KINDS = ["", "k=1meg c=300"]
FORMULATIONS = ["", "formulation=absolute"]


def run(cards: str, end: float, prints: str, more: str = ""):
    return emsim.run(f"""rolling and drilling friction
.gravity 9.81
{cards}
.options reltol=1e-8 {more}
.tran 10m {end!r}
.print tran {prints}
.end
""")


def spent(r, name: str) -> float:
    return next(line for line in r.energy.lines if line.name == name).dissipated


@pytest.mark.parametrize("more", FORMULATIONS)
@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("way", [None, 0.0, 0.7, 2.2, 4.4])
def test_a_ball_that_rolls_slows_evenly_until_it_rests(way, law, more):
    """m v' = -T and J w' = r T - b m g with w = v/r: v' = -b g/(r (1 + J/(m r^2)))."""
    v = 0.5
    slows = B * G / (R * 1.4)
    y = R - (M * G / 1e6 if law else 0.0)
    if way is None:
        ball, line = f"j={BALL!r} vx={v} omega={-v / R}", "line=(0,1)"
        prints = "vx(ball) rolling(floor)"
    else:
        vx, vz = v * cos(way), v * sin(way)
        ball = f"j=({BALL!r},{BALL!r},{BALL!r}) vx={vx!r} vz={vz!r} omega=({vz / R!r},0,{-vx / R!r})"
        line, prints = "line=(0,1,0)", "vx(ball) vz(ball) rolling(floor)"
    cards = f"BODY ball m={M} y={y!r} {ball}\nCONTACT floor ball 0 {line} r={R} mu=0.5 rolling={B} {law}"
    r = run(cards, 4.5, prints, more)
    t = np.asarray(r.time)
    speed = np.maximum(v - slows * t, 0.0)
    if way is None:
        assert np.asarray(r["vx(ball)"]) == pytest.approx(speed, abs=2e-6)
    else:
        assert np.asarray(r["vx(ball)"]) == pytest.approx(cos(way) * speed, abs=2e-6)
        assert np.asarray(r["vz(ball)"]) == pytest.approx(sin(way) * speed, abs=2e-6)
    moves = (t > 0.01) & (t < v / slows - 0.01)
    assert np.abs(np.asarray(r["rolling(floor)"])[moves]) == pytest.approx(B * M * G, rel=1e-5)
    assert spent(r, "floor") == pytest.approx(0.7 * M * v * v, rel=1e-6)
    assert abs(r.energy.residual) < 1e-7


@pytest.mark.parametrize("more", FORMULATIONS)
@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("shape", [False, True])
def test_a_ball_that_spins_about_its_normal_stops(shape, law, more):
    """J w' = -b m g: it stops after w J/(b m g)."""
    w = 7.0
    y = R - (M * G / 1e6 if law else 0.0)
    at = "shape=ball(0.1)\nSHAPE ground 0 plane(0,1,0)\nCONTACT floor ball ground" if shape else ""
    at = at or "\nCONTACT floor ball 0 line=(0,1,0) r=0.1"
    cards = f"BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) y={y!r} omega=(0,{w},0) {at} drilling={B} {law}"
    ends = w * BALL / (B * M * G)
    r = run(cards, 2.0, "ke(ball) drilling(floor)", more)
    t = np.asarray(r.time)
    left = np.maximum(1.0 - t / ends, 0.0)
    assert np.asarray(r["ke(ball)"]) == pytest.approx(0.5 * BALL * w * w * left**2, abs=2e-7)
    moves = (t > 0.01) & (t < ends - 0.01)
    assert np.asarray(r["drilling(floor)"])[moves] == pytest.approx(-B * M * G, rel=1e-5)


@pytest.mark.parametrize("law", KINDS)
@pytest.mark.parametrize("space", [False, True])
@pytest.mark.parametrize("more", FORMULATIONS)
def test_a_ball_stays_on_a_slope_below_b_by_r(more, space, law):
    """It stays where tan(a) < b/r, and else rolls with g (sin a - b/r cos a)/1.4."""
    b = 0.02
    for factor in (0.99, 1.5):
        a = atan(factor * b / R)
        high = R - (M * G * cos(a) / 1e6 if law else 0.0)
        j = f"({BALL!r},{BALL!r},{BALL!r})" if space else repr(BALL)
        line = f"{sin(a)!r},{cos(a)!r}" + (",0" if space else "")
        cards = f"BODY ball m={M} j={j} x={high * sin(a)!r} y={high * cos(a)!r}\n"
        cards += f"CONTACT slope ball 0 line=({line}) r={R} mu=0.9 rolling={b} {law}"
        r = run(cards, 1.0, "vx(ball) vy(ball) rolling(slope)", more)
        speed = hypot(r["vx(ball)"][-1], r["vy(ball)"][-1])
        if factor < 1.0:
            assert speed < 1e-7
            assert abs(r["rolling(slope)"][-1]) == pytest.approx(M * G * R * sin(a), rel=1e-5)
        else:
            assert speed == pytest.approx(G * (sin(a) - b / R * cos(a)) / 1.4, rel=1e-6)


@pytest.mark.parametrize("shapes", [False, True])
@pytest.mark.parametrize("space", [False, True])
def test_a_ball_rests_beside_the_top_of_another_one(space, shapes):
    """m g r sin(phi) about the place of touch against b m g cos(phi): it stays where tan(phi) < b/r, though that is a hill."""
    b, big = 0.02, 0.3
    for factor in (0.99, 1.02):
        phi = atan(factor * b / R)
        high = R + big
        j = f"({BALL!r},{BALL!r},{BALL!r})" if space else repr(BALL)
        kind = "ball" if space else "disc"
        cards = f"BODY ball m={M} j={j} x={high * sin(phi)!r} y={high * cos(phi)!r} z=0"
        if not space:
            cards = cards.removesuffix(" z=0")
        if shapes:
            cards += f" shape={kind}({R})\nSHAPE hill 0 {kind}({big})\nCONTACT c ball hill mu=0.9 rolling={b}"
        else:
            cards += f"\nCONTACT c ball 0 r={R} rq={big} mu=0.9 rolling={b}"
        r = run(cards, 1.0, "x(ball) vx(ball) rolling(c)")
        assert (abs(r["vx(ball)"][-1]) < 1e-7) == (factor < 1.0)
        if factor > 1.0:
            assert r["x(ball)"][-1] > high * sin(phi) + 1e-3


def test_without_sliding_friction_rolling_takes_the_turning_alone():
    w, v = 5.0, 1.0
    cards = f"BODY ball m={M} j={BALL!r} y={R} vx={v} omega={w}\nCONTACT floor ball 0 line=(0,1) r={R} rolling={B}"
    r = run(cards, 2.0, "vx(ball) omega(ball)")
    t = np.asarray(r.time)
    assert np.asarray(r["vx(ball)"]) == pytest.approx(v, abs=1e-9)
    assert np.asarray(r["omega(ball)"]) == pytest.approx(np.maximum(w - B * M * G / BALL * t, 0.0), abs=1e-6)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_an_impact_takes_a_moment_of_its_impulse(e):
    """What is dropped from h has the impulse m v (1 + e), and loses b times that of its spin, in the instant."""
    h, w = 0.2, 9.0
    v = (2 * G * h) ** 0.5
    inertia = f"({BALL!r},{BALL!r},{BALL!r})"
    cards = f"BODY ball m={M} j={inertia} y={R + h!r} omega=(0,{w},0)\n"
    cards += f"CONTACT floor ball 0 line=(0,1,0) r={R} e={e} drilling={B}"
    # just after the impact, before what follows: in the air, or within a time in which the weight takes b g M dt
    at = v / G + 1e-3
    r = run(cards, at, "ke(ball) vy(ball)")
    spin = w - B * M * v * (1 + e) / BALL - (0.0 if e else B * M * G * 1e-3 / BALL)
    lifts = e * v - (G * 1e-3 if e else 0.0)
    assert r["ke(ball)"][-1] == pytest.approx(0.5 * BALL * spin**2 + 0.5 * M * lifts**2, rel=1e-6)


def test_a_thin_disc_rolls_on_its_rim_against_it():
    """A hoop's inertia: m r^2 about its axle."""
    v, j = 0.5, M * R * R
    cards = f"BODY wheel m={M} j=({j / 2!r},{j / 2!r},{j!r}) y={R} vx={v} omega=(0,0,{-v / R})\n"
    cards += f"CONTACT floor wheel 0 line=(0,1,0) r={R} axis=(0,0,1) mu=0.5 rolling={B}"
    r = run(cards, 2.0, "vx(wheel)")
    assert r["vx(wheel)"][-1] == pytest.approx(v - 2.0 * B * G / (2 * R), abs=2e-6)


BOX = "BODY b m=1 y=0.5 shape=box(0.2,0.2,0.2) j=(1,1,1)\nSHAPE f 0 plane(0,1,0)\nCONTACT c b f mu=0.5 "
FLAT = "BODY b m=1 y=0.5 shape=box(0.2,0.2)\nSHAPE f 0 box(2,0.2)\nCONTACT c b f mu=0.5 "
DISC = f"BODY ball m={M} j=0.01 y={R}\nCONTACT floor ball 0 line=(0,1) r={R} mu=0.2 "


@pytest.mark.parametrize(
    ("cards", "code", "words"),
    [
        (
            BOX + "rolling=1m",
            "E240",
            "rolling= of CONTACT c: box(..) of b and plane(..) of f touch at several places",
        ),
        (BOX + "drilling=1m", "E240", "drilling= of CONTACT c"),
        (FLAT + "rolling=1m", "E240", "several places"),
        (DISC + "drilling=1m", "N233", "its parts cannot turn about the normal"),
        (DISC + "rolling=-1m", "E238", "rolling"),
    ],
)
def test_what_does_not_allow_it_is_told(cards, code, words):
    assert any(d.code == code and words in d.message for d in problems(cards))


def test_where_tilt_is_just_below_and_above_in_any_direction():
    """The circle of both directions: what is held does not hang on the way the slope goes down."""
    b = 0.02
    for way in np.linspace(0.1, 6.0, 5):
        for factor, stays in ((0.999, True), (1.002, False)):
            a = atan(factor * b / R)
            n = [sin(a) * cos(way), cos(a), sin(a) * sin(way)]
            cards = f"BODY ball m={M} j=({BALL!r},{BALL!r},{BALL!r}) x={R * n[0]!r} y={R * n[1]!r} z={R * n[2]!r}\n"
            cards += (
                f"CONTACT slope ball 0 line=({n[0]!r},{n[1]!r},{n[2]!r}) r={R} mu={tan(0.5)!r} rolling={b}"
            )
            r = run(cards, 0.5, "vx(ball) vy(ball) vz(ball)")
            speed = hypot(*(r[f"v{c}(ball)"][-1] for c in "xyz"))
            assert (speed < 1e-8) == stays
