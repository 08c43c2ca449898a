"""The decks of tests/ngspice/corpus in both programs: every vector of every plot, and every number that is printed."""

from __future__ import annotations

from pathlib import Path

import corpus
import pytest
from support import needs_ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]

FOLDER = Path(__file__).resolve().parent / "corpus"


@pytest.mark.parametrize("path", corpus.decks(FOLDER), ids=lambda p: p.stem)
def test_a_deck_agrees_with_ngspice(path):
    case = corpus.run(path, timed=False)
    assert case.passed, case.line()


def test_a_wrong_value_is_seen(tmp_path):
    """The comparison itself can fail."""
    text = (FOLDER / "op_bridge.cir").read_text()
    (tmp_path / "deck.cir").write_text(text)
    case, right = corpus.Case(tmp_path / "deck.cir"), corpus.emsim.run(text)
    wrong = corpus.emsim.run(text.replace("R4 c 0 1k", "R4 c 0 1.2k"))
    corpus.compare(case, wrong.plots, right.plots)
    assert case.deviation > 0.01
    corpus.compare(case := corpus.Case(case.path), right.plots, right.plots)
    assert case.deviation == 0 and case.compared > 0
