"""The page "How to add a card": its files and edits, applied to a copy of the tree, give a card that works."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest
from support import copied_tree
from test_pages import PAGES, blocks

PAGE = PAGES / "internals" / "add_card.md"


def change(text: str, edit: str) -> str:
    """One hunk: lines that begin with a blank stay, `-` goes, `+` comes; it must fit in exactly one place."""
    lines = edit.splitlines(keepends=True)
    old = "".join(line[1:] for line in lines if line[0] in " -")
    new = "".join(line[1:] for line in lines if line[0] in " +")
    assert text.count(old) == 1, f"found {text.count(old)} times:\n{old}"
    return text.replace(old, new)


@pytest.fixture
def copy(tmp_path):
    """The package that is tested, with its compiled engine, in the shape of the tree."""
    return copied_tree(tmp_path)


def test_the_card_of_the_page_works(copy):
    for head, body in blocks(PAGE):
        title = re.search(r'title="([^"]+)"', head)
        if title is None:
            continue
        path = copy / title[1]
        path.parent.mkdir(parents=True, exist_ok=True)
        if head.startswith("diff"):
            body = change(path.read_text(encoding="utf-8"), body)
        path.write_text(body, encoding="utf-8")

    env = {**os.environ, "PYTHONPATH": str(copy), "XDG_CACHE_HOME": str(copy / "cache")}

    def python(*args: object) -> str:
        done = subprocess.run(
            [sys.executable, *map(str, args)], cwd=copy, env=env, capture_output=True, text=True, timeout=300
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    assert python("-c", "import emsim; print(emsim.__file__)").startswith(str(copy))
    assert "4 passed" in python("-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/cards/test_detent.py")
    # what else follows from the spec: a run on the command line, the editor's hover
    assert "torque(d)" in python("-m", "emsim", "netlists/mechanical/detent.cir", "--no-files")
    assert "places that a rotor prefers" in python(
        "-c", "from emsim.editor.hover import card_text; print(card_text('detent'))"
    )


def test_nothing_but_the_card_and_the_list_is_touched():
    titles = [re.search(r'title="([^"]+)"', head) for head, _ in blocks(PAGE)]
    touched = [title[1] for title in titles if title and title[1].startswith(("emsim/", "grammar/"))]
    assert touched == ["emsim/cards/detent.py", "emsim/cards/__init__.py"]


def test_an_edit_that_does_not_fit_is_found():
    assert change("a\nb\nc\n", " a\n+x\n b\n") == "a\nx\nb\nc\n"
    assert change("a\nb\nc\n", "-b\n+B\n") == "a\nB\nc\n"
    with pytest.raises(AssertionError, match="found 0"):
        change("a\nb\n", " a\n+x\n c\n")
