"""What machines with friction, stops, contacts and joints in space are held to: every figure, and the test that holds it.

`LADDERS` are decks with a closed form or a separate solution, at three tolerances: each has its bound, and the error falls.
`HELD` names, row by row, the figures that stand in tests elsewhere; a test here sees to it that those are there.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from reference_set import TRAJECTORIES, Trajectory
from scipy.integrate import quad
from scipy.optimize import brentq
from support import ROOT, deck, run

import emsim

TOLERANCES = ("1e-4", "1e-6", "1e-9")
Errors = Callable[[emsim.Result], float]
Ladder = tuple[str, str, Errors, tuple[float, float, float]]


def heavy_top(r: emsim.Result) -> float:
    """Extrapolation in binary128 (Gragg, Bulirsch and Stoer), 18 digits; body rates at t = 2 as parts of the spin."""
    want = {"wx(tip)": 0.1222332194973942, "wy(tip)": 150.0, "wz(tip)": -5.855624589205458}
    return max(abs(r.at(name, 2.0) - value) for name, value in want.items()) / 150.0


def precession(r: emsim.Result) -> float:
    """The axis keeps its 60 degrees and goes round at 3 rad/s; it begins in the plane x = 0."""
    t = np.asarray(r.time)
    where = {"x": -sqrt(0.75) * np.sin(3 * t), "y": sqrt(0.75) * np.cos(3 * t), "z": 0.5 + 0 * t}
    return max(float(np.abs(np.asarray(r[f"{k}(top.com)"]) - v).max()) for k, v in where.items())


def bouncing_ball(r: emsim.Result) -> float:
    """Time of the tenth impact, t1 (1 + 2 e (1 - e^9)/(1 - e)) [s]."""
    e = 0.8
    tenth = sqrt(2 / 9.81) * (1 + 2 * e * (1 - e**9) / (1 - e))
    return abs(float(np.asarray(r.time)[np.asarray(r["hits(floor)"]) >= 10][0]) - tenth)


def belt(r: emsim.Result) -> float:
    """Where the block is as it sticks again, and the same a period later (binary128)."""
    first = abs(r.at("pos(rail)", 9.295999525480155) + 0.5410063538700848)
    period = abs(r.at("pos(rail)", 8 + 12.00103129483058) - r.at("pos(rail)", 8.0))
    return max(first, period)


@cache
def swings() -> list[tuple[float, float]]:
    """(time, tilt) of a rocking block's first ten turning points, by Housner and quadrature."""
    b, h, m, g, tilt = 0.1, 0.3, 1.0, 9.81, 0.15
    a, inertia = float(np.arctan2(b, h)), 4 * m * (b * b + h * h) / 3
    ratio, weight = 1 - 1.5 * sin(a) ** 2, m * g * np.hypot(b, h)

    def quarter(top: float) -> float:
        """From the turning point down: s = sqrt(top - tilt) takes the end's root away."""

        def slowness(s: float) -> float:
            bent = sin(a - top + s * s / 2) * float(
                np.sinc(s * s / (2 * pi))
            )  # cos(a - top) - cos(a - x) = bent s^2
            return 2 / sqrt(2 * weight * bent / inertia)

        return quad(slowness, 0.0, sqrt(top), epsabs=1e-14, epsrel=1e-13)[0]

    t, found = 0.0, []
    for n in range(10):
        t += quarter(tilt)
        energy = ratio**2 * (cos(a - tilt) - cos(a))
        tilt = brentq(lambda x, energy=energy: cos(a - x) - cos(a) - energy, 0.0, a)
        t += quarter(tilt)
        found.append((t, tilt if n % 2 else -tilt))
    return found


def rocking(r: emsim.Result) -> float:
    return max(abs(r.at("angle(block)", t) - tilt) for t, tilt in swings()[:6])


def jack(r: emsim.Result) -> float:
    """Height of the load against that of the rhombus whose width the spindle's turns have left."""
    turns = 5 * np.asarray(r.time) ** 2
    width = 0.36 - 0.003 * turns
    return float(np.abs(2 * np.sqrt(0.04 - width * width / 4) - np.asarray(r["pos(lift)"])).max())


