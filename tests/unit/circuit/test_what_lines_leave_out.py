"""What a line leaves out or says in vain: read as ngspice reads it, with a word where the result is not what was meant."""

from __future__ import annotations

import pytest
from circuit_decks import codes, deck, problems, remarks

import emsim


def test_a_resistor_without_a_value_is_a_milliohm() -> None:
    lines = ("v1 a 0 1", "r1 a b 1k", "r2 b 0", ".op")
    assert emsim.run(deck(*lines)).table("op")["v(b)"][0] == pytest.approx(1e-6, rel=1e-5)
    found = remarks(*lines)
    assert [d.code for d in found] == ["W281"]


def test_values_given_by_name() -> None:
    lines = (
        "V1 a 0 6",
        "R1 a b resistance=1k",
        "R2 b 0 2k",
        "C1 b 0 capacitance=1u",
        "L1 b c ind=1m",
        "R3 c 0 2k",
        ".op",
    )
    assert emsim.run(deck(*lines)).table("op")["v(b)"][0] == pytest.approx(3.0)


@pytest.mark.parametrize("card", ["C1 out 0 1u ic=4", "C1 out 0 1u ic={2+2}"])
def test_ic_without_uic_is_said_to_count_for_nothing(card: str) -> None:
    lines = ("V1 in 0 10", "R1 in out 1k", card, ".tran 10u 5m")
    found = remarks(*lines)
    assert [d.code for d in found] == ["W283"]
    assert "uic" in found[0].message and ".ic v(out)=4" in (found[0].hint or "")
    assert emsim.run(deck(*lines))["v(out)"][0] == pytest.approx(10.0)  # as ngspice 39


def test_ic_of_a_coil_without_uic() -> None:
    assert [d.code for d in remarks("V1 in 0 10", "R1 in a 1k", "L1 a 0 1m ic=1m", ".tran 10u 5m")] == [
        "W283"
    ]


@pytest.mark.parametrize("run", [".tran 10u 5m uic", ".op"])
def test_ic_where_it_counts_or_no_run_starts_says_nothing(run: str) -> None:
    assert remarks("V1 in 0 10", "R1 in out 1k", "C1 out 0 1u ic=4", run) == []


def test_a_pair_of_windings_without_a_k_is_named() -> None:
    coils = (
        "V1 in 0 SIN(0 1 1k)",
        "Rs in a 50",
        "Lp a 0 2m",
        "Lt t 0 8m",
        "Lb 0 b 8m",
        "R1 t 0 600",
        "R2 b 0 600",
    )
    found = remarks(*coils, "K1 Lp Lt 0.95", "K2 Lp Lb 0.95", ".tran 5u 10u")
    assert [d.code for d in found] == ["W285"] and "lt lb" in (found[0].hint or "")
    assert remarks(*coils, "K1 Lp Lt Lb 0.95", ".tran 5u 10u") == []


@pytest.mark.parametrize("value", ["{0/0}", "{ln(0)}", "{time}", "{1/x}"])
def test_a_parameter_of_a_model_that_nothing_uses_is_an_error_at_its_place(value: str) -> None:
    found = problems(".param x=0", "V1 a 0 1", "R1 a 0 1k", f".model dm D(is={value})", ".op")
    assert [d.code for d in found] in (["E124"], ["E125"])
    assert found[0].span is not None and found[0].span.line == 5


@pytest.mark.parametrize(
    ("card", "where"), [("E9 b 0 a 0 {time}", 4), ("G9 b 0 a 0 {v(a)}", 4), ("F9 b 0 V1 {time}", 4)]
)
def test_a_gain_that_the_run_would_have_to_compute(card: str, where: int) -> None:
    found = problems("V1 a 0 1", "R1 a 0 1k", card, "R2 b 0 1k", ".op")
    assert [d.code for d in found] == ["E125"]
    assert found[0].span is not None and found[0].span.line == where


@pytest.mark.parametrize("args", ["0 1 1u -1u 2u", "0 1 1u 1u 2u -1u"])
def test_exp_with_a_negative_time_constant(args: str) -> None:
    assert codes(f"V1 a 0 EXP({args})", "R1 a 0 1k", ".tran 1u 1m") == ["E292"]


def test_ac_on_a_source_is_the_amplitude_of_its_waveform() -> None:
    from emsim import pipeline
    from emsim.build import read
    from emsim.elaborate import flatten

    ctx = pipeline.prepare(flatten(read(deck("V1 a 0 AC 2 90", "I1 0 a AC 3", "R1 a 0 1", ".op"))))[0].ctx
    for name, amplitude in (("v1", 2j), ("i1", 3.0)):
        ((wave, value),) = ctx.elements[name].excite(ctx)
        assert wave == ctx.wave(ctx.elements[name]) and value == pytest.approx(amplitude)
    assert not ctx.elements["r1"].excite(ctx)


def test_values_of_a_model_in_brackets() -> None:
    # a vendor's spelling: it was refused with E102
    plain, bracketed = (
        emsim.run(deck("V1 a 0 1", "R1 a b 1k", "D1 b 0 dm", f".model dm D({given})", ".op")).table("op")[
            "v(b)"
        ][0]
        for given in ("is=1e-13 n=1.5", "is=(1e-13) n=( 1.5 )")
    )
    assert plain == bracketed
