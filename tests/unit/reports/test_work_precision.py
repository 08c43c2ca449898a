"""Fronts of work-precision points: what counts, what is interpolated, what is never extrapolated."""

from __future__ import annotations

import pytest

from emsim.reports.chart import csv_lines, failures, lines
from emsim.reports.work_precision import Chart, Point, Series, best, exponent, front, short, time_at


def tool(name: str, *pairs: tuple[float, float]) -> Series:
    return Series(name, "emsim", [Point(f"{e:g}", e, e, s, 10, 5) for e, s in pairs])


def test_front_keeps_what_nothing_beats():
    # slower and less accurate than its neighbour: not on the front
    assert front([(1e-2, 1.0), (1e-3, 3.0), (2e-3, 4.0), (1e-5, 5.0)]) == [
        (1e-2, 1.0),
        (1e-3, 3.0),
        (1e-5, 5.0),
    ]


def test_equal_times_keep_the_more_accurate():
    assert front([(1e-2, 1.0), (1e-4, 1.0)]) == [(1e-4, 1.0)]


def test_between_points_it_is_a_power_law():
    # time = error^-0.5 exactly
    line = front([(10.0**-k, 10.0 ** (k / 2)) for k in (2, 4, 8)])
    for k in (2, 3, 5.5, 8):
        assert time_at(line, 10.0**-k) == pytest.approx(10 ** (k / 2), rel=1e-12)


def test_more_accurate_than_asked_costs_its_cheapest_point():
    assert time_at([(1e-5, 0.3), (1e-7, 0.9)], 1e-2) == 0.3


def test_nothing_is_extrapolated():
    assert time_at([(1e-3, 1.0), (1e-5, 2.0)], 9e-6) is None
    assert time_at([], 1e-3) is None


def test_failed_points_are_on_no_front():
    series = tool("a", (1e-2, 1.0), (1e-4, 2.0))
    series.points.append(Point("1e-6", 1e-6, None, 9.0, reason="over 9 s"))
    assert series.at(1e-4) == 2.0 and series.at(1e-5) is None
    assert [p.reason for p in series.failures] == ["over 9 s"]


def test_errors_that_the_reference_does_not_resolve_count_as_its_own():
    series = tool("a", (1e-4, 1.0), (1e-12, 2.0))
    assert series.at(1e-9) is not None
    assert series.at(1e-9, floor=1e-8) is None
    assert series.at(1e-8, floor=1e-8) == 2.0


def test_best_is_the_cheapest_that_gets_there():
    fast, exact = tool("fast", (1e-3, 1.0)), tool("exact", (1e-3, 2.0), (1e-9, 4.0))
    found = best([fast, exact], 1e-3)
    assert found is not None and found[0] is fast and found[1] == 1.0
    found = best([fast, exact], 1e-6)
    assert found is not None and found[0] is exact and found[1] == pytest.approx(8**0.5)
    assert best([fast], 1e-6) is None


@pytest.fixture
def chart() -> Chart:
    made = Chart("deck", "A deck", ["v(a)"], 50)
    made.reference, made.distance = "radau 1e-13, met to 1e-10 by gear 1e-12", 1e-10
    failing = tool("rk45", (1e-2, 1.0))
    failing.points += [Point(f"1e-{k}", 10.0**-k, None, 1.0, reason="over 1 s, at once") for k in (4, 5)]
    failing.points.append(Point("1e-6", 1e-6, None, 0.0, reason="unfit: index 2"))
    made.series = [tool("radau", (1e-3, 2e-3), (1e-11, 5e-3)), failing]
    return made


def test_failures_are_told_once_a_reason(chart):
    assert list(failures(chart)) == [
        ("rk45", "1e-4 .. 1e-5", "over 1 s, at once"),
        ("rk45", "1e-6", "unfit: index 2"),
    ]


def test_table_shows_times_and_what_is_not_reached(chart):
    text = "\n".join(lines(chart, points=True))
    assert "one point came nearer" in text and "over 1 s" in text
    (head,) = (line.split() for line in text.splitlines() if line.endswith("best error"))
    assert (
        head[0] == "1e-2" and head[-3] == "1e-10"
    )  # the reference's own floor; nothing beyond it is claimed
    table = text[text.index("CPU ms") : text.index("setting")].splitlines()
    radau, rk45 = (next(line.split() for line in table if name in line) for name in ("radau", "rk45"))
    assert radau[1] == "2" and radau[-1] == "<1.0e-10"
    assert rk45[1] == "1e+03" and set(rk45[2:-1]) == {"-"}


def test_csv_has_every_point_and_quotes_commas(chart):
    import csv

    rows = list(csv.DictReader(csv_lines([chart])))
    assert len(rows) == 6
    assert rows[-2]["reason"] == "over 1 s, at once" and rows[-2]["error"] == ""
    assert float(rows[0]["cpu_seconds"]) == 2e-3


def test_a_chart_survives_its_dictionary(chart):
    again = Chart.from_dict(chart.as_dict())
    assert again.as_dict() == chart.as_dict()
    assert again.unresolved == 1


def test_the_picture_says_why_runs_failed_and_what_was_left_out(chart, tmp_path):
    pytest.importorskip("matplotlib")
    from emsim.reports import draw

    chart.notes.append("no scipy witness: index 2")
    draw.one(str(tmp_path / "c.svg"), chart)
    text = (tmp_path / "c.svg").read_text()
    assert "failed: rk45, 1e-4 .. 1e-5: over 1 s, at once" in text and "rk45, 1e-6: unfit: index 2" in text
    assert "no scipy witness: index 2" in text


def test_a_long_list_of_reasons_is_cut(chart):
    from emsim.reports import draw

    chart.notes += [f"note {k}" for k in range(40)]
    assert len(draw.reasons(chart)) == draw.MOST and draw.reasons(chart)[-1] == f"and {43 - draw.MOST} more"


def test_numbers_read_well():
    assert [exponent(t) for t in (1e-2, 1e-6, 2.5e-10)] == ["1e-2", "1e-6", "2.5e-10"]
    assert [short(t) for t in (3.4e-5, 1.23e-3, 0.34, 12.3)] == ["0.034 ms", "1.2 ms", "340 ms", "12.3 s"]