def screw(r: emsim.Result) -> float:
    """Speeds up and down of a screw that a motor drives, as parts of that up; standing still in between."""
    load, kt, ra = 50 * 9.81 * 4e-3 / (2 * pi), 0.2, 0.25
    up, down = (24 - ra * (0.5 + load) / kt) / kt, (-12 + ra * (0.5 - load) / kt) / kt
    rest = abs(r.at("z(load)", 1.0) - r.at("z(load)", 0.9)) / 4e-3
    return max(abs(r.at("omega(s)", 0.59) - up) / up, abs(r.at("omega(s)", 1.59) - down) / up, rest)


def legs(r: emsim.Result) -> float:
    """Length of each driven leg, two rods of 0.3 m and what is between them, against the distance of its ends [m]."""
    worst = 0.0
    for k in range(6):
        ends = [np.asarray(r[f"{x}({p}{k})"]) for p in ("lo", "plate.h") for x in "xyz"]
        apart = np.sqrt(sum((a - b) ** 2 for a, b in zip(ends[:3], ends[3:], strict=True)))
        worst = max(worst, float(np.abs(apart - 0.6 - np.asarray(r[f"pos(leg{k})"])).max()))
    return worst


LADDERS: dict[str, Ladder] = {
    "heavy_top": ("mechanical/heavy_top", "method=dop853", heavy_top, (1e-4, 1e-6, 1e-9)),
    "steady precession": ("mechanical/steady_precession", "", precession, (1e-4, 1e-6, 1e-9)),
    "bouncing_ball_zeno": ("mechanical/bouncing_ball", "", bouncing_ball, (2e-9, 2e-9, 2e-9)),
    "stick_slip_belt": ("mechanical/stick_slip_belt", "", belt, (1e-4, 1e-6, 1e-9)),
    "rocking block": ("mechanical/rocking_block", "", rocking, (1e-4, 1e-6, 1e-8)),
    "scissor jack": ("mechanical/scissor_jack", "", jack, (1e-6, 1e-6, 1e-9)),
    "screw that holds": ("coupled/screw_jack_motor", "", screw, (1e-6, 1e-8, 1e-10)),
    "stewart platform on legs": ("mechanical/stewart_legs", "", legs, (1e-6, 1e-6, 1e-9)),
}
FLOOR = 1e-12
INSTANT = 1e-9  # flights between impacts are exact at any tolerance: what is left is the instant behind which a hit counts [s]


@pytest.mark.parametrize("name", LADDERS)
def test_the_error_falls_with_the_tolerance(name: str) -> None:
    where, options, error, allowed = LADDERS[name]
    found = [error(run(deck(where), f"reltol={tol} {options}")) for tol in TOLERANCES]
    assert all(e <= a for e, a in zip(found, allowed, strict=True)), found
    assert found[2] <= max(0.1 * found[0], FLOOR) or max(found) <= INSTANT, found


# separate solutions of 12 digits: errors as parts of each signal's range
SOLUTIONS: dict[str, tuple[float, float, float]] = {
    "msl_rot_friction": (1e-5, 1e-7, 1e-9), "msl_trans_friction_stop": (1e-5, 1e-7, 1e-8), "msl_trans_brake": (1e-9, 1e-9, 1e-9),
    "msl_trans_elastogap": (1e-5, 1e-7, 1e-9), "msl_rot_backlash": (1e-5, 1e-7, 1e-8), "msl_moving_coil": (1e-5, 1e-6, 1e-8),
    "msl_solenoid_pullin": (1e-5, 1e-6, 1e-8), "msl_mb_fourbar_spatial": (1e-4, 1e-6, 1e-8),
    "fric_two_on_shaft": (1e-4, 1e-6, 1e-10), "fric_slider_crank_mu": (1e-5, 1e-6, 1e-8),
    "paper_motor_pendulum_kp30_friction": (1e-5, 1e-6, 1e-7), "stop_pendulum": (1e-4, 1e-6, 1e-8),
    "newton_cradle5": (1e-4, 1e-6, 1e-8), "arm6_swing": (1e-5, 1e-7, 1e-9), "ball_chain3": (1e-5, 1e-7, 1e-9),
    "stewart_springs": (1e-6, 1e-8, 1e-9), "universal_shaft": (1e-5, 1e-6, 1e-9),
}  # fmt: skip
IN_SPACE = [
    Trajectory(
        "mechanical/arm6",
        "arm6_swing",
        {**{f"q{k}": f"angle(q{k})" for k in range(1, 7)}, "zt": "z(b6(0.1,0,0))"},
    ),
    Trajectory(
        "mechanical/ball_chain",
        "ball_chain3",
        {"x1": "x(b1(0,-0.4,0))", "yt": "y(b3(0,-0.4,0))", "zt": "z(b3(0,-0.4,0))"},
    ),
    Trajectory(
        "mechanical/stewart_springs", "stewart_springs", {"x": "x(plate)", "y": "y(plate)", "z": "z(plate)"}
    ),
    Trajectory(
        "mechanical/hooke_shafts",
        "universal_shaft",
        {"phi1": "angle(in)", "w1": "omega(in)", "w2": "omega(out)"},
    ),
]


