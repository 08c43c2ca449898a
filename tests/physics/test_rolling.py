"""Rows of speeds: what rolls without slip (ROLL) and what goes along its edge alone (KNIFE), in the plane and in space."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim
from emsim import pipeline

G = 9.81
TOLERANCES = [1e-3, 1e-6, 1e-9]
FORMULATIONS = ["joint", "absolute"]


def codes(r):
    return [d.code for d in r.diagnostics]


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("reltol", TOLERANCES)
def test_a_wheel_rolls_down_an_incline(formulation, reltol):
    """a = g sin/(1 + J/(m r^2)); the ground holds it back with m (g sin - a) and up with m g cos."""
    r = pipeline.run(
        f"""wheel on an incline of 30 degrees
BODY w m=2 j=0.03 x={{0.2*sin(pi/6)}} y={{0.2*cos(pi/6)}}
ROLL c w 0 r=0.2 line=({{sin(pi/6)}},{{cos(pi/6)}})
.gravity {G}
.options formulation={formulation} reltol={reltol}
.tran 10m 1
.print tran x(w) angle(w) force(c) friction(c)
.end
""",
        energy=True,
    )
    a = G * 0.5 / (1.0 + 0.03 / (2.0 * 0.04))
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["x(w)"], 0.1 + 0.5 * a * t * t * math.cos(math.pi / 6), atol=1e-9)
    np.testing.assert_allclose(r["angle(w)"], -0.5 * a * t * t / 0.2, atol=1e-9)
    np.testing.assert_allclose(r["force(c)"], 2.0 * G * math.cos(math.pi / 6), rtol=1e-7)
    np.testing.assert_allclose(r["friction(c)"], -2.0 * (0.5 * G - a), rtol=1e-6)
    assert r.energy.share < 1e-12


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("reltol", "off"), [*zip(TOLERANCES, [1e-3, 1e-6, 1e-9], strict=True)])
def test_chaplygins_sleigh_turns_its_mass_to_the_front(formulation, reltol, off):
    """u' = a w^2, (J + m a^2) w' = -m a u w of the blade's speed and the turn: u = V tanh(a V t/k^2 + c), w = V/k sech(..),
    k^2 = J/m + a^2 (Chaplygin 1911; Neimark and Fufaev, Dynamics of Nonholonomic Systems, ch. 3)."""
    a, m, j, u0, w0 = 0.3, 2.0, 0.5, -1.0, 2.0
    r = pipeline.run(
        f"""sleigh, blade at its origin, set off backwards
BODY s m={m} j={j} com=({a},0) vx={u0} vy=0 omega={w0}
KNIFE k s 0 along=(1,0)
.options formulation={formulation} reltol={reltol}
.tran 10m 3
.probe vx(s) vy(s) angle(s) omega(s) force(k)
.end
""",
        energy=True,
    )
    k = math.sqrt(j / m + a * a)
    v = math.hypot(u0, k * w0)
    phase = a * v * np.asarray(r["time"]) / k**2 + math.atanh(u0 / v)
    angle = np.asarray(r["angle(s)"])
    u = np.asarray(r["vx(s)"]) * np.cos(angle) + np.asarray(r["vy(s)"]) * np.sin(angle)
    w = v / k / np.cosh(phase)
    np.testing.assert_allclose(u, v * np.tanh(phase), atol=3.0 * off)
    np.testing.assert_allclose(r["omega(s)"], w, atol=10.0 * off)
    # across: m (u w + a w') of the centre of mass
    slope = -m * a * v * np.tanh(phase) * w / (m * k * k)
    np.testing.assert_allclose(r["force(k)"], m * (v * np.tanh(phase) * w + a * slope), atol=100.0 * off)
    assert abs(r.energy.share) < off


@pytest.mark.parametrize(
    ("method", "off"),
    [
        *((method, 2e-6) for method in ("auto", "dop853", "rk45", "radau", "gauss4", "esdirk", "gear")),
        *((method, 4e-5) for method in ("trbdf2", "trap")),
    ],
)
def test_a_skate_on_a_slope_goes_along_a_cycloid(method, off):
    """It turns at a constant rate and comes back to its height: no potential decides where it goes."""
    g, w, m = 4.0, 3.0, 1.5
    r = emsim.run(
        f"""skate on a slope, seen from above
