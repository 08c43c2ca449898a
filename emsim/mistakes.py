"""What is said of a line that the grammar does not accept: Lark reads it again and knows what would have fitted."""

from __future__ import annotations

from .diagnostics import Diagnostic, suggest
from .elements import LETTERS
from .lark_grammar import parser
from .syntax import CARD_WORDS, LineError, code_end, first_word

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .source import Line
    from .syntax import Tree

MAX_NESTING = 100


def lark_line(line: Line, start: str) -> Tree:
    """syntax.parse_line by Lark itself. Raises LineError."""
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
    "NAME_IN_QUOTES": "a name or value",
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
    "motor": "MOTOR name n+ n- joint kt= (or ke=, kv=) [r=] [l=] [j=] [b=] [gear=]",
    "pot": "POT name top wiper bottom joint r= range=(a,b)",
    "spring": "SPRING name joint k= [q0=], or SPRING name P Q k= [l0=]",
    "damper": "DAMPER name joint c=, or DAMPER name P Q c=",
    "friction": "FRICTION name joint fc= [fs=] or mu= [mus=] [radius=] [vs=] [b=]",
    "freewheel": "FREEWHEEL name joint dir=1",
    "stop": "STOP name joint [min=] [max=] [e=] or k= [c= or e=]",
    "gear": "GEAR name j1 j2 ratio=",
    "belt": "BELT name j1 j2 r1= r2= k= [c=] [f0=] [cross=yes]",
    "cam": "CAM name follower cam lift={expression} [k= or e=]",
    "force": "FORCE name P dir=(x,y) value|{expression}|PULSE(..)",
    "torque": "TORQUE name joint tau=value|{expression}|PULSE(..)",
    "drive": "DRIVE name joint q={expression}",
    "contact": "CONTACT name P Q line=(nx,ny) or rq= [r=] [e=] or k= [c= or e=]",
    "transducer": "TRANSDUCER name n+ n- joint C={..}|L={..}|K={..}|W={..}, or name (n1+ n1- n2+ n2- ..) (j1 j2 ..) W={..}",
}


# a machine card is told from a SPICE line by its mark
MARKS = {
    "body": "m=, shape= or fixed=",
    "point": "a name with a dot",
    "joint": "its kind (pin, slide, weld, ...) as the fourth word",
    "motor": "kt=, ke=, kv=, vnom= or model=",
    "pot": "range=",
    "spring": "k=",
    "damper": "c=",
    "friction": "fc= or mu=",
    "freewheel": "dir=",
    "stop": "min= or max=",
    "gear": "ratio= or lead=",
    "belt": "r1=",
    "cam": "lift=",
    "force": "dir=, fx= or fy=",
    "torque": "tau=",
    "drive": "q= or qd=",
    "contact": "k=, e=, line= or rq=",
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
    code, _ = code_end(text)
    accepts = set(getattr(error, "accepts", None) or getattr(error, "expected", None) or ())
    accepts |= set(getattr(error, "allowed", None) or ())
    wanted = _wanted(accepts)
    form = form_of(line, start) if start not in ("expression", "vectors", "let") else None
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
