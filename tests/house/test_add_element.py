"""An element is one file in elements/ and its line in the list there (import and entry): a gyrator, in a copy of the tree.

The gyrator takes i_a = g v_b and i_b = -g v_a against a common terminal. It has no losses, and turns a capacitor at b into
an inductor of C/g^2 at a: behind a resistor, the current at a rises as (V/R) (1 - exp(-t R g^2/C)).
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from math import exp

import pytest
from support import copied_tree

# every letter is taken: those of two lines are given away
FILE = '''"""Y: a gyrator, i_a = g v_b and i_b = -g v_a, against a common terminal; it turns a capacitor into an inductor."""

from __future__ import annotations

from .base import Element, Param


class Gyrator(Element):
    __slots__ = ()
    letter = "y"
    what = "gyrator"
    form = "Yname a b common g"
    law = "i_a = g v_b, i_b = -g v_a, without losses"
    unit = "S"
    terminals = ("a", "b", "common")
    positional = ("value",)
    instance = {"m": Param("so many in parallel", default=1.0)}

    def paths(self):
        return ((0, 2, "conducts"), (1, 2, "conducts"))

    def current(self, ctx, terminal=0):
        a, b, common = self.nodes
        g = self.number("m", 1.0) * self.quantity(ctx)
        into_a, into_b = g * ctx.v(b, common), -g * ctx.v(a, common)
        return (into_a, into_b, -(into_a + into_b))[terminal]

    def contribute(self, ctx):
        for k, node in enumerate(self.nodes):
            ctx.b.add_f(ctx.node(node), self.current(ctx, k))

    def probe(self, ctx, name):
        ends = {"i": 0, "ia": 0, "ib": 1, "ic": 2}
        return self.current(ctx, ends[name]) if name in ends else None

    def account(self, ctx, book):
        """What goes in at a comes out at b."""
'''
# one with a .model and a number of nodes that varies, as transistors have
CHANNEL = '''"""P: a channel whose conductance the gate sets, i = k area v(gate, source) v(drain, source)."""

from __future__ import annotations

from .base import Element, Param


class Channel(Element):
    __slots__ = ()
    letter = "p"
    what = "channel"
    form = "Pname drain gate source [bulk] model [area] [off]"
    law = "i = k area v(gate, source) v(drain, source)"
    terminals = ("drain", "gate", "source", "bulk")
    least = 3
    positional = ("area",)
    flags = ("off",)
    instance = {"area": Param("factor on k", default=1.0), "off": Param("off at the start")}
    model_types = ("chan",)
    model_words = {"k": Param("conductance per volt", "S/V", 1e-3)}

    def paths(self):
        return ((0, 2, "conducts"),)

    def reads(self):
        return [self.nodes[1], *self.nodes[3:]]

    def current(self, ctx, terminal=0):
        drain, gate, source = self.nodes[:3]
        k = self.model.params.get("k", 1e-3) * self.number("area", 1.0)
        i = k * ctx.v(gate, source) * ctx.v(drain, source)
        return {0: i, 2: -i}.get(terminal, ctx.b.const(0.0))

    def contribute(self, ctx):
        for k in (0, 2):
            ctx.b.add_f(ctx.node(self.nodes[k]), self.current(ctx, k))

    def account(self, ctx, book):
        book.dissipates(self, self.current(ctx) * ctx.v(self.nodes[0], self.nodes[2]))
'''
DECK = """a capacitor behind a gyrator is an inductor of 0.1 H
V1 in 0 1
R1 in a 100
Y1 a b 0 {g}
C1 b 0 10u
.param g=10m
.tran 10u 5m uic
.print tran v(a) v(b) i(y1) @y1[ib]
.end
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    to = copied_tree(tmp_path_factory.mktemp("copy"))
    (to / "emsim" / "elements" / "gyrator.py").write_text(FILE, encoding="utf-8")
    (to / "emsim" / "elements" / "channel.py").write_text(CHANNEL, encoding="utf-8")
    listed = to / "emsim" / "elements" / "__init__.py"
    text = listed.read_text(encoding="utf-8")
    for before, line in (
        ('    "p": "p CoupledLines",\n', '    "p": "channel Channel",\n'),
        ('    "y": "y SingleLine",\n', '    "y": "gyrator Gyrator",\n'),
        ('"y": "txl", "p": "cpl", ', ""),
    ):
        assert text.count(before) == 1
        text = text.replace(before, line)
    listed.write_text(text, encoding="utf-8")
    (to / "gyrator.cir").write_text(DECK, encoding="utf-8")
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
        "import emsim, json; r = emsim.run('gyrator.cir');"
        "print(json.dumps([emsim.__file__, *(list(map(float, r[n])) for n in ('time', 'i(y1)', '@y1[ib]', 'v(a)'))]))"
    )
    where, times, into_a, into_b, v_a = json.loads(python(copy, "-c", code))
    assert where.startswith(str(copy))
    for t, i, ib, v in zip(times, into_a, into_b, v_a, strict=True):
        assert i == pytest.approx(0.01 * (1.0 - exp(-t * 100.0 / 0.1)), abs=2e-5)
        assert ib == pytest.approx(-0.01 * v, abs=1e-9)
    assert times[-1] == pytest.approx(5e-3)


