"""Slips in machine cards that gave a machine nobody meant, without a word; and what looks like them and is meant."""

from __future__ import annotations

import pytest
from machines import problems

ARM = "BODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin zero=-90deg\n"
COIN = "BODY coin m=1 j=(2.5m,5m,2.5m) z=0.1 rot=(0.37,0,0)\nCONTACT c coin 0 line=(0,0,1) r=0.1 "
MOTOR = "V1 a 0 6\nMOTOR m1 "

SLIPS = {
    "gravity with a sign": (".gravity -9.81\n" + ARM, "W243", ".gravity 9.81"),
    "a rod in millimetres": (ARM.replace("0.3", "300"), "W244", "rod(300m)"),
    "a plate in millimetres": ("BODY p shape=box(200,300) m=0.2\nJOINT h 0 p pin", "W244", "box(200m,300m)"),
    "a pin twice": (ARM + "JOINT shaft 0 arm pin zero=-90deg", "W245", "leave one"),
    "a motor on one node": (ARM + MOTOR + "a a hinge kt=20m r=2", "W246", "MOTOR m1 a 0"),
    "kt in mN m": (ARM + MOTOR + "a 0 hinge kt=20 r=2", "W247", "20m"),
    "a disc that is a ball": (".gravity 0 0 -9.81\n" + COIN, "W248", "axis=(0,1,0)"),
}
MEANT = {
    "gravity in components": ".gravity 0 9.81\n" + ARM,
    "a mast": "BODY mast shape=rod(30) m=200\nJOINT h 0 mast pin",
    "a large motor": "BODY hub m=400 j=90\nJOINT h 0 hub pin\n" + MOTOR + "a 0 h kt=20 r=2",
    "a flywheel without a mass": "BODY fly m=0 j=1\nJOINT h 0 fly pin\n" + MOTOR + "a 0 h kt=20 r=2",
    "two hinges of a door": ".gravity 0 0 -9.81\nBODY door m=9 j=(1,1,1) com=(0.4,0,0)\nJOINT low 0 door pin axis=(0,0,1)\n"
    "JOINT high 0(0,0,1) door(0,0,1) pin axis=(0,0,1)",
    "a disc": ".gravity 0 0 -9.81\n" + COIN + "axis=(0,1,0)",
    "a ball in a body that is none": ".gravity 0 0 -9.81\n" + COIN + "axis=(0,0,0)",
    "a wheel in the plane": "BODY w shape=disc(0.1) m=1 y=0.1\nCONTACT c w 0 line=(0,1) r=0.1",
}
CODES = {f"W{k}" for k in range(243, 249)}


@pytest.mark.parametrize("what", SLIPS)
def test_a_slip_is_told_once_with_what_to_write(what):
    cards, code, words = SLIPS[what]
    found = [d for d in problems(cards) if d.code in CODES]
    assert [d.code for d in found] == [code]
    assert words in (found[0].hint or "")


@pytest.mark.parametrize("what", MEANT)
def test_what_is_meant_is_not(what):
    assert not CODES & {d.code for d in problems(MEANT[what])}


WRONG = {
    "an angle of 1e300": ("BODY b m=1 j=(1,1,1)\nJOINT j 0 b ball ic=(0,1e300,0)", "E232", "square"),
    "a mass of 1e200": ("BODY b m=1e200 j=1", "E232", "square"),
    "a disc with two components": (COIN + "axis=(0,1)", "E232", "three components"),
    "a disc beside a ball": (COIN.replace("line=(0,0,1)", "rq=0.2") + "axis=(0,1,0)", "E240", "plane"),
    "a disc without a radius": (COIN.replace("r=0.1", "") + "axis=(0,1,0)", "E240", "r= is 0"),
    "a peak below zero": (ARM + "FRICTION f hinge fc=1 fs=-2", "E238", "below 0"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_cannot_be_is_refused(what):
    cards, code, words = WRONG[what]
    found = [d for d in problems(cards) if d.severity == "error"]
    assert [d.code for d in found] == [code] and words in found[0].message
