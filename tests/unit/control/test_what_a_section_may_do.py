"""Decks of strangers: what a .control section writes and uses up is bounded, and told."""

from __future__ import annotations

import os
import resource
import subprocess
import sys

import pytest

import emsim
from emsim.cli import main
from emsim.control.budget import DEPTH, RESULTS, TEXT
from emsim.outputs import written

RC = "t\nV1 a 0 1\nR1 a 0 1k\n"


@pytest.fixture(autouse=True)
def state(tmp_path, monkeypatch):
    """A state of its own, outside of where decks run."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "state"))
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "state"


def section(*lines: str) -> str:
    return RC + "\n".join([".control", *lines, ".endc", ".end", ""])


def codes(*lines: str) -> list[str]:
    try:
        result = emsim.run(section(*lines))
    except emsim.DeckError as error:
        return [d.code for d in error.diagnostics if d.severity == "error"]
    return [d.code for d in result.diagnostics if d.severity == "error"]


@pytest.mark.parametrize(
    "name",
    "Makefile ./.profile .bashrc.txt other_deck.cir tasks.json x.py x.sh x.lib a.txt/../b.cir .x.txt x. ~/x.txt".split(),
)
def test_what_is_no_file_of_results_is_not_written(name):
    assert codes("op", f"echo all: > {name}") == ["E163"]
    assert os.listdir(".") == []


COMMANDS = ["write {}", "wrdata {} v(a)", "print v(a) > {}", "echo x >> {}"]
SOURCES = {
    "a deck": "t\nR1 1 0 1000\nR2 1 0 2000\nR3 1 0 3000\nI1 0 1 1\n.op\n.end\n",
    "a library": "* diodes\n.model d1 d is=1e-14 n = 1\n",
    "a list of packages": "numpy==1.26\nscipy>=1.11\n",
    "prose": "What we measured on Monday.\nThe sensor was warm.\nSee page 3 of the book.\n",
    "a program": "\x7fELF\0\0 1 2 3\n",
}
RESULTS_OF_OTHERS = {
    "columns": " 0.0e+00  1.0e+00 \n 1.0e-03  2.0e+00 \n",
    "a table of ngspice's": "t\nTransient Analysis  Mon Jan  1\n-----\nIndex   time   v(a)\n-----\n"
    + "".join(f"{k}\t{k}e-3\t1.0\n" for k in range(7)),
    "a raw file": "Title: t\nDate: Mon\nPlotname: Operating Point\nFlags: real\n",
    "named values": "gain = 20.1\nwidth=3e3\n",
    "nothing": "",
}


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("text", SOURCES.values(), ids=SOURCES)
def test_a_text_of_somebody_s_stays(text, command):
    with open("notes.txt", "w") as file:
        file.write(text)
    assert codes("op", command.format("notes.txt")) == ["E163"]
    with open("notes.txt") as file:
        assert file.read() == text


@pytest.mark.parametrize("text", RESULTS_OF_OTHERS.values(), ids=RESULTS_OF_OTHERS)
def test_results_of_a_run_before_are_written_over_with_a_note(text):
    with open("out.txt", "w") as file:
        file.write(text)
    result = emsim.run(section("op", "wrdata out.txt v(a)"))
    assert [d.message for d in result.diagnostics if "out.txt" in d.message] == [
        "`out.txt` was there, and is written over"
    ]
    with open("out.txt") as file:
        assert [float(word) for word in file.read().split()][-1] == 1.0


def test_what_the_deck_reads_is_not_written_over():
    with open("wave.txt", "w") as file:
        file.write("0 0\n1m 1\n")
    deck = (
        't\nV1 a 0 PWL file="wave.txt"\nR1 a 0 1k\n.control\ntran 1u 1m\nwrdata wave.txt v(a)\n.endc\n.end\n'
    )
    result = emsim.run(deck)
    assert [d.code for d in result.diagnostics if d.severity == "error"] == ["E163"]


@pytest.mark.parametrize("command", ["write {}", "wrdata {} v(a)", "print v(a) > {}"])
def test_what_emsim_wrote_is_written_over_until_somebody_changes_it(command):
    for _ in range(2):
        assert codes("op", command.format("x.txt"), command.format("x.txt")) == []
    with open("x.txt", "w") as file:
        file.write("a note\nof mine\n")
    assert codes("op", command.format("x.txt")) == ["E163"]
    os.remove("x.txt")
    assert codes("op", command.format("x.txt")) == []


def test_the_run_s_own_file_may_be_written_by_its_section_again():
    with open("deck.cir", "w") as file:
        file.write(section("op", "write deck.raw"))
    for _ in range(2):
        assert main(["-q", "deck.cir"]) == 0


def test_a_copy_is_not_what_emsim_wrote():
    assert codes("op", "echo words > x.txt") == []
    with open("x.txt", "rb") as file:
        data = file.read()
    with open("y.txt", "wb") as file:
        file.write(data)
    assert codes("op", "wrdata y.txt v(a)") == ["E163"]


def test_without_a_state_nothing_is_known(monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "file"))
    assert codes("op", "echo words > x.txt") == []
    assert codes("op", "wrdata x.txt v(a)") == ["E163"]


def test_the_state_does_not_grow_without_end(monkeypatch):
    monkeypatch.setattr(written, "MOST", 2000)
    for k in range(100):
        with open(f"x{k}.txt", "w") as file:
            file.write("x")
        written.remember(f"x{k}.txt")
    assert written.is_ours("x99.txt") and not written.is_ours("x0.txt")
    assert os.path.getsize(written.store()) < 4000


def test_a_link_does_not_lead_out(tmp_path):
    (tmp_path / "victim.txt").write_text("precious")
    os.symlink(tmp_path / "victim.txt", "x.txt")
    assert codes("op", "echo x > x.txt") == ["E163"]
    assert (tmp_path / "victim.txt").read_text() == "precious"


DOUBLES = {
    "a word": ("set w=xx", "repeat 60", 'set w="$w$w"', "end"),
    "a list": ("set w=( x y )", "repeat 20", "set w=( $w $w )", "end"),
    "braces": ("foreach x " + "{a,b}" * 40, "end"),
    "functions": ("define f0(x) x", *(f"define f{k}(x) f{k - 1}(x)+f{k - 1}(x)" for k in range(1, 50)), "let y=f49(1)"),
    "vectors": ("repeat 100", "let n=vecmax(n+1)", 'set name="y$&n"', "let $name=vector(2e7)", "end"),
}  # fmt: skip

FEWER = """
import sys
from emsim.cli import main
from emsim.control import session

