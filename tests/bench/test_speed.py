"""The speed script runs; no time is judged here."""

from __future__ import annotations

import pytest
import speed
from support import needs_ngspice

pytestmark = [needs_ngspice, pytest.mark.ngspice]


@pytest.mark.parametrize("name", speed.CIRCUITS)
def test_measure(name):
    found = speed.measure(name, runs=1, scale=0.003)
    assert found["emsim_points"] > 20 and found["ngspice_points"] > 20
    assert found["emsim_wall"] > 0 and found["emsim_cpu"] > 0


def test_process_times():
    found = speed.process_times(1)
    assert len(found) == 3 and all(wall > 1 and cpu >= 0 for wall, cpu in found.values())
