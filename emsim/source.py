"""Source files: the user's bytes as text, its logical lines and cards, and places in them.

Nothing here changes the text: a logical line is a slice of it, and every span points into it.
"""

from __future__ import annotations

import gc

from .diagnostics import Span

TYPE_CHECKING = False
if TYPE_CHECKING:
    from os import PathLike
    from typing import Any, Protocol

    from .dialects import Dialect

    class Circuit(Protocol):
        """A Circuit of PySpice, whose netlist is its text."""

        @property
        def raw_spice(self) -> Any: ...

    # what a deck may be given as: a path, a text, or such a Circuit
    Source = str | bytes | PathLike[str] | Circuit


class NoCollection:
    """While half a million small objects come that live on, collecting garbage only costs time."""

    __slots__ = ("_was",)

    def __enter__(self) -> None:
        self._was = gc.isenabled()
        gc.disable()

    def __exit__(self, *_: object) -> None:
        if self._was:
            gc.enable()


class SourceFile:
    """One deck or included file. `text` has `\\n` line ends; `path` is None for text given as a string. `dialect` says
    how it is read where dialects differ; None: as ngspice does, and refused where that would be a slip.

    Of a deck that was made of a schematic `sheet` is the layout and `origins` says where its words stand there: by line,
    (from column, to column, file, line, column)."""

    __slots__ = ("_starts", "dialect", "included_from", "name", "origins", "path", "remarks", "sheet", "text")

    def __init__(
        self, name: str, text: str, path: str | None = None, included_from: Span | None = None
    ) -> None:
        self.name = name
        self.text = text
        self.path = path
        self.included_from = included_from
        self._starts: list[int] | None = None
        self.dialect: Dialect | None = None
        self.remarks: list[Any] = []  # diagnostics found while its numbers were read
        self.origins: dict[int, list[tuple[int, int, SourceFile, int, int]]] | None = None
        self.sheet: Any = None  # a sheets.sheet.Sheet

    @property
    def has_sections(self) -> bool:
        """Whether the file is a library of .lib name ... .endl sections."""
        return "\n.endl" in self.text.lower()

    @property
    def starts(self) -> list[int]:
        """Offset of the first character of every line."""
        if self._starts is None:
            starts, at, find = [0], 0, self.text.find
            while (at := find("\n", at) + 1) > 0:
                starts.append(at)
            self._starts = starts
        return self._starts

    def text_line(self, line: int) -> str:
        """The text of a line (1-based) without its line end; empty beyond the end."""
        starts = self.starts
        if not 1 <= line <= len(starts):
            return ""
        end = starts[line] - 1 if line < len(starts) else len(self.text)
        return self.text[starts[line - 1] : end]

    def word(self, line: int, col: int) -> Span:
        """The span of the word that begins there."""
        text = self.text_line(line)
        end = col - 1
        while end < len(text) and not text[end].isspace() and text[end] not in "=(){},;\"'":
            end += 1
        return Span(self, line, col, end + 1)

    def span(self, start: int, end: int) -> Span:
        """The span of text[start:end], cut at the end of its first line."""
        from bisect import bisect_right

        starts = self.starts
        line = bisect_right(starts, start)
        col = start - starts[line - 1] + 1
        limit = (starts[line] if line < len(starts) else len(self.text) + 1) - starts[line - 1]
        return Span(self, line, col, max(col, min(col + end - start, limit)))


class Line:
    """A logical line: text[start:end] of a file, with the continuation lines and the comments among them."""

    __slots__ = ("col", "end", "file", "number", "single", "start", "text")

    def __init__(self, file: SourceFile, number: int, col: int, start: int, end: int) -> None:
        self.file = file
        self.number = number
        self.col = col
        self.start = start
        self.end = end
        self.text = file.text[start:end]
        self.single = "\n" not in self.text

    def span(self, leaf: Any) -> Span:
        """The place of a leaf of the line's tree (a str with `start_pos` and `end_pos`)."""
        return self.span_at(leaf.start_pos, leaf.end_pos)

    def span_at(self, start: int, end: int) -> Span:
        if self.single:
            return Span(self.file, self.number, self.col + start, self.col + end)
        return self.file.span(self.start + start, self.start + end)

    @property
    def whole(self) -> Span:
        """The line's first physical line."""
        text = self.text
        stop = text.find("\n")
        return Span(self.file, self.number, self.col, self.col + len(text[:stop] if stop >= 0 else text))


class Leaf(str):
    """A word of a logical line: its text, which terminal of the grammar it is, and where it stands in the line."""

    __slots__ = ("end_pos", "start_pos", "type")
    type: str
    start_pos: int
    end_pos: int


# the cards that come as words in place of a tree: rule -> (number of words, is the last one a number?); elements/ says them
PLAIN: dict[str, tuple[int, bool]] = {}
# first words of lines that the native parser leaves to whoever asks; marks.py says them
HANDED_BACK: list[str] = []
_trees: Any = None


