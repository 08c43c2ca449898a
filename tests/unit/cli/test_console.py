"""Engineering numbers, JSON without infinities, the progress line, files that are not written over."""

from __future__ import annotations

import io
import json
import os

import pytest

from emsim.cli import console, main
from emsim.diagnostics import Diagnostic


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0123, "12.3m"),
        (40e-6, "40u"),
        (3100, "3.1k"),
        (0, "0"),
        (2.5e9, "2.5G"),
        (-5e-9, "-5n"),
        (1e-14, "0.01p"),
    ],
)
def test_engineering(value, text):
    assert console.engineering(value) == text


def test_json_document_is_strict(capsys):
    console.print_json(
        3, [Diagnostic("error", "E410", "stopped")], statistics={"x": float("inf"), "y": [float("nan"), 1.5]}
    )
    document = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert document["status"] == "no convergence" and document["exit_code"] == 3
    assert document["statistics"] == {"x": None, "y": [None, 1.5]}
    assert document["diagnostics"][0]["code"] == "E410"


def test_progress_line_waits_a_second_and_is_wiped(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(console, "monotonic", lambda: now[0])
    progress = console.Progress()
    progress.stream = io.StringIO()
    now[0] += 0.9
    progress(1e-3, 20e-3, 40e-6, 100, 0)
    assert progress.stream.getvalue() == ""
    now[0] += 0.6
    progress(12.3e-3, 20e-3, 40e-6, 3100, 7)
    assert "t=12.3ms/20ms  step 40us  3.1k steps  ETA 1s  events 7" in progress.stream.getvalue()
    progress.clear()
    assert (
        progress.stream.getvalue().endswith("\r")
        and progress.stream.getvalue().rsplit("\r", 2)[1].strip() == ""
    )


def test_quiet_leaves_notes_out(capsys):
    console.show([Diagnostic("note", "N1", "a note"), Diagnostic("warning", "W1", "a warning")], quiet=True)
    said = capsys.readouterr().err
    assert "a warning" in said and "a note" not in said


DECK = "spins\nBODY b m=1 j=1m\nJOINT p 0 b pin ic=(0,1)\n.tran 1m 10m\n.end\n"


@pytest.mark.parametrize(
    "args",
    [
        ["run", "--csv"],
        ["view", "--no-open", "-o"],
        ["analogue", "-o"],
        ["chart", "--alone", "--methods", "radau", "--csv"],
    ],
)
@pytest.mark.parametrize("name", ["d.cir", "./d.cir", "link.cir", "hard.cir"])
def test_no_verb_writes_over_its_deck(args, name, scratch, capsys):
    deck = scratch / "d.cir"
    deck.write_text(DECK)
    os.symlink("d.cir", scratch / "link.cir")
    os.link(deck, scratch / "hard.cir")
    assert main([*args, name, "d.cir"]) == 2
    assert f"{name} is the deck" in capsys.readouterr().err and deck.read_text() == DECK


def test_the_same_device_may_be_written_twice(scratch):
    console.check_targets([os.devnull, os.devnull])
