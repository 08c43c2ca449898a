"""Files that elements read their numbers from, beside the deck that names them."""

from __future__ import annotations

import os

from ..source import decode, read_bytes

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Span
    from .contract import Circuit


class FileTrouble(Exception):
    """Why a file has no text; `path` is where it was looked for."""

    def __init__(self, said: str, path: str) -> None:
        super().__init__(said)
        self.path = path


def text_beside(ctx: Circuit, given: str, at: Span) -> str:
    """The text of a file that is named at a place of a deck. Raises FileTrouble."""
    folder = os.path.dirname(at.file.path) if at.file.path else ""
    path = os.path.join(folder or ".", os.path.expanduser(given.replace("\0", "")))
    if "\\" in path and not os.path.exists(path):
        path = path.replace("\\", os.sep)  # a path as Windows writes it
    if path not in ctx.flat.named:
        ctx.flat.named.append(path)
    try:
        text = decode(read_bytes(path, regular=True))
    except OSError as error:
        raise FileTrouble(f"cannot read {given}: {error.strerror or error}", path) from None
    if text is None:
        raise FileTrouble(f"{given} is not a text file", path)
    return text
