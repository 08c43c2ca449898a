"""`emsim.optimise`: values with which measures meet goals."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.fits.measured import Measures, Task

CHARGING = """charging
.param r=1k
V1 in 0 1
R1 in out {r}
C1 out 0 1u IC=0
.tran 50u 5m uic
.meas tran t9 WHEN v(out)=0.9 RISE=1
.meas tran top MAX v(out)
.meas tran q INTEG i(v1)
.end
"""

RINGING = """ringing
.param r=20 c=1u
V1 a 0 PULSE(0 1 0 1n 1n 1 2)
R1 a b {r}
L1 b o 1m
C1 o 0 {c}
.tran 1u 2m
.meas tran over MAX v(o)
.meas tran rise TRIG v(o) VAL=0.1 RISE=1 TARG v(o) VAL=0.9 RISE=1
.meas tran level PARAM='r*2'
.end
"""

FILTER = """a filter
.param c=1u
V1 in 0 AC 1
R1 in out 1k
C1 out 0 {c}
.ac dec 50 1 1meg
.meas ac corner WHEN vdb(out)=-3.0103
.end
"""


def test_a_rise_time_is_met_by_the_closed_form():
    found = emsim.optimise(CHARGING, "r=1..1meg", "t9=1m")
    assert found.converged and not found.missed
    assert found.values["r"] == pytest.approx(1e-3 / (1e-6 * math.log(10.0)), rel=1e-5)


def test_two_goals_and_two_quantities():
    found = emsim.optimise(RINGING, ["r=1..1k", "c=10n..10u"], ["over=1.1", "rise=50u"])
    assert found.measures["over"] == pytest.approx(1.1, rel=1e-4)
    assert found.measures["rise"] == pytest.approx(50e-6, rel=1e-4)
    # damping of an overshoot of 10 %
    damping = found.values["r"] / 2.0 * math.sqrt(found.values["c"] / 1e-3)
    share = math.log(0.1)
    assert damping == pytest.approx(-share / math.hypot(math.pi, share), rel=1e-3)


def test_the_fastest_that_does_not_overshoot():
    found = emsim.optimise(RINGING, ["r=10..1k"], "over<1.05", minimise="rise")
    assert not found.missed and found.measures["over"] == pytest.approx(1.05, rel=1e-3)


def test_measures_over_frequency_take_differences():
    found = emsim.optimise(FILTER, "c=1n..10u", "corner=10k")
    assert found.values["c"] == pytest.approx(1.0 / (2e3 * math.pi * 10e3), rel=1e-3)


def test_derivatives_of_measures_are_those_of_runs():
    for deck, values in ((CHARGING, {"r": 1e3}), (RINGING, {"r": 20.0, "c": 1e-6})):
        along = Measures(Task(deck, {}, tuple(values), {"reltol": 1e-9}))
        sizes = place = tuple(values.values())
        found = along.slopes(place, sizes)
        assert not along.by_runs
        along.by_runs = True
        for name, row in along.slopes(place, sizes).items():
            assert row == pytest.approx(found[name], rel=2e-3, abs=1e-6 * np.abs(row).max()), name


def test_a_goal_that_cannot_be_met_is_told(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rc.cir").write_text(CHARGING)
    assert main(["optimise", "rc.cir", "-p", "r=100..200", "--goal", "t9=1m"]) == 0
    said = capsys.readouterr()
    assert "W434" in said.err and "W432" in said.err and "t9" in said.out


def test_a_goal_of_no_measure_is_refused():
    with pytest.raises(emsim.DeckError, match=r"no \.meas `t8`"):
        emsim.optimise(CHARGING, "r", "t8=1m")


@pytest.mark.parametrize("goal", ["t9", "t9=fast", "=3"])
def test_what_is_no_goal_is_said(goal):
    with pytest.raises(ValueError, match="a goal is"):
        emsim.optimise(CHARGING, "r", goal)
