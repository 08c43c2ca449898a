"""CONTACT between solids in space, pair by pair: gaps by distances that are found otherwise, closed forms of impacts and of rest,
own integrations, boxes as hulls, many-sided hulls as cylinders, the energy, any order of cards."""

from __future__ import annotations

import random
from itertools import product

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize, minimize_scalar, nnls
from scipy.spatial.transform import Rotation
from test_shapes import G, never_rises

import emsim
from emsim.diagnostics import DeckError

SIZES = {
    "ball": (0.1,),
    "capsule": (0.3, 0.06),
    "box": (0.2, 0.1, 0.16),
    "ellipsoid": (0.12, 0.07, 0.05),
    "cylinder": (0.1, 0.14),
    "disc": (0.12,),
    "hull": (-0.1, 0.0, 0.02, 0.08, -0.05, 0.0, 0.07, 0.06, -0.04, -0.02, 0.09, 0.03, 0.01, 0.01, 0.12, 0.0, -0.02, -0.11),
}  # fmt: skip
PAIRS = [
    *(("ball", other) for other in ("cylinder", "disc", "ellipsoid", "hull", "box", "capsule")),
    *(("capsule", other) for other in ("capsule", "box", "hull", "cylinder", "disc")),
    *(("ellipsoid", other) for other in ("box", "hull", "capsule", "ellipsoid")),
]


def card(kind: str) -> str:
    return f"{kind}({','.join(map(repr, SIZES[kind]))})"


def corners(kind: str) -> np.ndarray:
    """Those of what is straight, its radius aside."""
    sizes = SIZES[kind]
    if kind == "box":
        return np.array(list(product(*((-0.5 * w, 0.5 * w) for w in sizes))))
    if kind == "hull":
        return np.reshape(sizes, (-1, 3))
    return np.array([[0.0, 0.0, 0.0], [sizes[0], 0.0, 0.0]] if kind == "capsule" else [[0.0, 0.0, 0.0]])


def radius(kind: str) -> float:
    return SIZES[kind][-1] if kind in ("ball", "capsule") else 0.0


def to_points(p: np.ndarray, points: np.ndarray) -> np.ndarray:
    """From the nearest place of their hull to p: the least of all mixtures, by nonnegative least squares (Lawson and Hanson)."""
    away = points - p
    weights, _ = nnls(np.vstack([away.T, np.ones(len(points))]), np.array([0.0, 0.0, 0.0, 1.0]))
    return -(weights @ away) / weights.sum()


def to_drum(kind: str, p: np.ndarray) -> float:
    """From a cylinder or a disc to a place in its axes, by the plane through both."""
    high = 0.5 * SIZES[kind][1] if kind == "cylinder" else 0.0
    return float(np.hypot(max(np.hypot(p[0], p[1]) - SIZES[kind][0], 0.0), max(abs(p[2]) - high, 0.0)))


def of_ellipsoids(one: np.ndarray, other: np.ndarray, away: np.ndarray) -> float:
    """The least |away + other v - one u| of u and v in the unit ball."""

    def squared(w: np.ndarray) -> tuple[float, np.ndarray]:
        off = away + other @ w[3:] - one @ w[:3]
        return float(off @ off), 2.0 * np.concatenate([-one.T @ off, other.T @ off])

    inside = [{"type": "ineq", "fun": lambda w, k=k: 1.0 - w[k : k + 3] @ w[k : k + 3]} for k in (0, 3)]
    best = minimize(squared, np.zeros(6), jac=True, constraints=inside, tol=1e-18, options={"maxiter": 500})
    return float(np.sqrt(best.fun))


