"""Closed loops: what is cut, how the start is assembled, what is redundant, what cannot be."""

import itertools
import math

import pytest
from machines import machine, only_error, problems, reads, value

import emsim

CRANK, COUPLER, ROCKER, GROUND = 0.10, 0.24, 0.20, 0.22
BODIES = """.gravity 9.81
BODY  crank   shape=rod(0.10) m=0.10
BODY  coupler shape=rod(0.24) m=0.24
BODY  rocker  shape=rod(0.20) m=0.20
"""


def four_bar(a="ic=(0,10)", b="guess=56deg", d="guess=86deg", close="", ground=GROUND):
    return BODIES + (
        f"JOINT a 0 crank pin {a}\nJOINT b crank(0.10,0) coupler pin {b}\n"
        f"JOINT d 0({ground},0) rocker pin {d}\nJOINT close coupler(0.24,0) rocker(0.20,0) pin {close}"
    )


def angles():
    """Coupler and rocker at crank angle 0, by the cosine rule."""
    e = GROUND - CRANK
    coupler = math.acos((COUPLER**2 + e**2 - ROCKER**2) / (2 * COUPLER * e))
    rocker = math.atan2(COUPLER * math.sin(coupler), COUPLER * math.cos(coupler) - e)
    return coupler, rocker


def test_assembly_finds_the_closed_loop():
    m = machine(four_bar())
    coupler, rocker = angles()
    start = {c.q_name: c.start for c in m.own}
    at = {name: v for name, _, v in m.found.moved}
    assert at["angle(b)"] == pytest.approx(coupler, abs=1e-12)
    assert at["angle(d)"] == pytest.approx(rocker, abs=1e-12)
    assert start["angle(a)"] == 0.0 and "angle(a)" not in at
    # w2 = w3 = -25/3 for w1 = 10, from the velocity polygon
    assert at["omega(b)"] == pytest.approx(-25 / 3 - 10)
    assert at["omega(d)"] == pytest.approx(-25 / 3)


@pytest.mark.parametrize("cut", "abd")
def test_any_joint_may_be_the_cut_one(cut):
    """ic= of a cut joint is held as well; the assembled machine is the same."""
    where = {"a": "ic=(0,10)", "b": "guess=56deg", "d": "guess=86deg"}
    where[cut] += " cut=yes"
    m = machine(four_bar(**where, close="guess=28deg"))
    assert m.joints[cut].cut and len(m.own) == 3 and m.found.dof == 1
    at = {name: v for name, _, v in m.found.moved}
    assert reads(m, "angle", "rocker", at=at) == pytest.approx(angles()[1], abs=1e-9)
    assert reads(m, "omega", "rocker", at=at) == pytest.approx(-25 / 3, abs=1e-7)


def test_deck_order_decides_the_cut():
    m = machine(four_bar())
    assert m.plan.cut == ["close"]
    lines = four_bar().split("\n")
    m = machine("\n".join([*lines[:4], lines[7].replace("pin ", "pin guess=0"), *lines[4:7]]))
    assert m.plan.cut == ["d"]


def test_loop_that_cannot_close_names_joints_and_gap():
    error = only_error(four_bar(ground=0.92))
    assert error.code == "E242"
    assert "b, a, d, close" in error.message
    assert "0.38 m" in error.message  # 0.92 - 0.10 - 0.24 - 0.20


def test_held_start_in_conflict_is_told_from_an_impossible_loop():
    error = only_error(four_bar(b="ic=0"))
    assert error.code == "E244" and "held" in error.message
    assert "guess=" in (error.hint or "")


def test_held_speeds_in_conflict():
    error = only_error(four_bar(d="guess=86deg").replace("guess=86deg", "ic=(1.50408017838467,5)"))
    assert error.code == "E244" and "speeds" in error.message


def test_parallel_axes_that_never_meet():
    """Two slides along x at different heights, rigidly tied: a constant gap that nothing can move."""
    error = only_error(
        "BODY a m=1 j=1\nBODY b m=1 j=1\nJOINT j 0 a slide\nJOINT k a(0,1) b weld\nJOINT l 0 b slide"
    )
    assert error.code == "E242" and "whatever moves" in error.message


TRIPLE = (
    ".gravity 9.81\n"
    "BODY l1 shape=rod(0.2) m=0.1\nBODY l2 shape=rod(0.2) m=0.1\nBODY l3 shape=rod(0.2) m=0.1\n"
    "BODY top shape=rod(0.4) m=0.3\nJOINT j1 0 l1 pin ic=(60deg,1)\nJOINT j2 0(0.2,0) l2 pin guess=60deg\n"
    "JOINT j3 0(0.4,0) l3 pin guess=60deg\nJOINT k1 l1(0.2,0) top pin guess=-60deg\n"
    "JOINT k2 l2(0.2,0) top(0.2,0) pin\nJOINT k3 l3(0.2,0) top(0.4,0) pin"
)


