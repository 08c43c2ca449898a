"""Commands of .control that the other files leave out, against what ngspice prints; names of alias; and .print of an analysis
that names its columns itself."""

from __future__ import annotations

import numpy as np
import pytest
from control_runs import agree
from support import needs_ngspice

import emsim

RC = "V1 in 0 DC 1 AC 1 DISTOF1 1\nR1 in out 1k\nR2 out 0 3k\nC1 out 0 1u"

SECTIONS = {
    "alias": (
        "alias p print\nalias both p v(in)\nalias hi echo hello\nop\np v(out)\nboth v(out)\nhi there $curplot\n"
        "alias both\nP v(in)"
    ),
    "unalias": "alias p print\nop\np v(out)\nunalias p\nprint v(in)",
    "alias of an alias goes before a command": "alias echo print\nop\necho v(out)",
    "tf": "tf v(out) v1\nprint transfer_function\nprint v1#input_impedance",
    "noise": (
        "noise v(out) v1 dec 2 10 1k\nsetplot noise1\nprint frequency onoise_spectrum inoise_spectrum\n"
        "setplot noise2\nprint onoise_total"
    ),
    "pz": "pz in 0 out 0 vol pz\nprint pole(1)",
    "sens": "sens v(out)\nprint r1 v1",
    "save": "save v(out)\nac dec 2 10 100\nprint v(out)",
    "unset": "set k = 3\necho $k\nunset k\nop\nprint v(out)",
    "options": "options temp=50\nop\nprint v(out)",
    "option": "option reltol=1e-5\nop\nprint v(out)",
    "setseed": "setseed 3\nop\nprint v(out)",
    "transpose": "op\nlet a = vector(6)\nreshape a [2][3]\ntranspose a\ndisplay\nprint a[2][1]",
    "exit": "op\nexit\nprint v(out)",
    "quit": "op\nquit\nprint v(out)",
    "disto": "disto dec 2 10 100\nsetplot",
    "status": "op\nstatus\necho x",
}


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", SECTIONS)
def test_a_section_prints_what_ngspice_prints(name, tmp_path):
    agree(RC, SECTIONS[name], tmp_path)


def run(commands: str, cards: str = RC) -> emsim.Result:
    return emsim.run(f"t\n{cards}\n.control\n{commands}\n.endc\n.end\n")


def codes(found: emsim.Result) -> list[str]:
    return [d.code for d in found.diagnostics if d.severity == "error"]


def test_names_that_stand_for_each_other_are_an_error():
    assert codes(run("alias a b\nalias b a\nop\na 1")) == ["E160"]


def test_a_name_for_a_block_is_an_error_and_a_name_that_was_taken_away_is_no_command():
    assert codes(run("alias w while\nop\nw 1")) == ["E160"]
    found = run("alias p print\nunalias p\nop\np v(out)")
    assert codes(found) == ["E160"] and found.output == ""


def test_a_name_may_ask_for_what_runs_have_to_record():
    assert run("alias p print @r1[i]\nop\np").output == "@r1[i] = 2.500000e-04\n"


def test_an_analysis_whose_tables_have_other_names_leaves_no_empty_plot():
    found = run("disto dec 2 10 100\nprint length(frequency)")
    assert not codes(found) and found.output.startswith("length(frequency) = 3.0")


def test_columns_that_an_analysis_names_are_printed_by_their_names():
    deck = "t\nV1 a 0 PULSE(0 1 0 1n 1n 1 2)\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m\n.sens v(b) tran by r1 c1\n"
    found = emsim.run(deck + ".print sens sens(v(b),r1)\n.end\n")
    assert found.prints == [("sens", ["sens(v(b),r1)"])] and not found.diagnostics
    other = emsim.run(deck + ".print sens sens(v(b),r9)\n.end\n")
    assert [d.code for d in other.diagnostics] == ["W287"]


# ---- gauss: the method with lines, the random value with a temperature ----


def test_a_line_is_refused_by_a_method_whose_steps_do_not_end_where_its_edges_come_out():
    cards = "V1 a 0 PULSE(0 1 0 10n 10n 1u 2u)\nR1 a b 100\nT1 b 0 c 0 z0=50 td=100n\nR2 c 0 200\nC1 c 0 100p"
    deck = f"t\n{cards}\n.tran 10n 2u\n.end\n"
    for method in ("gauss", "gauss4", "gauss6", "rk45", "dop853"):
        with pytest.raises((emsim.DeckError, emsim.ConvergenceError)) as error:
            emsim.run(deck, method=method)
        assert [d.code for d in error.value.diagnostics] == ["E413"]


def test_gauss_knows_the_temperature_of_a_resistor():
    deck = "t\nV1 a 0 SIN(0 1 1k)\nR1 a b {}\nC1 b 0 1u\n{}\n.options method=gauss reltol=1e-8\n.tran 10u 2m\n.end\n"
    warm, plain = emsim.run(deck.format("1k tc1=1m", ".temp 127")), emsim.run(deck.format("1.1k", "* "))
    assert np.abs(np.interp(plain["time"], warm["time"], warm["v(b)"]) - plain["v(b)"]).max() < 1e-7


def test_a_random_value_is_the_same_at_every_temperature():
    deck = "t\n.param r=gauss(1k,0.1,3)\nV1 a 0 3\nR1 a b {{r}} tc1=1m\nR2 b 0 1k\n.temp {}\n.op\n.end\n"
    cold, warm = (float(emsim.run(deck.format(t))["v(b)"][0]) for t in (27, 127))
    assert 3 / warm - 1 == pytest.approx(1.1 * (3 / cold - 1), rel=1e-12)
