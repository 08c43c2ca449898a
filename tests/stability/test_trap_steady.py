"""The trapezoid rings on a junction behind a milliohm; whether the error control sees the ringing must not hang on the
fourth digit of reltol. It once did: 24 000 or 50 000 steps on a ten-stage multiplier, in one case of ten."""

from __future__ import annotations

import pytest
from support import run

TRUTH = 1036.62  # v(d9) at 20 ms: trap at reltol 1e-6 and ngspice 39 at 1e-6 with tmax 20 ns agree on 1036.62


def multiplier(stages: int = 10) -> str:
    lines = ["multiplier", "V1 n0 0 SIN(0 100 10k)"]
    ac, dc = "n0", "0"
    for k in range(stages):
        lines += [
            f"Ca{k} {ac} a{k} 10n",
            f"Da{k} {dc} a{k} dm",
            f"Db{k} a{k} d{k} dm",
            f"Cb{k} {dc} d{k} 10n",
        ]
        ac, dc = f"a{k}", f"d{k}"
    model = ".model dm D(is=1e-14 n=1 rs=0.1 cjo=10p)"
    return "\n".join([*lines, f"RL {dc} 0 10meg", model, ".save v(d9)", ".tran 1u 20m", ".end", ""])


@pytest.mark.slow
def test_steps_do_not_jump_with_the_tolerance():
    text = multiplier()
    steps, ends = [], []
    for k in range(8):
        result = run(text, f"reltol={1e-3 * (0.93 + 0.02 * k):g}")
        steps.append(result.stats["steps"])
        ends.append(float(result["v(d9)"][-1]))
    assert max(steps) < 1.1 * min(steps), steps
    # a few tenths of a per cent at the default tolerance
    assert max(abs(v - TRUTH) for v in ends) < 4e-3 * TRUTH, ends
