"""Parameters, conditions, includes, libraries, subcircuits, models in their scopes."""

from __future__ import annotations

import numpy as np
import pytest

from emsim.build import read
from emsim.diagnostics import DeckError
from emsim.elaborate import flatten

from .support import codes, element, flat, said


def values(cards: str, **defines: object) -> dict[str, float]:
    return {e.name: e.value for e in flat(cards, **defines).elements}


# ---- parameters ----


def test_parameters_in_any_order():
    assert values("R1 a 0 {c}\n.param c={a+b} b={2*a}\n.param a=1") == {"r1": 3.0}


def test_unused_wrong_parameters_are_told_once():
    assert codes(".param a={b} b={a} c={a}\nR1 x 0 {a}") == ["E121"]
    assert codes(".param a={nope} b={a}\nR1 x 0 {b}\nR2 x 0 {a}") == ["E120"]


def test_suggestion_for_a_misspelt_parameter():
    (d,) = said(".param rload=1\nR1 a 0 {rlaod}")
    assert d.hint == "did you mean `rload`?"


@pytest.mark.parametrize("wrong", [1 + 2j, None, [1]])
def test_defines_are_numbers_or_text(wrong):
    """(1+2j) was read as 3: its j for a unit."""
    with pytest.raises(TypeError, match="`r` is a number or text"):
        flat(".param r=1\nR1 n 0 {r}", r=wrong)
    assert values(".param r=1\nR1 n 0 {r}", r=np.int64(5)) == {"r1": 5}


def test_defines_stand_above_the_deck():
    text = ".param r=1k c={2*r}\nR1 a 0 {r}\nR2 a 0 {c}"
    assert values(text, r=5) == {"r1": 5.0, "r2": 10.0}
    assert values(text, R="2k") == {"r1": 2e3, "r2": 4e3}
    assert values(text, r="{1k*3}") == {"r1": 3e3, "r2": 6e3}
    assert values(text, r="1k*3") == {"r1": 3e3, "r2": 6e3}  # not 1k with letters behind it
    assert values(text, r="4.7kohm") == {"r1": 4.7e3, "r2": 9.4e3}
    assert [d.code for d in flat(text, q=1).sink.diagnostics] == ["W126"]


# ---- conditions ----


@pytest.mark.parametrize(
    ("x", "names"), [(1, ["r1", "r5"]), (2, ["r2", "r3", "r5"]), (3, ["r2", "r5"]), (9, ["r4", "r5"])]
)
def test_conditions(x, names):
    text = (
        f".param x={x}\n.if (x==1)\nR1 a 0 1\n.elseif x<=3\nR2 a 0 {{y}}\n.param y=7\n.if (x==2)\nR3 a 0 1\n.endif\n"
        ".else\nR4 a 0 1\n.endif\nR5 a 0 1"
    )
    assert list(values(text)) == names


def test_models_and_subcircuits_in_conditions():
    text = ".param big=1\n.if (big)\n.model dm D(is=2)\n.else\n.model dm D(is=1)\n.endif\nD1 a 0 dm"
    assert element(text).model.params == {"is": 2.0}


# ---- files ----


@pytest.fixture
def library(tmp_path):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "parts.inc").write_text("Rinc a 0 {k}\n.include more.inc\n")
    (tmp_path / "lib" / "more.inc").write_text("Rmore a 0 2\n.param k=3\n")
    (tmp_path / "lib" / "corners.lib").write_text(
        "* corners\n.lib tt\n.param k=1\n.lib 'corners.lib' common\n.endl tt\n.lib FF\n.param k=2\n.endl\n"
        ".lib common\nRcommon a 0 {k}\n.endl common\n"
    )
    return tmp_path


def deck_in(folder, cards: str):
    (folder / "main.cir").write_text("main\n" + cards + "\n")
    return flatten(read(folder / "main.cir"))


