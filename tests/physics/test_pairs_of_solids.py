"""CONTACT between solids in space, pair by pair: gaps by distances that are found otherwise, closed forms of impacts and of rest, own
integrations, boxes as hulls, many-sided hulls as cylinders, the energy, any order of cards."""

from __future__ import annotations

import random
from itertools import product

import numpy as np
import pytest
from scipy.optimize import minimize, minimize_scalar, nnls
from scipy.spatial.transform import Rotation

import emsim

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
    *(("ellipsoid", other) for other in ("box", "hull", "capsule")),
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
    assert straight is not None
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
