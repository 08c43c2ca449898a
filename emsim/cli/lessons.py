"""usage: emsim lessons [options] [FOLDER]

Copies the lessons, decks and the pages of text beside them, into a folder (otherwise emsim-lessons) and opens the page of the
first one's run. Files that exist are left alone. `emsim new -t 04_motor NAME` writes one of their decks by itself."""

from __future__ import annotations

import sys
from os import listdir, makedirs
from os.path import abspath, dirname, isdir, join

from ..diagnostics import Diagnostic, OutsideError
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK, check_folder

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [Option("--no-open", "copy them, open nothing"), QUIET, HELP]
PACKAGE = dirname(dirname(abspath(__file__)))


def folder() -> str:
    """Where the lessons lie: in the source tree, or inside an installed package. OutsideError where they are missing."""
    for found in (join(dirname(PACKAGE), "netlists", "lessons"), join(PACKAGE, "lessons")):
        if isdir(found):
            return found
    hint = "install it again: pip install --force-reinstall emsim"
    raise OutsideError(Diagnostic("error", "E505", "the lessons are missing from this emsim", None, hint))


def names() -> list[str]:
    """The decks without their ending, in order; none where the lessons are missing."""
    try:
        return sorted(name.removesuffix(".cir") for name in listdir(folder()) if name.endswith(".cir"))
    except OutsideError:
        return []


def text_of(name: str) -> str:
    """A lesson's file as it is beside the reader's decks, not in the source tree."""
    with open(join(folder(), name), encoding="utf-8") as file:
        return file.read().replace("netlists/lessons/", "")


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if len(given.words) > 1:
        raise UsageError("emsim lessons takes one folder: emsim lessons learning")
    target = given.words[0] if given.words else "emsim-lessons"
    files = sorted(name for name in listdir(folder()) if name.endswith((".cir", ".md")))
    if not isdir(target):
        check_folder(target)
    makedirs(target, exist_ok=True)
    kept = []
    for name in files:
        try:
            with open(join(target, name), "x", encoding="utf-8") as file:
                file.write(text_of(name))
        except FileExistsError:
            kept.append(name)
    if not given.has("quiet"):
        print(f"{target}: {len(files) - len(kept)} files, README.md says what each lesson teaches")
        for name in names():
            title = text_of(f"{name}.cir").partition("\n")[0]
            print(f"  emsim view {join(target, name)}.cir    {title}")
        if kept:
            print(f"left alone, because they were there: {', '.join(kept)}", file=sys.stderr)
    if given.has("no-open"):
        return OK
    from .view import main as view

    return view([join(target, f"{names()[0]}.cir"), "-q"])