def trees() -> Any:
    """The native parser of the grammar's tables."""
    global _trees
    if _trees is None:
        from ._engine import Trees

        _trees = Trees(Leaf, PLAIN, HANDED_BACK)
    return _trees


class Reading:
    """A text cut into its title, its cards, and the commands of its .control sections.

    A card is (rule, name, words between, last word, its value, place) where it is one of PLAIN, in lower case; else
    (rule, children, where, None, None, -1): its tree; (None, start, where, None, None, -1) where the native parser
    has none. See `line` for `where`.
    """

    __slots__ = ("behind", "cards", "control", "control_span", "file", "stray", "title", "title_line")

    def __init__(self, file: SourceFile, has_title: bool) -> None:
        self.file = file
        skip_empty = file.path is None  # above the title of a text given as a string
        try:
            found = trees().cards(file.text, has_title, skip_empty)
        except UnicodeEncodeError:  # half a surrogate pair; a stand-in of the same length
            whole = "".join("\ufffd" if "\ud800" <= c <= "\udfff" else c for c in file.text)
            found = trees().cards(whole, has_title, skip_empty)
        title, stray, control, behind, commands, self.cards = found
        self.title, self.title_line = "", 0
        if title is not None:
            self.title, self.title_line = file.text[title[2] : title[3]], title[0]
        # continuation lines that continue nothing, their blanks behind them included
        self.stray = [Span(file, number, col, len(file.text_line(number)) + 1) for number, col, _, _ in stray]
        self.control_span = None if control is None else self.line(control).whole
        self.control = [self.line(where) for where in commands]
        # the first card behind .end
        self.behind = None if behind is None else self.line(behind).whole

    def line(self, where: tuple[int, int, int, int]) -> Line:
        """The logical line at (line, column, start, end)."""
        return Line(self.file, *where)


def decode(data: bytes) -> str | None:
    """Bytes of a deck as text with `\\n` line ends: UTF-8, UTF-16 with its mark, else Latin-1; None for binary."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        try:
            text = data.decode("utf-16")
        except UnicodeDecodeError:
            return None
    else:
        if b"\0" in data:
            return _unmarked(data)
        try:
            # not by the codec utf-8-sig, a module of its own
            text = data.removeprefix(b"\xef\xbb\xbf").decode()
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            strange = sum(c < " " and c not in "\t\n\r\f\x1a" for c in text[:4096])
            if strange * 50 > min(len(text), 4096):
                return None
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    if "\x1a" in text[-8:]:
        text = text.rstrip("\x1a \t\n") + "\n"  # the end of a file, as DOS wrote it
    return text


def _unmarked(data: bytes) -> str | None:
    """UTF-16 without its mark: every second byte of nearly all ASCII is 0. None for binary."""
    for codec, zeros in (("utf-16-le", data[1::2]), ("utf-16-be", data[0::2])):
        if len(data) % 2 == 0 and zeros.count(0) * 10 > len(zeros) * 9:
            try:
                text = data.decode(codec)
            except UnicodeDecodeError:
                return None
            return None if "\0" in text else text.replace("\r\n", "\n").replace("\r", "\n")
    return None


MOST_BYTES = 1 << 28  # of a file


def read_bytes(path: str, regular: bool = False) -> bytes:
    """The bytes of a file. `regular`: pipes and devices, which a deck may name but nobody waits for, are refused. Raises
    OSError, for what is larger than MOST_BYTES too."""
    import errno
    import os
    from stat import S_ISDIR, S_ISREG

    # a pipe without a writer would keep even open() waiting
    flags = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOCTTY", 0)
    descriptor = os.open(path, flags | (getattr(os, "O_NONBLOCK", 0) if regular else 0))
    with open(descriptor, "rb") as handle:
        mode = os.fstat(descriptor).st_mode
        if S_ISDIR(mode):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), path)
        if regular and not S_ISREG(mode):
            raise OSError(errno.EINVAL, "it is a pipe or a device, not a file", path)
        # in pieces: what a device or a pipe holds nobody knows
        data = b""
        while piece := handle.read(max(1 << 16, len(data))):
            data += piece
            if len(data) > MOST_BYTES:
                raise OSError(errno.EFBIG, f"it has more than {MOST_BYTES >> 20} MiB", path)
    return data


_kept: dict[str, bytes] | None = None


class SameFiles:
    """Within it a file is read once: whoever reads a deck again, after its run, reads what ran."""

    __slots__ = ()

    def __enter__(self) -> None:
        global _kept
        _kept = {}

    def __exit__(self, *_: object) -> None:
        global _kept
        _kept = None


def load(path: str, included_from: Span | None = None, shown: str | None = None) -> SourceFile:
    """Read a file; an included one must be a regular file. Raises OSError, or ValueError when it is not text."""
    data = None if _kept is None else _kept.get(path)
    if data is None:
        data = read_bytes(path, regular=included_from is not None)
        if _kept is not None:
            _kept[path] = data
    text = decode(data)
    if text is None:
        raise ValueError(f"{path} is not a text file")
    return SourceFile(shown or path, text, path, included_from)
