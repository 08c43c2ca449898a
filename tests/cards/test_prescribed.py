"""Prescribed and geared motion: exact accelerations and efforts, reactions across the free axis, contradictions."""

import numpy as np
import pytest
from machines import only_error, problems

import emsim
from emsim.diagnostics import DeckError

W = 2 * np.pi
ROD = "BODY b shape=rod(1) m=1\nJOINT h 0 b pin\n.gravity 0\n"
SHAFTS = "BODY a m=1 j=0.1\nBODY b m=1 j=2\nJOINT j1 0 a pin\nJOINT j2 0 b pin\n"


def run(cards, names, options="", tran="1m 0.3"):
    r = emsim.run(f"test\n{cards}\n.tran {tran}\n.options {options}\n.print tran {names}\n.end\n")
    return np.asarray(r.time), [np.asarray(r[name]) for name in names.split()]


@pytest.mark.parametrize("method", ["trap", "gear", "radau"])
def test_accelerations_of_a_driven_joint_are_exact(method):
    """No quadrature of what is known: alpha, the drive's torque m l^2/3 alpha and the pin's force are formulas."""
    t, (alpha, torque, ax, fx) = run(
        ROD + "DRIVE d h q={.8*sin(2*pi*time)}",
        "alpha(h) torque(d) ax(b.com) fx(h)",
        f"method={method} reltol=1e-2",
        "20m 1",
    )
    q, u, a = 0.8 * np.sin(W * t), 0.8 * W * np.cos(W * t), -0.8 * W * W * np.sin(W * t)
    assert alpha == pytest.approx(a, abs=1e-9)
    assert torque == pytest.approx(a / 3, abs=1e-9)
    assert ax == pytest.approx(-0.5 * (a * np.sin(q) + u * u * np.cos(q)), abs=1e-9)
    assert fx == pytest.approx(ax, abs=1e-9)


ROUGH = ["max(0,time-.5)", "time>.5 ? time-.5 : 0", "pwl(time,0,0,1,1,2,0)", "floor(3*time)", "abs(time-.1)", "u(time-.1)",
         "sgn(time)", "min(time,.1)", "(time>.1)*time", "uramp(time-.1)", "int(time)", "nint(9*time)"]  # fmt: skip


@pytest.mark.parametrize("q", ROUGH)
def test_a_coordinate_with_corners_is_refused(q):
    """The body would be in two places, or its speed would jump unseen."""
    error = only_error(ROD + f"DRIVE d h q={{{q}}}")
    assert error.code == "E251" and "corners or jumps" in error.message and error.span.text == f"q={{{q}}}"


def test_a_constant_corner_is_none():
    assert not [d for d in problems(ROD + "DRIVE d h q={time^3+max(1,2)}") if d.severity == "error"]


def test_a_sine_without_delay_is_a_formula():
    """vo + va e^(-theta t) sin(2 pi f t + phase), and its exact acceleration."""
    t, (q, alpha) = run(ROD + "DRIVE d h q=SIN(0.1 0.5 3 0 2 90)", "angle(h) alpha(h)", "reltol=1e-2")
    s = -2 + 6j * np.pi
    assert q == pytest.approx(0.1 + 0.5 * (1j * np.exp(s * t)).imag, abs=1e-9)
    assert alpha == pytest.approx(0.5 * (1j * s * s * np.exp(s * t)).imag, abs=1e-9)


def test_a_sine_with_delay_says_its_corner():
    error = only_error(ROD + "DRIVE d h q=SIN(0 1 10 2m)")
    assert error.code == "E251" and "its delay, 0.002 s" in error.message


@pytest.mark.parametrize(
    ("qd", "jump"),
    [("time>.05 ? 1 : 0", "t = 0.05 s, from 0 to 1"), ("floor(30*time)", "t = 0.0333333 s, from 0 to 1"),
     ("max(0,time-.05)", ""), ("u(time-.05)*(time-.05)", ""), ("sin(9*time)", "")],
)  # fmt: skip
def test_a_speed_that_jumps_is_said_and_claims_no_balance(qd, jump):
    result = emsim.run(f"t\n{ROD}DRIVE d h qd={{{qd}}}\n.tran 1m 0.1\n.end\n")
    said = [d.message for d in result.diagnostics if d.code == "W237"]
    assert len(said) == bool(jump) and all(jump in text for text in said)
    assert not [d for d in result.diagnostics if d.code == "W415"]