BODY k m={m} j=0.02 omega={w}
KNIFE e k 0 along=(1,0)
.gravity {g}
.options reltol=1e-7 method={method}
.tran 10m 3
.print tran x(k) y(k) force(e)
.end
"""
    )
    t = np.asarray(r["time"])
    x = g / w * (t / 2 + np.sin(2 * w * t) / (4 * w) - np.sin(w * t) / w)
    y = g / w * (np.sin(w * t) ** 2 / 2 - (1 - np.cos(w * t))) / w
    np.testing.assert_allclose(r["x(k)"], x, atol=off)
    np.testing.assert_allclose(r["y(k)"], y, atol=off)
    np.testing.assert_allclose(r["force(e)"], m * g * (2 * np.cos(w * t) - 1), atol=2e-3)


# a disc of mass M and radius R; moments A about a diameter, C about its axis
M, R = 2.0, 0.3
A, C = M * R * R / 4, M * R * R / 2
DISC = """a thin disc rolls on the ground
BODY d m={m!r} j=({a!r},{c!r},{a!r}) y={y!r} z={z!r} rot=({lean!r},0,0) {start}
ROLL c d 0 r={r!r} axis=(0,1,0) line=(0,0,1)
.gravity 0 0 -9.81
.options {options}
.tran 10m {until!r}
.print tran x(d) y(d) z(d) force(c) friction(c) friction(c,1) friction(c,2)
.end
"""


def disc(lean, start, until, options, y=0.0):
    values = {"m": M, "a": A, "c": C, "r": R, "y": y, "z": R * math.cos(lean), "lean": lean}
    return pipeline.run(DISC.format(start=start, until=until, options=options, **values), energy=True)


@pytest.mark.parametrize(
    "options", ["reltol=1e-3", "reltol=1e-6", "reltol=1e-9", "formulation=absolute", "method=radau"]
)
def test_a_disc_rolls_round_in_a_circle(options):
    """The moment of the ground's forces about the centre turns the angular momentum round:
    W^2 = m g r tan(lean)/(A sin(lean) + (C/r + m r) Rc), Rc the radius of the centre's circle."""
    lean, rc = math.radians(20.0), 1.0
    w = math.sqrt(M * G * R * math.tan(lean) / (A * math.sin(lean) + (C / R + M * R) * rc))
    start = f"vx={-w * rc!r} vy=0 vz=0 omega=(0,{-w * rc / R!r},{w * math.cos(lean)!r})"
    r = disc(lean, start, 2.0 * math.pi / w, options, y=rc)
    np.testing.assert_allclose(np.hypot(r["x(d)"], r["y(d)"]), rc, rtol=1e-8)
    np.testing.assert_allclose(r["z(d)"], R * math.cos(lean), rtol=1e-8)
    np.testing.assert_allclose(r["force(c)"], M * G, rtol=1e-6)
    np.testing.assert_allclose(r["friction(c)"], M * w * w * rc, rtol=1e-6)
    np.testing.assert_allclose(np.hypot(r["friction(c,1)"], r["friction(c,2)"]), r["friction(c)"], rtol=1e-9)
    assert r["x(d)"][-1] == pytest.approx(0.0, abs=1e-6)
    assert abs(r.energy.share) < 1e-9


