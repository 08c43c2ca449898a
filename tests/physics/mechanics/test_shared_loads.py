"""Where joints hold more than there is to hold, loads are shared as equally stiff joints share them: the least of all answers.

The references solve for the whole wrench of every joint by a pseudo-inverse, from the free bodies alone.
"""

from __future__ import annotations

from itertools import permutations
from math import cos, sin
from random import Random

import numpy as np
import pytest

import emsim

FORMULATIONS = ("joint", "absolute")
G = 9.81


def run(cards: str, formulation: str, options: str = "") -> emsim.Result:
    return emsim.run(f"t\n{cards}\n.options formulation={formulation} {options}\n.end\n")


def at_end(r: emsim.Result, *names: str) -> list[float]:
    return [float(r[name][-1]) for name in names]


# supports ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("analysis", [".op", ".op static", ".tran 1m 5m"])
def test_three_supports_were_zero_all_zero_by_the_order_of_cards(formulation, analysis):
    beam = f"""BODY beam shape=rod(1) m=2
JOINT l 0 beam pin
JOINT m 0(0.5,0) beam(0.5,0) pinslot axis=(1,0)
JOINT r 0(1,0) beam(1,0) pinslot axis=(1,0)
.gravity {G}
{analysis}
.save fx(l) fy(l) fy(m) fy(r)"""
    r = run(beam, formulation)
    assert at_end(r, "fx(l)", "fy(l)", "fy(m)", "fy(r)") == pytest.approx([0.0, *[2 * G / 3] * 3], abs=1e-9)
    (note,) = [d for d in r.diagnostics if d.code == "W240"]
    assert note.message.startswith("fy(l), fy(m), fy(r): not unique") and "equally stiff" in note.hint


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_bench_with_a_load_aside_shares_by_a_straight_line_in_any_order_of_cards(formulation):
    places = {"a": 0.0, "b": 0.9, "c": 2.0}
    supports = [
        f"JOINT {n} 0({x},0) plank({x},0) {'pin' if n == 'a' else 'pinslot axis=(1,0)'}"
        for n, x in places.items()
    ]
    x = np.array([*places.values()])
    weight, moment = 7 * G, (3 * 1.0 + 4 * 1.4) * G
    # stiff springs of one kind under a straight plank: f = p + q x, with the sum and the moment of the loads
    p, q = np.linalg.solve([[3, x.sum()], [x.sum(), (x * x).sum()]], [weight, moment])
    for order in permutations(supports):
        cards = "\n".join(
            ["BODY plank shape=rod(2) m=3", "BODY load m=4 j=0.01", *order, "JOINT on plank(1.4,0) load weld"]
        )
        r = run(f"{cards}\n.gravity {G}\n.op\n.save fy(a) fy(b) fy(c)", formulation)
        assert at_end(r, "fy(a)", "fy(b)", "fy(c)") == pytest.approx(p + q * x, abs=1e-9)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("read", ["fy(r)", "fy(r) fy(l) mz(l)"])
def test_a_roller_under_a_beam_that_is_welded_carries_its_share(formulation, read):
    """Its closure rows fold to constants: it was said to carry nothing, without a word."""
    cards = f"""BODY beam shape=rod(1) m=2
JOINT l 0 beam weld
JOINT r 0(1,0) beam(1,0) pinslot axis=(1,0)
.gravity {G}
.op
.save {read}"""
    r = run(cards, formulation)
    # l = 1/2 m, so moments count four times: the least of F_l^2 + F_r^2 + (M/l)^2 has no moment at all here
    assert at_end(r, "fy(r)") == pytest.approx([G], abs=1e-9)
    assert "W240" in [d.code for d in r.diagnostics]


KINDS = {  # forces along (across) the joint's axis, and a moment: what it holds
    "pin": ("x", "y"),
    "weld": ("x", "y", "m"),
    "slide": ("n", "m"),
    "pinslot": ("n",),
}


def least(bodies: list[tuple[float, np.ndarray]], joints: list[tuple]) -> dict[str, np.ndarray]:
    """(fx, fy, mz) of every joint: free bodies of (mass, place), joints of (name, kind, A or -1, B, place, direction of axis)."""
    columns, equilibrium, weights = [], [], []
    at = np.array([place for *_, place, _ in joints])
    extent = np.sqrt(((at - at.mean(axis=0)) ** 2).sum(axis=1).mean())
    for k, (_, kind, a, b, place, angle) in enumerate(joints):
        for held in KINDS[kind]:
            wrench = {
                "x": (1, 0, 0),
                "y": (0, 1, 0),
                "m": (0, 0, 1),
                "n": (-np.sin(angle), np.cos(angle), 0),
            }[held]
            row = np.zeros(3 * len(bodies))
            for body, sign in ((b, 1.0), (a, -1.0)):
                if body >= 0:
                    arm = place - bodies[body][1]
                    turned = wrench[2] + arm[0] * wrench[1] - arm[1] * wrench[0]
                    row[3 * body : 3 * body + 3] = sign * np.array([wrench[0], wrench[1], turned])
            columns.append((k, np.array(wrench, float)))
            equilibrium.append(row)
            weights.append(1.0 / extent if held == "m" else 1.0)
    matrix, scale = np.array(equilibrium).T, np.array(weights)
    loads = np.concatenate([[0.0, m * G, 0.0] for m, _ in bodies])
    found = np.linalg.pinv(matrix / scale, 1e-9) @ loads / scale
    assert np.allclose(matrix @ found, loads, atol=1e-9)
    return {
        joint[0]: sum(v * wrench for v, (i, wrench) in zip(found, columns, strict=True) if i == k)
        for k, joint in enumerate(joints)
    }


