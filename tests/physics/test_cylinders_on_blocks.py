"""Cylinders on boxes and hulls in space: gaps and normals by distances that are found otherwise, what stands, tips, rolls and
falls by closed forms and an own integration, the energy, any order of cards."""

from __future__ import annotations

import random

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from test_pairs_of_solids import SIZES, UP, card, corners, pose, run, to_points, tumbles
from test_shapes import G, never_rises

import emsim

Placed = tuple[np.ndarray, np.ndarray]


def distance(kind: str, block: Placed, can: Placed) -> float:
    """From a cylinder to what is straight: over all places of the cylinder the distance to that, which is convex."""
    (turn, at), (other, to) = can, block
    r, h = SIZES["cylinder"]
    size, straight = np.array([r, r, 0.5 * h]), corners(kind) @ other.T + to

    def squared(u: np.ndarray) -> tuple[float, np.ndarray]:
        away = to_points(at + turn @ (size * u), straight)
        return 100.0 * float(away @ away), 200.0 * size * (turn.T @ away)

    inside = {
        "type": "ineq",
        "fun": lambda u: 1.0 - u[:2] @ u[:2],
        "jac": lambda u: [-2 * u[0], -2 * u[1], 0],
    }
    best = np.inf
    for start in ([0.0, 0.0, 0.0], [0.3, 0.2, 0.1]):
        found = minimize(
            squared,
            start,
            jac=True,
            constraints=[inside],
            bounds=[(-1, 1)] * 3,
            tol=1e-20,
            options={"maxiter": 999},
        )
        u = np.clip(found.x, -1, 1)
        u[:2] /= max(1.0, np.hypot(*u[:2]))
        best = min(best, squared(u)[0])
    return 0.1 * float(np.sqrt(best))


