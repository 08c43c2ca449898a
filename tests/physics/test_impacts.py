"""Rigid STOP, CONTACT, GEAR with play, FREEWHEEL: impacts, rest, and what goes through a machine."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

import emsim

BALL = """a ball on the floor
.gravity 9.81
BODY ball m=2 j=1
JOINT lift 0 ball slide axis=(0,1) ic=1
{card} e={e}
.options reltol={reltol:g} {more}
.tran 0.1 {until}
.print tran pos(lift) vel(lift) hits(floor) gap(floor) force(floor) mode(floor) impulse(floor)
.end
"""


TWO = "t\nBODY m m=1 j=1\nBODY other m=1\nJOINT way 0 m slide axis=(1,0)\nJOINT o 0 other slide axis=(1,0)\n"


def first(r, name: str, value: float) -> int:
    """Index of the row from which on a signal has a value."""
    return int(np.flatnonzero(np.asarray(r[name]) == value)[0])


@pytest.mark.parametrize(
    "card", ["STOP floor lift min=0", "CONTACT floor ball 0 line=(0,1)", "CONTACT floor ball 0(0,-3) rq=3"]
)
def test_a_bouncing_ball_comes_to_rest(card):
    """Zeno: impact n at t1 (1 + 2 e (1 - e^(n-1))/(1 - e)), rest from t1 (1 + e)/(1 - e) on (refs: bouncing_ball_zeno)."""
    for reltol, error in ((1e-3, 1e-4), (1e-6, 1e-6), (1e-9, 1e-7)):
        r = emsim.run(BALL.format(card=card, e=0.8, reltol=reltol, more="", until=5))
        t = np.asarray(r.time)
        for n, impact in ((1, 0.45152364098573090), (2, 1.1739614665629004), (10, 3.5788929510204383)):
            assert t[first(r, "hits(floor)", n)] == pytest.approx(impact, abs=error)
        k = first(r, "hits(floor)", 1)
        assert r["vel(lift)"][k] == pytest.approx(3.543557534456016, rel=1e-6)
        assert r.stats["events"] < 150
        assert (
            abs(r["pos(lift)"][-1]) < 1e-9
            and abs(r["vel(lift)"][-1]) < 1e-12
            and abs(r["mode(floor)"][-1]) == 1
        )
        assert r["force(floor)"][-1] == pytest.approx(2 * 9.81, rel=1e-9)
        assert np.min(r["gap(floor)"]) > -max(0.1 * reltol, 1e-8)
        floor = next(line for line in r.energy.lines if line.name == "floor")
        assert (
            floor.dissipated == pytest.approx(2 * 9.81, rel=max(0.1 * reltol, 1e-6))
            and abs(r.energy.residual) < 1e-4
        )


def test_impulses_are_changes_of_momentum():
    r = emsim.run(BALL.format(card="STOP floor lift min=0", e=0.5, reltol=1e-8, more="", until=0.6))
    v = sqrt(2 * 9.81)
    assert r["impulse(floor)"][-1] == pytest.approx(2 * 1.5 * v, rel=1e-7)


@pytest.mark.parametrize("method", ["radau", "esdirk", "trbdf2", "trap", "gear"])
def test_every_implicit_method_bounces(method):
    r = emsim.run(
        BALL.format(card="STOP floor lift min=0", e=0.5, reltol=1e-5, more=f"method={method}", until=2)
    )
    assert r["hits(floor)"][-1] > 5 and abs(r["pos(lift)"][-1]) < 1e-6
    assert np.asarray(r.time)[first(r, "hits(floor)", 2)] == pytest.approx(0.4515236409857 * 2, abs=1e-3)


def test_explicit_methods_refuse_rigid_stops_by_name():
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(
            BALL.format(card="STOP floor lift min=0", e=0.5, reltol=1e-5, more="method=dop853", until=2)
        )
    assert "rigid stops" in str(error.value)


def test_an_impact_goes_through_a_closed_loop():
    """The piston of a slider-crank meets a stop: every link is thrown back, w+ = -e w-, and energy falls by e^2."""
    r = emsim.run("""slider-crank against a stop
BODY crank shape=rod(30m) m=20m
BODY rod shape=rod(100m) m=30m
BODY piston m=0.2 j=1e-5
JOINT shaft 0 crank pin ic=(90deg,20)
JOINT big crank(30m,0) rod pin
JOINT small rod(100m,0) piston pin
JOINT bore 0 piston slide axis=(1,0)
STOP end bore min=80m e=0.6
.options reltol=1e-8
.tran 1m 50m
.print tran omega(shaft) vel(bore) ke() hits(end)
.end
""")
    k = first(r, "hits(end)", 1)
    assert r["vel(bore)"][k] == pytest.approx(-0.6 * r["vel(bore)"][k - 1], rel=1e-6)
    assert r["omega(shaft)"][k] == pytest.approx(-0.6 * r["omega(shaft)"][k - 1], rel=1e-6)
    assert r["ke()"][k] == pytest.approx(0.36 * r["ke()"][k - 1], rel=1e-6)


def test_an_impact_goes_through_motor_and_circuit():
    """A current cannot jump: behind the impact it is what it was, and the speed has turned round."""
    r = emsim.run("""motor against a stop
