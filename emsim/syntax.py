"""Parsing: a logical line becomes a small tree, by Lark's tables of the grammar in grammar/*.lark.

A tree is (rule, [children]); a leaf is a str with `type`, `start_pos` and `end_pos` (its place in the line). The
engine runs the tables (engine/src/syntax); grammar/export.py took them from Lark. A line that it does not accept
is parsed again by Lark itself, which knows what would have fitted: the message is made from that.

So Lark is imported only when something is wrong. Its tables are kept in the user's cache directory, written as
plain data (marshal, nothing that could execute), in a directory that only the user can write.
"""

from __future__ import annotations

import os
import sys

from .diagnostics import Diagnostic, OutsideError, suggest
from .source import trees

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from .source import Line

    Tree = tuple[str, list[Any]]

PARTS = ("deck", "lexical", "spice", "mechanics", "expression")
STARTS = ("dot", "card", "element", "command", "expression")
CARD_WORDS = frozenset(
    [
        "body",
        "point",
        "joint",
        "motor",
        "pot",
        "spring",
        "damper",
        "friction",
        "stop",
        "gear",
        "force",
        "torque",
        "drive",
        "contact",
        "transducer",
    ]
)
MAX_NESTING = 100

_parser: Any = None


class LineError(Exception):
    """A line that the grammar does not accept, with the message for its author."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic


def grammar_folder() -> str:
    """grammar/ of the source checkout, or the copy inside an installed package."""
    package = os.path.dirname(os.path.abspath(__file__))
    checkout = os.path.dirname(package)
    # a build leaves a copy in the package folder; in a checkout the originals are the truth
    if os.path.exists(os.path.join(checkout, "pyproject.toml")):
        folders = [os.path.join(checkout, "grammar"), os.path.join(package, "grammar")]
    else:
        folders = [os.path.join(package, "grammar")]
    for folder in folders:
        if os.path.exists(os.path.join(folder, "deck.lark")):
            return folder
    raise OutsideError(
        Diagnostic("error", "E502", "the grammar files of emsim are missing from its installation")
    )


def grammar_text() -> str:
    """All five parts as one grammar."""
    parts = []
    for name in PARTS:
        with open(os.path.join(grammar_folder(), name + ".lark"), encoding="utf-8") as handle:
            parts.append(handle.read())
    return "\n".join(parts)


class _Trees:
    """Lark's inline transformer: every rule becomes the tuple (rule, children) as soon as it is complete."""

    def __getattr__(self, rule: str) -> Callable[[list[Any]], Tree]:
        if not rule[0].islower():  # terminals stay as they are
            raise AttributeError(rule)
        name = sys.intern(str(rule))
        return lambda children: (name, children)


def parser() -> Any:
    """The Lark parser, from the cached tables or built from the grammar."""
    global _parser
    if _parser is None:
        _parser = _load_parser()
    return _parser


def _load_parser() -> Any:
    import lark

    text = grammar_text()
    path = _cache_file(text, lark.__version__)
    if path is not None:
        tables = _read_cache(path)
        if tables is not None:
            try:
                return lark.Lark._load_from_dict(tables[0], tables[1], transformer=_Trees())
            except Exception:  # a damaged file: build anew
                pass
    built = build_parser(text)
    if path is not None:
        _write_cache(path, built)
        return built
    return built


def build_parser(text: str) -> Any:
    """Lark's LALR parser with the contextual lexer, from the grammar's text."""
    import lark

    return lark.Lark(
        text,
        parser="lalr",
        lexer="contextual",
        start=list(STARTS),
        maybe_placeholders=False,
        transformer=_Trees(),
    )


# ---- the cache of tables ----


def _cache_file(text: str, version: str) -> str | None:
    """Where the tables of this grammar are kept; None where no safe place exists."""
    import hashlib

    key = "\n".join((version, sys.version, sys.implementation.cache_tag or "", text))
    name = "grammar-" + hashlib.sha256(key.encode()).hexdigest()[:24] + ".tables"
    base = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    if not os.path.isabs(base):
        return None
    folder = os.path.join(base, "emsim")
    try:
        os.makedirs(folder, mode=0o700, exist_ok=True)
        status = os.lstat(folder)
    except OSError:
        return None
    if hasattr(os, "getuid") and (status.st_uid != os.getuid() or status.st_mode & 0o077):
        return None  # someone else could have planted tables here
    return os.path.join(folder, name)


def _read_cache(path: str) -> Any:
    import marshal

    try:
        with open(path, "rb") as handle:
            if hasattr(os, "getuid") and os.fstat(handle.fileno()).st_uid != os.getuid():
                return None
            return marshal.loads(handle.read())
    except (OSError, ValueError, EOFError, TypeError):
        return None