def test_a_flag_of_time_does_not_hide_that_motion_is_known():
    t, (alpha,) = run(ROD + "DRIVE d h qd={time > 0.1 ? sin(9*time) : time*time}", "alpha(h)", "reltol=1e-2")
    away = abs(t - 0.1) > 1e-6
    expected = np.where(t > 0.1, 9 * np.cos(9 * t), 2 * t)
    assert alpha[away] == pytest.approx(expected[away], abs=1e-9)


def test_a_waveform_is_no_formula():
    """PULSE has corners that differentiation of an expression would not see: alpha is its slope all the same."""
    t, (alpha,) = run(ROD + "DRIVE d h qd=pulse(0 1 0.1 0.1 0.1 1 3)", "alpha(h)")
    assert alpha[(t > 0.12) & (t < 0.18)] == pytest.approx(10.0, rel=1e-6)
    assert alpha[(t > 0.22)] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("cut", ["", " cut=yes"])
def test_a_driven_pin_transmits_no_moment(cut):
    cards = ROD.replace("pin", "pin" + cut) + "DAMPER c h c=0.3\nDRIVE d h q={1.5*time*time}"
    t, (mz, torque) = run(cards, "mz(h) torque(d)")
    assert mz == pytest.approx(0.0, abs=1e-12)
    assert torque == pytest.approx(1.0 + 0.3 * 3 * t, rel=1e-6)


def test_geared_pins_transmit_no_moment():
    _, (first, second, torque) = run(
        SHAFTS + "GEAR g j1 j2 ratio=10\nTORQUE t j1 tau=1", "mz(j1) mz(j2) torque(g)"
    )
    assert first == pytest.approx(0.0, abs=1e-12) and second == pytest.approx(0.0, abs=1e-12)
    assert torque[-1] == pytest.approx(-1 / 6, rel=1e-6)


def test_a_driven_slide_transmits_across_its_axis_only():
    """Axis (1,1): of the weight m g, m g/2 along x and y remains."""
    _, (fx, fy) = run(
        "BODY a m=2 j=0.1\nJOINT s 0 a slide axis=(1,1)\n.gravity 10\nDRIVE d s q={0.1*sin(9*time)}",
        "fx(s) fy(s)",
    )
    assert fx == pytest.approx(-10.0, rel=1e-9) and fy == pytest.approx(10.0, rel=1e-9)


def test_a_driven_pin_in_space_transmits_no_moment_about_its_axis():
    _, (my, mz, torque) = run(
        "BODY b shape=rod(1) m=1 j=(0.1,0.1,0.1)\nJOINT h 0 b pin axis=(0,1,1)\n.gravity 9.81\nDRIVE d h q={3*time}",
        "my(h) mz(h) torque(d)",
    )
    assert my + mz == pytest.approx(0.0, abs=1e-9)
    assert abs(torque).max() > 1.0 and abs(mz).max() > 1.0


def test_a_slide_driven_on_a_turning_arm():
    """Both ways round, A and B swapped, the force is the opposite and has no part along the arm."""
    arm = "BODY arm m=1 j=1\nJOINT p 0 arm pin ic=(0,2)\nBODY a m=1 j=0.1\n"
    _, forth = run(
        arm + "JOINT s arm a slide\nDRIVE d s q={0.5+0.1*sin(9*time)}", "fx(s) fy(s) angle(p)", "reltol=1e-6"
    )
    _, back = run(
        arm + "JOINT s a arm slide\nDRIVE d s q={-0.5-0.1*sin(9*time)}", "fx(s) fy(s) angle(p)", "reltol=1e-6"
    )
    for fx, fy, q in (forth, back):
        assert fx * np.cos(q) + fy * np.sin(q) == pytest.approx(0.0, abs=1e-9)
        assert abs(fy).max() > 1.0
    assert forth[1][-1] == pytest.approx(-back[1][-1], rel=1e-4)