def lean_by_hand(lean, wt, wb, wa, until):
    """The same disc by its own equations, in the axes t (along the ground), b (from the ground to the centre), a (its own):
    H' + Wf x H = -r b x F, F = m (v' + g z), v = w x r b; Wf = (wt, wb, wb tan lean), lean' = -wt."""
    from scipy.integrate import solve_ivp

    def slopes(_, s):
        lean, wt, wb, wa = s
        frame = np.array([wt, wb, wb * math.tan(lean)])
        h = np.cross(frame, [A * wt, A * wb, C * wa])
        v = np.cross(frame, [-R * wa, 0.0, R * wt])
        return [
            -wt,
            (-h[0] - R * M * (v[2] + G * math.sin(lean))) / (A + M * R * R),
            -h[1] / A,
            (-h[2] + R * M * v[0]) / (C + M * R * R),
        ]

    return solve_ivp(slopes, (0.0, until), [lean, wt, wb, wa], method="DOP853", rtol=1e-12, atol=1e-12).y[
        :, -1
    ]


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("reltol", "off"), [*zip(TOLERANCES, [1e-3, 1e-6, 1e-9], strict=True)])
def test_a_disc_that_wobbles_agrees_with_its_own_equations(formulation, reltol, off):
    lean, wb, wa, until = 0.4, 1.0, -6.0, 1.3
    start = f"omega=(0,{wa},{wb})"
    r = disc(lean, start, until, f"formulation={formulation} reltol={reltol}")
    there = lean_by_hand(lean, 0.0, wb, wa, until)
    assert abs(there[0] - lean) > 0.02  # it has moved
    assert r["z(d)"][-1] == pytest.approx(R * math.cos(there[0]), abs=off)
    assert abs(r.energy.share) < off


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize(("reltol", "off"), [*zip(TOLERANCES, [1e-5, 1e-7, 1e-9], strict=True)])
def test_a_ball_on_a_turntable_circles_at_two_sevenths_of_its_rate(formulation, reltol, off):
    """J = 2/5 m r^2: v' = 2/7 W z x v, wherever it is on the table (Earnshaw 1844; Weckesser, Am. J. Phys. 65, 1997)."""
    r = emsim.run(
        f"""ball on a turntable
BODY table m=1 j=(1,1,1)
JOINT axle 0 table pin axis=(0,0,1)
DRIVE d axle qd=7
BODY ball m=0.1 j=(64u,64u,64u) x=0.5 z=0.04 vx=0.2 vy=0.3
ROLL c ball table r=0.04 line=(0,0,1)
.gravity 0 0 -9.81
.options formulation={formulation} reltol={reltol}
.tran 10m {{pi}}
.print tran x(ball) y(ball)
.end
"""
    )
    w, (x0, y0), (vx, vy) = 2.0, (0.5, 0.0), (0.2, 0.3)
    cx, cy = x0 - vy / w, y0 + vx / w
    c, s = np.cos(w * np.asarray(r["time"])), np.sin(w * np.asarray(r["time"]))
    np.testing.assert_allclose(r["x(ball)"], cx + (x0 - cx) * c - (y0 - cy) * s, atol=off)
    np.testing.assert_allclose(r["y(ball)"], cy + (x0 - cx) * s + (y0 - cy) * c, atol=off)


def test_a_wheel_rolls_inside_a_ring():
    """Small swings of a wheel in a ring of radius rq: w^2 = g/((rq - r) (1 + J/(m r^2))), by .modes and by the run."""
    r = emsim.run(
        f"""wheel in a ring
BODY w m=1 j=0.005 x=1m y={{-sqrt(0.4^2-1u)}}
ROLL c w 0 r=0.1 rq=-0.5
.gravity {G}
.options reltol=1e-8
.modes static
.tran 10m 2
.print tran x(w)
.end
"""
    )
    w = math.sqrt(G / (0.4 * 1.5))
    assert max(r.table("modes")["frequency"]) == pytest.approx(w / (2 * math.pi), rel=1e-6)
    run = r.table("tran")
    t = np.asarray(run["time"])
    np.testing.assert_allclose(run["x(w)"], 1e-3 * np.cos(w * t), atol=1e-7)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_wheel_at_rest_has_rolled_there(formulation):
    """A spring turns back what the slope pulls: r c q = m g r sin, q from where it stood; no position says so."""
    r = emsim.run(
        f"""a wheel on a slope of 30 degrees, a clock spring on its axle
BODY cart m=1
BODY w m=1 j=0.01
JOINT s 0(0,0.2) cart slide axis=(1,0)
JOINT axle cart w pin
ROLL c w 0 r=0.2 line=(0,1)
SPRING k axle k=5
.gravity {{{G}*0.5}} {{-{G}*sqrt(0.75)}}
.options formulation={formulation}
.op static
.print op pos(s) angle(axle) friction(c)
.end
"""
    )
    pull = 2.0 * G * 0.5
    assert r["friction(c)"][0] == pytest.approx(-pull, rel=1e-6)
    assert r["angle(axle)"][0] == pytest.approx(-pull * 0.2 / 5.0, rel=1e-6)
    assert r["pos(s)"][0] == pytest.approx(pull * 0.04 / 5.0, rel=1e-6)