BODY arm m=1 j=1e-3
JOINT hinge 0 arm pin
V1 a 0 6
MOTOR m1 a 0 hinge kt=0.1 r=2 l=10m j=1e-4
STOP end hinge max=1 e=0.4
.options reltol=1e-7
.tran 1m 1
.print tran omega(hinge) i(m1) hits(end) torque(end)
.end
""")
    k = first(r, "hits(end)", 1)
    assert r["omega(hinge)"][k] == pytest.approx(-0.4 * r["omega(hinge)"][k - 1], rel=1e-5)
    assert r["i(m1)"][k] == pytest.approx(r["i(m1)"][k - 1], rel=1e-6)
    # it comes to rest against the end and stalls: v/r, kt v/r
    assert r["i(m1)"][-1] == pytest.approx(3.0, rel=1e-4) and r["torque(end)"][-1] == pytest.approx(
        -0.3, rel=1e-4
    )
    assert abs(r.energy.residual) < 1e-5 * r.energy.supplied


def test_a_row_of_masses_hands_an_impact_on():
    """Equal masses, e = 1: the first stops, the last goes; all at once they would go at -0.6 0.4 0.4 0.4 0.4."""
    cards = "".join(
        f"BODY b{k} m=1 j=1\nJOINT s{k} 0 b{k} slide axis=(1,0) ic=({k if k else -1},{0 if k else 1})\n"
        for k in range(5)
    )
    cards += "".join(f"CONTACT c{k} b{k + 1} b{k} r=0.5 rq=0.5 e=1\n" for k in range(4))
    r = emsim.run(f"row\n{cards}.tran 0.1 3\n.end\n")
    v = [r[f"vel(s{k})"][-1] for k in range(5)]
    assert v == pytest.approx([0, 0, 0, 0, 1], abs=1e-9)


def test_a_stack_rests_and_its_forces_add_up():
    r = emsim.run("""three blocks dropped
.gravity 9.81
BODY a m=1
BODY b m=2
BODY c m=3
JOINT ja 0 a slide axis=(0,1) ic=0.5
JOINT jb 0 b slide axis=(0,1) ic=1.1
JOINT jc 0 c slide axis=(0,1) ic=1.6
STOP floor ja min=0 e=0.3
CONTACT ab b a line=(0,1) r=0.5 e=0.3
CONTACT bc c b line=(0,1) r=0.5 e=0.3
.options reltol=1e-6
.tran 0.1 4
.print tran pos(ja) pos(jb) pos(jc) force(floor) force(ab) force(bc) ke()
.end
""")
    assert [r[f"pos(j{k})"][-1] for k in "abc"] == pytest.approx([0.0, 0.5, 1.0], abs=1e-6)
    forces = [r[f"force({k})"][-1] for k in ("floor", "ab", "bc")]
    assert forces == pytest.approx([6 * 9.81, 5 * 9.81, 3 * 9.81], rel=1e-6)
    assert r["ke()"][-1] < 1e-12 and abs(r.energy.residual) < 1e-4


def test_no_impact_raises_the_energy():
    """Double pendulums that run into stops at both joints, at random."""
    rng, hits = np.random.default_rng(7), 0
    for _ in range(12):
        a, b, wa, wb, e = *rng.uniform(-1, 1, 2), *rng.uniform(-8, 8, 2), rng.uniform(0, 1)
        r = emsim.run(f"""double pendulum between stops
