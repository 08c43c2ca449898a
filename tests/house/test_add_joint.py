"""A kind of joint is one new file and one line: a screw, added to a copy of the tree, moves as the book says.

A nut on a spindle advances r = lead/2 pi a radian: its momentum is (J + m r^2) omega, so under gravity along the axis
omega' = m g r/(J + m r^2).
"""

from __future__ import annotations

import os
import subprocess
import sys
from math import pi
from pathlib import Path

import pytest
from support import copied_tree

SCREW = '''"""screw: B turns about an axis and advances along it, lead a turn."""

from __future__ import annotations

from math import pi

from ..base import Default
from .base import Coord, JointKind
from .rows import across, axis_kept, shifted, turned


class Screw(JointKind):
    name = "screw"
    meaning = "turn about its axis and advance along it, lead a turn"
    axis_default = (0.0, 0.0, 1.0)
    params = {"lead": Default(1e-3, "m", "advance of a screw in one turn")}
    coordinates = (Coord("angle", "rad", "axis"),)
    speeds = (Coord("omega", "rad/s"),)

    @property
    def pitch(self):
        return self.lead / (2.0 * pi)

    def move(self, moving, q, u, sign):
        turn, speed = sign * (q[0] + self.zeros[0]), sign * u[0]
        moving.turn(self.axis, turn, speed)
        moving.slide(self.axis, self.pitch * turn, self.pitch * speed)
        return []

    def closure(self, b, fa, fb, d):
        advance = shifted(fa, d, self.axis) - self.pitch * turned(b, fa, fb, self.axis, 0.0)
        return [*across(fa, d, self.axis), *axis_kept(fa, fb, self.axis), ("advance", advance, "N")]

    def measure(self, b, fa, fb, d, near):
        return [turned(b, fa, fb, self.axis, near[0])]
'''
BODY = "nut on a spindle\nBODY nut m=0.2 j=(1m,1m,2e-5)\n"
END = ".gravity 0 0 -9.81\n.options reltol=1e-9\n.tran 1m 1\n.save all z(nut)\n.end\n"
FALLS = BODY + "JOINT s 0 nut screw lead=20m ic=(0,3)\n" + END
# the same joint as the one that is cut: a cylinder in the tree, the screw takes one of its two freedoms
CUT = BODY + "JOINT c 0 nut cylinder ic=(0,0)\nJOINT s 0 nut screw lead=20m cut=yes\n" + END


@pytest.fixture
def copy(tmp_path):
    copied_tree(tmp_path)
    listed = tmp_path / "emsim/cards/joints/__init__.py"
    # without the one that is there
    text = (
        listed.read_text(encoding="utf-8")
        .replace("from .screw import Screw\n", "")
        .replace("        Screw,\n", "")
    )
    (tmp_path / "emsim/cards/joints/screw.py").write_text(SCREW, encoding="utf-8")
    kinds = text.replace("from .slide import Slide\n", "from .screw import Screw\nfrom .slide import Slide\n")
    kinds = kinds.replace("        Cylinder,\n", "        Cylinder, Screw,\n")
    assert len(kinds.splitlines()) == len(text.splitlines()) + 1  # its import; in the list it shares a line
    listed.write_text(kinds, encoding="utf-8")
    return tmp_path


def run(copy: Path, deck: str, *columns: str) -> list[list[float]]:
    code = "import emsim, json, sys; r = emsim.run(sys.argv[1]); print(json.dumps([list(r[c]) for c in sys.argv[2:]]))"
    (copy / "deck.cir").write_text(deck, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", code, "deck.cir", *columns],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    found: list[list[float]] = __import__("json").loads(done.stdout)
    return found


@pytest.mark.parametrize(("deck", "speed"), [(FALLS, 3.0), (CUT, 0.0)], ids=["in the tree", "cut"])
def test_a_new_kind_of_joint_is_one_file_and_one_line(copy, deck, speed):
    m, j, r = 0.2, 2e-5, 20e-3 / (2 * pi)
    t, z, angle, omega = run(copy, deck, "time", "z(nut)", "angle(s)", "omega(s)")
    gain = -m * 9.81 * r / (j + m * r * r)
    turned = speed * t[-1] + 0.5 * gain * t[-1] ** 2
    assert omega[-1] == pytest.approx(speed + gain * t[-1], rel=1e-8)
    assert angle[-1] == pytest.approx(turned, rel=1e-8)  # many turns, also where it is measured
    assert z[-1] == pytest.approx(r * turned, rel=1e-8)


def test_a_new_kind_is_known_to_the_reference_and_the_messages(copy):
    code = "from emsim.cards import CARDS; from emsim.cards.joints import KINDS; print(*KINDS, *CARDS['JOINT'].spec.params)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy)},
        capture_output=True,
        text=True,
    )
    assert "screw" in done.stdout and "lead" in done.stdout
