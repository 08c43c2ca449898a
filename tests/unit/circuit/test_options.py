"""Options: defaults, ranges, precedence, and what is said about unknown ones."""

from __future__ import annotations

import pytest
from circuit_decks import codes, deck, remarks

import emsim
from emsim.assemble.options import resolve
from emsim.deck import MachineCard
from emsim.diagnostics import Sink, Span
from emsim.elaborate.flat import FlatDeck
from emsim.source import SourceFile

RC = ("V1 a 0 1", "R1 a b 1k", "C1 b 0 1u")


def flat(**options: float | str | bool) -> FlatDeck:
    d = FlatDeck("t", Sink())
    d.options = dict(options)
    return d


def test_only_what_is_given_goes_to_the_engine() -> None:
    assert resolve(flat()) == {"gmin": 1e-12, "method": "auto", "formulation": "auto"}
    assert resolve(flat(reltol=1e-5, method="Gear", maxord=9.0)) == {
        "gmin": 1e-12, "method": "gear", "formulation": "auto", "reltol": 1e-5, "maxord": 6,
    }  # fmt: skip


def test_from_outside_wins() -> None:
    assert resolve(flat(reltol=1e-5, method="gear"), {"reltol": 1e-7, "method": "trap"}) == {
        "gmin": 1e-12, "method": "trap", "formulation": "auto", "reltol": 1e-7,
    }  # fmt: skip


def test_machines_too_are_left_to_auto() -> None:
    d = flat()
    span = Span(SourceFile("t.cir", "t\n"), 1, 1, 2)
    d.machine = [MachineCard("BODY", "arm", [], {}, None, span, {})]
    assert resolve(d)["method"] == "auto"


def test_unknown_options_make_one_note() -> None:
    notes = [d for d in remarks(*RC, ".options reltoll=1e-4 foo=1 acct", ".tran 1m 10m") if d.code == "N281"]
    assert len(notes) == 1
    assert "foo" in notes[0].message
    assert "`reltol`" in (notes[0].hint or "")
    assert "acct" not in notes[0].message


@pytest.mark.parametrize(
    ("text", "code"), [("reltol=-1", "E293"), ("reltol=2", "E293"), ("method=gaer", "E294")]
)
def test_errors(text: str, code: str) -> None:
    assert codes(*RC, f".options {text}", ".tran 1m 10m") == [code]


def test_rshunt_loads_every_node() -> None:
    r = emsim.run(deck("V1 a 0 1", "R1 a b 1k", ".options rshunt=1k", ".op"))
    assert r.table("op")["v(b)"][0] == pytest.approx(0.5)


@pytest.mark.parametrize("cards", [(".temp 77", ".options temp=50"), (".options temp=50", ".temp 77")])
def test_temp_card_stands_above_the_option(cards: tuple[str, str]) -> None:
    """As in ngspice, in whatever order they stand: 1k at 50 degrees above tnom, and the same in a parameter."""
    r = emsim.run(
        deck(
            "V1 a 0 1",
            "R1 a b 1k tc1=0.01",
            "R2 b 0 1k",
            ".param t={temper}",
            "V2 c 0 {t}",
            "R3 c 0 1",
            *cards,
            ".op",
        )
    )
    assert r["v(b)"][0] == pytest.approx(0.4) and r["v(c)"][0] == pytest.approx(77)


@pytest.mark.parametrize("options", [{"tmax": 1e-5}, {"Tmax": 1e-5}, {"TMAX": 1e-5}])
def test_tmax_from_python_in_any_case(options) -> None:
    r = emsim.run(deck(*RC, ".tran 1m 10m"), options=options)
    assert max(r.time[1:] - r.time[:-1]) <= 1e-5 * (1 + 1e-9)


@pytest.mark.parametrize("value", ["1u", -1e-6, float("nan"), 0])
def test_a_tmax_that_is_none_is_a_message(value) -> None:
    with pytest.raises(emsim.DeckError, match=r"E293|E305"):
        emsim.run(deck(*RC, ".tran 1m 10m"), tmax=value)


def test_tmax_among_the_deck_s_options_is_told_to_do_nothing() -> None:
    (note,) = (d for d in remarks(*RC, ".options tmax=1u", ".tran 1m 10m") if d.code == "N281")
    assert "tmax" in note.message and ".tran tstep tstop tstart tmax" in note.hint


def test_what_was_given_by_name_stands_above_options_of_any_case() -> None:
    r = emsim.run(deck(*RC, ".tran 1m 10m"), method="trap", options={"Method": "gear"})
    assert r.stats["method"] == "trap"


def test_one_further_column_as_a_text() -> None:
    r = emsim.run(deck(*RC, ".op"), also="v(a)*2+1")
    assert "v(a)*2+1" in r.names


@pytest.mark.parametrize("cards", [[], [".temp 50"], [".options temp=50"]])
def test_the_temperature_from_outside_is_temper_everywhere(cards: list[str]) -> None:
    lines = [".param q={temper}", "V1 a 0 {q}", "R1 a 0 1", "B1 b 0 V=temper", "R2 b 0 1", *cards, ".op"]
    table = emsim.run(deck(*lines), options={"temp": 80}).table("op")
    assert (table["v(a)"][0], table["v(b)"][0]) == (80.0, 80.0)


def test_a_temperature_that_is_a_word_is_refused() -> None:
    """ngspice says: bad type given for option temp."""
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run(deck(".param hot=80", "V1 a 0 1", "R1 a 0 1", ".options temp=hot", ".op"))
    (error,) = caught.value.diagnostics
    assert error.code == "E293" and "{hot}" in (error.hint or "")
