"""A share of the bed of closed loops: plain runs beside tight ones from given values."""

from __future__ import annotations

import loops
import pytest

# kinds whose runs take well below a second; the whole bed: python tests/bench/loops.py
QUICK = ("buck", "current", "hysteretic", "sigma_delta", "timer", "pll", "ring", "wien")


@pytest.mark.parametrize("kind", QUICK)
def test_a_loop_obeys_its_limits_and_comes_to_the_means_of_a_tight_run(kind: str) -> None:
    (loop,) = loops.loops(7, 1, [kind])
    wrong = {who: what for who, what in loops.judged(loop, ["auto"], False) if what}
    assert wrong == {}


def test_a_limit_that_is_left_is_seen() -> None:
    (loop,) = loops.loops(7, 1, ["buck"])
    own = loops.run(loop)
    left = loops.Outcome(own.means, own.ranges, {"v(c)": 2000.0}, ())
    assert loops.verdict(loop, left, own).startswith("limit v(c)")
    off = loops.Outcome({"v(out)": 1.1 * own.means["v(out)"]}, own.ranges, own.beyond, ())
    assert loops.verdict(loop, off, own).startswith("mean v(out)")
