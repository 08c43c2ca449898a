"""Every deck of netlists/ is read without an error, and the five design decks as they are meant."""

from __future__ import annotations

import os
from glob import glob

import pytest

from emsim.build import read
from emsim.elaborate import flatten

NETLISTS = os.path.join(os.path.dirname(__file__), "..", "..", "..", "netlists")


@pytest.mark.parametrize(
    "path", sorted(glob(os.path.join(NETLISTS, "*", "*.cir"))), ids=lambda p: os.path.basename(p)
)
def test_deck_is_read(path):
    deck = flatten(read(path))
    assert deck.title and (deck.elements or deck.machine) and deck.analyses


@pytest.mark.parametrize(
    ("name", "letters", "kinds"),
    [
        ("pendulum_servo", "vvrvb", "BODY JOINT MOTOR POT"),
        ("comb_drive", "vrvr", "BODY JOINT SPRING DAMPER TRANSDUCER TRANSDUCER"),
        ("cart_pole", "b", "BODY BODY JOINT JOINT MOTOR FORCE"),
        ("relay", "rvmdvbsvrld", "BODY JOINT SPRING STOP TRANSDUCER"),
        ("slider_crank_hbridge", "vssssddddvvbbbb", "BODY BODY BODY JOINT JOINT JOINT JOINT MOTOR"),
    ],
)
def test_design_decks(name, letters, kinds):
    deck = flatten(read(os.path.join(NETLISTS, "coupled", name + ".cir")))
    assert "".join(e.letter for e in deck.elements) == letters
    assert " ".join(c.kind for c in deck.machine) == kinds
    assert deck.sink.diagnostics == []


def test_the_mosfet_of_the_relay():
    deck = flatten(read(os.path.join(NETLISTS, "coupled", "relay.cir")))
    m1 = next(e for e in deck.elements if e.name == "m1")
    assert m1.nodes == ["c2", "gate", "0", "0"] and m1.model.type == "nmos"
    assert m1.params == pytest.approx({"l": 1e-6, "w": 10e-3})
