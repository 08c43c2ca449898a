"""What the pages of the site say is true: decks are written, commands typed and Python run in the order of each page, and
what they print is what the page shows.

Of a page of emsim/docs/pages, in an empty folder with the tree's netlists/ in it:

    ```spice title="NAME"   is a file; without a title it is a part of a deck, whose words the parser must know
    ```python               is run, every block of a page in one namespace
    ```console              `$ ` is typed, and what follows is what it prints: numbers within a percent, times, counts of
                            points and the methods of auto freely; `...` stands for any text, on a line of its own for any lines
    ```sh                   is not run: long, or for other machines; its verbs, options and files must exist

A command may fail only where the page goes on with `$ echo $?`.
"""

from __future__ import annotations

import os
import re
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

from emsim.assemble import options
from emsim.cli import VERBS, console
from emsim.editor import words

PAGES = ROOT / "emsim" / "docs" / "pages"
FENCE = re.compile(r"^(?P<indent> *)```+(?P<head>[^\n`]*)\n(?P<body>.*?)^(?P=indent)```+$", re.M | re.S)
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w]*\.\w)", re.I)
FREELY = [
    (r", auto: [^\n]*?(?= ->|\n|$)", ", auto: M"),
    (r"\b\d+ points in [\d.]+ ?[a-z]+", "N points in T"),
    (r"\b\d[\d.]* ?(?:ns|us|ms)\b", "T"),
    (r"(?:[-+.\de]+ J )?unexplained[^\n]*", "unexplained"),
    (r"about [\d.e+]+ (?:steps|seconds|minutes|hours)", "about T"),
]


def pages() -> list[Path]:
    """Those with blocks; add_card.md changes the tree and has a test of its own."""
    found = (path for path in PAGES.rglob("*.md") if "```" in path.read_text(encoding="utf-8"))
    return sorted(path for path in found if path.name != "add_card.md")


def blocks(path: Path) -> list[tuple[str, str]]:
    """(what stands behind the fence, text) of every block."""
    found = []
    for match in FENCE.finditer(path.read_text(encoding="utf-8")):
        indent = len(match["indent"])
        body = "".join(
            line[indent:] if line.strip() else line for line in match["body"].splitlines(keepends=True)
        )
        found.append((match["head"].strip(), body))
    return found


