"""ngspice as a program: `ngspice -b -r out.raw deck`, in a directory of its own.

The deck goes in as the user wrote it. Only what would not survive the move is changed: relative paths of
.include and .lib become absolute, and a .control section, which emsim does not run either, is left out
(its tran and op lines become dot cards where the deck has no others). The tight run adds its options at
the end of the deck, where they win, and replaces the .tran card by one with a small TMAX.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator

from ..diagnostics import Diagnostic, OutsideError
from ..outputs import raw
from ..result import Result, Table

INSTALL = "Debian, Ubuntu: apt install ngspice; macOS: brew install ngspice; Windows: https://ngspice.sourceforge.io"
ANALYSES = (".tran", ".op", ".dc", ".ac", ".noise", ".tf", ".pz", ".sens", ".disto", ".pss", ".sp")


class NgspiceError(Exception):
    """ngspice ran and gave no result; the text is its own last words."""


def find() -> str:
    """Path of the program. OutsideError E510 when there is none."""
    path = shutil.which("ngspice")
    if path is None:
        raise OutsideError(Diagnostic("error", "E510", "ngspice is not installed", None, INSTALL))
    return path


def version() -> str:
    """The program's version as it prints it, e.g. "39"; "" if it does not say."""
    asked = [find(), "--version"]
    said = subprocess.run(asked, capture_output=True, text=True, stdin=subprocess.DEVNULL).stdout
    found = re.search(r"ngspice-(\S+)", said)
    return found.group(1) if found else ""


def run(deck: str, timeout: float = 300.0) -> Result:
    """Runs a prepared deck; the tables that are real numbers come back, others are passed over.

    Raises OutsideError without ngspice, NgspiceError when it fails or takes longer than timeout [s]."""
    program = find()
    with tempfile.TemporaryDirectory(prefix="emsim-ngspice-") as folder:
        source, target = os.path.join(folder, "deck.cir"), os.path.join(folder, "out.raw")
        with open(source, "w", encoding="utf-8") as file:
            file.write(deck)
        try:
            done = subprocess.run(
                [program, "-b", "-r", target, source],
                cwd=folder, stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise NgspiceError(f"not done after {timeout:g} s") from None
        log = (done.stdout + b"\n" + done.stderr).decode("utf-8", "replace")
        if done.returncode or not os.path.exists(target):
            raise NgspiceError(last_words(log))
        return named_alike(raw.read(target))


def last_words(log: str) -> str:
    """The lines of ngspice's output that say what is wrong, or else its last line."""
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    trouble = re.compile(r"error|too small|singular|can't|unknown|fail", re.I)
    telling = [line for line in lines if trouble.search(line)]
    return "; ".join(dict.fromkeys(telling[:3] or lines[-1:])) or "no output"


def named_alike(result: Result) -> Result:
    """ngspice's names as emsim spells them: the current of x1.v1 is `i(v.x1.v1)` there, `i(x1.v1)` here."""
    plots = []
    for table in result.plots:
        names = [re.sub(r"^i\([a-z]\.(.*)\)$", r"i(\1)", name) for name in table.names]
        renamed = Table(table.kind, names, table.units, table.waves, title=table.title, axis=table.axis)
        renamed.plotname = table.plotname
        plots.append(renamed)
    return Result(result.title, plots)


def as_written(text: str, folder: str) -> str:
    """The deck for a run as the user wrote it; `folder` is where its relative paths start."""
    return _rebuild(text, folder, None, [])


def tightened(
    text: str, folder: str, grid: tuple[float, float, float] | None, tmax: float, reltol: float
) -> str:
    """The deck for the reference run. grid: (tstep, tstart, tstop) [s] of its .tran, None without one."""
    small = reltol / 1e-3
    absolute = f"abstol={1e-12 * small:g} vntol={1e-6 * small:g} chgtol={1e-14 * small:g}"
    options = f".options reltol={reltol:g} {absolute} trtol=1 itl4=100"
    return _rebuild(text, folder, grid and (*grid, tmax), [options])


def points_for(text: str) -> int:
    """Points that a reference run must have at least. ngspice finds a switch's threshold only to within some
    steps, so a deck with switches needs short ones whatever reltol is."""
    return 100_000 if re.search(r"(?im)^\s*[sw]\w*\s", text.partition("\n")[2]) else 20_000


def _rebuild(text: str, folder: str, tran: tuple[float, float, float, float] | None, more: list[str]) -> str:
    cards = list(_cards(text))
    title = cards.pop(0)[0] if cards else ""
    outside, control = _split_control(cards)
    if not any(card[0].lower().split()[0] in ANALYSES for card in outside if card[0].strip()):
        outside += [["." + card[0].strip(), *card[1:]] for card in control if _word(card) in ("tran", "op")]
    out = [title]
    for card in outside:
        word = _word(card)
        if word == ".end":
            continue
        if word in (".include", ".inc", ".lib"):
            card = [_absolute(card[0], folder), *card[1:]]
        elif word == ".tran" and tran is not None:
            tstep, tstart, tstop, tmax = tran
            uic = " uic" if "uic" in " ".join(card).lower().split() else ""
            card = [f".tran {tstep!r} {tstop!r} {tstart!r} {tmax!r}{uic}"]
        out += card
    return "\n".join([*out, *more, ".end", ""])


def _cards(text: str) -> Iterator[list[str]]:
    """Physical lines grouped with the `+`, comment and blank lines that follow; the title stands alone."""
    group: list[str] = []
    for number, line in enumerate(text.splitlines()):
        follows = line.lstrip()[:1] in ("+", "*", "")
        if number > 1 and group and follows:
            group.append(line)
            continue
        if group or number == 1:
            yield group
        group = [line]
    if group:
        yield group


def _split_control(cards: list[list[str]]) -> tuple[list[list[str]], list[list[str]]]:
    outside: list[list[str]] = []
    control: list[list[str]] = []
    inside = False
    for card in cards:
        if _word(card) == ".control":
            inside = True
        elif _word(card) == ".endc":
            inside = False
        else:
            (control if inside else outside).append(card)
    return outside, control


def _word(card: list[str]) -> str:
    words = card[0].split(None, 1)
    return words[0].lower() if words else ""


def _absolute(line: str, folder: str) -> str:
    """.include, .inc or .lib with its path made absolute, if a file stands there."""
    found = re.match(r"""(\s*\.\w+\s+)("[^"]*"|'[^']*'|\S+)(.*)""", line)
    if not found:
        return line
    head, path, rest = found.groups()
    full = os.path.abspath(os.path.join(folder, os.path.expanduser(path.strip("\"'"))))
    return f'{head}"{full}"{rest}' if os.path.isfile(full) else line