def distance(a: str, b: str, where: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Between two solids, each turned and moved, by convex optimisation."""
    (turn, at), (other, to) = where
    if b in ("cylinder", "disc") and a == "capsule":
        begin, way = other.T @ (at - to), SIZES[a][0] * other.T @ turn[:, 0]
        found = minimize_scalar(
            lambda s: to_drum(b, begin + s * way), bounds=(0, 1), method="bounded", options={"xatol": 1e-12}
        )
        return min(found.fun, to_drum(b, begin), to_drum(b, begin + way)) - radius(a)
    straight = corners(b) @ other.T + to if b in ("ball", "capsule", "box", "hull") else None
    if a != "ellipsoid" and straight is not None:
        mine = corners(a) @ turn.T + at
        off = (mine[:, None] - straight[None]).reshape(-1, 3)
        return float(np.linalg.norm(to_points(np.zeros(3), off))) - radius(a) - radius(b)
    if a == "ball":
        a, b, (other, to), (turn, at), straight = b, a, (turn, at), (other, to), at[None]
    if straight is None:
        return of_ellipsoids(turn * SIZES[a], other * SIZES[b], to - at)
    if a in ("cylinder", "disc"):
        return to_drum(a, turn.T @ (straight[0] - at)) - radius(b)
    shape = turn * SIZES[a]

    def squared(u: np.ndarray) -> tuple[float, np.ndarray]:
        away = to_points(at + shape @ u, straight)
        return float(away @ away), 2.0 * shape.T @ away

    inside = {"type": "ineq", "fun": lambda u: 1.0 - u @ u, "jac": lambda u: -2.0 * u}
    start = shape.T @ (straight.mean(axis=0) - at)
    best = minimize(squared, start / np.linalg.norm(start), jac=True, constraints=[inside], tol=1e-18)
    u = best.x / max(1.0, np.linalg.norm(best.x))
    return float(np.sqrt(squared(u)[0])) - radius(b)


def pose(rng: random.Random) -> tuple[np.ndarray, np.ndarray]:
    return np.array([rng.uniform(-2, 2) for _ in range(3)]), np.array([rng.gauss(0, 1) for _ in range(3)])


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_the_gap_is_the_distance(a, b):
    """Of random poses that are apart."""
    rng = random.Random(f"{a} {b}")
    done = 0
    while done < 8:
        (turn, way), (other, _) = pose(rng), pose(rng)
        at = way / np.linalg.norm(way) * rng.uniform(0.1, 0.5)
        where = [
            (Rotation.from_rotvec(turn).as_matrix(), at),
            (Rotation.from_rotvec(other).as_matrix(), np.zeros(3)),
        ]
        far = distance(a, b, where)
        if far < 1e-3:
            continue
        done += 1
        put = [" ".join(f"{n}={v!r}" for n, v in zip("xyz", at.tolist(), strict=True)), ""]
        bodies = [
            f"BODY {n} m=1 shape={card(kind)} com=(0,0,0) j=(1,1,1) {p} rot=({','.join(map(repr, r.tolist()))})"
            for n, kind, p, r in zip("ab", (a, b), put, (turn, other), strict=True)
        ]
        deck = "\n".join([*rng.sample(bodies, 2), "CONTACT c a b e=0"])
        r = emsim.run(f"t\n{deck}\n.tran 1u 1u\n.save gap(c)\n.end\n")
        assert r["gap(c)"][0] == pytest.approx(far, abs=1e-9), deck


def prism(sides: int, r: float, h: float) -> str:
    """A hull through places of both rims of a cylinder."""
    around = [2 * np.pi * k / sides for k in range(sides)]
    points = [(r * np.cos(a), r * np.sin(a), z) for a in around for z in (-0.5 * h, 0.5 * h)]
    return "hull(" + ",".join(repr(float(c)) for p in points for c in p) + ")"


def run(cards: str, until: float, save: str, reltol: float = 1e-7):
    deck = f"t\n.gravity {G}\n{cards}\n.options reltol={reltol:g}\n.tran 5m {until}\n.save energy() {save}\n.end\n"
    return emsim.run(deck)


def test_a_hull_of_many_sides_tends_to_the_cylinder():
    """No farther from a ball than the cylinder by more than r (1 - cos(pi/n)), the depth of a side."""
    where = "x=0.3 y=0.03 z=0.23"
    gaps = [
        run(f"SHAPE f 0 {shape}\nBODY b m=1 shape=ball(0.1) {where}\nCONTACT c all e=0", 1e-3, "gap(c)")[
            "gap(c)"
        ][0]
        for shape in ("cylinder(0.1,0.3)", *(prism(n, 0.1, 0.3) for n in (8, 16)))
    ]
    for n, gap in zip((8, 16), gaps[1:], strict=True):
        assert -1e-12 <= gap - gaps[0] <= 0.1 * (1 - np.cos(np.pi / n))
    assert gaps[1] - gaps[0] > 1e-4


def test_a_hull_with_the_corners_of_a_box_moves_as_it_does():
    corner = list(product((-0.1, 0.1), (-0.05, 0.05), (-0.08, 0.08)))
    random.Random(1).shuffle(corner)
    hull = "hull(" + ",".join(repr(c) for p in corner for c in p) + ")"
    ends = []
    for shape in ("box(0.2,0.1,0.16)", hull):
        deck = f"SHAPE f 0 box(1,0.2,1) at=(0,-0.1,0)\nBODY b m=1 shape={shape} y=0.2 rot=(0.3,0.4,0.5)\nCONTACT c all e=0.5"
        r = run(deck, 0.25, "x(b) y(b) z(b) vx(b) vy(b) vz(b)", 1e-9)
        ends.append([r[f"{n}(b)"][-1] for n in ("x", "y", "z", "vx", "vy", "vz")])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


UP = f"rot=({np.pi / 2!r},0,0)"  # an axis along y


@pytest.mark.parametrize("e", [1.0, 0.5])
@pytest.mark.parametrize(
    ("fixed", "falls", "at"),
    [
        (f"cylinder(0.1,0.2) {UP}", "ball(0.05)", 0.15),
        ("cylinder(0.1,0.6)", "ball(0.05) x=0", 0.15),
        (f"disc(0.1) {UP}", "ball(0.05)", 0.05),
        ("disc(0.1)", "ball(0.05)", 0.15),
        ("ellipsoid(0.2,0.1,0.3)", "ball(0.05)", 0.15),
        (prism(6, 0.1, 0.2), "ball(0.05)", 0.05 + 0.1 * np.sqrt(0.75)),
        ("cylinder(0.1,0.6)", "capsule(0.4,0.05) x=-0.2", 0.15),
        ("disc(0.1)", "capsule(0.4,0.05) x=-0.2", 0.15),
        ("box(0.4,0.2,0.4)", "ellipsoid(0.2,0.1,0.3)", 0.2),
        (f"box(0.4,0.1,0.1) rot=({np.pi / 4!r},0,0)", "ellipsoid(0.2,0.1,0.3)", 0.1 + 0.05 * np.sqrt(2)),
        ("capsule(0.4,0.05) at=(-0.2,0,0)", "ellipsoid(0.2,0.1,0.3)", 0.15),
        ("ellipsoid(0.3,0.1,0.1)", "ellipsoid(0.1,0.05,0.3)", 0.15),
        (prism(6, 0.1, 0.6), f"capsule(0.4,0.05) x=0 z=-0.2 rot=(0,{-np.pi / 2!r},0)", 0.05 + 0.1 * np.sqrt(0.75)),
    ],
)  # fmt: skip
def test_what_falls_on_another_is_thrown_back(fixed, falls, at, e):
    """On its middle, from 0.2 m: v = g t arrives, e v goes up, and nothing turns or goes aside."""
    deck = f"SHAPE f 0 {fixed}\nBODY b m=1 shape={falls} y={float(at) + 0.2!r}\nCONTACT c all e={e}"
    r = run(deck, 0.3, "vy(b) vx(b) wz(b) wx(b) hits(c)", 1e-8)
    v, k = np.sqrt(0.4 * G), int(np.flatnonzero(np.asarray(r["hits(c)"]) >= 1)[0])
    assert r.time[k] == pytest.approx(v / G, rel=1e-7)
    assert r["vy(b)"][k] == pytest.approx(e * v, rel=1e-6)
    assert max(abs(r[n][k]) for n in ("vx(b)", "wz(b)", "wx(b)")) < 1e-8 and never_rises(r)


@pytest.mark.parametrize(
    ("fixed", "lies", "high"),
    [
        (f"cylinder(0.15,0.3) at=(0,-0.15,0) {UP}", "capsule(0.4,0.05) x=-0.19 rot=(0,0.3,0)", 0.05),
        ("cylinder(0.15,0.6) at=(0,-0.15,0)", f"capsule(0.4,0.05) z=-0.19 rot=(0,{-np.pi / 2!r},0)", 0.05),
        ("cylinder(0.15,0.2) at=(0,-0.15,0)", f"capsule(0.4,0.05) z=-0.19 rot=(0,{-np.pi / 2!r},0)", 0.05),
        (prism(8, 0.15, 0.3) + f" at=(0,-0.15,0) {UP}", "capsule(0.4,0.05) x=-0.19 rot=(0,0.3,0)", 0.05),
        ("box(0.2,0.2,0.2) at=(0,-0.1,0)", prism(6, 0.05, 0.4) + " rot=(0,0.3,0)", 0.05 * np.sqrt(0.75)),
        ("box(0.6,0.2,0.6) at=(0,-0.1,0)", "ellipsoid(0.1,0.06,0.15)", 0.06),
    ],
)  # fmt: skip
def test_what_lies_on_another_rests(fixed, lies, high):
    """After a fall by 2 cm, at its height, its weight borne: on two places of a rim or of edges where it sticks out."""
    deck = f"SHAPE f 0 {fixed}\nBODY b m=2 shape={lies} y={float(high) + 0.02!r}\nCONTACT c all e=0"
    r = run(deck, 0.3, "y(b) force(c)")
    assert r["y(b)"][-1] == pytest.approx(high, abs=1e-8)
    assert r["force(c)"][-1] == pytest.approx(2 * G, rel=1e-7) and never_rises(r)


@pytest.mark.parametrize("law", ["e=0", "e=0.3", "e=0 mu=0.3"])
@pytest.mark.parametrize("shape", ["disc(0.12)", "cylinder(0.12,0.03)"])
@pytest.mark.parametrize(("lean", "spin"), [(0.0, "(0,0.3,0)"), (0.05, "(0,0,0)"), (-0.02, "(0.1,-0.2,0)")])
def test_what_is_flat_comes_to_lie_on_a_rod(law, shape, lean, spin):
    """Level, on the two places at which the rod crosses its rim, while it turns about the normal too; where it leans at first, it
    strikes with its lower side."""
    where = f"y=0.12 rot=({np.pi / 2!r},0,{lean!r}) omega={spin}"
    r = run(
        f"SHAPE f 0 capsule(0.6,0.06) at=(-0.3,0,0)\nBODY b m=1 shape={shape} {where}\nCONTACT c all {law}",
        0.3,
        "mode(c) gap(c)",
    )
    assert r["mode(c)"][-1] == 2 and np.min(r["gap(c)"]) > -1e-7 and never_rises(r)


@pytest.mark.parametrize("mu", [0.0, 3.0])
def test_a_ball_on_an_ellipsoid_goes_off_as_it_does_by_an_integration(mu):
    """Its centre on the curve r off the ellipse; it slides with its mass m, or rolls with 7/5 m."""
    a, b, r, start, until = 0.3, 0.2, 0.05, 1.4, 0.3
    inert = 1.4 if mu else 1.0

    def centre(q: float) -> np.ndarray:
        normal = np.array([np.cos(q) / a, np.sin(q) / b])
        return np.array([a * np.cos(q), b * np.sin(q)]) + r * normal / np.linalg.norm(normal)

    def moves(_: float, y: np.ndarray) -> list[float]:
        """inert (|c'|^2 q'' + c'.c'' q'^2) + g c'_y = 0; slopes by central differences, to 1e-10."""
        h = 1e-4
        near = [centre(y[0] + k * h) for k in (-2, -1, 0, 1, 2)]
        one = (near[0] - 8 * near[1] + 8 * near[3] - near[4]) / (12 * h)
        two = (-near[0] + 16 * near[1] - 30 * near[2] + 16 * near[3] - near[4]) / (12 * h * h)
        return [y[1], -(one @ two * y[1] ** 2 + G * one[1] / inert) / (one @ one)]

    found = solve_ivp(moves, (0, until), [start, 0.0], rtol=1e-11, atol=1e-12).y[0, -1]
    x, y = centre(start)
    body = f"BODY b m=0.7 shape=ball({r}) x={float(x)!r} y={float(y)!r}"
    deck = f"SHAPE f 0 ellipsoid({a},{b},0.25)\n{body}\nCONTACT c all e=0 mu={mu}"
    result = run(deck, until, "x(b) y(b) force(c) gap(c)", 1e-9)
    assert [result["x(b)"][-1], result["y(b)"][-1]] == pytest.approx(centre(found), abs=1e-7)
    assert result["force(c)"][-1] > 1 and np.max(np.abs(result["gap(c)"])) < 1e-9


@pytest.mark.parametrize(
    ("fixed", "falls"),
    [
        ("box(0.3,0.3,0.3)", "ellipsoid(0.12,0.05,0.07)"),
        ("box(0.3,0.3,0.3)", "capsule(0.2,0.05)"),
        ("ellipsoid(0.3,0.1,0.2)", "ellipsoid(0.1,0.05,0.2)"),
        ("cylinder(0.15,0.3)", "capsule(0.2,0.05)"),
        ("disc(0.2)", "ball(0.06)"),
        ("box(0.3,0.3,0.3)", card("hull")),
        (prism(5, 0.15, 0.3), "capsule(0.2,0.05)"),
        ("box(0.3,0.3,0.3)", "box(0.2,0.1,0.16)"),
    ],
)  # fmt: skip
def test_what_tumbles_over_another_only_loses(fixed, falls):
    tumbles(fixed, falls, "e=0.3", 0.5)


def tumbles(fixed, falls, law, until):
    """Without friction too: nothing is in another, no energy comes from nowhere, and an order of cards is none."""
    rng = random.Random(fixed + falls)
    turn, other, spin = (",".join(repr(rng.uniform(-1, 1)) for _ in range(3)) for _ in range(3))
    cards = [
        f"SHAPE f 0 {fixed} rot=({turn})",
        f"BODY b m=1 shape={falls} x=0.03 y=0.4 rot=({other}) omega=({spin})",
    ]
    ends = []
    for order in (cards, cards[::-1]):
        r = run("\n".join(order) + f"\nCONTACT c all {law}", until, "x(b) y(b) z(b) gap(c) hits(c)")
        assert never_rises(r) and np.min(r["gap(c)"]) > -1e-6 and r["hits(c)"][-1] > 0
        ends.append([r[n][-1] for n in ("x(b)", "y(b)", "z(b)")])
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


@pytest.mark.parametrize(
    ("a", "b"),
    [("cylinder", other) for other in ("cylinder", "disc", "ellipsoid")]
    + [("disc", "disc"), ("disc", "box"), ("disc", "hull"), ("ellipsoid", "disc")],
)
def test_pairs_that_have_no_rule_are_refused(a, b):
    with pytest.raises(
        DeckError, match=r"do not touch each other: (disc|cylinder)\(\.\.\) touches planes, balls"
    ):
        run(f"SHAPE f 0 {card(a)} rot=(1,0,0)\nBODY b m=1 shape={card(b)} y=1\nCONTACT c all e=0", 0.1, "")


def test_two_thin_ellipsoids_are_refused():
    with pytest.raises(DeckError, match="half-axes go up to 10 to 1"):
        run(
            "SHAPE f 0 ellipsoid(1,1,1)\nBODY b m=1 shape=ellipsoid(1,1,0.09) y=3\nCONTACT c all e=0", 0.1, ""
        )


@pytest.mark.parametrize("kind", ["box", "hull", "capsule", "ellipsoid"])
def test_what_is_in_another_at_the_start_is_an_error(kind):
    """Crossed ones too, of which no corner is in the other."""
    at = -0.15 if kind == "capsule" else 0.0
    deck = f"SHAPE f 0 box(0.6,0.03,0.03)\nBODY b m=1 shape={card(kind)} x={at}\nCONTACT c all e=0"
    with pytest.raises(DeckError, match="in each other at the start"):
        run(deck, 0.1, "")


def test_a_box_on_the_tilted_edge_of_another_only_loses():
    """Its lower edge meets an edge that leans: that crossing holds it, and no other place of both."""
    deck = "SHAPE f 0 box(0.3,0.3,0.3) at=(0,-0.2,0) rot=(0.3,0.2,0.5)\nBODY b m=1 shape=box(0.2,0.1,0.16) y=0.25 omega=(0,2,0)"
    r = run(f"{deck}\nCONTACT c all e=0", 0.5, "gap(c) hits(c)")
    assert r["hits(c)"][-1] > 0 and np.min(r["gap(c)"]) > -1e-6 and never_rises(r)


@pytest.mark.parametrize("seed", [0, 4, 5, 11])
def test_a_capsule_that_falls_on_a_cylinder_only_loses(seed):
    """Its place of touch goes from the side to a rim: two places that are nearly one, which no large impulses hold together."""
    rng = random.Random(seed)
    lies, x, turn, spin = (
        [rng.uniform(-s, s) for _ in range(n)] for n, s in ((3, 0.5), (1, 0.1), (3, 1.0), (3, 4.0))
    )
    rot = {
        name: ",".join(f"{v:.3f}" for v in vector)
        for name, vector in zip("ltw", (lies, turn, spin), strict=True)
    }
    r = run(
        f"SHAPE fixed 0 cylinder(0.15,0.3) rot=({rot['l']})\n"
        f"BODY falls m=1 shape=capsule(0.2,0.05) x={x[0]:.3f} y=0.35 rot=({rot['t']}) omega=({rot['w']})\n"
        "CONTACT c falls fixed e=0 mu=0.3",
        0.5, "gap(c)", 1e-6,
    )  # fmt: skip
    assert never_rises(r) and abs(r.energy.residual) < 1e-6 and np.min(r["gap(c)"]) > -1e-7
    assert r.stats["events"] < 100
