"""Deviations that are known beforehand: by a shift in value, a shift in time, a scale."""

from __future__ import annotations

import numpy as np
import pytest

from emsim.reports.compare import compare, table_lines
from emsim.store import Columns
from emsim.table import Table

T = np.linspace(0, 1, 2001)


def table(t, kind="tran", **columns):
    names = [{"v": "v(out)", "i": "i(v1)", "w": "v(w)"}[key] for key in columns]
    units = ["A" if name.startswith("i") else "V" for name in names]
    return Table(
        kind,
        ["time", *names],
        ["s", *units],
        Columns([np.asarray(c).tolist() for c in (t, *columns.values())]),
    )


def row(ours, tight, **more):
    found = compare([ours], [tight], **more)
    return found.rows[0]


def test_a_constant_offset_is_measured_by_the_range():
    wave = 3 * np.sin(6 * T)
    r = row(table(T, v=wave + 0.06), table(T, v=wave), window=0.0)
    assert r.scale == pytest.approx(np.ptp(wave)) and r.maximum == pytest.approx(0.06 / r.scale)
    assert r.rms == pytest.approx(r.maximum, rel=1e-3)


def test_rms_weighs_by_time_not_by_points():
    """The error stands on half the time but on 1 % of the points."""
    t = np.concatenate([np.linspace(0, 0.5, 2000), np.linspace(0.5, 1, 20)[1:]])
    r = row(table(t, v=t + 0.1 * (t > 0.5)), table(t, v=t), window=0.0)
    assert r.rms == pytest.approx(0.1 * np.sqrt(0.5), rel=0.05) and r.maximum == pytest.approx(0.1)


def test_a_late_edge_is_forgiven_within_the_window_only():
    def edge(at):
        return [0, at, at + 1e-9, 1], [0.0, 0.0, 1.0, 1.0]

    (t0, y0), (t1, y1) = edge(0.5), edge(0.5 + 2e-7)
    assert row(table(t1, v=y1), table(t0, v=y0)).maximum == 0
    assert row(table(t1, v=y1), table(t0, v=y0), window=1e-7).maximum > 0.9


def test_the_window_does_not_forgive_a_wrong_level():
    r = row(
        table([0, 0.5, 0.5 + 1e-9, 1], v=[0, 0, 1.1, 1.1]), table([0, 0.5, 0.5 + 1e-9, 1], v=[0, 0, 1, 1])
    )
    assert r.maximum == pytest.approx(0.1, rel=1e-6)


def test_coarse_points_of_a_smooth_signal_are_not_blamed():
    """40 points a period: chords would be off by 0.3 % of the range, the interpolation is not."""
    coarse = np.linspace(0, 1, 41)
    r = row(table(coarse, v=np.sin(2 * np.pi * coarse)), table(T, v=np.sin(2 * np.pi * T)))
    assert r.maximum < 5e-4


def test_numerical_zero_has_a_floor():
    noise = 1e-18 * np.random.default_rng(0).standard_normal(len(T))
    assert row(table(T, i=-noise), table(T, i=noise)).maximum < 1e-5
    # beside a signal of the same unit that is large
    found = compare([table(T, v=T * 0, w=1000 * T)], [table(T, v=1e-8 * T, w=1000 * T)])
    assert found.rows[0].scale == pytest.approx(1e-3)


def test_a_supply_that_does_not_move_is_measured_by_its_size():
    assert row(table(T, v=0 * T + 5.01), table(T, v=0 * T + 5)).scale == pytest.approx(5e-3)


def test_who_is_nearer():
    tight, near, far = (table(T, v=T + e) for e in (0, 1e-3, 1e-2))
    found = compare([near], [tight], [far])
    assert found.passed and found.rows[0].nearer == "emsim" and found.count("emsim") == 1
    swapped = compare([far], [tight], [near])
    assert not swapped.passed and swapped.rows[0].nearer == "ngspice"
    assert compare([tight], [tight], [tight]).rows[0].nearer == "equal"
    assert compare([near], [tight]).rows[0].nearer == ""


def test_operating_points_are_compared_by_value():
    def op(v):
        return Table("op", ["v(out)"], ["V"], Columns([[v]]), axis=False)

    r = row(op(5.05), op(5.0))
    assert r.maximum == pytest.approx(0.01) and r.worst_at is None


def test_only_shared_time_and_shared_names_count():
    """ngspice leaves t = 0 out with UIC; names of one side are listed."""
    ours = table(T, v=np.where(T == 0, 99, T), i=T)
    found = compare([ours], [table(T[1:], v=T[1:])])
    assert found.passed and found.unmatched == ["i(v1)"] and [r.name for r in found.rows] == ["v(out)"]


def test_nothing_in_common_is_no_pass():
    found = compare([table(T, v=T)], [table(T, i=T)])
    assert not found.passed and "nothing compared" in "\n".join(table_lines(found))


def test_the_text_names_what_is_over_and_where():
    bad = np.where(abs(T - 0.25) < 1e-4, T + 0.5, T)
    text = "\n".join(table_lines(compare([table(T, v=bad)], [table(T, v=T)])))
    assert "1 of 1 signals are further than 0.5 %" in text and "over at 0.25 s" in text
