"""Vectors and variables: let, unlet, set, unset, define, undefine, shift, strcmp, setseed."""

from __future__ import annotations

import re

import numpy as np

from ..build_control import OPTIONS
from . import words
from .base import Command
from .errors import CommandError, usage
from .plots import CONSTANTS, Vector
from .vectors import Evaluator

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .program import Statement
    from .session import Session

LET = "let name = expression"
DEFINE = "define name(a, b) expression"
# what `set` can set and emsim heeds; others are kept for $name
MOST_WORDS = 100_000


def let(s: Session, text: str, at: Statement) -> None:
    if not text:
        from .show import display

        display(s, "", at)
        return
    text = words.without_braces(text)
    _, (target, value) = s.tree(text, "let", at)
    name = str(target[1][0]).lower()
    found = Evaluator(s, text).value(value)
    plot, inner = s.plots.current, name
    head, dot, rest = name.partition(".")
    if dot and (other := s.plots.named(head)) is not None and plot.find(name) is None:
        plot, inner = other, rest
    elif plot.find(name) is None and name not in CONSTANTS and s.plots.const.find(name) is not None:
        plot = s.plots.const  # what was made before any analysis goes on counting there
    if plot is s.plots.const and (inner in ("pi", "e", "i", "c") or inner in _fixed(plot)):
        raise CommandError("E164", f"`{inner}` is a constant", "call the vector otherwise")
    if inner == "all":
        raise CommandError("E164", "`all` is every vector of a plot", "call the vector otherwise")
    if len(target[1]) > 1:
        _into(s, plot.find(inner) or s.plots.known(inner), target[1][1:], found, text, inner)
        return
    if (there := plot.find(inner)) is not None:
        inner = there.key  # v(2) is the vector `2`
    known = plot.vectors.get(inner)
    s.budget.make(max(0, found.values.nbytes - (0 if known is None else known.values.nbytes)))
    made = found.copied(inner, plot)
    made._values = np.array(found.values)
    if known is not None and plot.scale is known and len(known) != len(made) and len(plot.vectors) > 1:
        raise CommandError(
            "E164", f"`{inner}` is what the vectors of {plot.name} are over", "call it otherwise"
        )
    plot.add(made)


def _fixed(plot: Any) -> frozenset[str]:
    return frozenset(CONSTANTS)


def _into(s: Session, vector: Vector | None, places: list[Any], value: Vector, text: str, name: str) -> None:
    """let v[2] = .., let v[1][0,3] = ..: the places of the first dimensions."""
    if vector is None:
        raise s.plots.missing(name)
    values = np.array(vector.values, dtype=complex if value.is_complex or vector.is_complex else float)
    shaped = values.reshape(vector.dims) if vector.dims else values
    if len(places) > shaped.ndim:
        raise CommandError("E164", f"`{name}` has {shaped.ndim} dimension{'s'[: shaped.ndim > 1]}")
    chosen: list[slice] = []
    for (kind, parts), rows in zip(places, shaped.shape, strict=False):
        if kind != "range":
            usage(LET, "one place is set at a time")
        ends = [Evaluator(s, text).value(p) for p in parts if p not in ("[", "]", ",")]
        numbers = [int(e.values[0].real) for e in ends]
        if not all(0 <= k < rows for k in numbers):
            raise CommandError("E164", f"`{name}` has places 0 to {rows - 1}, not {max(numbers, key=abs)}")
        chosen.append(slice(numbers[0], numbers[-1] + 1))
    part = shaped[tuple(chosen)]
    if 1 < len(value) < part.size:
        raise CommandError("E164", f"{len(value)} numbers do not fit {part.size} places")
    if len(value) > part.size:
        s.warn(
            f"of {len(value)} numbers the first {'is' if part.size == 1 else f'{part.size} are'} taken, as in ngspice"
        )
    part[...] = value.values[: part.size].reshape(part.shape) if len(value) > 1 else value.values[0]
    vector._values = shaped.reshape(-1)


