"""Which of ngspice's points are timed again: a first figure that is wrong by half does not cost a point its place."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from emsim.reports import spice
from emsim.reports.work_precision import time_at

# reltol 1e-3 by tmax: steps, error, seconds
RUNS = {1.0: (60, 4e-6, 0.026), 0.5: (110, 2e-6, 0.051), 0.2: (260, 7e-7, 0.058), 0.1: (520, 3e-6, 0.29)}


class Bench:
    """ngspice of which one first figure is high; counts what is timed again."""

    def __init__(self, text: str, folder: str, signals: list[str]) -> None:
        self.timed: dict[float, int] = {}
        Bench.last = self

    def __enter__(self) -> Bench:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def values(self, tran, options, limit):
        steps, error, seconds = RUNS[tran[3]]
        return Table(steps, tran[2], error), seconds * (1.8 if tran[3] == 0.5 else 1.0)

    def seconds(self, tran, options, about, limit):
        self.timed[tran[3]] = self.timed.get(tran[3], 0) + 1
        return RUNS[tran[3]][2]


class Table:
    def __init__(self, steps: int, end: float, error: float) -> None:
        self.steps, self.time, self.error = steps, [0.0, end], error

    def __len__(self) -> int:
        return self.steps


def test_a_first_figure_is_not_trusted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spice, "Bench", Bench)
    problem = SimpleNamespace(
        transient=SimpleNamespace(tstep=1.0, tstart=0.0, tstop=50.0),
        signals=None,
        values=lambda table: table.error,
    )
    judge, turns = SimpleNamespace(error=lambda values: values), SimpleNamespace(take=lambda: None)
    series = spice.measure(problem, judge, "", "", turns, rounds=4, reltols=(1e-3,), parts=(1, 2, 5, 10))  # type: ignore[arg-type]
    assert {p.error: p.seconds for p in series.points} == {e: s for _, e, s in RUNS.values()}
    # what is far from the front stays with its first figure
    assert Bench.last.timed == {1.0: 4, 0.5: 4, 0.2: 4}
    assert time_at([(p.error, p.seconds) for p in series.points[:3]], 2e-6) == pytest.approx(0.051)
