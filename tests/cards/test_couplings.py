"""What couplings and elements contribute: signs, energies, consistency of both sides."""

import math

import pytest
from machines import generalised_force, machine, momentum, only_error, problems, reads, state, value

import emsim
from emsim.diagnostics import ConvergenceError, DeckError

ROTOR = "BODY rotor m=1 j=1m\nJOINT shaft 0 rotor pin\n"
SLED = "BODY sled m=2\nJOINT rail 0 sled slide axis=(1,0)\n"


def rows(m, name, at):
    """(Q, F) of a row after compiling, at a state."""
    x = state(m, at)
    system = m.b.compile()
    x = (x + [0.0] * system.n)[: system.n]
    k = system.names.index(name)
    return system.q(x, 0.0)[k], system.f(x, 0.0)[k]


# MOTOR -----------------------------------------------------------------------------------------------


def test_positive_current_turns_counter_clockwise():
    m = machine(ROTOR + "MOTOR m1 a 0 shaft kt=50m r=2 l=1m gear=30\nV1 a 0 1")
    at = {"i(m1)": 0.4}
    assert generalised_force(m, "angle(shaft)", at) == pytest.approx(30 * 0.05 * 0.4)
    assert reads(m, "torque", "m1", at=at) == pytest.approx(30 * 0.05 * 0.4)


def test_back_emf_and_resistance_oppose_the_voltage():
    """d/dt(l i) + r i + ke w - v = 0, w on the motor's side of the gear."""
    m = machine(ROTOR + "MOTOR m1 a 0 shaft kt=50m r=2 l=1m gear=30\nV1 a 0 1")
    q, f = rows(m, "m1", {"i(m1)": 0.4, "omega(shaft)": 3.0, "a": 5.0})
    assert q == pytest.approx(1e-3 * 0.4)
    assert f == pytest.approx(2 * 0.4 + 0.05 * 30 * 3.0 - 5.0)


def test_rotor_inertia_counts_with_the_gear_squared():
    m = machine(ROTOR + "MOTOR m1 a 0 shaft kt=50m r=2 j=2u gear=30\nV1 a 0 1")
    assert momentum(m, "angle(shaft)", {"omega(shaft)": 1.0}) == pytest.approx(1e-3 + 900 * 2e-6)


def test_viscous_friction_is_on_the_motor_side():
    m = machine(ROTOR + "MOTOR m1 a 0 shaft kt=50m r=2 b=1u gear=30\nV1 a 0 1")
    assert generalised_force(m, "angle(shaft)", {"omega(shaft)": 2.0}) == pytest.approx(-900e-6 * 2.0)


def test_belt_on_a_slide():
    """radius: F = kt i gear / radius, w = gear v / radius."""
    m = machine(SLED + "MOTOR m1 a 0 rail kt=30m r=1 radius=15m gear=2\nV1 a 0 1")
    assert generalised_force(m, "pos(rail)", {"i(m1)": 0.5}) == pytest.approx(0.03 * 0.5 * 2 / 0.015)
    assert rows(m, "m1", {"vel(rail)": 0.3})[1] == pytest.approx(0.03 * 2 * 0.3 / 0.015)


def test_kt_and_ke_equal_unless_both_are_given():
    for given in ("kt=7m", "model=small\n.model small dcmotor ke=7m", "kt=7m ke=7m"):
        m = machine(ROTOR + f"V1 a 0 1\nMOTOR m1 a 0 shaft r=1 {given}")
        assert reads(m, "torque", "m1", at={"i(m1)": 1.0}) == pytest.approx(7e-3)
        assert m.imbalances == []


def test_power_from_nowhere_is_counted():
    m = machine(ROTOR + "MOTOR m1 a 0 shaft kt=0.124 ke=0.145 r=1\nV1 a 0 1")
    ((name, power),) = m.imbalances
    assert name == "m1"
    assert value(m, power, {"i(m1)": 2.0, "omega(shaft)": 10.0}) == pytest.approx((0.124 - 0.145) * 20.0)


def test_motor_from_a_model():
    m = machine(ROTOR + "MOTOR m1 a 0 shaft model=small gear=3\n.model small dcmotor kt=10m r=4\nV1 a 0 1")
    assert reads(m, "torque", "m1", at={"i(m1)": 1.0}) == pytest.approx(0.03)
    assert rows(m, "m1", {"i(m1)": 1.0})[1] == pytest.approx(4.0)