def test_an_ic_that_says_what_the_drive_says_is_fine():
    found = problems(ROD.replace("pin", "pin ic=(1,2)") + "DRIVE d h q={1+2*time}")
    assert not [d for d in found if d.severity != "note"]


def test_an_ic_whose_speed_a_node_prescribes_is_said_to_be_idle():
    found = problems(ROD.replace("pin", "pin ic=(1,2)") + "DRIVE d h qd={v(n)}\nV1 n 0 1")
    assert [d.code for d in found if d.severity == "warning"] == ["W235"]


def test_contradicting_gears_are_both_named():
    found = {d.code: d for d in problems(SHAFTS + "GEAR g1 j1 j2 ratio=2\nGEAR g2 j1 j2 ratio=3")}
    assert "g1" in found["W236"].message and "g2" in found["W236"].message
    assert found["N231"].severity == "note" and "no degree of freedom" in found["N231"].message


def test_agreeing_gears_and_driven_ones_are_not_remarked_on():
    for more in ("GEAR g2 j2 j1 ratio=0.5", "DRIVE d j2 q={time}"):
        assert not {"W236", "N231"} & {d.code for d in problems(SHAFTS + "GEAR g1 j1 j2 ratio=2\n" + more)}


MIXED = "BODY r m=1 j=1m\nJOINT j 0 r pin\nV1 n 0 1\n.subckt s n h\nMOTOR m n 0 h kt=1 r=1\n"


@pytest.mark.parametrize(
    "cards",
    [
        MIXED + "R1 h 0 1\n.ends\nX1 n j s",
        MIXED + ".ends\n.subckt outer n h\nX2 n h s\nR1 h 0 1\n.ends\nX1 n j outer",
    ],
)
def test_a_terminal_that_is_a_joint_and_a_node_is_an_error_at_the_x_line(cards):
    (error,) = problems(cards)
    assert error.code == "E136" and error.span is not None and error.span.text == "X1"
    assert "r1" in error.message and "MOTOR m" in error.message


def test_nodes_and_joints_of_one_name_stay_separate():
    found = problems(MIXED + ".ends\nX1 j j s\nR5 j 0 1")
    assert not [d for d in found if d.severity != "note"]


def trouble(cards, card):
    try:
        r = emsim.run(f"test\n{cards}\n{card}\n.end\n")
    except (DeckError, emsim.ConvergenceError) as error:
        return {d.code: d for d in error.diagnostics}
    return {d.code: d for d in r.diagnostics}


@pytest.mark.parametrize("load", ["TORQUE t j1 tau=1", ".gravity 9.81\nTORQUE t j1 tau=1"])
def test_no_equilibrium_is_told_in_mechanical_words(load):
    found = trouble("BODY a m=1 j=1\nJOINT j1 0 a pin\n" + load, ".op static")
    told = found.get("E410") or found["E411"]
    assert "no equilibrium" in told.message and "JOINT `j1`" in told.message
    assert "SPRING" in told.hint and "a path to ground" not in told.hint


@pytest.mark.parametrize(("method", "codes"), [("auto", ("E410", "W233")), ("radau", ("E411",))])
def test_a_change_point_start_is_told_in_mechanical_words(method, codes):
    links = "".join(f"BODY {n} shape=rod(1) m=1\n" for n in "abc")
    found = trouble(
        links + "JOINT p 0 a pin ic=0\nJOINT q a(1,0) b pin ic=0\nJOINT s 0(1,0) c pin ic=0\n"
        "JOINT r b(1,0) c(1,0) pin\nTORQUE t p tau=1",
        f".options method={method}\n.tran 1m 1",
    )
    # auto begins aside by rounding, and stops where the loop would jump; who goes on is warned
    told = next(found[code] for code in codes if code in found)
    assert "two ways" in told.message + told.hint or "another way of moving" in told.message
    assert "JOINT `" in told.message or "ic=" in told.hint
    assert "ground" not in told.hint


def test_a_motor_without_resistance_across_a_source_is_called_a_motor():
    found = trouble("BODY r m=1 j=1m\nJOINT s 0 r pin\nV1 a 0 1\nMOTOR m a 0 s kt=1", ".tran 1m 0.01")
    assert "motor winding" in found["W301"].message and "r=" in found["W301"].hint
