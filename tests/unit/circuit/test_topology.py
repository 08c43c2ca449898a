"""Impossible circuits are named before they are solved; what ngspice accepts is accepted."""

from __future__ import annotations

import numpy as np
import pytest
from circuit_decks import codes, deck, problems, remarks

import emsim


def test_a_loop_of_sources_names_its_elements() -> None:
    found = problems("V1 a 0 1", "V2 a b 1", "E1 b 0 a 0 2", "R1 a 0 1", ".op")
    assert [d.code for d in found] == ["E301"]
    assert all(f"`{name}`" in found[0].message for name in ("v1", "v2", "e1"))
    assert {span.line for span, _ in found[0].labels} | {found[0].span.line} == {2, 3, 4}


def test_a_voltage_that_follows_its_own_current_closes_no_loop() -> None:
    table = emsim.run(deck("V1 a 0 6", "B1 a 0 V={2*i(b1)}", "V2 b 0 6", "H1 b 0 V2 -3", ".op")).table("op")
    assert table["i(b1)"][0] == pytest.approx(3.0)
    assert table["i(v2)"][0] == pytest.approx(-2.0)


def test_a_source_on_one_node() -> None:
    assert codes("V1 a a 1", "R1 a 0 1", ".op") == ["E301"]


def test_an_inductor_across_a_sine_source_is_fine() -> None:
    lines = ("V1 a 0 SIN(0 1 1k)", "L1 a 0 1m", ".tran 10u 1m")
    assert remarks(*lines) == []
    # i = (1 - cos wt)/(w L)
    r = emsim.run(deck(*lines), reltol=1e-6)
    assert r.at("i(l1)", 0.5e-3) == pytest.approx(2 / (2 * 3.14159265 * 1e3 * 1e-3), rel=1e-4)


def test_a_dc_source_across_an_inductor_warns() -> None:
    assert [d.code for d in remarks("V1 a 0 1", "L1 a 0 1m", ".op")] == ["W301"]


def test_parallel_inductors_share_the_current() -> None:
    r = emsim.run(deck("V1 a 0 1", "R1 a b 1", "L1 b 0 1m", "L2 b 0 1m", ".op"))
    assert r.table("op")["i(l1)"][0] + r.table("op")["i(l2)"][0] == pytest.approx(1.0)


def test_a_node_that_is_only_read() -> None:
    found = problems("V1 out 0 1", "R1 out 0 1", "E1 b 0 uot 0 2", "R2 b 0 1", ".op")
    assert [d.code for d in found] == ["E302"]
    assert "`out`" in (found[0].hint or "")


def test_a_current_that_has_nowhere_to_go() -> None:
    found = problems("I1 a 0 1m", "V1 b 0 1", "R1 b 0 1", ".op")
    assert [d.code for d in found] == ["E303"]
    assert "`i1`" in found[0].message


def test_an_island_gets_a_shunt_and_a_warning() -> None:
    assert [d.code for d in remarks("V1 a 0 1", "R1 a 0 1", "R2 b c 1", ".op")] == ["W302"]


def test_a_conductance_made_of_a_controlled_source_is_a_path() -> None:
    lines = ("I1 0 b 1m", "G1 b 0 b 0 1m", "I2 0 c 1m", "B1 c 0 I={v(c)*1m}", ".op")
    assert remarks(*lines) == []
    table = emsim.run(deck(*lines)).table("op")
    assert table["v(b)"][0] == pytest.approx(1.0)
    assert table["v(c)"][0] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("lines", "code"),
    [
        (["U1 a b 0 um l=1", "R2 b 0 1", ".model um urc(isperl=1n)"], "E297"),
        (["Z1 a b 0 hf", "R2 b 0 1", ".model hf nhfet"], "E297"),
        (["O1 a 0 b 0 lossy", "R2 b 0 1", ".model lossy ltra(r=1 l=1u len=1)"], "E295"),  # no c
        (["D1 a 0 nomodel"], "E140"),
        (["D1 a 0 sw1", ".model sw1 sw"], "E141"),
        (["F1 b 0 V9 2", "R2 b 0 1"], "E285"),
        (["R2 a 0 1 foo=3"], "E307"),
        (["F1 b 0 R1 2", "R2 b 0 1"], "E285"),
        (["L1 a c 1m", "K1 L1 L9 0.5", "R2 c 0 1"], "E285"),
        (["L1 a c 1m", "L2 c 0 1m", "K1 L1 L2 1.5"], "E284"),
        (["L1 a 0 1m", "K1 L1 L1 0.5"], "E284"),  # doubled the inductance
        (["L1 a 0 1m m=0"], "E281"),  # stopped inside
        (["E1 b 0 a 0 2 tc1=0.01", "R2 b 0 1"], "E307"),  # had no effect
        ([".temp -300"], "E293"),
    ],
)
def test_errors_of_elements(lines: list[str], code: str) -> None:
    assert code in codes("V1 a 0 1", "R1 a 0 1", *lines, ".op")


