"""The native parser gives Lark's trees: same rules, same words, same places; what it refuses, Lark reads."""

from __future__ import annotations

import random
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from emsim import parsed, syntax
from emsim.build import read
from emsim.cards import CARDS
from emsim.lark_grammar import STARTS
from emsim.mistakes import lark_line
from emsim.source import PLAIN, Line, Reading, SourceFile, trees
from emsim.syntax import LineError
from emsim.units import spice_leftover, spice_number

ROOT = Path(__file__).resolve().parents[3]


def test_the_tables_are_those_of_the_grammar():
    done = subprocess.run([sys.executable, ROOT / "grammar" / "export.py", "--check"])
    assert done.returncode == 0, "run python grammar/export.py and build the engine again"


# ---- lines --------------------------------------------------------------------------------------


def shape(tree):
    if tree.__class__ is tuple:
        return tree[0], [shape(child) for child in tree[1]]
    return str(tree), tree.type, tree.start_pos, tree.end_pos


def line_of(text: str) -> Line:
    return Line(SourceFile("x", text), 1, 1, 0, len(text))


def by_lark(text: str, start: str):
    try:
        return shape(lark_line(line_of(text), start))
    except LineError:
        return None


def agree(text: str, start: str) -> bool:
    """True when the native parser read the line, and Lark the same in it."""
    tree = trees().line(text, start)
    if tree is not None:
        assert shape(tree) == by_lark(text, start), f"{start}: {text!r}"
    return tree is not None


def lines_of(text: str, has_title: bool = True) -> list[str]:
    """The logical lines of a deck."""
    # every card as a tree: behind the title nothing is plain
    file = SourceFile("x", text)
    lines = []
    for _, name, where, _, _, place in Reading(file, has_title).cards:
        if place < 0:
            lines.append(file.text[where[2] : where[3]])
        else:
            lines.append(file.text_line(place >> 40)[place >> 20 & 0xFFFFF :])
            assert lines[-1].lower().startswith(name)
    return lines


def start_of(line: str) -> str:
    if line[0] == ".":
        return "dot"
    return "machine_card" if syntax.first_word(line).upper() in CARDS else "element"


NETLISTS = sorted(
    [*ROOT.glob("netlists/**/*.cir"), *ROOT.glob("netlists/**/*.lib"), *ROOT.glob("tests/**/*.cir")]
)
DECKS = {path: path.read_text(encoding="utf-8", errors="replace") for path in NETLISTS}


def bad_cards() -> list[str]:
    """All lines of grammar/errors and of the texts in tests of the front end and of decks."""
    out = []
    for path in sorted((ROOT / "grammar" / "errors").glob("*.txt")):
        out += [line for line in path.read_text(encoding="utf-8").split("\n") if line[:3] not in ("", "=> ")]
    for path in [*ROOT.glob("tests/unit/frontend/test_*.py"), *ROOT.glob("tests/decks/test_*.py")]:
        for line in path.read_text(encoding="utf-8").split("\n"):
            out += [part for part in line.split('"')[1::2] if part]
    return out


def test_there_is_a_corpus():
    assert len(DECKS) > 50
    assert len(bad_cards()) > 1000


@pytest.mark.parametrize("path", DECKS, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_line_of_a_deck_has_larks_tree(path):
    text = DECKS[path]
    for line in lines_of(text):
        native = agree(line, start_of(line))
        assert native == (by_lark(line, start_of(line)) is not None), f"Lark alone can read {line!r}"


def test_wrong_and_strange_lines_are_read_as_lark_reads_them():
    read_by_both = 0
    for text in bad_cards():
        for start in STARTS:
            native = agree(text, start)
            read_by_both += native
            if not native and text.isascii():
                assert by_lark(text, start) is None, f"Lark alone can read {start} {text!r}"
    assert read_by_both > 1000


PIECES = [
    *"(){},;=+-*/?:.$'\"@#!~^<>&|% ", "\n", "\n+", "\n* c\n+ ", "\t", "//", " // x", " ; c", " $ c", "**", "==", "<=",
    "<>", "&&", "||", "or", "and", "a", "n1", "0", "1k", "1e-3", "2.5meg", "5µ", "5μF", "é", "ſin", "K1", "İ", "٣",
    "\xa0", "\u2003", "\x1c", "\x85", "𝔸", "R1", "C1", "V1", "B1", "E1", "F1", "D1", "X1", "S1", "M1", "K1",
    "JOINT", "BODY", "SPRING", "POINT", "pin", "a.b", "m=1", "k=2", "v(a)", "i(v1)", "v(", "dc", "ac", "PULSE(", "sin",
    "poly(1)", "table", "value=", "V=", "I=", "r=", "tc=1,2", "{", "}", "{a+1}", "'x'", "ic=0", ".tran", ".param",
    ".model", ".print", ".ic", ".lib", ".title", ".subckt", ".if", ".foo", "@d1[id]", "uic", "params:",
]  # fmt: skip


@settings(max_examples=400, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.sampled_from(PIECES), min_size=1, max_size=14), st.sampled_from(STARTS), st.booleans())
def test_made_up_lines_have_larks_tree(pieces, start, spaced):
    agree((" " if spaced else "").join(pieces), start)


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=40), st.sampled_from(STARTS))
def test_any_text_is_read_as_lark_reads_it(text, start):
    try:
        agree(text, start)
    except UnicodeEncodeError:
        assert any("\ud800" <= c <= "\udfff" for c in text)


