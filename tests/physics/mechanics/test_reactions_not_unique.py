"""Reactions that equilibrium does not determine are named in the run, and only these."""

from __future__ import annotations

import pytest
from machines import problems

import emsim

BEAM = """.gravity 9.81
BODY beam shape=rod(1) m=2
JOINT l 0 beam pin
JOINT m 0(0.5,0) beam(0.5,0) pinslot axis=(1,0)
{right}
.print tran {read}"""
RIGHT = "JOINT r 0(1,0) beam(1,0) pinslot axis=(1,0)"


def named(cards: str) -> str:
    return " ".join(d.message.partition(":")[0] for d in problems(cards) if d.code == "W240")


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_a_third_support_gets_a_plain_number_by_deck_order(formulation):
    """Whatever the order, fy of all three is named; fx(l) is 0 in every answer and is not."""
    deck = "t\n" + BEAM.format(right=RIGHT, read="fx(l) fy(l) fy(m) fy(r)") + "\n.tran 1m 5m\n.end\n"
    if formulation == "absolute":
        deck = deck.replace(".tran", ".options formulation=absolute\n.tran", 1)
    r = emsim.run(deck)
    found = [d.message.partition(":")[0] for d in r.diagnostics if d.code == "W240"]
    assert found == ["fy(l), fy(m), fy(r)"]
    # what is shown, and that nature may choose otherwise
    (note,) = [d for d in r.diagnostics if d.code == "W240"]
    assert "least of many answers" in note.hint and "stiffness decides" in note.hint
    # rounding of a beam that rests is no energy that went
    assert not [d for d in r.diagnostics if d.code == "W415"]
    # what equilibrium does say: the sum, and the moment
    left, middle, right = (float(r[f"fy({name})"][-1]) for name in "lmr")
    assert left + middle + right == pytest.approx(19.62)
    assert 0.5 * middle + right == pytest.approx(9.81)


def test_two_supports_are_determined():
    assert named(BEAM.format(right="", read="fx(l) fy(l) fy(m)")) == ""


def test_reactions_that_nobody_reads_are_not_spoken_of():
    assert named(BEAM.format(right=RIGHT, read="angle(l)")) == ""
