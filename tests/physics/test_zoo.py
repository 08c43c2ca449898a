"""Mechanisms with a closed form or an invariant, each a deck of netlists/: what must come out of them.

Every machine keeps its energy or closes its balance besides.
"""

from __future__ import annotations

import json
from functools import cache
from math import asin, cos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from support import NETLISTS, deck, reference, run, values_at

import emsim

TIGHT = "reltol=1e-9"


@cache
def solved(name: str, options: str = TIGHT):
    return run(deck(name), options)


def columns(name: str, *wanted: str) -> list[np.ndarray]:
    found = solved(name)
    return [np.asarray(found.time), *(np.asarray(found[w]) for w in wanted)]


BALANCED = {
    "slider_crank": 1e-9, "slider_crank_stop": 1e-9, "quick_return": 1e-6, "pantograph": 1e-8, "peaucellier": 1e-8, "hart": 1e-8,
    "jansen": 1e-7, "bennett": 1e-7, "sarrus": 1e-9, "rssr": 1e-8, "hooke_shafts": 1e-8, "stewart_springs": 1e-9, "arm6": 1e-9,
    "ball_chain": 1e-9, "heavy_top": 1e-8, "gyroscope_gimbals": 1e-9, "bevel_differential": 1e-9, "planetary_gear": 1e-9,
    "screw_jack": 1e-9, "backlash_pair": 1e-9, "yo_yo": 1e-8, "atwood": 1e-12, "freewheel_rectifier": 1e-8, "clutch": 1e-9,
    "two_clutches": 1e-7, "brake_car": 1e-12, "bouncing_ball": 1e-5, "geneva": 1e-7, "cam_follower": 1e-8,
    "stick_slip_belt": 1e-8, "stewart_legs": 1e-7, "scissor_jack": 1e-8, "steady_precession": 1e-8, "ref_fric_slider_crank": 1e-7,
    "ref_msl_fourbar_spatial": 1e-8,
}  # fmt: skip


@pytest.mark.parametrize("name", BALANCED)
def test_its_energy_balance_closes(name: str) -> None:
    ledger = solved(f"mechanical/{name}").energy
    assert ledger.balanced
    assert ledger.share < BALANCED[name]


def test_slider_crank_places_its_piston() -> None:
    _, f, x = columns("mechanical/slider_crank", "angle(main)", "x(piston)")
    assert np.abs(x - (0.1 * np.cos(f) + np.sqrt(0.09 - (0.1 * np.sin(f)) ** 2))).max() < 1e-10


def test_a_stop_turns_the_whole_slider_crank_back() -> None:
    """Every speed of the loop is -e times what it was: the motion has one freedom."""
    _, w, hits, x, v = columns(
        "mechanical/slider_crank_stop", "omega(main)", "hits(wall)", "pos(guide)", "vel(guide)"
    )
    at = np.flatnonzero(np.diff(hits) > 0)
    assert len(at) >= 1
    k = at[0]
    assert w[k + 1] / w[k] == pytest.approx(-0.6, rel=1e-2)  # rows beside the impact
    assert x.min() > 0.22 - 1e-9
    # closed at velocity level: the piston's speed is that of the crank, before and after
    f = columns("mechanical/slider_crank_stop", "angle(main)")[1]
    slope = -0.1 * np.sin(f) - 0.01 * np.sin(f) * np.cos(f) / np.sqrt(0.09 - (0.1 * np.sin(f)) ** 2)
    assert np.abs(v - slope * w).max() < 1e-8 * np.abs(v).max()


def test_quick_return_takes_its_time_forth() -> None:
    """sin a = r/d; the arm's ends are where it touches the crank's circle."""
    t, w = columns("mechanical/quick_return", "omega(pivot)")
    turns = t[np.flatnonzero(np.diff(np.sign(w)) != 0)]
    spans = np.diff(turns)
    a = asin(0.05 / 0.12)
    ratio = max(spans[:2]) / min(spans[:2])
    assert ratio == pytest.approx((pi + 2 * a) / (pi - 2 * a), rel=5e-3)  # to the print grid
    assert sum(spans[:2]) == pytest.approx(1.0, abs=2e-3)


