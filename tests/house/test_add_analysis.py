"""An analysis is one file in analyses/ and its line in ANALYSES: the input impedance over frequency, in a copy of the tree.

    Z(w) = -V/I of a source that excites with 1 V: of a resistor and a coil in series R + j w L.

Its axis is a frequency and its columns are complex: command line, raw file, CSV, the page, .print know nothing of it.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from math import pi

import numpy as np
import pytest
from support import copied_tree

from emsim.outputs import load, raw

FILE = '''"""`.zin source n fstart fstop`: the impedance that a voltage source sees, over frequency."""

from __future__ import annotations

from math import pi

from ..assemble import Output
from .ac import grid, linearised
from .base import Analysis, Axis, Computed, Run


class Zin(Analysis):
    word = "zin"
    form = ".zin source points fstart fstop"
    meaning = "the impedance that a voltage source sees"
    plotname = "Input Impedance"
    axis = Axis("frequency", "Hz", log=True)
    complex = True

    def __init__(self, card, source, frequencies):
        self.card, self.source, self.frequencies = card, source, frequencies

    @classmethod
    def read(cls, card, sink):
        found = grid(cls, card, sink, ["dec", *card.args[1:]])
        return None if found is None else cls(card, card.args[0], found)

    def columns(self, ctx):
        return [Output("zin", "Ohm", ctx.b.x(ctx.branches[self.source]))]

    def run(self, assembly, progress=None):
        linear, trouble = linearised(assembly, self, False)
        (output,) = assembly.outputs[self]
        one = [(assembly.ctx.wave(assembly.ctx.elements[self.source]), (1.0, 0.0))]
        found = linear.respond([(0.0, 2 * pi * f) for f in self.frequencies], [output.expr], one)
        i = memoryview(found[0]).cast("d")
        z = [-1 / complex(*i[k : k + 2]) for k in range(0, len(i), 2)]
        column = [part for value in z for part in (value.real, value.imag)]
        waves = Computed([self.frequencies, column], [False, True])
        return Run(self, ["frequency", "zin"], ["Hz", "Ohm"], waves, self.axis, trouble=trouble)
'''
DECK = """a resistor and a coil
V1 a 0 dc 1
R1 a b 50
L1 b 0 {l}
.param l=10m
.zin v1 5 10 {1k*10}
.print zin zin
.end
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    analyses = to / "emsim" / "analyses"
    (analyses / "zin.py").write_text(FILE, encoding="utf-8")
    lists = analyses / "__init__.py"
    text = lists.read_text(encoding="utf-8")
    before = '    "tf": "tf Tf",\n'
    assert text.count(before) == 1
    lists.write_text(text.replace(before, before + '    "zin": "zin Zin",\n'), encoding="utf-8")
    (to / "deck.cir").write_text(DECK, encoding="utf-8")
    return to


def python(copy, *args: object, code: int = 0) -> str:
    env = {**os.environ, "PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(copy / "cache")}
    done = subprocess.run(
        [sys.executable, *map(str, args)], cwd=copy, env=env, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout


def answer(f: np.ndarray) -> np.ndarray:
    return 50 + 2j * pi * f * 10e-3


def test_command_line_print_raw_file_and_csv(copy):
    said = python(copy, "-m", "emsim", "deck.cir", "--csv", "x.csv", "--html", "x.html")
    assert python(copy, "-m", "emsim", "deck.cir", "-r", "x.raw") == ""
    assert "Input Impedance" in said
    table = raw.read(str(copy / "x.raw")).main  # by a reader that knows nothing of the analysis
    assert table.plotname == "Input Impedance" and table.is_complex("zin") and table.axis.log
    np.testing.assert_allclose(table["zin"], answer(table["frequency"]), rtol=1e-12)
    np.testing.assert_allclose(load(str(copy / "x.csv"))["zin"], table["zin"], rtol=1e-14)
    rows = [line.split() for line in said.splitlines() if line[:1].isdigit()]
    assert [float(r[2].rstrip(",")) for r in rows] == pytest.approx(list(table["zin"].real), rel=1e-5)
    assert [float(r[3]) for r in rows] == pytest.approx(list(table["zin"].imag), rel=1e-5)
    np.testing.assert_allclose(table["db(zin)"], 20 * np.log10(abs(answer(table["frequency"]))))


def test_page_and_picture(copy):
    python(copy, "-m", "emsim", "deck.cir", "--no-files", "--html", "x.html")
    run = json.loads(
        re.search(r'<script id="run"[^>]*>(.*?)</script>', (copy / "x.html").read_text(), re.S)[1]
    )
    assert run["axisName"] == "frequency" and run["axisLog"]
    assert run["complex"][run["names"].index("zin")]
    drawn = python(copy, "-m", "emsim", "deck.cir", "--no-files", "--plot", "zin")
    assert "db(zin)" in drawn and "ph(zin)" in drawn and "frequency [" in drawn


def test_check_and_the_list_of_what_there_is(copy):
    assert ".zin v1" in python(copy, "-m", "emsim", "check", "deck.cir")
    (copy / "other.cir").write_text(DECK.replace(".zin v1 5 10 {1k*10}", ".hb 1k"))
    done = python(copy, "-m", "emsim", "--json", "other.cir", code=1)
    assert ".zin" in json.loads(done)["diagnostics"][0]["hint"]
