"""ROPE: over points and pulleys of any number, slack as a mode, elastic, wound on drums; in the plane and in space."""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from support import ROOT

import emsim
from emsim import pipeline

G = 9.81
BOTH = pytest.mark.parametrize("formulation", ["joint", "absolute"])


def run(
    cards: str, options: str = "reltol=1e-8", tran: str = "10m 1", gravity: str = f"{G}", prints: str = ""
):
    shown = f".print tran {prints}\n" if prints else ""
    deck = f"rope\n{cards}\n.gravity {gravity}\n.options {options}\n.tran {tran}\n{shown}.end\n"
    return pipeline.run(deck, energy=True)


# over pulleys that turn with it, and blocks of n parts -------------------------------------------------

ATWOOD = """BODY a m=2
BODY b m=1
BODY w j=0.02 m=3
JOINT pin 0(0,2) w pin
JOINT sa 0(-0.1,0) a slide axis=(0,1)
JOINT sb 0(0.1,0) b slide axis=(0,1)
ROPE r a w b r=(0,-0.1,0) grip=2 slack=0"""


@BOTH
@pytest.mark.parametrize(
    "options", ["reltol=1e-3", "reltol=1e-6", "reltol=1e-9", "method=trap", "method=gear", "method=esdirk"]
)
def test_atwood_machine_with_inertia_in_its_pulley(formulation, options):
    """a = g (m1 - m2)/(m1 + m2 + J/r^2); the tensions differ by J a/r^2. Before and behind the pulley stretches of their own."""
    r = run(ATWOOD, f"formulation={formulation} {options}", "10m 0.3",
            prints="pos(sa) pos(sb) angle(pin) tension(r,1) tension(r,2) length(r,1) mode(r,1)")  # fmt: skip
    a = G * 1.0 / (3.0 + 0.02 / 0.01)
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["pos(sa)"], -0.5 * a * t * t, atol=1e-7)
    np.testing.assert_allclose(r["pos(sb)"], 0.5 * a * t * t, atol=1e-7)
    np.testing.assert_allclose(r["angle(pin)"], 5.0 * a * t * t, atol=1e-6)
    np.testing.assert_allclose(r["tension(r,1)"], 2 * (G - a), rtol=1e-6)
    np.testing.assert_allclose(r["tension(r,2)"], 1 * (G + a), rtol=1e-6)
    np.testing.assert_allclose(r["length(r,1)"], 2.0 + 0.5 * a * t * t, atol=1e-7)
    np.testing.assert_allclose(r["mode(r,1)"], 1.0)
    assert abs(r.energy.share) < 1e-10


@BOTH
def test_fixed_and_movable_pulley_both_with_inertia(formulation):
    """From the ceiling under a pulley on the load, over one on the ceiling, to the counterweight, which goes twice as far:
    (M + mw + 4 m + J1/r1^2 + 4 J2/r2^2) y'' = (2 m - M - mw) g."""
    r = run(
        """BODY load m=3
BODY low j=5m m=0.5
BODY high j=8m m=1
BODY cw m=2
JOINT s 0 load slide axis=(0,1)
JOINT pl load low pin
JOINT ph 0(0.25,2) high pin
JOINT sc 0(0.4,1) cw slide axis=(0,1)
ROPE r 0(-0.1,2) low high cw r=(0,0.1,-0.15,0) grip=(2,3) slack=0""",
        f"formulation={formulation} reltol=1e-8",
        "10m 0.4",
        prints="pos(s) pos(sc) angle(pl) angle(ph) tension(r,1) tension(r,2) tension(r,3)",
    )
    j1, j2 = 5e-3 / 0.01, 8e-3 / 0.0225
    a = (2 * 2.0 - 3.5) * G / (3.5 + 4 * 2.0 + j1 + 4 * j2)
    y = 0.5 * a * np.asarray(r["time"]) ** 2
    np.testing.assert_allclose(r["pos(s)"], y, atol=1e-9)
    np.testing.assert_allclose(r["pos(sc)"], -2 * y, atol=1e-9)
    np.testing.assert_allclose(r["angle(pl)"], y / 0.1, atol=1e-8)
    np.testing.assert_allclose(r["angle(ph)"], -2 * y / 0.15, atol=1e-8)
    t3 = 2.0 * (G - 2 * a)
    t2 = t3 - j2 * 2 * a
    np.testing.assert_allclose(r["tension(r,3)"], t3, rtol=1e-7)
    np.testing.assert_allclose(r["tension(r,2)"], t2, rtol=1e-7)
    np.testing.assert_allclose(r["tension(r,1)"], t2 - j1 * a, rtol=1e-7)