def test_geneva_moves_by_a_quarter_and_no_further() -> None:
    t, w = columns("mechanical/geneva", "omega(cross)")
    found = solved("mechanical/geneva")
    for turn in (1, 2, 3):
        assert found.at("angle(cross)", float(turn)) == pytest.approx(-turn * pi / 2, abs=1e-9)
    m = sin(pi / 4)
    assert np.abs(w).max() / (2 * pi) == pytest.approx(m / (1 - m), rel=1e-4)
    assert np.abs(w[np.abs((t % 1.0) - 0.5) > 0.3]).max() < 1e-7 * np.abs(w).max()


def test_pantograph_draws_twice_as_large() -> None:
    near = columns("mechanical/pantograph", "x(near(0.2,0))", "y(near(0.2,0))")[1:]
    far = columns("mechanical/pantograph", "x(two(0.4,0))", "y(two(0.4,0))")[1:]
    for a, b in zip(near, far, strict=True):
        assert np.abs(b - 2 * a).max() < 1e-9


def test_peaucellier_draws_a_straight_line() -> None:
    _, x, y = columns("mechanical/peaucellier", "x(bc(0.12,0))", "y(bc(0.12,0))")
    assert np.abs(x - (0.09 - 0.0144) / 0.2).max() < 1e-10
    assert np.ptp(y) > 0.05


def test_hart_inverts() -> None:
    """OP OQ = t (1 - t)(p^2 - q^2), on one line through O; Q runs straight, across the line from O to the circle's centre."""
    _, qx, qy, px, py = columns(
        "mechanical/hart", *(f"{k}({p})" for p in ("cb(0.1,0)", "ad(0.1,0)") for k in "xy")
    )
    assert np.abs(np.abs(qx * px + qy * py) - 0.25 * (0.16 - 0.04)).max() < 1e-10
    assert np.abs(qx * py - qy * px).max() < 1e-10
    line = np.polyfit(qx, qy, 1) if np.ptp(qx) > np.ptp(qy) else np.polyfit(qy, qx, 1)
    along = (qx, qy) if np.ptp(qx) > np.ptp(qy) else (qy, qx)
    assert np.abs(np.polyval(line, along[0]) - along[1]).max() < 1e-9
    assert np.ptp(along[0]) > 0.05


def test_the_foot_of_jansens_leg_walks_on_a_closed_path() -> None:
    found = solved("mechanical/jansen")
    t, f = np.asarray(found.time), np.asarray(found["angle(shaft)"])
    x, y = np.asarray(found["x(foot.sole)"]), np.asarray(found["y(foot.sole)"])
    way = np.sign(f[-1] - f[0])
    for start in (1.0, 1.2):  # the same place a turn later, as a function of the crank
        a = np.interp(start, t, f)
        for column in (x, y):
            here, there = (np.interp(v * way, f * way, column) for v in (a, a + way * 2 * pi))
            assert here == pytest.approx(there, abs=1e-5)
    assert emsim.check(NETLISTS / "mechanical/jansen.cir")["machine"]["redundant_rows"] == []
    assert np.ptp(x) > 0.04 and np.ptp(y) > 0.01


def test_bennetts_linkage_keeps_its_product_of_tangents() -> None:
    _, p0, p1 = columns("mechanical/bennett", "angle(p0)", "angle(p1)")
    a, b = 1.2217304763960306 + p0, 2.6522857378439326 + p1
    want = sin(np.radians(57.5)) / sin(np.radians(17.5))
    assert np.ptp(p0) > 0.3
    # by the angle that the first one asks for: one tangent has a pole where the other is 0
    off = b - 2 * np.arctan2(want * np.cos(a / 2), np.sin(a / 2))
    assert np.abs(2 * np.sin(off / 2)).max() < 1e-9
    assert len(emsim.check(NETLISTS / "mechanical/bennett.cir")["machine"]["redundant_rows"]) == 3


