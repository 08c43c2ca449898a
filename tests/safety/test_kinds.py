"""Every kind of deck that once gave a wrong result without a word is held by a test that exists and is not skipped."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import pytest
from kinds import KINDS

TESTS = Path(__file__).resolve().parent.parent


@cache
def functions_of(file: str) -> dict[str, list[str]]:
    """Test functions of a file, each with the names that its decorators are made of."""
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    return {
        node.name: [
            part.attr
            for decorator in node.decorator_list
            for part in ast.walk(decorator)
            if isinstance(part, ast.Attribute)
        ]
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_kind_of_wrong_result_is_held_by_a_test(kind):
    assert KINDS[kind], kind
    for test in KINDS[kind]:
        file, name = test.split("::")
        found = functions_of(file)
        assert found if name == "*" else name in found, test
        if name != "*":
            assert not {"skip", "xfail"} & {*found[name]}, f"{test} is not run"
