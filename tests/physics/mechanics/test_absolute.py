"""Maximal coordinates against joint coordinates: two sets of equations of one machine, which share no closure row, no
mass matrix and no multiplier, must move alike and transmit the same forces."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support import NETLISTS, deck, with_options

import emsim
from emsim.diagnostics import DeckError

# what a deck needs beyond the rule: (reltol, .tran); a run at full length where neither is given. Spans are cut where what the
# deck is for has been seen: two turns of windows, a strip that whips, 40 periods of a bridge, joints that rub in turn
SPECIAL = {
    "mechanical/ref_double_pendulum": (1e-11, "0.05 2"),  # chaotic
    "mechanical/bricard": (1e-8, "10m 1"),
    # forty flat windows in maximal coordinates: radau stops beside one at most tolerances tighter and looser than this
    "mechanical/ref_n_four_bar_40": (6e-9, "0.2 4"),
    # nothing is left to integrate: how good the forces are is a matter of the step alone
    "mechanical/driven_slider_crank": (1e-9, "5m 0.5 0 0.5m"),
    "mechanical/scotch_yoke": (1e-9, "2m 0.4 0 0.5m"),
    "coupled/slider_crank_hbridge": (4e-7, "20u 4m"),  # thousands of switchings
    "coupled/pendulum_servo": (1e-7, "1m 0.2"),
    "coupled/cart_pole": (1e-9, "1m 3.5"),
    "coupled/comb_drive": (3e-9, "1u 1m"),
    "coupled/ref_comb_drive": (1e-9, "50u 1m"),
    # one pace for both: two paces of their own know the motion to the tolerance, forces at a row only without its ripple
    "coupled/chain50_converter": (1e-8, "0.1m 0.4m UIC"),
    # the motion agrees to 1e-9 at each tolerance; the force has the rounding of what stretches the strip, 1e-5 below this
    "mechanical/flexible_pendulum": (1e-8, "10m 0.3"),
    # at 1e-9 a pawl is let go 2 us late under radau: the curve inside a step behind an event begins where its stages point,
    # 7e-10 m from its start, so that an event in its first nanosecond is seen at once, twelve times
    "mechanical/ratchet": (1e-8, None),
    # tighter, pins that go round the corners of pallets are taken off and put back many times, each of which is a short step
    "mechanical/pin_wheel_clock": (1e-7, None),
    # from behind the first row, whose forces, of the first 1e-12 s beside events, are good to 1e-2 where something moves already
    "mechanical/domino_wave": (1e-9, "1m 0.45 1m"),
    # to before the bounces end, which they do where they rise less than the tolerance
    "mechanical/ref_stop_pendulum": (1e-9, "50m 5.25"),
    "mechanical/ref_fric_arm10": (1e-9, "0.1 4"),
    "mechanical/gyroscope_gimbals": (1e-9, "2m 1"),
    "mechanical/bevel_differential": (1e-9, "5m 1"),
    "mechanical/bicycle": (1e-9, "5m 1.5"),
    "mechanical/arm6": (1e-9, "5m 0.7"),
    "mechanical/slider_crank_flexible": (1e-9, "0.1m 4m"),  # its steps are those of the rod swaying
    # the same: tighter, the pull on the clamp in the last row is of a leaf stretched by 1e-15 m more in one of them
    "coupled/vibration_sensor": (1e-8, "0.2m 0.2"),
    "coupled/ref_pwm_hbridge_motor": (1e-9, "50u 0.2 UIC"),
}
# columns that only one of them has (quaternions), forces that nothing determines (redundant rows), forces and modes at
# instants of events, screws that count turns, no .tran at all: what these must do stands in tests/physics/test_zoo.py
ELSEWHERE = {
    "mechanical/ball_chain", "mechanical/heavy_top", "mechanical/rssr", "mechanical/stewart_springs", "mechanical/bennett",
    "mechanical/sarrus", "mechanical/backlash_pair", "mechanical/geneva", "mechanical/slider_crank_stop",
    "mechanical/stick_slip_belt",
    "mechanical/two_clutches", "mechanical/screw_jack", "mechanical/hooke_double", "mechanical/stewart_legs",
    "mechanical/ref_fric_slider_crank", "coupled/screw_jack_motor",
    "mechanical/torsion_chain", "mechanical/toggle_rests", "mechanical/ball_with_spin", "coupled/maglev_ball",
    "mechanical/beam_roll_up", "mechanical/beam_bend", "mechanical/fishing_rod",
    # shares of corners that nothing determines; columns of a body by itself; told as E418 there
    "mechanical/planks", "mechanical/rattleback", "mechanical/solids", "mechanical/gems", "mechanical/cans",
    "mechanical/rough_ball_joint",
}  # fmt: skip
MOVING = "A bicycle"  # its modes at speed are refused in absolute coordinates (E416: tests/physics/test_rolling.py)
DECKS = sorted(
    f"{kind}/{p.stem}" for kind in ("mechanical", "coupled") for p in (NETLISTS / kind).glob("*.cir")
)


def both(text: str, options: str = "", tran: str | None = None) -> tuple[emsim.Result, emsim.Result]:
    text = re.sub(r"(?m)^\.modes$", "*", text) if MOVING in text else text
    return tuple(  # type: ignore[return-value]
        emsim.run(with_options(text, f"{options} formulation={f}", tran=tran)) for f in ("joint", "absolute")
    )


def with_reactions(text: str) -> str:
    """The deck with every reaction of every joint printed; a machine inside a subcircuit keeps its own."""
    if ".subckt" in text.lower():
        return text
    joints = re.findall(r"(?im)^JOINT\s+(\S+)", text)
    spatial = "bricard" in text.lower()
    words = ("fx", "fy", "fz", "mx", "my", "mz") if spatial else ("fx", "fy", "mz")
    asked = " ".join(f"{w}({j})" for j in joints for w in words)
    return re.sub(r"(?im)^\.end\s*$", f".print tran {asked}\n.end", text)


def apart(joint: emsim.Result, absolute: emsim.Result) -> dict[str, float]:
    """Largest difference of every column on the print grid, over the largest value of that unit."""
    step, start, stop = joint.plots[0].grid
    times = np.linspace(start, stop, 1 + min(200, round((stop - start) / step)))
    times = np.round(times / step) * step
    columns = {n: [np.asarray(r.at(n, times)) for r in (joint, absolute)] for n in joint.names[1:]}
    peaks: dict[str, float] = {}
    for name, (a, _) in columns.items():
        unit = joint.plots[0].unit(name)
        peaks[unit] = max(peaks.get(unit, 0.0), np.abs(a).max())
    # moments are compared with forces at a metre where a machine has no moment of its own
    peaks["N m"] = max(peaks.get("N m", 0.0), 0.1 * peaks.get("N", 0.0))
    peaks["N"] = max(peaks.get("N", 0.0), peaks["N m"])
    peaks["J"] = max(peaks.get("J", 0.0), 1e-3)  # a sum that may stay 0
    return {
        name: np.abs(a - b).max() / (peaks[joint.plots[0].unit(name)] or 1.0)
        for name, (a, b) in columns.items()
    }


# windows that are flat twice a turn, with rows 0.7 ms beside: rounding of the motion, 1e-10, is 1e-3 of the forces there
# ... and forces of the first row that are, in coordinates of bodies, those of some microseconds later
MOTION_ALONE = ("mechanical/ref_n_four_bar", "mechanical/ref_n_four_bar_40", "coupled/puma560")


@pytest.mark.parametrize("name", [d for d in DECKS if d not in ELSEWHERE and "ref_andrews" not in d])
def test_both_formulations_agree(name):
    reltol, tran = SPECIAL.get(name, (1e-9, None))
    text = deck(name) if name in MOTION_ALONE else with_reactions(deck(name))
    pace = " method=auto" if "method=multirate" in text else ""
    found = apart(*both(text, f"reltol={reltol}{pace}", tran))
    worst = max(found, key=found.__getitem__)
    assert found[worst] < 2e-6, f"{worst}: {found[worst]:.2e}"


def test_coordinates_rows_and_their_price():
    """A four-bar has nine coordinates and eight rows, where joint coordinates need three and two; one freedom."""
    facts = emsim.check(with_options(deck("mechanical/ref_four_bar"), "formulation=absolute"))
    assert facts["unknowns"] == {"coordinate": 9, "speed": 9, "lambda": 8, "mu": 8}
    machine = facts["machine"]
    assert machine["degrees_of_freedom"] == 1 and machine["loops"] == [["b", "a", "d", "close"]]
    cost = facts["formulations"]
    assert (cost["joint"]["size"], cost["joint"]["rows"]) == (10, 2)
    assert (cost["absolute"]["size"], cost["absolute"]["rows"]) == (34, 8)
    assert cost["absolute"]["values"] == facts["operations"]["values"]
    # the other way round the same is said
    assert emsim.check(deck("mechanical/ref_four_bar"))["formulations"] == cost


def test_space_has_seven_coordinates_a_body():
    facts = emsim.check(with_options(deck("mechanical/bricard"), "formulation=absolute"))
    machine = facts["machine"]
    assert facts["unknowns"]["coordinate"] == 5 * 7 + 6  # and what follows the angle of each pin
    # 6 pins of 5 rows and 5 norms, one row redundant: it is a joint's, never a norm
    assert len(machine["constraint_rows"]) == 34 and machine["redundant_rows"] == ["p5 tilt 2"]
    assert machine["degrees_of_freedom"] == 1


PAN_AND_TILT = """pan and tilt
.gravity 0 -1 0
BODY base m=1 j=(1m,2m,1m)
BODY head m=0.5 com=(0.1,0,0.02) j=(0.5m,0.6m,0.7m)
JOINT pan  0 base pin axis=(0,1,0) ic=(0.3,5) damp=1m
JOINT tilt base(0,0.2,0) head pin axis=(0,0,1) ic=(-0.5,-25)
SPRING s tilt k=2m
.print tran {reactions}
.tran 20m 3
.end
"""


def test_angles_in_space_count_full_turns():
    """Two axes, both turning many times; a spring winds up on the second."""
    reactions = " ".join(f"{w}({j})" for j in ("pan", "tilt") for w in ("fx", "fy", "fz", "mx", "my", "mz"))
    joint, absolute = both(PAN_AND_TILT.format(reactions=reactions), "reltol=1e-9")
    assert np.abs(joint["angle(pan)"]).max() > 10 and np.abs(joint["angle(tilt)"]).max() > 10
    found = apart(joint, absolute)
    worst = max(found, key=found.__getitem__)
    assert found[worst] < 2e-6, f"{worst}: {found[worst]:.2e}"


def test_angles_in_the_plane_count_full_turns():
    text = "rotor\nBODY r m=1 j=1m\nJOINT h 0 r pin ic=(0,100)\nSPRING s h k=1m\n.tran 10m 2\n.end\n"
    _, absolute = both(text, "reltol=1e-9")
    assert np.abs(absolute["angle(h)"] - 100.0 * np.sin(np.asarray(absolute.time))).max() < 1e-6


def test_a_prescribed_speed_is_integrated():
    """DRIVE qd= of a joint that supplies no coordinate here; torque(d) is its row's multiplier."""
    text = (
        "fan\nBODY r m=1 com=(0.1,0) j=1m\nJOINT h 0 r pin\nDRIVE d h qd={5*sin(3*time)}\n.gravity 9.81\n"
        ".print tran angle(h) omega(h) torque(d) fx(h)\n.tran 10m 2 0 2m\n.end\n"
    )
    joint, absolute = both(text, "reltol=1e-9")
    assert np.abs(absolute["angle(h)"] - 5 / 3 * (1 - np.cos(3 * np.asarray(absolute.time)))).max() < 1e-8
    assert max(apart(joint, absolute).values()) < 2e-6


