"""A deck with .step and a .control section: every analysis of the section is run for each value, a plot each; the last one is
current, `meas` measures all, and the result has one table of them, as of a deck without a section."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

DECK = """steps under control
V1 in 0 SIN(0 1 1k) AC 1
R1 in out {r}
C1 out 0 100n
.param r=1k
.step param r list 1k 2k 5k
"""


def run(commands: str, cards: str = "", deck: str = DECK) -> emsim.Result:
    return emsim.run(f"{deck}{cards}\n.control\n{commands}\n.endc\n.end\n")


def corner(r: float) -> float:
    return 1.0 / (2.0 * math.pi * r * 100e-9)


def test_an_analysis_makes_a_plot_for_each_value_and_a_note_says_which():
    found = run("ac lin 1 1k 1k\nprint mag(ac1.v(out)) mag(ac2.v(out)) mag(ac3.v(out))\necho $curplot")
    values = [float(line.rpartition("=")[2]) for line in found.output.splitlines()[:3]]
    assert values == pytest.approx(
        [1.0 / math.hypot(1.0, 1e3 / corner(r)) for r in (1e3, 2e3, 5e3)], rel=1e-5
    )
    assert found.output.splitlines()[3] == "ac3"
    assert [d.message for d in found.diagnostics if d.code == "N160"] == [
        ".step: ac1 to ac3 are the runs over r; commands read ac3, the last"
    ]


def test_each_plot_knows_its_value():
    found = run("ac lin 1 1k 1k\nprint ac1.r r\nsetplot ac2\necho $&r $curplottitle")
    assert [float(line.rpartition("=")[2]) for line in found.output.splitlines()[:2]] == [1e3, 5e3]
    assert found.output.splitlines()[2] == "2000 steps under control: r = 2000"


def test_meas_measures_every_one():
    found = run("ac dec 200 10 100k\nmeas ac edge when vdb(out)=-3.0103 fall=1\nprint ac1.edge ac3.edge")
    said = found.output.splitlines()
    assert [line[: line.index(":")] for line in said[:3]] == ["At r = 1000", "At r = 2000", "At r = 5000"]
    values = [float(line.rpartition("=")[2]) for line in said[:3]]
    assert values == pytest.approx([corner(r) for r in (1e3, 2e3, 5e3)], rel=1e-4)
    assert [float(line.rpartition("=")[2]) for line in said[3:]] == pytest.approx(
        [values[0], values[2]], rel=1e-5
    )


def test_the_result_is_that_of_the_deck_without_a_section():
    cards = ".tran 10u 2m\n.meas tran top max v(out)"
    ours, plain = run("run", cards), emsim.run(f"{DECK}{cards}\n.end\n")
    assert ours.steps == plain.steps == [{"r": 1e3}, {"r": 2e3}, {"r": 5e3}]
    assert ours.measures == plain.measures
    a, b = ours.main, plain.main
    assert a.names == b.names and a.steps == b.steps == ["r"]
    assert np.array_equal(a["v(out)"], b["v(out)"]) and np.array_equal(a["r"], b["r"])


def test_what_a_section_alters_holds_in_every_step():
    found = run(
        "alter c1 = 50n\nac lin 1 1k 1k\nprint mag(ac1.v(out)) mag(v(out))\nalter r1 = 9k\nac lin 1 1k 1k\nprint mag(ac4.v(out))"
    )
    values = [float(line.rpartition("=")[2]) for line in found.output.splitlines()]
    wanted = [1.0 / math.hypot(1.0, 1e3 / corner(r / 2)) for r in (1e3, 5e3, 9e3)]
    assert values == pytest.approx(wanted, rel=1e-5)


def test_several_steps_and_the_temperature():
    deck = "two\nV1 in 0 1\nR1 in out 1k tc1=1m\nR2 out 0 {r}\n.param r=1k\n.step param r list 1k 3k\n.step temp list 27 127\n"
    found = run("op\nprint op1.v(out) op2.v(out) op3.v(out) op4.v(out)", "", deck)
    values = [float(line.rpartition("=")[2]) for line in found.output.splitlines()]
    assert values == pytest.approx([1 / 2, 3 / 4, 1 / 2.1, 3 / 4.1], rel=1e-6)


def test_a_step_that_fails_is_the_last():
    deck = "fails\nV1 a 0 {v}\nB1 b 0 V=v(a)>1.5 ? exp(1e3*v(b)*v(b)+1e3) : 1\nR1 b 0 1\n.param v=1\n.step param v list 1 2 3\n"
    with pytest.raises(emsim.ConvergenceError) as error:
        run("op\nprint op1.v(b)", "", deck)
    partial = error.value.partial
    assert partial is not None and "1.000000e+00" in partial.output
