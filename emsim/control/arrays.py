"""Vectors made of others: compose, cross, reshape, transpose, diff."""

from __future__ import annotations

import re

import numpy as np

from ..units import spice_number
from . import words
from .base import Command
from .errors import CommandError, usage
from .functions import MOST
from .numbers import number, whole
from .plots import Vector

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .program import Statement
    from .session import Session

COMPOSE = "compose name values v .., or name start= stop= step=|lin=, center= span=, dec=|oct=|log="


def compose(s: Session, text: str, at: Statement) -> None:
    name, _, rest = text.strip().partition(" ")
    if not name or not rest:
        usage(COMPOSE, "a name and values are needed")
    rest = re.sub(r"\s*=\s*", "=", rest)
    given = rest.split()
    if given[0].lower() == "values":
        listed = rest.strip()[6:].strip()
        found = s.vectors(listed.replace(",", " ") if "(" not in listed else listed)
        values = np.concatenate([v.values for v in found]) if found else np.zeros(0)
        if not len(values):
            usage(COMPOSE, "there are no values")
    else:
        options: dict[str, float] = {}
        for word in given:
            key, equals, value = word.partition("=")
            found_number = s.numbers(value)[0] if equals and value else None
            if found_number is None:
                usage(COMPOSE, f"`{word}` is no word=number")
            options[key.lower()] = found_number
        values = _series(options)
    s.plots.current.add(Vector(name, values, "", s.plots.current))


def _series(o: dict[str, float]) -> np.ndarray:
    strange = set(o) - {
        "start", "stop", "step", "lin", "dec", "oct", "log", "center", "span", "gauss", "random", "unif",
    }  # fmt: skip
    if strange:
        usage(COMPOSE, f"`{min(strange)}` is none of its words")
    if "center" in o or "span" in o:
        if not {"center", "span"} <= set(o):
            usage(COMPOSE, "center= and span= go together")
        o.setdefault("start", o["center"] - o["span"] / 2)
        o.setdefault("stop", o["center"] + o["span"] / 2)
    count = next((o[k] for k in ("lin", "log", "dec", "oct") if k in o), None)
    if "start" not in o or ("stop" not in o and not {"step", "lin"} <= set(o)):
        usage(COMPOSE, "start= and stop= are needed, or start=, step= and lin=")
    start = o["start"]
    if "step" in o:
        step = o["step"]
        if not step:
            usage(COMPOSE, "step=0 makes no series")
        n = int(o["lin"]) if "lin" in o else int(np.floor((o["stop"] - start) / step + 1e-9)) + 1
        _check(n)
        return start + step * np.arange(n)
    stop = o["stop"]
    if count is None:
        usage(COMPOSE, "step=, lin=, dec=, oct= or log= is needed")
    if "lin" in o:
        _check(count)
        return np.linspace(start, stop, int(count))
    if not (start > 0 and stop > 0):
        usage(COMPOSE, "by ratios from a positive start to a positive stop")
    points: float = (
        count if "log" in o else count * abs(np.log(stop / start) / np.log(10.0 if "dec" in o else 2.0)) + 1
    )
    _check(points)
    return np.geomspace(start, stop, int(np.floor(points + 1e-9)))


def _check(n: float) -> None:
    if not 1 <= n < MOST:
        raise CommandError("E161", f"a vector of {n:g} numbers", f"1 to {MOST:g} are possible")


def cross(s: Session, text: str, at: Statement) -> None:
    """Of several vectors the numbers at one place."""
    given = words.split(text)
    if len(given) < 3:
        usage("cross name place vector ..", "a name, a place and vectors are needed")
    place, found = whole(given[1], "the place"), [s.plots.vector(n) for n in given[2:]]
    if any(not 0 <= place < len(v) for v in found):
        raise CommandError("E164", f"a vector has no place {place}")
    s.plots.current.add(
        Vector(given[0], np.array([v.values[place] for v in found]), found[0].unit, s.plots.current)
    )


def reshape(s: Session, text: str, at: Statement) -> None:
    form = "reshape vector .. [n][m]"
    found = re.match(r"([^\[]*)((?:\[[^\[\]]*\])*)\s*$", text)
    if found is None or not found[1].strip():
        usage(form, "vectors and dimensions are needed")
    places = [part.replace(",", " ") for part in re.findall(r"\[([^\[\]]+)\]", found[2])]
    dims = tuple(int(n) for part in places for n in s.numbers(part))
    for name in found[1].split():
        v = s.plots.vector(name)
        if dims and int(np.prod(dims)) != len(v):
            raise CommandError("E164", f"{len(v)} numbers are not {'x'.join(map(str, dims))}")
        v.dims = dims if len(dims) > 1 else ()


def transpose(s: Session, text: str, at: Statement) -> None:
    for name in words.split(text):
        v = s.plots.vector(name)
        if len(v.dims) < 2:
            raise CommandError("E164", f"`{name}` has one dimension")
        v._values = np.ascontiguousarray(v.values.reshape(v.dims).swapaxes(-1, -2)).reshape(-1)
        v.dims = (*v.dims[:-2], v.dims[-1], v.dims[-2])


TOLERANCES = {"diff_abstol": 1e-12, "diff_reltol": 1e-3, "diff_vntol": 1e-6}


def diff(s: Session, text: str, at: Statement) -> None:
    """Where the vectors of two plots differ by more than the tolerances."""
    given = words.split(text)
    if len(given) < 2:
        usage("diff plot plot [vector ..]", "two plots are needed")
    a, b = s.plots.get(given[0]), s.plots.get(given[1])
    limits = {
        k: float(s.variables[k]) if isinstance(s.variables.get(k), float) else v
        for k, v in TOLERANCES.items()
    }
    asked = {n.lower() for n in given[2:]}
    for v in a.sorted():
        if asked and v.key not in asked:
            continue
        w = b.vectors.get(v.key)
        if w is None:
            s.say(f">>> {v.type} vector {v.name} in {a.name} not in {b.name}, or of wrong type")
            continue
        small = limits["diff_vntol"] if v.unit == "V" else limits["diff_abstol"]
        if len(v) != len(w):
            s.say(f">>> {v.name} is {len(v)} long in {a.name} and {len(w)} long in {b.name}")
        n = min(len(v), len(w))
        x, y = v.values[:n], w.values[:n]
        far = np.abs(x - y) > limits["diff_reltol"] * np.maximum(np.abs(x), np.abs(y)) + small
        for k in np.flatnonzero(far):
            s.say(f"{a.name}.{v.name}[{k}] = {_shown(x[k])}    {b.name}.{v.name}[{k}] = {_shown(y[k])}")
    for w in b.sorted():
        if w.key not in a.vectors and (not asked or w.key in asked):
            s.say(f">>> {w.type} vector {w.name} in {b.name} not in {a.name}, or of wrong type")


def _shown(x: complex) -> str:
    return (
        f"{number(x.real)},{number(x.imag)}"
        if isinstance(x, (complex, np.complexfloating))
        else number(float(x))
    )


COMMANDS = (
    Command("compose", COMPOSE, "makes a vector of numbers or a series", compose),
    Command("cross", "cross name place vector ..", "a vector of one place of several others", cross),
    Command("reshape", "reshape vector .. [n][m]", "gives a vector several dimensions", reshape),
    Command("transpose", "transpose vector ..", "exchanges the last two dimensions", transpose),
    Command("diff", "diff plot plot [vector ..]", "where the vectors of two plots differ", diff),
)

__all__ = ["COMMANDS", "spice_number"]