TACKLES = {  # parts that carry the load: places, radii, where the free end comes down
    2: ("0(-0.1,2) load 0(0.2,2)", "0,0.1,-0.1", 0.3),
    3: ("load(-0.1,0) 0(0,2) load(0.2,0) 0(0.4,2)", "0,-0.1,0.1,-0.1", 0.5),
    4: ("0(-0.1,2) load 0(0.2,2) load(0.4,0) 0(0.6,2)", "0,0.1,-0.1,0.1,-0.1", 0.7),
}


@BOTH
@pytest.mark.parametrize("parts", [2, 3, 4])
def test_block_and_tackle_multiplies_the_force(formulation, parts):
    """n parts carry the load and the free end goes n times as far: (M + n^2 m) y'' = (n m - M) g."""
    places, radii, x = TACKLES[parts]
    m = 1.0
    r = run(
        f"BODY load m=4 j=1\nJOINT s 0 load slide axis=(0,1)\nBODY cw m={m}\nJOINT sc 0({x},1) cw slide axis=(0,1)\n"
        f"ROPE r {places} cw r=({radii},0) slack=0",
        f"formulation={formulation} reltol=1e-8",
        "10m 0.3",
        prints="pos(s) pos(sc) tension(r) length(r)",
    )
    a = (parts * m - 4.0) * G / (4.0 + parts**2 * m)
    t = np.asarray(r["time"])
    np.testing.assert_allclose(r["pos(s)"], 0.5 * a * t * t, atol=1e-9)
    np.testing.assert_allclose(r["pos(sc)"], -0.5 * parts * a * t * t, atol=1e-9)
    np.testing.assert_allclose(r["tension(r)"], m * (G - parts * a), rtol=1e-8)
    np.testing.assert_allclose(r["length(r)"], r["length(r)"][0], rtol=1e-12)


@pytest.mark.parametrize("parts", [2, 3, 4])
def test_block_and_tackle_at_rest_and_its_mode(parts):
    """Made fast with an elastic rope: tension M g/n; the load swings with n^2 k."""
    places, radii, x = TACKLES[parts]
    r = emsim.run(
        f"tackle\nBODY load m=4\nJOINT s 0 load slide axis=(0,1)\nROPE r {places} 0({x},1) r=({radii},0) slack=0 k=5k\n"
        f".gravity {G}\n.op static\n.modes static\n.save pos(s) tension(r)\n.end\n"
    )
    assert r.table("op")["tension(r)"][0] == pytest.approx(4 * G / parts, rel=1e-9)
    assert r.table("op")["pos(s)"][0] == pytest.approx(-4 * G / parts**2 / 5e3, rel=1e-7)
    assert r.table("modes")["frequency"][0] == pytest.approx(sqrt(parts**2 * 5e3 / 4) / (2 * pi), rel=1e-9)


