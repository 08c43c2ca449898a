"""The layout of a deck: `formatted` changes blanks and nothing else.

Cards that follow one another stand in columns (name and nodes of elements, word, name and terminals of machine cards),
as do the comments behind them; one blank between other words, none around the `=` of a parameter; two blanks deeper
inside .subckt and .if; at most one empty line in a row. Line breaks, comments, the case of names, the title, .control
sections and whatever follows .end stay as they are. What stands in braces, quotes or parentheses is left alone, and so
is every line that the grammar does not accept, and every line whose tree would not be the same as before.
"""

from __future__ import annotations

from ..elements import LETTERS
from ..marks import is_card_word
from ..source import Reading, SourceFile, trees
from ..syntax import first_word, uncommented

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

INDENT = "  "
WIDEST = 20  # of a column: what is longer stands out of it
COMMENT_AT = 64  # a comment behind more than that is not lined up
TWO_NODES = frozenset(kind.letter for kind in LETTERS.values() if len(kind.terminals) > 1)
OPENING, CLOSING = "([{", ")]}"
BLANKS = " \t\r\f\v\xa0"
PLAIN_BLANKS = (
    " \t\r"  # the others count as blanks in some places only: a card with one of them stays as it is
)
# dot cards whose words are cards' words; the rest is kept as text
SPACED = frozenset(
    """.param .csparam .func .model .subckt .ends .tran .op .ac .dc .print .save .probe .ic .nodeset .options .option .opt
    .temp .global .gravity .view .if .elseif .elif .else .endif .end""".split()
)
DEEPER, SHALLOWER = (".subckt", ".if"), (".ends", ".endif")
LEVEL_UP_ONCE = (".else", ".elseif", ".elif")  # stands one level out


class Row:
    """One physical line: `kind` "card", "more" (a continuation), "comment", "blank" or "raw" (kept as it is)."""

    __slots__ = ("code", "comment", "depth", "kind", "text", "words")

    def __init__(self, kind: str, text: str, depth: int) -> None:
        self.kind, self.text, self.depth = kind, text.rstrip(PLAIN_BLANKS), depth
        self.words: list[str] = []
        self.code = self.comment = ""  # what stands before and behind the blanks of a comment

    def shown(self) -> str:
        if self.kind == "comment":
            return INDENT * self.depth + self.text.lstrip(BLANKS)
        return self.code + self.comment if self.words else self.text


def formatted(text: str) -> str:
    """A deck's text, with `\\n` line ends, in the house layout. Formatting it again changes nothing."""
    rows, cards = _rows(text)
    at = 0
    while at < len(rows):
        end = at
        while end < len(rows) and rows[end].words:
            end += 1
        if end > at:
            _columns(rows[at:end])
            _comments(rows[at:end])
        at = max(end, at + 1)
    new = [row.shown() for row in rows]
    for first, last in cards:
        before = "\n".join(row.text for row in rows[first : last + 1]).lstrip(BLANKS)
        after = "\n".join(new[first : last + 1]).lstrip(BLANKS)
        if before != after and not _same(before, after):
            new[first : last + 1] = [row.text for row in rows[first : last + 1]]
    lines: list[str] = []
    for row, line in zip(rows, new, strict=True):
        if row.kind != "blank" or (lines and lines[-1]):
            lines.append(line)
    while lines and not lines[-1]:
        lines.pop()
    return "\n".join(lines) + "\n"


# ---- reading ------------------------------------------------------------------------------------


