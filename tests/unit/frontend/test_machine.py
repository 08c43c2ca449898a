"""Machine cards: told from SPICE lines by their mark, read generically, numbers in SI."""

from __future__ import annotations

import time
from math import pi

import pytest

from emsim.elements import Element

from .support import codes, flat, machine, said

CARDS = [
    "BODY arm m=1",
    "BODY arm shape=rod(0.3)",
    "BODY arm fixed=yes",
    "POINT arm.tip 0.3 0",
    "JOINT hinge 0 arm pin",
    "MOTOR m1 a 0 hinge kt=1",
    "MOTOR m1 a 0 hinge model=mx",
    "POT p1 t w b hinge r=1k range=(0,1)",
    "SPRING s1 hinge k=1",
    "SPRING s1 arm(0.1,0) 0(0,1) k=1",
    "DAMPER d1 hinge c=1",
    "FRICTION f1 hinge fc=1",
    "STOP s1 hinge min=0 k=1",
    "STOP s1 hinge max=0 k=1",
    "GEAR g1 hinge h2 ratio=2",
    "GEAR g1 hinge h2 lead=2",
    "FORCE f1 arm dir=(1,0) 5",
    "FORCE f1 arm fx=1 fy=2",
    "TORQUE t1 hinge tau=1",
    "DRIVE d1 hinge q={time}",
    "DRIVE d1 hinge qd=1",
    "CONTACT c1 arm.tip wall k=1",
    "CONTACT c1 ball wall e=0.5",
    "TRANSDUCER c1 a 0 beam C={1n*pos(beam)}",
    "TRANSDUCER c1 a 0 beam l={1n*pos(beam)}",
    "TRANSDUCER c1 a 0 beam K={pos(beam)}",
]


@pytest.mark.parametrize("card", CARDS)
@pytest.mark.parametrize("spelling", [str, str.lower, str.upper])
def test_a_marked_line_is_a_machine_card(card, spelling):
    assert machine(spelling(card)).kind == card.split()[0]


@pytest.mark.parametrize("card", CARDS)
def test_continued_and_commented_lines_too(card):
    words = card.split(" ")
    text = (
        f"{words[0]} {words[1]} ; it's m= and {{ kt=\n* range=(0 and '\n+ "
        + " ".join(words[2:-1])
        + f"\n+ {words[-1]} ; x"
    )
    if words[0] == "POINT":  # its mark stands in the name, on the first line
        text = card + " ; x"
    if words[0] == "JOINT":
        text = "JOINT hinge\n+ 0 arm\n+ pin zero=1 ; c"
    assert machine(text).kind == words[0]


SPICE = """
.model motor_n NMOS
.model jf NJF
.model sw1 SW
.model dm D
.model cm C
MOTOR d g s b motor_n w=1u
JOINT d g s jf
BODY a 0 V={v(b)*2}
BODYI a 0 I={m==1 ? v(b) : 0}
SPRING a b c d sw1
STOP a b c d sw1 on
DAMPER a b dm
DRIVE a b dm 2
CONTACT a b 1u ic=1
GEAR a b c d 5
FORCE a b vm 2
FRICTION a b vm 3
VM a b 0
TORQUE a 0 b 0 z0=50 td=1n
TRANSDUCER a 0 b 0 z0=50
BODYX a 0 V=1 m=2
BODYY a 0 ; m=1
+V=1 m=2
.param m=1
"""


def test_spice_elements_with_card_words_for_names_keep_working():
    deck = flat(SPICE)
    assert deck.machine == []
    assert [e.letter for e in deck.elements] == list("mjbbssddcgffvttbb")


@pytest.mark.parametrize("comment", [" ; kt=1", "\n* kt=1\n+ ", " ; a\n* kt=\n+ ; model="])
def test_a_mark_in_a_comment_is_none(comment):
    deck = flat(f".model n NMOS\nMOTOR d g s b n{comment}")
    assert isinstance(deck.elements[0], Element) and deck.machine == []