@BOTH
@pytest.mark.parametrize("k", ["", "k=5k"])
def test_a_load_comes_to_rest_on_its_movable_pulley(formulation, k):
    """Half of its weight in the rope, in both formulations, stretched or not."""
    taut = "length=4.3" if k else "slack=0"
    r = emsim.run(
        f"rest\nBODY load m=4\nJOINT s 0 load slide axis=(0,1)\nROPE r 0(-0.1,2) load 0(0.1,2) r=(0,0.1,0) {taut} {k}\n"
        f".gravity {G}\n.options formulation={formulation}\n.op static\n.save pos(s) tension(r)\n.end\n"
    )
    stretched = 4 * G / 2 / 5e3 if k else 0.0
    longer = 4.3 - (4 + 0.1 * pi) if k else 0.0
    assert r.table("op")["tension(r)"][0] == pytest.approx(2 * G, rel=1e-8)
    assert r.table("op")["pos(s)"][0] == pytest.approx(-(stretched + longer) / 2, abs=1e-9)


# pegs -------------------------------------------------------------------------------------------------


def involute(r: float, l0: float, psi0: float, rate0: float, times, centre=(0.0, 0.0), on=-1.0):
    """A bob on a rope that is wound clockwise (on = -1) on a fixed circle: psi the direction of its free part l,
    l' = -on r psi'; its velocity is across the free part, l psi'. Returns x, y."""

    def place(psi, length):
        t, n = (cos(psi), sin(psi)), (-sin(psi), cos(psi))
        # the end is held at the last place: towards the bob the rope leaves the circle
        return tuple(c - on * r * b + length * a for c, a, b in zip(centre, t, n, strict=True))

    def motion(_, state):
        psi, rate, length = state
        # x' = t l' + n l psi' - on r (-t) psi', and l' = -on r psi': what is left is n l psi'
        change = -on * r * rate
        force = -G * cos(psi)  # across the free part, over the mass
        # l psi' is the speed, its change the force across
        return [rate, (force - change * rate) / length, change]

    found = solve_ivp(motion, (0, times[-1]), [psi0, rate0, l0], t_eval=times, rtol=1e-11, atol=1e-12)
    return np.array([place(psi, length) for psi, _, length in found.y.T])


@BOTH
@pytest.mark.parametrize("tolerance", [1e-4, 1e-7, 1e-10])
def test_pendulum_whose_rope_winds_on_its_peg(formulation, tolerance):
    """A swing on an involute, both ways, against an integration of its own."""
    radius, length, psi = 0.08, 0.9, -0.3
    x = radius * -sin(psi) + length * cos(psi)
    y = radius * cos(psi) + length * sin(psi)
    r = run(
        f"BODY bob m=0.7 j=1m x={x!r} y={y!r}\nROPE r 0 bob r=(-{radius},0) slack=0",
        f"formulation={formulation} reltol={tolerance}",
        "20m 3",
        prints="x(bob) y(bob) tension(r) length(r)",
    )
    places = involute(radius, length, psi, 0.0, np.asarray(r["time"]))
    error = np.abs(places - np.column_stack((r["x(bob)"], r["y(bob)"]))).max()
    assert error < 300 * tolerance
    assert min(r["length(r)"]) < 0.75 < 0.9 < max(r["length(r)"]) + 1e-4  # it has wound some 0.2 m
    assert abs(r.energy.share) < 10 * tolerance


