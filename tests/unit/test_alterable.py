"""emsim.Deck: a deck that is altered between runs, beside the same deck written with the value."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

TEXT = """a deck
.param r=1k
V1 in 0 DC 1 AC 1 SIN(0 1 1k)
R1 in out {r}
C1 out 0 1u
R2 out 0 5k
D1 out x dm
R3 x 0 1k
.model dm d(is=1e-14)
X1 out cell
.subckt cell a
R9 a 0 10k
.ends
.op
.end
"""


def v(deck: emsim.Deck, name: str = "v(out)") -> float:
    return float(deck.run(["op"])[name][0])


@pytest.mark.parametrize(
    ("change", "written"),
    [
        (lambda d: d.alter("r2", 1e3), TEXT.replace("5k", "1k")),
        (lambda d: d.alter("R2", 1e3, "resistance"), TEXT.replace("5k", "1k")),
        (lambda d: d.alter("v1", 3.0), TEXT.replace("DC 1", "DC 3")),
        (lambda d: d.alter("x1.r9", 1e3), TEXT.replace("10k", "1k")),
        (lambda d: d.alter("r.x1.r9", 1e3), TEXT.replace("10k", "1k")),
        (lambda d: d.alter_model("dm", "is", 1e-9), TEXT.replace("1e-14", "1e-9")),
        (lambda d: d.alter_parameter("r", 3e3), TEXT.replace("r=1k", "r=3k")),
        (lambda d: d.set_option("temp", 80.0), TEXT.replace(".op", ".op\n.temp 80")),
    ],
)
def test_an_altered_deck_is_the_deck_with_that_value(change, written):
    deck = emsim.Deck(TEXT)
    before = v(deck)
    change(deck)
    assert v(deck) == pytest.approx(float(emsim.run(written)["v(out)"][0]), rel=1e-12)
    assert v(deck) != before


def test_reset_takes_alterations_back_and_keeps_parameters():
    deck = emsim.Deck(TEXT)
    first = v(deck)
    deck.alter("r2", 10.0)
    deck.reset()
    assert v(deck) == first
    deck.alter_parameter("r", 3e3)
    deck.reset()
    assert v(deck) == pytest.approx(float(emsim.run(TEXT.replace("r=1k", "r=3k"))["v(out)"][0]), rel=1e-12)


def test_alterations_outlive_a_changed_parameter():
    deck = emsim.Deck(TEXT)
    deck.alter("r2", 1e3)
    deck.alter_parameter("r", 3e3)
    assert v(deck) == pytest.approx(
        float(emsim.run(TEXT.replace("r=1k", "r=3k").replace("5k", "1k"))["v(out)"][0]), rel=1e-12
    )


def test_decks_do_not_share_what_is_altered():
    a, b = emsim.Deck(TEXT), emsim.Deck(TEXT)
    a.alter("r2", 1.0)
    assert v(b) == float(emsim.run(TEXT)["v(out)"][0])


def test_waveforms_and_amplitudes_are_altered():
    deck = emsim.Deck(TEXT)
    deck.alter("v1", [0.0, 2.0, 2e3], "sin")
    deck.alter("v1", 2.0, "acmag")
    result = deck.run(["tran 10u 1m", ".ac lin 3 10 1k"])
    assert result.table("tran").at("v(in)", 0.125e-3) == pytest.approx(2.0, rel=1e-6)
    assert np.allclose(abs(result.table("ac")["v(in)"]), 2.0)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda d: d.alter("r7", 1.0), "E166"),
        (lambda d: d.alter("r1", 1.0, "resistence"), "E166"),
        (lambda d: d.alter_model("dn", "is", 1.0), "E166"),
        (lambda d: d.alter_model("dm", "iss", 1.0), "E166"),
        (lambda d: d.alter_parameter("rr", 1.0), "E166"),
        (lambda d: d.alter("d1", 1.0), "E167"),
        (lambda d: d.run(["trann 1u 1m"]), "E105"),
    ],
)
def test_what_is_not_there_is_an_error(change, code):
    with pytest.raises(emsim.DeckError) as error:
        change(emsim.Deck(TEXT))
    assert error.value.diagnostics[0].code == code


def test_a_machine_is_altered_too():
    text = "a pendulum\nBODY arm m=1 j=0.1 com=(0.5,0)\nJOINT hinge 0 arm pin\n.gravity\n.tran 1m 0.1\n.end\n"
    deck = emsim.Deck(text)
    first = deck.run()["omega(hinge)"][-1]
    deck.alter("arm", 2.0, "m")
    twice = emsim.run(text.replace("m=1", "m=2"))["omega(hinge)"][-1]
    assert deck.run()["omega(hinge)"][-1] == pytest.approx(twice, rel=1e-9) and twice != first


def test_one_analysis_may_stand_alone():
    """A text is one card, not a list of letters."""
    assert emsim.Deck(TEXT).run("tran 10u 1m").tran is not None
    assert emsim.run(TEXT, analyses="tran 10u 1m").tran is not None


def test_hints_say_what_a_deck_may_be_given_as():
    assert "Source" in emsim.run.__annotations__["source"]
    with pytest.raises(TypeError, match="PySpice"):
        emsim.sweep(3.0, {"r": [1, 2]})  # type: ignore[arg-type]


def test_a_drawing_of_ltspice_is_read_and_what_it_lacks_told_at_its_line():
    drawn = "Version 4\nSHEET 1 880 680\nWIRE 96 96 208 96\nSYMBOL res 80 80 R0\nSYMATTR InstName R1\n"
    with pytest.raises(emsim.DeckError) as told:
        emsim.run(drawn)
    (said,) = told.value.diagnostics
    assert said.code == "E140" and said.span is not None and said.span.line == 4
