"""emsim explain: which forms an argument has, what is told of a code."""

from __future__ import annotations

import json

import pytest

from emsim.cli import main


@pytest.mark.parametrize("word", ["E140", "e140"])
def test_a_code_is_told_with_its_deck_message_and_remedy(word, capsys):
    assert main(["explain", word]) == 0
    said = capsys.readouterr().out
    assert said.startswith("E140: ")
    assert "error[E140]: no .model is called `dfats`" in said and "did you mean `dfast`?" in said
    assert "| D1 in out dfast" in said, "the deck mended"


def test_as_json(capsys):
    assert main(["explain", "E140", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["entry"]
    assert (
        told["code"] == "E140" and told["message"].startswith("error[E140]") and "deck.cir" in told["fixed"]
    )


def test_all_codes_are_listed(capsys):
    assert main(["explain", "--list"]) == 0
    assert "  E140     " in capsys.readouterr().out


def test_a_card_word_that_is_misspelt_is_suggested(capsys):
    assert main(["explain", "MTOR"]) == 2
    assert "did you mean MOTOR?" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["E999", "E14", "77", "nothing"])
def test_what_nobody_knows_is_refused(word, capsys):
    assert main(["explain", word]) == 2
    said = capsys.readouterr().err
    assert f"nothing to explain of the name {word}" in said
    assert word != "E14" or "did you mean E140, E141, E143?" in said