@pytest.mark.parametrize("seed", range(3))
def test_mutated_lines_have_larks_tree(seed):
    r = random.Random(seed)
    lines = [line for text in DECKS.values() for line in lines_of(text)]
    accepted = 0
    for _ in range(400):
        line = r.choice(lines)
        for _ in range(r.randint(1, 3)):
            at = r.randint(0, len(line))
            line = line[:at] + r.choice([*PIECES, ""]) + line[at + r.randint(0, 2) :]
        if line.strip():
            accepted += agree(line, start_of(line))
    assert accepted > 100


# ---- texts ---------------------------------------------------------------------------------------


def test_words_of_a_plain_card_are_those_of_its_tree():
    for text in DECKS.values():
        for rule, card, between, last, value, place in Reading(SourceFile("x", text), True).cards:
            if place < 0:
                continue
            shown = SourceFile("x", text).text_line(place >> 40)[place >> 20 & 0xFFFFF :]
            name, leaves = lark_line(line_of(shown), "element")
            assert (rule, [card, *between, last]) == (name, [leaf.lower() for leaf in leaves])
            assert leaves[-1].start_pos == place & 0xFFFFF
            assert value == (spice_number(leaves[-1]) if PLAIN[rule][1] else None)


WORD = st.from_regex(r"[+-]?(\d{0,6}\.?\d{0,6})(e[+-]?\d{1,3})?[a-zA-Z%µ0-9]{0,4}", fullmatch=True).filter(
    bool
)


@settings(max_examples=300, deadline=None)
@given(WORD)
def test_numbers_have_pythons_value(word):
    ((_, _, _, _, value, place),) = Reading(SourceFile("x", f"t\nR1 a b {word}"), True).cards
    expected = spice_number(word)
    said = expected is None or abs(expected) == float("inf") or spice_leftover(word) != ""
    if place < 0:
        assert said or not word.isascii()
    else:
        assert not said and value == expected and str(value) == str(expected)


def test_places_count_characters():
    deck = read("title é\nR1 ä 0 {1+nöpe} ; ü\n\u2003 C1 a µ 1 ; ö\nR2 a b 1k ; é\n  R3 é b 1k\n")
    elements = {e.name: e for e in deck.body}
    assert elements["r1"].value.b.span.text == "nöpe"
    assert [(e.span.line, e.span.col, e.span.text) for e in deck.body] == [
        (2, 1, "R1"), (3, 3, "C1"), (4, 1, "R2"), (5, 3, "R3")
    ]  # fmt: skip
    assert [e.value_span.text for e in deck.body[1:]] == ["1", "1k", "1k"]


def test_spans_of_plain_cards():
    deck = read("t\n  Rab GND n2\t1k;c\nD1 a 0 dm // c\nV1 a 0 5\nE1 a 0 b c 2\n.model dm d\n")
    r, d, v, e = deck.body[:4]
    assert (r.span.text, r.value_span.text, r.model_span, r.nodes) == ("Rab", "1k", None, ["0", "n2"])
    assert (d.span.text, d.value_span, d.model_span.text) == ("D1", None, "dm")
    assert (v.value, v.extra, v.value_span.text) == (None, {"dc": 5.0, "ac": None}, "5")
    assert (e.letter, e.value, e.extra, e.value_span.text) == ("e", 2.0, {"form": "linear"}, "2")
    assert not hasattr(r, "nonsense")


def test_half_a_surrogate_pair_is_a_character():
    deck = read("t\nR1 \ud800 0 1k\nR2 a 0 {1+\udfff}\n")
    assert deck.body[0].nodes == ["\ufffd", "0"]
    assert [d.span.line for d in deck.sink.diagnostics] == [3]


@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
@given(st.lists(st.sampled_from(PIECES), max_size=30).map(" ".join), st.booleans())
def test_any_text_is_cut_and_read(text, has_title):
    file = SourceFile("x", text)
    reading = Reading(file, has_title)
    for rule, content, where, _, _, place in reading.cards:
        if place < 0:
            line = reading.line(where)
            assert line.text and line.text == line.text.lstrip()
            assert file.text_line(line.number)[line.col - 1 :].startswith(line.text.split("\n")[0])
            if rule is not None:
                assert shape((rule, content)) == by_lark(line.text, start_of(line.text))


def test_a_line_that_lark_refuses_is_an_error():
    with pytest.raises(LineError):
        parsed.parse_line(line_of("R1 a 0 {1"), "element")
