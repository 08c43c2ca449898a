"""The table of drawings that were looked at (judged.md) is about the decks that there are, and few of them are poor."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3] / "netlists"
ROW = re.compile(r"^\| (\S+) \| (\w*) \| (\w*) \| (.*?) ?\|$", re.M)
WORDS = ("textbook", "readable", "poor")


@pytest.fixture(scope="module")
def rows() -> list[tuple[str, str, str, str]]:
    text = (Path(__file__).parent / "judged.md").read_text()
    return [row for row in ROW.findall(text) if row[0] != "deck"]


def test_every_row_is_a_deck_and_most_decks_have_one(rows):
    names = [name for name, *_ in rows]
    there = {str(p.relative_to(ROOT).with_suffix("")) for p in ROOT.rglob("*.cir")}
    assert set(names) <= there and len(names) == len(set(names))
    # what is new has yet to be looked at
    assert len(there) - len(names) < 0.1 * len(there), sorted(there - set(names))


def test_every_deck_of_a_machine_was_looked_at(rows):
    """Those that a sheet shows: with a run over time or a sweep."""
    judged = {name for name, _, machine, _ in rows if machine}
    for path in ROOT.rglob("*.cir"):
        text = path.read_text()
        if re.search(r"^BODY\s", text, re.M | re.I) and re.search(r"^\.(tran|dc)\s", text, re.M | re.I):
            assert str(path.relative_to(ROOT).with_suffix("")) in judged


def test_three_machines_in_a_hundred_are_poor_at_most(rows):
    judged = [machine for _, _, machine, _ in rows if machine]
    assert judged.count("poor") <= 0.03 * len(judged)


@pytest.mark.parametrize("column", [1, 2], ids=["circuits", "machines"])
def test_one_in_twenty_is_poor_at_most(rows, column):
    judged = [row[column] for row in rows if row[column]]
    assert set(judged) <= set(WORDS) and len(judged) > 100
    assert judged.count("poor") <= 0.05 * len(judged)
    assert judged.count("textbook") > 0.7 * len(judged)


def test_what_is_not_textbook_has_its_reason(rows):
    for name, circuit, machine, why in rows:
        assert bool(why) == ({circuit, machine} - {"", "textbook"} != set()), name
