"""What pages compute with, for decks whose energies are numbers that a reader may move."""

from __future__ import annotations

from support import deck

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


ROLLS = """a ball that slides, then rolls: its radius is looked at while the slip is written
.gravity 9.81
BODY ball m=1.3 j=(5.2m,5.2m,5.2m) y=0.1 vx=3 vz=-1 omega=(20,7,30)
CONTACT floor ball 0 line=(0,1,0) r=0.1 mu=0.2
.tran 10m 0.1
.end
"""


def test_a_radius_that_vectors_are_made_of_is_no_constant() -> None:
    """It ended with an internal error: an open number was asked for its constant value."""
    result = emsim.run(ROLLS, scene=True)
    found = page.opened(ROLLS, result, {}, {})
    assert found is not None and "x(ball)" in [name for name, *_ in found["places"]]


DRIVEN = """a crank that turns at a given speed moves a rod on a spring
BODY crank shape=rod(0.05) m=0.2
BODY mass m=0.5
JOINT main 0 crank pin
JOINT guide 0 mass slide
SPRING s guide k=50
DRIVE turn main qd=6
.tran 1m 10m
.end
"""


def test_a_body_whose_speed_is_prescribed_is_not_taken_hold_of() -> None:
    """It ended with an internal error: its coordinate is a state, and is none of those that give way."""
    found = page.opened(DRIVEN, emsim.run(DRIVEN, scene=True), {}, {})
    assert found is not None
    assert [body for body, own in found["grips"].items() if own] == [2]


def test_the_number_of_a_wheel_s_teeth_is_no_open_number() -> None:
    """It ended with an internal error: a ratio that a reader may move was rounded to teeth."""
    text = deck("mechanical/planetary_gear")
    found = page.opened(text, emsim.run(text, scene=True), {}, {})
    assert found is not None and found["inputs"]
