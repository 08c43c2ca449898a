"""emsim explain of decks, of their lines, of card words."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from emsim.cards import CARDS
from emsim.cli import main
from emsim.elements import LETTERS

SERVO = str(Path(__file__).resolve().parents[3] / "netlists/coupled/pendulum_servo.cir")
DECK = """a divider, twice
.param rr=2k
.subckt half a b
R1 a b {rr}
R2 b 0
+ 1k
.ends
V1 in 0 5
X1 in m half
X2 m o half
Co o 0 1u
* a comment
.print tran v(o)
.tran 1u 1m
.end
"""


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "deck.cir"
    path.write_text(DECK)
    return str(path)


def said(capsys, *args: str) -> str:
    assert main(["explain", *args]) == 0
    return capsys.readouterr().out


def test_a_deck_reads_as_a_page(capsys):
    text = said(capsys, SERVO)
    for line in (
        "  12 unknowns, 12 equations: 3 have a time derivative, 9 are algebraic",
        "  1 degree of freedom",
        "  index 1: the algebraic equations determine their unknowns",
    ):
        assert line in text.splitlines()
    assert (
        "0.0078*d/dt omega(hinge)" in text
        and "= - 0.2943*sin(angle(hinge))                weight of arm" in text
    )
    assert "angle(hinge)  rad    angle of hinge" in text
    order = [
        text.index(f"\n{head}")
        for head in ("Unknowns", "Energies", "Motion", "Nodes", "Branches", "Where", "Conditions", "Folded")
    ]
    assert order == sorted(order)


def test_latex(capsys):
    text = said(capsys, SERVO, "--latex")
    assert text.startswith(r"\documentclass{article}") and text.endswith("\\end{document}\n")
    assert (
        r"0.0078\,\frac{\mathrm{d}}{\mathrm{d}t}\omega_{\mathrm{hinge}} &= -0.2943\,\sin\left(\theta_{\mathrm{hinge}}\right)"
        in text
    )


def test_as_json(capsys):
    told = json.loads(said(capsys, SERVO, "--json"))["equations"]
    assert (told["size"], told["degrees_of_freedom"], told["index"], told["left_out"]) == (12, 1, 1, 0)
    motion = next(e for e in told["equations"] if e["title"].startswith("motion of hinge"))
    assert [(t["owner"], t["formula"]) for t in motion["right"]] == [
        ("arm", "-0.2943*sin(angle(hinge))"),
        ("hinge", "-0.002*omega(hinge)"),
        ("m1", "0.6*i(m1)"),
    ]


def test_a_parameter_may_be_set(capsys, deck):
    assert "(v(in) - v(m))/2000" in said(capsys, deck)
    assert "(v(in) - v(m))/3000" in said(capsys, deck, "-D", "rr=3k")


def test_a_line_of_a_machine_card(capsys):
    text = said(capsys, f"{SERVO}:6")
    assert "     6 | MOTOR  m1     drive 0 hinge" in text
    assert "setting(kt 20m)" in text
    assert "kt=20m   0.02 N m/A" in text and "torque per ampere" in text
    assert "0.001*d/dt i(m1) + 0.6*omega(hinge) + 2*i(m1) = v(drive)" in text
    assert ".. = 0.6*i(m1) + .." in text


def test_a_line_of_a_subcircuit_is_read_once_a_use(capsys, deck):
    text = said(capsys, f"{deck}:4")
    assert "resistor x1.r1" in text and "resistor x2.r1" in text
    assert "(v(m) - v(o))/2000 + .. = 0" in text
    assert "value    {rr} = 2000 Ohm" in text


def test_a_continuation_belongs_to_its_card(capsys, deck):
    text = said(capsys, f"{deck}:6")
    assert "     5 | R2 b 0\n     6 | + 1k" in text and "1000 Ohm" in text


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (1, "the title"),
        (2, ".param rr = 2000"),
        (3, ".subckt half, terminals a, b"),
        (12, "a comment"),
        (13, ".print tran: v(o)"),
        (14, ".tran tstep = 1e-06 s, tstop = 0.001 s"),
    ],
)
def test_other_lines(capsys, deck, line, words):
    assert words in said(capsys, f"{deck}:{line}")


def test_a_line_as_json(capsys):
    told = json.loads(said(capsys, f"{SERVO}:11", "--json"))["line"]
    assert told["tree"] == ["resistor", ["rload", "wip", "0", "100k"]]
    assert any("100000 Ohm" in line for line in told["card"])


def test_the_line_of_a_wrong_deck_is_shown_before_what_is_wrong(capsys, tmp_path):
    path = tmp_path / "bad.cir"
    path.write_text("bad\nV1 a 0 1\nR1 a 0 1k foo=2\n.tran 1u 1m\n.end\n")
    assert main(["explain", f"{path}:3"]) == 1
    out, err = capsys.readouterr()
    assert "     3 | R1 a 0 1k foo=2" in out and "resistor(R1 a 0 1k param(foo 2))" in out
    assert "error[E307]" in err


@pytest.mark.parametrize(
    "word", [*CARDS, *(letter.upper() for letter in LETTERS), "motor", "r", ".tran", ".GRAVITY"]
)
def test_every_card_word_has_a_reference(capsys, word):
    text = said(capsys, word)
    assert text.startswith(word.lower() if word[0] == "." else word.upper())
    assert len(text.splitlines()) >= 3
    told = json.loads(said(capsys, word, "--json"))["card"]
    assert told["form"] in text and told["meaning"] in text


def test_the_reference_names_unit_default_and_meaning(capsys):
    text = said(capsys, "POT")
    assert "required" in text and "resistance from top to bottom (greater than 0)" in text
    assert "how resistance follows the way (lin or log)" in text


@pytest.mark.parametrize(
    ("args", "code", "words"),
    [
        (["explain"], 2, "takes one of"),
        (["explain", SERVO, "MOTOR"], 2, "takes one of"),
        (["explain", "nope.cir"], 5, "there is no file nope.cir"),
        (["explain", "nope.cir:3"], 5, "there is no file nope.cir"),
        (["explain", f"{SERVO}:99"], 2, "there is no line 99"),
        (["explain", f"{SERVO}:0"], 2, "there is no line 0"),
        (["explain", "MOTR"], 2, "nothing to explain"),
    ],
)
def test_what_cannot_be_explained(capsys, args, code, words):
    assert main(args) == code
    assert words in capsys.readouterr().err


def test_a_wrong_deck_is_refused_with_its_message(capsys, tmp_path):
    path = tmp_path / "bad.cir"
    path.write_text("bad\nV1 a 0 1\nV2 a 0 2\n.tran 1u 1m\n.end\n")
    assert main(["explain", str(path)]) == 1
    assert "error[E" in capsys.readouterr().err
