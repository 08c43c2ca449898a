"""Random scenes of solids, an arm on a ball joint with friction, and a rope, in space: energy never rises, nothing is in another,
all come to the end without a short step that is told as wrong, and the order of the cards changes nothing."""

from __future__ import annotations

import random
from itertools import combinations

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from support import daily
from test_pairs_of_solids import SIZES, card, corners, radius

import emsim

FLAT = ("box", "hull", "capsule", "ball")
KINDS = (*FLAT, "ellipsoid", "cylinder")
ARM = 0.3  # m


class Scene:
    """Two solids are thrown on a block that stands on the floor; over it an arm, and in some of them a rope."""

    def __init__(self, seed: int) -> None:
        rng = random.Random(seed)
        self.kinds: dict[str, str] = {"block": rng.choice(("box", "hull", "ellipsoid"))}
        thrown = [rng.choice(KINDS) for _ in range(2)]
        # a cylinder has no rule with another, nor with an ellipsoid
        if "cylinder" in thrown and (
            self.kinds["block"] == "ellipsoid" or thrown[0] == thrown[1] or "ellipsoid" in thrown
        ):
            thrown = [kind if kind != "cylinder" else "box" for kind in thrown]
        self.fixed = [
            "SHAPE floor 0 plane(0,1,0)",
            f"SHAPE block 0 {card(self.kinds['block'])} at=(0,0.15,0)",
        ]
        self.cards = []
        if rng.random() < 0.6:
            hangs = ",".join(f"{rng.uniform(-0.3, 0.3) - (k == 2) * 1.57:.4f}" for k in range(3))
            self.fixed.append(f"BODY arm m=0.6 shape=capsule({ARM},0.06)")
            self.cards.append(f"JOINT hang 0(0,0.9,0) arm ball ic=({hangs})")
            if rng.random() < 0.6:
                self.cards.append("FRICTION dry hang fc=0.15")
            if rng.random() < 0.5:
                self.cards.append("STOP cone hang.swing max=50deg e=0.2")
        for k, kind in enumerate(thrown):
            self.kinds[f"b{k}"] = kind
            turn, spin = (",".join(f"{rng.uniform(-s, s):.4f}" for _ in range(3)) for s in (1, 5))
            side = 2 * k - 1
            speed = f"vx={rng.uniform(-0.5, 0.5):.4f} vz={-side * rng.uniform(0.4, 1.4):.4f}"
            self.fixed.append(
                f"BODY b{k} m={rng.uniform(0.3, 2):.4f} shape={card(kind)} x={rng.uniform(-0.1, 0.1):.4f} y={0.5 + 0.3 * k} "
                f"z={0.36 * side} rot=({turn}) {speed} omega=({spin})"
            )
        if rng.random() < 0.3:
            self.cards.append("ROPE line b0 b1 length=0.9 e=0.1")
        self.cards.append(f"CONTACT c all e={rng.choice((0, 0.2, 0.5))} mu={rng.choice((0, 0.2, 0.5, 0.8))}")

    def deck(self, until: float, reltol: float, turned: bool = False) -> str:
        cards = [*self.fixed, *self.cards]
        cards = cards[::-1] if turned else cards
        shown = " ".join(
            f"{word}(b{k})" for k in range(2) for word in ("x", "y", "z", "e0", "e1", "e2", "e3")
        )
        return "\n".join(
            ["t", ".gravity 9.81", *cards, f".options reltol={reltol}", f".tran 10m {until}", f".save energy() gap(c) {shown}"]
        )  # fmt: skip


def reach(kind: str, way: np.ndarray) -> float:
    """How far a shape about its body's origin goes that way, in its own axes."""
    if kind == "ellipsoid":
        return float(np.linalg.norm(SIZES[kind] * way))
    if kind == "cylinder":
        r, h = SIZES[kind]
        return float(r * np.hypot(way[0], way[1]) + 0.5 * h * abs(way[2]))
    return float((corners(kind) @ way).max()) + radius(kind)


Placed = tuple[str, np.ndarray, np.ndarray]  # kind, rotation, place of the origin


def apart(one: Placed, other: Placed) -> float:
    """How far a plane can lie between two convex solids: the best of all its directions, from several starts."""

    def off(angles: np.ndarray) -> float:
        a, b = angles
        n = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
        (kind, turn, at), (second, back, to) = one, other
        return -float(n @ (at - to) - reach(kind, -(turn.T @ n)) - reach(second, back.T @ n))

    way = one[2] - other[2]
    starts = [way, *np.eye(3), *-np.eye(3)]
    best = -np.inf
    for way in starts:
        start = [np.arctan2(way[1], way[0]), np.arctan2(way[2], np.hypot(way[0], way[1]))]
        best = max(
            best, -minimize(off, start, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}).fun
        )
        if best > -1e-5:
            break
    return best


@pytest.mark.parametrize("seed", daily(range(24), 3))
def test_a_scene_in_space_loses_energy_and_nothing_passes(seed):
    s = Scene(seed)
    r = emsim.run(s.deck(0.6, 1e-5))
    energy = np.asarray(r["energy()"])
    size = max(1.0, float(np.ptp(energy)))
    assert np.diff(energy).max() < 1e-4 * size and abs(r.energy.residual) < 1e-3 * size, s.deck(0.6, 1e-5)
    assert min(line.dissipated for line in r.energy.lines) > -1e-5 * size
    assert not [d.message for d in r.diagnostics if d.code in ("W404", "W406")]
    assert r.time[-1] == 0.6 and r.stats["events"] < 3000
    still = (np.eye(3), np.array([0.0, 0.15, 0.0]))
    for k in np.linspace(0, len(r.time) - 1, 25).astype(int):
        where = {"block": (s.kinds["block"], *still)}
        for name in ("b0", "b1"):
            e = [r[f"e{j}({name})"][k] for j in range(4)]
            turn = Rotation.from_quat([*e[1:], e[0]]).as_matrix()
            where[name] = (s.kinds[name], turn, np.array([r[f"{axis}({name})"][k] for axis in "xyz"]))
            down = -(turn.T @ [0.0, 1.0, 0.0])
            assert where[name][2][1] - reach(s.kinds[name], down) > -1e-5
        for one, other in combinations(where, 2):
            assert apart(where[one], where[other]) > -1e-5, f"{one} in {other}\n{s.deck(0.6, 1e-5)}"


@pytest.mark.parametrize("seed", daily(range(8), 4))
def test_another_order_of_cards_is_the_same_scene_in_space(seed):
    """Until motions part that began 1e-12 from each other: over the first impacts."""
    s = Scene(seed)
    one, other = (emsim.run(s.deck(0.25, 1e-8, turned)) for turned in (False, True))
    for column in ("x(b0)", "y(b0)", "z(b0)", "e1(b0)", "x(b1)", "y(b1)", "z(b1)", "e1(b1)"):
        assert one.at(column, 0.25) == pytest.approx(other.at(column, 0.25), abs=1e-5), s.deck(0.25, 1e-8)


def test_the_scenes_in_space_hold_all_of_it():
    scenes = [Scene(seed) for seed in range(24)]
    words = [line.split()[0] for s in scenes for line in s.cards]
    assert all(words.count(word) >= 3 for word in ("JOINT", "FRICTION", "STOP", "ROPE"))
    kinds = [kind for s in scenes for kind in s.kinds.values()]
    assert all(kinds.count(kind) >= 2 for kind in KINDS)