@pytest.mark.parametrize("seed", range(6))
def test_two_bodies_on_joints_of_all_kinds_are_as_a_pseudo_inverse_has_them(seed):
    """All joints of one group: a frame that no joint can leave out without the others noticing."""
    random = Random(seed)

    def place() -> np.ndarray:
        return np.array([round(random.uniform(-1, 1), 3), round(random.uniform(-1, 1), 3)])

    bodies = [(random.uniform(1, 3), place()) for _ in range(2)]
    joints = [
        (f"j{k}", random.choice([*KINDS]), a, b, place(), random.uniform(0, 3))
        for k, (a, b) in enumerate([(-1, 0), (0, 1), (-1, 1), (0, 1), (-1, 0), (-1, 1)])
    ]
    joints[0], joints[1] = (*joints[0][:1], "weld", *joints[0][2:]), (*joints[1][:1], "weld", *joints[1][2:])
    expected = least(bodies, joints)
    cards = [f"BODY b{k} m={m!r} j=1 com=({c[0]},{c[1]})" for k, (m, c) in enumerate(bodies)]
    lines = []
    for name, kind, a, b, at, angle in joints:
        axis = f" axis=({cos(angle)!r},{sin(angle)!r})" if kind in ("slide", "pinslot") else ""
        x, y = at
        lines.append(f"JOINT {name} {'0' if a < 0 else f'b{a}'}({x},{y}) b{b}({x},{y}) {kind}{axis}")
    names = [f"{fn}({joint[0]})" for joint in joints for fn in ("fx", "fy", "mz")]
    for formulation in FORMULATIONS:
        random.shuffle(lines)
        r = run("\n".join([*cards, *lines, f".gravity {G}", ".op", f".save {' '.join(names)}"]), formulation)
        found = np.array(at_end(r, *names)).reshape(-1, 3)
        assert found == pytest.approx(np.array([*expected.values()]), abs=1e-8)


# what moves ----------------------------------------------------------------------------------------------

BARS = f"""BODY c shape=rod(1) m=2
BODY a1 shape=rod(0.5) m=0.1
BODY a2 shape=rod(0.5) m=0.1
BODY a3 shape=rod(0.5) m=0.1
JOINT p1 0(0,0) a1 pin ic=-1
JOINT p2 0(0.5,0) a2 pin
JOINT p3 0(1,0) a3 pin
JOINT q1 a1(0.5,0) c(0,0) pin
JOINT q2 a2(0.5,0) c(0.5,0) pin
JOINT q3 a3(0.5,0) c(1,0) pin
.gravity {G}
.tran 5m 0.5
.print tran """


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("method", ["auto", "dop853", "radau", "trap", "esdirk", "gauss"])
def test_three_parallel_bars_carry_a_third_each_at_every_instant(formulation, method):
    names = [f"{fn}({joint})" for joint in ("p1", "p2", "p3", "q1", "q2", "q3") for fn in ("fx", "fy")]
    r = run(
        BARS + " ".join([*names, "angle(p1)", "omega(p1)", "energy()"]),
        formulation,
        f"method={method} reltol=1e-7",
    )
    v = {name: np.array(r[name]) for name in names}
    angle, omega = np.array(r["angle(p1)"]), np.array(r["omega(p1)"])
    # what moves is one freedom: (m + 3 j/l^2) l^2 q'' = -(m + 3/2 m_bar) g l cos q, and the platform goes on a circle
    length, mass, bar = 0.5, 2.0, 0.1
    turning = -(mass + 1.5 * bar) * G / ((mass + bar) * length) * np.cos(angle)
    ax = length * (-np.sin(angle) * turning - np.cos(angle) * omega**2)
    ay = length * (np.cos(angle) * turning - np.sin(angle) * omega**2)
    near = dict(abs=2e-4, rel=1e-5)
    for k in "123":
        assert v[f"fx(q{k})"] == pytest.approx(mass * ax / 3, **near)
        assert v[f"fy(q{k})"] == pytest.approx(mass * (ay + G) / 3, **near)
        # less what the bar itself takes, whose centre goes half as far
        assert v[f"fx(p{k})"] == pytest.approx(mass * ax / 3 + bar * ax / 2, **near)
        assert v[f"fy(p{k})"] == pytest.approx(mass * (ay + G) / 3 + bar * (ay / 2 + G), **near)
    energy = np.array(r["energy()"])
    assert energy == pytest.approx(energy[0], abs=1e-4)
    assert min(angle) < -1.8


