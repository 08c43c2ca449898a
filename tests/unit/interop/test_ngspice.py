"""What is changed in a deck before ngspice gets it, and what comes back."""

from __future__ import annotations

import pytest
from support import needs_ngspice

from emsim.diagnostics import OutsideError
from emsim.interop import ngspice

DECK = """rc low-pass, not a card: .tran
V1 in 0 PULSE(0 1 0 1n 1n 1u 2u)
R1 in out {r}
* a comment
+ tc1=0
C1 out 0 1n
.param r=1k
.tran 0.1u
* between
+ 4u uic
.end
this is after the end
"""


def test_the_deck_as_written_has_its_cards_and_no_comments():
    want = DECK.replace("rc low", "emsim: rc low").replace("* a comment\n", "").replace("* between\n", "")
    assert ngspice.as_written(DECK, "/nowhere") == want.partition(".end\n")[0] + ".end\n"


def test_the_tight_deck_has_another_tran_and_options_at_its_end():
    lines = ngspice.tightened(DECK, "/nowhere", (1e-7, 0.0, 4e-6), 1e-9, 1e-6).splitlines()
    trans = [line for line in lines[1:] if line.lower().startswith(".tran")]
    assert trans == [".tran 1e-07 4e-06 0.0 1e-09 uic"] and "+ 4u uic" not in lines
    assert lines[-1] == ".end" and lines[-2].startswith(".options reltol=1e-06 abstol=1e-15 vntol=1e-09")


def test_control_sections_are_left_out_and_give_their_analyses():
    deck = "t\nR1 a 0 1\nV1 a 0 1\n.control\nset x=1\ntran 1u 1m\nplot v(a)\n.endc\n.end\n"
    text = ngspice.as_written(deck, "/nowhere")
    assert ".tran 1u 1m" in text and "control" not in text and "plot" not in text
    with_card = deck.replace(".control", ".tran 2u 2m\n.control")
    assert ".tran 1u 1m" not in ngspice.as_written(with_card, "/nowhere")


@pytest.mark.parametrize("line", [".include parts.inc", '.INC "parts.inc"', ".lib 'parts.inc' fast"])
def test_included_files_stand_in_the_place_of_their_cards(tmp_path, line):
    (tmp_path / "parts.inc").write_text("* parts\nR9 a 0 1\n" if "lib" not in line else LIBRARY)
    text = ngspice.as_written(f"title\n{line}\nV1 a 0 1\n.end\n", str(tmp_path))
    assert text == "emsim: title\nR9 a 0 1\nV1 a 0 1\n.end\n"


LIBRARY = ".lib slow\nR9 a 0 2\n.endl\n.lib FAST\nR9 a 0 1\n.endl fast\n"


def test_a_section_of_the_deck_itself_is_for_those_who_name_it(tmp_path):
    text = "title\n.lib fast\nR8 a 0 1\n.endl\nR9 a 0 1\n.end\n"
    assert ngspice.as_written(text, str(tmp_path)) == "emsim: title\nR9 a 0 1\n.end\n"


def test_missing_program(monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.raises(OutsideError) as caught:
        ngspice.find()
    assert caught.value.diagnostics[0].code == "E510" and "apt install" in (
        caught.value.diagnostics[0].hint or ""
    )


@needs_ngspice
@pytest.mark.ngspice
def test_a_run_and_its_names(scratch):
    deck = "sub\n.subckt s a\nV1 a b 1\nR1 b 0 1k\n.ends\nX1 n s\nR2 n 0 1k\n.tran 1u 10u\n.end\n"
    result = ngspice.run(ngspice.as_written(deck, str(scratch)))
    assert "i(x1.v1)" in result and "v(x1.b)" in result and result.analysis == "tran"
    assert list(scratch.iterdir()) == []  # nothing is left where it was called


@needs_ngspice
@pytest.mark.ngspice
def test_its_last_words_when_it_fails():
    with pytest.raises(ngspice.NgspiceError, match=r"(?i)singular|error|model"):
        ngspice.run("t\nV1 a 0 1\nV2 a 0 2\n.tran 1u 10u\n.end\n")
    with pytest.raises(ngspice.NgspiceError, match="not done after"):
        ngspice.run("t\nV1 a 0 SIN(0 1 1meg)\nR1 a 0 1\n.tran 1n 100\n.end\n", timeout=0.3)
