"""A device of the engine is one file in engine/dae/src/devices/ and its line in REGISTRY: a JFET (device_example.rs) in a copy.

It has three terminals, two inner nodes behind rd and rs, junctions whose steps are limited, and charges. Nothing else is
edited: matrix places, exact derivatives, four at a time, explicit methods, energy and the Python face follow from its law.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from support import build_engine, copied_tree

LINE = "    &Of::<jfet::Jfet, 2, 3, { jfet::CONSTANTS }>::NEW,\n"

pytestmark = [pytest.mark.builds, pytest.mark.skipif(shutil.which("cargo") is None, reason="needs cargo")]


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    devices = to / "emsim" / "engine" / "dae" / "src" / "devices"
    shutil.copy(Path(__file__).parent / "device_example.rs", devices / "jfet.rs")
    text = (devices / "mod.rs").read_text(encoding="utf-8")
    for before, line in (("pub mod diode;\n", "pub mod jfet;\n"), ("    // one line each\n", LINE)):
        assert text.count(before) == 1
        text = text.replace(before, before + line)
    (devices / "mod.rs").write_text(text, encoding="utf-8")
    build_engine(to)
    return to


SETUP = """
import json, math, struct
from emsim._engine import Builder, device_parameters, devices

VT = 1.38064852e-23 / 1.6021766208e-19 * 300.15
MODEL = dict(vto=-2.0, beta=1e-3, lam=0.01, rd=20.0, rs=10.0, cgs=5e-12, cgd=2e-12, pb=0.8)

class Circuit:
    "A common-source stage: 10 V, rd of 1 kohm, the gate behind 10 kohm."
    def __init__(self, gate, as_device=True, model=MODEL, count=1):
        b = self.b = Builder()
        self.supply, self.d, self.g, self.i, self.drive = (
            b.unknown(n, k, u) for n, k, u in
            (("vdd", "node", "V"), ("d", "node", "V"), ("g", "node", "V"), ("ivdd", "branch", "A"), ("in", "node", "V")))
        self.ig = b.unknown("ig", "branch", "A")
        for row, node, wave in ((self.i, self.supply, b.wave("dc", [10.0])), (self.ig, self.drive, b.wave(*gate))):
            b.g(row, node, 1.0); b.g(node, row, 1.0); b.f_wave(row, wave, -1.0)
        self.resistor(self.supply, self.d, 1e3)
        self.resistor(self.drive, self.g, 1e4)
        for k in range(count):
            if as_device:
                given = {**{k: v for k, v in model.items() if k != "lam"}, "lambda": model["lam"]}
                b.device("njf", f"j{k}", (self.d, self.g, -1), given, {"m": 1.0 / count})
            else:
                self.law(model)

    def resistor(self, p, n, ohm):
        for r, c, s in ((p, p, 1), (p, n, -1), (n, p, -1), (n, n, 1)):
            if r >= 0 and c >= 0:
                self.b.g(r, c, s / ohm)

    def law(self, m):
        "The same, written as expressions."
        b = self.b
        di, si = b.unknown("di", "node", "V"), b.unknown("si", "node", "V")
        self.resistor(self.d, di, m["rd"]); self.resistor(si, -1, m["rs"])
        vgs, vgd = b.x(self.g) - b.x(si), b.x(self.g) - b.x(di)
        positive = lambda e: 0.5 * (e + b.call("abs", e))
        s, d, vds = positive(vgs - m["vto"]), positive(vgd - m["vto"]), vgs - vgd
        channel = m["beta"] * (s * s - d * d) * (1.0 + m["lam"] * b.call("abs", vds))
        b.add_f(di, channel); b.add_f(si, -channel)
        for v, node, c in ((vgs, si, m["cgs"]), (vgd, di, m["cgd"])):
            i = 1e-14 * (b.call("exp", v * (1.0 / VT)) - 1.0) + 1e-12 * v
            q = c * 2.0 * m["pb"] * (1.0 - b.call("sqrt", 1.0 - v * (1.0 / m["pb"])))
            for row, sign in ((self.g, 1.0), (node, -1.0)):
                b.add_f(row, sign * i); b.add_q(row, sign * q)

def column(w, k):
    return struct.unpack(f"{w.rows}d", w.column(k))

def show(**values):
    print(json.dumps(values))
"""


def run(copy, code):
    env = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(
        [sys.executable, "-c", SETUP + code], cwd=copy, env=env, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


def test_a_saturated_channel_carries_the_closed_form(copy):
    """id = beta (vgs - vto)^2 (1 + lambda vds) without rd and rs, and the terminals are those of its spec."""
    got = run(
        copy,
        """
c = Circuit(("dc", [-1.0]), model={**MODEL, "rd": 0.0, "rs": 0.0})
w = c.b.compile().op([c.b.x(c.d), c.b.x(c.g)])
show(d=w.value(0, 1), g=w.value(0, 2), status=w.status, devices=devices(), words=[n for (n, *_), *_ in device_parameters("njf")])
""",
    )
    assert got["status"] == "ok"
    current = 1e-3 * (got["g"] + 2.0) ** 2 * (1.0 + 0.01 * got["d"])
    assert (10.0 - got["d"]) / 1e3 == pytest.approx(current, rel=1e-6)
    assert ["njf", ["drain", "gate", "source"]] in got["devices"] and "vto" in got["words"]


@pytest.mark.parametrize("gate", [-3.0, -1.0, 0.0, 2.0])
def test_its_equations_are_those_of_expressions(copy, gate):
    """Off, saturated, triode, and with a gate that conducts: the same operating point as the law in B sources."""
    got = run(
        copy,
        f"""
