"""FRICTION and tc=: what sticks stays, what slides slides, and both begin and end when they should."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

import emsim

BELT = """a mass on a belt, held by a spring
BODY belt m=1
BODY m m=1
JOINT bj 0 belt slide axis=(1,0)
JOINT rub belt m slide axis=(1,0) ic=0
DRIVE d bj q={0.2*time}
FRICTION f rub fc={1/(1+3*abs(vel(rub)))}
SPRING s 0 m k=1
.options method=%s reltol=%g
.tran 1 30
.print tran x(m) force(f) mode(f)
.end
"""


def turns(r, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Times at which a signal jumps, and where its rows behind are."""
    value = np.asarray(r[name])
    k = np.flatnonzero(np.diff(value)) + 1
    return np.asarray(r.time)[k], k


@pytest.mark.parametrize(
    ("method", "errors"),
    [
        ("dop853", (1e-5, 1e-7, 1e-9)), ("rk45", (1e-4, 1e-6, 1e-9)), ("radau", (1e-5, 1e-7, 1e-9)),
        ("esdirk", (1e-3, 1e-5, 1e-8)), ("trbdf2", (1e-2, 1e-4, 1e-6)),
    ],
)  # fmt: skip
def test_stick_slip_has_its_period(method, errors):
    """Slips at t = 5, x = 1 exactly, sticks again at 9.295999525480155 (binary128 extrapolation, refs: stick_slip_belt)."""
    for reltol, error in zip((1e-3, 1e-6, 1e-9), errors, strict=True):
        r = emsim.run(BELT % (method, reltol))
        t, k = turns(r, "mode(f)")
        assert list(np.asarray(r["mode(f)"])[k][:4]) == [-1.0, 0.0, -1.0, 0.0]
        assert t[0] == pytest.approx(5.0, abs=max(error, 3e-8))
        assert t[1] == pytest.approx(9.295999525480155, abs=error)
        assert t[3] - t[1] == pytest.approx(12.00103129483058, abs=error)
        assert np.asarray(r["x(m)"])[k[1]] == pytest.approx(-0.5410063538700847, abs=error)


@pytest.mark.parametrize(
    ("reltol", "error", "most"), [(1e-3, 3.7e-7, 381), (1e-7, 2e-9, 550), (1e-9, 1e-10, 700)]
)
def test_stick_slip_is_cheap(reltol, error, most):
    """Evaluations of one period, from slip to slip; a run to the second stick takes few more than two."""
    runs = [
        emsim.run((BELT % ("auto", reltol)).replace(".tran 1 30", f".tran 1 {until}"))
        for until in (5.1, 17.1, 21.4)
    ]
    first, second, whole = (r.stats["evaluations"] for r in runs)
    t, _ = turns(runs[2], "mode(f)")
    assert abs(t[3] - t[1] - 12.00103129483058) < error
    assert second - first < most and whole < 700 + 2 * most
    assert runs[2].stats["events"] <= 5


def test_what_sticks_does_not_creep():
    """A block on a slope under its friction, for twelve days."""
    for method in ("auto", "radau"):
        r = emsim.run(f"""block
.gravity 3 -9.3
BODY block m=2 j=1
JOINT rail 0 block slide axis=(1,0)
FRICTION rub rail fc=7
.options method={method}
.tran 1e4 1e6
.print tran pos(rail) force(rub) mode(rub)
.end
""")
        assert np.abs(r["pos(rail)"]).max() < 1e-12 and set(r["mode(rub)"]) == {0.0}
        assert r["force(rub)"][-1] == pytest.approx(-6.0, rel=1e-9)


def test_a_brake_stops_in_finite_time_and_holds():
    r = emsim.run("""brake
BODY m m=1
JOINT rail 0 m slide axis=(1,0) ic=(0,1)
FRICTION br rail fc=PULSE(0 1 0.1 1p 1p 10 20)
.tran 0.1 2
.end
""")
    assert r["pos(rail)"][-1] == pytest.approx(0.6, abs=3e-12) and abs(r["vel(rail)"][-1]) < 1e-18
    loss = next(line for line in r.energy.lines if line.name == "br")
    assert loss.dissipated == pytest.approx(0.5, rel=1e-9)


def test_friction_of_rest_is_higher():
    """Pulled by a spring whose end moves: first slip when k v t = fs."""
    r = emsim.run("""pulled
BODY hook m=1
BODY block m=2
JOINT a 0 hook slide axis=(1,0)
JOINT rail 0 block slide axis=(1,0)
DRIVE d a q={0.1*time}
SPRING s hook block k=50
FRICTION rub rail fc=3 fs=5 vs=10m
.options reltol=1e-8
.tran 0.1 3
.print tran pos(rail) force(rub) mode(rub)
.end
""")
    assert turns(r, "mode(rub)")[0][0] == pytest.approx(5 / (50 * 0.1), abs=1e-6)
    assert np.min(r["force(rub)"]) > -5.0 - 1e-6