def unlet(s: Session, text: str, at: Statement) -> None:
    for name in words.split(text):
        found = s.plots.known(name)
        if found is None or found.plot is None:
            raise s.plots.missing(name)
        if found.plot.scale is found and found.plot.has_scale:
            raise CommandError("E164", f"`{name}` is what the vectors of {found.plot.name} are over")
        found.plot.vectors.pop(found.key, None)


# ---- variables ----


def set_(s: Session, text: str, at: Statement) -> None:
    if not text.strip():
        for name in sorted(s.variables):
            value = s.variables[name]
            shown = words.shown(value)
            s.say(f"  {name}\t{shown}".rstrip())
        return
    for name, value in assignments(s, text):
        _set(s, name, value)


def assignments(s: Session, text: str) -> list[tuple[str, Any]]:
    """name, name = value, name = ( words ) of a line, with variables put in."""
    quoted = [m[1] if m[1] is not None else m[2] for m in re.finditer(r"\"([^\"]*)\"|'([^']*)'", text)]
    # quoted text is one word, whatever is in it
    count = iter(range(len(quoted)))
    plain = re.sub(r"\"[^\"]*\"|'[^']*'", lambda m: f"\0{next(count)}\0", text)
    tokens = re.findall(r"[=()]|[^\s=()]+(?:\([^\s()]*\))?[^\s=()]*", plain)

    def value_of(token: str) -> Any:
        if re.fullmatch(r"\0\d+\0", token):
            return words.substituted(s, quoted[int(token[1:-1])])
        # quoted and other text, with no blank between
        token = re.sub(r"\0(\d+)\0", lambda m: quoted[int(m[1])], token)
        return s.parsed(words.substituted(s, token))

    found: list[tuple[str, Any]] = []
    k = 0
    while k < len(tokens):
        name = str(value_of(tokens[k])).lower()
        if name in ("=", "(", ")"):
            usage("set name = value", f"`{name}` stands where a name is wanted")
        k += 1
        if k < len(tokens) and tokens[k] == "=":
            k += 1
            if k >= len(tokens):
                usage("set name = value", f"there is no value for `{name}`")
            if tokens[k] == "(":
                close = tokens.index(")", k) if ")" in tokens[k:] else len(tokens)
                listed = [
                    w
                    for t in tokens[k + 1 : close]
                    for w in (
                        [value_of(t)]
                        if "\0" in t or "$" not in t
                        else map(s.parsed, words.substituted(s, t).split())
                    )
                ]
                if len(listed) > MOST_WORDS:
                    raise CommandError("E165", f"a variable has {MOST_WORDS:,} words at most")
                found.append((name, listed))
                k = close + 1
                continue
            found.append((name, value_of(tokens[k])))
            k += 1
        else:
            found.append((name, True))
    return found


def _set(s: Session, name: str, value: Any) -> None:
    if name == "curplot":
        if str(value).lower() == "new":
            s.plots.new("unknown", "Anonymous", "unknown")
        else:
            s.plots.current = s.plots.get(str(value))
        return
    if name in ("curplottitle", "curplotname", "curplotdate"):
        setattr(
            s.plots.current,
            {"curplottitle": "title", "curplotname": "plotname"}.get(name, "date"),
            str(value),
        )
        return
    if name == "rndseed" and isinstance(value, float):
        s.seed(int(value))
    if name in OPTIONS:
        option_(s, name, value)
    s.variables[name] = value


def option_(s: Session, name: str, value: Any) -> None:
    s.deck.set_option(name, value.lower() if isinstance(value, str) else value)


def option(s: Session, text: str, at: Statement) -> None:
    """option reltol=1e-5: as .options, for the runs that follow."""
    from ..units import spice_number

    if not text.strip():
        for name, value in sorted({**s.deck.flat().options, **s.deck.options}.items()):
            s.say(f"{name} = {value}")
        return
    for name, value in assignments(s, text):
        if isinstance(value, str) and (number := spice_number(value)) is not None:
            value = number
        option_(s, name, value)


def unset(s: Session, text: str, at: Statement) -> None:
    for name in words.split(text):
        if name == "*":
            s.variables.clear()
        s.variables.pop(name.lower(), None)
        s.deck.options.pop(name.lower(), None)


def setseed(s: Session, text: str, at: Statement) -> None:
    from .numbers import whole

    s.seed(whole(text, "the seed") if text else 1)