def test_redundant_row_is_removed():
    """Three equal cranks under one beam: four closure rows, three of them independent."""
    m = machine(TRIPLE)
    assert len(m.rows) == 3 and len(m.found.redundant) == 1
    assert m.found.dof == 1
    at = {name: v for name, _, v in m.found.moved}
    assert at["omega(j3)"] == pytest.approx(1.0)


def test_start_at_a_change_point_is_said():
    deck = (
        "BODY l1 shape=rod(0.2) m=0.1\nBODY l2 shape=rod(0.2) m=0.1\nBODY top shape=rod(0.4) m=0.3\n"
        "JOINT j1 0 l1 pin ic=0\nJOINT j2 0(0.4,0) l2 pin\nJOINT k1 l1(0.2,0) top pin\n"
        "JOINT k2 l2(0.2,0) top(0.4,0) pin\n.gravity 9.81"
    )
    found = {d.code: d for d in problems(deck)}
    assert "W233" in found and "change point" in found["W233"].message
    assert not machine(deck).found.redundant


def test_in_line_slider_crank_at_dead_centre_is_no_change_point():
    m = machine(
        "BODY crank shape=rod(30m) m=20m\n"
        "BODY conrod shape=rod(100m) m=30m\nBODY piston shape=box(30m,20m) m=0.2\n"
        "JOINT shaft 0 crank pin\nJOINT big crank(30m,0) conrod pin\nJOINT small conrod(100m,0) piston pin\n"
        "JOINT bore 0 piston slide axis=(1,0)\n.gravity 9.81"
    )
    assert m.found.dof == 1 and not m.found.redundant and not m.found.singular
    assert reads(m, "pos", "bore") == pytest.approx(0.13)


MASSES = "BODY a m=1\nBODY b m=1\n"


def test_rod_keeps_the_distance_of_the_start():
    deck = MASSES + "JOINT x 0 a slide ic=0.3\nJOINT y 0 b slide axis=(0,1) ic=(0.4,-1)\nJOINT r a b rod"
    m = machine(deck + "\n.gravity 9.81")
    (row,) = m.rows
    assert m.joints["r"].kind.length == pytest.approx(0.5)
    assert value(m, row.h, {"pos(x)": 0.5, "pos(y)": 0.0}) == pytest.approx(0.0)
    at = {name: v for name, _, v in m.found.moved}
    assert at["vel(x)"] == pytest.approx(4 / 3)  # x v_x + y v_y = 0


# of the four-bar with the crank held at 60 degrees, pins set out from 0: both ways to close it
PINS = {
    "a": "JOINT a 0 crank pin ic=60deg",
    "b": "JOINT b crank(0.10,0) coupler pin",
    "d": "JOINT d 0(0.22,0) rocker pin",
    "close": "JOINT close coupler(0.24,0) rocker(0.20,0) pin",
}


def branches():
    """{joint: coordinate} of both, from the triangle over the diagonal."""
    px, py = CRANK * math.cos(math.pi / 3), CRANK * math.sin(math.pi / 3)
    gap, way = math.hypot(GROUND - px, -py), math.atan2(-py, GROUND - px)
    found = []
    for sign in (1, -1):
        turn = sign * math.acos((COUPLER**2 + gap**2 - ROCKER**2) / (2 * COUPLER * gap))
        coupler = way + turn
        end = (px + COUPLER * math.cos(coupler) - GROUND, py + COUPLER * math.sin(coupler))
        rocker = math.atan2(end[1], end[0])
        found.append({"b": coupler - math.pi / 3, "d": rocker, "close": rocker - coupler})
    return found


@pytest.mark.parametrize(("guessed", "branch"), [*itertools.product(("b", "d", "close"), (0, 1))])
def test_a_guess_says_the_branch_whichever_joint_is_cut(guessed, branch):
    """Also where the guessed joint is the cut one, whose guess was once ignored."""
    expected = branches()[branch]
    cards = PINS | {guessed: f"{PINS[guessed]} guess={expected[guessed] + 0.05:.2f}"}
    for order in itertools.permutations(cards.values()):
        m = machine(BODIES + "\n".join(order))
        at = {c.q_name: m.found.x[c.row] for c in m.own}
        for name in ("b", "d", "close"):
            off = reads(m, "angle", name, at=at) - expected[name]
            assert math.remainder(off, 2 * math.pi) == pytest.approx(0.0, abs=1e-9), (name, order)


def test_the_search_leaves_no_full_turns():
    """Every free angle starts within half a turn of where it set out."""
    for order in itertools.permutations(
        [*list(PINS.values())[:2], PINS["d"] + " guess=-100deg", PINS["close"]]
    ):
        m = machine(BODIES + "\n".join(order))
        if m.plan.cut != ["a"]:  # held at the cut, it counts the turns of the others
            assert all(abs(m.found.x[c.row] - c.start) < math.pi for c in m.own)


PENDULUM = "BODY pend shape=rod(0.30) m=0.1\nJOINT hang 0(0.3,0.4) pend pin ic=-80deg\n"
TIE = "JOINT tie rocker(0.1,0) pend(0.1,0) rod"