def test_sarrus_lifts_straight() -> None:
    _, x, y, z = columns("mechanical/sarrus", "x(top)", "y(top)", "z(top)")
    assert max(np.abs(x).max(), np.abs(z).max()) < 1e-10 and np.ptp(y) > 0.05
    facts = emsim.check(NETLISTS / "mechanical/sarrus.cir")["machine"]
    assert facts["degrees_of_freedom"] == 1 and len(facts["redundant_rows"]) == 1


def test_rssr_rocks_as_the_distance_of_its_balls_says() -> None:
    """|(0.08 cos c, 0.08 sin c, 0) - (0.3, 0.2 cos r, 0.15 + 0.2 sin r)| = 0.34, one branch."""
    assert emsim.check(NETLISTS / "mechanical/rssr.cir")["machine"]["degrees_of_freedom"] == 2
    _, crank, rock = columns("mechanical/rssr", "angle(drive)", "angle(rock)")

    def apart(c: float, r: float) -> float:
        d = np.array([0.08 * cos(c) - 0.3, 0.08 * sin(c) - 0.2 * cos(r), -0.15 - 0.2 * sin(r)])
        return float(d @ d) - 0.34**2

    for k in range(0, len(crank), 97):
        c, r = crank[k], rock[k]
        assert brentq(lambda v, c=c: apart(c, v), r - 0.02, r + 0.02) == pytest.approx(r, abs=1e-9)


def test_hookes_joint_runs_unevenly() -> None:
    _, f1, f2 = columns("mechanical/hooke_shafts", "angle(in)", "angle(out)")
    ref = reference("universal_shaft")
    for name, column in (("phi1", "angle(in)"), ("w1", "omega(in)"), ("w2", "omega(out)")):
        want = ref[name]
        assert np.abs(
            values_at(solved("mechanical/hooke_shafts"), column, ref["time"]) - want
        ).max() < 1e-7 * np.ptp(want)
    assert np.abs(np.sin(f2) * np.cos(f1) - cos(pi / 6) * np.sin(f1) * np.cos(f2)).max() < 1e-9


@pytest.mark.parametrize(
    ("name", "ref", "signals"),
    [
        ("stewart_springs", "stewart_springs", {"x": "x(plate)", "y": "y(plate)", "z": "z(plate)"}),
        ("arm6", "arm6_swing", {**{f"q{k}": f"angle(q{k})" for k in range(1, 7)}, "zt": "z(b6(0.1,0,0))"}),
        (
            "ball_chain",
            "ball_chain3",
            {"x1": "x(b1(0,-0.4,0))", "yt": "y(b3(0,-0.4,0))", "zt": "z(b3(0,-0.4,0))"},
        ),
    ],
)
def test_it_meets_a_separate_solution_and_the_error_falls(
    name: str, ref: str, signals: dict[str, str]
) -> None:
    want = reference(ref)
    errors = []
    for tol in (1e-4, 1e-6, 1e-9):
        found = solved(f"mechanical/{name}", f"reltol={tol}")
        errors.append(
            max(
                np.abs(values_at(found, s, want["time"]) - want[k]).max() / np.ptp(want[k])
                for k, s in signals.items()
            )
        )
    assert errors[0] < 1e-2 and errors[1] < 0.2 * errors[0] and errors[2] < 2e-8


def test_heavy_top_meets_binary128() -> None:
    found = solved("mechanical/heavy_top", "reltol=1e-11 method=dop853")
    want = {"wx(tip)": 0.1222332194973942, "wz(tip)": -5.855624589205458, "z(top.com)": -0.6730222695564441}
    for name, value in want.items():
        assert found.at(name, 2.0) == pytest.approx(value, abs=2e-9 * max(1.0, abs(value)))
    assert found.at("wy(tip)", 2.0) == pytest.approx(150.0, rel=1e-12)


