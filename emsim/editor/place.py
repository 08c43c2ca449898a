"""What stands at a place of a deck's text: the word, its card, and what the card expects there.

Only the text is read, so that it works on a line that is not finished.
"""

from __future__ import annotations

from ..cards import CARDS
from ..elements import LETTERS
from .layout import BLANKS, CLOSING, OPENING, code_of

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

ENDS_WORD = " \t\r\f\v\xa0=(){},;\"'"
EXPRESSION_CARDS = frozenset(
    ".param .csparam .func .if .elseif .elif .print .save .probe .meas .measure .four .step".split()
)


class Place:
    """Row and column count from 0.

    word, start, end  the word around the column, as SPICE cuts words, and where it stands in its row
    name              the part of it that is a name of an expression
    words             the words of the card before it, in lower case; empty where it is the first
    key               of `key=...`: the parameter whose value stands here; `is_key`: the word is itself followed by `=`
    call              the function whose argument this is
    inside            in braces, quotes or a call, or in an expression without braces
    is_code           False in the title, in comments, behind .end
    is_command        in a .control section
    """

    __slots__ = (
        "call", "end", "inside", "is_call", "is_code", "is_command", "is_key", "key", "name", "start", "word",
        "words",
    )  # fmt: skip

    def __init__(self, lines: Sequence[str], row: int, col: int) -> None:
        line = lines[row] if 0 <= row < len(lines) else ""
        col = min(max(col, 0), len(line))
        self.start = self.end = col
        while self.start and line[self.start - 1] not in ENDS_WORD:
            self.start -= 1
        while self.end < len(line) and line[self.end] not in ENDS_WORD:
            self.end += 1
        self.word = line[self.start : self.end]
        self.name, name_end = _name_around(line, col)
        behind = line[self.end :].lstrip()
        self.is_key = behind.startswith("=") and not behind.startswith("==")
        self.is_call = line[name_end:].lstrip().startswith("(")
        self.words: list[str] = []
        self.key = self.call = ""
        self.inside = False
        indent = len(line) - len(line.lstrip(BLANKS))
        is_more = line[indent : indent + 1] == "+"
        self.is_code = _is_code(lines, row)
        self.is_command = self.is_code and _is_command(lines, row)
        if self.is_code:
            code = code_of(line, indent + is_more, is_more)
            comment = line[code:].lstrip(BLANKS)
            self.is_code = not comment or self.start < len(line) - len(comment)
        if self.is_code:
            self._read(before(lines, row, self.start))

    def _read(self, text: str) -> None:
        """Words, open brackets and the key in front of the place."""
        word = key = ""
        stack: list[str] = []  # what was before each open bracket
        quote = ""
        for c in text + " ":
            if quote:
                quote = "" if c == quote else quote
                continue
            if c in "\"'":
                quote, word = c, ""
            elif c in OPENING:
                stack.append(_last_name(word) if c == "(" else "")
                word = ""
            elif c in CLOSING:
                if stack:
                    stack.pop()
                word = ""
                key = key if stack else ""
            elif c == "=":
                if not stack:
                    key = word.lower() or (self.words.pop() if self.words else "")
                    key = key.lower()
                word = ""
            elif c in BLANKS or c == ",":
                if word and not stack:
                    if not key:
                        self.words.append(word.lower())
                    key = ""
                word = ""
            else:
                word += c
        self.key = key
        self.call = next((name for name in reversed(stack) if name), "")
        first = self.words[0] if self.words else ""
        self.inside = (
            bool(stack or quote) or (first in EXPRESSION_CARDS) or (first[:1] == "b" and bool(self.key))
        )

    @property
    def card(self) -> str:
        """The first word of the card: `motor`, `r1`, `.tran`; the word itself where it is the first."""
        return self.words[0] if self.words else self.word.lower()

    @property
    def is_machine(self) -> bool:
        return self.card.upper() in CARDS

    def expects(self) -> tuple[str, ...]:
        """Kinds of names that stand here: node body joint point card element model subckt kind param key option ..."""
        from .words import reads

        if self.is_command:
            return ("vector",) if self.words else ("command",)
        if not self.is_code or not self.words:
            return ("card",) if self.is_code else ()
        if self.call and (found := reads(self.call)):
            return found
        if self.card == ".model":
            return ("param",) if self.key else ("of_model",)
        if self.inside:
            return ("param", "func", "probe")
        if self.is_machine:
            return self._machine_terminal()
        if self.card[0] == ".":
            return {".options": ("option",), ".option": ("option",), ".ic": ("probe",),
                    ".nodeset": ("probe",), ".global": ("node",)}.get(self.card, ())  # fmt: skip
        return self._element_word()

    def _machine_terminal(self) -> tuple[str, ...]:
        spec = CARDS[self.card.upper()].spec
        if self.key:
            return ("model",) if self.key == "model" else ("word",)
        k = len(self.words) - 2
        if k < 0:
            return ("name",)
        kinds: list[str] = []
        for form in spec.forms:
            kind = form[k][1] if k < len(form) else "key"
            kinds += ["point", "body"] if kind == "point" else [kind]
        return tuple(dict.fromkeys([*kinds, "key"] if all(k >= len(f) for f in spec.forms) else kinds))

    def _element_word(self) -> tuple[str, ...]:
        letter, k = self.card[0], len(self.words)
        if self.key:
            return ("param",)
        if letter == "x":
            return ("node", "joint", "body", "point", "subckt")
        kind = LETTERS.get(letter)
        if kind is None or not kind.supported or kind.least is not None:
            return ("node", "model")
        behind = ("node",) * len(kind.terminals) + kind.behind
        return (behind[k - 1],) if k <= len(behind) else ("key",)


