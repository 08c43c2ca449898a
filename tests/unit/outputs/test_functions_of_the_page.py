"""The page's functions, and those of columns, give what sources give: every line of functions.py at many places."""

from __future__ import annotations

import json
import math
import shutil
import subprocess

import numpy as np
import pytest

from emsim.assemble.behaviour import Compiler
from emsim.functions import BY_TREE, FUNCTIONS, KNOWN, OF_ROWS, script
from emsim.outputs import html

PLACES = [-7.5, -2.5, -1.0, -0.75, -0.5, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.5, 3.0, 40.0]
POINTS = (0.0, 1.0, 1.0, 3.0, 2.0, -1.0)


def arguments(least: int) -> list[tuple[float, ...]]:
    if least == 1:
        return [(x,) for x in PLACES]
    if least == 2:
        return [(x, y) for x in PLACES for y in (-1.5, 0.5, 2.0, 3.0)]
    return [(x, *POINTS[: least - 1]) for x in PLACES]


CASES = {
    name: [(x, *POINTS) for x in PLACES] if name in ("pwl", "table") else arguments(f.least)
    for name, f in KNOWN.items()
}


def number(name: str, x: tuple[float, ...]) -> float | None:
    """The value in sources; None where there is none."""
    try:
        value = float(KNOWN[name].source(*x))
    except (ValueError, OverflowError, ZeroDivisionError):
        return None
    return value if math.isfinite(value) else None


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_page_computes_what_sources_do():
    asked = "".join(
        f"found[{json.dumps(name)}] = {json.dumps(cases)}.map((x) => FUNCTIONS[{json.dumps(name)}](...x));\n"
        for name, cases in CASES.items()
    )
    text = (
        html._file("data.js")
        + script()
        + "\nconst found = {};\n"
        + asked
        + "console.log(JSON.stringify(found));"
    )
    done = subprocess.run(["node", "-"], input=text, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for name, cases in CASES.items():
        for x, got in zip(cases, found[name], strict=True):
            if (value := number(name, x)) is not None:
                assert got == pytest.approx(value, rel=1e-12, abs=1e-12), (name, x)


@pytest.mark.parametrize("name", [name for name, f in KNOWN.items() if f.column is not None])
def test_columns_are_computed_as_sources_are(name):
    function = KNOWN[name].of_columns(np)
    with np.errstate(all="ignore"):
        got = function(*map(np.array, zip(*CASES[name], strict=True)))
    for x, y in zip(CASES[name], np.broadcast_to(got, len(CASES[name])), strict=True):
        if (value := number(name, x)) is not None:
            assert y == pytest.approx(value, rel=1e-12, abs=1e-12), (name, x)


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.name)
def test_sources_know_each(function):
    assert (function.graph == BY_TREE) == hasattr(Compiler, f"_fn_{function.name}")
    assert function.graph is not None


def test_what_a_function_says_of_itself_holds():
    for f in (*FUNCTIONS, *OF_ROWS):
        for x in CASES[f.name]:
            value, mirrored = number(f.name, x), number(f.name, (-x[0], *x[1:]))
            if value is None or mirrored is None:
                continue
            assert not f.odd or mirrored == pytest.approx(-value, rel=1e-12), f.name
            assert not f.even or mirrored == pytest.approx(value, rel=1e-12), f.name
            assert not f.positive or value >= 0.0, f.name