def shift(s: Session, text: str, at: Statement) -> None:
    """Takes words off the front of a list."""
    from .numbers import whole

    given = words.split(text)
    name = given[0].lower() if given else "argv"
    value = s.variables.get(name)
    if not isinstance(value, list):
        raise CommandError("E162", f"`{name}` is no list of words")
    s.variables[name] = value[whole(given[1], "the count") if given[1:] else 1 :]


def strcmp(s: Session, text: str, at: Statement) -> None:
    """-1, 0 or 1 into a variable, as two words compare."""
    given = words.split(text)
    if len(given) != 3:
        usage("strcmp variable word word", f"three words are needed, there are {len(given)}")
    a, b = given[1:]
    s.variables[given[0].lower()] = float((a > b) - (a < b))


# ---- functions ----


def define(s: Session, text: str, at: Statement) -> None:
    if not text.strip():
        for (name, _), (params, _, body) in s.functions.items():
            s.say(f"{name} ({', '.join(params)}) = {body}")
        return
    found = re.match(r"\s*([A-Za-z_]\w*)\s*\(([^()]*)\)\s*=?\s*(.*)$", text, re.S)
    if found is None:
        usage(DEFINE, "this defines no function")
    name, params, body = (
        found[1].lower(),
        [p.strip().lower() for p in re.split(r"[,\s]+", found[2].strip()) if p.strip()],
        found[3].strip(),
    )
    if not body:
        usage(DEFINE, f"`{name}` has no expression")
    if not params or not all(re.fullmatch(r"[a-z_]\w*", p) for p in params):
        usage(DEFINE, "the arguments are names")
    if len(s.functions) > 10_000:
        raise CommandError("E165", "10,000 functions are the most")
    body = words.without_braces(words.substituted(s, body))
    tree = s.tree(body, "vectors", at)
    if len(tree[1]) != 1:
        usage(DEFINE, "a function is one expression")
    s.functions[name, len(params)] = params, tree[1][0], body


def undefine(s: Session, text: str, at: Statement) -> None:
    for word in words.split(text):
        if word == "*":
            s.functions.clear()
            continue
        found = [key for key in s.functions if key[0] == word.lower()]
        if not found:
            raise CommandError("E162", f"there is no function `{word}`")
        for key in found:
            del s.functions[key]


def alias(s: Session, text: str, at: Statement) -> None:
    """alias name words: what the name stands for; without words, what it stands for now."""
    name, _, words = text.strip().partition(" ")
    if words.strip():
        s.aliases[name.lower()] = words.strip()
        return
    for known, meaning in sorted(s.aliases.items()):
        if not name or known == name.lower():
            s.say(f"{known}\t{meaning}" if not name else meaning)


def unalias(s: Session, text: str, at: Statement) -> None:
    for name in text.lower().split():
        if name == "*":
            s.aliases.clear()
        s.aliases.pop(name, None)


COMMANDS = (
    Command("let", LET, "makes a vector in the current plot, or changes one", let, "let"),
    Command("unlet", "unlet name ..", "takes vectors away", unlet),
    Command(
        "set",
        "set name = value, set name = ( words )",
        "sets a variable; numdgt, width, filetype .. change what others do",
        set_,
        raw=True,
    ),
    Command("unset", "unset name ..", "takes variables away", unset),
    Command(
        "option", "option name = value", "an option for the runs that follow, as .options", option, raw=True
    ),
    Command("options", "options name = value", "the same", option, raw=True),
    Command("setseed", "setseed number", "the seed of sgauss, sunif, rnd, poisson, exponential", setseed),
    Command("shift", "shift list [count]", "takes the first words off a list", shift),
    Command("strcmp", "strcmp variable word word", "compares two words: -1, 0, 1", strcmp),
    Command("define", DEFINE, "defines a function of vectors", define, raw=True, records=True),
    Command("undefine", "undefine name ..", "takes functions away", undefine),
    Command(
        "alias",
        "alias name words",
        "another name for a command and its first words",
        alias,
        raw=True,
        records=True,
    ),
    Command("unalias", "unalias name ..", "takes such names away", unalias),
)
