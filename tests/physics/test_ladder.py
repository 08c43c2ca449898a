"""Does a tolerance mean what it says? Exact problems over a ladder of tolerances, method by method.

For reltol 1e-3, 1e-4 .. 1e-10, as a share of the signal's range,

  the error at the reference times is within ten times the tolerance,
  the error over the whole run (against a run at 1e-12) falls with the tolerance: no rung is more than three times worse
  than any rung before it,

both down to `floor`: the digits of the reference, or the rounding of the problem. At single times an error passes through
zero and says little about the rung; that is why the second claim looks at the whole run. Methods that choose their order do so
anew at each rung; one of a fixed order takes every second rung.

Another method joins by a word in METHODS. The same for every method and deck as a table: tests/bench/error_control.py.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from reference_set import PROBLEMS

METHODS = ("auto", "radau", "radau5", "radau9", "radau13")
CHOOSING = ("auto", "radau")
NOISE = 3.0
MEANS = 10.0


PARAMS = [
    pytest.param(p, m, id=f"{p.name}-{m}", marks=[pytest.mark.slow] if m in p.slow else [])
    for p in PROBLEMS
    for m in METHODS
]


@cache
def tight(deck: str) -> object:
    return next(p for p in PROBLEMS if p.deck == deck).run("method=radau reltol=1e-12")


@pytest.mark.parametrize(("problem", "method"), PARAMS)
def test_the_error_follows_the_tolerance(problem, method):
    ladder = problem.ladder if method in CHOOSING else problem.ladder[::2]
    runs = [problem.run(f"method={method} reltol={r:g}") for r in ladder]
    found = [max(problem.errors_of(r).values()) for r in runs]
    whole = [problem.apart(r, tight(problem.deck)) for r in runs]
    report = "\n".join(
        f"{r:g}: {e:.1e}, whole run {w:.1e}" for r, e, w in zip(ladder, found, whole, strict=True)
    )
    for k, reltol in enumerate(ladder):
        means = problem.misses.get((method, reltol), MEANS * reltol)
        assert found[k] <= max(means, problem.floor), report
        assert whole[k] <= max(NOISE * min(whole[:k], default=np.inf), problem.floor), report