def _rows(text: str) -> tuple[list[Row], list[tuple[int, int]]]:
    """The rows, and of every card its first and last row."""
    rows: list[Row] = []
    cards: list[tuple[int, int]] = []
    depth, awaiting_title, rest_is_raw, in_control, is_open = 0, True, False, False, False
    for number, line in enumerate(text.split("\n")):
        body = line.strip(BLANKS)
        word = first_word(body)
        if awaiting_title or rest_is_raw or (in_control and word != ".endc"):
            rows.append(Row("raw", line, 0))
            awaiting_title = awaiting_title and not body
        elif not body:
            rows.append(Row("blank", "", 0))
        elif body[0] in "*;$" or body.startswith("//"):
            rows.append(Row("comment", line, depth))
        elif body[0] == "+":
            rows.append(Row("more", line, depth))
            if is_open:
                cards[-1] = (cards[-1][0], number)
        elif word in (".control", ".endc"):
            rows.append(Row("raw", line, 0))
            in_control = word == ".control"
            is_open = False
        else:
            if word in SHALLOWER:
                depth = max(0, depth - 1)
            rows.append(Row("card", line, max(0, depth - 1) if word in LEVEL_UP_ONCE else depth))
            depth += word in DEEPER
            cards.append((number, number))
            is_open = True
            rest_is_raw = word == ".end"
    for first, last in cards:
        _take_words(rows[first : last + 1])
    return rows, cards


def _take_words(rows: list[Row]) -> None:
    """Words and comments of a card's rows; none where one of them cannot be cut into words."""
    word = first_word(rows[0].text)
    if word[:1] == "." and word not in SPACED:
        return
    found = []
    for row in rows:
        if row.kind not in ("card", "more"):
            continue
        if any(c in row.text for c in BLANKS if c not in PLAIN_BLANKS):
            return
        start = len(row.text) - len(row.text.lstrip(BLANKS)) + (row.kind == "more")
        code = code_of(row.text, start, row.kind == "more")
        words = _words(row.text[start:code])
        if words is None:
            return
        found.append((row, ["+", *words] if row.kind == "more" else words, row.text[code:].strip(BLANKS)))
    for row, words, comment in found:
        row.words, row.comment = words, comment


def code_of(line: str, start: int, is_more: bool) -> int:
    """Where the code of a physical line ends and its blanks and comment begin."""
    code = uncommented("\n" * is_more + line[start:])
    return max(start, start + len(code.rstrip(BLANKS + "\n")) - is_more)


def _words(code: str) -> list[str] | None:
    """Words of a line, parameters as `key=value`, brackets and quotes as a whole; None where one stays open."""
    words, begin, depth, quote = [], -1, 0, ""
    for at, c in enumerate(code):
        if quote:
            quote = "" if c == quote else quote
        elif c in "\"'":
            quote = c
        elif c in OPENING:
            depth += 1
        elif c in CLOSING:
            depth -= 1
            if depth < 0:
                return None
        elif c in BLANKS and not depth:
            if begin >= 0:
                words.append(code[begin:at])
                begin = -1
            continue
        if begin < 0:
            begin = at
    if quote or depth:
        return None
    if begin >= 0:
        words.append(code[begin:])
    return _joined(words)


def _joined(words: list[str]) -> list[str]:
    """`r = 1k` as one word."""
    out: list[str] = []
    for word in words:
        follows = out and word[0] == "=" and word[:2] != "==" and _is_key(out[-1])
        if follows or (out and out[-1][-1] == "=" and _is_key(out[-1][:-1])):
            out[-1] += word
        else:
            out.append(word)
    return out


def _is_key(word: str) -> bool:
    """A name, or v(node) of .ic: not an operator, not a value in braces."""
    name, bracket, rest = word.partition("(")
    return name.replace("_", "a").replace(".", "a").replace("#", "a").isalnum() and (
        not bracket or (rest.count(")") == 1 and rest.endswith(")"))
    )


def _same(before: str, after: str) -> bool:
    start = "dot" if before[0] == "." else "machine_card" if is_card_word(first_word(before)) else "element"
    tree = trees().line(before, start)
    return tree is not None and _plain(tree) == _plain(trees().line(after, start))


def _plain(tree: Any) -> list[Any]:
    """A tree without places, as its rules and words in their order: a sum of two thousand terms is as many rules deep."""
    out: list[Any] = []
    rest = [tree]
    while rest:
        node = rest.pop()
        if isinstance(node, tuple):
            out.append((node[0], len(node[1])))
            rest += reversed(node[1])
        else:
            out.append(node if node is None else " ".join(str(node).split()))
    return out