# POT -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("q", [-0.02, 0.0, 0.015])
def test_wiper_divides_by_the_coordinate(q):
    m = machine(SLED + "POT p1 top w 0 rail r=10k range=(-25m,25m)\nV1 top 0 5\nRL w 0 1e12")
    share = (q + 0.025) / 0.05
    at = {"pos(rail)": q, "top": 5.0, "w": 5.0 * share}
    assert rows(m, "w", at)[1] == pytest.approx(0.0, abs=1e-9)
    m = machine(SLED + "POT p1 top w 0 rail r=10k range=(-25m,25m)\nV1 top 0 5\nRL w 0 1e12")
    assert reads(m, "i", "p1", at=at) == pytest.approx(5.0 / 10e3)
    assert reads(m, "p", "p1", at=at) == pytest.approx(25.0 / 10e3)


def test_wiper_stays_at_its_end_with_the_contact_resistance_left():
    m = machine(SLED + "POT p1 top w 0 rail r=10k range=(0,10m) rw=5\nV1 top 0 5\nRL w 0 1k")
    at = {"pos(rail)": 0.02, "top": 5.0, "w": 4.0}
    assert reads(m, "i", "p1", at=at) == pytest.approx(1.0 / 5.0)
    assert set(m.flag_warnings) == {"p1 high", "p1 low"}


def test_log_taper_has_a_tenth_at_half_the_way():
    m = machine(SLED + "POT p1 top w 0 rail r=10k range=(0,10m) taper=log\nV1 top 0 5\nRL w 0 1e12")
    at = {"pos(rail)": 5e-3, "top": 5.0, "w": 0.0}
    assert reads(m, "i", "p1", at=at) == pytest.approx(5.0 / 9e3)


def test_range_may_say_pi():
    """R theta / pi on a pin with range=(0,pi)."""
    m = machine(ROTOR + "POT p1 top w 0 shaft r=10k range=(0,pi)\nV1 top 0 5\nRL w 0 1e12")
    at = {"angle(shaft)": math.pi / 4, "top": 5.0, "w": 1.25}
    assert rows(m, "w", at)[1] == pytest.approx(0.0, abs=1e-9)


def test_wiper_beyond_its_end_at_the_start_is_said():
    found = problems(SLED + "POT p1 top w 0 rail r=10k range=(1m,9m)\nV1 top 0 5\nRL w 0 1k")
    assert [d.code for d in found] == ["W234"]


def test_a_wiper_that_leaves_its_end_is_solved_for():
    """At its end it has 100 S, a step later a thousandth of that: with the derivatives of the end every update is nothing."""
    deck = (
        SLED + "DRIVE d rail q={15m*sin(2*pi*time)}\nPOT p1 top w 0 rail r=10k range=(-10m,10m)\nRL w 0 5k\n"
    )
    r = emsim.run("pot\n" + deck + "V1 top 0 10\n.tran 1m 2\n.end", method="radau")
    for t, v in zip(r.time, r["v(w)"], strict=True):
        a = min(max(0.5 + 0.75 * math.sin(2 * math.pi * t), 1e-6), 1 - 1e-6)
        upper, lower = 1 / (10e3 * (1 - a)), 1 / (10e3 * a) + 1 / 5e3
        assert v == pytest.approx(10 * upper / (upper + lower), abs=1e-3)


# SPRING, DAMPER, FORCE, TORQUE -----------------------------------------------------------------------


def test_spring_on_a_joint_pulls_back_and_preload_adds():
    m = machine(SLED + "SPRING s rail k=150 q0=10m f0=0.1")
    at = {"pos(rail)": 0.03}
    expected = -150 * 0.02 - 0.1
    assert generalised_force(m, "pos(rail)", at) == pytest.approx(expected)
    assert reads(m, "force", "s", at=at) == pytest.approx(expected)
    assert reads(m, "pe", at=at) == pytest.approx(75 * 0.02**2 + 0.1 * 0.03)


@pytest.mark.parametrize("rest", [0.0, 0.5])
def test_spring_between_points_pulls_along_their_line(rest):
    m = machine(f"BODY puck m=1 j=1 x=0.3 y=0.4\nSPRING s 0 puck k=20 l0={rest}")
    at = {"x(puck)": 0.6, "y(puck)": 0.8}
    assert generalised_force(m, "x(puck)", at) == pytest.approx(-20 * (1 - rest) * 0.6)
    assert generalised_force(m, "y(puck)", at) == pytest.approx(-20 * (1 - rest) * 0.8)
    assert reads(m, "force", "s", at=at) == pytest.approx(-20 * (1 - rest))


