"""`emsim help WORD` knows every word of the language, from the tables that the program itself reads."""

from __future__ import annotations

import json

import pytest

from emsim.assemble import options
from emsim.assemble.behaviour import FUNCTIONS
from emsim.assemble.waves import RULES
from emsim.cards import CARDS
from emsim.cards.base import PROBES as CARD_PROBES
from emsim.cli import VERBS, main
from emsim.editor import meanings
from emsim.elements import LETTERS


def told(capsys, *args: str) -> str:
    assert main(list(args)) == 0, args
    return str(capsys.readouterr().out)


def test_every_known_word_is_told(capsys):
    words = meanings.known()
    assert len(words) > 200
    for word in words:
        assert word.lower() in told(capsys, "explain", word).lower(), word


@pytest.mark.parametrize(
    "words",
    [
        list(CARDS),
        [kind.letter for kind in LETTERS.values()],
        [word for word in RULES if word != "dc"],
        list(FUNCTIONS),
        [*options.NUMBERS, *options.TEMPERATURES, "method", "formulation"],
        [*options.METHODS, *options.SPECIAL],
        [*CARD_PROBES],
        [kind for element in LETTERS.values() for kind in element.model_types],
    ],
    ids=["cards", "letters", "waveforms", "functions", "options", "methods", "probes", "models"],
)
def test_what_the_program_reads_is_explained(words):
    assert [word for word in words if not meanings.lines(word)] == []


def test_a_word_of_two_meanings_has_both(capsys):
    said = told(capsys, "help", "sin")
    assert "waveform" in said and "sine, x in radians" in said


@pytest.mark.parametrize("topic", list(meanings.TOPICS))
def test_lists(topic, capsys):
    assert len(told(capsys, "help", topic).splitlines()) > 6


def test_verbs_keep_their_help_and_mistakes_are_suggested(capsys):
    assert "options:" in told(capsys, "help", "plot") and set(VERBS) >= {"plot", "help"}
    for wrong, right in (("SPRNG", "SPRING"), ("reltl", "reltol"), (".tra", ".tran")):
        assert main(["help", wrong]) == 2
        assert f"did you mean {right}?" in capsys.readouterr().err


def test_as_json(capsys):
    assert (
        json.loads(told(capsys, "explain", "omega", "--json"))["lines"][0]
        == "omega(pin) | omega(body)  [rad/s]"
    )
