"""L-stable methods forget a fast component at once; the trapezoidal rule does not."""

from __future__ import annotations

import numpy as np
import pytest
from support import run

# tau = 1 ps under steps of 1 ms: h/tau = 1e9, from 1 V that nothing holds; beside it tau = 0.1 s
STIFF = """a picosecond beside a tenth of a second
C1 fast 0 1p IC=1
R1 fast 0 1
C2 slow 0 1 IC=1
R2 slow 0 0.1
.options fixed_step=1m
.tran 10m 0.1 UIC
.end
"""


@pytest.mark.parametrize("method", ["radau", "trbdf2", "esdirk"])
def test_a_picosecond_is_gone_after_one_step(method):
    result = run(STIFF, f"method={method}")
    time, fast, slow = (np.asarray(result[n]) for n in ("time", "v(fast)", "v(slow)"))
    after = time >= 0.999e-3
    assert np.abs(fast[after]).max() <= 1e-8
    assert np.abs(slow - np.exp(-time / 0.1)).max() <= 2e-5  # TR-BDF2's own h^2


def test_the_step_is_not_bound_by_what_has_decayed():
    """With step control, a picosecond costs nothing once it is over: fewer than 200 steps for 1e11 time constants."""
    for method in ("trbdf2", "esdirk"):
        result = run(STIFF.replace(".options fixed_step=1m\n", ".options reltol=1e-4\n"), f"method={method}")
        slow, time = np.asarray(result["v(slow)"]), np.asarray(result["time"])
        assert result.stats["steps"] < 200, (method, result.stats["steps"])
        assert np.abs(slow - np.exp(-time / 0.1)).max() <= 1e-3