.gravity 9.81
BODY a shape=rod(0.5) m={rng.uniform(0.1, 2)}
BODY b shape=rod(0.4) m={rng.uniform(0.1, 2)}
JOINT ha 0 a pin zero=-90deg ic=({a},{wa})
JOINT hb a(0.5,0) b pin ic=({b},{wb})
STOP sa ha min=-1.2 max=1.1 e={e}
STOP sb hb min=-1.3 max=1.4 e={rng.uniform(0, 1)}
.options reltol=1e-7
.tran 20m 2
.print tran energy() hits(sa) hits(sb)
.end
""")
        assert np.max(np.diff(r["energy()"])) < 1e-5 * np.ptp([0.0, *r["energy()"]])
        hits += r["hits(sa)"][-1] + r["hits(sb)"][-1]
        for line in r.energy.lines:
            assert line.dissipated >= -1e-9
    assert hits > 20


def test_play_between_gears():
    """The driven wheel follows when the flank touches: after the play, by the ratio, and loses energy by Poisson's law."""
    deck = """gear with play
BODY a m=1 j=1
BODY b m=1 j=2
JOINT ja 0 a pin ic=(0,3)
JOINT jb 0 b pin
GEAR g ja jb ratio=2 backlash=0.2 %s
.options reltol=1e-7
.tran 1m 0.5
.print tran angle(ja) angle(jb) omega(ja) omega(jb) gap(g) hits(g) torque(g)
.end
"""
    r = emsim.run(deck % "e=0")
    # both with the flank closed: u1 = 2 u2, J1 u1 + J2 u2/2 kept
    assert r["omega(ja)"][-1] == pytest.approx(3 / (1 + 2 / 4), rel=1e-7)
    assert r["omega(jb)"][-1] == pytest.approx(0.5 * r["omega(ja)"][-1], rel=1e-7)
    assert np.asarray(r.time)[first(r, "hits(g)", 1)] == pytest.approx(0.1 / 3, abs=1e-7)
    r = emsim.run(deck % "e=1")
    assert r["omega(ja)"][-1] ** 2 + 2 * r["omega(jb)"][-1] ** 2 == pytest.approx(9, rel=1e-7)
    assert np.min(r["gap(g)"]) > -1e-8
    r = emsim.run(deck % "k=1meg e=0.5 n=1")
    assert r["hits(g)"][-1] >= 1 and np.min(r["gap(g)"]) < 0


def test_a_freewheel_runs_one_way():
    """Driven back and forth: only the forward half swings reach the wheel; it coasts in between."""
    r = emsim.run("""freewheel
BODY hub m=1 j=1e-3
BODY wheel m=1 j=1
JOINT a 0 hub pin
JOINT f hub wheel pin
DRIVE d a qd={sin(time)}
FREEWHEEL fw f dir=1
.options reltol=1e-7
.tran 10m 12
.print tran omega(wheel) omega(f) mode(fw) torque(fw)
.end
""")
    t, w = np.asarray(r.time), np.asarray(r["omega(wheel)"])
    assert np.all(np.diff(w) > -1e-7) and w[-1] == pytest.approx(1.0, rel=1e-5)
    assert np.min(r["torque(fw)"]) > -1e-9
    early = t < 1.5
    assert np.abs(w[early] - np.sin(t[early])).max() < 1e-5


def test_a_freewheel_takes_what_would_throw_it_back():
    """A mass meets a wall, e = 0.5; a ratchet holds what comes back: 3/4 of the energy is the wall's, the rest its own."""
    r = emsim.run("""ratchet
BODY m m=2
JOINT way 0 m slide axis=(1,0) ic=(0,3)
STOP wall way max=1 e=0.5
FREEWHEEL catch way dir=1
.tran 10m 1
.print tran vel(way) hits(catch) impulse(catch) energy()
.end
""")
    assert r["vel(way)"][-1] == pytest.approx(0.0, abs=1e-9) and r["hits(catch)"][-1] == 1.0
    assert r["impulse(catch)"][-1] == pytest.approx(2 * 1.5, rel=1e-6)
    taken = {line.name: line.dissipated for line in r.energy.lines}
    assert taken["wall"] == pytest.approx(6.75, rel=1e-6) and taken["catch"] == pytest.approx(2.25, rel=1e-6)
    assert abs(r.energy.residual) < 1e-6


@pytest.mark.parametrize(
    ("cards", "code", "words"),
    [
        ("STOP s way min=0.5", "E258", "0.5 m in each other"), ("CONTACT c m 0(1,0) line=(1,0)", "E258", "1 m in each other"),
        ("STOP s way min=0 e=-1", "E238", "e="), ("STOP s way min=0 n=2", "E240", "n="),
        ("STOP s way e=1 max=-1", "E258", "in each other"),
        ("FREEWHEEL s way dir=2", "E238", "1 or -1"), ("GEAR g way o ratio=1 backlash=1m", "E230", "needs e="),
        ("GEAR g way o ratio=1 k=1", "E240", "belongs to backlash="),
        ("GEAR g way o ratio=1 backlash=-1 e=0", "E238", "backlash="),
        ("CONTACT c m 0(-1,0) rq=2", "E258", "1 m in each other"),
        ("STOP s way min=0 stiffness=3", "E231", "stiffness="),
    ],
)  # fmt: skip
def test_what_cannot_touch_is_told(cards, code, words):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(TWO + f"{cards}\n.tran 1m 1\n.end\n")
    said = [d for d in error.value.diagnostics if d.severity == "error"]
    assert [d.code for d in said] == [code] and words in said[0].message, said
