"""VSWITCH and ISWITCH were read as a hysteresis between von and voff: PSpice turns the resistance smoothly, in its logarithm.

ln R = ln sqrt(ron roff) + ln(ron/roff) (3/2 x - 2 x^3), x = (c - (von + voff)/2)/(von - voff), from the PSpice reference guide.
"""

from __future__ import annotations

from math import exp, log
from pathlib import Path

import pytest
from circuit_decks import deck, problems, remarks

import emsim
from emsim.cli import main


def resistance(c: float, on: float, off: float, ron: float, roff: float) -> float:
    x = min(max((c - 0.5 * (on + off)) / (on - off), -0.5), 0.5)
    return exp(0.5 * log(ron * roff) + log(ron / roff) * (1.5 * x - 2 * x**3))


def rising(on: float, off: float, kind: str = "vswitch") -> emsim.Result:
    lines = ("V1 in 0 5", "Vc c 0 PWL(0 0 50u 5 100u 0)", "S1 in out c 0 sm", "R1 out 0 10",
             f".model sm {kind}(von={on} voff={off} ron=0.01 roff=10meg)", ".tran 0.5u 100u")  # fmt: skip
    return emsim.run(deck(*lines), reltol=1e-6)


@pytest.mark.parametrize(("on", "off"), [(4.0, 1.0), (1.0, 4.0)])
def test_the_resistance_follows_the_control_both_ways(on: float, off: float) -> None:
    r = rising(on, off)
    for t in (5e-6, 12e-6, 20e-6, 25e-6, 33e-6, 45e-6, 67e-6, 75e-6, 80e-6, 95e-6):
        c = 5.0 * min(t, 100e-6 - t) / 50e-6
        assert r.at("v(out)", t) == pytest.approx(50 / (10 + resistance(c, on, off, 0.01, 1e7)), rel=2e-3)


def test_von_and_voff_mean_the_same_in_a_model_of_type_sw() -> None:
    assert rising(4, 1, "sw").at("v(out)", 25e-6) == pytest.approx(rising(4, 1).at("v(out)", 25e-6), rel=1e-6)


def test_the_defaults_are_those_of_pspice() -> None:
    lines = ("V1 in 0 1", "Vc c 0 {c}", "S1 in out c 0 sm", "R1 out 0 1", ".model sm vswitch", ".op")
    for c, r in ((0.0, 1e6), (0.5, 1e3), (1.0, 1.0)):
        table = emsim.run(deck(*(line.format(c=c) for line in lines))).table("op")
        assert table["v(out)"][0] == pytest.approx(1 / (1 + r), rel=1e-6)


def test_a_current_turns_an_iswitch() -> None:
    lines = (
        "V1 in 0 1",
        "Ic 0 c 0.5m",
        "Vc c 0 0",
        "W1 in out Vc wm",
        "R1 out 0 1",
        ".model wm iswitch",
        ".op",
    )
    assert emsim.run(deck(*lines)).table("op")["v(out)"][0] == pytest.approx(1 / (1 + 1e3), rel=1e-6)


def test_a_vswitch_with_vt_is_a_switch_with_hysteresis() -> None:
    lines = ("V1 in 0 1", "Vc c 0 PWL(0 0 1m 4 2m 0)", "S1 in out c 0 sm", "R1 out 0 1",
             ".model sm vswitch(vt=2 vh=1 ron=1 roff=1meg)", ".tran 10u 2m")  # fmt: skip
    r = emsim.run(deck(*lines))
    assert r.at("v(out)", 0.6e-3) == pytest.approx(1e-6, rel=1e-3)
    assert r.at("v(out)", 1.5e-3) == pytest.approx(0.5, rel=1e-3)


def test_what_cannot_be_is_said() -> None:
    base = ("V1 in 0 1", "S1 in 0 in 0 sm", ".op")
    equal = problems(*base, ".model sm vswitch(von=1 voff=1)")
    assert [d.code for d in equal] == ["E299"] and "equal" in equal[0].message
    assert [d.code for d in problems(*base, ".model sm vswitch(ron=-1)")] == ["E299"]
    both = remarks(*base, ".model sm sw(von=1 voff=0 vt=2)")
    assert [d.code for d in both] == ["W284"]
    memory = remarks("V1 in 0 1", "S1 in 0 in 0 sm on", ".op", ".model sm vswitch")
    assert [d.code for d in memory] == ["W283"]


def test_ngspice_gets_its_law_as_an_expression(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "turns.cir"
    path.write_text(
        deck("V1 in 0 5", "Vc c 0 1", "W1 in out Vc wm", "S1 in out c 0 sm", "R1 out 0 10", "R2 c 0 2",
             ".model sm vswitch", ".model wm iswitch(ion=1 ioff=0)", ".tran 1u 2u")
    )  # fmt: skip
    assert main(["analogue", str(path)]) == 0
    said = capsys.readouterr().out
    assert ".model" not in said and "bs1 in out i='v(in,out)*exp(" in said and "i(vc)" in said
