"""The playground as a folder of files that any web server gives out: nothing in it is computed there, and nothing is loaded from
elsewhere. It takes 10 MB on the way, once: Pyodide (Python for browsers), the engine as its module, emsim's own Python files.

The page opens with the run of its first deck in it and the engine of pages, so that something moves before Python is there.
"""

from __future__ import annotations

import importlib.util
import json
import os
import zipfile
from os.path import abspath, dirname, isdir, join
from shutil import copyfile, copytree

from .. import pipeline
from ..cards import CARDS
from ..diagnostics import Diagnostic, OutsideError
from ..editor.textmate import card_pattern
from ..fmus import page
from ..lark_grammar import grammar_folder
from ..outputs import html

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    Deck = tuple[str, str, str]  # group, name, text

PACKAGE = dirname(dirname(abspath(__file__)))
PARTS = join(dirname(abspath(__file__)), "parts")
SCRIPTS = (*html.SCRIPTS[:-1], "playground.js", html.SCRIPTS[-1])
STYLES = (*html.STYLES, "live.css", "playground.css")
WORKER = "playground-worker.js"
# folders of the package that are of no use in the page
ELSEWHERE = {"engine", "docs", "vscode", "web", "parts", "node_modules", "lessons", "grammar", "__pycache__"}
KINDS = (".py", ".va", ".vams", ".lib", ".md", ".cir", ".txt", ".lark")
STAMP = (1980, 1, 1, 0, 0, 0)  # the same files make the same archive
LICENCES = """emsim: MIT or Apache-2.0.
Pyodide (pyodide/): Mozilla Public License 2.0, its sources: https://github.com/pyodide/pyodide. CPython in it: PSF License 2.
CodeMirror and what it stands on (editor.js): MIT, see the files beside this one.
Lark (in emsim.zip): MIT. uPlot (in index.html): MIT.
"""


def build(target: str, decks: Sequence[Deck]) -> int:
    """Writes the folder; the page opens with the first of `decks`, all are in its menu. Returns its size in bytes.

    OutsideError where parts are missing, OSError as open() raises it."""
    _complete()
    os.makedirs(target, exist_ok=True)
    with open(join(target, "index.html"), "w", encoding="utf-8", newline="\n") as file:
        file.write(_page(decks))
    menu = [{"group": group, "name": name, "text": text} for group, name, text in decks]
    with open(join(target, "decks.json"), "w", encoding="utf-8", newline="\n") as file:
        json.dump(menu, file, separators=(",", ":"))
    copyfile(join(html.WEB, WORKER), join(target, "worker.js"))
    copyfile(join(PARTS, "editor.js"), join(target, "editor.js"))
    for folder in ("pyodide", "licences"):
        copytree(join(PARTS, folder), join(target, folder), dirs_exist_ok=True)
    with open(join(target, "licences", "README.txt"), "w", encoding="utf-8", newline="\n") as file:
        file.write(LICENCES)
    _lock(join(target, "pyodide", "pyodide-lock.json"))
    _archive(join(target, "emsim.zip"))
    return sum(os.path.getsize(join(at, name)) for at, _, names in os.walk(target) for name in names)


def there() -> bool:
    return isdir(join(PARTS, "pyodide")) and page.there()


def _complete() -> None:
    for found, how in (
        (isdir(join(PARTS, "pyodide")), "playground/build.sh"),
        (page.there(), "engine/page.sh"),
    ):
        if not found:
            said, hint = (
                "parts of the playground are missing here",
                f"in a checkout of the sources: emsim/{how}",
            )
            raise OutsideError(Diagnostic("error", "E505", said, None, hint))


def _page(decks: Sequence[Deck]) -> str:
    _, _, text = decks[0]
    source = text + "\n"
    result = pipeline.run(source, scene=True, energy=True)
    run = html.document(result, text)
    more = {
        "engine": page.engine(source, result, {}, {}),
        "text": text,
        "cards": [card_pattern(word) for word in CARDS],
    }
    whole = html.page({**run, **more}, SCRIPTS, STYLES)
    # its own files beside it, which other pages do not have
    for rule in ("script-src", "worker-src"):
        whole = whole.replace(f"{rule} ", f"{rule} 'self' ", 1)
    return whole


def _lock(path: str) -> None:
    """Pyodide's list of packages: none of them is here."""
    with open(path, encoding="utf-8") as file:
        known = json.load(file)
    known["packages"] = {}
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        json.dump(known, file)


def _archive(path: str) -> None:
    lark = importlib.util.find_spec("lark")
    assert lark is not None and lark.origin is not None  # a dependency of emsim
    files = [
        *_files(PACKAGE, "emsim"),
        *((name.path, f"emsim/grammar/{name.name}") for name in os.scandir(grammar_folder())),
        *_files(dirname(lark.origin), "lark"),
        (join(PARTS, "_engine.so"), "emsim/_engine.so"),
    ]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for source, name in sorted(files, key=lambda found: found[1]):
            if not name.endswith((*KINDS, "_engine.so")):
                continue
            with open(source, "rb") as file:
                archive.writestr(zipfile.ZipInfo(name, STAMP), file.read(), zipfile.ZIP_DEFLATED, 9)


def _files(folder: str, name: str) -> Iterable[tuple[str, str]]:
    def walk(at: str, under: str) -> Iterator[tuple[str, str]]:
        for entry in os.scandir(at):
            if entry.is_dir() and entry.name not in ELSEWHERE:
                yield from walk(entry.path, f"{under}/{entry.name}")
            elif entry.is_file():
                yield entry.path, f"{under}/{entry.name}"

    return walk(folder, name)
