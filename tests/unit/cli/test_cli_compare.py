"""`emsim compare`: exit codes, the document, what it leaves behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from support import NETLISTS, needs_ngspice

from emsim.cli import main

STEP = str(NETLISTS / "electrical" / "rc_step.cir")
pytestmark = pytest.mark.ngspice


@needs_ngspice
def test_a_plain_deck_passes(capsys, scratch):
    assert main(["compare", STEP]) == 0
    said = capsys.readouterr()
    assert "all 3 signals are within 0.5 %" in said.out and "nearer to the tight run" in said.out
    assert "reference: ngspice with reltol 1e-06" in said.err
    assert list(scratch.iterdir()) == []


@needs_ngspice
def test_over_tolerance_is_exit_4(capsys):
    assert main(["compare", "--tol", "1e-9", "--method", "gear", "--reltol", "0.05", STEP]) == 4
    assert "v(out)" in capsys.readouterr().out.rsplit("further than", 1)[1]


@needs_ngspice
def test_json(capsys):
    assert main(["compare", "--json", "--tol", "1%", STEP]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["tolerance"] == 0.01 and document["points"]["tight"] >= 20_000
    row = next(row for row in document["signals"] if row["name"] == "v(out)")
    assert row["maximum"] < 0.01 and row["nearer"] in ("emsim", "ngspice") and row["unit"] == "V"


@needs_ngspice
def test_picture(scratch):
    pytest.importorskip("matplotlib")
    assert main(["compare", "-q", "--plot", "x.svg", STEP]) == 0
    assert "v(out) [V]" in (scratch / "x.svg").read_text() or (scratch / "x.svg").stat().st_size > 10_000
    assert main(["compare", "-q", "--plot", "x.xyz", STEP]) == 2


@needs_ngspice
def test_includes_still_resolve_and_nothing_is_written_beside_the_deck(scratch, capsys):
    (scratch / "decks").mkdir()
    (scratch / "decks" / "r.inc").write_text("R1 in out 1k\n")
    deck = scratch / "decks" / "d.cir"
    deck.write_text("inc\nV1 in 0 SIN(0 1 1k)\n.include r.inc\nC1 out 0 100n\n.tran 10u 2m\n.end\n")
    assert main(["compare", "decks/d.cir"]) == 0, capsys.readouterr()
    assert sorted(os.listdir("decks")) == ["d.cir", "r.inc"] and os.listdir(".") == ["decks"]


@needs_ngspice
def test_shared_library_gives_the_same_verdict(capsys):
    pytest.importorskip("PySpice")
    code = main(["compare", "--json", "--engine", "shared", STEP])
    said = capsys.readouterr()
    if code == 5 and "E513" in said.err:
        pytest.skip("no libngspice")
    assert code == 0
    assert {row["name"] for row in json.loads(said.out)["signals"]} == {"v(in)", "v(out)", "i(v1)"}


@needs_ngspice
def test_machines_are_beyond_ngspice(capsys):
    assert main(["compare", "-q", str(NETLISTS / "coupled" / "pendulum_servo.cir")]) == 5
    said = capsys.readouterr().err
    assert "E511" in said and "emsim analogue" in said


@needs_ngspice
def test_a_deck_without_an_analysis_is_not_ngspice_s_fault(capsys, scratch):
    (scratch / "d.cir").write_text("nothing to do\nV1 a 0 1\nR1 a 0 1\n.end\n")
    assert main(["compare", "d.cir"]) == 1
    assert "E350" in capsys.readouterr().err


def test_without_ngspice_exit_5(capsys, monkeypatch):
    monkeypatch.setenv("PATH", "")
    assert main(["compare", STEP]) == 5
    assert "ngspice is not installed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (["--engine", "gnucap"], "process or shared"),
        (["--tol", "-1"], "not a positive number"),
        (["--plot", "x.xyz"], ".png, .svg, .pdf"),
    ],
)
def test_wrong_options(args, says, capsys):
    assert main(["compare", *args, STEP]) == 2
    assert says in capsys.readouterr().err


def test_stdin_is_read_once():
    text = Path(STEP).read_text()
    done = subprocess.run(
        [sys.executable, "-m", "emsim", "compare", "-"], input=text, capture_output=True, text=True
    )
    assert done.returncode in (0, 5), done.stderr


def test_an_interrupt_of_the_own_run_ends_it(monkeypatch, capsys):
    """Without ngspice ever being started."""
    from emsim import pipeline
    from emsim.cli import compare
    from emsim.diagnostics import Interrupted
    from emsim.result import Result
    from emsim.store import Columns
    from emsim.table import Table

    cut = Table("tran", ["time"], ["s"], Columns([[0.0, 1.0]]), status="interrupted")

    def ctrl_c(*a, **k):
        raise Interrupted(Result("cut", [cut]))

    monkeypatch.setattr(pipeline, "run", ctrl_c)

    def started(deck):
        raise AssertionError("ngspice was started")

    monkeypatch.setattr(compare, "_engine", lambda name: started)
    assert main(["compare", "--json", STEP]) == 130
    assert json.loads(capsys.readouterr().out)["status"] == "interrupted"


def test_a_run_that_does_not_get_through_is_exit_3(monkeypatch, capsys, scratch):
    from emsim.cli import compare

    monkeypatch.setattr(compare, "_engine", lambda name: None)
    (scratch / "stuck.cir").write_text("stuck\nI1 0 b 1\nB1 b 0 I={2+v(b)*v(b)}\nR2 b 0 1\n.op\n.end\n")
    assert main(["compare", "stuck.cir"]) == 3
    assert "E41" in capsys.readouterr().err


def test_a_missing_deck_is_said_as_by_run(capsys, monkeypatch):
    from emsim.cli import compare

    monkeypatch.setattr(compare, "_engine", lambda name: None)
    assert main(["run", "nosuch.cir"]) == 5
    said = capsys.readouterr().err
    assert main(["compare", "nosuch.cir"]) == 5
    assert capsys.readouterr().err == said and "E500" in said


@needs_ngspice
def test_coupled_lines_are_handed_on(scratch, capsys):
    """They were left out, and ngspice's circuit was another one."""
    Path("p.cir").write_text(
        "pair\nV1 in 0 PULSE(0 1 1n 0.2n 0.2n 8n 20n)\nR1 in a 30\nP1 a b 0 c d 0 m\nR3 b 0 50\nR4 c 0 50\nR5 d 0 70\n"
        ".model m cpl(r=0.3 0 0.3 l=9.13n 3.3n 9.13n g=0 0 0 c=3.65p -0.8p 3.65p length=6)\n.tran 0.05n 20n\n.end\n"
    )
    assert main(["compare", "--tol", "5%", "p.cir"]) == 0
    assert "below 1 ps" in capsys.readouterr().err


@needs_ngspice
def test_what_is_not_handed_on_is_not_compared(scratch, capsys):
    Path("n.cir").write_text("n\nV1 a 0 1\nR1 a b 1k\nN1 b 0 0 m\n.model m mesfet(vto=-2)\n.op\n.end\n")
    assert main(["compare", "n.cir"]) == 5
    assert "n1" in capsys.readouterr().err