BALL = """a ball that is free to turn
BODY b m=0.1 j=(64u,64u,64u) z=0.04 com=({off},0,0)
ROLL c b 0 r=0.04 line=(0,0,1)
{more}
.options reltol=1e-6 formulation={formulation}
.op static
.print op x(b) y(b) z(b) force(c) friction(c)
.end
"""


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_ball_on_a_plane_is_at_rest_where_it_is(formulation):
    """It ended with E411: three speeds of the turn leaned on one coordinate of four."""
    r = emsim.run(BALL.format(off=0, more=".gravity 0 0 -9.81", formulation=formulation))
    assert (r["x(b)"][0], r["y(b)"][0]) == (0.0, 0.0)
    assert r["z(b)"][0] == pytest.approx(0.04, rel=1e-9)
    assert r["force(c)"][0] == pytest.approx(0.981, rel=1e-9)
    assert r["friction(c)"][0] == pytest.approx(0.0, abs=1e-9)


def test_a_ball_in_space_rolls_to_its_rest():
    """With its weight aside it turns by a quarter and goes so far; on a slope a spring holds it, and it has turned by x/r."""
    r = emsim.run(BALL.format(off=0.01, more=".gravity 0 0 -9.81", formulation="joint"))
    assert r["x(b)"][0] == pytest.approx(0.04 * math.pi / 2.0, rel=1e-4)
    spring = "SPRING s b 0(0.1,0,0.04) k=100\n.gravity 1 0 -9.81\n.save all"
    r = emsim.run(BALL.format(off=0, more=spring, formulation="joint"))
    assert r["x(b)"][0] == pytest.approx(0.1 + 0.1 / 100.0, rel=1e-6)
    turned = 0.101 / 0.04
    assert (r["e0(b)"][0], r["e2(b)"][0]) == pytest.approx(
        (math.cos(turned / 2), math.sin(turned / 2)), rel=1e-6
    )
    assert r["friction(c)"][0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_ball_on_a_slope_has_no_rest(formulation):
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(BALL.format(off=0, more=".gravity 1 0 -9.81", formulation=formulation))
    (said,) = error.value.diagnostics
    assert said.code == "E410" and "on a slope there is none for what rolls (c)" in (said.hint or "")


def test_a_wheel_that_would_lift_off_says_so():
    """It goes over a hump of radius 1 m: N = m (g cos - v^2/1.1), below 0 from the start at 4 m/s. At 3.2 m/s from later on."""
    deck = f"""over a hump
BODY w m=1 j=10m y=1.1 vx={{}}
ROLL c w 0 r=0.1 rq=1
.gravity {G}
.tran 1m 0.3
.print tran force(c)
.end
"""
    assert codes(emsim.run(deck.format(1))) == []
    for speed in (3.2, 4):
        r = emsim.run(deck.format(speed))
        assert codes(r) == ["W422"]
        first = np.asarray(r["time"])[np.asarray(r["force(c)"]) < 0][0]
        said = float(r.diagnostics[0].message.partition("t = ")[2].partition(" s")[0])
        assert (said == 0.0) == (speed == 4) and said == pytest.approx(first, abs=2e-3)


@pytest.mark.parametrize("method", ["auto", "radau"])
def test_a_wheel_that_meets_a_wall_rolls_back(method):
    """The ground turns it round in the same instant: what rolls before an impact does so behind it."""
    r = emsim.run(
        f"""a wheel against a wall
BODY w m=1 j=0.01 x=-0.5 y=0.1 vx=2
ROLL c w 0 r=0.1 line=(0,1)
CONTACT wall w 0 line=(-1,0) r=0.1 e=0.5
.gravity {G}
.options reltol=1e-8 method={method}
.tran 10m 0.5
.print tran vx(w) omega(w)
.end
"""
    )
    assert r["vx(w)"][-1] == pytest.approx(-1.0, rel=1e-7)
    assert r["omega(w)"][-1] == pytest.approx(10.0, rel=1e-7)


BICYCLE = """a bicycle (Whipple 1899) by Meijaard, Papadopoulos, Ruina and Schwab, Proc. R. Soc. A 463 (2007), table 1; z up here
.gravity 0 0 -9.81
BODY frame m=85 j=(9.2,11,2.8,0,-2.4,0) com=(0.3,0,0.9) vx={v}
BODY rear m=2 j=(0.0603,0.12,0.0603)
BODY fork m=4 j=(0.05892,0.06,0.00708,0,0.00756,0) com=(-0.2,0,0.7)
BODY front m=3 j=(0.1405,0.28,0.1405)
JOINT jr frame(0,0,0.3) rear pin axis=(0,1,0)
JOINT steer frame(1.1,0,0) fork pin axis=({{-sin(pi/10)}},0,{{cos(pi/10)}})
JOINT jf fork(-0.08,0,0.35) front pin axis=(0,1,0)
ROLL rr rear 0 r=0.3 axis=(0,1,0) line=(0,0,1)
ROLL rf front 0 r=0.35 axis=(0,1,0) line=(0,0,1)
.modes
.end
"""


# its matrices for lean and steer, M q" + v C1 q' + (g K0 + v^2 K2) q = 0 (eq. 5.4 there)
BY_HAND = {
    "M": [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]],
    "C1": [[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]],
    "K0": [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]],
    "K2": [[0.0, 76.59734589573222], [0.0, 2.65431523794604]],
}


