"""Text to logical lines: title, comments, continuation, encodings, .control; spans point at the user's text."""

from __future__ import annotations

import pytest

from emsim.build import read
from emsim.elaborate import flatten
from emsim.source import Reading, SourceFile, decode

from .support import codes, element, flat, said


def test_first_line_is_the_title_whatever_it_says():
    deck = flatten(read("R9 a b 1k of a title\nR1 a 0 1\n"))
    assert deck.title == "R9 a b 1k of a title"
    assert [e.name for e in deck.elements] == ["r1"]


def test_a_card_as_title_is_warned_of():
    assert [d.code for d in read("V1 a 0 1\nR1 a 0 1\n").sink.diagnostics] == ["W108"]


@pytest.mark.parametrize(
    "line", [".gravity 9.81", ".op", "BODY a shape=rod(1) m=1", "JOINT h 0 a pin", "V1 a 0 PULSE(0 1 2)"]
)
def test_cards_of_every_kind_are_known_as_titles(line):
    assert [d.code for d in read(f"{line}\nR1 a 0 1\n").sink.diagnostics] == ["W108"]


@pytest.mark.parametrize(
    "line", ["Body of a rod", ".38 calibre", "Joint pin of two arms", "V1 and R2 in series", "R1"]
)
def test_titles_are_not_taken_for_cards(line):
    assert not read(f"{line}\nR1 a 0 1\n").sink.diagnostics


def test_title_card_replaces_the_first_line():
    assert flat(".title Another one ; said here\nR1 a 0 1").title == "Another one"


def test_empty_lines_above_a_text_are_not_its_title(tmp_path):
    assert read("\n\nthe title\nR1 a 0 1\n").title == "the title"
    path = tmp_path / "a.cir"
    path.write_text("\nthe title\n")  # in a file the first line counts, as in ngspice
    assert read(path).title == ""


@pytest.mark.parametrize(
    "comment", [" ; x", ";x", " $ x", " $x", "\t$ x", " // x", " ; it's {", ' $ "', "   ;; ;", " ; kt=1 $ ;"]
)
def test_trailing_comments(comment):
    assert element(f"R1 a 0 1k{comment}").value == 1e3


def test_a_dollar_inside_a_word_is_no_comment():
    assert element("R1 a$b 0 1k").nodes == ["a$b", "0"]


@pytest.mark.parametrize("between", ["", "* c\n", "\n", "  * c\n\n; c\n$ c\n// c\n", "*\n*\n"])
def test_continuation_across_comments(between):
    e = element(f"R1 a ; first\n{between}+ 0 $ second\n{between}  + 2.5k")
    assert (e.nodes, e.value) == (["a", "0"], 2500.0)


def test_continuation_may_split_an_expression_anywhere():
    deck = flat(".param a=1\n+ b = {a +\n+ 2} c={ (a\n* between\n+ +b)*2}\nR1 x 0 {c}")
    assert deck.elements[0].value == 8.0


def test_spans_on_continued_lines_point_at_their_own_line():
    (d,) = said("R1 a 0\n* comment\n+ {1 +\n+ nope}")
    assert (d.code, d.span.line, d.span.col, d.span.text) == ("E120", 5, 3, "nope")


@pytest.mark.parametrize(
    "data",
    [
        b"t\r\nR1 a 0 1k\r\n+ tc=1\r\n",
        b"\xef\xbb\xbft\nR1 a 0 1k\n+ tc=1\n",
        "t\nR1 a 0 1k\n+ tc=1\n".encode("utf-16"),
        b"t \xe9\nR1 a 0 1k ; 5 \xb5m\n+ tc=1\n",
        b"t\rR1 a 0 1k\r+ tc=1\r",
        b"t\nR1 a 0 1k\n+ tc=1",
    ],
    ids=["crlf", "bom", "utf-16", "latin-1", "cr", "no end"],
)
def test_encodings_and_line_ends(tmp_path, data):
    path = tmp_path / "a.cir"
    path.write_bytes(data)
    (e,) = flatten(read(path)).elements
    assert (e.value, e.params) == (1e3, {"tc1": 1.0})


def test_micro_sign_in_every_encoding():
    assert decode("5µ".encode()) == "5µ" == decode("5µ".encode("latin-1"))
    assert decode(b"R1\0") is None


def test_names_are_case_insensitive():
    e = element("RLoad OUT GND 1MEG")
    assert (e.name, e.nodes, e.value) == ("rload", ["out", "0"], 1e6)


def test_end_ends_the_deck():
    assert [e.name for e in flat("R1 a 0 1\n.END\nR2 is not read (").elements] == ["r1"]


def test_lines_keep_their_numbers():
    reading = Reading(SourceFile("x", "t\n\n* c\nR1 a 0 1\n+ tc=1\n  C1 a 0 V={1}\n"), has_title=True)
    lines = [reading.line(where) for _, _, where, *_ in reading.cards]
    assert [(line.number, line.col, line.text) for line in lines] == [
        (4, 1, "R1 a 0 1\n+ tc=1"),
        (6, 3, "C1 a 0 V={1}"),
    ]


