"""Looking at every recorded row costs little."""

from __future__ import annotations

import invariants
import pytest


@pytest.mark.parametrize("deck", ["coupled/relay", "mechanical/ref_four_bar"])
def test_looking_at_rows_is_cheap(deck):
    text = (invariants.NETLISTS / f"{deck}.cir").read_text(encoding="utf-8")
    with_, without = invariants.cost(text, 9)
    assert with_ < 1.5 * without
