"""`.meas`: the card's words become clauses, the signals and values in them expressions. What they mean is said in measures/.

ngspice's and LTspice's spellings are one: `trig v(a) val=0.5 rise=1` and `trig v(a)=0.5 rise=1`, `from=1u to=2u` and
`from 1u to 2u`, `param='a+b'` and `param a+b`; the analysis may be left out, as in LTspice. A word of the card is one only
outside brackets and quotes.
"""

from __future__ import annotations

from .build_expr import expression
from .deck import Clause, Measure
from .diagnostics import Diagnostic
from .expr import Call, Name, Node, Num
from .parsed import parse_line
from .source import Line
from .syntax import LineError, code_end

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from .diagnostics import Span

# analyses that a card may name; of those that are not there the card says so itself
ANALYSES = frozenset("tran dc ac noise sp ss tf op disto pss sens".split())
# statistics of a signal, which begin the card: `max(v(a),0)` further on is a function
STATISTICS = {
    "avg": "avg", "mean": "avg", "rms": "rms", "min": "min", "max": "max", "pp": "pp", "integ": "integ", "integral": "integ",
    "min_at": "min_at", "max_at": "max_at", "deriv": "deriv", "derivative": "deriv",
}  # fmt: skip
CLAUSES = frozenset(("trig", "targ", "find", "when", "param"))
# goals are for optimisers: read, and of no effect
VALUES = frozenset("val at td rise fall cross from to goal minval weight print".split())
FORMS = (
    ".meas tran name trig v(a) val=0.5 rise=1 targ v(b) val=0.5 fall=1, .meas tran name max v(a) from=0 to=1m, "
    ".meas tran name find v(a) when v(b)=1, .meas tran name param='a+b'"
)
LETTERS = frozenset("abcdefghijklmnopqrstuvwxyz_")


def measure(line: Line, start: int) -> Measure:
    """The card whose words begin at `start` of the line. Raises LineError."""
    text = _blanked(line.text[: code_end(line.text)])
    analysis, (name, at) = "", _between_blanks(text, start)
    if not name:
        raise wrong(line.whole, ".meas needs a name and what it measures")
    second, end = _between_blanks(text, at)
    if name.lower() in ANALYSES and second and (_begins(text, end) or not _begins(text, at)):
        analysis, name, at = name.lower(), second, end
    if any(c in "=(){}'\"," for c in name):
        where = line.span_at(at - len(name), at)
        raise wrong(where, f"`{name}` stands where .meas has the name of the result")
    return Measure(analysis, name.lower(), clauses(line, text, at), line.whole)


def _between_blanks(text: str, start: int) -> tuple[str, int]:
    """The next piece without blanks, and where it ends; "" where there is none."""
    rest = text[start:].split(None, 1)
    if not rest:
        return "", start
    return rest[0], text.index(rest[0], start) + len(rest[0])


def _word(text: str, start: int) -> str:
    """The word of letters that begins here, where no name goes on behind it."""
    end = start
    while end < len(text) and text[end].lower() in LETTERS:
        end += 1
    behind = text[end : end + 1]
    return "" if behind.isalnum() or behind in tuple("_.@#") else text[start:end]


def clauses(line: Line, text: str, start: int) -> list[Clause]:
    """What stands behind the name."""
    found: list[Clause] = []
    early: dict[str, Node] = {}  # values before the clause that they belong to
    pieces = list(_pieces(text, start))
    between = text[start : pieces[0][1] if pieces else len(text)]
    if strange := between.strip():
        first = start + between.index(strange[0])
        raise wrong(
            line.span_at(first, first + len(strange)), f"`{strange}` stands where .meas says what it measures"
        )
    for k, (word, first, at) in enumerate(pieces):
        end = pieces[k + 1][1] if k + 1 < len(pieces) else len(text)
        body = text[at:end]
        begin = at + len(body) - len(body.lstrip(" \t,"))
        end = at + len(body.rstrip(" \t,"))
        span = line.span_at(first, max(end, first + 1))
        if word in VALUES:
            if begin >= end:
                raise wrong(span, f"`{word}` has no value")
            (found[-1].values if found else early)[word] = _piece(line, text, begin, end)
            continue
        equal = _equal(text, begin, end)
        node = None if begin >= (equal or end) else _piece(line, text, begin, end if equal is None else equal)
        if isinstance(node, Num) and word != "param":
            node = Name(repr(node), node.at)  # a node whose name is a number
        level = None if equal is None else _piece(line, text, equal + 1, end)
        found.append(Clause(STATISTICS.get(word, word), node, level, span))
    if not found:
        raise wrong(line.whole, ".meas does not say what it measures")
    found[0].values = {**early, **found[0].values}
    return found


