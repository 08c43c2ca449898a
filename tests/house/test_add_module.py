"""A semiconductor is one file in emsim/devices/: a Verilog-A text that is put beside the others is a device, with its checks and
operating-point values, and nothing else is edited. `.hdl` does the same with a file of the user's."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from support import copied_tree

import emsim

TUNNEL = """
`include "disciplines.vams"
// Tunnel diode: a peak of current at vp, then what a junction carries.
module tunnel(a, c);
    inout a, c;
    electrical a, c;
    (* desc="peak current", units="A" *) parameter real ip = 1m from (0:inf);
    (* desc="voltage of the peak", units="V" *) parameter real vp = 0.1 from (0:inf);
    (* desc="saturation current", units="A" *) parameter real is = 1e-12 from [0:inf);
    (* desc="capacitance", units="F" *) parameter real cj = 1p from [0:inf);
    (* desc="conductance", units="S" *) real g;
    real v, i;
    analog begin
        v = V(a, c);
        i = ip * v / vp * exp(1.0 - v / vp) + is * (limexp(v / $vt) - 1.0);
        g = ddx(i, V(a));
        I(a, c) <+ i;
        I(a, c) <+ ddt(cj * v);
    end
endmodule
"""
DECK = """tunnel diode
V1 in 0 0.2
R1 in a 1
N1 a 0 t
.model t tunnel(ip=2m vp=0.08)
.save v(a) @n1[g] i(v1)
.op
.end
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    (to / "emsim" / "devices" / "tunnel.va").write_text(TUNNEL, encoding="utf-8")
    engine = next((emsim_folder()).glob("_engine*.so"))
    (to / "emsim" / engine.name).write_bytes(engine.read_bytes())
    return to


def emsim_folder():
    from pathlib import Path

    return Path(emsim.__file__).parent


def run(copy, folder, *words: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    return subprocess.run(
        [sys.executable, "-m", "emsim", *words], cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )  # fmt: skip


def test_a_text_beside_the_others_is_a_device(copy, tmp_path):
    (tmp_path / "deck.cir").write_text(DECK.replace(".op", ".print op v(a) @n1[g]\n.op"), encoding="utf-8")
    done = run(copy, tmp_path, "deck.cir")
    assert done.returncode == 0, done.stderr
    assert "@n1[g]" in done.stdout and " S" in done.stdout


def test_its_parameters_are_checked_by_its_own_description(copy, tmp_path):
    (tmp_path / "deck.cir").write_text(DECK.replace("vp=0.08", "vpp=0.08"), encoding="utf-8")
    done = run(copy, tmp_path, "deck.cir")
    assert done.returncode == 0 and "W284" in done.stderr and "did you mean vp=?" in done.stderr
    (tmp_path / "deck.cir").write_text(DECK.replace("vp=0.08", "vp=-1"), encoding="utf-8")
    done = run(copy, tmp_path, "deck.cir")
    assert done.returncode == 1 and "E299" in done.stderr and "vp" in done.stderr


def test_hdl_names_a_file_of_the_users(tmp_path):
    (tmp_path / "mine.va").write_text(TUNNEL, encoding="utf-8")
    deck = DECK.replace("V1 in", f'.hdl "{tmp_path / "mine.va"}"\nV1 in')
    table = emsim.run(deck).table("op")
    v, vt = table["v(a)"][0], 1.380649e-23 * 300.15 / 1.602176634e-19
    current = 2e-3 * v / 0.08 * 2.718281828459045 ** (1 - v / 0.08) + 1e-12 * (
        2.718281828459045 ** (v / vt) - 1
    )
    assert -table["i(v1)"][0] == pytest.approx(current, rel=1e-6)
    assert current == pytest.approx((0.2 - v) / 1.0, rel=1e-9)
