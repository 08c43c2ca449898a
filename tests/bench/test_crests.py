"""Pulses near crests are all seen; crests.py draws the whole chart."""

from __future__ import annotations

import pytest
from crests import READERS, SOURCES, seen


@pytest.mark.parametrize("method", ["auto", "trap", "esdirk"])
@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
@pytest.mark.parametrize("path", ["direct", "divider", "rc"])
def test_every_crest_of_a_sine_is_seen(path, reltol, method):
    assert seen("sin", path, "B", 0.999, method, reltol) == (1.0, 0)


@pytest.mark.parametrize("source", SOURCES)
def test_of_every_source_through_an_expression(source):
    assert seen(source, "cube", "B", 0.95, "auto", 1e-3) == (1.0, 0)


@pytest.mark.parametrize("reader", READERS)
def test_by_everything_that_has_a_threshold(reader):
    assert seen("sin", "direct", reader, 0.99, "auto", 1e-3) == (1.0, 0)
