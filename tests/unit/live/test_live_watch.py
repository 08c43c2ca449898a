"""Changes of files, by every way in which editors save."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from emsim.live import watch
from emsim.live.watch import Watch


@pytest.fixture(autouse=True)
def gap(monkeypatch: pytest.MonkeyPatch):
    """What is gone or empty is waited for until a test says that the time is over."""
    monkeypatch.setattr(watch, "GAP", 1e9)


def test_saving_over_the_file(tmp_path: Path):
    deck = tmp_path / "d.cir"
    deck.write_text("one\n")
    w = Watch([str(deck)])
    assert not w.changed()
    deck.write_text("other\n")
    assert w.changed()
    assert not w.changed()


def test_saving_by_rename(tmp_path: Path):
    deck, fresh = tmp_path / "d.cir", tmp_path / ".d.cir.swp"
    deck.write_text("one\n")
    w = Watch([str(deck)])
    fresh.write_text("two\n")
    fresh.rename(deck)
    assert w.changed()
    assert not w.changed()


def test_the_same_time_and_size_in_another_file(tmp_path: Path):
    deck, fresh = tmp_path / "d.cir", tmp_path / "e.cir"
    for path in (deck, fresh):
        path.write_text("one\n")
        os.utime(path, (1e9, 1e9))
    w = Watch([str(deck)])
    fresh.rename(deck)
    assert w.changed()


def test_through_a_link(tmp_path: Path):
    one, two, deck = tmp_path / "one", tmp_path / "two", tmp_path / "d.cir"
    one.write_text("one\n")
    two.write_text("other\n")
    deck.symlink_to(one)
    w = Watch([str(deck)])
    deck.unlink()
    deck.symlink_to(two)
    assert w.changed()


@pytest.mark.parametrize("empty", [True, False])
def test_empty_or_gone_for_a_moment(tmp_path: Path, empty: bool, monkeypatch: pytest.MonkeyPatch):
    deck = tmp_path / "d.cir"
    deck.write_text("one\n")
    w = Watch([str(deck)])
    deck.write_text("") if empty else deck.unlink()
    assert not w.changed()
    deck.write_text("two\n")
    assert w.changed()
    assert not w.changed()
    # and for longer
    deck.write_text("") if empty else deck.unlink()
    assert not w.changed()
    monkeypatch.setattr(watch, "GAP", 0.0)
    assert w.changed()
    assert not w.changed()
    deck.write_text("three\n")
    assert w.changed()


def test_a_file_that_is_to_come(tmp_path: Path):
    part = tmp_path / "part.lib"
    w = Watch([str(part)])
    assert not w.changed()
    part.write_text("R1 a 0 1\n")
    assert w.changed()


def test_following_others(tmp_path: Path):
    deck, old, young = tmp_path / "d.cir", tmp_path / "old.lib", tmp_path / "young.lib"
    for path in (deck, old, young):
        path.write_text("x\n")
    os.utime(old, (1e9, 1e9))
    w = Watch([str(deck)])
    # what was written after the run began may not be what the run read
    w.follow([str(deck), str(old)], time.time_ns() - 10**12)
    assert not w.changed()
    w.follow([str(deck), str(old), str(young)], time.time_ns() - 10**12)
    assert w.changed()
    assert not w.changed()
    w.follow([str(deck)], time.time_ns())
    old.write_text("changed\n")
    assert not w.changed()
    assert w.paths == [str(deck)]
