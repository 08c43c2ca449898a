"""A card against its specification: what is missing, unknown, out of range, of the wrong kind."""

import pytest
from machines import machine, only_error, problems

from emsim.cards import CARDS

ARM = "BODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin\n"

TWO = "BODY a m=1 j=1\nBODY b m=1 j=1\nJOINT j 0 a pin\nJOINT k 0 b pin\n"

BAD = {
    # missing and unknown
    "spring_without_k": (ARM + "POT p a b 0 hinge range=(0,1)", "E230", "needs r="),
    "motor_misspelt": (ARM + "MOTOR m a 0 hinge kt=1 gera=3\nR1 a 0 1", "E231", "gera="),
    "body_without_mass": ("BODY a shape=rod(1)\nJOINT j 0 a pin", "E230", "needs m="),
    "too_few_terminals": (ARM + "MOTOR m a hinge kt=1", "E233", "terminal"),
    # values
    "negative_mass": ("BODY a m=-1\nJOINT j 0 a pin", "E238", "mass"),
    "negative_damping": (ARM + "DAMPER d hinge c=-1", "E238", "damping"),
    "negative_inertia": ("BODY a m=1 j=-1\nJOINT j 0 a pin", "E238", "negative"),
    "angle_for_mass": ("BODY a m=3deg j=1\nJOINT j 0 a pin", "E256", "deg"),
    "length_for_stiffness": (ARM + "SPRING s hinge k=3mm", "E256", "mm"),
    "expression_for_mass": ("BODY a m={1+v(x)} j=1\nJOINT j 0 a pin\nR1 x 0 1\nV1 x 0 1", "E232", "number"),
    "empty_range": (ARM + "POT p a b 0 hinge r=1k range=(1,1)", "E232", "range="),
    "shape_unknown": ("BODY a shape=rod(1,2,3) m=1\nJOINT j 0 a pin", "E232", "rod(..)"),
    "shape_of_no_size": ("BODY a shape=rod(0) m=1\nJOINT j 0 a pin", "E232", "greater than zero"),
    "axis_of_no_length": ("BODY a m=1 j=1\nJOINT j 0 a slide axis=(0,0)", "E232", "direction"),
    "too_many_ic": ("BODY a m=1 j=1\nJOINT j 0 a pin ic=(1,2,3)", "E232", "3 values"),
    "force_without_direction": (ARM + "FORCE f arm dir=(0,0) 3", "E232", "direction"),
    "two_energies": (ARM + "TRANSDUCER t a 0 hinge C={1n} L={1m}\nR1 a 0 1", "E252", "exactly one"),
    "spring_q0_between_points": (ARM + "SPRING s 0 arm.com k=1 q0=1", "E240", "l0="),
    "spring_of_no_direction": ("BODY a m=1 j=1\nSPRING s 0 a k=3 l0=1", "E257", "coincide"),
    # kinds of joints
    "screw": ("BODY a m=1 j=1\nJOINT j 0 a screw", "E230", "needs lead="),
    "weld_has_no_coordinate": ("BODY a m=1\nJOINT j 0 a weld ic=3", "E240", "no coordinate"),
    "pot_on_weld": ("BODY a m=1\nJOINT j 0 a weld\nPOT p x y 0 j r=1k range=(0,1)\nR1 x 0 1", "E241", "weld"),
    "radius_on_a_pin": (ARM + "MOTOR m a 0 hinge kt=1 radius=1\nR1 a 0 1", "E240", "radius="),
    # names
    "motor_of_a_transistor_s_name": (
        ARM + "M1 a a 0 0 nm\n.model nm nmos\nMOTOR m1 a 0 hinge kt=1 r=1\nR1 a 0 1",
        "E135",
        "thing with a current",
    ),
    "unknown_body": ("BODY arm m=1 j=1\nJOINT j 0 amr pin", "E235", "amr"),
    "unknown_joint": (ARM + "SPRING s hnige k=1", "E236", "hnige"),
    "body_for_joint": (ARM + "DAMPER d arm c=1", "E236", "is a body"),
    "same_body_twice": (ARM + "JOINT j arm arm(1,0) pin", "E237", "itself"),
    "spring_within_a_body": (ARM + "SPRING s arm arm(1,0) k=1", "E237", "SPRING s ties arm to itself"),
    "damper_within_a_body": (ARM + "POINT arm.tip 1 0\nDAMPER d arm.tip arm c=1", "E237", "itself"),
    "spring_within_the_ground": (ARM + "SPRING s 0 0(1,0) k=1", "E237", "itself"),
    "length_below_zero": (ARM + "BODY b m=1\nJOINT j arm b rod l=-1", "E238", "-1; the length of a rod must be"),
    "energy_of_a_joint": (ARM + "TORQUE t arm tau={ke(hinge)}", "E249", "ke() reads a body; hinge"),
    "gap_in_metres": ("BODY a m=1 j=1 fixed=yes x=1\nJOINT k 0 a pin", "E242", "1 m are left at k"),
    "gap_in_radians": ("BODY a m=1 j=1 fixed=yes angle=1\nJOINT k 0 a slide", "E242", "1 rad are left at k"),
    "body_named_as_ground": ("BODY 0 m=1 j=1", "E234", "ground"),
    "point_of_nothing": (ARM + "POINT leg.tip 1 2", "E235", "leg"),
    "no_such_point": (ARM + "SPRING s 0 arm.tpi k=1\nPOINT arm.tip 1 0", "E235", "arm.tpi"),
    "model_missing": (ARM + "MOTOR m a 0 hinge model=faulhaber\nR1 a 0 1", "E253", "faulhaber"),
    # gears and drives
    "gear_to_itself": (ARM + "GEAR g hinge hinge ratio=2", "E237", "itself"),
    "gear_ratio_zero": (TWO + "GEAR g j k ratio=0", "E238", "0"),
    "motor_gear_zero": (ARM + "MOTOR m a 0 hinge kt=1 r=1 gear=0\nR1 a 0 1", "E238", "gear="),
    "model_gear_zero": (
        ARM + "MOTOR m a 0 hinge model=s\n.model s dcmotor kt=1 r=1 gear=0\nR1 a 0 1", "E238", "gear="
    ),
    "drive_and_ic": (ARM.replace("pin", "pin ic=(1,1)") + "DRIVE d hinge q={time}", "E244", "1 and 0 of hinge"),
    "drive_and_ic_speed": (ARM.replace("pin", "pin ic=(0,2)") + "DRIVE d hinge q={time}", "E244", "speed 2 and 1"),
    "drive_speed_and_ic": (ARM.replace("pin", "pin ic=(5,2)") + "DRIVE d hinge qd=3", "E244", "speed 2 and 3"),
    "efficiency": (TWO + "GEAR g j k ratio=2 eta=1.9", "E238", "eta"),
    "lead_between_pins": (TWO + "GEAR g j k lead=1m", "E240", "lead="),
    "driven_twice": (ARM + "DRIVE d hinge q={time}\nDRIVE e hinge q={2*time}", "E245", "twice"),
    "drive_of_the_state": (ARM + "DRIVE d hinge q={angle(hinge)}", "E251", "more than time"),
    "drive_circle": (ARM + "DRIVE d hinge qd={2*omega(hinge)}", "E251", "prescribes"),
    "effort_circle": (ARM + "TORQUE t arm tau={torque(u)}\nTORQUE u arm tau={torque(t)}", "E255", "decides"),
    # inertia and space
    "massless": ("BODY a m=0\nJOINT j 0 a pin", "E243", "no inertia"),
    "point_mass_on_its_axis": ("BODY a m=1\nJOINT j 0 a pin", "E243", "no inertia"),
    "massless_slide": ("BODY a m=0\nJOINT j 0 a slide", "E243", "no mass"),
    "one_inertia_in_space": ("BODY a m=1 j=1\nJOINT j 0 a pin axis=(1,0,0)", "E248", "out of the plane"),
    "free_in_space": (ARM + "BODY b m=1 j=(1,1,1)\nBODY c m=1\nJOINT k arm b pin axis=(1,0)", "E248", "c turns out of the plane"),
}  # fmt: skip

