"""The bench of the two paces runs, and what it writes is what it measured; no time is judged here."""

from __future__ import annotations

import csv
from pathlib import Path

import multirate


def test_a_corner_of_the_map(tmp_path: Path) -> None:
    rows = multirate.main(["--links", "1,5", "--fsw", "50k", "--stop", "1m", "--out", str(tmp_path)])
    with (tmp_path / "multirate.csv").open() as file:
        written = list(csv.DictReader(file))
    assert [float(r["ratio"]) for r in written] == [r["ratio"] for r in rows]
    assert (tmp_path / "multirate.png").stat().st_size > 10_000
    for row in rows:
        for method in ("multirate", *multirate.SINGLE):
            assert row[f"error {method}"] <= 1e-4
            assert 0 < row[method] < float("inf")
