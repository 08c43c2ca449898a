"""Decks against reference trajectories (tests/physics/refs/*.csv, each with its source and licence).

Claims: as the deck stands, within 1e-3 of each signal's range at every reference time; with method radau and
reltol 1e-8 within `tight` (1e-5 unless the deck differs from the stated equations, then why is said); and the
error falls from the looser to the tighter run.
"""

from __future__ import annotations

from functools import cache

import pytest
from reference_set import TRAJECTORIES, Errors


@cache
def errors(name: str, options: str) -> Errors:
    return next(c for c in TRAJECTORIES if c.ref == name).errors(options)


CASE_PARAMS = [pytest.param(c, id=c.ref, marks=[pytest.mark.slow] if c.slow else []) for c in TRAJECTORIES]


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_default_tolerance_is_within_1e3_of_range(case):
    found = errors(case.ref, "")
    assert max(found.values()) <= case.default, found


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_tight_tolerance_meets_the_anchor(case):
    found = errors(case.ref, "method=radau reltol=1e-8")
    assert max(found.values()) <= case.tight, found


@pytest.mark.parametrize("case", CASE_PARAMS)
def test_error_falls_with_the_tolerance(case):
    loose, middle, tight = (
        max(errors(case.ref, f"method=radau reltol={r}").values()) for r in ("1e-3", "1e-5", "1e-8")
    )
    assert middle <= max(loose, case.floor), (loose, middle, tight)
    assert tight <= max(0.1 * loose, case.floor), (loose, middle, tight)