@pytest.mark.parametrize("name", SOLUTIONS)
def test_a_separate_solution_is_met_at_every_tolerance(name: str) -> None:
    case = next(c for c in (*TRAJECTORIES, *IN_SPACE) if c.ref == name)
    found = [max(case.errors(f"reltol={tol}").values()) for tol in TOLERANCES]
    assert all(e <= a for e, a in zip(found, SOLUTIONS[name], strict=True)), found
    assert found[2] <= max(0.1 * found[0], FLOOR) or max(found) <= INSTANT, found


def test_a_chain_of_ten_that_rubs_has_its_events() -> None:
    """209 +- 2 up to 6 s; a separate solution to 1e-6 at reltol 1e-7."""
    text = deck("mechanical/ref_fric_arm10")
    assert abs(run(text, "reltol=1e-7", tran="0.1 6").stats["events"] - 209) <= 2
    case = next(c for c in TRAJECTORIES if c.ref == "fric_arm10")
    assert max(case.errors("reltol=1e-7").values()) < 1e-6


def test_a_ball_comes_to_rest_in_few_events() -> None:
    assert run(deck("mechanical/bouncing_ball"), "reltol=1e-7").stats["events"] < 150


def test_a_rod_that_jams_is_told_and_goes_on_as_the_limit_of_a_stiff_contact() -> None:
    r = emsim.run(deck("mechanical/painleve_rod"))
    assert [d.code for d in r.diagnostics] == ["W421"]
    for name, value in {"vx(rod)": -0.9729, "vy(rod)": 0.4746, "omega(rod)": 2.1649}.items():
        assert r.at(name, 0.05) == pytest.approx(value, abs=6e-5)
    assert abs(np.asarray(r["slip(tip)"])[np.asarray(r.time) > 1e-4]).max() < 1e-8


def test_a_rocking_block_loses_its_share_and_stands() -> None:
    r = run(deck("mechanical/rocking_block"), "reltol=1e-6")
    w = np.asarray(r["omega(block)"])
    hits = np.asarray(r["hits(l)"]) + np.asarray(r["hits(r)"])
    at = np.flatnonzero(np.diff(hits) > 0)
    ratio = 1 - 1.5 * 0.01 / 0.1
    assert w[at + 1][:8] / w[at][:8] == pytest.approx(ratio * np.ones(8), rel=1e-6)
    assert hits[-1] < 100 and abs(w[-1]) < 1e-9 and abs(r["angle(block)"][-1]) < 1e-8


def test_a_rotor_on_springs_has_its_two_frequencies() -> None:
    """w^2 -+ (J3 W/J1) w - k/J1 = 0: 200 forwards and 20 rad/s backwards."""
    r = emsim.run("""gyro
BODY outer m=0 j=(0,0,0)
BODY inner m=0 j=(0,0,0)
BODY rotor m=1 j=(0.01,0.01,0.018)
JOINT a 0 outer pin axis=(1,0,0)
JOINT b outer inner pin axis=(0,1,0)
JOINT s inner rotor pin axis=(0,0,1)
SPRING ka a k=40
SPRING kb b k=40
DRIVE spin s qd=100
.modes
.end
""")
    assert 2 * pi * np.asarray(r.table("modes")["frequency"])[-2:] == pytest.approx([20, 200], rel=1e-10)


