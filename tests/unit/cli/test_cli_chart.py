"""`emsim chart`: what it measures on a small deck, its files, its exit codes."""

from __future__ import annotations

import csv
import json
import os
import signal
import threading
from itertools import pairwise

import numpy as np
import pytest
from support import NETLISTS, ROOT, needs_ngspice

import emsim
from emsim import pipeline
from emsim.cli import main
from emsim.interop.ngspice import NgspiceError
from emsim.interop.ngspice_time import Bench
from emsim.reports import ladder, reference, spice, witness
from emsim.reports.ladder import Judge, Problem, measure

PENDULUM = str(NETLISTS / "mechanical" / "ref_double_pendulum.cir")
TANK = """tank
C1 a 0 1u IC=1
L1 a 0 1m
.tran 10u 1m UIC
.end
"""
QUICK = ["--methods", "trap,radau", "--tolerances", "1e-3,1e-5,1e-7", "--rounds", "1", "--alone", "-q"]


@pytest.fixture
def tank(scratch):
    (scratch / "tank.cir").write_text(TANK)
    return "tank.cir"


def test_a_machine(capsys, scratch):
    assert main(["chart", PENDULUM, *QUICK, "--json", "-o", "p.png", "--csv", "p.csv"]) == 0
    document = json.loads(capsys.readouterr().out)
    chart = document["chart"]
    assert chart["signals"] == ["angle(p1)", "omega(p1)", "angle(p2)", "omega(p2)"]
    assert "radau 1e-13" in chart["reference"] and chart["distance"] < 1e-8
    errors = {s["name"]: [p["error"] for p in s["points"]] for s in chart["series"] if s["group"] == "emsim"}
    # error falls with the tolerance; radau is good to ten tolerances, trap is not asked to be
    assert all(a > b for e in errors.values() for a, b in pairwise(e))
    assert errors["radau"][-1] < 1e-6 and errors["trap"][-1] > errors["radau"][-1]
    assert all(p["seconds"] > 0 and p["evaluations"] > 10 for s in chart["series"] for p in s["points"])
    assert document["files"] == ["p.csv", "p.png"]
    assert (scratch / "p.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((scratch / "p.csv").open()))
    assert {row["tool"] for row in rows} >= {"trap", "radau"} and len(rows) >= 6


class Known(Judge):
    """A judge of the tank's voltage that needs no reference run: v = cos(t/sqrt(LC)), of range 2."""

    def __init__(self, problem: Problem) -> None:
        self.reference = np.cos(problem.grid / np.sqrt(1e-9))[None, :]
        self.scale = np.array([2.0])


def tank_problem(stop: str) -> Problem:
    text = TANK.replace(" 1m ", f" {stop} ")
    return Problem(lambda options: pipeline.prepare(pipeline.read(text), options), ["v(a)"])


def test_a_run_over_its_limit_tells_so():
    table, stats, reason = tank_problem("40").run("radau", 1e-9, 0.05)
    assert table is None and reason == "over 0.05 s"
    assert 0.05 <= stats["solve_time"] < 1.0


def test_errors_are_those_of_the_closed_form():
    """What is charted is the distance from cos(t/sqrt(LC)), to the last digits."""
    problem = tank_problem("1m")
    (trap, radau) = measure(problem, Known(problem), ["trap", "radau"], (1e-3, 1e-9), rounds=1)
    run = emsim.run(TANK, method="trap", reltol=1e-3)
    true = np.abs(run["v(a)"] - np.cos(run.time / np.sqrt(1e-9))).max() / 2
    assert trap.points[0].error == pytest.approx(true, rel=0.2)
    assert radau.points[1].error < 1e-8


def test_a_method_over_its_limit_is_not_tried_at_tighter_tolerances():
    problem = tank_problem("40m")
    (trap,) = measure(problem, Known(problem), ["trap"], (1e-3, 1e-12, 1e-13), limit=0.1, rounds=1)
    assert [p.reason for p in trap.points] == ["", "over 0.1 s", "not tried: over 0.1 s at 1e-12"]
    assert trap.points[1].seconds >= 0.1 and trap.points[1].error is None


def test_a_senseless_run_is_no_point_of_a_front():
    problem = tank_problem("1m")
    judge = Known(problem)
    judge.scale = np.array([1e-6])
    (trap,) = measure(problem, judge, ["trap"], (1e-3,), rounds=1)
    assert trap.points[0].reason.startswith("wrong by") and not trap.good


def test_scipy_meets_the_closed_form():
    problem = tank_problem("1m")
    (found,) = witness.measure(problem, Known(problem), emsim.compile(TANK), ["DOP853"], (1e-9,))
    assert found.points[0].error < 1e-7 and found.points[0].evaluations > 100
    assert found.label == "scipy DOP853"


def test_a_state_of_scipy_without_its_unknowns_is_no_point(monkeypatch):
    """What is not a number was left out of the error as a signal that is not there, and the others made a point of it."""
    problem = tank_problem("1m")
    complete = witness.Reduced.complete

    def lost(reduced, t, y):
        x, f, c = complete(reduced, t, y)
        return (x if reduced.end < float("inf") else x * float("nan")), f, c

    monkeypatch.setattr(witness.Reduced, "complete", lost)
    (found,) = witness.measure(problem, Known(problem), emsim.compile(TANK), ["DOP853"], (1e-9,))
    assert not found.good and found.points[0].reason.startswith("its algebraic unknowns")


def test_scipy_reduces_floating_capacitors_and_refuses_what_is_no_ode():
    """A capacitor between two nodes has a null space in dQ/dx: v(b) is algebraic in a turned basis."""
    text = "c\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b c 100n\nR2 c 0 1k\n.tran 10u 2m\n.end\n"
    problem = Problem(lambda options: pipeline.prepare(pipeline.read(text), options), ["v(b)", "v(c)"])
    table, _, _ = problem.run("radau", 1e-10)
    (found,) = witness.measure(
        problem, Judge(problem, problem.values(table)), emsim.compile(text), ["DOP853"], (1e-9,)
    )
    assert found.points[0].error < 1e-7
    switching = "s\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\nS1 b 0 a 0 m\n.model m SW(vt=0.5 vh=0.1)\n.tran 10u 2m\n.end\n"
    with pytest.raises(witness.NoOde, match="thresholds s1 holds a state"):
        witness.Reduced(emsim.compile(switching))
    with pytest.raises(witness.NoOde, match="index 2"):
        witness.Reduced(emsim.compile(NETLISTS / "mechanical" / "ref_four_bar.cir"))


def test_a_chart_of_inputs_alone_says_so(capsys, scratch):
    """A deck that saves its source alone is compared on it, where every method is right to the last digit."""
    (scratch / "d.cir").write_text(
        "rc\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.save v(a)\n.tran 10u 1m\n.end\n"
    )
    assert main(["chart", "d.cir", *QUICK]) == 0
    assert "v(a), and none of it stands under d/dt" in capsys.readouterr().out


def test_scipy_witnesses_a_clamp():
    """v' = -max(v - 1, 1/2) from 3 on: v = 1 + 2 exp(-t) until v = 3/2 at t = ln 4, from there on a straight line."""
    text = "clamp\nC1 b 0 1 ic=3\nB1 b 0 I={max(v(b)-1, 0.5)}\n.tran 10m 2 uic\n.end\n"
    problem = Problem(lambda options: pipeline.prepare(pipeline.read(text), options), ["v(b)"])
    t = problem.grid
    exact = np.where(t < np.log(4), 1 + 2 * np.exp(-t), 1.5 - 0.5 * (t - np.log(4)))
    for method in ("RK45", "LSODA"):
        system = emsim.compile(text)
        assert system.conditions and not system.latches
        (found,) = witness.measure(problem, Judge(problem, exact[None]), system, [method], (1e-9,))
        assert found.points[0].error < 1e-7


def test_a_second_method_that_disagrees_is_outvoted():
    """The reference is the pair that meets nearest, and the text tells who is away."""

    class Skewed(Problem):
        def values(self, table):
            found = super().values(table)
            return found + 1e-3 * (self.last == "radau")

        def run(self, method, *args, **more):
            self.last = method
            return super().run(method, *args, **more)

    problem = Skewed(lambda options: pipeline.prepare(pipeline.read(TANK), options), ["v(a)"])
    found = reference.find(problem, ["radau", "gear", "trap"], limit=0.5)
    assert found.text.startswith("gear") and "radau" in found.text
    assert Known(problem).error(found.judge.reference) < 1e-5


@pytest.mark.parametrize(
    ("args", "code", "word"),
    [
        (["--methods", "radu"], 2, "did you mean radau"),
        (["--tolerances", "2"], 2, "from 1e-14"),
        (["--tolerances", "1e-3,x"], 2, "'x'"),
        (["--times", "1.5"], 2, "whole number"),
        (["--signals", ","], 2, "names of columns"),
        (["--signals", "v(b)"], 1, "no column v(b)"),
        (["-o", "nowhere/p.png"], 5, "no folder nowhere"),
        (["--rounds"], 2, "needs a value"),
    ],
)
def test_bad_input(capsys, tank, args, code, word):
    assert main(["chart", tank, *QUICK, *args]) == code
    assert word in capsys.readouterr().err


def test_an_unknown_format_is_a_usage_error(capsys, tank):
    assert main(["chart", tank, *QUICK, "-o", "p.xyz"]) == 2
    assert ".svg" in capsys.readouterr().err


def test_ctrl_c_is_no_run_over_its_limit():
    problem = tank_problem("40")
    timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            problem.run("rk45", 1e-9, 30.0)
    finally:
        timer.cancel()
        signal.signal(signal.SIGINT, before)


SWING = """swing
.gravity 9.81
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin zero=-90deg ic=30deg damp=1m
.tran 10m 1
{options}
.end
"""


def test_absolute_tolerances_of_a_machine_follow_the_ladder_too():
    """Left in force they kept trap at 3 % down to 1e-9, and the reference at 2e-5."""

    def problem(options):
        text = SWING.format(options=options)
        return Problem(lambda given: pipeline.prepare(pipeline.read(text), given))

    loose, plain = problem(".options angtol=1e-2 spintol=1e-2 reltol=1e-4"), problem("")
    assert loose.tolerances(1e-6) == plain.tolerances(1e-6)
    one, other = (p.values(p.run("trap", 1e-7)[0]) for p in (loose, plain))
    np.testing.assert_array_equal(one, other)


def test_decks_that_cannot_be_charted(capsys, scratch):
    (scratch / "op.cir").write_text("op\nV1 a 0 1\nR1 a 0 1\n.op\n.end\n")
    assert main(["chart", "op.cir", *QUICK]) == 1
    assert "no transient analysis" in capsys.readouterr().err
    bad = str(ROOT / "tests" / "decks" / "bad" / "run_no_operating_point.cir")
    assert main(["chart", bad, *QUICK]) == 3
    assert "no reference" in capsys.readouterr().err
    assert main(["chart"]) == 2
    assert main(["chart", "missing.cir"]) == 5


@pytest.mark.ngspice
@needs_ngspice
def test_ngspice_on_the_tank():
    """Its points fall with the largest step, its time is that of the analysis and not of the process."""
    problem = tank_problem("1m")
    turns = ladder.Turns(problem, ())
    found = spice.measure(
        problem, Known(problem), TANK, ".", turns, rounds=1, reltols=(1e-3, 1e-5), parts=(5, 100), limit=5.0
    )
    turns.settle()
    good = found.good
    assert len(good) >= 2 and found.group == "ngspice"
    coarse, fine = good[0], min(good, key=lambda p: p.error)
    assert fine.error < 0.1 * coarse.error and fine.error < 1e-2
    assert all(0 < p.seconds < 1.0 for p in good)


@pytest.mark.ngspice
@needs_ngspice
def test_what_a_cold_start_costs_is_no_cost_of_the_first_run(monkeypatch):
    """The first run of all was charged with finding the program on the disk: the start is measured before it."""
    order = []

    def cpu(bench, deck, timeout):
        order.append("run" if "\nrun\n" in deck else "start")
        return 0.5 if len(order) == 1 else 0.1, ""

    monkeypatch.setattr(Bench, "_cpu", cpu)
    with Bench(TANK, ".", ["v(a)"]) as bench, pytest.raises(NgspiceError):
        bench.values((1e-5, 0.0, 1e-3, 2e-5), "reltol=1e-3", 5.0)
    assert order == ["start", "start", "start", "run"] and bench.start_up((0, 0, 0, 0), "") == 0.1


def test_points_that_are_compared_are_timed_in_turns(monkeypatch):
    """Two figures of different seconds are no ratio: on a machine that is twice as slow in every other turn, every time comes out
    as on a quiet one."""
    problem = tank_problem("1m")
    series = measure(problem, Known(problem), ["auto", "trap"], (1e-3, 1e-5), rounds=1)
    turns = ladder.Turns(problem, series)
    assert "auto" in [name for name, _ in turns.short]
    cost = {(name, p.tolerance): 0.01 * (k + 1) for k, (name, p) in enumerate(turns.short)}
    slow = [1.0]

    def run(method, tolerance, formulation):
        return None, {"solve_time": slow[0] * cost[method, tolerance]}, ""

    monkeypatch.setattr(problem, "run", run)
    for number in range(6):
        slow[0] = 1.0 + number % 2
        turns.take()
    turns.settle()
    for name, point in turns.short:
        assert point.seconds == pytest.approx(cost[name, point.tolerance], rel=1e-12)


def test_what_is_too_long_for_a_turn_is_timed_between_two(monkeypatch):
    """... in parts of these, so that it comes out right where all of it is slow."""
    problem = tank_problem("1m")
    series = measure(problem, Known(problem), ["auto"], (1e-3, 1e-5), rounds=1)
    quick, long = series[0].points
    quick.seconds, long.seconds = 1e-3, 1.0
    turns = ladder.Turns(problem, series)
    assert [p for _, p in turns.short] == [quick] and [p for _, p in turns.long] == [long]

    def run(method, tolerance, formulation):
        slow = 2.0 if turns.parts or len(turns.turns) >= 3 * ladder.TURNS else 1.0
        return None, {"solve_time": slow * (2e-3 if tolerance == 1e-3 else 2.0)}, ""

    monkeypatch.setattr(problem, "run", run)
    turns.spend(4, 60.0)
    turns.settle()
    assert quick.seconds == pytest.approx(2e-3)
    assert long.seconds == pytest.approx(2.0)


@pytest.mark.ngspice
@needs_ngspice
def test_ngspice_that_fails_is_a_point_with_its_words():
    text = "no such model\nC1 a 0 1u IC=1\nL1 a 0 1m\nD1 a 0 nosuch\n.tran 10u 1m UIC\n.end\n"
    problem = tank_problem("1m")
    turns = ladder.Turns(problem, ())
    found = spice.measure(problem, Known(problem), text, ".", turns, rounds=1, reltols=(1e-3,), parts=(1,))
    assert not found.good and found.points[0].reason


def test_help_lists_its_options(capsys):
    assert main(["help", "chart"]) == 0
    out = capsys.readouterr().out
    assert "--tolerances" in out and "CPU time" in out
