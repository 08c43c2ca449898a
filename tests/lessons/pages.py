"""Lessons as data: the figures a page states, the edits it proposes, the commands it gives, and their runs.

A page is netlists/lessons/NN_name.md beside its deck; the answers to its exercises are a section of answers.md, read in
the same way. What a machine reads in it:

    3.16 V<!--v_tau-->          a figure: must be the value `v_tau` of the lesson's forms to the digits printed
    70<!--about:steps-->        within 15 %; `min:` and `max:` state a bound
    ```edit                     an edit of the deck: lines `- old` and `+ new`, or options as on the command line
    ```sh                       commands that must run
    ```output                   what the command above prints, word by word; numbers to a part in a thousand

Any other number of the prose must stand in the deck or in an edit, or be small and whole.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import floor, log10, pi

import numpy as np
import pytest
from support import NETLISTS, ROOT

import emsim

sys.path.insert(0, str(ROOT / "emsim" / "docs"))  # the site's modules import one another by bare names
from edits import Edit, blocks, edits

FOLDER = NETLISTS / "lessons"
NAMES = sorted(p.stem for p in FOLDER.glob("*.cir"))
HEADINGS = [
    "What to expect", "Run it", "What to try", "The closed form", "Where the numbers come from", "A question", "Exercises",
]  # fmt: skip

SCALES = {"": 1.0, "k": 1e3, "M": 1e6, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9, "p": 1e-12}
SI = ("V", "A", "s", "Hz", "J", "W", "N", "m", "Ohm", "F", "H", "V/m")
UNITS = {f"{prefix}{unit}": scale for unit in SI for prefix, scale in SCALES.items()}
# units without prefixes, and those that are no power of ten
UNITS |= {
    "": 1.0, "%": 0.01, "degrees": pi / 180, "rad": 1.0, "mrad": 1e-3, "rad/s": 1.0, "rad/s²": 1.0, "m/s²": 1.0, "rpm": pi / 30,
    "1/s": 1.0, "m/s": 1.0, "mm/s": 1e-3, "N m": 1.0, "mN m": 1e-3, "N/m": 1.0, "N s/m": 1.0,
    "N m s/rad": 1.0, "V/rad": 1.0, "kg": 1.0, "kg m²": 1.0,
    "dB": 1.0, "times": 1.0, "steps": 1.0, "million times": 1e6, "million steps": 1e6,
}  # fmt: skip
NUMBER = r"[-+−]?\d(?:[\d ]*\d)?(?:\.\d+)?(?:e[-+]?\d+)?"
WORDS = "|".join(sorted((re.escape(u) for u in UNITS if u), key=len, reverse=True))
MARKED = re.compile(rf"({NUMBER})\s?({WORDS})?\s*<!--(?:(min|max|about):)?(\w+)-->")
PLAIN = re.compile(rf"(?<![\w.])({NUMBER})(?:\s?({WORDS})(?!\w))?")
SUFFIXED = re.compile(r"(?<![\w.])(\d+(?:\.\d*)?(?:e[-+]?\d+)?)(meg|[kmunp])?", re.I)


@dataclass(frozen=True)
class Stated:
    """A number of the text: value in SI units, half of its last digit, and how it is meant."""

    key: str
    kind: str  # "", "min", "max", "about"
    value: float
    half: float
    text: str

    def holds(self, value: float) -> bool:
        match self.kind:
            case "min":
                return value >= self.value
            case "max":
                return abs(value) <= self.value
            case "about":
                return abs(value - self.value) <= 0.15 * abs(self.value)
        return (
            abs(value - self.value) <= 1.02 * self.half
        )  # a value between two digits may be rounded either way


@dataclass(frozen=True)
class Figure:
    """A value of a lesson: by formula, computed without emsim, and as the run shows it. One of the two may be
    missing: arithmetic on the deck's values needs no run, and what a method does with its steps has no formula."""

    key: str
    closed: float | None
    measured: float | None = None
    rel: float = 1e-3  # how far the two may be apart, in parts of the formula's value
    off: float = 0.0  # ... and in the value's own unit