@pytest.fixture
def folder(scratch, monkeypatch):
    (scratch / "netlists").symlink_to(ROOT / "netlists")
    programs = scratch / ".programs"
    programs.mkdir()
    (programs / "emsim").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m emsim "$@"\n')
    (programs / "emsim").chmod(0o755)
    monkeypatch.setenv("PATH", f"{programs}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("BROWSER", "true")  # a page is opened by the program of this name
    monkeypatch.setenv("MPLBACKEND", "agg")
    return scratch


@pytest.mark.parametrize("path", pages(), ids=lambda p: p.relative_to(PAGES).as_posix())
def test_page(path, folder):
    if "$ emsim compare" in path.read_text(encoding="utf-8") and shutil.which("ngspice") is None:
        pytest.skip("needs the ngspice program")
    names: dict[str, object] = {}
    for head, body in blocks(path):
        language, *rest = head.split(maxsplit=1)
        title = re.search(r'title="([^"]+)"', rest[0]) if rest else None
        if title:
            (folder / title[1]).write_text(body)
        elif language == "python":
            exec(compile(body, str(path), "exec"), names)
        elif language == "console":
            session(body, folder)
        elif language == "sh":
            for line in body.splitlines():
                known(line)
        else:
            assert language in ("spice", "text", "toml", "json"), (
                f"{path.name}: a block of {language} is not tested"
            )


def session(body: str, folder: Path) -> None:
    """Types every command of a block, compares what it prints."""
    typed = [part for part in re.split(r"^\$ ", body, flags=re.M) if part]
    status = 0
    for k, part in enumerate(typed):
        command, _, shown = part.partition("\n")
        while command.endswith("\\"):
            more, _, shown = shown.partition("\n")
            command += "\n" + more
        done = subprocess.run(
            ["sh", "-c", f"(exit {status}); {command}"], cwd=folder, text=True, timeout=120,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL,
        )  # fmt: skip
        status = done.returncode
        assert status == 0 or (k + 1 < len(typed) and typed[k + 1].startswith("echo $?")), done.stdout
        problem = differs(shown, done.stdout)
        assert problem is None, f"$ {command}\n{problem}\n--- printed:\n{done.stdout}"


def differs(shown: str, printed: str) -> str | None:
    """Where the text of the page and what was printed part, or None."""
    got = [line for line in freely(printed).splitlines() if line.strip()]
    at, skip = 0, False
    for line in freely(shown).splitlines():
        if not line.strip():
            continue
        if line.strip() == "...":
            skip = True
            continue
        while skip and at < len(got) and not alike(line, got[at]):
            at += 1
        if at == len(got) or not alike(line, got[at]):
            return f"the page has {line!r}, printed is {got[at] if at < len(got) else 'nothing more'!r}"
        at, skip = at + 1, False
    return None if skip or at == len(got) else f"the page does not have {got[at]!r}"


def freely(text: str) -> str:
    for pattern, free in FREELY:
        text = re.sub(pattern, free, text)
    return text


def alike(shown: str, printed: str) -> bool:
    """Words the same, blanks any, numbers within a percent; those below 1e-6 both count as nothing."""
    words, numbers = NUMBER.sub("#", shown).split(), [float(x) for x in NUMBER.findall(shown)]
    pattern = "".join(
        r"[\s\S]*" if part == "..." else re.escape(part) for part in re.split(r"(\.\.\.)", " ".join(words))
    )
    if not re.fullmatch(pattern, " ".join(NUMBER.sub("#", printed).split())):
        return False
    if "..." in shown:
        return True
    got = [float(x) for x in NUMBER.findall(printed)]
    return all(abs(a - b) <= max(0.01 * abs(a), 1e-6) for a, b in zip(numbers, got, strict=True))


def known(line: str) -> None:
    """A command that is not run: its verb, its options and the files of the tree that it names exist."""
    from importlib import import_module

    for path in re.findall(r"\b(?:tests|netlists|emsim)/[\w/.]+", line):
        assert (ROOT / path).exists(), f"{line}: no {path}"
    found = re.match(r"(?:\S*/)?emsim (\S+)(.*)", line)
    if found is None:
        return
    verb = found[1] if found[1] in VERBS else "run"
    options = {
        name for option in getattr(import_module(f"emsim.cli.{verb}"), "OPTIONS", ()) for name in option.names
    }
    for option in re.findall(r"(?<=\s)(--?[a-zA-Z][\w-]*)", " " + found[0].partition("#")[0]):
        assert option in options, f"{line}: emsim {verb} has no {option}"


def test_inline_commands_exist():
    for path in PAGES.rglob("*.md"):
        text = FENCE.sub("", path.read_text(encoding="utf-8"))
        for command in re.findall(r"`((?:python tests/|emsim )[^`]+)`", text):
            known(command)


def test_a_page_that_is_wrong_is_found():
    assert differs("a 1.00 b\n...\nend\n", "a 1.001 b\nx\ny\nend\n") is None
    assert differs("a 1.00 b\n", "a 1.02 b\n") is not None
    assert differs("a\n", "a\nb\n") is not None
    assert differs("a\nb\n", "a\n") is not None
    assert differs("x ... z\n", "x any 3 z\n") is None
    assert differs("error[E100]: no\n", "error[E101]: no\n") is not None
    assert differs("12 points in 3ms\n", "99 points in 1.2s\n") is None
    with pytest.raises(AssertionError):
        known("emsim deck.cir --no-such")
    with pytest.raises(AssertionError):
        known("python tests/bench/none.py")


def first_cells(name: str, heading: str = "") -> list[str]:
    """Words in code of the first column of a page's tables, behind a heading."""
    text = (PAGES / name).read_text(encoding="utf-8").partition(heading)[2] if heading else ""
    text = text or (PAGES / name).read_text(encoding="utf-8")
    cells = re.findall(r"^\| ([^|]*`[^|]*) \|", text, re.M)
    return [word for cell in cells for word in re.findall(r"`([^`]+)`", cell)]


def test_every_method_is_told():
    assert set(first_cells("numerics/index.md", "## The methods")) == {*options.METHODS, *options.SPECIAL}


def test_options_that_pages_name_exist():
    for name, heading in (("guide/tolerances.md", ""), ("guide/ngspice.md", "## Options")):
        found = set(first_cells(name, heading))
        assert len(found) > 8 and found <= {*words.OPTIONS, *options.SILENT}, name


def test_exit_codes_are_the_programs():
    text = (PAGES / "guide" / "messages.md").read_text(encoding="utf-8")
    assert {int(code) for code in re.findall(r"^\| (\d+) \|", text, re.M)} == set(console.STATUS)


# sentences ---------------------------------------------------------------------------------------------------


def sentences(text: str) -> list[list[str]]:
    """The words of each sentence of a page's prose; code and formulas count as one word, tables and headings as none."""
    text = re.sub(r"<!--.*?-->|\$\$.*?\$\$", "", FENCE.sub("", text), flags=re.S)
    indented = re.compile(r"(?:    .*\n?)+")  # formulas as they stand
    paragraphs = (p.strip() for p in re.split(r"\n[ \t]*\n", text) if not indented.fullmatch(p))
    prose = (p for p in paragraphs if not p.startswith(("#", "|", "<", "---")))
    items = (item for p in prose for item in re.split(r"^\s*(?:[-*]|\d+\.)\s+", p, flags=re.M))
    ends = r"(?<=[.!?:])\s+(?=[A-Z`\"*(])"
    found = (re.findall(r"`[^`]*`|\$[^$]*\$|[\w'.-]+", s) for item in items for s in re.split(ends, item))
    return [words for words in found if len(words) > 2]


def test_sentences_of_guide_and_numerics_are_short():
    found = {
        path.name: sentences(path.read_text(encoding="utf-8"))
        for folder in ("guide", "numerics")
        for path in sorted((PAGES / folder).glob("*.md"))
    }
    assert statistics.median(len(s) for page in found.values() for s in page) <= 14
    # a list of what there is may be long: it is of code
    long = {
        name: " ".join(s) for name, page in found.items() for s in page
        if len(s) > 32 and sum(word.startswith("`") for word in s) < 10
    }  # fmt: skip
    assert long == {}