budget = session.Budget
session.Budget = lambda most: budget(most // 20)
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize("what", DOUBLES)
def test_what_doubles_ends_in_a_message(what):
    """In less than 2.5 GB, which is mostly what Python and its libraries reserve. Calls of functions are counted, and take no
    memory: a twentieth of the budget ends as all of it does."""
    lines = ("let n=0", *DOUBLES[what]) if what == "vectors" else DOUBLES[what]
    with open("deck.cir", "w") as file:
        file.write(section(*lines))
    program = ["-m", "emsim"]
    if what == "functions":
        program = ["-c", FEWER]
    done = subprocess.run(
        [sys.executable, *program, "deck.cir"], capture_output=True, text=True, timeout=300,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (2_500_000_000, 2_500_000_000)),
    )  # fmt: skip
    assert done.returncode == 1 and "E165" in done.stderr, done.stderr


@pytest.mark.parametrize("block", ["if 1", "repeat 1", "while 1", "foreach x 1", "dowhile 0"])
def test_blocks_within_blocks(block):
    assert codes(*[block] * 400, *["end"] * 400) == ["E165"]
    assert codes(*["if 1"] * DEPTH, "op", *["end"] * DEPTH) == []


@pytest.mark.parametrize(
    "expression", ["-" * 3000 + "1", "(" * 3000 + "1" + ")" * 3000, "sin(" * 500 + "1" + ")" * 500]
)
@pytest.mark.parametrize("command", ["let y={}", "print {}", "if {}\nend"])
def test_expressions_within_expressions(command, expression):
    found = codes(command.format(expression))
    assert found and set(found) <= {"E104", "E165"}


def test_a_file_that_sources_itself():
    with open("again.txt", "w") as file:
        file.write("source again.txt\n")
    assert codes("source again.txt") == ["E165"]


@pytest.mark.parametrize(
    ("code", "left"), [("0", 0), ("3", 3), ("255", 255), ("256", 1), ("-1", 1), ("1e9", 1)]
)
def test_exit_codes_are_told_as_they_are(code, left, capsys):
    with open("deck.cir", "w") as file:
        file.write(section("op", f"quit {code}"))
    assert main(["-q", "--no-files", "deck.cir"]) == left
    assert left != 1 or "E161" in capsys.readouterr().err


def test_help_lists_the_limits(capsys):
    assert main(["help", "control"]) == 0
    said = capsys.readouterr().out
    assert all(f".{suffix}" in said for suffix in RESULTS) and f"{DEPTH}" in said and f"{TEXT:,}" in said