SLED = "BODY a m=1 j=1\nJOINT j 0 a slide"
PIN = "BODY a m=1 j=1\nJOINT j 0 a pin"
DISH = "BODY a m=1 j=1\nJOINT j 0 a planar"

# cards -> the number that does not fit, and the unit that would
UNITS = {
    SLED + " ic=30deg": ("30deg", "in m where"),
    SLED + " zero=30deg": ("30deg", "in m where"),
    SLED + " guess={-30deg}": ("30deg", "in m where"),
    SLED + " ic=(1,30rpm)": ("30rpm", "in m/s where"),
    PIN + " ic=30mm": ("30mm", "in rad where"),
    PIN + " zero=30mm": ("30mm", "in rad where"),
    PIN + " ic=(100rpm,\n+ 30deg)": ("100rpm", "in rad where"),
    PIN + " ic=(10deg,\n+ 30mm)": ("30mm", "in rad/s where"),
    DISH + " ic=(1mm,2mm,3deg,1mm,2deg,3rpm)": ("2deg", "in m/s where"),
    DISH + " zero=3mm": ("3mm", "in rad where"),
    PIN.replace("pin", "pinslot") + " zero=3deg": ("3deg", "in m where"),
    PIN + "\nPOT p a b 0 j r=1k range=(0,150mm)": ("150mm", "in rad where"),
    SLED + "\nPOT p a b 0 j r=1k range=(0,150deg)": ("150deg", "in m where"),
    PIN + "\nSPRING s j k=1 q0=30mm": ("30mm", "in rad where"),
    PIN + "\nSTOP s j k=1 max=30mm": ("30mm", "in rad where"),
    SLED + "\nDRIVE d j q=30deg": ("30deg", "in m where"),
    SLED + "\nDRIVE d j qd=30rpm": ("30rpm", "in m/s where"),
    PIN + "\nDRIVE d j qd=SIN(0 30mm 1)": ("30mm", "in rad/s where"),
    PIN + "\nTORQUE t j tau=SIN(0 1 60rpm)": ("60rpm", "Hz"),
    PIN + "\nTORQUE t j tau=3deg": ("3deg", "in N m;"),
    PIN + "\nFORCE f a dir=(1,0) PWL(0 0 1 3mm)": ("3mm", "in N;"),
    "BODY a m=1 j=1\nJOINT j 0 a(1deg,0) pin": ("1deg", "a point of JOINT j is in m;"),
    PIN + "\nPOINT a.tip 1 3deg": ("3deg", "POINT a.tip is in m;"),
    "BODY a m=1 shape=rod(3deg)\nJOINT j 0 a pin": ("3deg", "in m;"),
    PIN + "\nMOTOR m x 0 j kt=1 r=1 gear=3deg": ("3deg", "no unit"),
}


