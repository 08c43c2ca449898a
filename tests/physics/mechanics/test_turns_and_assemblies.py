"""Angles of joints that close a loop count turns; the assembly nearest to the drawn pose is taken; amplified errors are told."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from support import deck

import emsim


def run(deck: str):
    r = emsim.run(deck)
    return r, {name: np.asarray(r[name]) for name in r.main.names}


CARDAN = """Cardan joint made of pins, 30 degrees
BODY s1 m=1 j=(1m,1m,1m)
BODY cross m=0.1 j=(1u,1u,1u)
BODY s2 m=1 j=(1m,1m,1m)
JOINT in 0 s1 pin axis=(1,0,0) ic=0
JOINT f1 s1 cross pin axis=(0,0,1)
JOINT f2 cross s2 pin axis=(-0.5,0.866025403784439,0)
JOINT out 0 s2 pin axis=(0.866025403784439,0.5,0)
DRIVE d in qd={6}
"""


def output(t):
    """Of the bent shaft, as many turns as the driven one."""
    c = math.cos(math.radians(30))
    return np.unwrap(np.arctan2(np.sin(6 * t), np.cos(6 * t) * c)), np.unwrap(
        np.arctan2(np.sin(6 * t) * c, np.cos(6 * t))
    )


@pytest.mark.parametrize("formulation", ["joint", "absolute"])
def test_the_angle_of_the_joint_that_closes_a_loop_in_space_counts_turns(formulation):
    _, at = run(
        f"{CARDAN}.options reltol=1e-6 formulation={formulation}\n.tran 5m 4\n.save all angle(out) omega(out)\n.end"
    )
    assert min(abs(at["angle(out)"] - a).max() for a in output(at["time"])) < 1e-4
    assert at["angle(out)"][-1] > 3 * 2 * math.pi


def test_what_sits_on_that_joint_does_not_jump_either():
    """A spring on it stores k/2 angle^2; a gear turns its other shaft by as many turns; a pot reads beyond half a turn."""
    cards = (
        "SPRING k out k=2m\nBODY wheel m=1 j=(1m,1m,1m)\nJOINT w 0 wheel pin axis=(1,0,0)\nGEAR g w out ratio=2\n"
        "V1 top 0 5\nPOT p top mid 0 out r=1k range=(0,30)\n"
    )
    _, at = run(
        f"{CARDAN}{cards}.options reltol=1e-6\n.tran 5m 4\n.save all angle(out) pe() v(mid) angle(w)\n.end"
    )
    assert at["pe()"] == pytest.approx(1e-3 * at["angle(out)"] ** 2, abs=1e-9)
    assert at["angle(w)"] == pytest.approx(2 * at["angle(out)"], abs=1e-6)
    assert at["v(mid)"] == pytest.approx(5 * at["angle(out)"] / 30, abs=1e-5)  # its end resistance
    assert abs(np.diff(at["angle(w)"])).max() < 1.0 and at["angle(w)"][-1] > 40.0


@pytest.mark.parametrize("options", ["", "method=dop853", "method=radau", "formulation=absolute"])
def test_a_screw_that_closes_a_loop_in_space_counts_its_turns(options):
    """A scissor jack: twenty turns take 60 mm off its width."""
    r = emsim.run(deck("mechanical/scissor_jack").replace(".end", f".options {options} reltol=1e-7\n.end"))
    turns = 5 * np.asarray(r.time) ** 2
    assert np.asarray(r["angle(s)"]) == pytest.approx(2 * math.pi * turns, abs=1e-6)
    width = 0.36 - 0.003 * turns
    assert np.asarray(r["pos(lift)"]) == pytest.approx(2 * np.sqrt(0.04 - width**2 / 4), abs=1e-7)


def four_bars():
    """Random ones with the crank held, drawn with coupler and rocker at 0, and both ways to close each."""
    rng, found = random.Random(7), []
    while len(found) < 28:
        crank, coupler, rocker = (rng.uniform(0.05, 0.3) for _ in range(3))
        ground, angle = rng.uniform(0.1, 0.3), rng.uniform(-math.pi, math.pi)
        px, py = crank * math.cos(angle), crank * math.sin(angle)
        gap = math.hypot(ground - px, -py)
        if not abs(coupler - rocker) * 1.02 < gap < (coupler + rocker) * 0.98:
            continue
        over = math.acos((coupler**2 + gap**2 - rocker**2) / (2 * coupler * gap))
        both = []
        for sign in (1, -1):
            along = math.atan2(-py, ground - px) + sign * over
            tip = math.atan2(py + coupler * math.sin(along), px + coupler * math.cos(along) - ground)
            both.append((math.remainder(along - angle, 2 * math.pi), tip))
        deck = (
            f"four-bar\nBODY a shape=rod({crank}) m=0.1\nBODY b shape=rod({coupler}) m=0.2\nBODY c shape=rod({rocker}) m=0.15\n"
            f"JOINT p 0 a pin ic={angle}\nJOINT q a({crank},0) b pin\nJOINT s 0({ground},0) c pin\n"
            f"JOINT e b({coupler},0) c({rocker},0) pin\n.gravity 0\n.tran 1m 1m\n.end"
        )
        found.append((deck, both))
    return found


@pytest.mark.parametrize(("deck", "both"), four_bars(), ids=range(28))
def test_without_a_guess_the_assembly_nearest_to_the_drawn_pose_is_taken(deck, both):
    _, at = run(deck)
    near = min(both, key=lambda pair: pair[0] ** 2 + pair[1] ** 2)
    assert (at["angle(q)"][0], at["angle(s)"][0]) == pytest.approx(near, abs=1e-6)


GIMBAL = """a body that flips, on a gimbal of three pins
BODY p m=0 j=(0,0,0)
BODY q m=0 j=(0,0,0)
BODY n m=1 j=(1m,2m,3m)
JOINT z 0 p pin axis=(0,0,1) ic=(0,0.01)
JOINT x p q pin axis=(1,0,0) ic=(0,0.01)
JOINT y q n pin axis=(0,1,0) ic=(0,10)
"""
BALL = "a body that flips\nBODY n m=1 j=(1m,2m,3m)\nJOINT b 0 n ball ic=(0,0,0,0.01,10,0.01)\n"


@pytest.mark.parametrize("method", ["auto", "dop853", "radau", "trbdf2", "gear"])
@pytest.mark.parametrize("deck", [GIMBAL, BALL], ids=["gimbal", "ball"])
def test_a_body_that_flips_is_right_or_said_to_amplify_errors(deck, method):
    """Against the same at 1e-10: within 5 % of the range, or a remark that names the growth."""
    end = ".tran 10m 5\n.save all y(n(0,1,0))\n.end"
    _, tight = run(f"{deck}.options reltol=1e-10 method=radau\n{end}")
    r, at = run(f"{deck}.options reltol=1e-3 method={method}\n{end}")
    grid = np.linspace(0.0, 5.0, 501)
    flips, right = (np.interp(grid, a["time"], a["y(n(0,1,0))"]) for a in (at, tight))
    told = [d.message for d in r.diagnostics if d.code == "W417"]
    assert told or abs(flips - right).max() < 0.05 * 2.0
    assert all("-fold" in message for message in told)


def test_a_motion_that_settles_is_not_said_to_amplify():
    r, _ = run(f"{BALL[:-1]} damp=1m\n.tran 10m 5\n.end")
    assert not [d for d in r.diagnostics if d.code == "W417"]
