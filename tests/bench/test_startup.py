"""The start-up script runs; no time is judged here. What a run may import is judged in tests/unit/test_layers.py."""

from __future__ import annotations

import startup


def test_measure():
    found = startup.measure(1)
    assert {"python -c pass", "console script"} <= set(found)
    assert all(wall > 1 for wall, _ in found.values())


def test_modules():
    found = startup.modules(1)
    assert "emsim.pipeline" in found and "emsim._engine" in found
