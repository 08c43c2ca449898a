"""What a picture shows: signals, expressions and their units, panels, courses between points, thinning."""

from __future__ import annotations

import numpy as np
import pytest

from emsim import DeckError
from emsim.outputs.html import shown
from emsim.outputs.panels import panels, prefixed, split, thinned, writes_degrees
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

T = [0.0, 1.0, 2.0, 3.0]


def table(kind="tran", **more):
    return Table(
        kind,
        ["time", "v(out)", "i(v1)", "angle(hinge)", "v(in)"],
        ["s", "V", "A", "rad", "V"],
        Columns([T, [0.0, 1.0, 4.0, 9.0], [-1.0, -2.0, -3.0, -4.0], [0.0, 1.0, 2.0, np.pi], [1.0] * 4]),
        **more,
    )


def drawn(text, **more):
    return panels(table(), [text], **more)


def values(text):
    """An expression at the four points."""
    (panel,) = panels(table(kind="other"), [text])
    return panel.unit, panel.curves[0].y.tolist()


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("v(out)", "V", [0, 1, 4, 9]),
        ("V( OUT )", "V", [0, 1, 4, 9]),
        ("v1#branch", "A", [-1, -2, -3, -4]),
        ("out", "V", [0, 1, 4, 9]),
        ("v(out,in)", "V", [-1, 0, 3, 8]),
        ("v(out)-v(in)", "V", [-1, 0, 3, 8]),
        ("2*i(v1)", "A", [-2, -4, -6, -8]),
        ("v(out)*i(v1)", "W", [0, -2, -12, -36]),
        ("v(out)/i(v1)", "Ohm", [0, -0.5, -4 / 3, -9 / 4]),
        ("sqrt(v(out))", "", [0, 1, 2, 3]),
        ("abs(i(v1))", "A", [1, 2, 3, 4]),
        ("deg(angle(hinge))", "deg", [0, np.degrees(1), np.degrees(2), 180]),
        ("v(out)^2", "V^2", [0, 1, 16, 81]),
        ("-v(out)", "V", [0, -1, -4, -9]),
        ("v(out) > 2 ? 1 : 0", "", [0, 0, 1, 1]),
        ("min(v(out),2)", "V", [0, 1, 2, 2]),
        ("sgn(v(out)-1)", "", [-1, 0, 1, 1]),
        ("time*2", "s", [0, 2, 4, 6]),
        ("sin(pi*time)+!time", "", [1, 0, 0, 0]),
    ],
)
def test_expressions_of_columns(text, unit, expected):
    got, found = values(text)
    assert got == unit
    assert found == pytest.approx(expected, abs=1e-12)


def test_where_an_expression_has_no_value():
    _, found = values("log(v(out))")
    assert found[0] == -np.inf and found[1:] == pytest.approx(np.log([1, 4, 9]))
    _, found = values("asin(v(out))")
    assert np.isnan(found[2]) and found[1] == pytest.approx(np.pi / 2)


def test_a_panel_a_unit_in_the_order_of_the_signals():
    found = drawn("i(v1), v(out) angle(hinge) v(in)")
    assert [(p.unit, [c.name for c in p.curves]) for p in found] == [
        ("A", ["i(v1)"]),
        ("V", ["v(out)", "v(in)"]),
        ("rad", ["angle(hinge)"]),
    ]
    assert [p.label for p in found] == ["i(v1)", "voltage", "angle(hinge)"]
    assert {(p.x, p.xunit) for p in found} == {("time", "s")}


def test_several_lists_are_not_mixed():
    assert [p.unit for p in panels(table(), ["v(out) i(v1)", "v(in)"])] == ["V", "A", "V"]


def test_all_signals():
    assert sum(len(p.curves) for p in drawn("all")) == 4


def test_degrees():
    (panel,) = drawn("angle(hinge)", degrees=True)
    assert panel.unit == "deg" and panel.curves[0].y[-1] == pytest.approx(180)
    assert writes_degrees("JOINT hinge 0 arm pin zero=-90deg\n") and not writes_degrees("R1 degree 0 1k\n")


def test_one_signal_over_another():
    (panel,) = drawn("v(out) vs i(v1)")
    curve = panel.curves[0]
    assert (panel.x, panel.xunit, panel.unit) == ("i(v1)", "A", "V")
    # x falls, and the points of the table lie on the curve
    for x, y in zip([-1, -2, -3, -4], [0, 1, 4, 9], strict=True):
        assert curve.y[np.argmin(abs(curve.x - x))] == pytest.approx(y, abs=1e-9)


@pytest.mark.parametrize(
    "text", ["vs", "v(out) vs", "vs v(out)", "v(out) vs i(v1) v(in)", "v(out) vs v(in) vs time"]
)
def test_vs_stands_between(text):
    from emsim.build import parse_signals

    with pytest.raises(DeckError, match="E353"):
        split(parse_signals(text))


@pytest.mark.parametrize(
    ("text", "said", "near"),
    [
        ("v(oot)", "no column `v(oot)`", "v(out)"),
        ("2*angel(hinge)", "no column `angel(hinge)`", "angle(hinge)"),
    ],
)
def test_a_signal_that_is_not_there_is_shown_with_the_nearest(text, said, near):
    with pytest.raises(DeckError) as caught:
        drawn(text)
    (found,) = caught.value.diagnostics
    assert said in found.message and near in found.hint
    assert found.span.text == said.split("`")[1]