@pytest.mark.parametrize("cards", UNITS)
def test_a_unit_that_the_joint_does_not_have_is_refused_at_its_number(cards):
    number, words = UNITS[cards]
    error = only_error(cards)
    assert error.code == "E256" and words in error.message and error.span.text == number


@pytest.mark.parametrize(
    "cards",
    [
        SLED + " ic=(1mm,30mm) zero=2cm",
        PIN + " ic=(30deg,100rpm) zero=1rad guess=2deg",
        DISH + " ic=(1mm,2mm,3deg,1mm,2mm,3rpm)",
        PIN.replace("pin", "weld") + " zero=30deg",
        PIN + "\nSPRING s j k={3/30mm} q0=-30deg",
        PIN + "\nDRIVE d j qd=PWL(0 30rpm 1 2deg)",
        "BODY a m=1 j=1 vx=30mm omega=3rpm",
    ],
)
def test_units_that_fit_pass(cards):
    assert not [d for d in problems(cards) if d.severity == "error"]


@pytest.mark.parametrize("name", BAD)
def test_a_bad_card_is_named_with_its_cause(name):
    cards, code, words = BAD[name]
    error = only_error(cards)
    assert error.code == code, f"{error.code}: {error.message}"
    assert words in error.message
    assert error.span is not None


def test_missing_parameter_shows_the_form():
    error = only_error(ARM + "POT p a b 0 hinge range=(0,1)\nR1 a 0 1")
    assert error.hint is not None and CARDS["POT"].spec.form in error.hint


def test_misspelt_parameter_is_suggested():
    assert only_error(ARM + "MOTOR m a 0 hinge kt=1 gera=3\nR1 a 0 1").hint == "did you mean gear=?"


def test_a_failed_card_is_blamed_once():
    """What hangs on a card with an error says nothing of its own."""
    error = only_error("BODY arm m=-1\nJOINT hinge 0 arm pin\nSPRING s hinge k=1\nPOINT arm.tip 1 0")
    assert error.code == "E238"


def test_several_errors_come_at_once():
    codes = {
        d.code
        for d in problems("BODY a m=-1\nBODY b j=1 shape=disc(0) m=1\nJOINT j 0 c pin")
        if d.severity == "error"
    }
    assert codes == {"E238", "E232", "E235"}


def test_every_parameter_says_what_it_is():
    for card in CARDS.values():
        assert card.spec.form.startswith(card.spec.word)
        for name, param in card.spec.params.items():
            assert param.meaning, f"{card.spec.word} {name}="
            assert f"{name}=" in card.spec.form or param.kind in ("value", "vector") or not param.required


