"""What editors and `emsim help` say of .meas, .step, .four and of the functions of results."""

import pytest

from emsim.cli import main
from emsim.editor.complete import complete
from emsim.editor.document import Document
from emsim.editor.hover import hover
from emsim.measures import KINDS

DECK = (
    "t\nV1 in 0 PULSE(0 1 0 1n 1n 1 2)\nR1 in out {r}\nC1 out 0 1n\n.tran 10n 10u\n.step param r list 1k 2k\n"
    ".meas tran late trig v(in) val=0.5 rise=1 targ v(out) val=0.5 rise=1\n.print tran rms(v(out))\n.end\n"
)
ROW = 6


def at(text: str, row: int = ROW) -> int:
    return DECK.splitlines()[row].index(text) + 1


@pytest.mark.parametrize(
    ("word", "said"), [("trig", "from one event to another"), ("targ", "where it ends"), ("rise", "which crossing")]
)  # fmt: skip
def test_words_of_a_measurement_are_explained_where_they_stand(word, said):
    assert said in str(hover(Document(DECK), ROW, at(word)))


def test_cards_and_functions_are_explained():
    document = Document(DECK)
    assert "runs the deck once for each value" in str(hover(document, 5, 2))
    assert "a number made of results" in str(hover(document, ROW, 2))
    assert "root of the mean square" in str(hover(document, 7, at("rms", 7)))


def test_words_and_signals_are_offered():
    labels = {item.label for item in complete(Document(DECK), ROW, at("targ") - 1)}
    assert {kind.words[0] for kind in KINDS} | {"targ", "rise", "from", "v", "db", "rms"} <= labels
    assert {".meas", ".step", ".four"} <= {item.label for item in complete(Document(DECK), 7, 0)}


@pytest.mark.parametrize("word", [".meas", ".step", ".four", "rms", "db"])
def test_help_has_them(word, capsys):
    assert main(["help", word]) == 0
    said = capsys.readouterr().out
    assert word in said
    if word == ".meas":
        assert all(kind.meaning in said for kind in KINDS)