def bicycle_by_hand(v):
    """Eigenvalues of the published matrices."""
    m, c, k0, k2 = (np.array(BY_HAND[name]) for name in ("M", "C1", "K0", "K2"))
    stiffness, damping = np.linalg.solve(m, G * k0 + v * v * k2), np.linalg.solve(m, v * c)
    return np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -damping]]))


def found_modes(r):
    """Eigenvalues with Im >= 0."""
    return [complex(-rate, 2.0 * math.pi * f) for rate, f in zip(r["rate"], r["frequency"], strict=True)]


@pytest.mark.parametrize("v", [0, 2, 5, 8])
def test_a_bicycle_steers_itself(v):
    """Weave, capsize and caster are those of the benchmark, at speeds where it falls, weaves, rights itself and capsizes."""
    wanted = [s for s in bicycle_by_hand(v) if s.imag >= 0.0]
    assert (max(s.real for s in wanted) < 0.0) == (v == 5)  # table 2: it is stable from 4.29 to 6.02 m/s
    r = emsim.run(BICYCLE.format(v=v))
    found = found_modes(r)
    for s in wanted:
        assert min(abs(s - other) for other in found) < 1e-6 * abs(s)
    moving = [s for s in found if abs(s) > 1e-3]
    assert len(moving) == len(wanted)
    assert "W306" not in codes(r)


# upright, and so slight a frame about it that the coordinates of the wheel do not turn
ROLLING = """a disc that rolls straight ahead
.gravity 0 0 -9.81
{frame}
BODY d m={m!r} j=({a!r},{c!r},{a!r}) {start}
{axle}
ROLL k d 0 r={r!r} axis=(0,1,0) line=(0,0,1)
.modes
.end
"""


def test_a_disc_that_rolls_fast_enough_stays_upright():
    """(A + m r^2) lean" + (C (C + m r^2)/A W^2 - m g r) lean = 0: upright from W^2 = g/(3 r) on.
    Without the frame its quaternion turns: there are no modes of such coordinates, and the error says so."""
    spin = 10.0
    inertia = C * (C + M * R * R) / A * spin**2 - M * G * R
    values = {"m": M, "a": A, "c": C, "r": R}
    frame = f"BODY f m=1n j=(1n,1n,1n) z={R!r} vx={spin * R!r} omega=(0,0,0)"
    r = emsim.run(ROLLING.format(start="", frame=frame, axle="JOINT axle f d pin axis=(0,1,0)", **values))
    wanted = math.sqrt(inertia / (A + M * R * R)) / (2.0 * math.pi)
    assert max(r["frequency"]) == pytest.approx(wanted, rel=1e-6)
    assert codes(r) == []
    start = f"z={R!r} vx={spin * R!r} omega=(0,{spin!r},0)"
    for options in ("", ".options formulation=absolute"):
        with pytest.raises(emsim.ConvergenceError) as error:
            emsim.run(ROLLING.format(start=start, frame=options, axle="", **values))
        assert [d.code for d in error.value.diagnostics] == ["E416"]


