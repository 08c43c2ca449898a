"""vacask.py: its decks are read and run, and its measures tell what is the same from what is not."""

from __future__ import annotations

import re

import numpy as np
import pytest
import vacask

import emsim

SHORT = {"rc": ".tran 1u 5m 0 1u", "graetz": ".tran 10u 30m 0 10u", "mul": ".tran 10n 50u 0 10n"}


@pytest.mark.parametrize("name", SHORT)
def test_a_deck_as_it_is_asked_is_as_near_as_a_free_one(tmp_path, name):
    output, _, text = vacask.decks()[name]
    text = re.sub(r"(?m)^\.tran.*$", SHORT[name], text)
    found = []
    for deck, reltol in ((text, 1e-3), (vacask.free(text), 1e-3), (vacask.free(text), 1e-7)):
        emsim.run(deck, reltol=reltol).save(tmp_path / "a.raw")
        found.append(vacask.course(tmp_path / "a.raw", output))
    asked, free, tight = found
    assert vacask.off(tight, tight) == 0.0
    assert 0.0 < vacask.off(asked, tight) < 1e-3 and vacask.off(free, tight) < 1e-3


def test_the_multiplier_has_all_its_terminals(tmp_path):
    text = vacask.written(vacask.decks()["c6288"][2], str(tmp_path))
    assert "{" not in text and len(re.findall(r"(?m)^V[ab]\d+ ", text)) == 2 * vacask.BITS
    line = next(line for line in text.splitlines() if line.startswith("X1 "))
    assert len(line.split()) == 2 + 4 * vacask.BITS


def test_edges_are_where_half_of_the_supply_is_passed():
    t = np.linspace(0.0, 1.0, 1001)
    at = vacask.edges(t, vacask.HALF * (1 + np.cos(20 * np.pi * t)))
    np.testing.assert_allclose(at, np.arange(0.025, 1.0, 0.05), atol=1e-6)


def test_the_table_says_what_took_no_part():
    lines = vacask.table({"rc": {"ngspice": [1.5, 1000, 2e-4]}})
    assert lines[-1] == "| rc | - | - | 1.5 s, 1000 points, 2.0e-04 | - |"