def test_two_elements_on_one_motion_hold_together():
    """Neither alone would hold 2.4 N m; the gear ties them: 1 + 2*0.8 = 2.6 N m."""
    deck = """geared
BODY wheel m=1 j=0.5
BODY pinion m=1 j=0.125
JOINT slow 0 wheel pin
JOINT fast 0 pinion pin
GEAR g1 fast slow ratio=2
FRICTION f1 slow fc=1
FRICTION f2 fast fc=0.8
TORQUE t1 slow tau={%g*time}
.options method=%s
.tran 0.1 2
.print tran angle(slow) torque(f1) torque(f2) mode(f1) mode(f2)
.end
"""
    for method in ("auto", "radau"):
        r = emsim.run(deck % (1.2, method))
        assert np.abs(r["angle(slow)"]).max() < 1e-16 and set(r["mode(f1)"]) == set(r["mode(f2)"]) == {0.0}
        held = np.asarray(r["torque(f1)"]) + 2 * np.asarray(r["torque(f2)"])
        assert np.abs(held + 1.2 * np.asarray(r.time)).max() < 1e-6
        r = emsim.run(deck % (2.6, method))  # gives way at t = 1
        t, _ = turns(r, "mode(f1)")
        assert t[-1] == pytest.approx(1.0, abs=1e-6)
        assert r["angle(slow)"][-1] == pytest.approx(2.6 / 6, rel=1e-5)  # 2.6 (t - 1)^3/6 over J = 1


def test_friction_on_a_joint_that_is_driven_takes_its_power():
    r = emsim.run("""driven
BODY m m=1
JOINT rail 0 m slide axis=(1,0)
DRIVE d rail q={sin(time)}
FRICTION rub rail fc=2
.options reltol=1e-6
.tran 10m 6
.print tran force(rub) loss()
.end
""")
    u = np.cos(np.asarray(r.time))
    assert np.abs(np.asarray(r["force(rub)"]) + 2 * np.sign(u))[np.abs(u) > 1e-3].max() < 1e-9
    assert np.min(r["loss()"]) > -1e-9


def test_a_motor_with_dry_friction_starts_late():
    """Its torque kt i must exceed tc first: i = (v/r)(1 - exp(-t r/l)) reaches tc/kt."""
    r = emsim.run(
        """motor
BODY rotor m=1 j=1e-3
JOINT shaft 0 rotor pin
V1 a 0 1
MOTOR m1 a 0 shaft kt=0.1 r=2 l=1 tc=20m
.options reltol=1e-8
.tran 0.1 3
.print tran omega(shaft) i(m1) mode(m1) torque(m1)
.ic
.end
""".replace(".tran 0.1 3", ".tran 0.1 3 uic").replace(".ic\n", "")
    )
    assert turns(r, "mode(m1)")[0][0] == pytest.approx(-0.5 * np.log(1 - 0.2 * 2), abs=1e-6)
    lost = next(line for line in r.energy.lines if line.name == "m1")
    assert lost.dissipated > 0 and abs(r.energy.residual) < 1e-8


def test_a_stiff_circuit_beside_friction():
    """A diode and a coil: implicit steps, the same modes."""
    r = emsim.run("""h-bridge
BODY rotor m=1 j=1e-4
JOINT shaft 0 rotor pin
V1 a 0 PULSE(0 12 1m 1u 1u 0.5m 1m)
D1 0 b dd
R1 a b 0.1
MOTOR m1 b 0 shaft kt=0.05 r=1 l=1m
FRICTION f shaft fc=50m
.model dd D(is=1n)
.tran 0.1m 60m
.options reltol=1e-5
.print tran omega(shaft) mode(f)
.end
""")
    assert r["omega(shaft)"][-1] > 1.0 and r["mode(f)"][0] == 0.0 and r["mode(f)"][-1] == 1.0
    assert abs(r.energy.residual) < 1e-3 * r.energy.supplied


def test_a_clutch_ties_two_shafts():
    """Momentum is shared, the difference of the energies is heat: w = J1 w1/(J1 + J2)."""
    r = emsim.run("""clutch
BODY a m=1 j=2
BODY b m=1 j=1
JOINT pa 0 a pin ic=(0,30)
JOINT pb a b pin ic=(0,-30)
FRICTION clutch pb fc={time > 0.1 ? 10 : 0}
.options reltol=1e-8
.tran 0.1 4
.print tran omega(pa) omega(pb) mode(clutch)
.end
""")
    assert r["omega(pa)"][-1] == pytest.approx(20.0, rel=1e-9) and r["omega(pb)"][-1] == 0.0
    heat = next(line for line in r.energy.lines if line.name == "clutch").dissipated
    assert heat == pytest.approx(0.5 * 2 * 30**2 - 0.5 * 3 * 20**2, rel=1e-7)