def test_starts_where_joint_coordinates_assemble():
    """guess= leaves two ways to close; both formulations take the same, and speeds of free joints stay."""
    text = (
        deck("mechanical/ref_four_bar")
        .replace("guess=86deg", "guess=-60deg")
        .replace("guess=56deg", "guess=-80deg")
    )
    text = text.replace("angle(a)", "angle(b) angle(d) omega(b) omega(d)")
    joint, absolute = both(text, "reltol=1e-8", tran="1m 1m")
    for name in ("angle(b)", "angle(d)", "omega(b)", "omega(d)"):
        assert absolute[name][0] == pytest.approx(joint[name][0], abs=1e-12)


def test_unknown_formulation_is_an_error():
    with pytest.raises(DeckError, match="did you mean `absolute`"):
        emsim.check(with_options(deck("mechanical/ref_four_bar"), "formulation=absolut"))


def test_what_is_wrong_is_said_once():
    text = (
        deck("mechanical/ref_four_bar")
        .replace("shape=rod(0.20)", "shape=rod(0.20)")
        .replace("0.22,0", "0.62,0")
    )
    with pytest.raises(DeckError) as trouble:
        emsim.check(with_options(text, "formulation=absolute"))
    errors = [d for d in trouble.value.diagnostics if d.severity == "error"]
    assert [d.code for d in errors] == ["E242"] and "b, a, d, close" in errors[0].message


@pytest.mark.parametrize("method", ["dop853", "rk45", "radau"])
def test_a_mass_that_only_slides_needs_no_inertia(method):
    """Its turn is no coordinate: an explicit method would not know the speed of it."""
    cards = "BODY b m=1\nJOINT h 0 b slide axis=(1,1) zero=0.2 ic=1\nSPRING s h k=100\n.gravity 0"
    run = emsim.run(
        f"t\n{cards}\n.options formulation=absolute method={method} reltol=1e-8\n.tran 1m 0.3\n.print tran pos(h)\n.end\n"
    )
    t = np.asarray(run.time)
    assert np.asarray(run["pos(h)"]) == pytest.approx(np.cos(10 * t), abs=1e-6)
