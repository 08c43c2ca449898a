"""usage: emsim fmt [options] deck.cir ...        (or - for stdin)

Lays decks out: cards in columns, comments lined up, one blank between words, blocks indented. Only blanks change; comments,
continuation lines, the case of names and the meaning of every card stay. Files are rewritten in place, stdin goes to
stdout. With --check nothing is written; exit code 1 where a file would change."""

from __future__ import annotations

import sys

from ..diagnostics import Diagnostic, OutsideError, deck_error
from ..editor.layout import formatted, meaning
from ..outputs.beside import replacing
from ..sheets import kind
from ..source import decode, read_bytes
from .arguments import HELP, QUIET, Option, UsageError, parse
from .console import DECK, OK, stdin_text

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

OPTIONS = [Option("--check", "write nothing, name the files that would change"), QUIET, HELP]


def main(args: Sequence[str]) -> int:
    given = parse(args, OPTIONS)
    if not given.words:
        raise UsageError("emsim fmt takes decks: emsim fmt deck.cir")
    code = OK
    for path in given.words:
        if path == "-":
            text = stdin_text()
            new = laid_out(text)
            if not given.has("check"):
                sys.stdout.write(new)
            changes = new != text
        else:
            changes = _file(path, write=not given.has("check"))
        if changes and given.has("check"):
            code = DECK
        if changes and path != "-" and not given.has("quiet"):
            print(f"{path}: {'would change' if given.has('check') else 'laid out'}", file=sys.stderr)
    return code


def laid_out(text: str) -> str:
    """The text formatted. A layout that changed the meaning would be a bug, and is not written."""
    new = formatted(text)
    if meaning(new) != meaning(text):
        raise AssertionError("the layout would change the deck")
    return new


def _file(path: str, write: bool) -> bool:
    """Formats a file in its own encoding and with its own line ends; whether that changes it."""
    data = read_bytes(path)
    text = decode(data)
    if text is None:
        raise OutsideError(Diagnostic("error", "E500", f"{path} is not a text file"))
    if (found := kind(text)) is not None:
        deck_error(
            "E157",
            f"{path} is {found[0]}, whose layout is its owner's",
            None,
            "emsim convert makes a deck of it",
        )
    new = laid_out(text)
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8"
    try:
        data.decode(encoding)
    except UnicodeDecodeError:
        encoding = "latin-1"  # as source.decode reads it
    bytes_of = new.replace("\n", "\r\n") if b"\r\n" in data or "\r\n".encode("utf-16-le") in data else new
    mark = b"\xef\xbb\xbf" if data.startswith(b"\xef\xbb\xbf") else b""
    out = mark + bytes_of.encode(encoding)
    if out == data:
        return False
    if write:
        with replacing(path, sync=True) as beside, open(beside, "wb") as file:
            file.write(out)
    return True
