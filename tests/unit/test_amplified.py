"""The second run that tells whether a motion amplifies errors (W417)."""

from __future__ import annotations

from array import array
from types import SimpleNamespace

import pytest

from emsim.analyses import afterwards, base


class Waves:
    """Columns of a run, as the engine gives them."""

    def __init__(self, *columns: list[float]) -> None:
        self.columns, self.rows = [array("d", c) for c in columns], len(columns[0])
        self.status, self.stats = "ok", {"steps": 1}

    def column(self, k: int) -> bytes:
        return self.columns[k].tobytes()

    def value(self, row: int, k: int) -> float:
        return self.columns[k][row]


@pytest.mark.parametrize("other", [[0.0, 0.0, 0.0], [0.0, 0.5, 1.5]])
def test_what_moves_in_one_of_two_runs_is_told(monkeypatch, other):
    """A ball that is hit in the run, and with finer steps is just missed: it never moves there."""
    told: list[str] = []
    monkeypatch.setattr(base, "recorded", lambda *_: (["x(a)", "x(b)"], ["m", "m"], []))
    coordinates = [SimpleNamespace(q_name=name, u_name="") for name in ("x(a)", "x(b)")]
    machine = SimpleNamespace(found=SimpleNamespace(dof=6), all_coordinates=lambda: coordinates)
    again = Waves([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], other)
    system = SimpleNamespace(names=["x(a)", "x(b)"], tran=lambda *_, **_given: again)
    sink = SimpleNamespace(warning=lambda code, *_: told.append(code))
    assembly = SimpleNamespace(machine=machine, options={}, system=system, flat=SimpleNamespace(sink=sink))
    waves = Waves([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], [0.0, 0.5, 1.0])
    run = SimpleNamespace(waves=waves, grid=(1.0, 2.0, 0.0), uic=False, analysis=None)
    afterwards._amplified(assembly, run)
    assert told == ["W417"]
