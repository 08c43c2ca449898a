"""What ended in "internal error" (exit 70) once: each is a diagnostic now, with a place in the deck."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.diagnostics import OutsideError
from emsim.outputs import load, raw
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

RC = "V1 a 0 1\nR1 a 0 1k\n"
DIODE = "V1 a 0 1\nD1 a 0 dm\n"
# name -> (code, line, deck)
DECKS = {
    "a model that nobody uses divides by zero": ("E124", 4, f"t\n{RC}.model dm D(is={{0/0}})\n.op\n.end\n"),
    "a model divides by a parameter that is zero": (
        "E124", 5, f"t\n.param x=0\n{DIODE}.model dm D(is=1n rs={{1/x}})\n.op\n.end\n",
    ),
    "time in a model": ("E125", 4, f"t\n{DIODE}.model dm D(is={{time}})\n.op\n.end\n"),
    "time in a gain": ("E125", 4, f"t\n{RC}E9 b 0 a 0 {{time}}\nR2 b 0 1k\n.op\n.end\n"),
    "a voltage in a gain": ("E125", 4, f"t\n{RC}G9 b 0 a 0 {{v(a)}}\nR2 b 0 1k\n.op\n.end\n"),
    "a universal joint between absolute bodies": (
        "E243", 2,
        "t\nBODY b1 m=1 shape=rod(0.3)\nJOINT j1 0 b1 universal axis=(1,0,0)\n.options formulation=absolute\n.tran 1m 1\n.end\n",
    ),
    "a word too many on a joint between absolute bodies": (
        "E233", 3,
        "t\nBODY rotor m=1 shape=rod(0.3)\nJOINT shaft 0 rotor pin brake\n.options formulation=absolute\n.tran 1m 1\n.end\n",
    ),
    ".op of something": ("E102", 4, f"t\n{RC}.op W1\n.end\n"),
    ".ac of a parameter": ("E102", 4, f"t\n{RC}.ac r=1k\n.end\n"),
    ".temp of an option": ("E102", 4, f"t\n{RC}.temp reltol=1e-6\n.op\n.end\n"),
    "EXP with a negative time": ("E292", 2, "t\nV1 a 0 EXP(0 1 1u -1u 2u)\nR1 a 0 1k\n.tran 1u 1m\n.end\n"),
}  # fmt: skip


@pytest.mark.parametrize("name", DECKS)
def test_a_deck_that_was_an_internal_error_has_its_diagnostic(name):
    code, line, text = DECKS[name]
    with pytest.raises(emsim.DeckError) as caught:
        emsim.check(text)
    errors = [d for d in caught.value.diagnostics if d.severity == "error"]
    assert [d.code for d in errors] == [code] and errors[0].span is not None
    assert errors[0].span.line == line and errors[0].span.text.strip()


@pytest.mark.parametrize("depth", [60, 2000])
def test_conditions_within_conditions(depth):
    text = RC + ".if (1)\n" * depth + "R3 a 0 1k\n" + ".endif\n" * depth
    if depth == 60:
        assert emsim.run(f"t\n{text}.op\n.end\n").table("op")["i(v1)"][0] == pytest.approx(-2e-3)
        return
    with pytest.raises(emsim.DeckError) as caught:
        emsim.check(f"t\n{text}.op\n.end\n")
    assert [d.code for d in caught.value.diagnostics] == ["E104"]


def test_a_misspelt_way_to_run_expressions_is_told_by_name(scratch):
    """EMSIM_CODE=natve was "a bug in emsim"."""
    (scratch / "deck.cir").write_text(f"t\n{RC}.op\n.end\n")
    done = subprocess.run(
        [sys.executable, "-m", "emsim", "deck.cir"],
        capture_output=True,
        text=True,
        env={**os.environ, "EMSIM_CODE": "natve"},
    )
    assert done.returncode == 2 and "EMSIM_CODE=natve" in done.stderr and "bug" not in done.stderr


def test_an_inductance_of_nothing_is_explained(scratch):
    (scratch / "deck.cir").write_text("t\nV1 a 0 1\nR1 a b 1k\nL1 b 0 1e-308\n.op\n.end\n")
    assert main(["explain", "deck.cir"]) == 0 and main(["explain", "--latex", "deck.cir"]) == 0


def test_a_switch_without_roff_where_gmin_is_zero_is_open():
    """Its off resistance is 1/gmin where the model gives none."""
    deck = (
        "t\n.options gmin=0\nV1 a 0 PULSE(0 1 1m 1u 1u 1 2)\nS1 a b a 0 sm\nW1 a b V1 wm\nR1 b 0 1k\n"
        ".model sm SW(vt=0.5)\n.model wm CSW(it=1)\n.tran 10u 2m\n.end\n"
    )
    r = emsim.run(deck)
    assert r.at("v(b)", 2e-3) == pytest.approx(1 / 1.001, abs=1e-6) and r.at("v(b)", 0.5e-3) == 0


@pytest.mark.parametrize("operator", ["+", "*"])
def test_fmt_of_two_thousand_terms(operator, scratch):
    line = "R1   a 0 {" + operator.join(["x"] * 2000) + "}\n"
    (scratch / "deck.cir").write_text(f"t\n.param x=1\nV1 a 0 1\n{line}.op\n.end\n")
    assert main(["fmt", "-q", "deck.cir"]) == 0
    assert (scratch / "deck.cir").read_text().count(f"x{operator}x") == 1000


def test_an_error_told_before_is_an_error_again():
    """Cards that are bound a second time, in other coordinates, went on with what the first time had found wrong."""
    from emsim.diagnostics import Sink

    sink = Sink()
    for count in (1, 2):
        sink.error("E233", "no", None)
        assert sink.error_count == count and len(sink.diagnostics) == 1


def example() -> Result:
    t = np.linspace(0, 1, 50)
    columns = Columns(c.tolist() for c in (t, np.sin(t), np.cos(t)))
    return Result("t", [Table("tran", ["time", "v(a)", "i(v1)"], ["s", "V", "A"], columns, title="t")])


@pytest.mark.parametrize("extension", ["raw", "ascii.raw", "csv", "nc", "parquet"])
def test_damaged_files_of_results_are_read_or_refused(extension, scratch):
    """Bytes changed, cut out, put in, the end missing: seeded."""
    if extension in ("nc", "parquet"):
        pytest.importorskip("h5netcdf" if extension == "nc" else "pyarrow")
    name = f"x.{extension}"
    if extension == "ascii.raw":
        raw.write(name, example(), ascii=True)
    else:
        example().save(name)
    data = (scratch / name).read_bytes()
    r = random.Random(extension)
    head = data.find(b"Binary:") + 8 if extension == "raw" else min(len(data), 3000)
    for _ in range(400):
        damaged = bytearray(data)
        for _ in range(r.randint(1, 3)):
            at = r.randrange(max(1, min(len(damaged), head if r.random() < 0.8 else len(damaged))))
            match r.randint(0, 4):
                case 0 if damaged:
                    damaged[min(at, len(damaged) - 1)] = r.choice(b"\0\xff 0-9:\n\teT")
                case 1:
                    del damaged[at : at + r.randint(1, 9)]
                case 2:
                    damaged[at:at] = bytes(
                        r.choice(b"\0\xff 0123456789-.e:\n\t") for _ in range(r.randint(1, 9))
                    )
                case 3 if r.random() < 0.3:
                    del damaged[at:]
                case 4:
                    damaged[at : at + 8] = r.randbytes(8)
        (scratch / f"y.{extension}").write_bytes(damaged)
        began = time.monotonic()
        try:
            for table in load(f"y.{extension}").plots:
                for column in table.names:
                    table.doubles(column)
        except OutsideError as error:
            assert error.diagnostics[0].code in ("E500", "E506")
        assert time.monotonic() - began < 5


def test_a_raw_file_that_announces_what_no_file_holds(scratch):
    for points, count in [(-1, 2), (10**15, 2), (3, 0), (3, -2), (3, 10**9)]:
        (scratch / "x.raw").write_text(
            f"Title: t\nPlotname: x\nFlags: real\nNo. Variables: {count}\nNo. Points: {points}\nVariables:\n"
            "\t0\ttime\ttime\n\t1\tv(a)\tvoltage\nBinary:\n0123456789"
        )
        with pytest.raises(OutsideError):
            load("x.raw")
