"""ngspice as a program: `ngspice -b -r out.raw deck`, in a directory of its own.

What goes in is written out by spice_deck.py: the user's cards, included ones in their place, and no command. A
.control section is left out (its tran and op lines become dot cards where the deck has no others). The tight run adds
its options at the end of the deck, where they win, and replaces the .tran card by one with a small TMAX. The program
runs in a scratch folder, without the user's environment and start-up files.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
import time

from ..diagnostics import Diagnostic, OutsideError
from ..outcome import Outcome
from ..outputs import raw
from ..result import Result
from ..store import Columns
from ..table import Table
from .child import Child
from .spice_deck import cards, code_models, first_word, flattened, passes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

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


STILL = 3.0  # s: so long the time of a run is watched
NEVER = 1e3  # of the timeout: a run that would take longer at its pace is ended at once


def run(deck: str, timeout: float = 300.0, tstop: float = 0.0) -> Result:
    """Runs a deck that `as_written` or `tightened` made; the tables that are real numbers come back, others are passed over.

    `tstop` [s] where a transient is the only analysis: one that stands still, with steps of nothing, is ended then.
    Raises OutsideError without ngspice, NgspiceError when it fails or takes longer than timeout [s]."""
    program = find()
    inside = list(cards(deck.partition("\n")[2]))
    models = code_models(inside)
    if not all(passes(card, models) or first_word(card) == ".end" for card in inside):
        raise NgspiceError("the deck holds more than a circuit")
    with tempfile.TemporaryDirectory(prefix="emsim-ngspice-") as folder:
        source, target = os.path.join(folder, "deck.cir"), os.path.join(folder, "out.raw")
        with open(source, "w", encoding="utf-8") as file:
            file.write(deck)
        code, log = _run([program, "-n", "-b", "-r", target, source], folder, target, timeout, tstop)
        if code or not os.path.exists(target):
            raise NgspiceError(last_words(log))
        return named_alike(raw.read(target))


def _run(command: list[str], folder: str, target: str, timeout: float, tstop: float) -> tuple[int, str]:
    """Exit code and output of a run. NgspiceError where it takes too long, or is seen to."""
    began = marked = time.monotonic()
    mark = 0.0
    with open(os.path.join(folder, "log.txt"), "w+b") as log:
        with Child(command, folder, surroundings(folder), log) as run:
            while (code := run.wait(STILL if tstop else timeout)) is None:
                now = time.monotonic()
                if now - began >= timeout:
                    raise NgspiceError(f"not done after {timeout:g} s")
                at = _last_time(target)
                if at is not None and (at - mark) * NEVER * timeout < (tstop - at) * (now - marked):
                    raise NgspiceError(f"it stands still at t = {at:g} s")
                mark, marked = at or 0.0, now
        log.seek(0)
        return code, log.read().decode("utf-8", "replace")


def _last_time(path: str) -> float | None:
    """The time of the last whole row of a raw file that is being written."""
    from struct import unpack

    try:
        with open(path, "rb") as file:
            head = file.read(1 << 16)
            begin = head.find(b"Binary:\n") + len(b"Binary:\n")
            columns = re.search(rb"No\. Variables:\s*(\d+)", head)
            size = os.path.getsize(path)
            if begin < len(b"Binary:\n") or columns is None or b"Flags: real" not in head:
                return None
            width = 8 * int(columns[1])
            rows = (size - begin) // width
            if rows < 1:
                return None
            file.seek(begin + (rows - 1) * width)
            (found,) = unpack("<d", file.read(8))
            return float(found)
    except (OSError, ValueError):
        return None


def last_words(log: str) -> str:
    """The lines of ngspice's output that say what is wrong, or else its last line."""
    lines = [line.strip() for line in log.splitlines() if line.strip()]
    trouble = re.compile(r"error|too small|singular|can't|unknown|fail", re.I)
    telling = [line for line in lines if trouble.search(line)]
    return "; ".join(dict.fromkeys(telling[:3] or lines[-1:])) or "no output"


def named_alike(result: Outcome) -> Result:
    """ngspice's names as emsim spells them: the current of x1.v1 is `i(v.x1.v1)` there, `i(x1.v1)` here; so are columns of
    noise, `v(onoise_total_r.x1.r1)`, of what devices say, `i(@q.x1.q1[ic])`, and of poles, `v(pole(1))`, which have another
    order. Without inoise_total and its parts: ngspice integrates them with the slope of the noise at the output."""
    plots = []
    for table in result.plots:
        names = [re.sub(r"^i\([a-z]\.(.*)\)$", r"i(\1)", name) for name in table.names]
        names = [re.sub(r"^[vi]\(@(?:[a-z]\.)?(.*\])\)$", r"@\1", name) for name in names]
        names = [
            re.sub(r"^[vi]\(([oi]noise_.*|(?:pole|zero)\(\d+\)|[SYZ]_\d+_\d+)\)$", r"\1", name)
            for name in names
        ]
        names = [re.sub(r"^([oi]noise_(?:total_)?)[a-z]\.", r"\1", name) for name in names]
        columns = [k for k, name in enumerate(names) if not name.startswith("inoise_total")]
        if any(name.startswith(("pole(", "zero(")) for name in names):
            from ..analyses.pencil import in_order

            for word in ("pole", "zero"):
                own = [k for k in columns if names[k].startswith(word)]
                if own:
                    order = in_order([complex(*(p[0] for p in table.parts(k))) for k in own])
                    for to, k in enumerate(order, 1):
                        names[own[k]] = f"{word}({to})"
            columns.sort(key=lambda k: (names[k][:4], int(names[k][5:-1])))
        store: Any = table.waves
        if columns != list(range(len(names))):
            store = Columns(
                (store.column(k) for k in columns), complex=[table.is_complex(k) for k in columns]
            )
        renamed = Table(
            table.kind, [names[k] for k in columns], [table.units[k] for k in columns], store, title=table.title, axis=table.axis,
        )  # fmt: skip
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


def least_step(text: str) -> float:
    """What a reference run's steps must not be shorter than [s]: ngspice's lines of .model txl and cpl keep their past in whole
    picoseconds, and grow without end where steps are shorter."""
    return 2e-12 if re.search(r"(?im)^\s*[yp]\w*\s", text.partition("\n")[2]) else 0.0


def _rebuild(text: str, folder: str, tran: tuple[float, float, float, float] | None, more: list[str]) -> str:
    title, outside, control = flattened(text, folder)
    if not any(first_word(card) in ANALYSES for card in outside):
        mirrored = [card for card in control if first_word(card) in ("tran", "op")]
        outside += [["." + re.split("[;$`]", " ".join(card))[0].strip()] for card in mirrored]
    out = [title]
    for card in outside:
        if first_word(card) == ".tran" and tran is not None:
            tstep, tstart, tstop, tmax = tran
            uic = " uic" if "uic" in " ".join(card).lower().split() else ""
            card = [f".tran {tstep!r} {tstop!r} {tstart!r} {tmax!r}{uic}"]
        out += card
    return "\n".join([*out, *more, ".end", ""])


def surroundings(folder: str) -> dict[str, str]:
    """The environment of ngspice in its scratch folder: nothing of the user's, in which start-up files and options stand."""
    kept = ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "SYSTEMROOT")
    given = {name: os.environ[name] for name in kept if name in os.environ}
    return {**given, "PATH": os.defpath, "HOME": folder, "TMPDIR": folder, "LANG": "C"}