def test_damper_linear_and_quadratic():
    m = machine(SLED + "DAMPER d rail c=3 c2=2")
    for u in (0.5, -0.5):
        expected = -3 * u - 2 * abs(u) * u
        assert generalised_force(m, "pos(rail)", {"vel(rail)": u}) == pytest.approx(expected)
    assert reads(m, "loss", at={"vel(rail)": 0.5}) == pytest.approx(3 * 0.25 + 2 * 0.125)


def test_damper_between_points_acts_on_the_distance_only():
    m = machine("BODY puck m=1 j=1 x=1\nDAMPER d 0 puck c=3")
    assert generalised_force(m, "y(puck)", {"vy(puck)": 1.0}) == pytest.approx(0.0)
    assert generalised_force(m, "x(puck)", {"vx(puck)": 1.0}) == pytest.approx(-3.0)


def test_joint_damping_takes_power():
    m = machine("BODY rotor m=1 j=1\nJOINT shaft 0 rotor pin damp=0.2")
    assert generalised_force(m, "angle(shaft)", {"omega(shaft)": 3.0}) == pytest.approx(-0.6)
    assert reads(m, "loss", at={"omega(shaft)": 3.0}) == pytest.approx(1.8)


def test_force_has_its_lever():
    m = machine("BODY arm m=1 j=1\nJOINT hinge 0 arm pin\nFORCE f arm(0.6,0) dir=(0,2) 5")
    at = {"angle(hinge)": 0.3}
    assert generalised_force(m, "angle(hinge)", at) == pytest.approx(5 * 0.6 * math.cos(0.3))
    assert reads(m, "force", "f", at=at) == pytest.approx(5.0)


def test_force_components_read_the_machine():
    m = machine("BODY puck m=1 j=1\nFORCE f puck fx={-3*x(puck)} fy={2*vy(puck)}")
    at = {"x(puck)": 2.0, "vy(puck)": 0.5}
    assert generalised_force(m, "x(puck)", at) == pytest.approx(-6.0)
    assert generalised_force(m, "y(puck)", at) == pytest.approx(1.0)


def test_effort_is_held_constant():
    """A torque that depends on the state has no gradient of its own in the equations of motion."""
    m = machine(ROTOR + "TORQUE t shaft tau={omega(shaft)*omega(shaft)}")
    assert generalised_force(m, "angle(shaft)", {"omega(shaft)": 3.0}) == pytest.approx(9.0)


def test_torque_on_a_body_far_down_the_chain():
    m = machine("BODY a m=1 j=1\nBODY b m=1 j=1\nJOINT j 0 a pin\nJOINT k a(1,0) b pin\nTORQUE t b tau=0.7")
    assert generalised_force(m, "angle(j)", {}) == pytest.approx(0.7)
    assert generalised_force(m, "angle(k)", {}) == pytest.approx(0.7)


def test_waveform_torque():
    m = machine(ROTOR + "TORQUE t shaft tau=SIN(0 10 5)")
    assert generalised_force(m, "angle(shaft)", {}, t=0.05) == pytest.approx(10.0)


# TRANSDUCER ------------------------------------------------------------------------------------------

CAPACITIVE = {
    "C": "C={1n/(1m-pos(rail))}",
    "W": "W={0.5*v(t)*v(t)*1n/(1m-pos(rail))}",
}
INDUCTIVE = {
    "L": "L={1m/(2m-pos(rail))}",
    "W": "W={0.5*i(t)*i(t)*1m/(2m-pos(rail))}",
    "saturating": "W={1m/(2m-pos(rail))*(sqrt(1+i(t)*i(t))-1)}",
}


@pytest.mark.parametrize("form", CAPACITIVE)
def test_capacitive_force_and_charge_come_from_one_energy(form):
    """dF/dv = dQ/dx: the mixed second derivatives of W' agree."""
    deck = SLED + f"TRANSDUCER t a 0 rail {CAPACITIVE[form]}\nV1 a 0 1\nR1 a 0 1k"
    m = machine(deck)
    at = {"pos(rail)": 2e-4, "a": 30.0}
    force = 0.5 * 900 * 1e-9 / (0.8e-3) ** 2
    assert reads(m, "force", "t", at=at) == pytest.approx(force, rel=1e-12)
    assert generalised_force(m, "pos(rail)", at) == pytest.approx(force, rel=1e-12)
    card = m.couplings["t"]
    dq_dx = m.b.grad(m.public(card.conjugate), [m.joints["rail"].q])[0]
    df_dv = m.b.grad(m.public(card.effort), [m.b.x(m.ctx.nodes["a"])])[0]
    assert value(m, dq_dx, at) == pytest.approx(value(m, df_dv, at), rel=1e-12)
    assert rows(m, "a", at)[0] == pytest.approx(30.0 * 1e-9 / 0.8e-3, rel=1e-12)


