"""What commands of a deck may write over: results, whoever made them, and what emsim has written itself.

A deck names its files of results, and a run before this one, of emsim or of ngspice, has left them there. Results are told by
their content: raw files, pictures, dumps, text of which most lines hold numbers and none is a card. Of everything else, such as
texts of `echo`, each file that a section writes is remembered by its place, its size and its time, in one file of the user's
state; a file that stands there as it was left is emsim's, one that was changed, copied or made by anybody else is not. Names are
kept as digests. Where the state cannot be kept, nothing is known.
"""

from __future__ import annotations

import os
import sys

MOST = 1_000_000  # bytes of the file; the newer half stays


def store() -> str:
    """The file of the state."""
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or os.path.expanduser("~")
    else:
        base = os.environ.get("XDG_STATE_HOME") or os.path.join(os.path.expanduser("~"), ".local", "state")
    return os.path.join(base, "emsim", "written.txt")


def _place(path: str) -> str:
    from hashlib import sha256

    return sha256(os.path.realpath(path).encode("utf-8", "surrogateescape")).hexdigest()[:32]


def _as_it_is(path: str) -> str:
    found = os.stat(path)
    return f"{found.st_size} {found.st_mtime_ns}"


def remember(path: str) -> None:
    """`path` was written just now."""
    file = store()
    try:
        os.makedirs(os.path.dirname(file), mode=0o700, exist_ok=True)
        if os.path.exists(file) and os.path.getsize(file) > MOST:
            from .beside import replacing

            with open(file, encoding="ascii") as old:
                lines = old.readlines()
            with replacing(file) as new, open(new, "w", encoding="ascii") as out:
                out.writelines(lines[len(lines) // 2 :])
        with open(file, "a", encoding="ascii") as out:
            out.write(f"{_place(path)} {_as_it_is(path)}\n")
    except (OSError, ValueError):
        pass


def holds_results(path: str) -> bool:
    """Is the file at `path` a result of some run by its content, and no deck, no library and no text of somebody's?"""
    import re

    try:
        with open(path, "rb") as file:
            head = file.read(MOST)
    except OSError:
        return False
    if head.startswith((b"\x89PNG", b"%PDF", b"%!PS")) or b"\nPlotname:" in head or b"$timescale" in head:
        return True
    lines = [line for line in head.decode("utf-8", "replace").splitlines() if line.strip()]
    if b"\0" in head or any(re.match(r"\s*\.[A-Za-z]", line) for line in lines):
        return False
    number = r"(?:^|[\s,;]|[^=<>!~]=)[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?(?=$|[\s,;])"
    return b"<svg" in head or 2 * sum(bool(re.search(number, line)) for line in lines) >= len(lines)


def is_ours(path: str) -> bool:
    """Is the file at `path` as emsim has left it?"""
    try:
        with open(store(), encoding="ascii") as file:
            of_it = [line.rstrip("\n") for line in file if line.startswith(_place(path))]
        return bool(of_it) and of_it[-1].partition(" ")[2] == _as_it_is(path)
    except (OSError, ValueError):
        return False