@BOTH
def test_pendulum_that_meets_a_peg(formulation):
    """Free about its anchor until the rope lies on a peg below, then on an involute of it, until it leaves the peg again."""
    peg, radius, whole = (0.1, -0.4), 0.05, 1.0
    r = run(
        f"BODY bob m=1 j=1m x={whole * sin(1.0)!r} y={-whole * cos(1.0)!r}\nROPE r 0 0{peg} bob r=(0,{-radius},0) slack=0",
        f"formulation={formulation} reltol=1e-9",
        "20m 2.4",
        prints="x(bob) y(bob) energy() mode(r)",
    )
    times = np.asarray(r["time"])
    # the rope touches where the line from the anchor is a tangent, with the peg on its left as seen going down
    far = sqrt(peg[0] ** 2 + peg[1] ** 2)
    touch = atan2(peg[1], peg[0]) + np.arcsin(radius / far)
    before = sqrt(far**2 - radius**2)

    def free(_, s):
        return [s[1], -G / whole * cos(s[0])]

    def meets(_, s):
        return s[0] - touch

    meets.terminal = True
    first = solve_ivp(
        free, (0, 2.4), [1.0 - pi / 2, 0.0], events=meets, rtol=1e-12, atol=1e-13, dense_output=True
    )
    at = first.t_events[0][0]
    rate = first.y_events[0][0][1]
    assert 0.2 < at < 0.5
    later = times[(times > at)]
    length = whole - before
    turn = rate * whole / length  # the bob's speed stays
    places = involute(radius, length, touch, turn, np.concatenate(([0.0], later - at)), peg, -1.0)[1:]
    # until it is back where it left
    angles = np.unwrap(np.arctan2(places[:, 1] - peg[1], places[:, 0] - peg[0]))
    own = touch + (angles - angles[0])
    back = next((k for k in range(5, len(own)) if own[k] > own[0] - 1e-3), len(own))
    assert back > 30
    seen = np.column_stack((r["x(bob)"], r["y(bob)"]))[times > at][: back - 1]
    np.testing.assert_allclose(seen, places[: back - 1], atol=2e-6)
    before_it = times < at
    angle = first.sol(times[before_it])[0]
    np.testing.assert_allclose(np.asarray(r["x(bob)"])[before_it], whole * np.cos(angle), atol=1e-7)
    assert abs(r.energy.share) < 1e-8


def test_a_bob_that_winds_itself_up():
    """Without weight its speed v stays, and its free part falls as l^2 = l0^2 - 2 r v t: more than a turn, counted."""
    r = run("BODY bob m=1 j=1m x=0.05 y=-1 vx=5\nROPE r 0 bob r=(0.05,0) slack=0".replace("x=0.05", "x=-0.05"),
            "reltol=1e-9", "10m 1.9", "0", "length(r) vx(bob) vy(bob) tension(r)")  # fmt: skip
    t = np.asarray(r["time"])
    free = np.sqrt(1.0 - 2 * 0.05 * 5 * t)
    np.testing.assert_allclose(r["length(r)"], free, atol=1e-7)
    np.testing.assert_allclose(np.hypot(r["vx(bob)"], r["vy(bob)"]), 5.0, rtol=2e-7)
    np.testing.assert_allclose(r["tension(r)"][1:], 25.0 / free[1:], rtol=1e-5)
    assert (1.0 - free[-1]) / 0.05 > 4 * pi  # two turns


# slack ------------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_slack_rope_that_goes_taut_takes_its_impulse(formulation, e):
    """Thrown level on a slack rope: as it goes taut the velocity along it turns to -e of it; m/2 v^2 (1 - e^2) is lost."""
    r = run(
        f"BODY bob m=2 j=1m x=0.3 y=-0.4 vx=3\nROPE r 0 bob length=1 e={e}",
        f"formulation={formulation} reltol=1e-9", "1m 0.4", "0",
        "x(bob) y(bob) vx(bob) vy(bob) tension(r) hits(r) impulse(r) mode(r) gap(r)",
    )  # fmt: skip
    reach = sqrt(1 - 0.16)
    at = (reach - 0.3) / 3
    k = int(np.searchsorted(r["time"], at)) + 1
    assert r["gap(r)"][0] == pytest.approx(0.5, rel=1e-10)
    assert r["mode(r)"][k - 3] == 0.0 and r["tension(r)"][k - 3] == 0.0
    along, across = 3 * reach, 3 * 0.4
    assert r["impulse(r)"][k + 1] == pytest.approx(2 * along * (1 + e), rel=1e-7)
    assert r["hits(r)"][k + 1] == 1
    speed = np.hypot(r["vx(bob)"][k + 1], r["vy(bob)"][k + 1])
    assert speed == pytest.approx(sqrt(across**2 + (e * along) ** 2), rel=1e-7)
    assert r.energy.dissipated == pytest.approx(along**2 * (1 - e * e), rel=1e-7) or e
    assert abs(r.energy.share) < 1e-9