def test_motion_does_not_depend_on_whether_reactions_are_read():
    read = run(BARS + "angle(p1) fx(q2)", "joint", "method=radau")
    unread = run(BARS + "angle(p1)", "joint", "method=radau")
    assert float(read["angle(p1)"][-1]) == pytest.approx(float(unread["angle(p1)"][-1]), abs=1e-9)


def test_a_pose_where_all_bars_lie_in_one_line_has_numbers():
    """Rows lose rank there: what is shown stays finite and joins what is shown beside it."""
    names = [f"{fn}({joint})" for joint in ("p1", "p2", "p3") for fn in ("fx", "fy")]
    cards = BARS.replace("ic=-1", "ic=(-0.3,6)").replace(".tran 5m 0.5", ".tran 1m 0.1")
    r = run(cards + " ".join(["angle(p1)", *names]), "joint")
    assert min(r["angle(p1)"]) < 0.0 < max(r["angle(p1)"])
    for name in names:
        assert np.abs(np.array(r[name])).max() < 20.0


def hinges(centre: np.ndarray, spin: float, mass: float, heights: list[float]) -> np.ndarray:
    """(fx, fy, fz, mx, my) of hinges on a vertical axis that carry a door of three equal moments of inertia."""
    arm = centre * [1.0, 1.0, 0.0]
    force = mass * (-(spin**2) * arm + [0.0, 0.0, G])
    moment = np.cross(centre, force)
    extent = np.std(heights)
    blocks = []
    for z in heights:
        block = np.zeros((6, 5))
        block[:3, :3] = np.eye(3)
        block[3:, :3] = np.array([np.cross([0.0, 0.0, z], e) for e in np.eye(3)]).T
        block[3:5, 3:] = np.eye(2) * extent
        blocks.append(block)
    found = np.linalg.pinv(np.hstack(blocks)) @ [*force, *moment]
    found = found.reshape(-1, 5)
    found[:, 3:] *= extent
    return found


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("heights", [[0.2, 1.8], [0.2, 0.7, 1.8], [1.8, 0.2, 0.7]])
def test_a_door_on_hinges_of_one_axis(formulation, heights):
    """All rows of a second hinge fold to constants. The door turns on at its speed."""
    names = [f"{fn}(h{k})" for k in range(len(heights)) for fn in ("fx", "fy", "fz", "mx", "my")]
    cards = ["BODY d m=10 j=(1,1,1) com=(0.4,0,1)"]
    for k, z in enumerate(heights):
        cards.append(f"JOINT h{k} 0(0,0,{z}) d(0,0,{z}) pin axis=(0,0,1)" + (" ic=(0.3,1)" if k == 0 else ""))
    cards += [f".gravity 0 0 {-G}", ".tran 10m 0.5", f".print tran angle(h0) {' '.join(names)}"]
    r = run("\n".join(cards), formulation, "reltol=1e-7")
    for row in (0, -1):
        q = float(r["angle(h0)"][row])
        expected = hinges(np.array([0.4 * np.cos(q), 0.4 * np.sin(q), 1.0]), 1.0, 10.0, heights)
        found = np.array([float(r[name][row]) for name in names]).reshape(-1, 5)
        assert found == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("read", ["fx(h1)", "fz(h1)"])
def test_reading_one_hinge_is_as_reading_all(read):
    cards = f"""BODY d m=10 j=(1,1,1) com=(0.4,0,1)
JOINT h0 0(0,0,0.2) d(0,0,0.2) pin axis=(0,0,1)
JOINT h1 0(0,0,1.8) d(0,0,1.8) pin axis=(0,0,1)
.gravity 0 0 {-G}
.op
.save {read}"""
    expected = hinges(np.array([0.4, 0.0, 1.0]), 0.0, 10.0, [0.2, 1.8])[1, 0 if read[1] == "x" else 2]
    for formulation in FORMULATIONS:
        assert at_end(run(cards, formulation), read) == pytest.approx([expected], abs=1e-6)


# efforts, friction -----------------------------------------------------------------------------------------


