"""Operating points that are none without gmin, and such whose expressions have no value where the search begins."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

# a current is driven into the base until the transistor takes that of I1; by gmin alone another point lies at -1e10 V
FEEDBACK = """feedback of a collector current
VCC s 0 3
VM s c 0
F1 0 b VM -1000
I1 0 c 10m
Q1 c b 0 n
.model n npn bf=100 is=1f
"""
VT = 1.380649e-23 / 1.602176634e-19 * 300.15


def codes(result) -> list[str]:
    return [d.code for d in result.diagnostics]


def test_the_point_that_needs_no_gmin_is_preferred():
    found = emsim.run(FEEDBACK + ".op\n.end")
    assert "W408" not in codes(found)
    assert found.op["v(b)"][0] == pytest.approx(VT * math.log(10e-3 / 1e-15), abs=1e-3)


def test_so_it_is_along_a_sweep():
    found = emsim.run(FEEDBACK + ".dc I1 1m 10m 1m\n.end")
    current = np.arange(1, 11) * 1e-3
    assert "W408" not in codes(found)
    np.testing.assert_allclose(found.dc["v(b)"], VT * np.log(current / 1e-15), atol=1e-3)


def test_so_it_is_at_the_start_of_a_run_and_for_small_signals():
    found = emsim.run(FEEDBACK + ".tran 1u 10u\n.ac dec 1 1 10\n.print ac v(b)\n.end")
    assert "W408" not in codes(found)
    np.testing.assert_allclose(found.tran["v(b)"], VT * math.log(10e-3 / 1e-15), atol=1e-3)


BLOCKED = "a current into a diode that blocks\nI1 0 a 1m\nD1 0 a d\n.model d d\n"


@pytest.mark.parametrize("card", [".op", ".dc I1 -1m 1m 1m", ".ac dec 1 1 10", ".tran 1u 10u"])
def test_a_voltage_that_only_gmin_holds_is_told(card):
    found = emsim.run(f"{BLOCKED}{card}\n.end")
    (said,) = [d for d in found.diagnostics if d.code == "W408"]
    assert "`a`" in said.message and "0.001 A" in said.message
    if card == ".op":
        assert found.op["v(a)"][0] == pytest.approx(1e9, rel=1e-3)


@pytest.mark.parametrize(
    "lines",
    [
        "V1 a 0 1k\nD1 m a d\nD2 0 m d",  # shared out by gmin, within the source's voltage
        "V1 a 0 1k\nD1 m a d\nC1 m 0 1n",  # one junction alone: no current
        "V1 a 0 5\nR1 a m 1e15\nD1 0 m d",  # hardly a path, but one
        "I1 0 a 1m\nD1 a 0 d",
        "V1 a 0 5\nM1 a 0 m 0 nm\nM2 m 0 0 0 nm",  # transistors that are turned off in series
    ],
)
def test_what_gmin_only_shares_out_is_not_told(lines):
    found = emsim.run(f"title\n{lines}\n.model d d\n.model nm nmos vto=1\n.op\n.end")
    assert "W408" not in codes(found) and np.isfinite(found.op["v(m)" if " m " in lines else "v(a)"][0])


@pytest.mark.parametrize(
    ("lines", "node", "volts"),
    [
        ("V1 c 0 5\nR1 a 0 '1k*v(c)'\nI1 0 a 1m", "a", 5.0),
        ("V1 c 0 2\nV2 d c 3\nB1 a 0 V=pow(v(d),-1)\nR1 a 0 1k", "a", 0.2),
        ("V1 c 0 2\nR1 c d 1k\nR2 d 0 1k\nR3 c a '1k*v(d)'\nR4 a 0 1k", "a", 1.0),
        # one has its value by another
        ("V1 c 0 2\nB1 d 0 V=4/v(c)^1\nB2 e 0 V=pow(v(d),-2)\nR1 a 0 '1k/v(e)^-1'\nI1 0 a 1m", "a", 0.25),
        # behind a diode
        ("V1 c 0 5\nR1 c d 1k\nD1 d 0 d\nR2 a 0 '1k*v(d)/v(d)'\nI1 0 a 1m", "a", 1.0),
        # its own voltage: 1 mA = v / (1k v(c)^2/v)
        ("V1 c 0 2\nR2 c a 1k\nB1 a 0 I=1m*log(v(a))/log(v(a))", "a", 1.0),
    ],
)
def test_expressions_without_a_value_at_the_start(lines, node, volts):
    found = emsim.run(f"title\n{lines}\n.model d d\n.op\n.end")
    assert found.op[f"v({node})"][0] == pytest.approx(volts, rel=1e-6)


def test_a_quotient_by_its_own_value_is_solved():
    found = emsim.run("title\nV1 i 0 2\nB1 o 0 V=v(i)/v(o)\nR1 o 0 1k\n.op\n.end")
    assert abs(found.op["v(o)"][0]) == pytest.approx(math.sqrt(2.0), rel=1e-6)


def test_what_cancels_is_told_at_the_operating_point_too():
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run("title\nI1 0 a 1m\nR1 a 0 1k\nG1 a 0 a 0 -1m\n.op\n.end")
    assert "E411" in str(caught.value)


def tied(tmp_path, law: str, nodes: str, analysis: str = ".op") -> emsim.Result:
    ports = "inout t, s; electrical t, s;"
    (tmp_path / "m.va").write_text(
        f'`include "disciplines.vams"\nmodule m(t, s); {ports}\nanalog begin {law} end\nendmodule\n'
    )
    (tmp_path / "deck.cir").write_text(
        f'title\n.hdl "m.va"\n.model mm m\nN1 {nodes} mm\nI1 0 a 1m\nR1 a 0 2k\n{analysis}\n.end\n'
    )
    return emsim.run(tmp_path / "deck.cir")


@pytest.mark.parametrize("analysis", [".op", ".tran 1u 5u"])
def test_a_branch_of_no_voltage_at_one_node_is_consistent(tmp_path, analysis):
    found = tied(tmp_path, "V(t) <+ 0; I(s) <+ V(s)/2k;", "0 a", analysis)
    np.testing.assert_allclose(getattr(found, analysis[1:].split()[0])["v(a)"], 1.0, rtol=1e-6)


def test_so_it_is_between_terminals_that_are_one_node(tmp_path):
    assert tied(tmp_path, "V(t, s) <+ 0;", "a a").op["v(a)"][0] == pytest.approx(2.0)


def test_a_branch_of_another_voltage_there_is_a_contradiction(tmp_path):
    with pytest.raises(emsim.ConvergenceError) as caught:
        tied(tmp_path, "V(t) <+ 1; I(s) <+ V(s)/2k;", "0 a")
    assert "E411" in str(caught.value) and "n1" in str(caught.value)


def test_an_expression_that_never_has_a_value_is_told():
    with pytest.raises(emsim.ConvergenceError) as caught:
        emsim.run("title\nV1 c 0 0\nR1 a 0 '1k*v(c)'\nI1 0 a 1m\n.op\n.end")
    assert "E412" in str(caught.value) and "node `a`" in str(caught.value)
