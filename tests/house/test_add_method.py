"""An integrator is one file in engine/integrate/src/ and its line in REGISTRY: one of order 2 (method_example.rs), in a copy."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support import build_engine, copied_tree

LINE = """    (&["sdirk2"], ["2", "one step, L-stable", "an example"], |sys, o| Ok(Box::new(sdirk2::Sdirk2::new(sys, o)?))),
"""

pytestmark = [pytest.mark.builds, pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")]


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    integrate = to / "emsim" / "engine" / "integrate" / "src"
    shutil.copy(Path(__file__).parent / "method_example.rs", integrate / "sdirk2.rs")
    text = (integrate / "lib.rs").read_text(encoding="utf-8")
    for before, line in (
        ("mod rows;\n", "mod sdirk2;\n"),
        ("const REGISTRY: &[(&[&str], Told, Maker)] = &[\n", LINE),
    ):
        assert text.count(before) == 1
        text = text.replace(before, before + line)
    (integrate / "lib.rs").write_text(text, encoding="utf-8")
    build_engine(to)
    return to


RUN = """
import json, math
import emsim
deck = '''a tank behind a diode that is an expression
C1 a 0 1 ic=1
L1 a b 1 ic=0
R1 b 0 0.2
B1 a 0 I={0.1*v(a)^3}
.options method=%s fixed_step=%r
.tran 0.01 2 uic
.end
'''
ends = [float(emsim.run(deck % ("sdirk2", h))["v(a)"][-1]) for h in (0.04, 0.02, 0.01)]
exact = float(emsim.run(deck.replace("fixed_step=%r", "reltol=1e-11") % "radau")["v(a)"][-1])
print(json.dumps([ends, exact]))
"""


def test_its_order_is_the_slope_of_its_error(copy):
    env = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(
        [sys.executable, "-c", RUN], cwd=copy, env=env, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    ends, exact = json.loads(done.stdout)
    errors = [abs(end - exact) for end in ends]
    assert errors[0] < 1e-2
    for coarse, fine in itertools.pairwise(errors):
        assert 3.4 < coarse / fine < 4.6, errors


def test_help_and_the_command_line_know_it(copy):
    env = {**os.environ, "PYTHONPATH": str(copy)}
    (copy / "rc.cir").write_text("rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m uic\n.end\n")
    for args, said in ((["help", "sdirk2"], "L-stable"), (["rc.cir", "--method", "sdirk2"], "points")):
        done = subprocess.run(
            [sys.executable, "-m", "emsim", *args],
            cwd=copy,
            env=env,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0 and said in done.stdout + done.stderr, done.stderr
