"""`emsim import`: what a URDF or MJCF file describes moves as an own integration of it does, and as MuJoCo's."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from arms import Arm, Part, about
from support import deck, run

import emsim
from emsim import robots
from emsim.diagnostics import Sink

NETLISTS = Path(__file__).resolve().parents[2] / "netlists"
X, Y, Z = np.eye(3)

# ---- the Puma 560 -------------------------------------------------------------------------------------
# Denavit-Hartenberg rows (a, d, alpha), masses, centres and inertias in the frames of their rows, rotors and gears: P. I. Corke,
# B. Armstrong-Helouvry, IEEE ICRA 1994, as mdl_puma560 of the Robotics Toolbox has them
ROWS = [(0, 0, 90), (0.4318, 0, 0), (0.0203, 0.15005, -90), (0, 0.4318, 90), (0, 0, -90), (0, 0, 0)]
MASSES = [0, 17.4, 4.8, 0.82, 0.34, 0.09]
CENTRES = [
    (0, 0, 0),
    (-0.3638, 0.006, 0.2275),
    (-0.0203, -0.0141, 0.070),
    (0, 0.019, 0),
    (0, 0, 0),
    (0, 0, 0.032),
]
INERTIAS = [
    (0, 0.35, 0), (0.13, 0.524, 0.539), (0.066, 0.086, 0.0125), (1.8e-3, 1.3e-3, 1.8e-3), (0.3e-3, 0.4e-3, 0.3e-3),
    (0.15e-3, 0.15e-3, 0.04e-3),
]  # fmt: skip
GEARS = np.array([62.6111, 107.815, 53.7063, 76.0364, 71.923, 76.686])
ROTORS = np.array([200e-6] * 3 + [33e-6] * 3)
VISCOUS = np.array([1.48e-3, 0.817e-3, 1.38e-3, 71.2e-6, 82.6e-6, 36.7e-6])
# what the toolbox prints for gravload and inertia at q = 1 2 3 4 5 6 rad, G^2 Jm on the diagonal of the latter
POSE = np.arange(1.0, 7.0)
LOAD = [0.0, -7.9683, 8.4581, -0.0197, 0.0027, 0.0]
MATRIX = [
    [2.6152, -0.6550, -0.0363, 0.0001, 0.0010, 0.0],
    [-0.6550, 4.3038, 0.2953, -0.0008, -0.0017, 0.0],
    [-0.0363, 0.2953, 0.9366, -0.0009, -0.0006, 0.0],
    [0.0001, -0.0008, -0.0009, 0.1926, 0.0, 0.0],
    [0.0010, -0.0017, -0.0006, 0.0, 0.1713, 0.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.1941],
]
JOINTS = ["waist", "shoulder", "elbow", "wrist_roll", "wrist_pitch", "flange_roll"]


def puma(rotors: bool) -> Arm:
    """From the table: a link's frame is that of the row before, turned by its joint."""
    parts, before = [], (np.eye(3), np.zeros(3))
    for k, (a, d, alpha) in enumerate(ROWS):
        row = about(X, np.radians(alpha))
        at = np.array([a, 0, d])
        tensor = row @ np.diag(INERTIAS[k]) @ row.T
        rotor = (ROTORS[k], GEARS[k]) if rotors else (0.0, 1.0)
        parts.append(Part(k - 1, *before, Z, MASSES[k], at + row @ np.array(CENTRES[k]), tensor, rotor=rotor))
        before = (row, at)
    return Arm(parts)


@cache
def imported(path: Path, **options) -> str:
    return robots.imported(str(path), robots.Options(**options), Sink())


def started(text: str, joints, q, u=None) -> str:
    """The deck with joints that start at q, with speeds u, and have no ends."""
    lines = []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["JOINT"] and words[1] in joints:
            k = joints.index(words[1])
            line += f" ic=({q[k]!r},{0.0 if u is None else u[k]!r})"
        lines += [line] if words[:1] != ["STOP"] else []
    return "\n".join(lines) + "\n"


def matrix_and_load(text: str):
    """M and dV/dq of a chain of pins and slides where it starts."""
    s = emsim.compile(text)
    c, f = s.C(s.x0, 0.0), np.asarray(s.F(s.x0, 0.0))
    return np.asarray(c.toarray() if hasattr(c, "toarray") else c)[1::2, 1::2], f[1::2]


def test_the_arm_of_a_urdf_is_the_published_one():
    text = started(imported(NETLISTS / "coupled" / "puma560.urdf"), JOINTS, POSE.tolist())
    matrix, load = matrix_and_load(text)
    assert load == pytest.approx(np.array(LOAD), abs=6e-5)  # a digit of theirs
    assert matrix + np.diag(GEARS**2 * ROTORS) == pytest.approx(np.array(MATRIX), abs=6e-5)
    own = puma(rotors=False)
    assert load == pytest.approx(own.gravity_load(POSE), abs=1e-12)
    assert matrix == pytest.approx(own.mass_matrix(POSE), abs=1e-12)


def test_the_deck_has_the_cards_of_the_import():
    wanted = [" ".join(line.split()) for line in imported(NETLISTS / "coupled" / "puma560.urdf").splitlines()]
    wanted = [line for line in wanted if line.split(" ")[0] in ("BODY", "JOINT", "STOP")]
    there = [" ".join(line.split()) for line in deck("coupled/puma560").splitlines()]
    assert len(wanted) == 18 and [line for line in there if line in wanted] == wanted