@pytest.mark.parametrize("where", [0, 2, 4])
def test_a_rod_is_measured_once_the_other_loops_have_closed(where):
    """At the guesses it is another length, with which the held joints could not close."""
    lines = [*PINS.values()]
    lines[2] += " guess=100deg"
    lines.insert(where, TIE)
    m = machine(BODIES + PENDULUM + "\n".join(lines))
    rocker, hang = branches()[0]["d"], math.radians(-80)
    x = 0.22 + 0.1 * math.cos(rocker) - 0.3 - 0.1 * math.cos(hang)
    y = 0.1 * math.sin(rocker) - 0.4 - 0.1 * math.sin(hang)
    assert m.joints["tie"].kind.length == pytest.approx(math.hypot(x, y), abs=1e-9)
    assert m.found.dof == 1


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_rod_between_loops_runs(formulation):
    cards = BODIES + PENDULUM + "\n".join([TIE, *PINS.values()])
    run = emsim.run(
        f"t\n{cards}\n.options formulation={formulation}\n.tran 1m 0.1\n.print tran angle(hang)\n.end\n"
    )
    assert run["angle(hang)"][0] == pytest.approx(math.radians(-80), abs=1e-9)


def test_a_rod_of_no_length_is_named():
    error = only_error("BODY a m=1 shape=rod(1)\nJOINT h 0 a pin ic=0\nJOINT r 0(1,0) a(1,0) rod")
    assert error.code == "E242" and "no length" in error.message


def test_rod_of_given_length_assembles():
    deck = MASSES + "JOINT x 0 a slide guess=0.3\nJOINT y 0 b slide axis=(0,1) ic=0.4\nJOINT r a b rod l=0.6"
    m = machine(deck)
    at = {name: v for name, _, v in m.found.moved}
    assert at["pos(x)"] == pytest.approx(math.sqrt(0.36 - 0.16))


def test_scotch_yoke():
    """A pinslot that closes a loop leaves one row."""
    m = machine(
        "BODY crank shape=rod(0.1) m=0.1\nBODY yoke m=0.5\nJOINT j 0 crank pin ic=(0.3,5)\n"
        "JOINT s 0 yoke slide axis=(1,0)\nJOINT p yoke crank(0.1,0) pinslot axis=(0,1)"
    )
    assert len(m.rows) == 1 and m.found.dof == 1
    at = {name: v for name, _, v in m.found.moved} | {"angle(j)": 0.3, "omega(j)": 5.0}
    assert reads(m, "pos", "s", at=at) == pytest.approx(0.1 * math.cos(0.3))
    assert reads(m, "vel", "s", at=at) == pytest.approx(-0.5 * math.sin(0.3))


def test_driven_loop_has_no_freedom_left_and_still_closes():
    m = machine(four_bar(a="") + "\nDRIVE d1 a q={10*time}")
    assert m.found.dof == 0 and len(m.own) == 2 and len(m.rows) == 2
    at = {name: v for name, _, v in m.found.moved}
    assert at["omega(d)"] == pytest.approx(-25 / 3)


def test_drive_at_the_cut_joint_is_a_constraint():
    m = machine(four_bar(a="guess=20deg") + "\nDRIVE d1 close q={0.6+time}")
    assert [row.owner for row in m.rows] == ["close", "close", "d1"]
    assert m.found.dof == 0
    at = {name: v for name, _, v in m.found.moved}
    assert reads(m, "angle", "close", at=at) == pytest.approx(0.6)
    assert reads(m, "omega", "close", at=at) == pytest.approx(1.0)


def test_islands_are_free():
    m = machine("BODY a m=1 j=1 x=1 vx=2\nBODY b m=1 j=1\nJOINT j a b(0.5,0) pin ic=0.1\n.gravity 9.81")
    assert m.plan.roots == ["a"]
    assert [c.q_name for c in m.own] == ["angle(j)", "x(a)", "y(a)", "angle(a)"]
    assert m.found.dof == 4


def test_bricard_mechanism_has_one_freedom():
    """Six pins in a ring, five closure rows, one of them redundant in every configuration."""
    deck = [".gravity 9.81"]
    ends = [(1, 0, 0), (0, -1, 0), (0, 0, 1), (-1, 0, 0), (0, 1, 0)]
    axes = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    previous = "0"
    for k, (end, axis) in enumerate(zip(ends, axes, strict=True)):
        along, across = 0.0016666666666666668, 0.08416666666666667
        j = ",".join(str(along if c else across) for c in end)
        com = ",".join(str(c / 2) for c in end)
        deck.append(f"BODY r{k} m=1 com=({com}) j=({j})")
        deck.append(f"JOINT p{k} {previous} r{k} pin axis=({','.join(map(str, axis))})")
        previous = f"r{k}({','.join(map(str, end))})"
    deck.append("JOINT p5 0(0,0,1) r4(0,1,0) pin axis=(1,0,0)")
    m = machine("\n".join(deck))
    assert len(m.own) == 5 and len(m.rows) == 4 and len(m.found.redundant) == 1
    assert m.found.dof == 1 and not m.report()["planar"]
