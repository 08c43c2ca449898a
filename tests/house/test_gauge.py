"""The project gets simpler: what gauge.py counts stays below ceilings that only come down."""

from __future__ import annotations

import ast
import json
from collections import Counter
from pathlib import Path

import gauge
import pytest

CEILINGS = gauge.ceilings()


@pytest.fixture(scope="module")
def found() -> dict[str, gauge.Count]:
    return {count.name: count for count in gauge.counts()}


def test_each_count_has_a_ceiling_and_a_goal(found):
    assert list(found) == list(CEILINGS)
    assert all(row["goal"] <= row["ceiling"] for row in CEILINGS.values())


@pytest.mark.parametrize("name", CEILINGS)
def test_below_its_ceiling(name, found):
    count = found[name]
    where = "".join(f"\n  {place}" for place in count.who[:20])
    assert count.value <= CEILINGS[name]["ceiling"], f"{name}: python tests/house/gauge.py tells more{where}"


def test_ceilings_only_come_down(monkeypatch, tmp_path):
    path = tmp_path / "ceilings.json"
    path.write_text(json.dumps({"a": {"ceiling": 5, "goal": 1}, "b": {"ceiling": 5, "goal": 1}}))
    monkeypatch.setattr(gauge, "CEILINGS", path)
    found = gauge.lowered([gauge.Count("a", 3), gauge.Count("b", 9)])
    assert (found["a"]["ceiling"], found["b"]["ceiling"]) == (3, 5)


def test_files_of_tests_have_names_of_their_own():
    # pytest imports them as top-level modules, so that two of one name end its collection
    tests = Path(__file__).parents[1]
    names = Counter(
        path.name for path in tests.rglob("test_*.py") if not (path.parent / "__init__.py").exists()
    )
    assert [name for name, files in names.items() if files > 1] == []


def test_files_of_tests_import_no_package_of_tests():
    # there is none: `python -m pytest` finds the folder beside it, the README's `pytest` does not
    tests = Path(__file__).parents[1]
    found = [
        path.name
        for path in tests.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if (isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "tests")
        or (isinstance(node, ast.Import) and any(a.name.split(".")[0] == "tests" for a in node.names))
    ]
    assert found == []


RUST = """
/// Said.
pub const SAID: f64 = 1.0;
const SHARED: f64 = 2.0;

const SILENT: usize = 3;
const BESIDE: i32 = 4; // why four
const TABLE: [f64; 2] = [0.0, 1.0];

pub struct Wide {
    pub(crate) a: f64,
    b: Vec<f64>,
}

trait Declared {
    fn asked(&self, a: f64, b: f64);
}

fn nested(&mut self, set: &mut dyn FnMut(&mut Work, f64) -> f64, /* s */ t: (f64, f64)) -> [f64; 2] {
    if true {
    }
    // in (0, 1]
    one
}

fn short() -> f64 { 1.0 }
"""


def test_rust_is_read_as_written(tmp_path):
    source = tmp_path / "emsim" / "engine" / "src"
    source.mkdir(parents=True)
    (source / "a.rs").write_text(RUST + "\n#[cfg(test)]\nmod tests {\n    const UNCOUNTED: f64 = 1.0;\n}\n")
    rust = gauge.Rust(tmp_path)
    said = {place.split()[1]: ok for place, _, ok in rust.constants()}
    assert said == {"SAID": True, "SHARED": True, "SILENT": False, "BESIDE": True, "TABLE": False}
    assert [(place.split()[1], *rest) for place, *rest in rust.functions()] == [
        ("asked", 1, 2), ("nested", 6, 2), ("short", 1, 0),
    ]  # fmt: skip
    assert rust.structs() == [("emsim/engine/src/a.rs Wide", 2)]


PYTHON = """
MOST = -2 * 3
NAMES = ("a",)


class Box:
    kind: str

    def __init__(self, a, *, b=1):
        self.a, other.b = a, b
        with open(a) as self.file:
            pass

    def late(self):
        from . import c
"""


def test_python_is_read_as_written(tmp_path):
    package = tmp_path / "emsim"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "a.py").write_text(PYTHON)
    (package / "c.py").write_text("TYPE_CHECKING = False\nif TYPE_CHECKING:\n    from .a import Box\n")
    python = gauge.Python(tmp_path)
    assert python.numbers() == ["emsim.a MOST"]
    assert python.functions() == [("emsim.a __init__", 4, 2), ("emsim.a late", 2, 0)]
    assert python.classes() == [("emsim.a Box", 3, 2)]
    # lazy and for types alone, each counts
    assert gauge.knots(python.imports()) == [["emsim.a", "emsim.c"]]


def test_knots_are_circles_not_chains():
    edges = {("a", "b"), ("b", "c"), ("c", "b"), ("c", "d"), ("d", "e"), ("e", "d"), ("d", "f"), ("f", "d")}
    assert gauge.knots(edges) == [["d", "e", "f"], ["b", "c"]]


def test_statements_hold_no_expressions():
    tree = ast.parse("if a:\n    try:\n        b = 1\n    except c:\n        d = 2\nelse:\n    e = 3\n")
    stored = [n.targets[0].id for n in gauge._statements(tree) if isinstance(n, ast.Assign)]
    assert stored == ["b", "d", "e"]
