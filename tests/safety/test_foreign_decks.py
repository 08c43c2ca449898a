"""`emsim compare` and `chart` hand foreign decks to ngspice, which can start programs, read start-up files and write where it
likes. Nothing but cards of a circuit gets there; every trick here works on ngspice alone."""

from __future__ import annotations

import os
import subprocess
from contextlib import suppress

import pytest
from support import needs_ngspice

from emsim.cli import main
from emsim.interop import ngspice, spice_deck

RC = "V1 in 0 SIN(0 1 1k)\nR1 in out 1k\nC1 out 0 1u\n.tran 10u 2m\n"
RUN = "shell touch {mark}"
CONTROL = f".control\n{RUN}\n.endc\n"
# name -> (deck, included file)
TRICKS = {
    "control section": (f"t\n{RC}{CONTROL}.end\n", ""),
    "control section behind the end": (f"t\n{RC}.end\n{CONTROL}", ""),
    "control section of an include": (f"t\n.include parts.inc\n{RC}.end\n", CONTROL),
    "control section of a library": (f"t\n.lib parts.inc typ\n{RC}.end\n", f".lib typ\n{CONTROL}.endl\n"),
    "control section of an include of an include": (
        f"t\n.include parts.inc\n{RC}.end\n",
        ".include 'other.inc'\n",
    ),
    "control in capitals, indented": (f"t\n{RC}  .CONTROL\n{RUN}\n.ENDC\n.end\n", ""),
    "comment that is a command": (f"t\n{RC}*# {RUN}\n.end\n", ""),
    "comment of an include": (f"t\n.include parts.inc\n{RC}.end\n", f"*#{RUN}\nR9 out 0 1k\n"),
    "comment between continuation lines": (f"t\n{RC}R3 out\n*# {RUN}\n+ 0 1k\n.end\n", ""),
    "title of a script": (f"*ng_script\n{RC}.end\n", ""),
    "line end inside a line": (f"t\n{RC}R3 out 0 1k\x0b.control\x0b{RUN}\x0b.endc\n.end\n", ""),
    "line end of another system": (f"t\n{RC}.save v(out)\r.control\r{RUN}\r.endc\n.end\n", ""),
    "redirected print": (f"t\n{RC}.print tran v(out) > {{mark}}\n.end\n", ""),
    "print of a command": (f"t\n{RC}.print tran `touch {{mark}}`\n.end\n", ""),
    "tran with a command behind it": (
        f"t\n{RC.replace('.tran', '*')}.control\ntran 10u 2m ; {RUN}\ntran 1u `touch {{mark}}`\n.endc\n.end\n",
        "",
    ),
    "option": (f"t\n{RC}.options sourcepath=( . ) editor='touch {{mark}}' history\n.end\n", ""),
    "control parameter": (f"t\n{RC}.csparam x=1\n.exec {RUN}\n.shell {RUN}\n.end\n", ""),
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("trick", TRICKS)
def test_a_foreign_deck_runs_no_command(scratch, trick):
    mark = scratch / "mark"
    deck, part = (text.replace("{mark}", str(mark)) for text in TRICKS[trick])
    (scratch / "deck.cir").write_bytes(deck.encode())
    (scratch / "parts.inc").write_text(part)
    (scratch / "other.inc").write_text(CONTROL.replace("{mark}", str(mark)))
    (scratch / ".spiceinit").write_text(f"shell touch {mark}\n")
    main(["compare", "-q", "deck.cir"])
    # and where emsim itself would refuse the deck
    for make in (
        lambda: ngspice.as_written(deck, str(scratch)),
        lambda: ngspice.tightened(deck, str(scratch), (1e-5, 0.0, 2e-3), 1e-6, 1e-6),
    ):
        text = make()
        assert "*" not in [line.strip()[:1] for line in text.split("\n")]
        inside = list(spice_deck.cards(text.partition("\n")[2]))
        models = spice_deck.code_models(inside)
        assert all(
            spice_deck.passes(card, models) or spice_deck.first_word(card) == ".end" for card in inside
        )
        with suppress(ngspice.NgspiceError):
            ngspice.run(text, timeout=20)
    assert not mark.exists()


@needs_ngspice
@pytest.mark.ngspice
def test_these_tricks_would_work_on_ngspice(scratch):
    """Else the test above shows nothing."""
    for trick in ("control section of an include", "comment that is a command"):
        mark = scratch / "mark"
        deck, part = (text.replace("{mark}", str(mark)) for text in TRICKS[trick])
        (scratch / "deck.cir").write_text(deck)
        (scratch / "parts.inc").write_text(part)
        subprocess.run(
            ["ngspice", "-b", "deck.cir"], capture_output=True, stdin=subprocess.DEVNULL, timeout=60
        )
        assert mark.exists(), trick
        mark.unlink()


@needs_ngspice
@pytest.mark.ngspice
def test_ngspice_reads_no_start_up_file_of_the_user(scratch, monkeypatch):
    mark = scratch / "mark"
    (scratch / ".spiceinit").write_text(f"shell touch {mark}\n")
    monkeypatch.setenv("HOME", str(scratch))
    monkeypatch.setenv("SPICE_ASCIIRAWFILE", "1")
    ngspice.run(ngspice.as_written(f"t\n{RC}.end\n", str(scratch)))
    assert not mark.exists()


@pytest.mark.parametrize(
    ("line", "model", "goes"),
    [
        ("A1 [a b] c m", ".model m d_and(rise_delay=1n)", True),
        ("A1 [a b]\n+ c m", ".model m\n+ d_and", True),
        ("A1 a b null m", '.model m d_process(process_file="/bin/sh")', False),
        ("A1 a b m", ".model m d_and\n.model m d_cosim", False),
        ("A1 a b m $ x", ".model m d_and", False),
        ("A1 a b {m}", ".model m d_and", False),
        ("A1 a b x", ".model m d_and", False),
    ],
)
def test_ngspice_gets_code_models_that_only_compute(line, model, goes):
    lines = ngspice.as_written(f"t\n{line}\n{model}\nR1 a 0 1\n.end\n", "/nowhere").splitlines()
    assert any(found.startswith("A1") for found in lines) == goes and "R1 a 0 1" in lines


def test_ngspice_gets_no_code_model_that_reads_a_file():
    with pytest.raises(OSError, match="reads a file"):
        ngspice.as_written('t\nA1 [a] m\n.model m d_source(input_file="/etc/passwd")\n.end\n', "/nowhere")


def test_ngspice_gets_no_process_and_no_library():
    """d_process starts a program, d_cosim loads a library."""
    deck = 't\nA1 [a] [b] null proc\n.model proc d_process(process_file="/bin/sh")\nN1 a b lib\n.osdi x.so\nR1 a 0 1\n.end\n'
    lines = ngspice.as_written(deck, "/nowhere").splitlines()
    assert (
        not [line for line in lines[1:] if line[0].lower() in "an" or "osdi" in line] and "R1 a 0 1" in lines
    )


def test_a_deck_that_was_not_prepared_does_not_run(monkeypatch):
    monkeypatch.setattr(ngspice, "find", lambda: os.devnull)
    with pytest.raises(ngspice.NgspiceError, match="more than a circuit"):
        ngspice.run("t\nR1 a 0 1\n.control\nquit\n.endc\n.end\n")


@needs_ngspice
@pytest.mark.ngspice
def test_includes_mean_the_same_to_both(scratch):
    (scratch / "lib").mkdir()
    (scratch / "lib" / "parts.lib").write_text(
        "* parts\n.lib slow\n.include inner.inc\n.endl\n.lib fast\n.param tau=1u\n.endl\n"
    )
    (scratch / "lib" / "inner.inc").write_text(".param\n* a comment\n+ tau = 5u\n")
    (scratch / "deck.cir").write_text(
        "t\n.lib 'lib/parts.lib' slow\nV1 in 0 PULSE(0 1 1u 1u 1u 1 2)\nR1 in out 1k\nC1 out 0 {tau/1k}\n.tran 1u 30u\n.end\n"
    )
    assert main(["compare", "-q", "deck.cir"]) == 0
