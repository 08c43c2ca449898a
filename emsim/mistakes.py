"""What is said of a line that the grammar does not accept: Lark reads it again and knows what would have fitted."""

from __future__ import annotations

import re

from . import dots
from .cards import CARDS
from .diagnostics import Diagnostic, Fix, Span, did_you_mean
from .elements import LETTERS
from .lark_grammar import parser
from .marks import card_class, missing_mark
from .source import Line
from .syntax import LineError, code_end, first_word, uncommented
from .units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .source import SourceFile
    from .syntax import Tree

MAX_NESTING = 100


def lark_line(line: Line, start: str) -> Tree:
    """parsed.parse_line by Lark itself. Raises LineError."""
    text = line.text
    if len(text) > 200 and (text.count("(") + text.count("{")) > MAX_NESTING:
        _check_nesting(line)
    try:
        return parser().parse(text, start)
    except Exception as error:
        if type(error).__module__.partition(".")[0] != "lark":
            raise
        raise LineError(_explain(line, start, error)) from None


def _check_nesting(line: Line) -> None:
    depth = 0
    for at, c in enumerate(line.text):
        if c in "({":
            depth += 1
            if depth > MAX_NESTING:
                said = f"brackets are nested more than {MAX_NESTING} deep"
                hint = "give parts of the expression names with .param or .func"
                raise LineError(Diagnostic("error", "E104", said, line.span_at(at, at + 1), hint))
        elif c in ")}":
            depth -= 1


# what the grammar's terminals are called when one of them is missing
_NAMES = {
    "WORD": "a name or value", "NAME": "a name", "NODE": "a node", "NUMBER": "a number", "_EQUAL": "`=`", "_LPAR": "`(`",
    "_RPAR": "`)`", "_COMMA": "`,`", "LBRACE": "`{`", "RBRACE": "`}`", "QUOTE": "a quote", "DBLQUOTE": "a quote",
    "QMARK": "`?`", "COLON": "`:`", "KEY_V": "`V=`", "KEY_I": "`I=`", "$END": "the end of the line",
    "PATH": "a file name", "QUOTED": "a file name", "NAME_IN_QUOTES": "a name or value",
}  # fmt: skip
_OPERATORS = [
    "OR", "AND", "EQUALS", "DIFFERS", "AT_MOST", "AT_LEAST", "LESS", "MORE", "PLUS", "MINUS", "TIMES", "OVER",
    "PERCENT", "POWER", "QMARK",
]  # fmt: skip

# the form of each card, for the hint under an error in it
FORMS = {
    **{kind.letter: kind.form for kind in LETTERS.values()},
    ".tran": ".tran tstep tstop [tstart [tmax]] [uic]",
    ".op": ".op [static]",
    ".dc": ".dc source start stop step [source2 start stop step]",
    ".ac": ".ac dec|oct|lin points fstart fstop",
    ".noise": ".noise v(out) source dec|oct|lin points fstart fstop",
    ".tf": ".tf v(out) source",
    ".pz": ".pz in+ in- out+ out- cur|vol pol|zer|pz",
    ".sens": ".sens v(out) [ac dec|oct|lin points fstart fstop]",
    ".sp": ".sp dec|oct|lin points fstart fstop",
    ".modes": ".modes [static]",
    **{word: form for word, (form, _) in dots.CARDS.items()},
}


def form_of(line: Line, start: str) -> str | None:
    """The form of the card on this line, for a hint."""
    word = first_word(line.text)
    if start == "machine_card" and word.upper() in CARDS:
        return CARDS[word.upper()].spec.form
    return FORMS.get(word) or FORMS.get(word[:1])


FREQUENCY_FORMS = ("chebyshev",)  # of E and G, in the frequency domain


def _explain(line: Line, start: str, error: Any) -> Diagnostic:
    """The diagnostic for a Lark exception."""
    text = line.text
    unbalanced = _unbalanced(line)
    if unbalanced is not None:
        return unbalanced
    words = text.split(maxsplit=4)
    if words[3:] and words[0][0] in "EGeg" and words[3].lower() in FREQUENCY_FORMS:
        place = text.index(words[3], len(words[0]))
        span = line.span_at(place, place + len(words[3]))
        hint = "write its transfer function: LAPLACE {V(in)} {H(s)}"
        return Diagnostic("error", "E113", f"{words[3].upper()} is not supported yet", span, hint)
    token = getattr(error, "token", None)
    at = getattr(error, "pos_in_stream", None)
    if token is not None and token.type != "$END":
        at = token.start_pos
    code = code_end(text)
    accepts = set(getattr(error, "accepts", None) or getattr(error, "expected", None) or ())
    accepts |= set(getattr(error, "allowed", None) or ())
    wanted = _wanted(accepts)
    form = form_of(line, start) if start not in ("expression", "vectors", "let") else None
    if at is None or at >= code or (token is not None and token.type == "$END"):
        end = _last_visible(text, code)
        if (switch := _short_switch(line, text[:code])) is not None:
            return switch
        what = f": {wanted} is missing" if wanted else ""
        return Diagnostic(
            "error",
            "E103",
            f"the line ends too early{what}",
            line.span_at(end, end + 1),
            form and f"form: {form}",
        )
    stop = at + 1
    while stop < len(text) and text[stop] not in " \t\n=(){},;\"'":
        stop += 1
    found = text[at:stop] if text[at] not in "=(){},;\"'" else text[at]
    message = f"`{found}` does not fit here" + (f"; expected {wanted}" if wanted else "")
    return Diagnostic("error", "E102", message, line.span_at(at, at + len(found)), form and f"form: {form}")