def wrong(span: Span, said: str, hint: str | None = None) -> LineError:
    return LineError(Diagnostic("error", "E330", said, span, hint or f"forms: {FORMS}"))


def _blanked(text: str) -> str:
    """The text with blanks in place of comments, line ends and the marks of continuation lines."""
    if "\n" not in text and ";" not in text and "$" not in text:
        return text
    lines = []
    for k, part in enumerate(text.split("\n")):
        kept = part[: code_end(part)] if k == 0 or not part.lstrip().startswith("*") else ""
        if k and kept.lstrip().startswith("+"):
            kept = kept.replace("+", " ", 1)
        lines.append(kept.ljust(len(part)))
    return " ".join(lines)


def _outside(text: str, start: int) -> Iterator[int]:
    """Places outside brackets and quotes."""
    depth, quote = 0, ""
    for at in range(start, len(text)):
        c = text[at]
        if quote:
            quote = "" if c == quote else quote
        elif c in "'\"":
            quote = c
        elif c in "({[":
            depth += 1
        elif c in ")}]":
            depth -= 1
        elif depth <= 0:
            yield at


def _begins(text: str, at: int) -> bool:
    """Does a clause begin here?"""
    begin = at + len(text[at:]) - len(text[at:].lstrip(" \t"))
    return next((first == begin for _, first, _ in _pieces(text, begin)), False)


def _pieces(text: str, start: int) -> Iterator[tuple[str, int, int]]:
    """(word, where it begins, where what it is about begins)."""
    none_yet = True
    for at in _outside(text, start):
        if at > start and text[at - 1] not in " \t,":
            continue
        key = _word(text, at).lower()
        if not key:
            continue
        behind = at + len(key)
        rest = text[behind:].lstrip(" \t")
        equal = rest[:1] == "=" and rest[:2] != "=="
        if key in VALUES:
            known = equal or (text[behind : behind + 1] in (" ", "\t") and rest[:1] not in "*/^<>=?:&|)")
        elif key in STATISTICS:
            known = none_yet
        else:
            known = key in CLAUSES and (equal or text[behind : behind + 1] in ("", " ", "\t", "'", "{", "("))
        if not known:
            continue
        if key in STATISTICS or key in CLAUSES:
            none_yet = False
        yield key, at, len(text) - len(rest) + 1 if equal else behind


def _equal(text: str, start: int, end: int) -> int | None:
    """Where the `=` between a signal and its level stands."""
    for at in _outside(text[:end], start):
        if text[at] == "=" and text[at - 1 : at] not in ("<", ">", "!", "=") and text[at + 1 : at + 2] != "=":
            return at
    return None


def _piece(line: Line, text: str, start: int, end: int) -> Node:
    """The expression of a part of the line."""
    while start < end and text[start] in " \t":
        start += 1
    if start >= end:
        raise wrong(line.span_at(start - 1, start), "a signal or a value is missing here")
    if line.single:
        piece = Line(line.file, line.number, line.col + start, line.start + start, line.start + end)
    else:
        span = line.span_at(start, end)
        piece = Line(line.file, span.line, span.col, line.start + start, line.start + end)
    piece.text = text[start:end]
    piece.single = "\n" not in line.text[start:end]
    node = expression(parse_line(piece, "expression"), piece)
    if isinstance(node, Call) and node.fn == "par" and len(node.args) == 1:
        node = node.args[0]  # ngspice's brackets about an expression
    return node


def fourier(line: Line, start: int) -> Measure:
    """`.four f v(a) v(b) ...`: a clause for each signal, with the frequency among its values. Raises LineError."""
    text = _blanked(line.text[: code_end(line.text)])
    places = [at for at in _outside(text, start) if text[at] in " \t,"]
    starts = [at + 1 for at in places if text[at + 1 : at + 2] not in ("", " ", "\t", ",")]
    ends = [min((p for p in (*places, len(text)) if p > at), default=len(text)) for at in starts]
    pieces = list(zip(starts, ends, strict=True))
    if len(pieces) < 2:
        said = ".four needs a frequency and signals"
        raise LineError(Diagnostic("error", "E333", said, line.whole, "form: .four 1k v(out) v(in)"))
    found = []
    for first, last in pieces[1:]:
        signal = _piece(line, text, first, last)
        if isinstance(signal, Num):
            signal = Name(repr(signal), signal.at)  # a node whose name is a number
        clause = Clause("four", signal, None, line.span_at(first, last))
        clause.values["freq"] = _piece(line, text, *pieces[0])
        found.append(clause)
    return Measure("tran", "four", found, line.whole)
