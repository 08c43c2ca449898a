"""A function of expressions is one line in functions.py: sech(x) = 1/cosh(x), added to a copy of the tree.

It is known to .param, B sources (there with its derivative), .print, .meas, .control, Result[..], transfer functions of s, the
page, help, completion and the colours of editors, and none of them names it.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from math import cos, cosh, pi

import pytest
from support import copied_tree

LINE = """    Function("sech", "x", "hyperbolic secant", lambda x: 1.0 / math.cosh(x), graph=lambda c, x: 1.0 / c.call("cosh", x),
             column=lambda np, x: 1.0 / np.cosh(x), complex=lambda cmath, z: 1.0 / cmath.cosh(z), js="(x) => 1 / Math.cosh(x)",
             even=True, positive=True),
"""
DECK = """a secant everywhere
.param k={sech(0.5)}
V1 a 0 DC 0 PWL(0 0 1 2) ac 1
B1 b 0 v={sech(v(a))}
R1 b 0 {1k*k}
.tran 10m 1
.print tran {sech(v(a))}
.meas tran last find {sech(v(a))} at=1
.meas tran derived param={sech(last)}
.control
run
print sech(v(a))[length(v(a))-1]
.endc
.end
"""
LAPLACE = "t\nV1 a 0 ac 1\nE1 b 0 LAPLACE {v(a)} = {sech(s*1m)}\nR1 b 0 1\n.ac lin 1 100 100\n.end\n"
# in the copy: every place that knows functions
ASKED = f"""
import json
import emsim
from emsim.editor import meanings, textmate, words
from emsim.outputs import html

r, ac = emsim.run("sech.cir"), emsim.run({LAPLACE!r})
print(json.dumps({{
    "source": float(r["v(b)"][-1]), "current": float(r["i(b1)"][-1]), "printed": float(r.main["sech(v(a))"][-1]),
    "asked": float(r["2*sech(v(a)/2)"][-1]), "measures": r.measures, "response": abs(complex(ac["v(b)"][0])),
    "help": meanings.lines("sech"), "completed": words.FUNCTIONS["sech"],
    "coloured": "|sech|" in json.dumps(textmate.grammar()),
    "script": html._file("data.js") + html._file(html.FUNCTIONS),
}}))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the copy's command line prints, and what it answers."""
    to = tmp_path_factory.mktemp("sech")
    table = copied_tree(to) / "emsim" / "functions.py"
    text, before = table.read_text(encoding="utf-8"), '    _elementary("asinh",'
    assert text.count(before) == 1
    table.write_text(text.replace(before, LINE + before), encoding="utf-8")
    (to / "sech.cir").write_text(DECK, encoding="utf-8")
    env = {**os.environ, "PYTHONPATH": str(to), "XDG_CACHE_HOME": str(to / "cache")}

    def said(*args: str) -> str:
        done = subprocess.run(
            [sys.executable, *args], cwd=to, env=env, capture_output=True, text=True, timeout=100
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return {**json.loads(said("-c", ASKED)), "stdout": said("-m", "emsim", "sech.cir")}


def sech(x: float) -> float:
    return 1.0 / cosh(x)


def test_decks_know_it(told):
    assert told["source"] == pytest.approx(sech(2.0), rel=1e-3)
    assert told["current"] == pytest.approx(-sech(2.0) / (1e3 * sech(0.5)), rel=1e-3)  # by .param k
    assert told["printed"] == pytest.approx(sech(2.0), rel=1e-6)
    assert told["measures"]["last"] == pytest.approx(sech(2.0), rel=1e-4)
    assert told["measures"]["derived"] == pytest.approx(sech(told["measures"]["last"]), rel=1e-9)
    row = next(line for line in told["stdout"].splitlines() if line.startswith("sech"))
    assert float(row.rpartition("=")[2]) == pytest.approx(sech(2.0), rel=1e-4)  # .control


def test_results_know_it(told):
    assert told["asked"] == pytest.approx(2 * sech(1.0), rel=1e-6)


def test_transfer_functions_know_it(told):
    # sech(j w) = 1/cos(w)
    assert told["response"] == pytest.approx(1 / cos(2 * pi * 100 * 1e-3), rel=1e-6)


def test_help_completion_and_colours_know_it(told):
    assert "hyperbolic secant" in " ".join(told["help"])
    assert told["completed"] == ["sech(x)", "hyperbolic secant"] and told["coloured"]


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_page_knows_it(told):
    asked = "\nconsole.log(compileExpression('1 + sech(v(a))', (name) => name === 'v(a)' ? [2] : null)(0));"
    node = subprocess.run(["node", "-e", told["script"] + asked], capture_output=True, text=True, timeout=60)
    assert node.returncode == 0, node.stderr
    assert float(node.stdout) == pytest.approx(1 + sech(2.0), rel=1e-12)