def test_includes_are_relative_to_the_including_file(library):
    deck = deck_in(library, ".include lib/parts.inc\nR1 a 0 1")
    assert {e.name: e.value for e in deck.elements} == {"rinc": 3.0, "rmore": 2.0, "r1": 1.0}
    assert len(deck.sources) == 3 and deck.elements[1].span.file.name == "more.inc"
    assert deck_in(library, '.inc "lib/more.inc" ; quoted').elements[0].name == "rmore"


def test_library_sections(library):
    assert {e.name: e.value for e in deck_in(library, ".lib lib/corners.lib TT").elements} == {"rcommon": 1.0}
    deck = deck_in(library, ".lib 'lib/corners.lib' ff\nR1 a 0 {k}")
    assert {e.name: e.value for e in deck.elements} == {"r1": 2.0}
    deck = deck_in(library, ".lib lib/more.inc\nR1 a 0 {k}")  # LTspice: a whole file
    assert [e.name for e in deck.elements] == ["rmore", "r1"]


def test_wrong_includes(library):
    (library / "loop.inc").write_text(".include loop2.inc\n")
    (library / "loop2.inc").write_text(".include loop.inc\n")
    (library / "main.cir").write_text(
        "t\nR1 a 0 1\n.include loop.inc\n.include main.cir\n.lib lib/corners.lib tf\n.include lib\n.include lib/more.in\n"
    )
    with pytest.raises(DeckError) as caught:
        flatten(read(library / "main.cir"))
    found = [(d.code, d.span.file.name, d.span.line) for d in caught.value.diagnostics]
    assert found[0] == ("E151", "loop2.inc", 1)
    assert [line for _, _, line in found[1:]] == [4, 5, 6, 7]
    assert [code for code, _, _ in found] == ["E151", "E151", "E152", "E501", "E501"]
    assert "did you mean `tt`?" in [d.hint for d in caught.value.diagnostics]


# ---- subcircuits ----


def test_nested_subcircuits_with_parameters():
    text = (
        ".subckt div top out params: r=1k ratio={2*one}\nR1 top out {r}\nR2 out 0 {r*ratio}\n.ends div\n"
        ".subckt two a b r=5\nX1 a m div r={r}\nXb m b div r={2*r} ratio=1\nC1 m vdd 1\n.ends\n"
        ".param one=1\n.global vdd\nx2 in out two r=7\nX3 in out two\n"
    )
    deck = flat(text)
    found = {e.name: (e.nodes, e.value) for e in deck.elements}
    assert found["x2.x1.r1"] == (["in", "x2.m"], 7.0)
    assert found["x2.x1.r2"] == (["x2.m", "0"], 14.0)
    assert found["x2.xb.r2"] == (["out", "0"], 14.0)
    assert found["x2.c1"] == (["x2.m", "vdd"], 1.0)
    assert found["x3.x1.r1"] == (["in", "x3.m"], 5.0)


def test_parameters_are_seen_through_the_call_as_in_ngspice():
    text = (
        ".param p=1\n.subckt inner a\nr1 a 0 {p}\n.ends\n.subckt outer a\n.param p=2\nx1 a inner\n.ends\n"
        ".subckt outer2 a p=3\nx1 a inner\n.ends\nx1 n outer\nx2 n outer2\nx3 n inner\n"
    )
    assert values(text) == {"x1.x1.r1": 2.0, "x2.x1.r1": 3.0, "x3.r1": 1.0}


def test_local_models_and_subcircuits():
    text = (
        ".model dm D(is=1)\n.subckt s a i0=5\n.model dm D(is={i0})\nD1 a 0 dm\nX1 a t\n"
        ".subckt t a\nD2 a 0 dm\n.ends\n.ends\nX1 a s\nX2 a s i0=6\nD3 a 0 dm\n"
    )
    deck = flat(text)
    found = {e.name: (e.model.name, e.model.params["is"]) for e in deck.elements}
    assert found == {
        "x1.d1": ("x1.dm", 5), "x1.x1.d2": ("x1.dm", 5), "x2.d1": ("x2.dm", 6), "x2.x1.d2": ("x2.dm", 6), "d3": ("dm", 1),
    }  # fmt: skip
    assert codes(".subckt s a\n.subckt t a\nR1 a 0 1\n.ends\n.ends\nX1 a t") == ["E130"]


