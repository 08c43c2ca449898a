"""Runs that fail, under every kind of method: the message names the card, the last good time, what was tried, what to try."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import emsim
from emsim.diagnostics import ConvergenceError, Diagnostic

METHODS = ("auto", "radau", "trap", "gear", "trbdf2", "esdirk", "gauss", "dop853")
GOLDEN = Path(__file__).resolve().parent / "golden"

ESCAPE = "feeds on itself\nC1 a 0 1 IC=1\nB1 0 a I={v(a)*v(a)}\n.tran 10m 2 UIC\n"
VANISHES = (
    "a solution ends\nV1 in 0 PWL(0 0 1m 1)\nR1 in a 1k\nB1 0 a I={1m*(v(a)*v(a)+0.05)}\n.tran 10u 1m\n"
)
OVERFLOW = "too large\nV1 in 0 PWL(0 0 1m 1)\nB1 out 0 V={exp(v(in)/1m)}\nR1 out 0 1k\n.tran 10u 1m\n"
CANCELS = "cancels\nI1 0 a 1m\nR1 a 0 1k\nG1 a 0 a 0 -1m\n.tran 10u 2m\n"
NO_POINT = "no point\nV1 in 0 1\nR1 in a 1k\nB1 a 0 I={v(a)*v(a)+1}\n.tran 10u 1m\n"
NO_BALANCE = "no balance\nBODY a m=1 j=1\nJOINT j1 0 a pin\nTORQUE t j1 tau=1\n.gravity 9.81\n.op static\n"
LOCKS = (
    "locks\nBODY a shape=rod(0.1) m=0.1\nBODY b shape=rod(0.24) m=0.1\nBODY c shape=rod(0.1) m=0.1\n"
    "JOINT p 0 a pin ic=60deg\nJOINT q a(0.1,0) b pin guess=-40deg\nJOINT s 0(0.22,0) c pin guess=60deg\n"
    "JOINT r b(0.24,0) c(0.1,0) pin\n.gravity 0\nDRIVE d p qd=1\n.tran 1m 5\n"
)
LASTING = (
    "radio beside a pendulum\nBODY arm m=1 com=(1,0) j=0\nJOINT hinge 0 arm pin ic=30deg\n.gravity 9.81\n"
    "V1 a 0 SIN(0 1 700meg)\nR1 a b 50\nC1 b 0 1p\n.tran 20m 5\n"
)
STRAIGHT = (
    "in one line\nBODY a shape=rod(1) m=1\nBODY b shape=rod(1) m=1\nBODY c shape=rod(1) m=1\n"
    "JOINT p 0 a pin ic=0\nJOINT q a(1,0) b pin ic=0\nJOINT s 0(1,0) c pin ic=0\n"
    "JOINT r b(1,0) c(1,0) pin\n.gravity 0\nTORQUE t p tau=1\n.tran 1m 1\n"
)


def failure(deck: str, method: str) -> tuple[Diagnostic, emsim.Result]:
    with pytest.raises(ConvergenceError) as caught:
        emsim.run(f"{deck}.options method={method}\n.end\n")
    return caught.value.diagnostics[0], caught.value.partial


def places(d: Diagnostic) -> set[str]:
    """First words of the lines that the message shows."""
    assert d.span is not None
    return {span.text.lower() for span in (d.span, *(s for s, _ in d.labels))}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("deck", "card"), [(ESCAPE, "b1"), (VANISHES, "b1"), (OVERFLOW, "b1"), (LOCKS, "joint")]
)
def test_a_run_that_stops_says_where_when_and_what_to_try(deck, card, method):
    d, partial = failure(deck, method)
    assert d.code in ("E410", "E412") and card in places(d), d
    # the last good time, and it is the last row
    found = re.search(r"everything up to t = (\S+) s is kept", d.hint)
    assert found and float(found[1]) == pytest.approx(partial.time[-1], rel=1e-5)
    when = re.search(r"at t = (\S+) s", d.message)
    assert when and float(found[1]) <= float(when[1]) < float(found[1]) + 0.1 * partial.time[-1]
    assert "try: " in d.hint
    if deck is not OVERFLOW:  # there was nothing to try: the value itself is beyond every number
        assert "tried: shorter steps, down to" in d.hint
        assert method == "auto" or method in d.hint.splitlines()[0]


@pytest.mark.parametrize("method", METHODS)
def test_what_ran_away_is_named_with_its_size(method):
    d, partial = failure(ESCAPE, method)
    found = re.search(r"v\(a\) ran away, from at most (\S+) to (\S+) in the last tenth", d.hint)
    assert found and float(found[2]) == pytest.approx(abs(partial["v(a)"][-1]), rel=0.1)
    assert float(found[1]) < 20


@pytest.mark.parametrize("method", METHODS)
def test_a_voltage_that_has_to_jump_is_offered_a_capacitor(method):
    d, _ = failure(VANISHES, method)
    assert "a small capacitor from node `a` to ground" in d.hint and "`a`" in d.message


@pytest.mark.parametrize("method", METHODS)
def test_a_mechanism_that_locks_names_its_drive(method):
    d, _ = failure(LOCKS, method)
    assert "JOINT `" in d.message and "DRIVE `d` goes on" in d.hint and "in one line" in d.hint


def test_methods_that_were_tried_are_not_what_to_try():
    d, _ = failure(VANISHES, "auto")
    assert "method=" not in d.hint
    d, _ = failure(VANISHES, "gear")
    assert ".options method=radau" in d.hint
    d, _ = failure(VANISHES, "radau")
    assert ".options method=gear" in d.hint


@pytest.mark.parametrize("method", METHODS)
def test_the_first_point(method):
    d, _ = failure(NO_POINT, method)
    assert "at the operating point" in d.message and "node `a`" in d.message and "b1" in places(d)
    assert "tried: Newton's method" in d.hint and ".nodeset" in d.hint and "no such point" in d.hint


@pytest.mark.parametrize("method", METHODS)
def test_what_cancels_is_undetermined_at_the_operating_point(method):
    d, _ = failure(CANCELS, method)
    assert d.code == "E411"
    assert d.message == "nothing determines the voltage of node `a` at the operating point"
    assert {"i1", "r1", "g1"} == places(d) and "cancel" in d.hint


@pytest.mark.parametrize("method", METHODS)
def test_what_cancels_is_undetermined_from_given_values(method):
    d, _ = failure(re.sub(r"(?m)^(\.tran.*)$", r"\1 uic", CANCELS), method)
    if d.code == "E413":
        assert "what conducts there cancels" in d.message and "`a`" in d.message
    else:
        assert (
            d.code == "E411" and d.message == "nothing determines the voltage of node `a` in the first step"
        )
        assert {"i1", "r1", "g1"} == places(d) and "cancel" in d.hint


@pytest.mark.parametrize("method", ["radau", "trap", "gear", "esdirk"])
def test_links_in_one_line_are_told_in_words_of_motion(method):
    d, _ = failure(STRAIGHT, method)
    assert d.code == "E411" and d.message.startswith("nothing determines the motion at JOINT `")
    assert "guess=" in d.hint and "ground" not in d.hint


@pytest.mark.parametrize("method", METHODS)
def test_no_balance(method):
    d, _ = failure(NO_BALANCE, method)
    assert "no equilibrium" in d.message and "JOINT `j1`" in d.message and "SPRING" in d.hint


@pytest.mark.parametrize("method", ["auto", "radau", "trap", "gear", "trbdf2", "esdirk", "dop853"])
def test_a_run_that_is_refused_names_what_asks_for_it(method):
    d, partial = failure(LASTING, method)
    assert d.code == "E414" and "700 MHz" in d.message and "`v1`" in d.message and places(d) == {"v1"}
    assert "maxsteps=" in d.hint and len(partial) > 0


MATRIX_WORDS = re.compile(r"\b(singular|matrix|matrices|pivots?|rank|jacobian|residuals?)\b", re.I)


def test_messages_speak_of_physics_not_of_matrices():
    for path in GOLDEN.glob("*.txt"):
        found = MATRIX_WORDS.search(path.read_text(encoding="utf-8"))
        assert found is None, f"{path.name}: {found[0]}"


ASIN_OF_SOURCE = (
    "of a source\nV1 a 0 SIN(0 2 1k)\nRx a 0 1k\nB1 o 0 V={asin(v(a))}\nR1 o 0 1k\nC1 o 0 1n\n.tran 1u 1m\n"
)
ASIN_OF_CHARGE = (
    "of a charge\nI1 0 c 1m\nC1 c 0 1u\nR0 c 0 1meg\nR2 p 0 1k\nB2 p 0 V={asin(v(c))+1}\n.tran 1u 10m\n"
)
ASIN_OF_START = "of a start\nC1 c 0 1u IC=2\nR1 c 0 1k\nB2 p 0 I={asin(v(c))}\nR2 p 0 1k\n.tran 1u 10m UIC\n"


@pytest.mark.parametrize("method", [m for m in METHODS if m not in ("gauss", "dop853")])
@pytest.mark.parametrize(
    ("deck", "card"), [(ASIN_OF_SOURCE, "b1"), (ASIN_OF_CHARGE, "b2"), (ASIN_OF_START, "b2")]
)
def test_a_value_out_of_a_functions_domain_is_not_laid_to_the_first_card_of_the_deck(deck, card, method):
    """A solution that is no number is none in every unknown: the first one was told, V1 or C1."""
    d, _ = failure(deck, method)
    assert d.code == "E412"
    assert d.span is not None and d.span.text.lower() == card, d