@BOTH
def test_a_bungee_jump(formulation):
    """Free fall by the slack, then k (s - slack)^2/2 = m g s at the lowest point; the tension begins at 0."""
    m, k, slack = 70.0, 150.0, 20.0
    r = run(f"BODY jumper m={m} j=1\nJOINT s 0 jumper slide axis=(0,1)\nROPE r 0(0,5) jumper slack={slack} k={k}",
            f"formulation={formulation} reltol=1e-9", "1m 6", prints="pos(s) tension(r) gap(r)")  # fmt: skip
    b = m * G / k
    deepest = slack + b + sqrt(b * b + 2 * b * slack)
    assert min(r["pos(s)"]) == pytest.approx(-deepest, rel=1e-6)
    assert max(r["tension(r)"]) == pytest.approx(k * (deepest - slack), rel=1e-6)
    taut = sqrt(2 * slack / G)
    np.testing.assert_allclose(np.asarray(r["tension(r)"])[np.asarray(r["time"]) < taut], 0.0)
    assert abs(r.energy.share) < 1e-8


def test_damping_of_an_elastic_rope_gives_back_its_share():
    """e= with k=: a mass that runs into its rope comes back with e of its speed, whatever k."""
    cards = "BODY cart m=2\nJOINT s 0 cart slide axis=(1,0) ic=(0,3)\nROPE r 0 cart(0.1,0) slack=1 k=2k e=0.6"
    r = run(cards, "reltol=1e-9", "1m 0.6",
            "0", "vel(s) tension(r)")  # fmt: skip
    assert r["vel(s)"][-1] == pytest.approx(-1.8, rel=1e-6)
    assert min(r["tension(r)"]) > -1e-9


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_what_the_jerk_takes_is_all_that_is_lost(tolerance):
    """Galileo's pendulum: on its peg, slack, taut again; the ledger closes, and but for the jerk energy stays."""
    deck = (ROOT / "netlists/mechanical/peg_pendulum.cir").read_text()
    r = pipeline.run(
        deck.replace("reltol=1e-6", f"reltol={tolerance}").replace("tension(rope)", "energy() tension(rope)"),
        energy=True,
    )
    energy, modes = np.asarray(r["energy()"]), np.asarray(r["mode(rope)"])
    assert set(modes) == {0.0, 1.0}
    jerk = int(np.nonzero((modes[1:] == 1.0) & (modes[:-1] == 0.0))[0][-1])
    slack = int(np.argmin(modes))
    np.testing.assert_allclose(energy[: jerk - 1], energy[0], atol=30 * tolerance)
    np.testing.assert_allclose(energy[jerk + 2 :], energy[-1], atol=30 * tolerance)
    assert energy[-1] < energy[slack] - 5.0
    assert abs(r.energy.share) < 10 * tolerance


