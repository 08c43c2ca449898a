"""What decks of schematic programs write at their end: lists of all voltages or currents where there may be none, harmonics into
a file, `run` without an analysis. ngspice goes on in each of these."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

GATES = """nothing but digital nodes
a1 [x y] z nand
.model nand d_nand
.tran 1u 10u
.control
run
{commands}
.endc
.end
"""
SINE = """a sine
V1 a 0 SIN(0 1 1k)
R1 a 0 1k
.control
{commands}
.endc
.end
"""


def codes(text: str) -> list[str]:
    try:
        return [d.code for d in emsim.run(text).diagnostics]
    except emsim.DeckError as error:
        return [d.code for d in error.diagnostics]


@pytest.mark.parametrize("word", ["allv", "alli"])
def test_a_list_of_nothing_is_a_warning_and_the_rest_is_done(scratch, word):
    result = emsim.run(GATES.format(commands=f"print {word} > all.txt\nlet q = 5\nprint q"))
    assert [d.code for d in result.diagnostics] == ["W160"] and f"`{word}`" in result.diagnostics[0].message
    assert "q = 5" in result.output and (scratch / "all.txt").read_text() == ""


def test_where_a_vector_is_needed_nothing_is_an_error(scratch):
    assert "E162" in codes(GATES.format(commands="let q = alli"))
    # and before any analysis it is one, as no list is known
    assert codes(SINE.format(commands="print alli")) == ["E162"]


def test_harmonics_go_into_a_file(scratch):
    commands = "tran 1u 5m\nfourier 1k v(a) > harmonics.txt"
    result = emsim.run(SINE.format(commands=commands))
    assert result.diagnostics == [] and "Harmonic" not in result.output
    first = (scratch / "harmonics.txt").read_text().split("\n")
    assert first[0] == "Fourier analysis for v(a):"
    row = next(line.split() for line in first if line.split()[:1] == ["1"])
    assert float(row[2]) == pytest.approx(1.0, abs=1e-4)


def test_run_without_an_analysis_does_nothing(scratch):
    result = emsim.run(SINE.format(commands="run\nop\nprint v(a)"))
    assert [d.code for d in result.diagnostics] == ["W160"] and "v(a) = " in result.output


def test_a_form_of_frequencies_that_nobody_filled_in_is_one_point():
    result = emsim.run("a form\nV1 a 0 1 AC 2\nR1 a b 1k\nR2 b 0 1k\n.ac lin 0 0Hz 0Hz\n.end\n")
    assert result["v(b)"].tolist() == [1.0] and [d.code for d in result.diagnostics] == ["W309"]
    with pytest.raises(emsim.DeckError, match="number of points is 0"):
        emsim.run("a form\nV1 a 0 1 AC 2\nR1 a 0 1k\n.ac lin 0 1 10\n.end\n")


@pytest.mark.parametrize(
    "card",
    [
        ".print dc v(a) Out=par('2*v(a)')",
        ".print dc Out=par('2*v(a)') v(a)",
        ".save v(a) out=par('2*v(a)')",
        ".save v(a) Out = par('2*v(a)')",
    ],
)
def test_an_expression_that_is_shown_has_the_name_it_was_given(card):
    result = emsim.run(
        f"named\nV1 a 0 1\nR1 a 0 1k\n.dc V1 0 2 1\n{card}\n.control\nrun\nprint out\n.endc\n.end\n"
    )
    assert result["out"].tolist() == [0.0, 2.0, 4.0] and "W287" not in [d.code for d in result.diagnostics]


def test_columns_over_another_vector(scratch):
    """`vs` as in plot: the vector behind it stands in front of those before it, in place of their scale."""
    commands = "tran 1u 1m\nwrdata w v(a) vs i(v1) v(a)\nset wr_vecnames\nset wr_singlescale\nwrdata one.txt v(a) vs i(v1)"
    assert emsim.run(SINE.format(commands=commands)).diagnostics == []
    table = np.loadtxt(scratch / "w")
    assert table.shape[1] == 4 and np.allclose(table[:, 1], -1e3 * table[:, 0]) and table[-1, 2] == 1e-3
    assert (scratch / "one.txt").read_text().split()[:2] == ["i(v1)", "v(a)"]
    assert codes(SINE.format(commands="tran 1u 1m\nwrdata w.txt vs v(a)")) == ["E161"]


def test_sections_of_included_files_are_carried_out_where_they_stand(scratch):
    (scratch / "power.inc").write_text("* measures\n.control\nlet twice = 2*once\n.endc\n")
    text = SINE.format(commands="op\nlet once = 4")
    text = text.replace(".end\n", ".include power.inc\n.control\nprint twice\n.endc\n.end\n")
    (scratch / "deck.cir").write_text(text)
    assert "twice = 8" in emsim.run(scratch / "deck.cir").output