def _is_code(lines: Sequence[str], row: int) -> bool:
    """Not the title, not a comment line, not behind .end."""
    if not 0 < row < len(lines):
        return False
    body = lines[row].lstrip(BLANKS)
    if body[:1] in ("*", ";", "$") or body.startswith("//"):
        return False
    return not any(line.strip(BLANKS).lower() == ".end" for line in lines[1:row])


def _is_command(lines: Sequence[str], row: int) -> bool:
    """Between .control and .endc."""
    marks = (line.strip(BLANKS).lower() for line in reversed(lines[1:row]))
    last = next((mark for mark in marks if mark in (".control", ".endc")), "")
    return last == ".control" and lines[row].strip(BLANKS).lower() != ".endc"


def before(lines: Sequence[str], row: int, col: int) -> str:
    """The card's text in front of a place, without comments and continuation marks."""
    parts = [lines[row][:col]]
    while parts[0].lstrip(BLANKS)[:1] == "+" or not _starts_card(parts[0], parts):
        parts[0] = parts[0].lstrip(BLANKS).removeprefix("+") if parts[0].lstrip(BLANKS)[:1] == "+" else ""
        row -= 1
        if row < 1:
            break
        line = lines[row]
        indent = len(line) - len(line.lstrip(BLANKS))
        is_more = line[indent : indent + 1] == "+"
        parts.insert(0, line[: code_of(line, indent + is_more, is_more)])
    return " ".join(parts)


def _starts_card(text: str, parts: list[str]) -> bool:
    """Whether a card begins on this line; comments and empty lines stand between a card and its continuation."""
    body = text.lstrip(BLANKS)
    return len(parts) == 1 or (body != "" and body[0] not in "*;$")


def _last_name(word: str) -> str:
    """`v` of `8*v`, in lower case; empty where a bracket only groups."""
    at = len(word)
    while at and (word[at - 1].isalnum() or word[at - 1] in "_.#$"):
        at -= 1
    return word[at:].lower()


def _name_around(line: str, col: int) -> tuple[str, int]:
    """The name of an expression around a column, of letters, digits and `_ . # $`, and where it ends."""
    start = end = col
    while start and (line[start - 1].isalnum() or line[start - 1] in "_.#$"):
        start -= 1
    while end < len(line) and (line[end].isalnum() or line[end] in "_.#$"):
        end += 1
    return line[start:end], end