def test_momentum_of_a_gyroscope_about_the_vertical_is_kept() -> None:
    """Outer gimbal 3 g m^2 about z; inner and rotor by their own axes."""
    _, v, h, u, s = columns("mechanical/gyroscope_gimbals", "omega(v)", "angle(h)", "omega(h)", "omega(s)")
    c, d = np.cos(h), np.sin(h)
    # in the inner frame, x along its axis: w = (u, v sin h, v cos h)
    inner = 1.5e-3 * v * d * d + 1e-3 * v * c * c
    rotor = 0.6e-3 * v * d * d + 1.1e-3 * (v * c + s) * c
    momentum = 3e-3 * v + inner + rotor
    assert np.abs(momentum - momentum[0]).max() < 1e-8 * abs(momentum[0])
    assert np.abs(u).max() > 0.1


def test_a_differential_halves_what_it_adds() -> None:
    _, cage, left, right = columns("mechanical/bevel_differential", "omega(cage)", "omega(l)", "omega(r)")
    assert np.abs((cage + left) + (cage + right) - 2 * cage).max() < 1e-9
    assert right[-1] > 1.0 > left[-1]  # the free wheel spins, the one in the mud does not


def test_willis_equation_of_a_planetary_gear() -> None:
    _, sun, ring, carrier = columns(
        "mechanical/planetary_gear", "omega(sun)", "omega(ring)", "omega(carrier)"
    )
    assert np.abs((sun - carrier) + 3 * (ring - carrier)).max() < 1e-9 * np.abs(sun).max()


def test_a_nut_sinks_as_its_lead_says() -> None:
    k = 0.02 / (2 * pi)
    a = -(2 * 9.81 * k - 0.01) / (2 * k * k + 1e-3)
    t, q, z = columns("mechanical/screw_jack", "angle(s)", "z(nut)")
    assert np.abs(q - 0.5 * a * t * t).max() < 1e-8 and np.abs(z - k * q).max() < 1e-12


@pytest.mark.parametrize(("fc", "holds"), [(0.9999, False), (1.0001, True)])
def test_a_screw_holds_by_itself_from_its_load_on(fc: float, holds: bool) -> None:
    text = deck("mechanical/screw_jack").replace("fc=10m", f"fc={fc * 2 * 9.81 * 0.02 / (2 * pi)!r}")
    found = run(text, TIGHT)
    z = np.asarray(found["z(nut)"])
    assert np.ptp(z) < 1e-15 if holds else z[-1] < -1e-6


def test_six_drives_leave_a_platform_no_freedom() -> None:
    facts = emsim.check(NETLISTS / "mechanical/stewart_legs.cir")["machine"]
    assert facts["degrees_of_freedom"] == 0 and facts["redundant_rows"] == []
    assert len(facts["constraint_rows"]) == 18
    _, x, y, z = columns("mechanical/stewart_legs", "x(plate)", "y(plate)", "z(plate)")
    assert np.ptp(y) > 0.002 and np.ptp(x) + np.ptp(z) > 0.01


def test_teeth_with_play_keep_momentum_and_lose_speed() -> None:
    _, w1, w2, hits = columns("mechanical/backlash_pair", "omega(p)", "omega(q)", "hits(g)")
    momentum = 2 * 1e-3 * w1 + 4e-3 * w2
    assert np.abs(momentum - momentum[0]).max() < 1e-9 * momentum[0]
    apart = w1 - 2 * w2
    for k in np.flatnonzero(np.diff(hits) == 1)[:5]:
        assert apart[k + 1] / apart[k] == pytest.approx(-0.7, rel=1e-6)
    assert hits[-1] > 5