@pytest.mark.parametrize("seed", range(6))
def test_scenes_by_chance(seed):
    """Bobs on ropes from the ground over pegs, and between one another: no rope grows longer, energy never rises, the ledger
    closes, and another order of cards gives the same."""
    chance = np.random.default_rng(seed)
    cards, prints = [], []
    for k in range(3):
        x, y = 0.8 * k + chance.uniform(-0.2, 0.2), chance.uniform(-1.5, -0.8)
        vx, vy = chance.uniform(-1, 1, 2)
        cards.append(
            f"BODY b{k} m={chance.uniform(0.5, 2):.3f} j=1m x={x:.4f} y={y:.4f} vx={vx:.3f} vy={vy:.3f}"
        )
        side, slack = chance.choice([-1, 1]), chance.choice([0.0, 0.1])
        e = chance.choice([0.0, 0.4])
        cards.append(
            f"ROPE r{k} 0({0.8 * k:.1f},0.6) 0({0.8 * k + side * 0.12:.2f},-0.1) b{k} r=(0,{side * 0.06},0) slack={slack} e={e}"
        )
        prints.append(f"gap(r{k})")
    cards.append("ROPE between b0 b2 slack=0.2 k=200 c=1")
    found = []
    for deck in (cards, cards[::-1]):
        r = run(
            "\n".join(deck), "reltol=1e-7", "10m 0.6", prints="energy() x(b0) x(b1) x(b2) " + " ".join(prints)
        )
        energy = np.asarray(r["energy()"])
        assert np.diff(energy).max() < 1e-5
        assert min(min(r[gap]) for gap in prints) > -1e-7
        assert abs(r.energy.share) < 1e-6
        found.append([r[f"x(b{k})"][-1] for k in range(3)])
    np.testing.assert_allclose(found[0], found[1], atol=2e-5)


# winches ----------------------------------------------------------------------------------------------


@BOTH
@pytest.mark.parametrize("side", [1, -1])
def test_a_winch_lifts_its_load(formulation, side):
    """(m + J/r^2) a = tau/r - m g; the drum turns as far as rope is wound."""
    r = run(
        f"""BODY drum j=0.05 m=10
JOINT axle 0 drum pin
BODY load m=20
JOINT s 0({3.2},-1) load slide axis=(0,1)
ROPE r drum 0(3,4) load r=({-side * 0.15},-0.2,0) slack=0
TORQUE motor axle tau={side * 40}""",
        f"formulation={formulation} reltol=1e-8",
        "10m 1.2",
        prints="pos(s) angle(axle) tension(r) length(r)",
    )
    a = (40 / 0.15 - 20 * G) / (20 + 0.05 / 0.0225)
    y = 0.5 * a * np.asarray(r["time"]) ** 2
    np.testing.assert_allclose(r["pos(s)"], y, atol=1e-7)
    np.testing.assert_allclose(r["angle(axle)"], side * y / 0.15, atol=1e-6)
    np.testing.assert_allclose(r["tension(r)"], 20 * (G + a), rtol=1e-7)
    np.testing.assert_allclose(r["length(r)"], r["length(r)"][0] - y, atol=1e-7)
    assert r["angle(axle)"][-1] * side > 2 * pi  # more than a turn
    assert abs(r.energy.share) < 1e-10


@BOTH
def test_a_winch_in_space_pays_out_by_its_drum(formulation):
    """pay= of a drum about any axis: through an eye to a load that hangs; (m + J/r^2) a = m g - tau/r."""
    r = run(
        """BODY drum j=(0.02,0.05,0.02) m=5
JOINT axle 0(1,1,0) drum pin axis=(0,1,0)
BODY load m=20 j=(1,1,1) z=-2
ROPE r 0(0,0,1) load slack=0 pay={0.15*angle(axle)}
TORQUE brake axle tau=-20""",
        f"formulation={formulation} reltol=1e-8",
        "10m 0.8",
        f"0 0 {-G}",
        "z(load) angle(axle) tension(r) length(r)",
    )
    a = (20 * G - 20 / 0.15) / (20 + 0.05 / 0.0225)
    down = 0.5 * a * np.asarray(r["time"]) ** 2
    np.testing.assert_allclose(r["z(load)"], -2 - down, atol=1e-7)
    np.testing.assert_allclose(r["angle(axle)"], down / 0.15, atol=1e-6)
    np.testing.assert_allclose(r["tension(r)"], 20 * (G - a), rtol=1e-7)
    np.testing.assert_allclose(r["length(r)"], 3 + down, atol=1e-7)
    assert abs(r.energy.share) < 1e-10


# in space ---------------------------------------------------------------------------------------------

SPHERE = "BODY bob m=2 j=(0.01,0.01,0.01) x=0.8 z=-0.6 vy=1.5\nROPE r 0 bob slack=0"