def test_two_drives_of_one_freedom_share_it():
    """A parallelogram whose two cranks are driven alike: each takes half of what one alone takes."""
    cards = f"""BODY c shape=rod(1) m=2
BODY a1 shape=rod(0.5) m=0.1
BODY a2 shape=rod(0.5) m=0.1
JOINT p1 0(0,0) a1 pin guess=1
JOINT p2 0(1,0) a2 pin guess=1
JOINT q1 a1(0.5,0) c(0,0) pin
JOINT q2 a2(0.5,0) c(1,0) pin
DRIVE d1 p1 q={{1+0.3*sin(5*time)}}
.gravity {G}
.tran 10m 0.5
.print tran torque(d1)"""
    alone = np.array(run(cards, "joint", "method=radau reltol=1e-7")["torque(d1)"])[[0, -1]]
    both = cards.replace(".gravity", "DRIVE d2 p2 q={1+0.3*sin(5*time)}\n.gravity") + " torque(d2) fx(q2)"
    for formulation in FORMULATIONS:
        r = run(both, formulation, "method=radau reltol=1e-7")
        for name in ("torque(d1)", "torque(d2)"):
            assert np.array(r[name])[[0, -1]] == pytest.approx(alone / 2, abs=1e-4)


def test_gears_in_a_ring_share_a_torque():
    """Three gears tie three wheels. Self-stress (1, 2, -1) of their efforts: the least answer has nothing of it."""
    cards = f"""BODY w1 m=1 j=0.1 com=(0.1,0)
BODY w2 m=1 j=0.1
BODY w3 m=1 j=0.1
JOINT p1 0(0,0) w1 pin ic=0.2
JOINT p2 0(1,0) w2 pin
JOINT p3 0(2,0) w3 pin
GEAR g1 p1 p2 ratio=2
GEAR g2 p2 p3 ratio=0.5
GEAR g3 p1 p3 ratio=1
.gravity {G}
.tran 10m 0.1
.print tran torque(g1) torque(g2) torque(g3)"""
    r = run(cards, "joint")
    one, two, three = (np.array(r[f"torque(g{k})"]) for k in (1, 2, 3))
    assert one + 2 * two - three == pytest.approx(0.0, abs=1e-9)
    assert abs(one[-1]) > 0.01
    # what the first wheel gets turns it: both others follow at 1/2 and at 1 of its acceleration
    turning = -G * 0.1 * np.cos(0.2) / (0.11 + 0.1 + 0.1 / 4)
    assert one[0] + three[0] == pytest.approx(0.11 * turning + G * 0.1 * np.cos(0.2), rel=1e-6)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("rubs", ["l", "m"])
def test_friction_goes_with_the_shared_load_and_is_named(formulation, rubs):
    """A slide in two guides rubs in one: half of its weight is there, whichever guide it is."""
    cards = f"""BODY s m=2 j=0.1
JOINT l 0 s slide axis=(1,0) ic=(0,1)
JOINT m 0(0,0.4) s(0,0.4) slide axis=(1,0)
FRICTION f {rubs} mu=0.3
.gravity {G}
.tran 10m 0.2
.print tran vel(l)"""
    r = run(cards, formulation)
    assert at_end(r, "vel(l)") == pytest.approx([1 - 0.3 * G / 2 * 0.2], abs=1e-6)
    (note,) = [d for d in r.diagnostics if d.code == "W240"]
    assert "FRICTION f" in note.hint and "motion depends" in note.hint


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_loop_of_driven_joints_alone_that_comes_open_is_told(formulation):
    """Nothing is left to move, so every closure row is left out; it opened without a word."""
    r = run(
        """BODY a m=1 j=0.1
BODY b m=1 j=0.1
JOINT p1 0 a slide axis=(1,0)
JOINT p2 0 b slide axis=(1,0)
JOINT z a b weld
DRIVE d1 p1 q={sin(5*time)}
DRIVE d2 p2 q={1.1*sin(5*time)}
.tran 10m 0.1
.print tran pos(p1)""",
        formulation,
    )
    assert "W413" in [d.code for d in r.diagnostics]


def test_what_is_determined_beside_it_is_as_it_was():
    """A pendulum beside three supports has its own reaction, to the last bit."""
    pendulum = """BODY arm shape=rod(0.3) m=0.2
JOINT h 0(5,0) arm pin ic=0.3
"""
    beam = """BODY beam shape=rod(1) m=2
JOINT l 0 beam pin
JOINT m 0(0.5,0) beam(0.5,0) pinslot axis=(1,0)
JOINT r 0(1,0) beam(1,0) pinslot axis=(1,0)
"""
    tail = f".gravity {G}\n.op\n.save fx(h) fy(h)"
    alone = at_end(run(pendulum + tail, "joint"), "fx(h)", "fy(h)")
    r = run(pendulum + beam + tail + " fy(m)", "joint")
    assert at_end(r, "fx(h)", "fy(h)") == alone
    assert [d.message.partition(":")[0] for d in r.diagnostics if d.code == "W240"] == ["fy(m)"]