def test_a_yo_yo_falls_slowly_and_turns_back() -> None:
    a = 9.81 / (1 + 40e-6 / (0.1 * 0.008**2))
    t, x, hits = columns("mechanical/yo_yo", "pos(fall)", "hits(end)")
    turn = sqrt(2 * 0.5 / a)
    before = t < turn - 0.01
    assert np.abs(x - 0.5 * a * t * t)[before].max() < 1e-8
    assert t[np.flatnonzero(np.diff(hits) == 1)[0]] == pytest.approx(turn, abs=5e-3)
    # it climbs to e^2 of the height
    second = x[(t > turn) & (t < turn * (1 + 1.8))]
    assert second.min() == pytest.approx(0.5 * (1 - 0.81), abs=2e-4)


def test_atwoods_machine() -> None:
    t, x = columns("mechanical/atwood", "pos(down)")
    a = (1.1 - 0.9) * 9.81 / (2.0 + 2e-3 / 0.01)
    assert np.abs(x - 0.5 * a * t * t).max() < 1e-10


def test_a_valve_leaves_its_cam_where_the_spring_is_too_weak() -> None:
    _, mode, f = columns("mechanical/cam_follower", "mode(lobe)", "angle(shaft)")
    left = f[np.flatnonzero((mode[:-1] == 1) & (mode[1:] == 0))[0]]
    assert left == pytest.approx(np.arccos(-500 * 13e-3 / (0.1 * 3e-3 * 200**2 - 500 * 3e-3)), abs=0.011)


def test_a_freewheel_lets_nothing_turn_back() -> None:
    _, crank, wheel, torque = columns(
        "mechanical/freewheel_rectifier", "omega(swing)", "omega(hub)", "torque(one)"
    )
    assert (wheel - crank).min() > -1e-8 * np.abs(crank).max()
    assert wheel.min() > -1e-8 and torque.min() > -1e-8 * np.abs(torque).max()
    assert wheel[-1] > 0.5


def test_the_heat_of_a_clutch_is_that_of_the_speeds() -> None:
    found = solved("mechanical/clutch")
    heat = next(line.dissipated for line in found.energy.lines if line.name == "plate")
    assert heat == pytest.approx(0.1 * 0.4 / 0.5 * 1000 / 2, rel=1e-9)
    end = (0.1 * 100 + 0.4 * (100 - sqrt(1000))) / 0.5
    assert found.at("omega(e)", 2.0) == pytest.approx(end, rel=1e-9)
    assert found.at("mode(plate)", 2.0) == 0.0
    other = run(deck("mechanical/clutch").replace("20*min(time/0.5,1)", "15+10*sin(30*time)"), TIGHT)
    again = next(line.dissipated for line in other.energy.lines if line.name == "plate")
    assert again == pytest.approx(heat, rel=1e-8)


def test_two_clutches_tie_the_machine_up() -> None:
    found = solved("mechanical/two_clutches")
    e, s = (lambda t: found.at("omega(e)", t)), (lambda t: found.at("omega(s)", t))
    assert e(0.1) == pytest.approx(100.0) and s(0.1) == 0.0
    assert e(0.79) == pytest.approx(3 * s(0.79), rel=1e-9) and e(0.79) > 1
    assert e(1.5) == pytest.approx(1.5 * s(1.5), rel=1e-9) and e(1.5) > 1
    assert abs(e(3.0)) < 1e-9 and abs(s(3.0)) < 1e-9
    assert found.at("mode(c1)", 3.0) == 0.0 and found.at("mode(c2)", 3.0) == 0.0


def test_a_car_brakes_in_its_distance_and_stands() -> None:
    found = solved("mechanical/brake_car")
    assert found.at("pos(road)", 6.0) == pytest.approx(400 / (2 * 0.5 * 9.81), rel=1e-10)
    assert abs(found.at("vel(road)", 6.0)) < 1e-20 and found.at("mode(brakes)", 6.0) == 0.0


