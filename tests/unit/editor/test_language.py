"""The tables of editor/words.py against the language itself, and every question at every place of every deck."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROOT

from emsim._engine import methods
from emsim.assemble.behaviour import FUNCTIONS, MECHANICAL
from emsim.assemble.options import OPTIONS
from emsim.assemble.outputs import UNITS
from emsim.cards import CARDS
from emsim.cards.joints import WORDS as JOINT_WORDS
from emsim.diagnostics import LONGEST
from emsim.editor import words
from emsim.editor.complete import complete
from emsim.editor.document import Document
from emsim.editor.hover import card_text, definition, element_text, hover
from emsim.editor.place import Place
from emsim.elements import LETTERS
from emsim.functions import OF_TICKS
from emsim.source import decode, trees

PACKAGE = ROOT / "emsim"
DECKS = sorted([*(ROOT / "netlists").rglob("*.cir"), *(ROOT / "tests" / "decks" / "bad").glob("*.cir")])


def test_every_function_of_the_machine_is_explained_with_its_unit():
    assert set(words.PROBES) == MECHANICAL | set(JOINT_WORDS)
    for name, (form, unit, _) in words.PROBES.items():
        assert form.startswith(f"{name}(") and unit == {**JOINT_WORDS, **UNITS}.get(
            name, ""
        )  # mode and hits are numbers


def test_every_function_of_expressions_is_explained():
    assert set(words.FUNCTIONS) == (set(FUNCTIONS) - MECHANICAL) | set(OF_TICKS)
    for name, (form, _) in words.FUNCTIONS.items():
        assert form.startswith(f"{name}(")


@pytest.mark.parametrize("option", OPTIONS.values(), ids=OPTIONS)
def test_options_are_those_that_are_read(option):
    if not option.reader:
        assert option.what.startswith("accepted")
        return
    text = (PACKAGE / option.reader).read_text(encoding="utf-8")
    assert re.search(rf"[\"']{option.name}[\"']|\b{option.name}\b", text), (
        f"{option.reader} reads no {option.name}"
    )


def test_methods_are_those_of_the_engine():
    assert set(words.METHODS) == {names[0] for names, *_ in methods()}
    assert all(len(told) == 3 and all(told) for told in words.METHODS.values())


@pytest.mark.parametrize("word", words.DOTS)
def test_dot_cards_are_known_to_the_grammar(word):
    example = {
        ".param": " a=1", ".func": " f(a) {a}", ".model": " m d", ".subckt": " s a", ".include": " x", ".lib": " x y",
        ".if": " (1)", ".elseif": " (1)", ".title": " x",
    }.get(word, "")  # fmt: skip
    tree = trees().line(word + example, "dot")
    assert tree is not None and tree[0] != "unknown"
    assert words.DOTS[word][0].startswith(word)


@pytest.mark.parametrize("word", CARDS)
def test_the_reference_of_a_card_has_all_its_parameters(word):
    text, spec = card_text(word.lower()), CARDS[word].spec
    assert spec.form in text and spec.meaning in text
    for key, param in spec.params.items():
        assert f"| `{key}` | {param.unit or '-'} |" in text and param.meaning in text


@pytest.mark.parametrize("letter", [letter.upper() for letter in LETTERS])
def test_elements_are_explained(letter):
    assert element_text(letter.lower())


@pytest.mark.parametrize("path", DECKS, ids=lambda p: p.stem)
def test_any_question_at_any_place(path):
    text = decode(path.read_bytes())
    if text is None or len(text) > 20 * LONGEST:
        return
    document = Document(text, str(path))
    for row, line in enumerate(document.lines[:120]):
        for col in {0, len(line), *range(row % 5, min(len(line), 200), 5)}:
            said = hover(document, row, col)
            assert said is None or "None" not in said.replace("-None-", "")
            target = definition(document, row, col)
            if target is not None:
                word = Place(document.lines, row, col).word.lower()
                assert target.name.partition(".")[0] in word or word.partition(".")[0] in target.name
                assert target.span.text.lower() == target.name or target.kind in ("node", "point", "param")
            for item in complete(document, row, col):
                assert item.label and item.insert


@settings(max_examples=80, deadline=None)
@given(
    st.lists(
        st.sampled_from(
            ["MOTOR ", "JOINT ", "R1 ", "a ", "0 ", "arm ", "kt=", "{", "}", "(", ")", "v(", "x", "\n", "\n+ ", "; c", ".param ",
             ".model ", "D(", "is=", "'", '"', "= ", ",", ".options ", "X1 ", ".subckt s a\n", ".ends", "* c", "\t", "é", "1k "]
        ),
        max_size=25,
    )
)  # fmt: skip
def test_any_question_about_any_text(parts):
    document = Document("t\n" + "".join(parts))
    for row in range(len(document.lines) + 1):
        for col in range(0, 40, 3):
            hover(document, row, col)
            definition(document, row, col)
            complete(document, row, col)


def test_unfinished_lines_are_understood():
    text = "t\nMOTOR m1 a 0\n* between\n+ hinge kt=1\n+ \n"
    place = Place(text.split("\n"), 3, 4)
    assert place.words == ["motor", "m1", "a", "0"] and place.expects() == ("joint",)
    assert Place(text.split("\n"), 4, 2).expects() == ("key",)
    assert not Place(text.split("\n"), 2, 4).is_code and not Place(text.split("\n"), 0, 1).is_code


def test_inner_names_hide_outer_ones():
    text = "t\n.param r=1\n.subckt s a b\n.param r=2\nR1 a b {r}\n.ends\nR1 x 0 {r}\nX1 x 0 s\n.op\n.end\n"
    document = Document(text)
    inner, outer = definition(document, 4, 8), definition(document, 6, 8)
    assert inner is not None and inner.span.line == 4
    assert outer is not None and outer.span.line == 2
    assert document.scope_at(4) == ("s",) and document.scope_at(5) == ("s",) and document.scope_at(6) == ()


def test_a_bug_in_emsim_is_a_diagnostic(monkeypatch):
    from emsim.editor import document

    monkeypatch.setattr(document, "flatten", lambda deck: 1 / 0)
    (said,) = Document("t\nR1 a 0 1\n").diagnostics
    assert said.code == "E499" and "ZeroDivisionError" in said.message


SECTION = """rc
V1 in 0 1
R1 in out 1k
C1 out 0 1u
.control
tr
print v(o
let x = db(v(out))
.endc
.tr
.end
"""


def test_commands_of_a_section_are_offered_and_told():
    document = Document(SECTION)
    offered = {item.label: item for item in complete(document, 5, 2)}
    assert {"tran", "print", "foreach", "end", ".endc"} <= set(offered) and "MOTOR" not in offered
    assert offered["tran"].detail.startswith("tran tstep tstop")
    vectors = {item.label for item in complete(document, 7, 8)}
    assert {"db", "vecmax", "v", "out"} <= vectors and "tran" not in vectors
    assert {item.label for item in complete(document, 6, 9)} >= {"in", "out", "v1"}
    assert "values, or columns" in (hover(document, 6, 1) or "")
    # behind it dot cards are offered again
    assert "MOTOR" in {item.label for item in complete(document, 9, 0)}
    assert hover(document, 2, 1) and "tran tstep" not in (hover(document, 2, 1) or "")
