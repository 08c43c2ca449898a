"""`emsim lessons`: copied beside the reader, each a deck that runs and a template of `emsim new`."""

from __future__ import annotations

from pathlib import Path

import pytest

from emsim.cli import lessons, main


def test_they_are_copied_and_run_where_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["lessons", "--no-open"]) == 0
    said = capsys.readouterr().out
    decks = sorted(Path("emsim-lessons").glob("*.cir"))
    assert len(decks) == 14 and all(str(deck) in said for deck in decks)
    pages = sorted(Path("emsim-lessons").glob("[0-9]*.md"))
    assert [page.stem for page in pages] == [deck.stem for deck in decks]
    # their commands are for the place where they lie
    text = "".join(page.read_text() for page in Path("emsim-lessons").glob("*.md"))
    assert "netlists/lessons" not in text and "emsim 04_motor.cir" in text
    assert main(["emsim-lessons/01_rc.cir", "-q", "--no-files"]) == 0
    # what the reader has changed stays
    decks[0].write_text("mine\n")
    assert main(["lessons", "--no-open"]) == 0
    assert decks[0].read_text() == "mine\n" and "01_rc.cir" in capsys.readouterr().err


def test_the_first_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.chdir(tmp_path)
    assert main(["lessons", "here", "-q"]) == 0
    assert len(opened) == 1 and opened[0].endswith("01_rc.html")


@pytest.mark.parametrize("name", lessons.names())
def test_each_is_a_template(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "-q", "-t", name, "mine"]) == 0
    text = Path("mine.cir").read_text()
    assert text.startswith("mine: Lesson") and text.rstrip().endswith(".end")
    assert main(["check", "-q", "mine.cir"]) == 0


def test_two_folders_are_one_too_many(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["lessons", "a", "b"]) == 2