@pytest.mark.parametrize(("reltol", "allowed"), [(1e-4, 2e-3), (1e-6, 2e-5), (1e-9, 2e-8)])
def test_a_block_on_a_belt_slips_in_its_own_time(reltol: float, allowed: float) -> None:
    """refs stick_slip_belt: where it sticks again after the first slip, and again a period later."""
    found = solved("mechanical/stick_slip_belt", f"reltol={reltol}")
    t, mode = np.asarray(found.time), np.asarray(found["mode(f)"])
    starts = t[np.flatnonzero((mode[:-1] == 0) & (mode[1:] != 0))]
    assert starts[0] == pytest.approx(5.0, abs=0.03)
    x = found.at("pos(rail)", 9.295999525480155)
    assert x == pytest.approx(-0.5410063538700848, abs=allowed)
    assert found.at("pos(rail)", 12.00103129483058 * 2 + 3) == pytest.approx(
        found.at("pos(rail)", 12.00103129483058 + 3), abs=5 * allowed
    )


def test_a_bouncing_ball_comes_to_rest() -> None:
    found = solved("mechanical/bouncing_ball")
    t, hits = np.asarray(found.time), np.asarray(found["hits(floor)"])
    tenth = t[np.flatnonzero(hits >= 10)[0]]
    assert tenth == pytest.approx(3.578892951020438, abs=6e-3)  # to the print grid
    assert found.at("pos(up)", 4.9) == 0.0 or abs(found.at("pos(up)", 4.9)) < 1e-12
    assert found.at("mode(floor)", 4.9) == 1.0 and 20 < hits[-1] < 150


def test_frequencies_of_a_torsion_chain() -> None:
    found = emsim.run(NETLISTS / "mechanical/torsion_chain.cir")
    table = json.loads(
        json.dumps(
            {n: [float(v) for v in found[n]] for n in found.names if np.isrealobj(np.asarray(found[n]))}
        )
    )
    frequency = next(sorted(v) for k, v in table.items() if k.startswith("f"))
    want = [2 * sqrt(400 / 10e-3) * sin((2 * j - 1) * pi / 34) / (2 * pi) for j in range(1, 9)]
    assert sorted(set(np.round(frequency, 12)))[-8:] == pytest.approx(want, rel=1e-10)


def test_an_induction_machine_ends_at_the_slip_of_its_load() -> None:
    found = solved("coupled/induction_start", "reltol=1e-8")
    w = found.at("omega(shaft)", 1.5)
    slip = 1 - w / (100 * pi / 2)
    rotor = 0.4 / slip + 1j * 100 * pi * 4e-3
    main = 1j * 100 * pi * 60e-3
    whole = 0.5 + 1j * 100 * pi * 3e-3 + main * rotor / (main + rotor)
    current = 100 * sqrt(2) / whole
    torque = 1.5 * 2 / (100 * pi) * 0.4 / slip * abs(current * main / (main + rotor)) ** 2
    assert torque == pytest.approx(8.0, rel=1e-3)
    t = np.asarray(found.time)
    assert np.abs(np.asarray(found["i(m1,1)"])[t > 1.46]).max() == pytest.approx(abs(current), rel=1e-3)


def test_a_rail_gun_accounts_for_its_charge() -> None:
    found = solved("coupled/rail_gun", "reltol=1e-9")
    i, v, u, x = (np.asarray(found[n]) for n in ("i(gun)", "v(c)", "vel(rails)", "pos(rails)"))
    assert np.abs(np.asarray(found["force(gun)"]) - 0.25e-6 * i * i).max() < 1e-9 * np.abs(i).max() ** 2
    held = 1e-3 * v * v + 0.01 * u * u + 0.5 * (0.2e-6 + 0.5e-6 * x) * i * i
    heat = next(line.dissipated for line in found.energy.lines if line.name == "r1")
    assert held[-1] + heat == pytest.approx(held[0], rel=1e-8)
    assert u[-1] > 5.0