def _short_switch(line: Line, code: str) -> Diagnostic | None:
    """An S line with a word too few: its model, or one of the nodes that turn it."""
    words = code.split()
    if len(words) != 5 or words[0][0] not in "sS" or "=" in code or not line.single:
        return None
    name, last = words[0], words[4]
    place = code.rindex(last)
    if re.search(rf"^[ \t]*\.model\s+{re.escape(last)}\s", line.file.text, re.I | re.M):
        said, at = (
            f"{name} is turned by the voltage between two nodes, and has one of them",
            line.span_at(place, place),
        )
        fixes = [Fix(at, "0 ", f"write `{' '.join([*words[:4], '0', last])}`, for the voltage to ground")]
    else:
        said, at = f"{name} names no model", line.span_at(len(code), len(code))
        fixes = [
            Fix(
                at,
                " sw\n.model sw SW(vt=2.5 vh=0.1)",
                "write `sw` behind it, and `.model sw SW(vt=2.5 vh=0.1)`",
            )
        ]
    span = line.span_at(place, place + len(last))
    hint = f"{fixes[0].label}\nform: {FORMS['s']}"
    return Diagnostic("error", "E109", said, span, hint, fixes=fixes)


def _wanted(accepts: set[str]) -> str:
    if {"NUMBER", "NAME", "V_CALL"} <= accepts:
        return "an expression"
    if "WORD" in accepts:
        # a comma is a blank there: nobody misses it
        accepts = accepts - {"LBRACE", "QUOTE", "DBLQUOTE", "_COMMA", "NAME_IN_QUOTES"}
    if not accepts or len(accepts) > 20:
        return ""
    operators = accepts & set(_OPERATORS)
    names = sorted({_NAMES.get(t, "") for t in accepts - operators} - {""})
    if len(names) > 5:
        return ""
    if operators:
        names.append("an operator")
    return ", ".join(names[:-1]) + (" or " if len(names) > 1 else "") + names[-1] if names else ""


def _last_visible(text: str, end: int) -> int:
    return max(0, min(end, len(text)))


def _unbalanced(line: Line) -> Diagnostic | None:
    """An unclosed or unopened bracket or quote, when the line has one."""
    closing = {")": "(", "}": "{"}
    stack: list[tuple[int, str]] = []
    for at, c in enumerate(uncommented(line.text)):
        if c in "\"'":
            if stack and stack[-1][1] == c:
                stack.pop()
            elif not stack or stack[-1][1] not in "\"'":
                stack.append((at, c))
        elif c in "({":
            stack.append((at, c))
        elif c in ")}":
            if stack and stack[-1][1] == closing[c]:
                stack.pop()
            else:
                opened = [s for s in stack if s[1] == closing[c]]
                if opened:
                    at, c = stack[-1]
                    return Diagnostic("error", "E103", f"`{c}` is never closed", line.span_at(at, at + 1))
                return Diagnostic("error", "E103", f"`{c}` closes nothing", line.span_at(at, at + 1))
    if stack:
        at, c = stack[-1]
        return Diagnostic("error", "E103", f"`{c}` is never closed", line.span_at(at, at + 1))
    return None


def unknown_dot(line: Line, word: str) -> Diagnostic:
    """The diagnostic for a dot card that nobody knows."""
    known = sorted(
        t.pattern.value
        for t in parser().terminals
        if t.pattern.type == "str" and t.pattern.value.startswith(".")
    )
    return Diagnostic(
        "error",
        "E105",
        f"there is no `{word}` card",
        line.span_at(0, len(word)),
        did_you_mean(word, known),
    )


# ---- lines that were meant as another card -------------------------------------------------------

# dot cards as they look without their dot, where an element could have that name
DOTLESS = {
    "tran": r"\s+[\d.{']", "op": r"\s*$", "ac": r"\s+(?:dec|oct|lin)\b", "dc": r"\s+\S+\s+[-+.\d{'].*\s", "ic": r"\s+v\s*\(",
    "tf": r"\s+[vi]\s*\(", "end": r"\s*$", "ends": r"\s*\w*\s*$", "save": r"\s+[\w@]", "temp": r"\s+[-+.\d{']",
    "model": r"\s+\S+\s+[a-z]", "meas": r"\s+\S+\s+\S", "four": r"\s+[\d.{']", "func": r"\s+\w+\s*\(", "lib": r"\s+\S",
    **dict.fromkeys(("print", "param", "params", "include", "options", "option", "subckt", "nodeset", "probe", "measure",
                     "global", "noise", "modes", "gravity", "step", "plot"), r"\s+\S"),
}  # fmt: skip