def test_its_words_are_known_everywhere(copy):
    told = python(copy, "-m", "emsim", "explain", "Y")
    assert "Y: gyrator" in told and "Yname a b common g" in told and "without losses" in told
    line = python(copy, "-m", "emsim", "explain", "gyrator.cir:4")
    assert "a = a, b = b, common = 0" in line and "0.01 S" in line
    equations = python(copy, "-m", "emsim", "explain", "gyrator.cir")
    assert "v(b)" in equations
    hover = python(copy, "-c", "from emsim.editor.hover import element_text; print(element_text('y'))")
    assert "gyrator" in hover and "not supported" not in hover
    code = (
        "from emsim.editor.place import Place\n"
        "for col in (3, 5, 7): print(Place(['t', 'y1 a b 0 '], 1, col).expects())\n"
        "from emsim.editor.complete import complete\n"
        "from emsim.editor.document import Document\n"
        "print([i.label for i in complete(Document('t\\ny1 a b 0 1m \\n', 'd.cir'), 1, 12)])\n"
    )
    expected = python(copy, "-c", code).splitlines()
    assert expected[:3] == ["('node',)"] * 3 and "'m'" in expected[3]


def test_what_is_wrong_in_its_line_is_said_with_its_form(copy):
    (copy / "wrong.cir").write_text("t\nV1 a 0 1\nY1 a b\n.op\n.end\n", encoding="utf-8")
    code = "import emsim\ntry: emsim.run('wrong.cir')\nexcept emsim.DeckError as e: print(e)\n"
    said = python(copy, "-c", code)
    assert "too few nodes" in said and "Yname a b common g" in said


def test_its_energy_balance_closes(copy):
    code = (
        "import emsim; r = emsim.run('gyrator.cir', energy=True); e = r.energy;"
        "print(abs(e.residual), e.share)"
    )
    _, share = map(float, python(copy, "-c", code).split())
    assert share < 1e-3


CHANNELS = """import emsim

def run(*lines):
    head, tail = ("t", "V1 d 0 2", "V2 g 0 3"), (".model ch chan(k=1m)", ".op", ".end")
    return emsim.run("\\n".join((*head, *lines, *tail)))

inside = (".subckt s a b", "P1 a b 0 ch area=4", ".ends", "X1 d g s")
for lines in (("P1 d g 0 ch",), ("P1 d g 0 0 ch 2",), ("P1 d g 0 ch {1+2} off",), inside):
    print(round(-float(run(*lines).table("op")["i(v1)"][0]), 9))
for card in ("P1 d g ch", "P1 d g 0 0 0 ch", "P1 d g 0 ch 1 2", "P1 d g 0 ch width=2", "P1 d g 0 nope"):
    try:
        run(card)
        print("ran")
    except emsim.DeckError as error:
        print(error.diagnostics[0].code)
"""


def test_one_with_a_model_and_as_many_nodes_as_it_likes(copy):
    (copy / "channels.py").write_text(CHANNELS, encoding="utf-8")
    found = python(copy, "channels.py").split()
    assert found == ["0.006", "0.012", "0.018", "0.024", "E109", "E109", "E102", "E307", "E140"]
    assert ".model name chan(..)" in python(copy, "-m", "emsim", "explain", "p")