@pytest.mark.parametrize("analysis", [".modes", ".ac dec 1 1 10"])
def test_a_moment_of_a_turn_in_absolute_coordinates_has_no_modes(analysis):
    """A pendulum swings through its lowest point: about the speeds of its body, which turn with it, the equations had
    eigenvalues of 5.48/s and no error; about its angle they have 5.17/s."""
    deck = f"""pendulum
BODY p m=1 j=0.02 com=(0,-0.3)
JOINT b 0 p pin ic=(0,2)
V1 a 0 ac 1
R1 a 0 1
.gravity {G}
.options formulation={{}}
{analysis}
.end
"""
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(deck.format("absolute"))
    assert [d.code for d in error.value.diagnostics] == ["E416"]
    r = emsim.run(deck.format("joint"))
    if analysis == ".modes":
        assert max(r["frequency"]) == pytest.approx(math.sqrt(G * 0.3 / 0.11) / (2.0 * math.pi), rel=1e-9)


def test_speeds_that_contradict_a_row_are_refused_and_free_ones_follow():
    deck = "t\nBODY w m=1 j=0.01 y=0.1 vx=1 {more}\nROLL c w 0 r=0.1 line=(0,1)\n.tran 1m 10m\n.print tran omega(w)\n.end\n"
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(deck.format(more="omega=5"))
    assert [d.code for d in error.value.diagnostics] == ["E244"]
    r = emsim.run(deck.format(more=""))
    np.testing.assert_allclose(r["omega(w)"], -10.0, rtol=1e-12)


def test_two_skates_on_one_edge_share_what_one_would_hold():
    """The second says nothing new. How they share is not known; the motion is."""
    deck = """two skates in a row, each across the axle
BODY s m=1 j=0.1 vx=1 omega=1 com=(0.2,0)
KNIFE k1 s(0,0.3) 0 along=(1,0)
KNIFE k2 s(0,-0.3) 0 along=(1,0)
.tran 10m 1
.print tran x(s) y(s) force(k1) force(k2)
.end
"""
    r = emsim.run(deck)
    assert "W240" in codes(r)
    np.testing.assert_allclose(r["force(k1)"], r["force(k2)"], rtol=1e-9)
    one = emsim.run(deck.replace("KNIFE k2", "*").replace("force(k2)", ""))
    np.testing.assert_allclose(r["x(s)"], one["x(s)"], atol=1e-9)
    np.testing.assert_allclose(r["force(k1)"], 0.5 * np.asarray(one["force(k1)"]), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("card", "code"),
    [
        ("ROLL c w 0 r=0.1 line=(0,1)", "E242"),  # 0.1 m above the ground whatever moves
        ("ROLL c w 0 line=(0,1)", "E230"),
        ("ROLL c w 0 r=0.2", None),  # no mark: a resistor with one word too many
        ("KNIFE c w 0 along=(0,0,1)", "E232"),
        ("KNIFE c w 0 along=(1,0,0,0)", "E232"),
        ("RATIO c s axle coef=(1,0)", "E238"),
        ("RATIO c s axle coef=(1,2,3)", "E232"),
        ("RATIO c s s coef=(1,2)", "E237"),
    ],
)
def test_mistakes_are_told(card, code):
    deck = f"""t
BODY cart m=1
BODY w m=1 j=0.01
JOINT s 0(0,0.2) cart slide axis=(1,0)
JOINT axle cart w pin
{card}
.tran 1m 10m
.end
"""
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(deck)
    found = [d.code for d in error.value.diagnostics if d.severity == "error"]
    assert found[:1] == [code] if code else found