def test_everything_inside_gets_its_names():
    deck = flat(
        ".subckt s a b\nV1 a m 1\nE1 b 0 POLY(1) m 0 1\nF1 b 0 V1 2\nH1 q 0 POLY(1) v1 1\nL1 a b 1\nL2 a b 1\n"
        "K1 L1 L2 0.5\nB1 b 0 V={v(m,a)+i(V1)+v(b)}\n.ic v(m)=3\n.ends\nX1 n1 n2 s\n"
    )
    by = {e.name: e for e in deck.elements}
    assert by["x1.e1"].extra["controls"] == [("x1.m", "0")]
    assert by["x1.f1"].extra["controls"] == ["x1.v1"] and by["x1.h1"].extra["controls"] == ["x1.v1"]
    assert by["x1.k1"].extra["inductors"] == ["x1.l1", "x1.l2"]
    assert str(by["x1.b1"].value) == "(v(x1.m,n1)+i(x1.v1))+v(n2)"
    assert [(n, v) for n, v, _ in deck.ics] == [("x1.m", 3)]


def test_multiplier_of_an_instance():
    text = ".subckt s a\nR1 a 0 1k\nC1 a 0 1n m=2\nV1 a 0 1\nx1 a t\n.ends\n.subckt t a\nR2 a 0 1\n.ends\nX1 n s m=3"
    by = {e.name: e.params.get("m") for e in flat(text).elements}
    assert by == {"x1.r1": 3, "x1.c1": 6, "x1.v1": None, "x1.x1.r2": 3}


def test_hierarchical_names_of_ngspice_in_probes():
    deck = flat(
        ".subckt s a\nV1 a m 1\nR1 m 0 1\n.ends\nX1 n s\nB1 q 0 V={i(v.x1.v1)+v(x1.m)}\n.print tran i(x1.v1)"
    )
    assert str(deck.elements[-1].value) == "i(x1.v1)+v(x1.m)"


def test_deep_recursion_through_others():
    assert codes(".subckt a n\nx1 n b\n.ends\n.subckt b n\nx1 n a\n.ends\nx1 n a") == ["E132"]


def test_what_multiplies_beyond_a_million_is_refused_before_it_is_built():
    """Forty levels of two each are 2^40 resistors: the deck of 160 lines filled the memory."""
    pairs = "".join(f".subckt s{k + 1} a\nX1 a s{k}\nX2 a s{k}\n.ends\n" for k in range(40))
    leaf = ".subckt s0 a\nR1 a 0 1\n.ends\n"
    (many,) = said("X1 n s40\n" + pairs + leaf)
    assert many.code == "E132" and "2.2e+12 subcircuits" in many.message and many.span.line == 2
    assert len(flat("X1 n s8\n" + pairs + leaf).elements) == 256


def test_what_is_nested_too_deep_is_said_in_its_own_words():
    """Seventy subcircuits, each in the next, were called one that contains itself; 300 parameters, each before the one it
    needs, stopped the program."""
    nested = "".join(f".subckt s{k} a\nX1 a s{k + 1}\n.ends\n" for k in range(70))
    (deep,) = said("X1 n s0\n" + nested + ".subckt s70 a\nR1 a 0 1\n.ends")
    assert deep.code == "E132" and "60 subcircuits deep" in deep.message
    backwards = "".join(f".param p{k + 1}={{p{k}+1}}\n" for k in reversed(range(300)))
    assert set(codes(backwards + ".param p0=1\nR1 a 0 {p300}")) == {"E121"}
    forwards = "".join(f".param p{k + 1}={{p{k}+1}}\n" for k in range(300))
    assert codes(".param p0=1\n" + forwards + "R1 a 0 {p300}") == []


