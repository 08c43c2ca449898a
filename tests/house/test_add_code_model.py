"""An analogue code model is one file in elements/xspice/ and its name in the list there: a rectifier, in a copy of the tree."""

from __future__ import annotations

import os
import subprocess
import sys
from math import pi, sin, sqrt

import pytest
from support import copied_tree

FILE = '''"""rectify: the magnitude of its input, rounded at zero."""

from __future__ import annotations

from .base import CodeModel, Seat, Word, driving, reading


class Rectify(CodeModel):
    name = "rectify"
    what = "rounded rectifier"
    law = "out = sqrt(in^2 + width^2)"
    ports = (reading("in"), driving("out"))
    parameters = {"width": Word("output at zero", "V", 0.1, least=1e-9)}

    def build(self, seat: Seat) -> None:
        x, width = seat.read("in"), seat["width"]
        seat.drive("out", seat.ctx.b.call("sqrt", x * x + width * width))


MODEL = Rectify
'''
DECK = """a rounded rectifier between two nodes
V1 a 0 SIN(0 1 1k)
V2 b 0 0.5
A1 %vd(a b) out r
R1 out 0 1k
.model r rectify(width=0.2)
.tran 10u 2m
.end
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    folder = to / "emsim" / "elements" / "xspice"
    (folder / "rectify_.py").write_text(FILE, encoding="utf-8")
    listed = folder / "__init__.py"
    text = listed.read_text(encoding="utf-8")
    assert text.count('"gain", ') == 1
    listed.write_text(text.replace('"gain", ', '"gain", "rectify", '), encoding="utf-8")
    (to / "deck.cir").write_text(DECK, encoding="utf-8")
    return to


def python(copy, *args):
    env = {**os.environ, "PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(copy / "cache")}
    done = subprocess.run(
        [sys.executable, *map(str, args)], cwd=copy, env=env, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_it_runs_and_its_values_are_right(copy):
    code = (
        "import emsim; r = emsim.run('deck.cir'); print(emsim.__file__)\n"
        "for t in (0.1e-3, 0.7e-3, 1.3e-3): print(t, float(r.at('v(out)', t)))"
    )
    where, *rows = python(copy, "-c", code).splitlines()
    assert where.startswith(str(copy))
    for t, out in (map(float, row.split()) for row in rows):
        assert out == pytest.approx(sqrt((sin(2 * pi * 1e3 * t) - 0.5) ** 2 + 0.04), abs=2e-3)


def test_its_words_are_known(copy):
    told = python(copy, "-m", "emsim", "help", "rectify")
    assert "rounded rectifier" in told and "Aname in out model" in told and "output at zero" in told
    assert "rectify" in python(copy, "-m", "emsim", "help", "code_models")
