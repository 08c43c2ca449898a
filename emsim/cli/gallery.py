"""usage: emsim gallery [options] -o FOLDER DECK ..

Writes a gallery of decks and of all decks in folders: a moving picture of each, in subjects, and behind it the page of its
run, in which sliders, switches and bodies are moved. The folder is opened in a browser as it is (its index.html), or put on
any web server; nothing is loaded from elsewhere. In a folder of `emsim playground` (-o site/gallery) it links there.

Decks without a result are left out, and told."""

from __future__ import annotations

import os
import sys
from os.path import abspath, isdir, isfile, join
from time import monotonic

from ..diagnostics import Diagnostic, OutsideError
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import OK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..playground.gallery import Made

OPTIONS = [
    Option("-o --output", "the folder to write", "FOLDER"),
    Option("-j --jobs", "processes, instead of one a core", "N"),
    QUIET,
    HELP,
]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    target = given.text("output")
    if target is None or not given.words:
        raise UsageError(
            "emsim gallery takes decks, or folders of them, and a folder to write: emsim gallery -o site netlists"
        )
    jobs = given.whole("jobs", os.cpu_count()) or 1
    if isdir(target) and os.listdir(target) and not isfile(join(target, "gallery.js")):
        said = f"{target} is a folder with other files in it"
        raise OutsideError(Diagnostic("error", "E507", said, None, "choose one that is new or empty"))
    from ..playground import gallery, tile  # noqa: F401

    start, quiet = monotonic(), given.has("quiet")
    found = gallery.decks(given.words)
    if not found:
        raise UsageError("there are no decks in what was given")

    def tell(one: Made) -> None:
        if one.failed and not quiet:
            print(f"left out: {one.name}: {one.failed}", file=sys.stderr)

    made = gallery.build(target, found, jobs, tell)
    there = [one for one in made if not one.failed]
    if not quiet:
        computing = sum(one.computes for one in there)
        print(
            f"gallery: {abspath(join(target, gallery.INDEX))}, {len(there)} decks of which {computing} compute, "
            f"{gallery.size(target) / 1e6:.1f} MB, {monotonic() - start:.0f} s",
            file=sys.stderr,
        )
    return OK