@pytest.mark.parametrize("form", INDUCTIVE)
def test_inductive_force_and_flux_come_from_one_energy(form):
    deck = SLED + f"TRANSDUCER t a 0 rail {INDUCTIVE[form]}\nV1 a 0 1\nR1 a 0 1k"
    m = machine(deck)
    at = {"pos(rail)": 5e-4, "i(t)": 2.0}
    card = m.couplings["t"]
    dflux_dx = m.b.grad(m.public(card.conjugate), [m.joints["rail"].q])[0]
    df_di = m.b.grad(m.public(card.effort), [m.b.x(m.ctx.branches["t"])])[0]
    assert value(m, dflux_dx, at) == pytest.approx(value(m, df_di, at), rel=1e-12)
    inductance = 1e-3 / 1.5e-3
    flux = inductance * (2.0 / math.sqrt(5.0) if form == "saturating" else 2.0)
    q, _ = rows(m, "t", at)
    assert q == pytest.approx(flux, rel=1e-12)


def test_voltage_and_current_coupling_is_lossless():
    m = machine(SLED + "TRANSDUCER t a 0 rail K={3+100*pos(rail)}\nV1 a 0 1\nR1 a 0 1k")
    at = {"pos(rail)": 0.01, "vel(rail)": 0.5, "i(t)": 2.0}
    assert generalised_force(m, "pos(rail)", at) == pytest.approx(4.0 * 2.0)
    assert reads(m, "power", "t", at=at) == pytest.approx(4.0)
    assert rows(m, "t", {**at, "a": 0.0})[1] == pytest.approx(4.0 * 0.5)


def test_stored_energy_is_counted():
    m = machine(SLED + "TRANSDUCER t a 0 rail C={1n/(1m-pos(rail))}\nV1 a 0 1\nR1 a 0 1k")
    at = {"pos(rail)": 0.0, "a": 10.0, "vel(rail)": 3.0}
    assert reads(m, "energy", at=at) == pytest.approx(0.5 * 1e-6 * 100 + 0.5 * 2 * 9)


# GEAR, DRIVE -----------------------------------------------------------------------------------------

TRAIN = "BODY a m=1 j=0.1\nBODY b m=1 j=2\nJOINT j1 0 a pin\nJOINT j2 0 b pin\n"


def test_gear_replaces_a_coordinate():
    m = machine(TRAIN + "GEAR g j1 j2 ratio=10\nTORQUE t j1 tau=1")
    assert [c.q_name for c in m.own] == ["angle(j2)"] and not m.rows
    assert momentum(m, "angle(j2)", {"omega(j2)": 1.0}) == pytest.approx(2 + 100 * 0.1)
    assert generalised_force(m, "angle(j2)", {}) == pytest.approx(10.0)
    assert reads(m, "angle", "j1", at={"angle(j2)": 0.2}) == pytest.approx(2.0)


def test_gear_hands_the_start_on():
    m = machine(TRAIN.replace("JOINT j1 0 a pin", "JOINT j1 0 a pin ic=(1,10)") + "GEAR g j1 j2 ratio=10")
    (c,) = m.own
    assert (c.start, c.start_speed) == pytest.approx((0.1, 1.0))


def test_lead_screw_either_way_round():
    screw = "BODY r m=1 j=1m\nBODY nut m=2\nJOINT jr 0 r pin\nJOINT jn 0 nut slide axis=(1,0)\n"
    for gear in ("GEAR g jn jr lead=10m", "GEAR g jr jn lead=10m"):
        m = machine(screw + gear)
        turn = {"angle(jr)": 2 * math.pi} if m.own[0].q_name == "angle(jr)" else {"pos(jn)": 0.01}
        assert reads(m, "pos", "jn", at=turn) == pytest.approx(0.01)
        assert reads(m, "angle", "jr", at=turn) == pytest.approx(2 * math.pi)


def test_ring_of_gears_gets_one_constraint():
    """Three gears on three shafts: two coordinates are replaced, the third gear says nothing new."""
    three = TRAIN + "BODY c m=1 j=1\nJOINT j3 0 c pin\n"
    m = machine(three + "GEAR g1 j1 j2 ratio=2\nGEAR g2 j2 j3 ratio=3\nGEAR g3 j1 j3 ratio=6")
    assert len(m.own) == 1 and not m.rows and m.found.dof == 1


