"""Malformed and impossible decks: the right exit code, a diagnostic that names line and cause, no traceback, no hang.

The second line of every deck in bad/ says what is expected:

    * expect: exit=1 code=E230 line=4 text=amr

exit may list alternatives (0|1); code, line and text are checked where given: the code among the diagnostics, the
line in the place of an error, the text (case does not matter) anywhere in the diagnostics.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

BAD = Path(__file__).resolve().parent / "bad"
DECKS = sorted(p.stem for p in BAD.glob("*.cir"))
LIMIT = 20.0  # seconds a wrong deck may take before it counts as a hang


@dataclass(frozen=True)
class Expectation:
    exits: tuple[int, ...]
    code: str
    line: int
    text: str


@dataclass(frozen=True)
class Outcome:
    exit: int
    out: str


def expectation(path: Path) -> Expectation:
    head = path.read_text().split("\n", 2)[1]
    found = re.fullmatch(r"\* expect: exit=([\d|]+)(?: code=(\w+))?(?: line=(\d+))?(?: text=(.*))?", head)
    assert found, f"{path.name}: no expectation in `{head}`"
    exits, code, line, text = found.groups()
    return Expectation(tuple(map(int, exits.split("|"))), code or "", int(line or 0), text or "")


def emsim(*args: str, cwd: Path | None = None, stdin: bytes = b"") -> Outcome:
    try:
        done = subprocess.run(
            [sys.executable, "-m", "emsim", *args], cwd=cwd, input=stdin, capture_output=True, timeout=LIMIT
        )
    except subprocess.TimeoutExpired:
        return Outcome(-1, f"hangs: not done after {LIMIT:g} s")
    return Outcome(done.returncode, (done.stdout + done.stderr).decode("utf-8", "replace"))


@cache
def outcomes() -> dict[str, Outcome]:
    """All decks through the command line, two at a time."""
    with ThreadPoolExecutor(2) as pool:
        runs = pool.map(lambda name: emsim("--no-files", str(BAD / f"{name}.cir")), DECKS)
    return dict(zip(DECKS, runs, strict=True))


@pytest.mark.parametrize("name", DECKS)
def test_bad_deck(name):
    want, got = expectation(BAD / f"{name}.cir"), outcomes()[name]
    assert got.exit in want.exits, got.out[-2000:]
    assert "Traceback" not in got.out and "panicked" not in got.out, got.out[-2000:]
    assert len(got.out) < 20_000, "a wall of text"
    if want.exits != (0,) and 0 not in want.exits:
        assert re.search(r"^error\[E\d{3}\]: \S", got.out, re.M), got.out[-2000:]
    if want.code:
        assert f"[{want.code}]" in got.out, got.out[-2000:]
    if want.line:
        places = re.findall(rf"{re.escape(name)}\.cir:(\d+):\d+", got.out)
        assert str(want.line) in places, f"line {want.line} is not among {places}\n{got.out[-2000:]}"
    assert want.text.lower() in got.out.lower(), got.out[-2000:]


# ---- judged: is the message enough? --------------------------------------------------------------

ROW = re.compile(r"^\| (\w+) \| (yes|choice|partly) \| `(.+)` \| (.*)\|$", re.M)
JUDGED = {
    deck: (verdict, mending, why)
    for deck, verdict, mending, why in ROW.findall((BAD / "JUDGEMENT.md").read_text())
}


def mended(name: str) -> str:
    """The deck with the lines that JUDGEMENT.md puts in the place of others."""
    lines = [[line] for line in (BAD / f"{name}.cir").read_text().split("\n")]
    for step in JUDGED[name][1].split(" ;; "):
        at, how, text = re.fullmatch(r"(\d+)([:+-]) ?(.*)", step).groups()
        place = lines[int(at) - 1]
        if how == "+":
            place.append(text)
        else:
            place[:1] = [text] if how == ":" else []
    return "\n".join(line for place in lines for line in place)


def test_every_deck_is_judged():
    assert sorted(JUDGED) == DECKS
    assert all(why.strip() for verdict, _, why in JUDGED.values() if verdict != "yes")


@pytest.mark.parametrize("name", DECKS)
def test_what_the_message_says_mends_the_deck(name):
    """The mending of JUDGEMENT.md leaves no error, and nothing of the code that the deck was blamed for."""
    import emsim as package

    folder = os.getcwd()
    os.chdir(BAD)
    try:
        found = package.run(mended(name)).diagnostics
    finally:
        os.chdir(folder)
    blamed = set(re.findall(r"^(?:error|warning)\[(\w+)\]|^note\[(N283)\]", outcomes()[name].out, re.M))
    assert not {d.code for d in found} & {code for pair in blamed for code in pair if code}, found


def test_there_are_at_least_sixty_five():
    assert len(DECKS) >= 65


JUNK = {
    "binary": bytes(range(256)) * 40,
    "nul_bytes": b"title\nV1 in 0 1\n\x00\x00\x00\x00\nR1 in 0 1k\n.tran 1u 1m\n.end\n",
    "latin1": b"caf\xe9\nV1 in 0 1\nR1 in 0 1k \xe9\xe9=1 (\n.tran 1u 1m\n.end\n",
    "empty": b"",
    "only_a_title": b"just a title\n",
    "only_blank_lines": b"\n" * 1000,
    "megabyte_line": b"title\nR1 in 0 " + b"x" * 1_000_000 + b"\n.tran 1u 1m\n.end\n",
    "html": b"<!DOCTYPE html>\n<html><body>404 not found</body></html>\n",
    "png_head": b"\x89PNG\r\n\x1a\n" + b"\x00\x00\x00\rIHDR" * 50,
    "crlf_without_end": b"t\r\nR1 a 0 1k\r\nR2 a 0\r\n.tran 1u 1m\r\n",
}


@pytest.mark.parametrize("kind", JUNK)
def test_junk_bytes(kind, tmp_path):
    """Whatever bytes a file holds: an error or a note with exit 0 or 1, never a traceback."""
    (tmp_path / "junk.cir").write_bytes(JUNK[kind])
    got = emsim("--no-files", "junk.cir", cwd=tmp_path)
    assert got.exit in (0, 1), got.out[-2000:]
    assert "Traceback" not in got.out and "panicked" not in got.out, got.out[-2000:]
    assert "[E" in got.out or "[N" in got.out or "[W" in got.out, f"says nothing about it: {got.out[:500]!r}"
    assert len(got.out) < 20_000, "a wall of text"


def test_missing_file(tmp_path):
    got = emsim("nowhere.cir", cwd=tmp_path)
    assert got.exit == 5 and "nowhere.cir" in got.out and "Traceback" not in got.out, got


def test_directory_instead_of_a_file(tmp_path):
    got = emsim(str(tmp_path), cwd=tmp_path)
    assert got.exit == 5 and "Traceback" not in got.out, got


def test_deck_from_stdin_is_checked_too(tmp_path):
    got = emsim("--no-files", "-", cwd=tmp_path, stdin=b"t\nV1 in 0 1\nR1 in\n.tran 1u 1m\n.end\n")
    assert got.exit == 1 and ":3:" in got.out and "Traceback" not in got.out, got


def test_all_errors_of_a_deck_are_shown_at_once(tmp_path):
    (tmp_path / "many.cir").write_text(
        "t\nV1 in 0 1\nR1 in\nR2 in 0 {nix}\nD1 in 0 dnix\n.tran 1u 1m\n.end\n"
    )
    got = emsim("--no-files", "many.cir", cwd=tmp_path)
    lines = set(re.findall(r"many\.cir:(\d+):", got.out))
    assert got.exit == 1 and {"3", "4"} <= lines, got.out


def test_at_most_twenty_errors_are_printed(tmp_path):
    body = "\n".join(f"R{k} in" for k in range(100))
    (tmp_path / "hundred.cir").write_text(f"t\nV1 in 0 1\n{body}\n.tran 1u 1m\n.end\n")
    got = emsim("--no-files", "hundred.cir", cwd=tmp_path)
    assert got.exit == 1 and 1 <= len(re.findall(r"^error\[", got.out, re.M)) <= 20, got.out[:3000]
