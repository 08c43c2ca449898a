"""Waveform defaults, as measured on ngspice 39.3 (vsrcload.c)."""

from __future__ import annotations

import numpy as np
import pytest
from circuit_decks import codes, deck

import emsim
from emsim.assemble.waves import resolve
from emsim.deck import Waveform
from emsim.diagnostics import Sink, Span
from emsim.source import SourceFile

WHERE = Span(SourceFile("t.cir", "title\n"), 1, 1, 2)
TIMES = (1e-3, 10e-3)


def args(kind: str, *values: float, **params: float) -> list[float]:
    return resolve(Waveform(kind, list(values), params, WHERE), TIMES, Sink())[1]


def test_pulse() -> None:
    assert args("pulse", 1, 2) == [1, 2, 0, 1e-3, 1e-3, 10e-3, 10e-3, 0]
    # zero counts as not given
    assert args("pulse", 1, 2, 5e-3, 0, 0, 0, 0) == [1, 2, 5e-3, 1e-3, 1e-3, 10e-3, 10e-3, 0]
    assert args("pulse", 1, 2, 0, 1e-6, 2e-6, 3e-6, 4e-6, 5) == [1, 2, 0, 1e-6, 2e-6, 3e-6, 4e-6, 5]


def test_sin() -> None:
    assert args("sin", 1, 2) == [1, 2, 100.0, 0, 0, 0]
    assert args("sin", 1, 2, 50, 1e-3, 10, 90) == [1, 2, 50, 1e-3, 10, 90]


def test_exp() -> None:
    assert args("exp", 1, 3) == [1, 3, 1e-3, 1e-3, 2e-3, 1e-3]
    assert args("exp", 1, 3, 0, 0, 5e-3) == [1, 3, 1e-3, 1e-3, 5e-3, 1e-3]


def test_sffm_and_am() -> None:
    assert args("sffm", 1, 2) == [1, 2, 100.0, 0, 100.0, 0, 0]
    assert args("am", 2, 1, 200, 700, 1e-3) == [2, 1, 200, 700, 1e-3, 0]
    # ngspice ignores the sixth place of AM and takes the phase from the seventh
    assert args("am", 2, 1, 200, 700, 1e-3, 30, 60)[5] == 60


def test_pwl_repeats_and_delays() -> None:
    assert args("pwl", 0, 0, 1, 2) == [0, 0, 1, 2]
    assert args("pwl", 0, 0, 1, 2, r=0.0, td=3.0) == [3.0, 0.0, 0, 0, 1, 2]


@pytest.mark.parametrize(
    "source",
    ["PWL(0 0 2m 1 1m 2)", "PULSE(1)", "PWL(0 0 1m 1 3m 2) r=0.5m"],
)
def test_errors(source: str) -> None:
    assert codes(f"V1 a 0 {source}", "R1 a 0 1", ".tran 1m 10m") == ["E292"]


@pytest.mark.parametrize(
    ("source", "figures"),
    [
        # ngspice 39.3 at 0.3 1.5 2.5 3.7 9.9 ms of .tran 1m 10m
        ("EXP(1 3)", [1.0, 1.786924, 1.766810, 1.230959, 1.000469]),
        ("SIN(1 2 500 1m 100 30)", [2.0, 2.647390, -0.4906203, 1.620926, 0.8292662]),
        ("SFFM(1 2 500 3 100 30 60)", [-0.8313727, 2.984847, 0.1250622, -0.7859282, 1.839745]),
        ("AM(2 1 200 700 1m 30 60)", [0.0, -0.4168373, 2.362422, 0.02562126, 0.8111528]),
        ("PULSE(1 2 1m 0.1m 0.1m 1m 2.5m 2)", [1.0, 2.0, 1.0, 2.0, 1.0]),
        ("PWL(0 0 1m 1 3m 2) r=1m", [0.3, 1.25, 1.75, 1.35, 1.45]),
        ("PWL(0 0 1m 1 3m 2) r=0 td=2m", [0.0, 0.0, 0.5, 1.35, 1.45]),
    ],
)
def test_values_as_ngspice(source: str, figures: list[float]) -> None:
    r = emsim.run(deck(f"V1 a 0 {source}", "R1 a 0 1", ".tran 1m 10m 0 2u"))
    found = [r.at("v(a)", t) for t in (0.3e-3, 1.5e-3, 2.5e-3, 3.7e-3, 9.9e-3)]
    # the figures were read off ngspice's own points, 10 us apart
    np.testing.assert_allclose(found, figures, atol=4e-3)


def test_dc_value_is_for_op_and_the_waveform_for_tran() -> None:
    r = emsim.run(deck("V1 a 0 DC 5 SIN(1 2 500)", "R1 a 0 1", ".op", ".tran 1m 10m"))
    assert r.table("op")["v(a)"][0] == 5.0
    assert r.table("tran")["v(a)"][0] == pytest.approx(1.0)


def test_each_transient_of_a_deck_gives_its_own_defaults() -> None:
    """All runs took the edges, width and frequency that the first .tran leaves to a waveform."""
    sources = ("V1 a 0 SIN(0 1)", "R1 a 0 1k", "V2 b 0 PULSE(0 1 1m)", "R2 b 0 1k")
    first, second = emsim.run(deck(*sources, ".tran 0.1m 2m", ".tran 1m 10m")).plots
    assert first.at("v(a)", 0.5e-3) == pytest.approx(1, abs=1e-3)
    assert second.at("v(a)", 2.5e-3) == pytest.approx(1, abs=1e-3)
    assert (first.at("v(b)", 1.05e-3), second.at("v(b)", 1.5e-3)) == (pytest.approx(0.5), pytest.approx(0.5))
    assert second.at("v(b)", 9e-3) == pytest.approx(1)  # the width is TSTOP


def test_each_transient_of_a_machine_too() -> None:
    lines = ("BODY b m=1", "JOINT j 0 b slide", "FORCE f b dir=(1,0) SIN(0 1)", ".tran 0.1 1", ".tran 0.1 2")
    first, second = emsim.run(deck(*lines), scene=True).plots
    for run, period in ((first, 1), (second, 2)):
        w = 2 * np.pi / period
        assert run["vel(j)"] == pytest.approx((1 - np.cos(w * run.time)) / w, abs=1e-3)
        assert run.scene is not None and run.scene.waves.rows == len(run)