def test_the_arm_moved_by_its_motors():
    """Every motor's rotor turns on the link below it, and its voltage follows the error of the joint."""
    kt, r = np.array([0.2] * 3 + [0.07] * 3), np.array([2.0] * 3 + [7.0] * 3)
    gain, way = np.array([400, 600, 400, 200, 200, 200.0]), np.array([0.8, 0.6, -0.9, 0.5, 0.7, -1.0])

    def tau(t, q, u):
        wanted = way * 0.5 * (1 - np.cos(np.pi * min(t, 1.5) / 1.5))
        w = GEARS * u
        return GEARS * (kt * (gain * (wanted - q) - kt * w) / r - VISCOUS * w)

    times = np.linspace(0, 0.9, 4)
    own = puma(rotors=True).run(np.zeros(6), np.zeros(6), tau, times, rtol=1e-9)
    got = run(deck("coupled/puma560"), "reltol=1e-8", tran="0.3 0.9")
    for k, joint in enumerate(JOINTS):
        for n in range(1, 4):
            assert float(got.at(f"angle({joint})", times[n])) == pytest.approx(own[k, n], abs=1e-7)
            assert float(got.at(f"omega({joint})", times[n])) == pytest.approx(own[6 + k, n], abs=1e-6)


# ---- random trees -------------------------------------------------------------------------------------


def random_tree(seed: int) -> tuple[str, Arm, list[str]]:
    """A tree of seven links, one of them fixed, as URDF and as an Arm of the six joints that move."""
    rng = np.random.default_rng(seed)
    out, parts, joints, at = (
        ['<robot name="tree">', '<link name="l0"/>'],
        [],
        [],
        {0: (-1, np.eye(3), np.zeros(3))},
    )
    fixed = 3
    for k in range(1, 8):
        parent = int(rng.integers(0, k))
        p, rpy, com, turn = (rng.uniform(-0.5, 0.5, 3) for _ in range(4))
        axis = rng.normal(size=3)
        # a body of four masses: an inertia that there can be
        spread = rng.normal(size=(4, 3)) * 0.1
        j = sum(0.5 * (v @ v * np.eye(3) - np.outer(v, v)) for v in spread)
        m = 2.0
        slides = k == 5
        kind = "fixed" if k == fixed else "prismatic" if slides else "continuous"
        tensor = (
            " ".join(
                f'i{a}{b}="{j["xyz".index(a), "xyz".index(b)]!r}"'
                for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")
            )
            .replace("np.float64(", "")
            .replace(")", "")
        )
        words = [" ".join(repr(float(v)) for v in w) for w in (com, turn, p, rpy, axis)]
        out += [
            f'<link name="l{k}"><inertial><origin xyz="{words[0]}" rpy="{words[1]}"/><mass value="{m}"/><inertia {tensor}/>',
            "</inertial></link>",
            f'<joint name="j{k}" type="{kind}"><parent link="l{parent}"/><child link="l{k}"/>',
            f'<origin xyz="{words[2]}" rpy="{words[3]}"/><axis xyz="{words[4]}"/>',
            '<limit lower="-9" upper="9" effort="0" velocity="0"/>' if slides else "",
            '<dynamics damping="0.2"/></joint>' if kind != "fixed" else "</joint>",
        ]
        rot, inner = (about(Z, w[2]) @ about(Y, w[1]) @ about(X, w[0]) for w in (rpy, turn))
        carrier, r0, p0 = at[parent]
        r0, p0 = r0 @ rot, p0 + r0 @ p
        if kind == "fixed":
            at[k] = (carrier, r0, p0)
            if carrier >= 0:
                old = parts[carrier]
                c = p0 + r0 @ com
                total = old.m + m
                centre = (old.m * old.c + m * c) / total
                moved = [
                    (old.m, old.c, old.j),
                    (m, c, r0 @ inner @ j @ inner.T @ r0.T),
                ]
                old.j = sum(t + n * ((d := x - centre) @ d * np.eye(3) - np.outer(d, d)) for n, x, t in moved)
                old.m, old.c = total, centre
            continue
        at[k] = (len(parts), np.eye(3), np.zeros(3))
        parts.append(Part(carrier, r0, p0, axis / np.linalg.norm(axis), m, com, inner @ j @ inner.T, slides))
        joints.append(f"j{k}")
    return "\n".join([*out, "</robot>"]), Arm(parts), joints


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_trees(seed, tmp_path):
    text, arm, joints = random_tree(seed)
    path = tmp_path / "tree.urdf"
    path.write_text(text)
    rng = np.random.default_rng(100 + seed)
    q, u = rng.uniform(-1, 1, 6), rng.uniform(-1, 1, 6)
    own = arm.run(q, u, lambda t, q, u: -0.2 * u, np.array([0.0, 0.4]))
    got = run(started(imported(path), joints, q.tolist(), u.tolist()), "reltol=1e-10", tran="0.1 0.4")
    for k, joint in enumerate(joints):
        place, speed = ("pos", "vel") if arm.parts[k].slides else ("angle", "omega")
        assert float(got[f"{place}({joint})"][-1]) == pytest.approx(own[k, 1], abs=1e-8)
        assert float(got[f"{speed}({joint})"][-1]) == pytest.approx(own[6 + k, 1], abs=1e-7)