@pytest.mark.parametrize(
    ("card", "model", "letter"),
    [
        ("MOTOR d g s b n kt=1", "n NMOS", "m"), ("JOINT d g s pin", "pin NJF", "j"), ("DAMPER a b dm c=2", "dm D", "d"),
        ("CONTACT a b cm k=3", "cm C", "c"), ("STOP a b c d sm max=1", "sm SW", "s"),
    ],
)  # fmt: skip
def test_where_a_model_fits_too_the_spice_reading_wins_with_a_note(card, model, letter):
    deck = flat(f"{card}\n.model {model}")
    assert [e.letter for e in deck.elements] == [letter] and deck.machine == []
    assert deck.elements[0].model.name == model.split()[0]
    assert [d.code for d in deck.sink.diagnostics] == ["N137"]
    other = flat(f"{card}\n.model {model.split()[0]} NPN")  # a model of another type does not fit
    assert len(other.machine) == 1 and other.elements == []


def test_without_the_mark_the_hint_names_it():
    for card, mark in (
        ("MOTOR m1 a 0 hinge r=2", "kt=, ke=, kv=, vnom= or model="),
        ("BODY arm j=1", "m=, shape= or fixed="),
    ):
        assert f"needs {mark}" in said(card)[0].hint


# ---- what is read ----


def test_numbers_tuples_shapes_words():
    card = machine(
        ".param l=0.3\nBODY arm shape=box(20mm,{l}) m=2k j=(1,2,3) com=({l/2}, -1cm) fixed=yes angle=180deg"
    )
    p = card.params
    assert (p["m"], p["j"], p["fixed"]) == (2000.0, (1.0, 2.0, 3.0), "yes")
    assert p["com"] == pytest.approx((0.15, -0.01)) and p["angle"] == pytest.approx(pi)
    assert p["shape"].fn == "box" and [a.value for a in p["shape"].args] == pytest.approx([0.02, 0.3])
    assert card.param_spans["com"].text == "com=({l/2}, -1cm)"


def test_refs():
    card = machine("SPRING s 0(0.1,-2) ARM.tip k=1 l0=0")
    a, b = card.args
    assert (a.name, a.point, b.name, b.point) == ("0", (0.1, -2.0), "arm.tip", None)
    assert a.span.text == "0(0.1,-2)"
    card = machine("MOTOR m1 1 GND hinge kt=1")  # nodes may be numbers
    assert [r.name for r in card.args] == ["1", "0", "hinge"]


def test_positional_values_and_waveforms():
    assert machine("FORCE f arm dir=(1,0) -5").params["value"] == -5.0
    assert machine("FORCE f arm -5 dir=(1,0)").params["value"] == -5.0
    assert str(machine("FORCE f arm dir=(1,0) {2*vel(j)}").params["value"]) == "2*vel(j)"
    wave = machine("FORCE f arm(0.6,0) dir=(1,0) PULSE(0 2 {a} 1m 1m 50m 100)\n.param a=3").wave
    assert (wave.kind, wave.args) == ("pulse", [0.0, 2.0, 3.0, 1e-3, 1e-3, 0.05, 100.0])
    wave = machine("TORQUE t hinge tau=SIN(0, 1, 2)").wave
    assert (wave.kind, wave.args) == ("sin", [0.0, 1.0, 2.0])
    assert machine("TORQUE t hinge tau=3").params == {"tau": 3.0}
    assert machine("POINT arm.tip 0.3 -1cm {1+1}").params["at"] == (0.3, -0.01, 2.0)


def test_expressions_keep_what_the_run_knows():
    card = machine(".param e0=2 x0=1\nTRANSDUCER c1 a 0 beam C={e0*(x0+pos(beam))}")
    assert str(card.params["c"]) == "2*(1+pos(beam))"


def test_letters_that_are_keywords_elsewhere_are_names():
    card = machine("MOTOR r l c q kt={1} r=2 l={3} c=4 q=5")
    assert (card.name, [a.name for a in card.args]) == ("r", ["l", "c", "q"])
    assert card.params == {"kt": 1.0, "r": 2.0, "l": 3.0, "c": 4.0, "q": 5.0}


def test_names_are_unique_among_mechanical_things():
    assert codes("BODY a m=1\nJOINT a 0 b pin") == ["E135"]
    assert codes("BODY r1 m=1\nR1 r1 0 1") == []  # nodes and elements are another space


@pytest.mark.parametrize(
    "text",
    [
        "BODY " + "\n* x\n+ " * 3000 + " =",
        "JOINT a" + "\n+" * 5000,
        "JOINT a " + "b " * 9000,
        "BODY a " + "; x\n+ " * 5000,
    ],
    ids=["comment lines", "continuations", "words", "comments"],
)
def test_looking_for_the_mark_takes_linear_time(text):
    start = time.process_time()
    assert said(text)[0].severity == "error"
    assert time.process_time() - start < 3
