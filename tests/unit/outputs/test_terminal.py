"""The plot in the terminal, cell by cell."""

from __future__ import annotations

import io

import numpy as np
import pytest

from emsim.outputs.panels import Curve, Panel
from emsim.outputs.terminal import DOTS, Look, lines, raster, ticks


def panel(*ys, x=(0.0, 1.0), unit="V", xunit="s"):
    found = Panel(unit, "time", xunit, False)
    for k, y in enumerate(ys):
        found.curves.append(Curve(f"v({k + 1})", np.array(x, dtype=float), np.array(y, dtype=float)))
    return found


def cells(text):
    """The characters right of the axis, by row from the top."""
    return [line.split(mark, 1)[1] for line in text for mark in "┤┼|+" if mark in line[:12]][:16]


def dots(row):
    """Braille characters as the columns and rows of their dots."""
    return {
        (2 * k + across, down)
        for k, sign in enumerate(row)
        for down in range(4)
        for across in range(2)
        if sign != " " and (ord(sign) - 0x2800) & DOTS[down][across]
    }


def test_a_straight_line_is_a_diagonal_of_dots():
    # 16 rows of 4 dots; the ends lie 3 % of the range inside the frame
    look = Look(columns=6 + 1 + 2 + 20, braille=True)
    text = list(lines([panel([0.0, 1.0])], look=look))
    rows = cells(text)
    assert len(rows) == 16
    set_dots = {(x, 4 * r + y) for r, row in enumerate(rows) for x, y in dots(row)}
    columns = 2 * 20
    expected = set()
    for x in np.linspace(0, 1, 100_001):
        right, down = x * (columns - 1), (1.03 - x) / 1.06 * 63
        expected.add((round(right), round(down)))
    # every dot is within one dot of the line, every column of dots has one
    assert {x for x, _ in set_dots} == set(range(columns))
    assert all(any(abs(x - a) <= 1 and abs(y - b) <= 1 for a, b in expected) for x, y in set_dots)
    assert (0, 61) in set_dots and (columns - 1, 2) in set_dots


def test_ascii_cell_by_cell():
    text = list(lines([panel([0.0, 1.0, 0.0], x=[0.0, 0.5, 1.0])], "triangle", Look(20, braille=False)))
    assert text == [
        "triangle",
        "v(1)  [V]",
        "      1 +     *",
        "        |     *",
        "        |    * *",
        "    0.8 +    * *",
        "        |    * *",
        "        |   *   *",
        "    0.6 +   *   *",
        "        |   *   *",
        "        |  *     *",
        "    0.4 +  *     *",
        "        |  *     *",
        "        | *       *",
        "    0.2 + *       *",
        "        | *       *",
        "        |*         *",
        "      0 +*         *",
        "        ++----+----+",
        "         0   0.5   1",
        "            time [s]",
    ]


def test_several_curves_without_colour_have_letters_with_it_colours():
    two = panel([0.0, 1.0], [1.0, 0.0])
    plain = "\n".join(lines([two], look=Look(60, colour=False)))
    assert "* v(1)  o v(2)" in plain and "\033" not in plain
    assert not any("\u2800" <= c <= "\u28ff" for c in plain)
    painted = "\n".join(lines([two], look=Look(60, colour=True)))
    assert "\033[38;5;32mv(1)\033[0m  \033[38;5;202mv(2)\033[0m" in painted
    assert any("\u2800" < c <= "\u28ff" for c in painted)


def test_no_line_is_wider_than_the_terminal():
    for width in (40, 60, 80, 133):
        text = list(lines([panel([1e-6, 3e-3, -2e-3], x=[0, 0.4, 1])], "t" * 200, Look(width)))
        assert max(map(len, text)) <= width


def test_numbers_stand_in_the_row_of_their_value():
    text = list(lines([panel([0.0, 0.02])], look=Look(80, braille=False)))
    at = {line.split()[0]: k for k, line in enumerate(text) if line[8:9] == "+" and line.split()[0] != "++"}
    assert "v(1)  [mV]" in text[0] and "0" in at and "20" in at
    rows = cells(text)
    assert rows[at["20"] - 1].rstrip().endswith("*") and rows[at["0"] - 1].startswith("*")


def test_panels_over_the_same_axis_write_it_once():
    text = "\n".join(lines([panel([0.0, 1.0]), panel([2.0, 1.0], unit="A")], look=Look(80)))
    assert text.count("time [s]") == 1 and text.index("[A]") < text.index("time [s]")
    other = panel([2.0, 1.0], unit="A")
    other.x = "v(in)"
    assert "\n".join(lines([panel([0.0, 1.0]), other], look=Look(80))).count("time [s]") == 1


def test_a_spike_among_a_million_points_is_seen():
    x = np.linspace(0, 1, 1_000_000)
    y = np.zeros_like(x)
    y[654_321] = 1.0
    found = raster(x, y, (0.0, 1.0), (0.0, 1.0), 100, 40)
    assert found[0].any() and found[:, round(0.654321 * 99)].all()


def test_what_rests_between_two_rows_stays_in_one():
    x = np.linspace(0, 1, 500)
    y = 0.5 + 1e-4 * np.sin(60 * x)  # just on the edge of two of the 10 rows
    assert raster(x, y, (0.0, 1.0), (0.0, 1.0), 50, 10).any(axis=1).sum() == 1


@pytest.mark.parametrize("y", [[3.0, 3.0], [0.0, 0.0], [np.nan, np.nan], [np.nan, 1.0], [1.0, np.inf]])
def test_flat_and_missing_values_are_drawn(y):
    assert len(list(lines([panel(y)], look=Look(60)))) == 20


def test_rounding_is_not_blown_up():
    text = list(lines([panel([629.44072, 629.44076], unit="")], look=Look(60)))
    rows = cells(text)
    assert sum(bool(row.strip()) for row in rows) == 1 and rows.index(next(r for r in rows if r.strip())) in (
        7,
        8,
    )


def test_round_numbers():
    assert ticks(-0.1, 1.1, 5) == [0.0, 0.5, 1.0]
    assert ticks(0, 1.5, 7) == pytest.approx([0, 0.5, 1.0, 1.5])
    assert ticks(-3, 3, 6) == [-3, -2, -1, 0, 1, 2, 3]


class Stream(io.StringIO):
    def __init__(self, tty, encoding):
        super().__init__()
        self.tty, self.coding = tty, encoding

    def isatty(self):
        return self.tty

    @property
    def encoding(self):
        return self.coding


@pytest.mark.parametrize(
    ("tty", "encoding", "environment", "colour", "braille"),
    [
        (True, "utf-8", {}, True, True),
        (False, "utf-8", {}, False, True),
        (True, "utf-8", {"NO_COLOR": "1"}, False, True),
        (True, "utf-8", {"TERM": "dumb"}, False, False),
        (True, "utf-8", {"TERM": "linux"}, True, False),
        (True, "ascii", {}, True, False),
        (True, "latin-1", {}, True, False),
        (True, "utf-8", {"LC_ALL": "C"}, True, False),
        (True, "utf-8", {"LC_ALL": "C", "LANG": "de_DE.UTF-8"}, True, False),
        (True, "utf-8", {"LANG": "de_DE.UTF-8"}, True, True),
    ],
)
def test_what_a_stream_can_show(monkeypatch, tty, encoding, environment, colour, braille):
    for name in ("NO_COLOR", "LC_ALL", "LC_CTYPE", "LANG"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "77")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    look = Look.of(Stream(tty, encoding))
    assert (look.colour, look.braille, look.columns) == (colour, braille, 77)
    assert Look.of(Stream(tty, encoding), 50).columns == 50