@BOTH
def test_a_spherical_pendulum_on_a_rope(formulation):
    """m (x vy - y vx) stays, and the rope is as long as ever."""
    r = run(SPHERE, f"formulation={formulation} reltol=1e-9", "10m 2", f"0 0 {-G}",
            "x(bob) y(bob) z(bob) vx(bob) vy(bob) tension(r) mode(r)")  # fmt: skip
    x, y, z = (np.asarray(r[f"{c}(bob)"]) for c in "xyz")
    np.testing.assert_allclose(np.sqrt(x * x + y * y + z * z), 1.0, atol=1e-9)
    spin = x * np.asarray(r["vy(bob)"]) - y * np.asarray(r["vx(bob)"])
    np.testing.assert_allclose(spin, 0.8 * 1.5, rtol=1e-7)
    assert min(r["mode(r)"]) == 1.0 and min(r["tension(r)"]) > 1.0
    assert abs(r.energy.share) < 1e-9


@BOTH
def test_across_a_bar_the_rope_goes_as_a_helix(formulation):
    """Over a bar along y to a bob that swings along it: the shortest of all ways from the anchor, by a search."""
    radius = 0.2
    r = run(
        f"BODY bob m=1 j=(1m,1m,1m) x=0.2 z=-0.5 vy=1.2\nROPE r 0(-0.6,0,-0.3) 0 bob r=(0,{radius},0) axis=(0,1,0) slack=0",
        f"formulation={formulation} reltol=1e-9",
        "50m 1",
        f"0 0 {-G}",
        "x(bob) y(bob) z(bob) gap(r)",
    )

    def shortest(bob):
        # in the plane across y: tangents from both points, the angle between them
        ends = [(-0.6, -0.3), (bob[0], bob[2])]
        free = [sqrt(u * u + w * w - radius**2) for u, w in ends]
        angle = [atan2(w, u) for u, w in ends]
        lean = [np.arccos(radius / np.hypot(u, w)) for u, w in ends]
        bend = angle[0] % (2 * pi) - lean[0] - (angle[1] + lean[1])
        way = lambda h: (  # noqa: E731
            np.hypot(free[0], h[0]) + np.hypot(radius * bend, h[1]) + np.hypot(free[1], bob[1] - h[0] - h[1])
        )
        return minimize(way, [0.1 * bob[1], 0.1 * bob[1]], method="BFGS", options={"gtol": 1e-10}).fun

    ways = [shortest(bob) for bob in zip(r["x(bob)"], r["y(bob)"], r["z(bob)"], strict=True)]
    assert max(np.abs(r["y(bob)"])) > 0.3
    np.testing.assert_allclose(ways, ways[0], rtol=1e-7)
    np.testing.assert_allclose(r["gap(r)"], 0.0, atol=1e-9)
    assert abs(r.energy.share) < 1e-9


# what does not matter, and what is refused ------------------------------------------------------------


def test_the_order_of_cards_and_the_way_along_the_rope_do_not_matter():
    """Backwards along the rope every pulley has its other side."""
    cards = ATWOOD.splitlines()
    found = []
    for deck in (
        cards,
        [cards[6], *cards[2::-1], *cards[3:6]],
        [*cards[:6], "ROPE r b w a r=(0,0.1,0) grip=2 slack=0"],
    ):
        r = run("\n".join(deck), prints="pos(sa) angle(pin) tension(r,1)", tran="10m 0.3")
        found.append((r["pos(sa)"][-1], r["angle(pin)"][-1], r["tension(r,1)"][-1]))
    assert found[1] == pytest.approx(found[0], rel=1e-9)
    assert found[2][:2] == pytest.approx(found[0][:2], rel=1e-9)
    assert found[2][2] == pytest.approx(1 * (G + G / 5), rel=1e-8)  # its first stretch is the other's second