def test_a_ball_under_a_magnet_falls_at_its_own_pace() -> None:
    found = emsim.run(NETLISTS / "coupled/maglev_ball.cir")
    poles = [complex(v) for n in found.names for v in np.atleast_1d(np.asarray(found[n], dtype=complex))]
    want = sqrt(2 * 9.81 / 10e-3)
    assert (
        min(abs(p.real - want) for p in poles) < 1e-9 * want
        or min(abs(abs(p) - want) for p in poles) < 1e-8 * want
    )


@pytest.mark.parametrize(
    ("name", "signals"),
    [
        ("ball_chain", ("x(b3(0,-0.4,0))", "y(b3(0,-0.4,0))", "z(b1(0,-0.4,0))")),
        ("heavy_top", ("x(top.com)", "z(top.com)")),
        ("rssr", ("angle(drive)", "angle(rock)")),
        ("stewart_springs", ("x(plate)", "y(plate)", "z(plate)")),
        ("sarrus", ("y(top)", "angle(a1)")),
        ("geneva", ("angle(cross)",)),
        ("slider_crank_stop", ("angle(main)", "pos(guide)")),
        ("two_clutches", ("omega(e)", "omega(s)")),
    ],
)
def test_maximal_coordinates_move_alike(name: str, signals: tuple[str, ...]) -> None:
    one, two = (solved(f"mechanical/{name}", f"reltol=1e-8 formulation={f}") for f in ("joint", "absolute"))
    stop = float(one.time[-1])
    for signal in signals:
        a, b = (np.array([float(r.at(signal, t)) for t in np.linspace(0.0, stop, 21)]) for r in (one, two))
        assert np.abs(a - b).max() < 1e-5 * max(np.ptp(a), 1e-9), signal


def test_an_electrostatic_switch_pulls_in_and_lets_go_where_the_forces_say() -> None:
    found = solved("coupled/es_switch", "reltol=1e-6")
    v, mode = np.asarray(found["v(a)"]), np.asarray(found["mode(bump)"])
    eps_area, d, g = 8.8541878128e-12 * 40e-9, 2e-6, 0.5e-6
    closes, opens = np.flatnonzero(np.diff(mode) > 0), np.flatnonzero(np.diff(mode) < 0)
    assert len(closes) == len(opens) == 1
    # the ramp goes on while the plate is on its way
    assert v[closes[0] + 1] == pytest.approx(sqrt(8 * d**3 / (27 * eps_area)), rel=5e-3)
    assert v[opens[0] + 1] == pytest.approx(sqrt(2 * (d - g) * g * g / eps_area), rel=1e-6)


def test_two_hookes_joints_in_line_run_evenly() -> None:
    found = solved("mechanical/hooke_double")
    w1, w3 = np.asarray(found["omega(in)"]), np.asarray(found["omega(out)"])
    assert np.abs(w1 - w3).max() < 1e-8 * np.abs(w1).max()
    assert np.ptp(np.asarray(found["omega1(u1)"])) > 5.0  # the middle one does not
    facts = emsim.check(NETLISTS / "mechanical/hooke_double.cir")["machine"]
    assert facts["degrees_of_freedom"] == 1 and len(facts["redundant_rows"]) == 1
    assert found.energy.share < 1e-9


@pytest.mark.parametrize(
    ("start", "rest", "unstable"), [(0.05, 0.4, False), (-0.05, -0.4, False), (0.0, 0.0, True)]
)
def test_a_toggle_has_two_rests_and_a_dead_point_between(start: float, rest: float, unstable: bool) -> None:
    found = emsim.run(deck("mechanical/toggle_rests").replace("ic=0.05", f"ic={start}"))
    assert found["pos(rail)"][0] == pytest.approx(rest, abs=1e-9)
    assert ("W241" in {d.code for d in found.diagnostics}) is unstable
