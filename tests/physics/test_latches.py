"""LATCH: what breaks, lets go and catches, by closed forms; energy of plastic impacts in the ledger."""

from __future__ import annotations

import math

import numpy as np
import pytest
from machines import problems
from scipy.integrate import quad, solve_ivp

import emsim
from emsim import pipeline

G = 9.81
FORMULATIONS = ["joint", "absolute"]


def run(deck, formulation="joint", reltol=1e-6):
    return pipeline.run(
        f"latches\n{deck}\n.options formulation={formulation} reltol={reltol}\n.end\n", energy=True
    )


def at(r, word, t):
    return float(np.interp(t, r["time"], r[word]))


CARTS = """BODY a m=1
BODY b m=3
JOINT ja 0 a slide axis=(1,0) ic=(0,2)
JOINT jb 0 b slide axis=(1,0) ic=(1,0.5)
"""


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("reltol", [1e-3, 1e-9])
def test_two_carts_latch_and_part(formulation, reltol):
    """v = (m1 v1 + m2 v2)/(m1 + m2); 1/2 mu dv^2 is lost; let go, both go on as they went."""
    r = run(
        CARTS
        + """LATCH l a b hold=distance catch={x(b)-x(a)<0.4} release={time>1}
FORCE push b dir=(1,0) {if(time>1.5,3,0)}
.tran 10m 2
.print tran x(a) x(b) vx(a) vx(b) hits(l) mode(l) force(l) impulse(l)""",
        formulation,
        reltol,
    )
    met, v, lost = 0.4, 0.875, 0.5 * 0.75 * 1.5**2
    t = np.asarray(r["time"])
    held = t > met + 1e-6
    np.testing.assert_allclose(np.asarray(r["vx(a)"])[held], v, rtol=1e-9)
    np.testing.assert_allclose(
        np.asarray(r["vx(b)"])[held], np.where(t[held] < 1.5, v, v + t[held] - 1.5), rtol=1e-9
    )
    between = held & (t < 1.0)
    np.testing.assert_allclose((np.asarray(r["x(b)"]) - r["x(a)"])[between], 0.4, atol=1e-9)
    np.testing.assert_allclose(r["x(a)"], np.where(t < met, 2 * t, 2 * met + v * (t - met)), atol=1e-8)
    assert r["hits(l)"][-1] == 1.0
    np.testing.assert_allclose(abs(r["impulse(l)"][-1]), 0.75 * 1.5, rtol=1e-9)
    assert np.all(np.asarray(r["mode(l)"])[(t > met + 1e-6) & (t < 1.0 - 1e-6)] == 1.0)
    assert np.all(np.asarray(r["mode(l)"])[t > 1.0 + 1e-6] == 0.0)
    np.testing.assert_allclose(r.energy.dissipated, lost, rtol=1e-9)
    assert r.energy.share < 1e-9


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_bodies_that_meet_go_on_as_one(formulation):
    """Two free bodies of the plane welded as they stand: momentum, angular momentum, and what is lost."""
    r = run(
        """BODY a m=2 j=0.3 x=0 y=0 vx=1 vy=0 omega=4
BODY b m=1 j=0.2 x=1 y=0.5 vx=-1 vy=0.5 omega=-1
LATCH w a b catch={x(b)-x(a)<0.6}
.tran 10m 2
.print tran x(a) y(a) x(b) y(b) vx(a) vy(a) vx(b) vy(b) omega(a) omega(b) energy() hits(w)""",
        formulation,
        1e-9,
    )
    end = {
        w: r[w][-1]
        for w in ("vx(a)", "vy(a)", "vx(b)", "vy(b)", "omega(a)", "omega(b)", "x(a)", "y(a)", "x(b)", "y(b)")
    }
    assert r["hits(w)"][-1] == 1.0
    # met at t = 0.2: d = (0.6, 0.6), of the centre of mass a stands at -d/3, b at 2 d/3
    np.testing.assert_allclose(2.0 * end["vx(a)"] + end["vx(b)"], 1.0, atol=1e-9)
    np.testing.assert_allclose(2.0 * end["vy(a)"] + end["vy(b)"], 0.5, atol=1e-9)
    mu, d, dv = 2.0 / 3.0, np.array([0.6, 0.6]), np.array([-2.0, 0.5])
    spin = 0.3 * 4.0 - 0.2 + mu * (d[0] * dv[1] - d[1] * dv[0])
    inertia = 0.5 + mu * (d @ d)
    np.testing.assert_allclose([end["omega(a)"], end["omega(b)"]], spin / inertia, rtol=1e-8)
    before = 0.5 * (0.3 * 16.0 + 0.2 + mu * (dv @ dv))
    np.testing.assert_allclose(r.energy.dissipated, before - 0.5 * spin**2 / inertia, rtol=1e-7)
    far = math.hypot(end["x(b)"] - end["x(a)"], end["y(b)"] - end["y(a)"])
    np.testing.assert_allclose(far, math.hypot(*d), rtol=1e-7)
    assert r.energy.share < 1e-8


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_bodies_dock_in_space(formulation):
    """The same in space: three momenta, three angular momenta about the centre of mass, one turn for both from then on."""
    r = run(
        """BODY a m=2 j=(0.3,0.4,0.5) vx=1 omega=(1,0,2)
BODY b m=1 j=(0.2,0.1,0.2) x=1 y=0.5 z=0.2 vx=-1 vy=0.5 omega=(0,1,-1)
LATCH w a b catch={time>0.2}
.tran 10m 1
.print tran x(a) y(a) z(a) x(b) y(b) z(b) vx(a) vy(a) vz(a) vx(b) vy(b) vz(b) energy()
.probe x(a(1,0,0)) y(a(1,0,0)) z(a(1,0,0)) x(b(0,2,0)) y(b(0,2,0)) z(b(0,2,0))""",
        formulation,
        1e-9,
    )
    va, vb = (np.array([r[f"v{k}({body})"] for k in "xyz"]) for body in "ab")
    np.testing.assert_allclose((2.0 * va + vb)[:, -1], [1.0, 0.5, 0.0], atol=1e-8)
    xa, xb = (np.array([r[f"{k}({body})"] for k in "xyz"]) for body in "ab")
    t = np.asarray(r["time"])
    held = t > 0.2 + 1e-6
    ends = [np.array([r[f"{k}({at})"] for k in "xyz"]) for at in ("a(1,0,0)", "b(0,2,0)")]
    for one, other in ((xa, xb), (xa, ends[1]), (xb, ends[0]), (ends[0], ends[1])):
        far = np.linalg.norm(other - one, axis=0)[held]
        np.testing.assert_allclose(far, far[0], rtol=1e-7)
    assert np.ptp(np.asarray(r["energy()"])[held]) < 1e-7
    assert r.energy.share < 1e-7


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("reltol", [1e-6, 1e-9])
def test_a_cable_breaks_at_its_tension_and_the_bob_flies(formulation, reltol):
    """Let go level, T = 3 m g sin a below the level: it breaks at T = 2 m g, sin a = 2/3, and then falls free."""
    r = run(
        f"""BODY bob m=1 j=0.1 x=1
LATCH cable 0 bob hold=distance held=yes force={2 * G}
.gravity {G}
.tran 5m 1.2
.print tran x(bob) y(bob) vx(bob) vy(bob) force(cable) mode(cable) angle(bob)""",
        formulation,
        reltol,
    )
    # (with a scale that no point falls on)
    a = math.asin(2.0 / 3.0)
    speed = math.sqrt(2.0 * G * 2.0 / 3.0)
    # dt = da/sqrt(2 g sin a), by a = s^2
    broke = quad(
        lambda s: 2.0 * s / math.sqrt(2.0 * G * math.sin(s * s)) if s else 0.0,
        0.0,
        math.sqrt(a),
        epsabs=1e-13,
    )[0]
    t, mode = np.asarray(r["time"]), np.asarray(r["mode(cable)"])
    first = t[mode < 0.0][0]
    assert abs(first - broke) < max(20.0 * reltol, 1e-7)
    end = 1.2 - broke
    known = [
        math.cos(a) - speed * math.sin(a) * end,
        -math.sin(a) - speed * math.cos(a) * end - 0.5 * G * end * end,
    ]
    np.testing.assert_allclose([r["x(bob)"][-1], r["y(bob)"][-1]], known, atol=max(100.0 * reltol, 1e-7))
    np.testing.assert_allclose(r["vx(bob)"][-1], -speed * math.sin(a), atol=max(100.0 * reltol, 1e-7))
    assert np.all(mode[t > first + 1e-9] == -1.0)
    assert np.max(np.abs(np.asarray(r["force(cable)"])[t > first + 1e-9])) == 0.0
    assert r.energy.share < 1e-6


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_bracket_breaks_under_a_load_that_rises(formulation):
    """Welded to the ground: force F = 10 t and torque 0.5 F at once; the torque is first at its limit, t = 0.4."""
    r = run(
        """BODY b m=2 j=0.5
LATCH w 0 b held=yes force=5 torque=2
FORCE f b(0.5,0) dir=(0,1) {10*time}
.tran 5m 0.5
.print tran y(b) angle(b) force(w) torque(w) mode(w)""",
        formulation,
    )
    t = np.asarray(r["time"])
    assert abs(t[np.asarray(r["mode(w)"]) < 0.0][0] - 0.4) < 1e-6
    held = t < 0.4 - 1e-6
    np.testing.assert_allclose(np.asarray(r["force(w)"])[held], 10.0 * t[held], atol=1e-6)
    np.testing.assert_allclose(np.asarray(r["torque(w)"])[held], -5.0 * t[held], atol=1e-6)
    np.testing.assert_allclose(np.asarray(r["y(b)"])[held], 0.0, atol=1e-12)
    known = solve_ivp(
        lambda t, y: [y[1], 5.0 * t, y[3], 5.0 * t * math.cos(y[2]) / 0.5],
        (0.4, 0.5),
        [0, 0, 0, 0],
        rtol=1e-10,
        atol=1e-12,
    ).y[:, -1]
    np.testing.assert_allclose([r["y(b)"][-1], r["angle(b)"][-1]], [known[0], known[2]], atol=1e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_flywheel_is_caught_let_go_and_caught_again(formulation):
    """On a coordinate: caught, held against a torque, let go, driven by it, caught again. Broken it stays, whatever catches."""
    r = run(
        """BODY w m=1 j=0.5
JOINT h 0 w pin ic=(0,4)
TORQUE t h tau=1
LATCH l h catch={time>0.5} release={time>1 & time<1.5}
.tran 10m 2
.print tran angle(h) omega(h) hits(l) torque(l) mode(l)""",
        formulation,
    )
    t = np.asarray(r["time"])
    known = np.select([t < 0.5, t < 1.0, t < 1.5], [4 * t + t * t, 2.25, 2.25 + (t - 1.0) ** 2], 2.25 + 0.25)
    np.testing.assert_allclose(r["angle(h)"], known, atol=1e-8)
    assert r["hits(l)"][-1] == 2.0
    assert abs(at(r, "torque(l)", 0.75) + 1.0) < 1e-9
    np.testing.assert_allclose(r.energy.dissipated, 0.25 * 25.0 + 0.25 * 1.0, rtol=1e-8)
    broken = run(
        """BODY w m=1 j=0.5
JOINT h 0 w pin
TORQUE t h tau={2*time}
LATCH l h catch={1} torque=1
.tran 10m 1
.print tran omega(h) mode(l)"""
    )
    t = np.asarray(broken["time"])
    np.testing.assert_allclose(broken["omega(h)"], np.where(t < 0.5, 0.0, 2.0 * (t * t - 0.25)), atol=1e-7)
    assert broken["mode(l)"][-1] == -1.0


def test_what_lies_on_a_floor_strikes_it_on_account_of_a_catch():
    """A ram comes down on a block that rests on a floor and catches it: the block cannot move, so all is lost."""
    r = run(
        f"""BODY block m=2
BODY ram m=1
JOINT jb 0 block slide axis=(0,1) ic=0
JOINT jr 0 ram slide axis=(0,1) ic=(1,-1)
STOP floor jb min=0
LATCH l block ram hold=distance catch={{y(ram)-y(block)<0.5}}
.gravity {G}
.tran 10m 1
.print tran y(block) y(ram) vy(ram) force(floor) impulse(floor) force(l)"""
    )
    fall = math.sqrt(1.0 + 2.0 * G * 0.5)
    assert abs(r["vy(ram)"][-1]) < 1e-12 and abs(r["y(block)"][-1]) < 1e-9
    np.testing.assert_allclose(r["y(ram)"][-1], 0.5, atol=1e-8)
    np.testing.assert_allclose(r["force(floor)"][-1], 3.0 * G, rtol=1e-6)
    np.testing.assert_allclose(r["impulse(floor)"][-1], fall, rtol=1e-6)
    np.testing.assert_allclose(r.energy.dissipated, 0.5 * fall**2, rtol=1e-6)


def test_a_chain_parts_where_it_is_weakest_and_in_any_order():
    """Three carts in a row pulled by a force that rises: each link carries what is behind it. Cards in any order."""
    links = ["LATCH p a b hold=distance held=yes force=3", "LATCH q b c hold=distance held=yes force=1.2"]
    found = []
    for order in (links, links[::-1]):
        r = run(
            "BODY a m=1\nBODY b m=1\nBODY c m=2\n"
            + "".join(
                f"JOINT j{n} 0 {n} slide axis=(1,0) ic={x}\n" for n, x in zip("abc", (2, 1, 0), strict=True)
            )
            + "\n".join(order)
            + "\nFORCE f a dir=(1,0) {2*time}\n.tran 10m 3\n.print tran x(a) x(b) x(c) mode(p) mode(q)"
        )
        t = np.asarray(r["time"])
        # q carries F/2: 1.2 at t = 1.2; then p carries F/2: 3 at t = 3
        assert abs(t[np.asarray(r["mode(q)"]) < 0.0][0] - 1.2) < 1e-6
        assert np.all(np.asarray(r["mode(p)"])[t < 2.99] == 1.0)
        found.append([r["x(a)"][-1], r["x(c)"][-1]])
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    np.testing.assert_allclose(found[0][1], 1.2**3 / 12.0 + 0.25 * 1.2**2 * 1.8, rtol=1e-6)


WRONG = {
    "never": ("LATCH l a b release={time>1} held=no", "E230", "never holds"),
    "hold of a joint": ("LATCH l ja held=yes hold=point", "E240", "two points"),
    "torque of a slide": ("LATCH l ja held=yes torque=1", "E240", "takes no torque"),
    "too much": (
        "BODY c m=1 j=1\nJOINT p 0 c pin\nLATCH l 0 c(1,0) held=yes",
        "E240",
        "3 motions, of which 1",
    ),
    "coincide": ("BODY c m=1 j=1\nLATCH l 0 c hold=distance held=yes", "E257", "coincide"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_told(name):
    cards, code, said = WRONG[name]
    found = [d for d in problems(CARTS + cards) if d.code == code]
    assert found and said in found[0].message


@pytest.mark.parametrize("method", ["radau", "esdirk", "trbdf2", "trap", "gear", "dop853", "rk45"])
def test_every_method_that_ends_steps_at_events_catches(method):
    r = run(
        CARTS
        + f"LATCH l a b hold=distance catch={{x(b)-x(a)<0.4}}\n.options method={method}\n.tran 10m 1\n.print tran vx(a) vx(b)"
    )
    np.testing.assert_allclose([r["vx(a)"][-1], r["vx(b)"][-1]], 0.875, rtol=1e-9)


def test_derivatives_go_through_a_catch_and_not_through_a_break():
    """v = (m1 v1 + m2 v2)/M, caught at t = 0.6/(v1 - v2): dv/dv1 = 1/4, and where it is at 1.9 s by hand. A break is refused."""
    text = (
        "latch\n.param v=2\n"
        + CARTS.replace("(0,2)", "(0,{v})")
        + "LATCH l a b hold=distance catch={x(b)-x(a)<0.4}@\n.tran 10m 2\n"
        + ".meas tran ve find vel(ja) at=1.9\n.meas tran xe find pos(ja) at=1.9\n.end\n"
    )
    found = emsim.Deck(text.replace("@", "")).gradient(["ve", "xe"], ["v"])
    # x = v t* + V (1.9 - t*), t* = 0.6/(v - 0.5), V = (v + 1.5)/4
    met, slope = 0.4, -0.6 / 1.5**2
    known = met + 2.0 * slope + 0.25 * (1.9 - met) - 0.875 * slope
    np.testing.assert_allclose(np.ravel(found.matrix), [0.25, known], rtol=1e-6)
    with pytest.raises(emsim.ConvergenceError, match="LATCH l breaks"):
        emsim.Deck(text.replace("@", " force=100")).gradient(["ve", "xe"], ["v"])


def test_modes_and_rest_of_what_is_held():
    """Two carts as one on a spring: sqrt(k/(m1 + m2)), and the distance that stays as it is."""
    held = "SPRING k ja k=4\nLATCH l a b hold=distance held=yes\n"
    modes = run(CARTS.replace("(0,2)", "0").replace("(1,0.5)", "1") + held + ".modes")
    np.testing.assert_allclose(2.0 * math.pi * np.asarray(modes["frequency"]), [0.0, 1.0], atol=1e-9)
    rest = run(CARTS.replace("(0,2)", "0.3").replace("(1,0.5)", "1") + held + ".op static")
    np.testing.assert_allclose([rest["pos(ja)"][0], rest["pos(jb)"][0]], [0.0, 0.7], atol=1e-6)


@pytest.mark.parametrize(("release", "codes"), [("", {"E244"}), (" release={1}", set())])
def test_one_that_holds_from_the_start_changes_no_speed_that_is_given(release, codes):
    text = (
        "two carts\nBODY a m=1\nBODY b m=3\nJOINT ja 0 a slide axis=(1,0) ic=(0,2)\nJOINT jb 0 b slide axis=(1,0) ic=(1,0)\n"
        f"LATCH l a b hold=distance held=yes{release}\n.tran 10m 1\n"
    )
    try:
        found = emsim.run(text)
        assert found["vel(ja)"][-1] == pytest.approx(2.0) and found["vel(jb)"][-1] == pytest.approx(
            0.0, abs=1e-12
        )
        said = found.diagnostics
    except emsim.DeckError as error:
        said = error.diagnostics
    assert {d.code for d in said if d.severity == "error"} == codes
