"""Numbers: SPICE's rule on electrical cards, SI with checked units on machine cards."""

from __future__ import annotations

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from emsim.units import machine_number, machine_number_problem, spice_leftover, spice_number

from .support import codes, element, machine, said


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0), ("-.5", -0.5), ("+3.", 3.0), ("1e3", 1e3), ("1E-3k", 1.0), ("2t", 2e12), ("2G", 2e9),
        ("3meg", 3e6), ("3MEGohm", 3e6), ("4k", 4e3), ("10kohm", 1e4), ("5m", 5e-3), ("1M", 1e-3),
        ("2mil", 50.8e-6), ("1mH", 1e-3), ("1u", 1e-6), ("1µF", 1e-6), ("5N", 5e-9), ("7p", 7e-12), ("1f", 1e-15),
        ("1F", 1e-15), ("3a", 3.0), ("1A", 1.0), ("2Amp", 2.0), ("30deg", 30.0), ("1kg", 1e3), ("5V", 5.0), ("1.1n", 1.1e-9),
        ("1d3", 1e3), ("5D+0", 5.0), ("1.5d-3", 1.5e-3),
    ],
)  # fmt: skip
def test_spice_numbers(text, value):
    assert spice_number(text) == value


@pytest.mark.parametrize("text", ["", "k", "+", "-", ".", "abc", "--1", "+-1", "e5", "inf", "nan", "_1"])
def test_words_that_are_no_numbers(text):
    assert spice_number(text) is None


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_printed_float_reads_back(value):
    assert spice_number(repr(value)) == value
    assert machine_number(repr(value)) == value


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2", 2.0), ("30m", 0.03), ("20k", 2e4), ("1meg", 1e6), ("3kg", 3.0), ("30mm", 0.03), ("2cm", 0.02),
        ("5um", 5e-6), ("-90deg", -pi / 2), ("2rad", 2.0), ("60rpm", 2 * pi), ("1e3RPM", 1e3 * 2 * pi / 60),
    ],
)  # fmt: skip
def test_machine_numbers(text, value):
    assert machine_number(text) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        ("5kN", "SPICE would read `5kN` as 5 kilo", "write `5000`"),
        ("10ms", "SPICE would read `10ms` as 10 milli", "write `0.01`"),
        ("3Nm", "SPICE would read `3Nm` as 3 nano", "write `3`"),
        ("2s", "SPICE would read `2s` as 2", "write `2`"),
        ("7furlong", "as 7 femto", "units understood: kg mm cm um deg rad rpm"),
        ("3A", "SPICE would read `3A` as 3", "write `3`"),
        ("2*pi", "not a number", "{2*pi}"),
    ],
)
def test_other_letters_on_machine_cards_are_explained(text, message, hint):
    assert machine_number(text) is None
    said_message, said_hint, _ = machine_number_problem(text)
    assert message in said_message and hint in said_hint


@pytest.mark.parametrize("text", ["5N", "5g", "5M"])
def test_suffixes_taken_for_units_are_warned_of(text):
    (warning,) = said(f"BODY arm m={text}")
    assert warning.code == "W112" and warning.span.text == text


def test_units_in_braces_follow_the_card():
    assert machine("JOINT h 0 arm pin zero={-90deg+1rad}").params["zero"] == pytest.approx(1 - pi / 2)
    assert codes("JOINT h 0 arm pin zero={30grad}") == ["E111"]
    assert element("R1 a 0 {30mm}").value == pytest.approx(0.03)  # SPICE: 30 milli
    assert codes(".param angle=30deg\nR1 a 0 {angle}") == ["W112"]


def test_leftovers_are_told():
    assert spice_leftover("10kohm") == "" and spice_leftover("5%") == ""
    assert spice_leftover("1k5") == "k5"
    assert codes("R1 a 0 1k5") == ["W110"]
    assert [spice_leftover(t) for t in ("1x", "1kk", "1\u00c2\u00b5", "1Farad", "1e")] == [
        "x", "kk", "\u00c2\u00b5", "Farad", "e"
    ]  # fmt: skip
    (doubled,) = said("C1 a 0 1\u00c2\u00b5")
    assert doubled.code == "W110" and "write `1u`" in (doubled.hint or "")
    assert codes("R1 a 0 {1x}") == ["W110"]


@pytest.mark.parametrize(
    "text", ["1megohm", "2.2kOhms", "5Volts", "10uF", "1mil", "100ns", "1\u00b5F", "3k\u2126", "50Hz"]
)
def test_units_behind_a_scale_need_no_word(text):
    assert spice_leftover(text) == ""
