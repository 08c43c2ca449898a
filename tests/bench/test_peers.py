"""Other engines' friction, stops and contacts: softened laws that come nearer with their steps."""

from __future__ import annotations

from math import exp, pi, sqrt

import numpy as np
import peers
import pytest
from peers.machines import TOUCH, touch
from support import NETLISTS

from emsim import pipeline
from emsim.reports.ladder import Judge, Problem

MODULES = {name: module for name, (module, _) in peers.PROGRAMS.items()}


@pytest.mark.parametrize("pulls", [True, False])
@pytest.mark.parametrize("e", [0.2, 0.5, 0.8, 0.97])
def test_a_touch_gives_back_its_share(e, pulls):
    h = 1e-3
    k, c = touch(e, h, pulls)
    d = c / 2
    w = sqrt(k - d * d)
    t = TOUCH * h
    x, v = exp(-d * t) * np.sin(w * t) / w, exp(-d * t) * (np.cos(w * t) - d / w * np.sin(w * t))
    assert v == pytest.approx(-e, rel=1e-9)
    # it ends where it is back, or where its force is 0
    assert (x * w if pulls else (k * x + c * v) / sqrt(k)) == pytest.approx(0, abs=1e-9)
    assert 0 < w * t < pi * (1 + 1e-9)


def test_steps_of_an_even_problem_are_all_alike():
    deck = NETLISTS / "bench" / "sled.cir"
    problem = Problem(lambda options: pipeline.prepare(pipeline.read(deck), options), times=20, even=True)
    grid = problem.grid
    assert len(grid) == 20 and np.allclose(np.diff(grid), grid[0], rtol=1e-12)


@pytest.mark.parametrize(
    "program, machine",
    [
        ("mujoco", "sled"), ("mujoco", "ref_stop_pendulum"), ("mujoco", "bouncing_ball"),
        ("exudyn", "sled"), ("exudyn", "ref_stop_pendulum"), ("exudyn", "bouncing_ball"),
    ],
)  # fmt: skip
def test_the_error_falls_with_the_step(program, machine):
    pytest.importorskip(MODULES[program])
    deck = next(NETLISTS.glob(f"*/{machine}.cir"))
    problem = Problem(lambda options: pipeline.prepare(pipeline.read(deck), options), times=20, even=True)
    judge = Judge(problem, problem.values(problem.run("radau", 1e-8)[0]))
    series, notes = peers.measure(problem, judge, machine, [program], limit=0.05, rounds=1)
    assert not notes and series
    for one in series:
        errors = [p.error for p in one.good]
        assert min(errors) < 0.2 * max(errors) and min(errors) < 0.1
