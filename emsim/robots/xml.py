"""XML with places, and without what XML can do to its reader: a document type, and with it every entity, is refused.

`Element` is what a reader of robots sees of a file: its tag, attributes and children, and where each of them stands, so that a
message shows the line. Numbers are read here, so that what is no number is told once and in one way.
"""

from __future__ import annotations

from xml.parsers import expat

from ..diagnostics import DeckError, Diagnostic, suggest

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ..diagnostics import Sink, Span
    from ..source import SourceFile


class Element:
    """One element. `attributes` keeps the order of the file."""

    __slots__ = ("attributes", "children", "file", "start", "tag", "text")

    def __init__(self, tag: str, attributes: dict[str, str], file: SourceFile, start: int) -> None:
        self.tag, self.attributes, self.file, self.start = tag, attributes, file, start
        self.children: list[Element] = []
        self.text = ""

    @property
    def span(self) -> Span:
        return self.file.span(self.start + 1, self.start + 1 + len(self.tag))

    def place(self, key: str) -> Span:
        """Of an attribute's value; of the element where it has none of that name."""
        at = self.start + 1 + len(self.tag)
        text = self.file.text
        while at < len(text) and text[at] not in ">":
            equal = text.find("=", at)
            quotes = [k for k in (text.find('"', equal), text.find("'", equal)) if k >= 0]
            if equal < 0 or not quotes or ">" in text[at:equal]:
                break
            first = min(quotes)
            last = text.find(text[first], first + 1)
            if text[at:equal].strip(" \t\n/") == key:
                return self.file.span(first + 1, last)
            at = last + 1
        return self.span

    def get(self, key: str, default: str = "") -> str:
        return self.attributes.get(key, default).strip()

    def has(self, key: str) -> bool:
        return key in self.attributes

    def all(self, *tags: str) -> Iterator[Element]:
        return (child for child in self.children if child.tag in tags)

    def one(self, tag: str) -> Element | None:
        return next(self.all(tag), None)

    # numbers ------------------------------------------------------------------------------------------

    def numbers(
        self, key: str, sink: Sink, default: Iterable[float] = (), count: int | None = None
    ) -> list[float]:
        """The numbers of an attribute, or the default; E533 where they are none, or not `count`."""
        if key not in self.attributes:
            return [*default]
        words = self.attributes[key].split()
        found = [number_of(word) for word in words]
        wrong = next((word for word, value in zip(words, found, strict=True) if value is None), None)
        if wrong is not None:
            said = f"{key} of <{self.tag}> is {wrong!r}, which is no number"
            sink.error("E533", said, self.place(key), "numbers are finite, and below 1e30 in SI units")
        elif not words and [*default] and count is None:
            sink.error("E533", f"{key} of <{self.tag}> is empty", self.place(key))
        elif count is not None and len(words) != count:
            many = f"{count} number" + "s" * (count > 1)
            sink.error("E533", f"{key} of <{self.tag}> takes {many}, not {len(words)}", self.place(key))
        else:
            return [value for value in found if value is not None]
        return [*default] or [0.0] * (count or 0)

    def number(self, key: str, sink: Sink, default: float = 0.0) -> float:
        return self.numbers(key, sink, (default,), 1)[0]

    def required(self, key: str, sink: Sink) -> str:
        """An attribute that has to be there; "" after E533."""
        if not self.get(key):
            sink.error("E533", f"<{self.tag}> needs {key}=", self.span)
        return self.get(key)

    def flag(self, key: str, sink: Sink, default: bool = False) -> bool:
        """true or false, also as 1 and 0."""
        word = self.get(key).lower()
        if key not in self.attributes:
            return default
        if word not in ("true", "false", "1", "0"):
            sink.error("E533", f"{key} of <{self.tag}> is true or false, not {word!r}", self.place(key))
        return word in ("true", "1")


def number_of(word: str) -> float | None:
    """A number, or None. What is above 1e30 in SI units is a slip: its squares and cubes would not be numbers for long."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if abs(value) < 1e30 and "_" not in word else None


def parse(file: SourceFile) -> Element:
    """The root of a file. Raises DeckError: E530 for what is no XML, E531 for a document type."""
    builder = _Builder(file)
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.characters
    parser.StartDoctypeDeclHandler = builder.doctype
    builder.parser = parser
    try:
        parser.Parse(builder.data, True)
    except expat.ExpatError as error:
        line = max(1, min(error.lineno, len(file.starts)))
        col = min(error.offset, len(file.text_line(line)))
        said = f"{file.name} is no well-formed XML: {expat.ErrorString(error.code)}"
        raise DeckError(Diagnostic("error", "E530", said, file.word(line, col + 1))) from None
    assert builder.root is not None  # expat refuses a file without an element
    return builder.root


class _Builder:
    deepest = 150  # levels: readers call themselves for each, far from Python's limit of 1000 calls

    def __init__(self, file: SourceFile) -> None:
        self.file, self.data = file, file.text.encode("utf-8", "replace")
        self.plain = len(self.data) == len(file.text)
        self.parser: expat.XMLParserType | None = None
        self.root: Element | None = None
        self.open: list[Element] = []
        self.at = (0, 0)  # bytes and characters that were counted

    def here(self) -> int:
        """Where the parser is, in characters."""
        assert self.parser is not None
        byte = self.parser.CurrentByteIndex
        if self.plain:
            return byte
        last, characters = self.at
        characters += len(self.data[last:byte].decode("utf-8", "replace"))
        self.at = (byte, characters)
        return characters

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self.file, self.here())
        if len(self.open) > self.deepest:
            said = f"<{tag}> stands more than {self.deepest} levels deep"
            raise DeckError(Diagnostic("error", "E530", said, element.span))
        if self.open:
            self.open[-1].children.append(element)
        else:
            self.root = element
        self.open.append(element)

    def end(self, tag: str) -> None:
        self.open.pop()

    def characters(self, text: str) -> None:
        if self.open:
            self.open[-1].text += text

    def doctype(self, *_: object) -> None:
        start = max(0, self.file.text.find("<!DOCTYPE"))
        said = "a document type (<!DOCTYPE ..>) is not read: its entities can grow without end or name other files"
        hint = "robots need none: delete it, and write entities out"
        raise DeckError(Diagnostic("error", "E531", said, self.file.span(start, start + 9), hint))


class Words:
    """Which attributes and children an element may have: `read` are read, `idle` do not bear on motion. What is in neither is
    E532."""

    __slots__ = ("idle", "inside", "read")

    def __init__(self, read: str = "", idle: str = "", inside: str = "") -> None:
        self.read, self.idle, self.inside = read.split(), idle.split(), inside.split()

    def check(self, element: Element, sink: Sink) -> None:
        known = [*self.read, *self.idle]
        for key in element.attributes:
            if key not in known and not key.startswith("xmlns"):
                near = suggest(key, known)
                said = f"{key}= of <{element.tag}> is not read here"
                sink.error("E532", said, element.place(key), f"did you mean {near}=?" if near else None)
        for child in element.children:
            if child.tag not in self.inside:
                near = suggest(child.tag, self.inside)
                said = f"<{child.tag}> in <{element.tag}> is not read here"
                sink.error("E532", said, child.span, f"did you mean <{near}>?" if near else None)
