"""Stages of nonlinear equations may have several solutions: the one that begins at the start of the step is wanted."""

from __future__ import annotations

import numpy as np
import pytest
from support import deck, run

WANT = 2.0833403401497817e-08  # the test set's y1 at 1e11 s


@pytest.mark.parametrize("method", ["esdirk", "trbdf2"])
@pytest.mark.parametrize("reltol", [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5])
@pytest.mark.parametrize("absolute", ["deck", "default"])
def test_robertson_below_its_tolerance(method, reltol, absolute):
    """y1 falls from 1 to 2e-8, its tolerance to 2 % of reltol. Late stages have two roots, both within it; from the negative one
    the kinetics themselves run away, to -4e7 under esdirk. What is known of y1 then is that it neither grows nor changes sign."""
    text = deck("electrical/ref_robertson")
    if absolute == "default":
        text = text.replace("vntol=1e-16 abstol=1e-20 chgtol=1e-16", "")
    found = run(text, f"method={method} reltol={reltol:g}")
    y1, y2, y3 = (np.asarray(found[f"v(y{k})"]) for k in (1, 2, 3))
    assert found.status == "ok"
    assert min(y1.min(), y2.min()) >= 0.0
    assert np.abs(y1 + y2 + y3 - 1.0).max() <= 1e-9
    assert y1[-1] == pytest.approx(WANT, rel=0.3)
