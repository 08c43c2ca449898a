"""The command line, parsed by hand: argparse alone would cost a tenth of the start-up budget.

A verb lists its options once, as `Option`s; the parser, the suggestions and `emsim help VERB` read that list.
Accepted spellings: `-o FILE`, `-oFILE`, `--csv FILE`, `--csv=FILE`; `--` ends the options; `-` is stdin.
"""

from __future__ import annotations

from os.path import exists

from ..diagnostics import did_you_mean, suggest
from ..units import scale_of, spice_number, split_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence


class UsageError(Exception):
    """The command line is wrong: exit code 2."""


class Option:
    """One option. `names`: every spelling, stored under the first long one; `value`: what help calls its
    value, "" for a switch; `repeat`: may be given several times."""

    __slots__ = ("help", "key", "names", "repeat", "value")

    def __init__(self, names: str, help: str, value: str = "", repeat: bool = False) -> None:
        self.names = names.split()
        self.key = next(name for name in self.names if name.startswith("--"))[2:]
        self.help, self.value, self.repeat = help, value, repeat


class Arguments:
    """What was given: positional words, switches and values by option key."""

    __slots__ = ("_given", "words")

    def __init__(self) -> None:
        self.words: list[str] = []
        self._given: dict[str, list[str]] = {}

    def has(self, key: str) -> bool:
        return key in self._given

    def text(self, key: str) -> str | None:
        return self._given[key][-1] if key in self._given else None

    def all(self, key: str) -> list[str]:
        return self._given.get(key, [])

    def number(self, key: str) -> float | None:
        """A positive value with SPICE's scale suffixes or a percent sign."""
        text = self.text(key)
        if text is None:
            return None
        value = number(text)
        if value is None or not 0 < value < float("inf"):
            raise UsageError(f"--{key}: {text!r} is not a positive number")
        return value

    def whole(self, key: str, default: int | None) -> int | None:
        value = self.number(key)
        if value is not None and value != int(value):
            raise UsageError(f"--{key} takes a whole number, 1 or more")
        return default if value is None else int(value)

    def picture(self) -> str | None:
        """The file of --plot."""
        path = self.text("plot")
        if path is not None and not path.endswith((".png", ".svg", ".pdf")):
            raise UsageError(f"--plot {path}: a picture is .png, .svg or .pdf")
        return path

    def deck(self, verb: str) -> str:
        """The one positional word."""
        if len(self.words) == 1:
            return self.words[0]
        if not self.words:
            raise UsageError(f"emsim {verb} needs a deck: emsim {verb} deck.cir")
        from . import VERBS

        # emsim chekc deck.cir
        first = self.words[0]
        near = suggest(first, VERBS) if verb == "run" else None
        if verb == "run" and first not in VERBS and first != "-" and not exists(first) and "." not in first:
            raise UsageError(
                f"there is no verb and no deck `{first}`"
                + (
                    f"; did you mean emsim {near} {self.words[1]}?"
                    if near
                    else f"; verbs: {', '.join(VERBS)}"
                )
            )
        raise UsageError(
            f"one deck at a time, got {len(self.words)}: {' '.join(self.words)}"
            + (f"; did you mean emsim {near} {self.words[1]}?" if near else "")
        )


def parse(args: Sequence[str], options: Sequence[Option]) -> Arguments:
    """Raises UsageError for an unknown option, a missing or an unexpected value."""
    spelled = {name: option for option in options for name in option.names}
    out = Arguments()
    rest = list(args)
    while rest:
        word = rest.pop(0)
        if word == "--":
            out.words += rest
            break
        if not word.startswith("-") or word == "-":
            out.words.append(word)
            continue
        name, equals, value = word.partition("=")
        if not word.startswith("--") and word not in spelled:
            # -oFILE, -Dname=value
            name, value = word[:2], word[2:]
            equals = "glued" if value else ""
        option = spelled.get(name)
        if option is None or (equals == "glued" and not option.value):
            near = suggest(word.partition("=")[0], spelled)
            raise UsageError(
                f"unknown option {word.partition('=')[0]}" + (f", did you mean {near}?" if near else "")
            )
        if option.value and not equals:
            if not rest:
                raise UsageError(f"{name} needs a value: {name} {option.value}")
            value = rest.pop(0)
        elif equals and not option.value:
            raise UsageError(f"{name} takes no value")
        given = out._given.setdefault(option.key, [])
        if given and not option.repeat:
            given.clear()
        given.append(value)
    return out


def describe(options: Sequence[Option]) -> str:
    """The options as help prints them."""
    heads = [", ".join(o.names) + (f" {o.value}" if o.value else "") for o in options]
    width = max(map(len, heads)) + 2
    return "\n".join(f"  {head:<{width}}{option.help}" for head, option in zip(heads, options, strict=True))


def number(text: str) -> float | None:
    """`10u`, `10us`, `1e-3`, `0.5%` as a float; None for anything else."""
    word = text.strip()
    percent = word.endswith("%")
    parts = split_number(word.removesuffix("%"))
    if parts is None:
        return None
    letters = parts[1]
    unit = letters[len(scale_of(letters)[1]) :]
    if unit.lower() not in ("", "s") or (percent and letters):
        return None
    value = spice_number(word.removesuffix("%"))
    return value if value is None or not percent else value / 100


DEFINE = Option("-D --define", "set a .param before the deck is read", "NAME=VALUE", repeat=True)
HELP = Option("-h --help", "this text")
JSON = Option("--json", "one JSON document on stdout instead of tables")
METHOD = Option("--method", "integration method", "NAME")
QUIET = Option("-q --quiet", "no notes, no progress; warnings and errors only")
RELTOL = Option("--reltol", "relative tolerance", "X")


def defines(arguments: Arguments) -> dict[str, str]:
    """-D options as name -> text of the value."""
    out = {}
    for text in arguments.all("define"):
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise UsageError(f"-D {text}: write -D name=value")
        out[name.strip().lower()] = value.strip()
    return out


def overrides(
    given: Arguments, numbers: Sequence[str] = ("reltol", "tmax", "seed")
) -> dict[str, float | str]:
    """The options of the command line that stand above the deck's own."""
    options: dict[str, float | str] = {}
    if method := given.text("method"):
        from ..assemble.options import METHODS, SPECIAL, SPELLINGS

        if method.lower() not in SPELLINGS:
            hint = did_you_mean(method, METHODS + SPECIAL, f"there are {', '.join(METHODS + SPECIAL)}", "{}")
            raise UsageError(f"there is no method {method!r}, {hint}")
        options["method"] = method.lower()
    if dialect := given.text("dialect"):
        from ..dialects import find, unknown

        if find(dialect) is None:
            raise UsageError(", ".join(unknown(dialect)))
        options["dialect"] = dialect.lower()
    for key in numbers:
        if (value := given.number(key)) is not None:
            options[key] = value
    if given.has("pictures"):
        options["pictures"] = 1.0
    return options