def test_drive_needs_no_unknown():
    m = machine(ROTOR + "DRIVE d shaft q={0.5*sin(6*time)}")
    assert m.own == [] and m.rows == []
    assert reads(m, "angle", "shaft", t=0.1) == pytest.approx(0.5 * math.sin(0.6))
    assert reads(m, "omega", "shaft", t=0.1) == pytest.approx(3.0 * math.cos(0.6))


def test_driven_speed_is_integrated():
    m = machine(ROTOR + "V1 a 0 3\nDRIVE d shaft qd={2*v(a)}")
    assert m.own == [] and len(m.given) == 1
    assert reads(m, "omega", "shaft", at={"a": 3.0}) == pytest.approx(6.0)
    _, f = rows(m, "angle(shaft)", {"a": 3.0})
    assert f == pytest.approx(-6.0)


def test_drive_moves_what_hangs_on_it():
    """A pendulum on a driven cart feels its acceleration: p has m l cos(q) times the speed of the cart."""
    m = machine(
        ".gravity 9.81\nBODY cart m=1\nBODY bob m=2 com=(0.5,0)\nJOINT rail 0 cart slide\n"
        "JOINT h cart bob pin zero=-90deg\nDRIVE d rail q={0.1*sin(4*time)}"
    )
    at = {"angle(h)": 0.3, "omega(h)": 0.7}
    p = value(m, m.momentum[id(m.own[0])][0], at, t=0.2)
    assert p == pytest.approx(2 * 0.25 * 0.7 + 2 * 0.5 * math.cos(0.3) * 0.4 * math.cos(0.8))


COMB = "BODY b m=1m\nJOINT h 0 b slide\nSPRING s h k=10\nV1 a 0 1\nV2 c 0 1\n"
LAWS = {
    "C={1p*(1+time)}": "time",
    "L={1m*(1+(time>1?2:0))}": "time",
    "W={0.5*i(t)^2*(1+time)}": "time",
    "C=SIN(1p 1p 1)": "time",
    "C={1p*(1+vel(h))}": "vel(h)",
    "C={1p*(1+v(c))}": "v(c)",
    "W={0.5*v(t)^2*(1+v(c))}": "v(c)",
}


@pytest.mark.parametrize("law", LAWS)
def test_an_energy_that_changes_by_itself_is_refused(law):
    """Its derivatives are no balance: the ledger blamed the integrator for it."""
    error = only_error(COMB + f"TRANSDUCER t a 0 h {law}")
    assert error.code == "E252" and f"the coordinate; {LAWS[law]} would do work" in error.message


@pytest.mark.parametrize(
    "law", ["K={1+time}", "K={1+v(c)}", "C={1p*(1+pos(h))}", "W={1p*v(t)^2*(1+pos(h)^2)}"]
)
def test_what_stores_nothing_may_read_anything(law):
    assert not [d for d in problems(COMB + f"TRANSDUCER t a 0 h {law}") if d.severity == "error"]


@pytest.mark.parametrize(
    ("card", "divisor"),
    [("TRANSDUCER t a 0 h C={1p/pos(h)}", "pos(h)"), ("TRANSDUCER t a 0 h C={1p/(2*pos(h))}", "2*pos(h)"),
     ("FORCE f b dir=(1,0) {1/vel(h)}", "vel(h)"), ("B1 d 0 V={v(a)/pos(h)^2+1/pos(h)}\nR1 d 0 1", "pos(h)^2")],
)  # fmt: skip
@pytest.mark.parametrize("analysis", [".op", ".tran 1m 1"])
def test_a_pole_at_the_start_is_shown(card, divisor, analysis):
    with pytest.raises(DeckError) as trouble:
        emsim.run(f"t\n{COMB}{card}\n{analysis}\n.end\n")
    found = [d for d in trouble.value.diagnostics if d.code == "E283"]
    assert found and found[0].span.text == divisor and "at the start" in found[0].message


def test_a_pole_that_a_condition_avoids_is_none():
    emsim.run(f"t\n{COMB}FORCE f b dir=(1,0) {{pos(h)>1m ? 1u/pos(h) : 0}}\n.tran 1m 10m\n.end\n")


@pytest.mark.parametrize("analysis", ["op", "tran"])
def test_no_infinite_value_is_a_result(analysis):
    with pytest.raises(ConvergenceError) as trouble:
        emsim.run(
            f"t\n{COMB}.{analysis}{' 1m 10m' * (analysis == 'tran')}\n.print {analysis} v(a)/pos(h)\n.end\n"
        )
    (found,) = trouble.value.diagnostics
    assert found.code == "E412" and "v(a)/pos(h) is not finite" in found.message