BOB = "BODY bob m=1 j=1m x=1\n"
IN_SPACE = "BODY bob m=1 j=(1m,1m,1m) x=1 z=-1\n"


@pytest.mark.parametrize(
    ("cards", "code", "said"),
    [
        (BOB + "ROPE r 0 bob k=1 slack=0 length=1", "E230", "needs one of slack="),
        (BOB + "ROPE r 0 bob r=(0,0.1,0) slack=0", "E232", "3 number.s. for 2 places"),
        (BOB + "ROPE r 0 bob grip=2 slack=0", "E238", "names place 2"),
        (BOB + "ROPE r 0 0(0.5,1) bob grip=2 length=2", "E232", "2 stretch"),
        (BOB + "ROPE r 0 bob slack=-1", "E238", "cannot be below 0"),
        (BOB + "ROPE r 0 bob length=0.9", "E258", "its way at the start is 1 m"),
        (BOB + "ROPE r 0(1.05,0) bob r=(0.1,0) slack=0", "E257", "lies in the pulley"),
        (BOB + "ROPE r 0(1,0) bob slack=0", "E257", "coincide"),
        ("BODY f fixed=yes x=1\n" + BOB + "ROPE r 0 f slack=0", "E240", "nothing moves its places"),
        (BOB + "ROPE r 0 0(1,1) 0(2,1) bob r=(0,0.1,0.1,0) slack=0", "E238", "would leave its pulley"),
        (BOB + "ROPE r 0 bob slack=0 e=2", "E238", "more energy than they had"),
        (BOB + "ROPE r 0 bob slack=0 c=2", "E240", "belongs to k="),
        (BOB + "ROPE r 0 bob slack=0 pay={time}", "E252", "reads time"),
        (BOB + "ROPE r 0 0(0.5,1) bob grip=2 slack=0 pay={x(bob)}", "E240", "is for one stretch"),
        (BOB + "ROPE r 0 bob slack=0 axis=(0,1)", "E232", "three components"),
        (IN_SPACE + "ROPE r 0 0(1,1) bob r=(0,0.1,0) slack=0", "E230", "their axis is not known"),
        (IN_SPACE + "ROPE r 0(0,0,3) bob r=(0.1,0) axis=(0,1,0) slack=0", "E240", "is held by a pulley"),
        (
            IN_SPACE + "ROPE r 0 bob 0(3,0) r=(0,0.1,0) axis=(0,1,0) slack=0",
            "E240",
            "does not keep its direction",
        ),
        (BOB + "ROPE r 0 bob slack=0\n.print tran force(r)", "E249", "it has: tension.r., gap.r."),
    ],
)
def test_what_a_rope_cannot_be_is_said_by_name(cards, code, said):
    with pytest.raises(emsim.DeckError, match=said) as error:
        run(cards)
    assert code in {d.code for d in error.value.diagnostics}


def test_two_places_that_come_together_are_told():
    """A bob that has wound up all of its rope."""
    r = run(
        "BODY bob m=1 j=1m x=-0.05 y=-1 vx=5\nROPE r 0 bob r=(0.05,0) slack=0",
        "reltol=1e-7",
        "10m 2.001",
        "0",
        "length(r)",
    )
    said = [d for d in r.diagnostics if d.code == "W401"]
    assert len(said) == 1 and "no free part is left" in said[0].message


def test_a_rope_that_would_leave_one_of_two_pulleys_is_told():
    """Beside another pulley it is held; the bob is thrown over."""
    r = run("BODY bob m=1 j=1m x=0.6 y=-1 vx=5 vy=9\nROPE r 0(-0.6,-1) 0(-0.5,0) 0(0.5,0) bob r=(0,-0.1,-0.1,0) slack=0",
            "reltol=1e-6", "10m 1", prints="x(bob)")  # fmt: skip
    assert any(d.code == "W401" and "at place 3" in d.message for d in r.diagnostics)
