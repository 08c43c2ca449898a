"""The VS Code extension: its grammar against the language, its client against the real server."""

from __future__ import annotations

import json
import re
import shutil
import stat
import subprocess
import sys

import pytest
from support import ROOT

from emsim.cards import CARDS
from emsim.editor import textmate
from emsim.editor.layout import formatted
from emsim.source import Reading, SourceFile, decode

FOLDER = ROOT / "emsim" / "editor" / "vscode"
DECKS = sorted([*(ROOT / "netlists").rglob("*.cir"), *(ROOT / "tests" / "decks" / "bad").glob("*.cir")])
needs_node = pytest.mark.skipif(shutil.which("node") is None, reason="needs node")


def test_the_grammar_is_the_one_made_from_the_specs():
    assert (FOLDER / "emsim.tmLanguage.json").read_text(encoding="utf-8") == textmate.text(), (
        "run python -m emsim.editor.textmate > emsim/editor/vscode/emsim.tmLanguage.json"
    )


def test_every_file_that_the_manifest_names_is_there():
    manifest = json.loads((FOLDER / "package.json").read_text())
    parts = manifest["contributes"]
    named = [manifest["main"], parts["languages"][0]["configuration"], parts["grammars"][0]["path"]]
    assert all((FOLDER / name).exists() for name in named)
    assert json.loads((FOLDER / "language-configuration.json").read_text())["comments"]
    commands = {command["command"] for command in parts["commands"]}
    registered = set(re.findall(r'registerCommand\("([\w.]+)"', (FOLDER / manifest["main"]).read_text()))
    assert commands == registered and parts["grammars"][0]["scopeName"] == textmate.grammar()["scopeName"]


def scope_of(line: str) -> str:
    """The name that the grammar gives the first word of a line which is not the first."""
    for rule in textmate.grammar()["patterns"]:
        pattern = rule.get("match") or rule.get("begin")
        if pattern is None or pattern.startswith(r"\A"):
            continue
        if found := re.match(pattern, line):
            return rule.get("name") or rule["captures"]["1"]["name"].partition(" ")[0] * bool(found[1])
    return ""


@pytest.mark.parametrize("path", DECKS, ids=lambda p: p.stem)
def test_cards_are_coloured_as_they_are_read(path):
    file = SourceFile("x", decode(path.read_bytes()) or "")
    reading = Reading(file, True)
    for rule, _, where, _, _, place in reading.cards:
        if place >= 0 or rule is None:
            continue
        line = reading.line(where)
        if "\n" in line.text:
            continue  # the mark may stand on a continuation line
        scope = scope_of(file.text_line(line.number))
        expected = "card" if rule == "machine_card" else "keyword" if line.text[0] == "." else "element"
        assert expected in scope, (line.text, scope)


def test_spice_elements_with_the_names_of_cards_are_elements():
    for word in CARDS:
        assert scope_of(f"{word} d g s b") == scope_of("R1 a 0 1k") == "entity.name.function.element.emsim"
    assert "element" in scope_of("BODY a 0 V={m = 2}") and "card" in scope_of("body a m=1")


@pytest.mark.parametrize(
    ("text", "scope"),
    [("k=1", "variable.parameter"), ("10meg ", "constant.numeric"), ("1e-3", "constant.numeric"),
     ("-90deg", "constant.numeric"), ("angle(h)", "support.function"), ("PULSE(0 1)", "support.type"),
     ("; x", "comment"), ("&&", "keyword.operator"), ("{", "punctuation")],
)  # fmt: skip
def test_values(text, scope):
    for rule in [r for part in textmate.grammar()["repository"].values() for r in part["patterns"]]:
        if "match" in rule and re.match(rule["match"], text):
            name = rule.get("name") or rule["captures"]["1"]["name"]
            assert scope in name
            return
    pytest.fail(f"nothing matches {text}")


DECK = """a motor
.gravity
BODY  arm   shape=rod(0.30) m=0.20
JOINT hinge 0 arm pin
MOTOR m1 a 0 hinge kt=20m r=2
V1 a 0 1
.tran 1m 10m
.end
"""


def run_client(folder, program: str) -> dict:
    (folder / "deck.cir").write_text(DECK)
    done = subprocess.run(
        ["node", ROOT / "tests" / "unit" / "editor" / "client.js", FOLDER / "extension.js", program, folder / "deck.cir"],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@needs_node
def test_the_client(scratch):
    program = scratch / "emsim"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m emsim "$@"\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    found = run_client(scratch, str(program))
    assert found["errors"] == [] and found["first"] == found["right"] == found["again"] == []
    wrong = found["wrong"][0]
    assert wrong["severity"] == 0 and wrong["source"] == "emsim" and "hnge" in wrong["message"]
    assert wrong["range"]["start"] == {"line": 4, "character": 13}
    assert "direct-current motor" in found["hover"] and "nothing" not in found
    assert found["definition"] == 3 and found["completion"] == ["hinge"]
    assert found["symbols"] == ["arm", "hinge", "m1", "v1"] and found["edits"] == [formatted(DECK)]


@needs_node
def test_a_program_that_is_not_there_is_named(scratch):
    found = run_client(scratch, str(scratch / "nowhere"))
    assert len(found["errors"]) == 1 and "nowhere" in found["errors"][0]