def test_the_guess_of_a_geared_joint_is_one_of_its_leader():
    m = machine(TWO.replace("a pin", "a pin guess=30deg") + "GEAR g j k ratio=10")
    assert [(c.q_name, round(c.start, 6)) for c in m.own] == [("angle(k)", 0.05236)]


@pytest.mark.parametrize(
    ("card", "code", "words"),
    [
        ("FORCE f 0(0.1,0) dir=(1,0) 1", "W238", "FORCE f has no effect: it acts on the ground"),
        ("FORCE f wall fx=1", "W238", "acts on wall, which is fixed"),
        ("TORQUE t wall tau=1", "W238", "acts on wall, which is fixed"),
        ("SPRING s 0 wall(1,0) k=1", "W238", "acts on the ground and wall, which is fixed"),
        ("BODY post m=1 fixed=yes vx=2", "W232", "vx= of BODY post has no effect: it is fixed"),
        ("BODY post m=1 fixed=yes angle=2", None, ""),
        ("SPRING s arm(1,0) wall(1,1) k=1", None, ""),
    ],
)
def test_what_acts_on_nothing_that_moves_is_said(card, code, words):
    found = problems(ARM + ".gravity 9.81\nBODY wall m=1 fixed=yes x=1\n" + card)
    assert [d.code for d in found] == [code] * (code is not None) and all(words in d.message for d in found)


@pytest.mark.parametrize(
    "cards",
    [
        PIN + " zero=-90",
        PIN + " ic=(45,1)",
        PIN + "\nPOT p x y 0 j r=1k range=(-150,150)",
        PIN + "\nDRIVE d j q=PULSE(0 30 1)",
        PIN + "\nSPRING s j k=1 q0=180",
        "BODY a m=1 j=1 angle=20",
    ],
)
def test_angles_that_read_like_degrees_are_questioned(cards):
    assert [d.code for d in problems(cards) if d.code == "W239"] == ["W239"]


@pytest.mark.parametrize(
    "cards",
    [
        PIN + " zero=-90deg ic=(1,90)",
        PIN + " zero=20rad ic=6.5",
        PIN + "\nDRIVE d j qd=PULSE(0 100 1)",
        PIN + "\nDRIVE d j q=PWL(0 0 10 1)",
        SLED + " ic=10",
        SLED + "\nPOT p x y 0 j r=1k range=(0,20)",
        "BODY a m=1 j=1 x=20 omega=30",
    ],
)
def test_radians_speeds_and_lengths_are_not(cards):
    assert "W239" not in {d.code for d in problems(cards)}


def test_a_mix_up_is_told_at_the_x_line():
    error = only_error(PIN + "\nR1 n 0 1\n.subckt s n h\nMOTOR m n 0 h kt=1 r=1\n.ends\nX1 j n s")
    assert error.code == "E236" and error.span.text == "n" and error.span.line == 8


HINTS = {
    PIN + " zero=-pi/2": "stands in braces: {-pi/2}",
    PIN + " zero=\u221290deg": "write `-90deg`",
    PIN + " zero=-90 deg": "right behind its number, as in 90deg",
    PIN + " ic=1,2": "a list stands in parentheses",
    "BODY a m=0,2 j=1": "decimals have a dot",
    "BODY a m=big j=1": "stands in braces: {big}",
    "BODY a m=1 shape=rod(l)": "stands in braces: {l}",
    PIN + "\nTORQUE t j tau=sin(time)": "stands in braces: {sin(time)}",
    PIN + "\nTORQUE t j tau=-1m*omega(j)": "stands in braces: {-1m*omega(j)}",
    PIN + "\nTORQUE t j tau=SIN(0 high 1)": "stands in braces: {high}",
    PIN + "\nTORQUE t j tau={-omega}": "omega(name)",
    PIN + "\nTORQUE t j tau={sin(t)}": "called `time`",
    PIN + "\nTORQUE t j tau={theta(j)}": "angle(j)",
    PIN + "\nTORQUE t j tau={x(a,1,0)}": "x(a(1, 0))",
    PIN + "\nSPRING s j k=5N/m": "write `5`",
    PIN + "\nMOTOR m 0 0 j kt=20mNm/A": "write `20m`",
    PIN + "\nJOINT k 0 b pin\nBODY b m=1 j=1\nGEAR g j k 2": "needs ratio= or lead=",
    "BODY a m=1 j=1\nJOINT j world a pin": "0 (the ground)",
}


@pytest.mark.parametrize("cards", HINTS)
def test_what_to_write_instead_is_said(cards):
    assert HINTS[cards] in (only_error(cards).hint or "")
