"""Pictures of frequency results: in the terminal, from files of other simulators, of several analyses."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import emsim
from emsim.build import parse_signals
from emsim.diagnostics import DeckError
from emsim.outputs import load, panels, picture, terminal
from emsim.store import Columns
from emsim.table import Table

DECK = """t
V1 in 0 dc 1 ac 1
R1 in out 1k
C1 out 0 1u
.ac dec 20 1 100k
.noise v(out) V1 dec 10 1 100k
.end
"""


def test_the_terminal_marks_decades_where_they_are() -> None:
    """The curve was drawn over a logarithm and the marks below it by equal distances: 20, 40, 60 .. kHz."""
    f = np.logspace(0, 4, 81)
    table = Table("ac", ["frequency", "y"], ["Hz", "V"], Columns([f.tobytes(), f.tobytes()]))
    shown = list(
        terminal.lines(
            panels.panels(table, ["y"]), look=terminal.Look(columns=70, colour=False, braille=False)
        )
    )
    marks, axis = shown[-2], shown[-3]
    found = [(marks.index(" " + text) + 1, text) for text in ("1", "10", "100", "1k", "10k")]
    places = [k for k, c in enumerate(axis) if c == axis[-1] or c == "+"]
    assert [text for _, text in found] == marks.split()
    steps = np.diff([k + (len(text) - 1) / 2 for k, text in found])
    assert np.ptp(steps[:-1]) <= 2 and places


def test_signals_come_from_the_analysis_that_has_them() -> None:
    """Of a deck with .ac and .noise the first could not be drawn."""
    result = emsim.run(DECK)
    found = [
        panels.of_result(result, parse_signals(text))
        for text in ("v(out)", "onoise_spectrum", "im(v(out)) vs re(v(out))")
    ]
    assert [[p.unit for p in one] for one in found] == [["dB", "deg"], ["V/sqrt(Hz)"], ["V"]]
    figure = picture.picture([p for one in found for p in one])
    assert [axis.get_xscale() for axis in figure.axes] == ["log", "log", "log", "linear"]
    assert figure.axes[2].get_yscale() == "log"
    with pytest.raises(DeckError, match="no column `v\\(nowhere\\)`"):
        panels.of_result(result, parse_signals("v(nowhere)"))


def test_panels_over_other_ranges_have_an_axis_each() -> None:
    """The upper one was read on the lower one's axis."""
    narrow, wide = (
        Table("ac", ["frequency", "y"], ["Hz", "V"], Columns([f.tobytes(), f.tobytes()]))
        for f in (np.logspace(3, 6, 50), np.logspace(3, 7, 50))
    )
    found = [p for table in (narrow, wide) for p in panels.panels(table, ["y"])]
    look = terminal.Look(columns=70, colour=False, braille=False)
    assert sum("frequency [Hz]" in line for line in terminal.lines(found, look=look)) == 2
    assert sum("frequency [Hz]" in line for line in terminal.lines([found[0]] * 2, look=look)) == 1


def test_what_an_analysis_alone_has_is_drawn_by_a_run(tmp_path: Path) -> None:
    deck = tmp_path / "a.cir"
    deck.write_text(DECK)
    command = [sys.executable, "-m", "emsim", str(deck), "--no-files", "--plot"]
    said = [
        subprocess.run([*command, name], capture_output=True, text=True, check=False)
        for name in ("onoise_spectrum", "nowhere")
    ]
    assert [done.returncode for done in said] == [0, 1]
    assert "onoise_spectrum" in said[0].stdout and "E352" in said[1].stderr


def test_a_complex_signal_is_no_x_axis_by_name() -> None:
    result = emsim.run(DECK)
    with pytest.raises(DeckError, match="complex, and no x axis"):
        panels.of_result(result, parse_signals("im(v(out)) vs v(out)"))


def test_parts_of_complex_signals_come_back_real_from_a_raw_file(tmp_path: Path) -> None:
    """im(v(out)) vs re(v(out)) of a file was an internal error: both came back as complex."""
    deck, raw = tmp_path / "a.cir", tmp_path / "a.raw"
    deck.write_text(
        DECK.replace(".noise v(out) V1 dec 10 1 100k\n", ".print ac re(v(out)) im(v(out)) v(out)\n")
    )
    emsim.run(str(deck)).save(str(raw))
    table = load(str(raw)).main
    assert (
        not table.is_complex("re(v(out))")
        and not table.is_complex("im(v(out))")
        and table.is_complex("v(out)")
    )
    assert len(panels.panels(table, ["im(v(out)) vs re(v(out))"])) == 1
