"""The paper's claim in numbers: what counts is steps per period, not frequency; gear damps, radau does not."""

from __future__ import annotations

import paper_tank
import pytest


@pytest.mark.parametrize("case", paper_tank.CASES)
def test_gear_at_default_tolerance_dies(case):
    row = paper_tank.tank(*paper_tank.CASES[case], "gear", 1e-3, 0.5)
    assert not paper_tank.kept(row) and row["amplitude"] < 0.9, row


@pytest.mark.parametrize("case", paper_tank.CASES)
def test_radau_at_1e6_keeps_amplitude_and_phase(case):
    row = paper_tank.tank(*paper_tank.CASES[case], "radau", 1e-6, 0.5)
    assert paper_tank.kept(row), row


@pytest.mark.parametrize("case", paper_tank.CASES)
def test_trap_keeps_the_amplitude_but_needs_many_steps_for_the_phase(case):
    f, cap = paper_tank.CASES[case]
    coarse, fine = (paper_tank.tank(f, cap, "trap", 1e-3, tmax) for tmax in (0.1, 0.005))
    assert abs(coarse["amplitude"] - 1) < 0.01 and not paper_tank.kept(coarse), coarse
    assert paper_tank.kept(fine), fine


@pytest.mark.parametrize("method", paper_tank.METHODS)
def test_frequency_does_not_matter(method):
    """Same steps per period, same result, from 100 kHz to 700 MHz."""
    rows = [paper_tank.tank(f, cap, method, 1e-3, 0.02) for f, cap in paper_tank.CASES.values()]
    for row in rows[1:]:
        assert row["amplitude"] == pytest.approx(rows[0]["amplitude"], abs=2e-3)
        assert row["steps"] == pytest.approx(rows[0]["steps"], rel=0.05)


def test_table_prints(capsys):
    assert paper_tank.main(["--quick"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + len(paper_tank.METHODS) * len(paper_tank.RELTOLS) * len(paper_tank.TMAX)
