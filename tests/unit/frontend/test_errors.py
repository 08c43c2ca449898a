"""grammar/errors: malformed cards and the messages promised for them; decks that must not break the reader."""

from __future__ import annotations

import os
import time

import pytest

from emsim.build import read
from emsim.diagnostics import DeckError, DiagnosticError, OutsideError, render_text, to_json
from emsim.elaborate import flatten

from .support import said


def examples() -> list[tuple[str, list[str]]]:
    out = []
    folder = os.path.join(os.path.dirname(__file__), "..", "..", "..", "grammar", "errors")
    for name in sorted(os.listdir(folder)):
        if name.endswith(".txt"):
            with open(os.path.join(folder, name), encoding="utf-8") as handle:
                for block in handle.read().strip("\n").split("\n\n"):
                    lines = block.split("\n")
                    cards = [line for line in lines if not line.startswith("=> ")]
                    out.append(("\n".join(cards), [line[3:] for line in lines if line.startswith("=> ")]))
    return out


@pytest.mark.parametrize(("cards", "expected"), examples(), ids=lambda value: str(value)[:40])
def test_malformed_card_says_what_is_promised(cards, expected):
    try:
        diagnostics = flatten(read(f"title\n{cards}\n")).sink.diagnostics
    except DiagnosticError as error:
        diagnostics = error.diagnostics
    assert [f"{d.code} {d.message}" for d in diagnostics if d.severity != "note"] == expected
    for d in diagnostics:
        assert d.span is not None and d.span.line >= 2 and d.span.end >= d.span.col
        assert d.code[0] == {"error": "E", "warning": "W", "note": "N"}[d.severity]


def test_there_are_enough_examples():
    assert len(examples()) > 80


def test_all_errors_at_once():
    diagnostics = said("R1 a\nR2 b 0 {1+\nC1 a 0 {nope}\n.trna 1 2")
    assert [(d.code, d.span.line) for d in diagnostics] == [
        ("E103", 2),
        ("E103", 3),
        ("E105", 5),
        ("E120", 4),
    ]


def test_at_most_twenty_errors_are_printed():
    diagnostics = said("\n".join(f"R{k} a" for k in range(30)))
    assert len(diagnostics) == 30
    text = render_text(diagnostics)
    assert text.count("error[") == 20
    assert text.endswith("... and 10 more errors")


def test_rendering_shows_line_caret_label_and_hint():
    (d,) = said("D1 a 0 dmo\n.model dm d")
    assert render_text([d]).splitlines() == [
        "error[E140]: no .model is called `dmo`",
        "  --> <text>:2:8",
        "   |",
        " 2 | D1 a 0 dmo",
        "   |        ^^^",
        "   = help: did you mean `dm`?",
    ]
    assert to_json(d)["span"] == {"file": "<text>", "line": 2, "col": 8, "end": 11}


def test_a_card_word_mistyped_is_no_element():
    (d,) = [d for d in said("MOTRO m1 a 0 hinge kt=20m") if d.code == "E140"]
    assert d.message.startswith("this is no MOTOR card") and d.hint == "did you mean `MOTOR`?"
    (d,) = [d for d in said("M1 d g 0 0 nmso\n.model nmos1 nmos") if d.code == "E140"]
    assert d.message == "no .model is called `nmso`"


@pytest.mark.parametrize(
    ("text", "code", "hint"),
    [
        ("Q1 c b 0 2N3904\n.model 2N3906 pnp", "E140", "did you mean `2n3906`? It is of type PNP"),
        ("M1 d g 0 0 irf\n.subckt irf d g s\nR1 d s 1\n.ends", "E140", "`irf` is a subcircuit: begin the line with X"),
        ("Q1 c b 0 qx\nX1 c 0 amp\n.subckt amp a b\n.model qx npn\nR1 a b 1\n.ends", "E140",
         "the .model qx in .subckt amp is known there alone: put it outside"),
        ("X1 d g 0 irf\n.model irf vdmos", "E130", "`irf` is a .model of type VDMOS: begin the line with M"),
        ("Q1 c b qn\n.model qn npn", "E109",
         "form: Qname collector base emitter [substrate [tj]] model [area] [off] [ic=] [temp=] [m=]"),
    ],
)  # fmt: skip
def test_a_transistor_of_the_wrong_kind_says_what_to_write(text, code, hint):
    assert hint in [d.hint for d in said(text) if d.code == code]


def test_caret_stands_right_behind_tabs():
    (d,) = said("D1\ta\t0\tdmo")
    lines = render_text([d]).splitlines()
    assert lines[4].index("^") == lines[3].index("dmo")


def test_two_places_in_one_message():
    (d,) = said("R1 a 0 1\nC1 a 0 1\nR1 b 0 1")
    text = render_text([d])
    assert " 2 | R1 a 0 1\n   | -- the first one\n 4 | R1 b 0 1\n   | ^^" in text


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("R1 a 0 {" + "(" * 100_000 + "1" + ")" * 100_000 + "}", "E104"),
        ("R1 a 0 {" + "(" * 100_000, "E104"),
        ("R1 a 0 {" + "-" * 100_000 + "1}", "E104"),
        ("R1 a 0 {" + "2^" * 3_000 + "1}", "E104"),
        ("R1 a 0 {" + "1?2:" * 3_000 + "1}", "E104"),
        ("R1 a 0 " + "1" * 1_000_000, "E110"),
        ("R1 a 0 " + "* " * 20_000 + "(", "E103"),
        ("R1 a 0 1\n" + "+ \n" * 20_000 + "+ (", "E103"),
    ],
    ids=["parentheses", "unclosed", "signs", "powers", "conditions", "digits", "stars", "continuations"],
)
def test_monstrous_lines_end_in_a_diagnostic(text, code):
    start = time.process_time()
    assert code in [d.code for d in said(text)]
    assert time.process_time() - start < 10


def test_a_long_sum_is_no_monster():
    deck = flatten(read("t\nR1 a 0 {" + "+".join(["1"] * 5000) + "}\n"))
    assert deck.elements[0].value == 5000


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"\x00\x01\x02", "E100"),
        (bytes(range(1, 256)) * 40, "E100"),
        (b"", "E128"),
        (b"only a title\n", "E128"),
    ],
    ids=["nul", "junk", "empty", "title"],
)
def test_files_that_are_no_decks(tmp_path, data, code):
    path = tmp_path / "x.cir"
    path.write_bytes(data)
    with pytest.raises(DeckError) as caught:
        flatten(read(path))
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_missing_file_and_directory(tmp_path):
    for path, words in ((tmp_path / "no.cir", "there is no file"), (tmp_path, "is a directory")):
        with pytest.raises(OutsideError) as caught:
            read(path)
        (d,) = caught.value.diagnostics
        assert d.code == "E500" and words in d.message


def test_a_missing_include_alone_is_the_outside_world(tmp_path):
    deck = tmp_path / "a.cir"
    deck.write_text("t\nR1 a 0 1\n.include no.inc\n")
    with pytest.raises(OutsideError):
        flatten(read(deck))
    deck.write_text("t\nR1 a 0 1\n.include no.inc\nR2 a\n")
    with pytest.raises(DeckError):
        flatten(read(deck))