def test_friction_in_a_closed_loop():
    """A slider-crank whose piston rubs: the work of the torque is friction and kinetic energy; implicit methods alone."""
    deck = """slider-crank
BODY crank shape=rod(30m) m=20m
BODY rod shape=rod(100m) m=30m
BODY piston m=0.2 j=1e-5
JOINT shaft 0 crank pin
JOINT big crank(30m,0) rod pin
JOINT small rod(100m,0) piston pin
JOINT bore 0 piston slide axis=(1,0)
FRICTION rub bore fc=1
TORQUE t shaft tau=50m
.options reltol=1e-6%s
.tran 10m 2
.print tran angle(shaft) vel(bore) force(rub)
.end
"""
    r = emsim.run(deck % "")
    rub = next(line for line in r.energy.lines if line.name == "rub")
    speed, t = np.abs(r["vel(bore)"]), np.asarray(r.time)
    assert rub.dissipated == pytest.approx(np.trapezoid(speed, t), rel=2e-2)
    assert abs(r.energy.residual) < 1e-4 * rub.dissipated
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(deck % " method=dop853")
    assert "friction acts within a closed loop" in str(error.value)


@pytest.mark.parametrize("method", ["gauss4", "multirate"])
def test_methods_without_modes_say_so(method):
    with pytest.raises(emsim.ConvergenceError) as error:
        emsim.run(BELT % (method, 1e-6))
    assert "modes" in str(error.value)


def test_smooth_friction_creeps_as_it_must():
    """tanh has no rest: under half its friction the block creeps at vs atanh(1/2)."""
    r = emsim.run("""smooth
BODY m m=1
JOINT rail 0 m slide axis=(1,0)
FRICTION rub rail fc=4 vs=1m model=smooth
FORCE f m dir=(1,0) 2
.options reltol=1e-6
.tran 0.1 1
.print tran vel(rail)
.end
""")
    assert r["vel(rail)"][-1] == pytest.approx(1e-3 * np.arctanh(0.5), rel=1e-6)


def test_dry_friction_written_by_hand_is_told_of_the_card():
    r = emsim.run("""by hand
BODY m m=1
JOINT h 0 m slide axis=(1,0) ic=(0,1)
FORCE f m dir=(1,0) {-2*sgn(vel(h))+0.5}
.tran 10m 1
.end
""")
    said = [d for d in r.diagnostics if d.code == "W405"]
    assert said and "FRICTION" in (said[0].hint or "")


def test_a_pendulum_with_friction_loses_so_much_a_swing():
    """Small swings under Coulomb friction: the amplitude falls by 2 tc/(m g l) each half swing, a straight line."""
    r = emsim.run(f"""pendulum
.gravity 9.81
BODY bob m=1 j=0 com=(0,-1)
JOINT h 0 bob pin ic=20m
FRICTION f h fc=9.81m
.options reltol=1e-8
.tran 10m {20 * pi}
.print tran angle(h) mode(f)
.end
""")
    angle, half = np.asarray(r["angle(h)"]), pi / np.sqrt(9.81)
    peaks = [abs(np.interp(k * half, r.time, angle)) for k in range(9)]
    assert np.diff(peaks) == pytest.approx(-2e-3, rel=2e-2)
    assert r["mode(f)"][-1] == 0.0 and abs(angle[-1]) <= 1e-3


@pytest.mark.parametrize(
    ("card", "code", "words"),
    [
        ("fc=-1", "E238", "cannot be below 0"), ("fc=2 fs=1", "E238", "less than fc="), ("fc=1 mu=0.3", "E240", "both mu="),
        ("fc=1 model=smooth", "E230", "vs="), ("fc=1 fs=2 vs=1 model=smooth", "E240", "sticks nowhere"),
        ("fc=1 vs=0", "E238", "vs="), ("fc=1 b=-1", "E238", "b="), ("fc=1 model=soft", "E232", "exact, smooth"),
        ("fc=1 k=3", "E231", "k="), ("mu=0.3 mus=0.2", "E238", "less than mu="), ("mu=0.3 radius=1m", "E240", "is for a pin"),
        ("fc=1 radius=1m", "E240", "belongs to mu="), ("fc=1 mus=1", "E240", "belongs to mu="), ("mu=-1", "E238", "mu="),
        ("mu=1 model=smooth mus=2 vs=1", "E240", "sticks nowhere"),
    ],
)  # fmt: skip
def test_a_friction_that_cannot_be_is_told(card, code, words):
    with pytest.raises(emsim.DeckError) as error:
        emsim.compile(f"t\nBODY m m=1\nJOINT h 0 m slide axis=(1,0)\nFRICTION f h {card}\n.tran 1m 1\n.end\n")
    said = [d for d in error.value.diagnostics if d.severity == "error"]
    assert [d.code for d in said] == [code] and words in said[0].message, said
