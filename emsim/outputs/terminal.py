"""Panels as text, for a terminal: braille dots, or ASCII where those cannot be shown.

    angle(hinge) [deg]
      40 ┤    ⢀⠔⠊⠉⠒⠤⠤⠤⠤⠤
      20 ┤  ⡠⠊
       0 ┼⠒⠁
         └┬──────┬──────┬─
          0     0.5     1  time [s]

A braille character is a grid of 2 x 4 dots, so one curve has eight times the resolution of characters. Several curves in one
panel are told apart by colour; without colour each is drawn with a letter of its own, a character a point. No library: this
is what there is when none is installed.
"""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np

from ..tabular import prefixed
from .panels import is_flat, off_scale, thinned

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import TextIO

    from .panels import Panel

DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # of a braille character, by row and column
COLOURS = (32, 202, 36, 175, 214, 74, 250)  # of 256, near those of picture.py
MARKS = "*o+x#@%&"
FRAMES = {True: tuple("┤┼└─┬"), False: tuple("|++-+")}


class Look:
    """What the terminal can show: `columns`, colour, and whether it knows braille."""

    __slots__ = ("braille", "colour", "columns")

    def __init__(self, columns: int = 80, colour: bool = False, braille: bool = True) -> None:
        self.columns, self.colour, self.braille = columns, colour, braille

    @staticmethod
    def of(stream: TextIO, columns: int | None = None) -> Look:
        """That of a stream: its width, its encoding, the locale; NO_COLOR is respected."""
        from os import environ
        from shutil import get_terminal_size

        tty, kind = stream.isatty(), environ.get("TERM", "")
        locale = next((v for n in ("LC_ALL", "LC_CTYPE", "LANG") if (v := environ.get(n))), "")
        try:
            "⣿└".encode(stream.encoding or "ascii")
            braille = not locale or "utf" in locale.lower()
        except (UnicodeEncodeError, LookupError):
            braille = False
        return Look(
            columns or get_terminal_size((80, 24)).columns,
            tty and not environ.get("NO_COLOR") and kind != "dumb",
            braille and kind not in ("dumb", "linux"),
        )


def lines(panels: Sequence[Panel], title: str = "", look: Look | None = None) -> Iterator[str]:
    """The panels one under the other."""
    look = look or Look()
    if title:
        yield title[: look.columns]
    rows = {1: 16, 2: 11}.get(len(panels), 8)
    for k, panel in enumerate(panels):
        same = k + 1 < len(panels) and _across(panels[k + 1]) == _across(panel)
        yield from _panel(panel, look, rows, not same)


def _across(panel: Panel) -> tuple[str, bool, tuple[float, float]]:
    """The axis of a panel: those of the same have one scale, written under the last of them."""
    return panel.x, panel.log, _range([c.x for c in panel.curves], 0.0)


