"""Modes move the drawing of their machine: by the shapes that .modes tells, with positions that hold."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

from emsim import pipeline
from emsim.outputs import html

ROOT = Path(__file__).resolve().parents[3] / "netlists"


@pytest.fixture(scope="module")
def chain():
    return pipeline.run(str(ROOT / "mechanical/torsion_chain.cir"), scene=True)


def test_discs_swing_as_the_modes_say(chain):
    """Angles of the eight discs at the mode's number are its amplitudes, the largest turned by 0.35 rad; half a swing later the
    other way round. Shapes: sin((2 m - 1) pi k/17), m the mode, k the disc (a chain held at one end)."""
    scene = chain.main.scene
    axis = np.array(scene.axis)
    assert list(axis[::48]) == [k + 0.5 for k in range(8)]
    names = [c["name"] for c in scene.data["channels"]]
    angles = np.array([np.frombuffer(scene.waves.column(names.index(f"angle(d{k})"))) for k in range(1, 9)])
    for mode in range(1, 9):
        now = angles[:, int(np.flatnonzero(axis == mode)[0])]
        wanted = np.array([np.sin((2 * mode - 1) * np.pi * k / 17) for k in range(1, 9)])
        now, wanted = now / now[np.argmax(abs(now))], wanted / wanted[np.argmax(abs(wanted))]
        assert now == pytest.approx(wanted, abs=1e-6) or -now == pytest.approx(wanted, abs=1e-6)
    own = angles[:, :24]
    assert own[:, 0] == pytest.approx(-own[:, 12], abs=1e-9) and abs(own).max() == pytest.approx(
        0.35, abs=0.01
    )


def test_what_turns_in_space_keeps_its_shape():
    """Nine numbers of each body stay a rotation, however far it swings: a slope would not."""
    scene = pipeline.run(
        "t\n.gravity 0 0 -9.81\nBODY a m=1 com=(0,0,-0.3) j=(20m,20m,1m)\n"
        "JOINT u 0 a universal axis=(1,0,0) axis2=(0,1,0)\n.modes\n.end\n",
        scene=True,
    ).main.scene
    names = [c["name"] for c in scene.data["channels"]]
    refs = scene.data["bodies"][1]["at"][3:]
    rows = np.array(
        [
            np.frombuffer(scene.waves.column(int(r[1:])))
            if isinstance(r, str)
            else np.full(len(scene.axis), r)
            for r in refs
        ]
    )
    turns = rows.T.reshape(-1, 3, 3)
    assert np.abs(turns @ turns.transpose(0, 2, 1) - np.eye(3)).max() < 1e-9
    assert np.abs(turns - turns[0]).max() > 0.01 and names


def test_a_page_has_the_machine_of_its_modes(chain, tmp_path):
    page = tmp_path / "modes.html"
    html.write(str(page), chain)
    run = html.document(chain)
    assert run["scene"]["rows"] == 8 * 48 and run["rows"] == 8
    again = pickle.loads(pickle.dumps(chain.main.scene))
    assert list(again.axis) == list(chain.main.scene.axis)


def test_without_a_drawing_nothing_swings():
    assert pipeline.run(str(ROOT / "mechanical/torsion_chain.cir")).main.scene is None
