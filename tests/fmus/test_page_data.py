"""What pages compute with, for decks whose energies are numbers that a reader may move."""

from __future__ import annotations

import emsim
from emsim.fmus import page

WEIGHTLESS = """a rotor without weight, whose stored energies do not hang on any coordinate
.param m=0.1
.gravity 9.81
BODY rotor m={m} j=1u
JOINT shaft 0 rotor pin
MOTOR m1 a 0 shaft kt=10m r=1 l=1m
V1 a 0 5
.tran 1m 20m
.end
"""


def test_an_energy_that_is_an_open_number_is_in_the_accounts() -> None:
    result = emsim.run(WEIGHTLESS, scene=True, energy=True)
    found = page.opened(WEIGHTLESS, result, {}, {})
    assert found is not None and "m" in [name for name, *_ in found["inputs"]]
    assert found["accounts"]