# ---- writing ------------------------------------------------------------------------------------


def _columns(rows: list[Row]) -> None:
    """Code of rows that follow one another: neighbours of a kind stand in columns, and so do the terminals of
    neighbours with the same card word."""
    for part in _runs(rows, _kind):
        kind = _kind(part[0])
        tails: dict[int, str] = {}
        if kind == "machine":
            for run in _runs(part, lambda row: "more" if row.kind == "more" else row.words[0].lower()):
                tails.update(zip(map(id, run), _padded([_arguments(row) for row in run]), strict=True))
        lines = _padded([_cells(row, kind, tails.get(id(row), "")) for row in part])
        for row, line in zip(part, lines, strict=True):
            row.code = INDENT * row.depth + line


def _runs(rows: list[Row], key: Callable[[Row], str]) -> list[list[Row]]:
    """Rows with the same key one after the other; continuations belong to what they continue."""
    runs: list[list[Row]] = []
    last = ""
    for row in rows:
        own = key(row)
        if not runs or own not in (last, "more"):
            runs.append([])
            last = own
        runs[-1].append(row)
    return runs


def _padded(table: list[list[str]]) -> list[str]:
    """Lines with every cell but the last as wide as the widest above and below it."""
    widths: list[int] = []
    for cells in table:
        for k, cell in enumerate(cells[:-1]):
            widths += [0] * (k + 1 - len(widths))
            widths[k] = max(widths[k], len(cell) if len(cell) <= WIDEST else 0)
    lines = []
    for cells in table:
        padded = [cell.ljust(widths[k]) for k, cell in enumerate(cells[:-1])]
        lines.append(" ".join([*padded, *cells[-1:]]).rstrip())
    return lines


def _kind(row: Row) -> str:
    if row.kind == "more":
        return "more"
    word = row.words[0].lower()
    if word[0] == ".":
        return "dot"
    # a card word without its mark is an element, but looks better as what it was meant for
    return "machine" if is_card_word(word) else "element"


def _cells(row: Row, kind: str, tail: str) -> list[str]:
    """The columns of a row; the last one is not padded. `tail`: what stands behind the name of a machine card."""
    words = row.words
    if row.kind == "more" or kind == "dot":
        return [" ".join(words)]
    if kind == "machine":
        return [*words[:2], tail] if tail else words[:2]
    if words[0][0].lower() in TWO_NODES and len(words) > 3 and not any("=" in w for w in words[1:3]):
        return [*words[:3], " ".join(words[3:])]
    return [words[0], " ".join(words[1:])] if len(words) > 1 else words


def _arguments(row: Row) -> list[str]:
    """Terminals of a machine card, then its parameters as one."""
    if row.kind == "more":
        return []
    words = row.words[2:]
    k = next((k for k, word in enumerate(words) if "=" in word or word[0] == "{"), len(words))
    return [*words[:k], " ".join(words[k:])] if k < len(words) else words


def _comments(rows: list[Row]) -> None:
    """Comments behind cards, lined up."""
    lengths = [len(row.code) for row in rows if row.comment and len(row.code) <= COMMENT_AT]
    column = max(lengths, default=0) + 2
    for row in rows:
        if row.comment:
            row.code = row.code.ljust(column - 2) + "  "


# ---- the whole ----------------------------------------------------------------------------------


def meaning(text: str) -> list[Any]:
    """What a deck says, without places: equal before and after."""
    reading = Reading(SourceFile("deck", text), has_title=True)
    found: list[Any] = [reading.title, [line.text.split() for line in reading.control]]
    for rule, content, between, last, _, place in reading.cards:
        if (
            place >= 0
        ):  # a card of words alone comes in lower case, or as a tree where its line holds more than ASCII
            found.append((rule, [content, *between, last]))
        elif rule is None:
            found.append("".join(reading.line(between).text.split()))
        else:
            words = [word for child in content for word in _plain(child)]
            found.append((rule, [word.lower() if isinstance(word, str) else word for word in words]))
    return found