class Page:
    def __init__(self, name: str) -> None:
        self.name = name
        self.deck = (FOLDER / f"{name}.cir").read_text(encoding="utf-8")
        self.text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")

    @property
    def exercises(self) -> list[str]:
        """Their numbers: of a lesson's page, or of the answers to them."""
        return re.findall(r"^\*\*(\d+\.\d+)\*\* ", self.text, re.M)

    @property
    def headings(self) -> list[str]:
        return re.findall(r"^## (.*)$", self.text, re.M)

    @property
    def edits(self) -> list[Edit]:
        return edits(self.text)

    @property
    def stated(self) -> list[Stated]:
        out = []
        for number, unit, kind, key in MARKED.findall(self.text):
            value, half = _number(number)
            scale = UNITS[unit]
            out.append(Stated(key, kind, value * scale, half * scale, f"{number} {unit}".strip()))
        return out

    @property
    def unaccounted(self) -> list[str]:
        """Numbers of the prose that nothing holds: not marked, not in the deck or an edit, not small and whole."""
        prose = re.sub(r"^```\w*\n.*?^```$", "", self.text, flags=re.M | re.S)
        prose = re.sub(
            r"`[^`]*`|^\*\*\d+\.\d+\*\*|^#.*$|\$\$.*?\$\$|\$[^$]*\$|\]\([^)]*\)|\bp\. \d+|\blessons? \d+( and \d+)?",
            " ",
            prose,
            flags=re.S | re.M,
        )
        prose = re.sub(r"<!--.*?-->", "", MARKED.sub(" ", prose))
        known = {_rounded(x) for x in _values(self.deck + "".join(blocks(self.text, "edit")))}
        out = []
        for number, unit in PLAIN.findall(prose):
            value = abs(_number(number)[0])
            fits = _rounded(value * abs(UNITS[unit or ""])) in known or _rounded(value) in known
            year = not unit and 1600 <= value <= 2100 and value == int(value)
            if not (fits or year or (value == int(value) and value <= 12)):
                out.append(f"{number} {unit}".strip())
        return out

    @property
    def bad_formulas(self) -> list[str]:
        """Formulas with decimals, which nothing checks, or with escapes such as `\\,` that Markdown eats."""
        formulas = re.findall(r"\$\$.*?\$\$|\$[^$\n]*\$", self.text, re.S)
        return [f for f in formulas if re.search(r"\d\.\d|\\[^A-Za-z]", f)]


def _number(text: str) -> tuple[float, float]:
    """Value and half a unit of the last digit printed. Zeros at the end of a whole number are digits."""
    plain = text.replace(" ", "").replace("−", "-")
    mantissa, _, power = plain.partition("e")
    digits = len(mantissa.partition(".")[2])
    return float(plain), 0.5 * 10.0 ** (int(power or 0) - digits)


def _values(text: str) -> Iterator[float]:
    """Numbers of a deck as written and with SPICE's scale suffix."""
    for number, suffix in SUFFIXED.findall(text):
        value = float(number)
        yield value
        if suffix:
            yield value * {"meg": 1e6}.get(suffix.lower(), SCALES.get(suffix.lower(), 1.0))


def _rounded(x: float) -> float:
    return 0.0 if x == 0.0 else round(x, 9 - floor(log10(abs(x))))