def matrix(turn: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(turn).as_matrix()


def placed(name: str, kind: str, at: np.ndarray, turn: np.ndarray, more: str = "") -> str:
    where = " ".join(f"{n}={v!r}" for n, v in zip("xyz", at.tolist(), strict=True))
    turned = ",".join(map(repr, turn.tolist()))
    return f"BODY {name} m=1 shape={card(kind)} com=(0,0,0) j=(1,1,1) {where} rot=({turned}) {more}"


@pytest.mark.parametrize("kind", ["box", "hull"])
def test_the_gap_is_the_distance(kind):
    """Of random poses that are apart."""
    rng = random.Random(kind)
    done = 0
    while done < 10:
        (turn, way), (other, _) = pose(rng), pose(rng)
        at = way / np.linalg.norm(way) * rng.uniform(0.05, 0.5)
        far = distance(kind, (matrix(other), np.zeros(3)), (matrix(turn), at))
        if far < 1e-3:
            continue
        done += 1
        bodies = [placed("a", "cylinder", at, turn), placed("b", kind, np.zeros(3), other)]
        deck = "\n".join([*rng.sample(bodies, 2), "CONTACT c a b e=0"])
        r = emsim.run(f"t\n{deck}\n.tran 1u 1u\n.save gap(c)\n.end\n")
        assert r["gap(c)"][0] == pytest.approx(far, abs=1e-9), deck


@pytest.mark.parametrize("kind", ["box", "hull"])
def test_it_is_thrown_back_along_the_normal(kind):
    """What cannot turn changes its speed along the normal: so far off along it as it is moved, it is then so far off."""
    rng = random.Random(kind)
    for _ in range(5):
        (turn, way), (other, _) = pose(rng), pose(rng)
        at = way / np.linalg.norm(way) * 0.6
        speed = -at + np.array([rng.uniform(-0.02, 0.02) for _ in range(3)])
        moves = " ".join(f"v{n}={v!r}" for n, v in zip("xyz", speed.tolist(), strict=True))
        still = f"SHAPE f 0 {card(kind)} rot=({','.join(map(repr, other.tolist()))})"
        thrown = placed("a", "cylinder", at, turn, moves).replace("j=(1,1,1)", "j=(1e9,1e9,1e9)")
        saved = "x(a) y(a) z(a) vx(a) vy(a) vz(a) hits(c)"
        r = emsim.run(
            f"t\n{still}\n{thrown}\nCONTACT c all e=0\n.options reltol=1e-9\n.tran 5m 0.8\n.save {saved}\n.end\n"
        )
        k = int(np.flatnonzero(np.asarray(r["hits(c)"]) > 0)[0])
        normal = np.array([r[f"v{n}(a)"][k] for n in "xyz"]) - speed
        normal /= np.linalg.norm(normal)
        there = np.array([r[f"{n}(a)"][k] for n in "xyz"]) + 0.01 * normal
        assert distance(kind, (matrix(other), np.zeros(3)), (matrix(turn), there)) == pytest.approx(
            0.01, abs=1e-8
        )


TABLE = "SHAPE f 0 box(1,0.2,1) at=(0,-0.1,0)"


def tilted(cards: str, angle: float, until: float, save: str):
    """The same with the floor tilted down towards +x."""
    down = f".gravity {float(G * np.sin(angle))!r} {float(-G * np.cos(angle))!r} 0"
    return emsim.run(
        f"t\n{down}\n{cards}\n.options reltol=1e-7\n.tran 5m {until}\n.save energy() {save}\n.end\n"
    )


@pytest.mark.parametrize("part", [0.99, 1.01])
def test_a_can_tips_over_its_rim(part):
    """Where its middle comes over that: tan a = 2 r/h. It stands by twelve places of the rim, one of which is below."""
    r, h = 0.05, 0.2
    body = f"BODY b m=2 shape=cylinder({r},{h}) y={0.5 * h} {UP}"
    found = tilted(f"{TABLE}\n{body}\nCONTACT c all e=0 mu=3", np.arctan(part * 2 * r / h), 0.8, "x(b) wz(b)")
    assert (found["x(b)"][-1] > 1e-3) == (part > 1.0)
    assert abs(found["x(b)"][-1]) < 1e-8 or part > 1.0


@pytest.mark.parametrize(("off", "stands"), [(-0.004, True), (0.004, False)])
def test_a_can_stands_on_the_edge_of_a_table_while_its_middle_does(off, stands):
    """Its end goes over the edge between two of its places: the crossings of edge and rim carry it."""
    body = f"BODY b m=2 shape=cylinder(0.05,0.1) x={0.5 + off} y=0.05 {UP}"
    r = run(f"{TABLE}\n{body}\nCONTACT c all e=0 mu=1", 0.5, "y(b) force(c)")
    if stands:
        assert r["y(b)"][-1] == pytest.approx(0.05, abs=1e-8)
        assert r["force(c)"][-1] == pytest.approx(2 * G, rel=1e-6)
    else:
        assert r["y(b)"][-1] < 0.0 and never_rises(r)


@pytest.mark.parametrize("deep", [0.5, 0.06])
def test_a_can_rolls_down_the_face_of_a_box(deep):
    """With 2/3 g sin a; on both of its rims, or across a beam that is less deep than it is long."""
    angle, until = 0.1, 0.6
    cards = f"SHAPE f 0 box(2,0.2,{deep}) at=(0,-0.1,0)\nBODY b m=0.7 shape=cylinder(0.05,0.1) y=0.05"
    r = tilted(f"{cards}\nCONTACT c all e=0 mu=1", angle, until, "x(b) force(c) gap(c) mode(c)")
    assert r["x(b)"][-1] == pytest.approx(G * np.sin(angle) * until**2 / 3, rel=1e-6)
    assert r["force(c)"][-1] == pytest.approx(0.7 * G * np.cos(angle), rel=1e-6) and r["mode(c)"][-1] == 2


def test_a_can_rolls_over_the_edge_of_a_table():
    """Without slip, it turns about the edge: a'' = 2/3 g/r sin a, of three tolerances, and leaves it at cos a = 4/7 of that at
    the start."""
    radius, start = 0.05, 0.3

    def leaves(_: float, y: np.ndarray) -> float:
        return G * np.cos(y[0]) - radius * y[1] ** 2

    leaves.terminal = True  # type: ignore[attr-defined]
    found = solve_ivp(
        lambda _, y: [y[1], 2 / 3 * G / radius * np.sin(y[0])],
        (0, 1),
        [start, 0.0],
        events=leaves,
        dense_output=True,
        rtol=1e-12,
        atol=1e-13,
    )
    assert np.cos(found.y[0, -1]) == pytest.approx(4 / 7 * np.cos(start), rel=1e-9)
    # (as it leaves it slips, whatever mu)
    leave = float(found.t[-1])
    angle, rate = found.sol(0.9 * leave)
    where = f"x={float(0.5 + radius * np.sin(start))!r} y={float(radius * np.cos(start))!r}"
    deck = f"{TABLE}\nBODY b m=0.7 shape=cylinder({radius},0.1) {where}\nCONTACT c all e=0 mu=50"
    errors = []
    for reltol in (1e-4, 1e-6, 1e-8):
        r = run(deck, 0.9 * leave, "x(b) y(b) wz(b) gap(c) mode(c)", reltol)
        last = [r["x(b)"][-1] - 0.5, r["y(b)"][-1], radius * r["wz(b)"][-1]]
        errors.append(np.abs(np.array(last) - radius * np.array([np.sin(angle), np.cos(angle), -rate])).max())
        assert np.min(r["gap(c)"]) > -1e-6 and r["mode(c)"][-1] == 2
    assert errors[-1] < 1e-7 and errors[0] < 1e-3
    r = run(deck, 1.05 * leave, "mode(c)")
    assert r["mode(c)"][-1] == 0 and never_rises(r)


@pytest.mark.parametrize("law", ["e=0", "e=0.3 mu=0.3"])
@pytest.mark.parametrize(
    ("fixed", "falls", "high"),
    [
        ("box(0.3,0.3,0.3)", f"cylinder(0.05,0.1) {UP}", 0.2),
        ("box(0.06,0.3,0.06)", f"cylinder(0.05,0.1) {UP}", 0.2),
        ("box(0.06,0.3,0.06)", "cylinder(0.05,0.1)", 0.2),
        (f"cylinder(0.15,0.3) {UP}", "box(0.1,0.1,0.1) rot=(0,0.3,0)", 0.2),
        (f"cylinder(0.15,0.3) {UP}", "box(0.3,0.1,0.1)", 0.2),
    ],
)
def test_what_falls_flat_comes_to_rest(fixed, falls, high, law):
    """At its height, its weight borne: an end on a flat, on a smaller one, a side across it, a box on an end, beyond it."""
    r = run(
        f"SHAPE f 0 {fixed}\nBODY b m=2 shape={falls} y={high + 0.02}\nCONTACT c all {law}",
        0.4,
        "y(b) force(c)",
    )
    assert r["y(b)"][-1] == pytest.approx(high, abs=1e-7)
    assert r["force(c)"][-1] == pytest.approx(2 * G, rel=1e-6) and never_rises(r)


@pytest.mark.parametrize("law", ["e=0.3", "e=0 mu=0.3"])
@pytest.mark.parametrize(
    ("fixed", "falls"),
    [
        ("box(0.3,0.3,0.3)", "cylinder(0.08,0.16)"),
        ("cylinder(0.15,0.3)", "box(0.2,0.1,0.16)"),
        (card("hull"), "cylinder(0.08,0.16)"),
    ],
)
def test_what_tumbles_over_another_only_loses(fixed, falls, law):
    tumbles(fixed, falls, law, 0.4)
