"""Python that films run and the page has in JavaScript: what is translated, and that nothing else is passed over."""

from __future__ import annotations

import shutil
import subprocess
from json import dumps, loads

import pytest

from emsim.outputs.glyphs import script as glyphs
from emsim.outputs.translate import Unknown, script

SOURCE = '''"""A module."""

from __future__ import annotations

import math

from .beside import far

LIMIT = 3
NAMES = ["a", "b"]


def first(x: float, s: dict, more: float = 2.0) -> list:
    """Everything at once."""
    total, found = 0.0, []
    for k in range(1, 4):
        if k == 2 or not x:
            continue
        total += k * more ** 2 if k < LIMIT else -k
    while total > 10:
        total -= 10
    for i, j in [[1, 2], [3, 4]]:
        found.append([i + j, (i - j) / 2])
    evens = [k for k in range(6) if k % 2 == 0]
    named = "here" if "key" in s else "gone"
    low = s.get("low", 7)
    a = b = math.hypot(*[3, 4])
    return [total, found, evens, f"{named} {low}", a + b, NAMES[-1], evens[1:], s.get("none") is None, x in [1, 2],
            all(v < 9 for v in evens), {"at": len(found)}, far(x)]
'''


def far(x: float) -> float:
    return 100 * x


def test_a_translation_gives_what_python_gives():
    node = shutil.which("node")
    if node is None:
        pytest.skip("needs node; the browser tests compare every glyph")
    scope: dict = {"far": far}
    exec(SOURCE.replace("from .beside import far\n", ""), scope)
    made = script([SOURCE], "{ first }", ("far",))
    text = (
        f"const far = (x) => 100 * x; const m = {made}; console.log(JSON.stringify(m.first(1, {{key: 1}})));"
    )
    done = subprocess.run([node, "-e", text], capture_output=True, text=True, check=True, timeout=60)
    assert loads(done.stdout) == loads(dumps(scope["first"](1, {"key": 1})))


@pytest.mark.parametrize(
    "body",
    [
        "return {k: 1 for k in range(3)}", "with a: pass", "return a @ a", "return a if a < 1 < 2 else 0",
        "return sum(k for k in a)",
        "try:\n        pass\n    except KeyError:\n        pass", "return f'{a:.3f}'", "return max(a, key=len)", "return a in a",
        "return lambda: a", "return a[::2]", "return a // 2", "return [i for i in a for j in a]", "global a", "del a",
    ],
)  # fmt: skip
def test_what_is_not_translated_is_told(body):
    with pytest.raises(Unknown):
        script([f"def f(a):\n    {body}\n"], "{ f }")


def test_names_that_nobody_says_are_told():
    with pytest.raises(Unknown, match="elsewhere"):
        script(["def f(a):\n    return elsewhere(a)\n"], "{ f }")
    with pytest.raises(Unknown, match="two things are called f"):
        script(["def f(a):\n    return a\n", "def f(b):\n    return b\n"], "{ f }")


def test_all_glyphs_are_translated():
    assert glyphs().count("function ") > 40