def _write_cache(path: str, built: Any) -> None:
    import marshal

    from lark.grammar import Rule
    from lark.lexer import TerminalDef

    data, memo = built.memo_serialize([TerminalDef, Rule])
    data["options"] = {k: v for k, v in data["options"].items() if k != "transformer"}
    temporary = f"{path}.{os.getpid()}"
    try:
        blob = marshal.dumps(_plain((data, memo)))
        with open(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as handle:
            handle.write(blob)
        os.replace(temporary, path)
    except (OSError, ValueError):
        pass  # the cache is a convenience


def _plain(value: Any) -> Any:
    """Lark's tables with its own kinds of str made plain ones."""
    if isinstance(value, dict):
        return {_plain(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(_plain(v) for v in value)
    return str(value) if isinstance(value, str) else value


# ---- one line ----


def parse_line(line: Line, start: str) -> Tree:
    """The tree of a logical line, from one of STARTS. Raises LineError."""
    try:
        tree: Tree | None = trees().line(line.text, start)
    except UnicodeEncodeError:  # half a surrogate pair
        tree = None
    return lark_line(line, start) if tree is None else tree


def lark_line(line: Line, start: str) -> Tree:
    """The same by Lark itself. Raises LineError."""
    text = line.text
    if len(text) > 200 and (text.count("(") + text.count("{")) > MAX_NESTING:
        _check_nesting(line)
    try:
        return (_parser or parser()).parse(text, start)
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
                raise LineError(
                    Diagnostic(
                        "error",
                        "E104",
                        f"brackets are nested more than {MAX_NESTING} deep",
                        line.span_at(at, at + 1),
                        "give parts of the expression names with .param or .func",
                    )
                )
        elif c in ")}":
            depth -= 1


# what the grammar's terminals are called when one of them is missing
_NAMES = {
    "WORD": "a name or value",
    "NAME": "a name",
    "NODE": "a node",
    "NUMBER": "a number",
    "_EQUAL": "`=`",
    "_LPAR": "`(`",
    "_RPAR": "`)`",
    "_COMMA": "`,`",
    "LBRACE": "`{`",
    "RBRACE": "`}`",
    "QUOTE": "a quote",
    "DBLQUOTE": "a quote",
    "QMARK": "`?`",
    "COLON": "`:`",
    "KEY_V": "`V=`",
    "KEY_I": "`I=`",
    "$END": "the end of the line",
    "PATH": "a file name",
    "QUOTED": "a file name",
}
_OPERATORS = [
    "OR",
    "AND",
    "EQUALS",
    "DIFFERS",
    "AT_MOST",
    "AT_LEAST",
    "LESS",
    "MORE",
    "PLUS",
    "MINUS",
    "TIMES",
    "OVER",
    "PERCENT",
    "POWER",
    "QMARK",
]

# the form of each card, for the hint under an error in it
FORMS = {
    "r": "Rname n+ n- value [tc=tc1,tc2] [m=], or Rname n+ n- R={expression}",
    "c": "Cname n+ n- value [ic=] [m=], or Cname n+ n- C={expression}",
    "l": "Lname n+ n- value [ic=] [m=], or Lname n+ n- L={expression}",
    "v": "Vname n+ n- [DC value] [AC mag [phase]] [PULSE(..) SIN(..) EXP(..) PWL(..) SFFM(..) AM(..)]",
    "i": "Iname n+ n- [DC value] [AC mag [phase]] [PULSE(..) SIN(..) EXP(..) PWL(..) SFFM(..) AM(..)]",
    "b": "Bname n+ n- V={expression}, or I={expression}",
    "e": "Ename n+ n- nc+ nc- gain, POLY(n) .., VALUE={..}, or TABLE {..} = (x,y) ..",
    "g": "Gname n+ n- nc+ nc- gain, POLY(n) .., VALUE={..}, or TABLE {..} = (x,y) ..",
    "f": "Fname n+ n- Vsource gain, or POLY(n) Vsource .. coefficients",
    "h": "Hname n+ n- Vsource gain, or POLY(n) Vsource .. coefficients",
    "d": "Dname anode cathode model [area] [off] [ic=]",
    "s": "Sname n+ n- nc+ nc- model [on|off]",
    "w": "Wname n+ n- Vsource model [on|off]",
    "k": "Kname Lname Lname [Lname ..] coupling",
    "x": "Xname node .. subcircuit [parameter=value ..]",
    ".tran": ".tran tstep tstop [tstart [tmax]] [uic]",
    ".param": ".param name=value [name={expression} ..]",
    ".func": ".func name(a,b) {expression}",
    ".model": ".model name type(parameter=value ..)",
    ".subckt": ".subckt name node .. [parameter=default ..]",
    ".include": ".include file",
    ".lib": ".lib file section",
    ".ic": ".ic v(node)=value ..",
    ".nodeset": ".nodeset v(node)=value ..",
    ".print": ".print tran v(node) i(Vname) {expression} ..",
    ".if": ".if (condition)",
    "body": "BODY name m= [j=] [com=(x,y)] [shape=rod(l)|box(w,h)|disc(r)]",
    "point": "POINT body.name x y [z]",
    "joint": "JOINT name A B kind [axis=(x,y)] [zero=] [ic=] [damp=]",
    "motor": "MOTOR name n+ n- joint kt= [ke=] [r=] [l=] [j=] [b=] [gear=]",
    "pot": "POT name top wiper bottom joint r= range=(a,b)",
    "spring": "SPRING name joint k= [q0=], or SPRING name P Q k= [l0=]",
    "damper": "DAMPER name joint c=, or DAMPER name P Q c=",
    "friction": "FRICTION name joint fc= [fs=] [vs=] [b=]",
    "stop": "STOP name joint min= max= k= [c=]",
    "gear": "GEAR name j1 j2 ratio=",
    "force": "FORCE name P dir=(x,y) value|{expression}|PULSE(..)",
    "torque": "TORQUE name joint tau=value|{expression}|PULSE(..)",
    "drive": "DRIVE name joint q={expression}",
    "contact": "CONTACT name P Q k= [c=] [mu=]",
    "transducer": "TRANSDUCER name n+ n- joint C={..}|L={..}|K={..}|W={..}",
}


# a machine card is told from a SPICE line by its mark
MARKS = {
    "body": "m=, shape= or fixed=",
    "point": "a name with a dot",
    "joint": "its kind (pin, slide, weld, ...) as the fourth word",
    "motor": "kt= or model=",
    "pot": "range=",
    "spring": "k=",
    "damper": "c=",
    "friction": "fc=",
    "stop": "min= or max=",
    "gear": "ratio= or lead=",
    "force": "dir=, fx= or fy=",
    "torque": "tau=",
    "drive": "q= or qd=",
    "contact": "k= or e=",
    "transducer": "C=, L=, K= or W=",
}


def missing_mark(word: str) -> str:
    """Why a line that begins with a card word was read as SPICE, as a hint."""
    return (
        f"a {word.upper()} card needs {MARKS[word]}; without it the line is SPICE element {word[0].upper()}\n"
        f"form: {FORMS[word]}"
    )


def is_machine_card(line: Line) -> bool:
    """Whether the line carries its card's mark, by the grammar's own terminal."""
    import re

    word = first_word(line.text).upper()
    pattern = next(t.pattern for t in parser().terminals if t.name == word)
    return re.match(pattern.to_regexp(), line.text) is not None


def form_of(line: Line, start: str) -> str | None:
    """The form of the card on this line, for a hint."""
    word = first_word(line.text)
    if start == "card" and word in CARD_WORDS:
        return FORMS[word]
    return FORMS.get(word) or FORMS.get(word[:1])


def first_word(text: str) -> str:
    head = text[:64].split(None, 1)
    return head[0].lower() if head else ""


def _explain(line: Line, start: str, error: Any) -> Diagnostic:
    """The diagnostic for a Lark exception."""
    text = line.text
    unbalanced = _unbalanced(line)
    if unbalanced is not None:
        return unbalanced
    token = getattr(error, "token", None)
    at = getattr(error, "pos_in_stream", None)
    if token is not None and token.type != "$END":
        at = token.start_pos
    code, _ = code_end(text)
    accepts = set(getattr(error, "accepts", None) or getattr(error, "expected", None) or ())
    accepts |= set(getattr(error, "allowed", None) or ())
    wanted = _wanted(accepts)
    form = form_of(line, start) if start != "expression" else None
    if at is None or at >= code or (token is not None and token.type == "$END"):
        end = _last_visible(text, code)
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


def _wanted(accepts: set[str]) -> str:
    if {"NUMBER", "NAME", "V_CALL"} <= accepts:
        return "an expression"
    if "WORD" in accepts:
        accepts = accepts - {"LBRACE", "QUOTE", "DBLQUOTE"}
    if not accepts or len(accepts) > 20:
        return ""
    operators = accepts & set(_OPERATORS)
    names = sorted({_NAMES.get(t, "") for t in accepts - operators} - {""})
    if len(names) > 5:
        return ""
    if operators:
        names.append("an operator")
    return ", ".join(names[:-1]) + (" or " if len(names) > 1 else "") + names[-1] if names else ""


def code_end(text: str) -> tuple[int, list[tuple[int, str]]]:
    """Where the code ends that is not comment, and the visible characters outside comments with their places."""
    visible: list[tuple[int, str]] = []
    at, n, fresh = 0, len(text), False  # fresh: nothing but blanks so far on a continuation line
    while at < n:
        c = text[at]
        before = text[at - 1] if at else "\n"
        if (
            c == ";"
            or (c == "/" and text[at : at + 2] == "//" and before in " \t\n")
            or (c == "$" and before in " \t\n,")
            or (c == "*" and fresh)
        ):
            at = text.find("\n", at)
            if at < 0:
                break
            continue
        if c == "\n":
            fresh = True
        elif c not in " \t\r\f":
            fresh = False
            visible.append((at, c))
        at += 1
    return (visible[-1][0] + 1 if visible else 0), visible


def _last_visible(text: str, end: int) -> int:
    return max(0, min(end, len(text)))


def _unbalanced(line: Line) -> Diagnostic | None:
    """An unclosed or unopened bracket or quote, when the line has one."""
    closing = {")": "(", "}": "{"}
    stack: list[tuple[int, str]] = []
    for at, c in code_end(line.text)[1]:
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
    near = suggest(word, known)
    return Diagnostic(
        "error",
        "E105",
        f"there is no `{word}` card",
        line.span_at(0, len(word)),
        f"did you mean `{near}`?" if near else None,
    )