class Answers(Page):
    """The answers to a lesson's exercises: edits are of the lesson's deck."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        text = (FOLDER / "answers.md").read_text(encoding="utf-8")
        found = re.search(rf"^## {int(name[:2])}\. .*?(?=^## |\Z)", text, re.M | re.S)
        self.text = found[0] if found else ""


class Runs:
    """The runs of a lesson, each made once: the deck as it stands, and with each edit applied."""

    def __init__(self, page: Page, step: str) -> None:
        self.page, self.step = page, step
        self._done: dict[int, emsim.Result] = {}

    @cached_property
    def base(self) -> emsim.Result:
        return self.edit(0)

    def edit(self, k: int) -> emsim.Result:
        """The run with the k-th edit of the page (from 1; 0 is the deck as it stands)."""
        if k not in self._done:
            text, options = self.deck(k)
            self._done[k] = emsim.run(text, energy=True, **options)
        return self._done[k]

    def failure(self, k: int) -> emsim.ConvergenceError:
        """What the k-th edit's run stops with, when the page says that it stops."""
        with pytest.raises(emsim.ConvergenceError) as stopped:
            self.edit(k)
        return stopped.value

    def deck(self, k: int) -> tuple[str, dict]:
        """The edited deck with a finer print step, so that figures between rows are read off well."""
        text, options = self.page.deck, {}
        if k:
            edit = self.page.edits[k - 1]
            text, options = edit.apply(text), _options(edit.options)
        if self.step and ".tran" in text:
            text, n = re.subn(r"(?m)^\.tran (\{[^}]*\}|\S+)", f".tran {self.step}", text)
            assert n == 1
        return text, options


def _options(words: tuple[str, ...]) -> dict:
    out: dict = {}
    queue = list(words)
    while queue:
        match queue.pop(0):
            case "-D":
                name, _, value = queue.pop(0).partition("=")
                out.setdefault("defines", {})[name] = value
            case "--method":
                out["method"] = queue.pop(0)
            case "--reltol":
                out["reltol"] = float(queue.pop(0))
            case word:
                raise AssertionError(f"an edit says {word!r}")
    return out


# the lessons' forms ------------------------------------------------------------------------------------------

Forms = Callable[[Runs], Iterator[Figure]]
FORMS: dict[str, tuple[Forms, str]] = {}
ANSWERS: dict[str, tuple[Forms, str]] = {}


def lesson(name: str, step: str = "") -> Callable[[Forms], Forms]:
    """Registers what a lesson's figures must be. `step`: print step of its runs in place of the deck's."""
    return _registers(FORMS, name, step)


def answers(name: str, step: str = "") -> Callable[[Forms], Forms]:
    """The same for the answers to a lesson's exercises."""
    return _registers(ANSWERS, name, step)


def _registers(where: dict[str, tuple[Forms, str]], name: str, step: str) -> Callable[[Forms], Forms]:
    def register(forms: Forms) -> Forms:
        where[name] = forms, step
        return forms

    return register


# reading runs ------------------------------------------------------------------------------------------------


def crossing(
    run: emsim.Result, name: str, level: float, after: float = 0.0, rising: bool | None = None
) -> float:
    """The first time after `after` at which a column passes a level; straight between points. `rising`: only so."""
    t, y = np.asarray(run.time), np.asarray(run[name]) - level
    up = (y[:-1] < 0) & (y[1:] >= 0)
    down = (y[:-1] > 0) & (y[1:] <= 0)
    passed = up if rising else down if rising is False else up | down
    (found,) = np.nonzero(passed & (t[:-1] >= after))
    k = found[0]
    return float(t[k] - y[k] * (t[k + 1] - t[k]) / (y[k + 1] - y[k]))


def peak(
    run: emsim.Result, name: str, start: float = 0.0, stop: float = np.inf, sign: int = 1
) -> tuple[float, float]:
    """Time and value of the largest (sign=-1: smallest) value in a window, by a parabola through three points."""
    t, y = np.asarray(run.time), sign * np.asarray(run[name])
    inside = np.nonzero((t >= start) & (t <= stop))[0]
    k = int(inside[np.argmax(y[inside])])
    if k in (0, len(t) - 1):
        return float(t[k]), sign * float(y[k])
    a, b, c = np.polyfit(t[k - 1 : k + 2] - t[k], y[k - 1 : k + 2], 2)
    return float(t[k] - b / (2 * a)), sign * float(c - b * b / (4 * a))