def test_a_stack_of_five_rests() -> None:
    r = emsim.run(f"""five blocks are let fall on each other
.gravity 9.81
{"".join(f"BODY b{k} m={k + 1}{chr(10)}JOINT j{k} 0 b{k} slide axis=(0,1) ic={0.55 * k + 0.1}{chr(10)}" for k in range(5))}
STOP floor j0 min=0 e=0.3
{"".join(f"CONTACT c{k} b{k} b{k - 1} line=(0,1) r=0.5 e=0.3{chr(10)}" for k in range(1, 5))}
.options reltol=1e-6
.tran 0.1 5
.print tran {" ".join(f"pos(j{k})" for k in range(5))} force(floor) ke()
.end
""")
    assert [r[f"pos(j{k})"][-1] for k in range(5)] == pytest.approx([0.5 * k for k in range(5)], abs=1e-6)
    assert r["force(floor)"][-1] == pytest.approx(15 * 9.81, rel=1e-6) and r["ke()"][-1] < 1e-12


# figures that tests elsewhere hold: file, test
HELD: dict[str, list[tuple[str, str]]] = {
    "msl_smpm_braking": [
        ("cards/test_motors.py", "test_smpm_spins_down_into_a_bridge_as_the_modelica_library_has_it")
    ],
    "pmsm_interior, bldc_six_step, stepper_20_steps, universal_ac, dc_datasheet to 1e-6": [
        ("physics/test_cases.py", "test_tight_tolerance_meets_the_anchor"),
        ("physics/test_cases.py", "test_error_falls_with_the_tolerance"),
    ],
    "power balance of every motor to 1e-12": [
        ("cards/test_motors.py", "test_power_in_is_stored_heat_and_work_at_every_point")
    ],
    "period of stick and slip to 1e-9 by every method": [
        ("physics/test_friction.py", "test_stick_slip_has_its_period"),
        ("physics/test_friction.py", "test_stick_slip_is_cheap"),
    ],
    "what sticks does not creep in 1e6 s": [
        ("physics/test_friction.py", "test_what_sticks_does_not_creep"),
        ("physics/test_rubbing.py", "test_what_sticks_does_not_creep"),
    ],
    "a relay that bounces": [
        ("physics/test_zoo.py", "test_an_electrostatic_switch_pulls_in_and_lets_go_where_the_forces_say")
    ],
    "slider-crank against a stop, w+ = -e w-": [
        ("physics/test_zoo.py", "test_a_stop_turns_the_whole_slider_crank_back"),
        ("physics/test_impacts.py", "test_an_impact_goes_through_a_closed_loop"),
    ],
    "no impact raises the energy": [
        ("physics/test_impacts.py", "test_no_impact_raises_the_energy"),
        ("physics/test_piles.py", "test_no_impact_of_an_arm_between_stops_raises_the_energy"),
        ("physics/test_rubbing.py", "test_random_scenes_lose_energy_only"),
    ],
    "piles come to rest, none hangs": [("physics/test_piles.py", "test_a_random_pile_comes_to_rest")],
    "a free body tumbles as its closed form": [
        (
            "physics/mechanics/test_joint_kinds.py",
            "test_free_body_turns_by_elliptic_functions_and_keeps_its_momentum",
        )
    ],
    "screw_drop": [
        ("physics/mechanics/test_free_in_space.py", "test_a_nut_falls_on_its_screw_against_friction")
    ],
    "operations of arm6, of planar decks": [
        ("physics/mechanics/test_folding.py", "test_velocities_in_space_are_carried_in_the_bodies_axes")
    ],
    "a torsion chain": [("physics/test_zoo.py", "test_frequencies_of_a_torsion_chain")],
    "resonance of the comb drive": [
        ("physics/test_sample_decks.py", "test_comb_drive_rings_at_its_resonance")
    ],
}


@pytest.mark.parametrize("row", HELD)
def test_what_is_held_elsewhere_is_there(row: str) -> None:
    for file, name in HELD[row]:
        tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
        assert name in {f.name for f in tree.body if isinstance(f, ast.FunctionDef)}, (file, name)
