"""The words of a command: quotes, `$name`, `$&vector`, braces. Nothing here runs a program or reads another file."""

from __future__ import annotations

import re

from .budget import TEXT
from .errors import CommandError
from .numbers import short

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .session import Session

NAME = re.compile(r"\$([?#]?)(?:\{([\w.@]+)\}|([A-Za-z_][\w]*))(?:\[([^\[\]]*)\])?")
VECTOR = re.compile(
    r"\$&(?:\{([^{}]+)\}|((?:\w+\.)?[viVI]\([^()]*\)|@[\w.]+\[\w+\]|[A-Za-z_][\w.#]*)((?:\[[^\[\]]*\])*))"
)


def substituted(s: Session, text: str, shown: bool = False) -> str:
    """`$name` and `$&vector` put in. `shown`: for people, with the digits that ngspice shows; else with all of them."""
    if "`" in _outside_quotes(text):
        raise CommandError(
            "E163", "backquotes run a program: there is no shell here", "write the words themselves"
        )
    if "$" not in text:
        return text

    length = 0

    def put_in(text: str) -> str:
        nonlocal length
        length += len(text)
        s.budget.put_in(length)
        return text

    def vector(found: re.Match[str]) -> str:
        name = found[1] or found[2] + (found[3] or "")
        values = s.vectors(substituted(s, name))[0].values
        return put_in(" ".join(_shown(x, shown) for x in values.tolist()))

    def variable(found: re.Match[str]) -> str:
        what, name, index = found[1], found[2] or found[3], found[4]
        if what == "?":
            return "1" if s.variable(name) is not None else "0"
        value = s.variable(name)
        if value is None:
            raise CommandError(
                "E162",
                f"there is no variable `${name}`",
                f"set {name} = .. makes one; the value of a vector is $&{name}",
            )
        if what == "#":
            return str(len(value)) if isinstance(value, list) else "1"
        if index is not None:
            words = value if isinstance(value, list) else [value]
            return put_in(" ".join(_text(w, shown) for w in _chosen(words, substituted(s, index), name)))
        if isinstance(value, list):
            return put_in(" ".join(_text(w, shown) for w in value))
        return put_in(_text(value, shown))

    text = VECTOR.sub(vector, text)
    return NAME.sub(variable, text)


def _outside_quotes(text: str) -> str:
    return re.sub(r"\"[^\"]*\"|'[^']*'", "", text)


def _chosen(words: list[object], index: str, name: str) -> list[object]:
    first, dash, last = index.partition("-")
    try:
        low = int(float(first)) if first.strip() else 1
        high = (int(float(last)) if last.strip() else len(words)) if dash else low
    except (ValueError, OverflowError):
        raise CommandError("E161", f"`{index}` is no place in ${name}") from None
    if not 1 <= low <= len(words) or not 1 <= high <= len(words):
        raise CommandError("E162", f"${name} has words 1 to {len(words)}, not {index}")
    return words[low - 1 : high]


def _text(value: object, shown: bool) -> str:
    if value is True:
        return "TRUE"
    if isinstance(value, float):
        return (
            (short(value) if shown else repr(value))
            if not abs(value) < 1e9 or value != int(value)
            else str(int(value))
        )
    return str(value)


def shown(value: object) -> str:
    """A variable as `set` lists it."""
    if isinstance(value, list):
        return "( " + " ".join(_text(w, True) for w in value) + " )"
    return "" if value is True else _text(value, True)


def _shown(value: complex | float, shown: bool) -> str:
    if isinstance(value, complex):
        return f"{_shown(value.real, shown)},{_shown(value.imag, shown)}"
    return short(value) if shown else repr(value)


def split(text: str, braces: bool = True) -> list[str]:
    """Words between blanks, quotes taken off; `=` is a word of its own where blanks stand about it only."""
    out: list[str] = []
    for found in re.finditer(r"(?:\"[^\"]*\"|'[^']*'|[^\s\"'])+", text):
        word = found[0]
        if word[0] in "\"'" and word.find(word[0], 1) == len(word) - 1:
            out.append(word[1:-1])
            continue
        plain = re.sub(r"\"([^\"]*)\"|'([^']*)'", lambda m: m[1] if m[1] is not None else m[2], word)
        out += _braced(plain) if braces else [plain]
    return out


def without_commas(text: str, within: bool = True) -> str:
    """A comma behind a word separates it from the next one, as in ngspice: a blank in its place. Those in quotes stay, and
    where not `within` those in brackets."""
    found, quote, depth = "", "", 0
    for k, c in enumerate(text):
        if c in "'\"" and quote in ("", c):
            quote = "" if quote else c
        depth += (c in "([") - (c in ")]")
        separates = c == "," and not quote and (within or depth < 1) and k and not text[k - 1].isspace()
        found += " " if separates else c
    return found


def _braced(word: str, made: list[int] | None = None) -> list[str]:
    """a{b,c}d is abd acd; {x} is x. `made`: how much text this came to."""
    made = [0] if made is None else made
    made[0] += len(word)
    if made[0] > TEXT:
        raise CommandError("E165", f"braces make more than {TEXT:,} characters here")
    found = re.search(r"\{([^{}]*)\}", word)
    if found is None:
        return [word]
    before, behind = word[: found.start()], word[found.end() :]
    return [w for part in found[1].split(",") for w in _braced(before + part + behind, made)]


def without_braces(text: str) -> str:
    """In an expression braces are brackets; about a part of a name, as in {$plot}.v(1), they only say where it ends."""
    if "{" not in text:
        return text
    text = re.sub(r"(?<=[\w.])\{([\w.]+)\}|\{([\w.]+)\}(?=[\w.])", lambda m: m[1] or m[2], text)
    return text.replace("{", "(").replace("}", ")")


def redirected(text: str) -> tuple[str, str, bool] | None:
    """Of `words > file`: the words, the file, whether what is said goes behind what the file has (`>>`). The `>` stands
    outside of quotes and brackets; a comparison with a number, `> 0.5`, is none."""

    def hidden(found: re.Match[str]) -> str:
        return " " * len(found[0])

    plain = re.sub(r"\"[^\"]*\"|'[^']*'", hidden, text)
    plain = re.sub(r"\([^()]*>[^()]*\)", hidden, plain)
    found = re.search(r"(>>?)\s*([^\s<=>\"'][^\s>\"']*)\s*$", plain)
    if found is None or not re.search(r"[A-Za-z_]", found[2]) or re.fullmatch(r"[\d.]+[A-Za-z]*", found[2]):
        return None
    return text[: found.start()], found[2], found[1] == ">>"