def test_curves_of_few_points_follow_the_rule_of_interpolation():
    whole = table()
    (panel,) = drawn("v(out)")
    curve = panel.curves[0]
    assert len(curve.x) >= 1500
    assert curve.y == pytest.approx(whole.at("v(out)", curve.x), abs=1e-12)
    assert set(T) <= set(curve.x.tolist())


def test_a_jump_stays_a_jump():
    step = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 1.0, 1.0, 2.0], [0.0, 0.0, 5.0, 5.0]]))
    curve = panels(step, ["v(a)"])[0].curves[0]
    at = np.flatnonzero(curve.x == 1.0)
    assert curve.y[at].tolist() == [0.0, 5.0]
    assert set(curve.y.tolist()) == {0.0, 5.0}


def test_a_window_begins_and_ends_where_it_is_asked_to():
    curve = drawn("v(out)", start=0.5, stop=2.5)[0].curves[0]
    assert (curve.x[0], curve.x[-1]) == (0.5, 2.5)
    assert curve.y[0] == pytest.approx(table().at("v(out)", 0.5))
    assert drawn("v(out)", start=-5, stop=99)[0].curves[0].x[[0, -1]].tolist() == [0.0, 3.0]


@pytest.mark.parametrize(("start", "stop"), [(4.0, None), (2.0, 1.0), (None, 0.0)])
def test_an_empty_window_is_refused(start, stop):
    with pytest.raises(DeckError, match=r"time goes from 0 s to 3 s"):
        drawn("v(out)", start=start, stop=stop)


@pytest.mark.parametrize("expression", ["v(in)/0", "v(out) 1e308*(1+v(in))*1e10"])
def test_what_is_nowhere_a_number_is_refused(expression):
    """An axis without limits ended in an internal error."""
    with pytest.raises(DeckError, match="nowhere a finite number"):
        drawn(expression)


def test_a_single_point_is_no_course():
    point = Table("op", ["v(out)"], ["V"], Columns([[5.0]]), axis=False)
    with pytest.raises(DeckError, match="E349"):
        panels(point, ["v(out)"])


def test_a_sweep_that_turns_back_is_drawn_as_it_is():
    sweep = Table(
        "dc", ["v-sweep", "v(out)"], ["V", "V"], Columns([[0.0, 1.0, 0.0], [0.0, 2.0, 1.0]]), axis=False
    )
    (panel,) = panels(sweep, ["v(out)"])
    assert panel.x == "v-sweep" and panel.curves[0].x.tolist() == [0, 1, 0]
    with pytest.raises(DeckError, match="turns back"):
        panels(sweep, ["v(out)"], start=0.5)


def test_thinning_keeps_the_extremes_of_every_column():
    rng = np.random.default_rng(1)
    x = np.sort(rng.random(200_000) ** 3)  # dense at one end
    y = rng.standard_normal(len(x))
    y[123_456], y[777] = 50.0, -50.0
    tx, ty = thinned(x, y, 300)
    assert len(tx) <= 4 * 300 and np.all(np.diff(tx) >= 0)
    column, kept = (np.minimum((v - x[0]) / (x[-1] - x[0]) * 300, 299).astype(int) for v in (x, tx))
    for k in np.unique(column):
        assert ty[kept == k].max() >= y[column == k][1:-1].max(initial=-99)
        assert ty[kept == k].min() <= y[column == k][1:-1].min(initial=99)
    assert {50.0, -50.0} <= set(ty.tolist())


def test_what_is_short_or_turns_back_is_not_thinned():
    x = np.linspace(0, 1, 100)
    assert thinned(x, x, 50)[0] is x
    turning = np.sin(np.linspace(0, 9, 10_000))
    assert thinned(turning, turning, 50)[0] is turning


@pytest.mark.parametrize(
    ("unit", "largest", "expected"),
    [
        ("A", 0.02, (1e3, "mA")), ("V", 1.0, (1.0, "V")), ("V", 999.0, (1.0, "V")), ("V", 1000.0, (1e-3, "kV")),
        ("V", 1e-3, (1e3, "mV")), ("s", 5e3, (1.0, "s")), ("s", 2e-9, (1e9, "ns")), ("rad", 1e-4, (1.0, "rad")),
        ("deg/s", 1e4, (1.0, "deg/s")), ("", 1e9, (1.0, "")), ("V", 0.0, (1.0, "V")), ("N m", 0.2, (1e3, "mN m")),
    ],
)  # fmt: skip
def test_prefixes(unit, largest, expected):
    factor, name = prefixed(unit, largest)
    assert (pytest.approx(factor), name) == expected


def test_what_is_drawn_where_nobody_says():
    printed = Result("", [table()], prints=[("tran", ["v(in)"]), ("op", ["i(v1)"])])
    assert shown(printed, printed.main) == ["v(in)"]
    # what moves, the machine first
    assert shown(Result("", [table()]), table()) == ["angle(hinge)", "v(out)", "i(v1)"]