def test_of_a_control_section_the_lines_and_its_plain_analyses_are_known():
    deck = flat(
        "R1 a 0 1\n.tran 1u 1m\n.control\nrun\nplot v(a)\ntran 1 2\n.endc\n.control\nfoo (\n.endc\nC1 a 0 1"
    )
    assert [e.name for e in deck.elements] == ["r1", "c1"]
    assert [(a.kind, a.args) for a in deck.analyses] == [("tran", [1e-6, 1e-3]), ("tran", [1.0, 2.0])]
    assert [line.text for line in deck.commands] == ["run", "plot v(a)", "tran 1 2", "foo ("]
    assert deck.sink.diagnostics == []


def test_a_control_section_without_end_is_said():
    """It swallowed the analysis, and nothing told so."""
    found = said("R1 a 0 1\n.control\nrun\n.tran 1u 1m\n.end")
    (error,) = found
    assert error.code == "E106" and "has no .endc" in error.message and error.hint == "close it with .endc"


def test_analyses_only_in_control_are_known():
    deck = flat("R1 a 0 1\n.control\nop\nrun\ntran 1u 1m uic\nplot v(a)\n.endc")
    assert [(a.kind, a.args, a.flags) for a in deck.analyses] == [
        ("op", [], set()),
        ("tran", [1e-6, 1e-3], {"uic"}),
    ]


NOT_KNOWN = ["foreach v 1 2\ntran 1u 1m\nend", "if 1\nop\nend", "tran 1u $&stop", "quit\nop"]


@pytest.mark.parametrize("commands", NOT_KNOWN)
def test_what_depends_on_the_run_of_the_section_is_not_known_before(commands):
    assert flat(f"V1 a 0 1\nR1 a 0 1\n.control\n{commands}\n.endc").analyses == []


READ = {
    "tran 1u 1m 0 uic maxstep=2u": ("tran", [1e-6, 1e-3, 0.0, 2e-6], {"uic"}),
    "set color0 = white\ntran 1u 1m ; tran 2u 2m": ("tran", [1e-6, 1e-3], set()),
    "tran 1u 1m $ to the end\nquit\nalter R1 = 5": ("tran", [1e-6, 1e-3], set()),
    "foreach v 1 2\necho $v\nend\nTRAN 1u\n+ 1m": ("tran", [1e-6, 1e-3], set()),
    "ac dec 10 1 1k": ("ac", ["dec", 10.0, 1.0, 1000.0], set()),
}


@pytest.mark.parametrize("commands", READ)
def test_plain_analyses_of_a_control_section_are_read(commands):
    (found,) = flat(f"V1 a 0 1\nR1 a 0 1\n.control\n{commands}\n.endc").analyses
    assert (found.kind, found.args, found.flags) == READ[commands]


def test_utf16_without_its_mark_is_read():
    """LTspice writes such netlists: they were binary files here."""
    for codec in ("utf-16-le", "utf-16-be"):
        text = decode("t\r\nR1 a 0 10\u00b5\r\n.end\r\n".encode(codec))
        assert text == "t\nR1 a 0 10\u00b5\n.end\n"
    assert decode(b"\0\1\2\3" * 50) is None and decode(b"R1 a 0 1\n" * 50 + b"\0\0\0\0") is None


def test_ctrl_z_ends_an_included_file(tmp_path):
    (tmp_path / "att.mod").write_bytes(b".subckt att a b\r\nR1 a b 1k\r\n.ends\r\n\x1a")
    (tmp_path / "deck.cir").write_text("t\n.include att.mod\nX1 a 0 att\nV1 a 0 1\n.op\n")
    assert [e.name for e in flatten(read(str(tmp_path / "deck.cir"))).elements] == ["x1.r1", "v1"]


def test_backslashes_in_the_path_of_an_include(tmp_path):
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "r.inc").write_text("R1 a 0 1k\n")
    for path in (".\\lib\\r.inc", '"lib\\r.inc"'):
        (tmp_path / "deck.cir").write_text(f"t\n.incl {path}\nV1 a 0 1\n.op\n")
        assert [e.name for e in flatten(read(str(tmp_path / "deck.cir"))).elements] == ["r1", "v1"]


def test_options_set_before_the_first_analysis_hold():
    deck = flat(
        "V1 a 0 1\nR1 a 0 1\n.control\nset temp=85\nset numdgt=9\noption reltol=1e-5\nrun\n.endc\n.op"
    )
    assert deck.temp == 85.0 and deck.options["reltol"] == 1e-5


def test_commands_of_an_included_file_count_too(tmp_path):
    (tmp_path / "inc.cir").write_text(".control\nalter R1=5k\n.endc\n")
    (tmp_path / "deck.cir").write_text("t\n.include inc.cir\nV1 a 0 1\nR1 a 0 1\n.op\n.end\n")
    assert [line.text for line in flatten(read(str(tmp_path / "deck.cir"))).commands] == ["alter R1=5k"]


def test_leftovers_of_other_simulators_are_tolerated():
    assert (
        codes("R1 a 0 1\n.backanno\n.option post brief\n.options plotwinsize=0 numdgt=7\n.width out=80") == []
    )
