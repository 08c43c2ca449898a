"""Names, units, plots, conversions of a Result."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

T = [0.0, 1.0, 2.0, 3.0]


def table(kind="tran", **more):
    return Table(
        kind,
        ["time", "v(out)", "i(v1)", "angle(hinge)"],
        ["s", "V", "A", "rad"],
        Columns([T, [0.0, 1.0, 4.0, 9.0], [-1.0, -2.0, -3.0, -4.0], [0.1] * 4]),
        title="four points",
        **more,
    )


def point():
    return Table(
        "op", ["v(out)", "i(v1)"], ["V", "A"], Columns([[5.0], [-0.001]]), axis=False, title="four points"
    )


@pytest.fixture
def result():
    return Result("four points", [point(), table()])


@pytest.mark.parametrize("name", ["v(out)", "V(OUT)", " v( out ) ", "out", "OUT"])
def test_spellings_of_a_voltage(result, name):
    assert result[name].tolist() == [0, 1, 4, 9]


def test_spellings_of_a_current(result):
    assert result["v1#branch"].tolist() == result["I(V1)"].tolist() == [-1, -2, -3, -4]


def test_difference_of_two_nodes():
    t = Table("tran", ["time", "v(a)", "v(b)"], ["s", "V", "V"], Columns([T, [5.0] * 4, T]))
    assert t["v(a,b)"].tolist() == [5, 4, 3, 2]
    assert t.at("v(a,b)", 1.5) == t.at("v(a,b)", [1.5])[0] == 3.5 and t.unit("v(a, b)") == "V"
    assert "v(a,b)" in t and "V(b, a)" in t and "v(a,c)" not in t and t["v(a, 0)"].tolist() == t["a"].tolist()
    with pytest.raises(KeyError, match=r"v\(c\)"):
        t["v(a,c)"]


@pytest.mark.parametrize("key", [0, slice(1, 2), None])
def test_columns_are_asked_for_by_name(result, key):
    with pytest.raises(TypeError, match="columns have names"):
        result[key]


def test_unknown_name_suggests_the_nearest(result):
    with pytest.raises(KeyError, match=r"v\(oit\).*did you mean 'v\(out\)'"):
        result["v(oit)"]


def test_the_transient_is_the_main_table_whatever_the_order():
    assert Result("", [table(), point()]).analysis == "tran"
    assert Result("", [point()]).analysis == "op"
    assert Result("", [point(), table()]).table("op")["v(out)"].tolist() == [5]


def test_nothing_ran():
    empty = Result("silence", [])
    assert "v(out)" not in empty and "nothing ran" in repr(empty)
    with pytest.raises(ValueError, match="no analysis ran"):
        empty.main  # noqa: B018


def test_units_names_signals(result):
    assert result.units["angle(hinge)"] == "rad" and result.unit("out") == "V"
    assert result.names[0] == "time" and result.signals == ["v(out)", "i(v1)", "angle(hinge)"]
    assert list(result) == result.names and len(result) == 4


def test_columns_are_read_only(result):
    with pytest.raises(ValueError):
        result["v(out)"][0] = 1


def test_at_follows_a_parabola(result):
    assert result.at("v(out)", 1.5) == pytest.approx(2.25)
    assert result.at("v(out)", [1.25, 2.0]).tolist() == pytest.approx([1.5625, 4.0])


def test_at_the_end_to_rounding(result):
    assert result.at("v(out)", 3.0000000000000004) == pytest.approx(9)
    assert result.at("v(out)", [3.0000000000000004, 0.0]).tolist() == pytest.approx([9, 0])


@pytest.mark.parametrize("t", [-0.1, 3.1, [0.0, 4.0], float("nan")])
def test_at_refuses_times_outside_the_run(result, t):
    with pytest.raises(ValueError, match=r"outside 0 \.\. 3"):
        result.at("v(out)", t)


def test_an_operating_point_has_no_axis():
    with pytest.raises(ValueError):
        point().at("v(out)", 0.0)


def test_columns_must_fit_names():
    with pytest.raises(ValueError, match="2 names"):
        Table("tran", ["time", "v(a)"], ["s", "V"], Columns([T]))


def test_status_is_the_first_trouble():
    assert Result("", [point(), table(status="interrupted")]).status == "interrupted"
    assert Result("", [point(), table()]).status == "ok"


def test_to_pandas(result):
    frame = result.to_pandas()
    assert (
        frame.index.name == "time" and frame.loc[2.0, "v(out)"] == 4 and frame.attrs["units"]["i(v1)"] == "A"
    )


def test_to_xarray(result):
    data = result.to_xarray()
    assert data["v(out)"].attrs["units"] == "V" and data["time"].values.tolist() == T
    assert float(data["v(out)"].sel(time=3.0)) == 9 and data.attrs["analysis"] == "tran"
    assert result.table("op").to_xarray()["v(out)"].values.tolist() == [5]


def test_repr_is_a_small_table(result):
    lines = repr(result).splitlines()
    assert lines[0] == "four points" and "Operating Point: 1 point" in lines
    assert any(line.split() == ["v(out)", "0", "9", "9", "V"] for line in lines)


def test_repr_of_a_wide_table_is_cut():
    names = [f"v({k})" for k in range(50)]
    wide = Table("op", names, ["V"] * 50, Columns([[float(k)] for k in range(50)]), axis=False)
    assert "... and 30 more" in repr(wide) and len(repr(wide).splitlines()) == 22


def test_save_by_extension(result, scratch):
    for name in ("a.raw", "a.csv", "a.txt"):
        result.save(name)
        assert (scratch / name).stat().st_size > 50
    with pytest.raises(ValueError, match=r"\.xlsx"):
        result.save("a.xlsx")
    assert np.all(result["v(out)"] >= 0)


def test_results_and_errors_pickle():
    import pickle

    import emsim

    result = emsim.run("t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 0\n.op\n.tran 10u 1m\n.print tran v(a)\n.end\n")
    again = pickle.loads(pickle.dumps(result))
    assert (again["v(a)"] == result["v(a)"]).all() and again.status == "ok" and again.prints == result.prints
    assert [p.kind for p in again.plots] == ["op", "tran"] and again.stats == result.stats
    assert again.diagnostics[0].span.text == result.diagnostics[0].span.text and repr(again) == repr(result)
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run("t\nC1 a 0\n.end\n")
    twin = pickle.loads(pickle.dumps(caught.value))
    assert type(twin) is emsim.DeckError and str(twin) == str(caught.value)


def test_saving_into_a_missing_folder(scratch):
    import emsim

    result = emsim.run("t\nV1 a 0 1\nR1 a 0 1\n.op\n.end\n")
    for name in ("x.raw", "x.csv", "x.txt"):
        with pytest.raises(emsim.OutsideError, match="no folder"):
            result.save(scratch / "nowhere" / name)


def test_places_that_are_asked_for_one_by_one_copy_a_column_once():
    """Each `at` of a long run copied the whole column: 6 s for four thousand places."""
    r = emsim.run("t\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1\n.tran 10u 5m\n.end\n")

    class Counted:
        def __init__(self, waves):
            self.waves, self.copied = waves, 0

        def __getattr__(self, name):
            return getattr(self.waves, name)

        def column(self, k):
            self.copied += 1
            return self.waves.column(k)

    counted = Counted(r.main.waves)
    table = Table(r.main.kind, r.main.names, r.main.units, counted)
    places = [5e-5 * k for k in range(90)]
    assert [table.at("v(a)", t) for t in places] == pytest.approx(list(table.at("v(a)", places)), abs=1e-12)
    assert counted.copied <= 6
