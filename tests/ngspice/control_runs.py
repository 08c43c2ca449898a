"""A deck with a .control section in both programs: what they print, line by line, and the files that they write."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import emsim

# what ngspice tells of itself
CHATTER = re.compile(
    r"\s*(Note:|Circuit:|Doing analysis|No\. of Data|Initial Transient|Node\s+Voltage|-+\s*$|----|ngspice-|Reset re-loads|"
    r"linearize t|Warning|binary raw|ASCII raw|Reference value|Using |.*%|No compat)"
)
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
DATE = re.compile(r"\s+(Mon|Tue|Wed|Thu|Fri|Sat|Sun) \w{3} .*$")


def deck(body: str, commands: str) -> str:
    return f"a deck\n{body}\n.control\n{commands}\n.endc\n.end\n"


def there(text: str, folder: Path) -> str:
    """What ngspice -b prints."""
    folder.mkdir(exist_ok=True)
    (folder / "deck.cir").write_text(text)
    done = subprocess.run(
        ["ngspice", "-b", "deck.cir"], cwd=folder, capture_output=True, text=True, timeout=60
    )
    return done.stdout


def here(text: str, folder: Path) -> tuple[str, emsim.Result]:
    """What emsim prints."""
    folder.mkdir(exist_ok=True)
    (folder / "deck.cir").write_text(text)
    said = subprocess.run(
        [sys.executable, "-m", "emsim", "--no-files", "-q", "deck.cir"],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
    )
    return said.stdout, said


def lines(text: str) -> list[str]:
    """The lines that say something."""
    found = []
    block = False  # the node voltages of a transient's start
    for line in text.split("\n"):
        line = DATE.sub("", line.rstrip())
        if line.strip() == "Initial Transient Solution":
            block = True
        if block:
            block = not line.startswith("No. of") and not re.match(r"[\w#.]+ = |Index", line)
            if block:
                continue
        if line.strip("\f -") and not CHATTER.match(line):
            found.append(line.strip())
    return found


def same(ours: str, theirs: str, within: float = 1e-3, small: float = 1e-9) -> str | None:
    """None where the lines say the same, numbers within a share; else what differs first."""
    a, b = lines(ours), lines(theirs)
    for k, (x, y) in enumerate(zip(a, b, strict=False)):
        if NUMBER.sub("#", x).split() != NUMBER.sub("#", y).split():
            return f"line {k}: {x!r} beside {y!r}"
        for p, q in zip(NUMBER.findall(x), NUMBER.findall(y), strict=True):
            if abs(float(p) - float(q)) > within * max(abs(float(p)), abs(float(q))) + small:
                return f"line {k}: {p} beside {q} in {x!r}"
    if len(a) != len(b):
        return f"{len(a)} lines beside {len(b)}: {(a + b)[min(len(a), len(b)) :][:3]}"
    return None


def agree(body: str, commands: str, folder: Path, within: float = 1e-3, small: float = 1e-9) -> None:
    text = deck(body, commands)
    theirs = there(text, folder / "ngspice")
    ours, _ = here(text, folder / "emsim")
    told = same(ours, theirs, within, small)
    assert told is None, f"{told}\n--- emsim\n{ours[:3000]}\n--- ngspice\n{theirs[:3000]}"