def test_parameters_without_effect_are_said() -> None:
    lines = ("V1 a 0 1", "L1 a b 1m", "R1 b 0 1", "S1 a b a 0 sm", ".model sm sw vt=2 ronn=3", ".op")
    found = remarks(*lines)
    assert [d.code for d in found] == ["W284"]
    assert "ron=" in (found[0].hint or "")


@pytest.mark.parametrize(
    ("line", "spelt_out"),
    [
        ("L1 a b 1m Rser=10", ["R9 a x 10", "L1 x b 1m"]),
        ("L1 a b 1m Rser=10 Rpar=1k Cpar=1n m=2", ["R9 a x 5", "L1 x b 0.5m", "R8 a b 500", "C8 a b 2n"]),
        ("C1 a b 1u Rser=10 Lser=1u RLshunt=3 Rpar=1k", ["R9 a x 10", "L9 x y 1u", "R7 x y 3", "C1 y b 1u", "R8 a b 1k"]),
        ("C1 a b 1u Rser={r} Cpar=2n", [".param r=10", "R9 a x 10", "C1 x b 1u", "C8 a b 2n"]),
        ("V1 a b SIN(0 1 1k) Rser=50", ["R9 a x 50", "V1 x b SIN(0 1 1k)"]),
    ],
)  # fmt: skip
def test_parasitics_of_ltspice_are_elements(line: str, spelt_out: list[str]) -> None:
    """They had no effect, with a warning; 1e13 A flowed through a coil with Rser=1 across a source."""
    around = (".param r=10", "R1 b 0 50", "R2 a 0 1k", "C2 a 0 10n")
    around = around if line[0] == "V" else (*around, "VS s 0 SIN(0 1 1k)", "RS s a 50")
    of_words, of_lines = (
        emsim.run(deck(*around, *lines, ".tran 1u 0.4m"), reltol=1e-6)
        for lines in ([line], [x for x in spelt_out if x[0] != "."])
    )
    for name in ("v(a)", "v(b)", f"i({line[:2]})"):
        if name in of_lines.names:
            assert of_words.at(name, 0.3e-3) == pytest.approx(of_lines.at(name, 0.3e-3), rel=1e-5, abs=1e-9)


def test_an_initial_voltage_without_effect_is_said() -> None:
    """ngspice makes other elements of such a capacitor, and so drops ic= too; .ic holds in both."""
    lines = ("V1 a 0 0", "R1 a b 1k", "C1 b 0 c='1u+0*v(b)' ic=2", ".tran 10u 1m uic")
    assert [d.code for d in remarks(*lines)] == ["W283"]
    r = emsim.run(deck(*lines[:2], "C1 b 0 c='1u+0*v(b)'", ".ic v(b)=2", lines[-1]))
    assert r.at("v(b)", 1e-3) == pytest.approx(2 * np.exp(-1), rel=2e-3)


@pytest.mark.parametrize(
    "element, model, name",
    [
        ("D1 b 0 m", "d(is=word)", "is"),
        ("S1 b 0 a 0 m", "sw(vt=word)", "vt"),
        ("R2 b 0 m l=1u", "r(rsh=word w=1u)", "rsh"),
    ],
)
def test_words_of_a_model(element: str, model: str, name: str) -> None:
    """A word is the name of a .param, as in ngspice, or an error: a diode took its default for it, a resistor stopped inside."""
    lines = ("V1 a 0 1", "R1 a b 1k", element, f".model m {model}")
    problem = next(d for d in problems(*lines) if d.code == "E110")
    assert f"{name}= of .model `m` is no number: `word`" in problem.message
    given, number = (
        emsim.run(deck(".param word=0.5", *lines[:-1], f".model m {m}", ".op", ".print op v(b)"))
        for m in (model, model.replace("word", "0.5"))
    )
    assert given["v(b)"][0] == number["v(b)"][0] != 1.0
    emsim.run(deck("V1 a 0 1", "D1 a 0 m", ".model m d(is=1n mfg=maker type=silicon)", ".op"))


@pytest.mark.parametrize("saturation", [1e-9, 1e-3, 0.02, 0.5, 100.0])
def test_a_diode_of_any_saturation_current(saturation: float) -> None:
    """Of a few milliamperes on the critical voltage of Newton's limiting was none, and half an ampere had no operating point."""
    result = emsim.run(
        deck("V1 a 0 1", "R1 a b 1k", "D1 b 0 m", f".model m d(is={saturation})", ".op", ".print op v(b)")
    )
    v, vt = result["v(b)"][0], 1.380649e-23 / 1.602176634e-19 * 300.15
    assert (1 - v) / 1e3 == pytest.approx(saturation * np.expm1(v / vt), rel=1e-4)


def test_a_temperature_among_the_options_is_that_of_the_circuit() -> None:
    lines = ("V1 a 0 1", "R1 a b 1k", "D1 b 0 m", ".model m d(is=1n)")
    tail = (".op", ".print op v(b)")
    asked = emsim.run(deck(*lines, *tail), options={"temp": 85})
    written = emsim.run(deck(*lines, ".temp 85", *tail))
    assert asked["v(b)"][0] == written["v(b)"][0] != emsim.run(deck(*lines, *tail))["v(b)"][0]