points = []
for as_device in (True, False):
    c = Circuit(("dc", [{gate}]), as_device)
    s = c.b.compile()
    w = s.op([c.b.x(k) for k in (c.d, c.g)], {{"reltol": 1e-9}})
    points.append([w.status, w.value(0, 1), w.value(0, 2)])
show(points=points)
""",
    )
    mine, theirs = got["points"]
    assert mine[0] == theirs[0] == "ok"
    assert mine[1:] == pytest.approx(theirs[1:], rel=1e-7, abs=1e-7)


def test_matrix_entries_are_the_slopes_of_the_rows(copy):
    """G and C of five instances, by fours and singly, against differences of F and Q."""
    got = run(
        copy,
        """
c = Circuit(("dc", [-0.5]), count=5)
s = c.b.compile()
x = [10.0, 6.0, -0.5, 0.0, -0.5, 0.0] + [5.5 - 0.4 * k for k in range(s.n - 6)]
ptr, rows = s.pattern()
cv, gv = s.jac(x, 0.0)
worst, h = [0.0, 0.0], 1e-6
for col in range(s.n):
    up, down = ([v + d * (i == col) for i, v in enumerate(x)] for d in (h, -h))
    for n, (of, values) in enumerate(((s.f, gv), (s.q, cv))):
        slope = [(a - b) / (2 * h) for a, b in zip(of(up, 0.0), of(down, 0.0))]
        dense = [0.0] * s.n
        for k in range(ptr[col], ptr[col + 1]):
            dense[rows[k]] = values[k]
        scale = max(map(abs, slope)) + 1e-15
        worst[n] = max(worst[n], max(abs(a - b) for a, b in zip(slope, dense)) / scale)
show(worst=worst, names=s.device_names)
""",
    )
    assert got["names"] == [f"j{k}" for k in range(5)]
    assert max(got["worst"]) < 1e-5


@pytest.mark.parametrize("method", ["trap", "gear", "radau", "auto", "rk45"])
def test_it_switches_like_its_expressions(copy, method):
    """Off to on and back through its charges, by implicit methods and by an explicit one that reads the law's symbols."""
    got = run(
        copy,
        f"""
ends = []
for as_device in (True, False):
    c = Circuit(("sin", [-1.5, 1.0, 2e5, 0.0, 0.0, 0.0]), as_device)
    w = c.b.compile().tran(1e-7, 1e-5, outputs=[c.b.x(c.d), c.b.x(c.g)], options_={{"method": "{method}", "reltol": 1e-6}})
    assert w.status == "ok", w.failure
    t, v = column(w, 0), column(w, 1)
    grid = [k * 1e-7 for k in range(1, 100)]
    at, k = [], 0
    for s in grid:
        while t[k + 1] < s:
            k += 1
        m = (s - t[k]) / (t[k + 1] - t[k])
        at.append(v[k] + m * (v[k + 1] - v[k]))
    ends.append(at)
show(worst=max(abs(a - b) for a, b in zip(*ends)), span=[min(ends[0]), max(ends[0])])
""",
    )
    assert got["span"][0] < 8.0 and got["span"][1] > 9.9
    assert got["worst"] < 5e-3


def test_its_energy_is_accounted_for(copy):
    """What the sources gave over ten periods is heat in it and in the resistors, but for what its charges hold."""
    got = run(
        copy,
        """
c = Circuit(("sin", [-1.0, 0.5, 2e5, 0.0, 0.0, 0.0]), model={**MODEL, "rd": 0.0, "rs": 0.0})
b = c.b
drop = [b.x(c.supply) - b.x(c.d), b.x(c.drive) - b.x(c.g)]
powers = [-(b.x(c.supply) * b.x(c.i)) - b.x(c.drive) * b.x(c.ig), drop[0] * drop[0] * 1e-3 + drop[1] * drop[1] * 1e-4]
w = b.compile().tran(1e-7, 5e-5, outputs=[b.x(c.d)], options_={"reltol": 1e-7}, accounts=(powers, [], False))
book = w.accounts
(heat, charge), = book["devices"]
show(given=book["powers"][0], lost=book["powers"][1], heat=heat, charge=charge)
""",
    )
    assert got["heat"] > 0.2 * got["given"]
    assert got["given"] == pytest.approx(got["lost"] + got["heat"] + got["charge"], rel=1e-5)


def test_what_is_wrong_with_it_is_a_sentence(copy):
    got = run(
        copy,
        """
said = []
for nodes, model in (((0, -1), {}), ((0, -1, -1), {"beta": -1.0})):
    b = Builder(); b.unknown("a", "node", "V")
    try: b.device("njf", "j1", nodes, model, {})
    except ValueError as e: said.append(str(e))
try: Builder().device("xyz", "j1", (), {}, {})
except ValueError as e: said.append(str(e))
show(said=said)
""",
    )
    assert "3 terminals" in got["said"][0] and "beta=" in got["said"][1] and "no device xyz" in got["said"][2]