def test_a_subcircuit_used_many_times_reports_its_error_once():
    assert codes(".subckt s a\nR1 a 0 {nope}\n.ends\n" + "\n".join(f"X{k} n s" for k in range(9))) == ["E120"]


# ---- machines in subcircuits ----


def test_terminals_may_be_bodies_joints_and_points():
    deck = flat(
        ".subckt leg hip knee j vdd len=0.3\nBODY shin shape=rod({len}) m=1\nPOINT shin.foot {len} 0\n"
        "JOINT k hip shin pin\nSPRING s shin.foot knee k=10\nSPRING s2 shin(0.1,{len}) hip k=1\n"
        "MOTOR m vdd 0 j kt=1\nB1 x 0 V={angle(k)+x(shin.foot)+omega(j)+y(knee)+torque(m)}\n.ends\n"
        "BODY body m=1\nJOINT base 0 body slide axis=(1,0)\nX1 body body(0.5,0.1) base dd leg len=0.4\n"
    )
    by = {f"{c.kind} {c.name}": c for c in deck.machine}
    assert by["BODY x1.shin"].params["shape"].args[0].value == 0.4
    assert by["POINT x1.shin.foot"].params["at"] == (0.4, 0.0)
    assert [str(r) for r in by["JOINT x1.k"].args] == ["body", "x1.shin", "pin"]
    assert [str(r) for r in by["SPRING x1.s"].args] == ["x1.shin.foot", "body(0.5, 0.1)"]
    assert [str(r) for r in by["SPRING x1.s2"].args] == ["x1.shin(0.1, 0.4)", "body"]
    assert [str(r) for r in by["MOTOR x1.m"].args] == ["dd", "0", "base"]
    (b,) = deck.elements
    assert str(b.value) == ("(((angle(x1.k)+x(x1.shin.foot))+omega(base))+y(body(0.5,0.1)))+torque(x1.m)")


def test_a_point_where_a_node_is_needed():
    (d,) = said(".subckt s a\nR1 a 0 1\n.ends\nBODY arm m=1\nX1 arm(0.1,0) s")
    assert d.code == "E136" and d.span.text == "X1"


ROTOR = "BODY r m=1 j=1m\nJOINT shaft 0 r pin\nV1 in 0 3\n"


def test_a_motor_finds_the_model_of_its_subcircuit():
    deck = flat(
        ROTOR + ".subckt unit n h k=2 f=1\nMOTOR m n 0 h model=d\n.model d dcmotor kt={k} r=1\n.ends\n"
        ".model d dcmotor kt=7 r=1\nX1 in shaft unit k=5\nX2 in shaft unit\nMOTOR m in 0 shaft model=d"
    )
    models = {c.name: deck.models[c.params["model"]].params["kt"] for c in deck.machine if c.kind == "MOTOR"}
    assert models == {"x1.m": 5, "x2.m": 2, "m": 7}


@pytest.mark.parametrize(
    "around", [".subckt outer n h\nX1 n h unit\n.ends\nX3 in shaft outer m=2", "X3 in shaft unit m=2"]
)
def test_machines_are_not_multiplied(around):
    (d,) = said(ROTOR + ".subckt unit n h\nPOINT r2.tip 1 0\nMOTOR m n 0 h kt=1\n.ends\n" + around)
    assert d.code == "E138" and d.span.text == "X3" and "MOTOR x3." in d.message


@pytest.mark.parametrize("reading", ["omega(j)", "x(j(1,0))", "y(j.tip)"])
def test_a_terminal_that_is_read_as_a_machine_is_no_node(reading):
    (d,) = said(ROTOR + f".subckt s j\nB1 o 0 V={{{reading}}}\nR1 o j 1\n.ends\nX1 shaft s")
    assert d.code == "E136" and d.span.text == "X1" and reading.replace(" ", "") in d.message