def line_at(span: Span) -> Line:
    """The logical line that begins at a span."""
    file, last = span.file, span.line
    while last < len(file.starts) and file.text_line(last + 1).lstrip().startswith("+"):
        last += 1
    start = file.starts[span.line - 1] + span.col - 1
    return Line(file, span.line, span.col, start, file.starts[last - 1] + len(file.text_line(last)))


def other_card(line: Line) -> Diagnostic | None:
    """What a line that is no element was meant as: a machine card without its mark, a dot card without its dot."""
    word = first_word(line.text)
    if word.upper() in CARDS:
        return None if card_class(line) else _unmarked(line, word)
    pattern = DOTLESS.get(word)
    if pattern is None or not re.match(word + pattern, line.text[: code_end(line.text)], re.I | re.S):
        return None
    span = line.span_at(0, len(word))
    fix = Fix(Span(span.file, span.line, span.col, span.col), ".", f"write `.{word}`")
    said = f"`{word}` is a dot card without its dot"
    return Diagnostic("error", "E105", said, span, f"write `.{word}`", fixes=[fix])


_ITEM = re.compile(
    r"(?:([^\s=(){},;\"']+)\s*=\s*)?((?:[^\s=(){},;\"']+(?:\([^()]*\))?|\{[^{}]*\}|\([^()]*\)))"
)


def _unmarked(line: Line, word: str) -> Diagnostic | None:
    """A line that begins with a card's word and has not what tells the card from an element."""
    code = line.text[: code_end(line.text)]
    items = [(m[1] or "", m[2], m.start(), m.end()) for m in _ITEM.finditer(code, len(word))]
    if not items:
        return None
    name, rest = items[0][1], items[1:]
    if word == "joint":
        return _one_end(line, name, rest)
    wrong = ""
    edits: list[tuple[int, int, str]] = []
    for key, value, start, end in rest:
        if key or (start > rest[0][2] and (spice_number(value) is not None or value[0] == "{")):
            new = CARDS[word.upper()].spec.meant.get(key.lower())
            if new is not None and not (key == "" and edits):
                edits.append((start, end, new.format(value)))
                wrong = wrong or (key if f"{key.lower()}=" not in new else "")
    if word == "stop" and len(edits) == 2:
        low, high = (spice_number(new.partition("=")[2]) for _, _, new in edits)
        if low is not None and high is not None and low > high:
            edits = [
                (start, end, f"{new[:3]}={edits[1 - k][2][4:]}") for k, (start, end, new) in enumerate(edits)
            ]
    said = (
        f"{word.upper()} {name} does not take parameter {wrong}="
        if wrong
        else f"{word.upper()} {name} needs {CARDS[word.upper()].mark_in_words()}"
    )
    hint = [missing_mark(word)]
    if word == "force" and edits and rest and (of := _joint(line.file, rest[0][1])) is not None:
        hint.insert(
            0, f"a FORCE acts at a point of a body: {rest[0][1]} is a joint, and {of} is the body on it"
        )
        edits.insert(0, (rest[0][2], rest[0][3], of))
    fixes = []
    if edits and line.single:
        first, last, text = edits[0][0], edits[-1][1], ""
        for k, (_, end, new) in enumerate(edits):
            text += new + code[end : edits[k + 1][0] if k + 1 < len(edits) else last]
        fixes = [Fix(line.span_at(first, last), text)]
        hint.insert(0, fixes[0].label)
    place = (edits[-1][0], edits[-1][1]) if edits else (0, len(word))
    return Diagnostic(
        "error", "E231" if wrong else "E230", said, line.span_at(*place), "\n".join(hint), fixes=fixes
    )


def _one_end(line: Line, name: str, rest: list[Any]) -> Diagnostic | None:
    """JOINT hinge arm pin: the kind stands where the second end does."""
    from .cards.joints import ALIASES, KINDS

    places = [item for item in rest if not item[0]]
    if len(places) < 2 or places[1][1].lower() not in {*KINDS, *ALIASES} or len(places) > 2:
        return None
    at = line.span_at(places[0][2], places[0][3])
    new = Fix(
        Span(at.file, at.line, at.col, at.col),
        "0 ",
        f"write `0 {places[0][1]}`, for the world and {places[0][1]}",
    )
    said = f"JOINT {name} has one end, and ties two: 0 is the world"
    return Diagnostic("error", "E233", said, at, fixes=[new])


def _joint(file: SourceFile, name: str) -> str | None:
    """The second end of a joint of the deck."""
    found = re.search(rf"^[ \t]*joint\s+{re.escape(name)}\s+\S+\s+([^\s(]+)", file.text, re.I | re.M)
    return found[1] if found else None
