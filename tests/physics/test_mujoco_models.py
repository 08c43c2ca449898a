"""MJCF models imported: where they are after a while, against MuJoCo 4.0.0 by its RK4 with steps of 1e-4 s (those with 2e-4 s
differ by less than 4e-11), contacts off; what a mesh weighs, against its compiler."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support import run

from emsim import robots
from emsim.diagnostics import Sink

MODELS = Path(__file__).resolve().parent / "mjcf"


def imported(path: Path, key: str | None = None) -> str:
    return robots.imported(str(path), robots.Options(key=key), Sink())


# coordinate and speed of joints at the end: mj_step, qpos and qvel
ENDS = {
    ("double_pendulum", "up", 2.0): {
        "angle(shoulder)": 1.4984236689, "omega(shoulder)": -1.3225966872, "angle(elbow)": -1.1677816852,
        "omega(elbow)": -1.7663146011,
    },
    ("cart_pole", "a", 2.0): {
        "pos(slider)": 11.745467897, "vel(slider)": 10.249796455, "angle(hinge)": 0.088366342465, "omega(hinge)": 0.10737283249,
    },
    ("chain_and_free", "k", 0.5): {
        "pos(a1)": -0.48116139521, "vel(a1)": -2.1458356012, "angle(a2)": 0.21552609152, "omega(a2)": 0.92887425447,
        "angle(a3)": -1.500410361, "omega(a3)": -10.634038026, "pos(d1)": 0.069674104477, "vel(d1)": 1.7045525552,
        "angle(g1)": 0.82813658358, "omega(g1)": 1.0238155552, "vx(ff)": -1.2603479076, "vz(ff)": -2.7161239401,
        "x(c)": 0.35366284749, "y(c)": 0.035648576246, "z(c)": -0.083377572668,
        "x(d)": 0.52241579857, "y(d)": 0.35117238375, "z(d)": -0.018472277324,
        "x(g)": 0.46515075033, "y(g)": 2.1633250201, "z(g)": 2.7943515434,
    },
}  # fmt: skip


@pytest.mark.parametrize("model", ENDS, ids=lambda model: model[0])
def test_it_moves_as_mujoco_has_it(model):
    """Hinges, slides, ball and free joints, several on a body; frames in every notation; springs, damping, armature, tendons,
    actuators with gears and clamps; start at a keyframe."""
    name, key, end = model
    text = imported(MODELS / f"{name}.xml", key)
    saved = " ".join(what for what in ENDS[model] if what[1] == "(")
    got = run(text.replace(".end", f".save all {saved}\n.end"), "reltol=1e-10", tran=f"10m {end}")
    for what, value in ENDS[model].items():
        assert float(got[what][-1]) == pytest.approx(value, abs=1e-9), what


def test_energy_of_an_imported_model_is_accounted_for():
    got = run(imported(MODELS / "cart_pole.xml", "a"), "reltol=1e-8")
    assert abs(got.energy.residual) < 1e-7 * got.energy.turnover


def prism(path: Path) -> None:
    """An L, 50 mm thick, away from the origin, as a binary STL file."""
    corners = np.array([(0, 0), (0.3, 0), (0.3, 0.1), (0.1, 0.1), (0.1, 0.2), (0, 0.2)])
    low, high = (np.column_stack([corners, np.full(6, z)]) + np.array([0.2, -0.1, 0.4]) for z in (0.0, 0.05))
    facets = []
    for a, b, c in ((0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)):
        facets += [(low[a], low[c], low[b]), (high[a], high[b], high[c])]
    for k in range(6):
        n = (k + 1) % 6
        facets += [(low[k], low[n], high[n]), (low[k], high[n], high[k])]
    data = b"".join(
        np.concatenate([np.zeros(3), np.ravel(f)]).astype("<f4").tobytes() + b"\0\0" for f in facets
    )
    path.write_bytes(b"\0" * 80 + len(facets).to_bytes(4, "little") + data)


MESH = """<mujoco><asset><mesh name="m" file="ell.stl" scale="1 2 1" inertia="exact"/></asset><worldbody><body name="b">
<freejoint/><geom type="mesh" mesh="m" pos="0.1 0.2 0.3" euler="20 30 40" density="700"/></body></worldbody></mujoco>"""
# body_mass, body_ipos and the tensor of body_inertia in the body's frame
MASS, CENTRE = 2.799999082, [0.55594305, 0.28250247, 0.57213834]
TENSOR = [0.02569983, 0.03891847, 0.04038166, -0.00018684, 0.01603970, -0.00461616]


def test_a_mesh_weighs_what_mujoco_says(tmp_path):
    prism(tmp_path / "ell.stl")
    (tmp_path / "mesh.xml").write_text(MESH)
    card = next(line for line in imported(tmp_path / "mesh.xml").splitlines() if line.startswith("BODY"))
    words = dict(word.split("=") for word in card.split()[2:])
    assert float(words["m"]) == pytest.approx(MASS, rel=1e-8)
    assert [float(v) for v in words["com"].strip("()").split(",")] == pytest.approx(CENTRE, abs=1e-8)
    assert [float(v) for v in words["j"].strip("()").split(",")] == pytest.approx(TENSOR, abs=1e-8)