def _panel(panel: Panel, look: Look, rows: int, with_axis: bool) -> Iterator[str]:
    low, high = _range([np.array(panel.scale)], 0.03)
    left, right = _range([c.x for c in panel.curves], 0.0)
    factor, unit = prefixed(panel.unit, max(abs(low), abs(high)))
    xfactor, xunit = prefixed(panel.xunit, max(abs(left), abs(right)))
    side, corner, bend, dash, tick = FRAMES[look.braille]

    # numbers at the left, each in the row of its value
    labels = [""] * rows
    marks = [side] * rows
    for value in ticks(low * factor, high * factor, max(2, rows // 2)):
        row = _place(value / factor, high, low, rows)
        labels[row], marks[row] = f"{value:.10g}", corner
    gutter = max(6, *(len(text) for text in labels)) + 1
    columns = max(10, look.columns - gutter - 2)

    yield f"{_heading(panel, unit, look)}  {panel.unseen}".rstrip()
    cells = _cells(panel, look, columns, rows, (left, right), (low, high))
    for label, mark, line in zip(labels, marks, cells, strict=True):
        yield f"{label:>{gutter}} {mark}{line}".rstrip()
    if not with_axis:
        return
    frame, text = [dash] * columns, [" "] * (columns + gutter + 2)
    ends = 0
    if panel.log:
        # powers of ten, each with its own prefix
        exponents = range(math.ceil(math.log10(left) - 1e-9), math.floor(math.log10(right) + 1e-9) + 1)
        places = [(math.log10(left), math.log10(right), float(e), _power(panel.xunit, e)) for e in exponents]
        xunit = panel.xunit
    else:
        found = ticks(left * xfactor, right * xfactor, max(2, columns // 10))
        places = [(left, right, value / xfactor, f"{value:.10g}") for value in found]
    for low_end, high_end, at, label in places:
        column = _place(at, low_end, high_end, columns)
        start = min(gutter + 2 + column - len(label) // 2, len(text) - len(label))
        if start <= ends and ends:
            continue
        frame[column] = tick
        text[start : start + len(label)] = label
        ends = start + len(label)
    yield f"{'':{gutter}} {bend}{''.join(frame)}"
    yield "".join(text).rstrip()
    name = f"{panel.x} [{xunit}]" if xunit else panel.x
    yield name.rjust(gutter + 2 + columns)


def _power(unit: str, exponent: int) -> str:
    """A power of ten as an axis says it: 10k."""
    factor, prefixed_unit = prefixed(unit, 10.0**exponent)
    return f"{10.0**exponent * factor:.10g}{prefixed_unit.removesuffix(unit)}"


def _heading(panel: Panel, unit: str, look: Look) -> str:
    """Names of the curves, as they are drawn, and their unit."""
    names = [c.name for c in panel.curves]
    if look.colour:
        names = [_painted(name, k) for k, name in enumerate(names)]
    elif len(names) > 1:
        names = [f"{MARKS[k % len(MARKS)]} {name}" for k, name in enumerate(names)]
    return "  ".join(names) + (f"  [{unit}]" if unit else "")


def _painted(text: str, curve: int) -> str:
    return f"\033[38;5;{COLOURS[curve % len(COLOURS)]}m{text}\033[0m"


def _cells(
    panel: Panel, look: Look, columns: int, rows: int, across: tuple[float, float], up: tuple[float, float]
) -> list[str]:
    """The characters of every row. Where curves meet, the later one is seen."""
    fine = look.braille and (look.colour or len(panel.curves) == 1)
    wide, tall = (2, 4) if fine else (1, 1)
    shown = np.zeros((rows, columns), dtype=int)  # dots that are set, or 1 + the number of a mark
    owner = np.full((rows, columns), -1)
    for k, curve in enumerate(panel.curves):
        dots = raster(
            curve.x,
            np.where(off_scale(curve.y), np.nan, curve.y),
            across,
            up,
            columns * wide,
            rows * tall,
            panel.log,
        )
        for down, right in np.argwhere(dots):
            row, column = down // tall, right // wide
            if fine:
                shown[row, column] |= DOTS[down % 4][right % 2]
            else:
                shown[row, column] = 1 + k % len(MARKS)
            owner[row, column] = k
    out = []
    for row in range(rows):
        line = ""
        # neighbours of one curve in one piece
        for number, piece in groupby(
            zip(owner[row].tolist(), shown[row].tolist(), strict=True), lambda cell: cell[0]
        ):
            text = "".join(" " if not v else chr(0x2800 + v) if fine else MARKS[v - 1] for _, v in piece)
            line += _painted(text, number) if look.colour and number >= 0 else text
        out.append(line.rstrip())
    return out


def raster(
    x: np.ndarray, y: np.ndarray, across: tuple[float, float], up: tuple[float, float], columns: int, rows: int,
    log: bool = False,
) -> np.ndarray:  # fmt: skip
    """Shape (rows, columns), bool: the dots that straight lines from point to point pass; row 0 is at the top."""
    if log:
        x, across = np.log10(x), (math.log10(across[0]), math.log10(across[1]))
    x, y = thinned(x, y, columns)
    right = (x - across[0]) / (across[1] - across[0]) * (columns - 1)
    down = (up[1] - y) / (up[1] - up[0]) * (rows - 1)
    dots = np.zeros((rows, columns), dtype=bool)
    known = np.isfinite(right) & np.isfinite(down)
    # what rests between two rows stays in one of them
    row = math.inf
    for k, value in enumerate(down.tolist()):
        if not abs(value - row) <= 0.6:
            row = round(value) if known[k] else math.inf
        down[k] = row
    for k in range(len(x)):
        if not known[k]:
            continue
        other = k + 1 if k + 1 < len(x) and known[k + 1] else k
        steps = int(max(abs(right[other] - right[k]), abs(down[other] - down[k])) + 1) + 1
        columns_of = np.rint(np.linspace(right[k], right[other], steps)).astype(int)
        rows_of = np.rint(np.linspace(down[k], down[other], steps)).astype(int)
        dots[np.clip(rows_of, 0, rows - 1), np.clip(columns_of, 0, columns - 1)] = True
    return dots


def ticks(low: float, high: float, most: int) -> list[float]:
    """At most `most` + 1 round numbers from low to high, a step of 1, 2 or 5 apart."""
    rough = (high - low) / most
    ten = 10.0 ** math.floor(math.log10(rough))
    step = next(m * ten for m in (1, 2, 5, 10) if m * ten >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def _place(value: float, first: float, last: float, cells: int) -> int:
    return round((value - first) / (last - first) * (cells - 1))


def _range(columns: Sequence[np.ndarray], margin: float) -> tuple[float, float]:
    """Lowest and highest finite value with a margin; never of no width."""
    kept = [c[np.isfinite(c)] for c in columns]
    kept = [c for c in kept if c.size]
    if not kept:
        return 0.0, 1.0
    low, high = min(float(c.min()) for c in kept), max(float(c.max()) for c in kept)
    if is_flat(low, high):
        pad = abs(high) * 0.1 or 1.0
        return low - pad, high + pad
    return low - margin * (high - low), high + margin * (high - low)
