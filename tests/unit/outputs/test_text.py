"""Print tables: ngspice's columns, the TSTEP grid."""

from __future__ import annotations

from emsim.outputs.text import lines, table_lines
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table


def ramp(**more):
    return Table("tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 0.3, 1.0], [0.0, 0.6, 2.0]]), **more)


def rows(text):
    return [[float(word) for word in line.split()] for line in text if line[:1].isdigit()]


def test_rows_stand_on_the_grid():
    text = list(table_lines(ramp(grid=(0.25, 0.0, 1.0)), ["v(a)"]))
    assert rows(text) == [[0, 0, 0], [1, 0.25, 0.5], [2, 0.5, 1], [3, 0.75, 1.5], [4, 1, 2]]
    assert text[3].split() == ["Index", "time", "v(a)"]


def test_a_grid_beyond_the_run_ends_with_it():
    assert [row[1] for row in rows(table_lines(ramp(grid=(0.4, 0.2, 9.0)), ["v(a)"]))] == [0.2, 0.6, 1.0]


def test_without_a_grid_every_point_is_shown():
    assert [row[1] for row in rows(table_lines(ramp(), ["v(a)"]))] == [0, 0.3, 1]


def test_columns_are_aligned():
    t = Table(
        "tran", ["time", "v(a)", "i(b)"], ["s", "V", "A"], Columns([[0.0, 1.0], [-1.0, 1.0], [3.0, -3.0]])
    )
    head, _, first, second = list(table_lines(t, ["v(a)", "i(b)"]))[3:7]
    for name in ("v(a)", "i(b)"):
        at = head.index(name)
        assert first[at - 1] == second[at - 1] == " " and first[at] != " " and second[at] != " "


def test_an_operating_point_is_a_list():
    op = Table("op", ["v(a)", "i(v1)"], ["V", "A"], Columns([[1.5], [-2e-3]]), axis=False)
    result = Result("", [op, ramp()], prints=[("op", ["i(v1)"]), ("tran", ["v(a)"]), ("ac", ["v(a)"])])
    text = list(lines(result))
    assert text[0] == "i(v1) = -2.000000e-03 A" and "v(a)" in text[4]


def test_of_an_unfinished_run_the_last_rows():
    cut = Result("t", [ramp(grid=(0.25, 0.0, 9.0), status="interrupted")], prints=[("tran", ["v(a)"])])
    text = list(lines(cut, unfinished=2))
    assert rows(text) == [[3, 0.75, 1.5], [4, 1, 2]] and "... 3 rows before these" in text
    assert len(rows(lines(cut))) == 5
    whole = Result("t", [ramp(grid=(0.25, 0.0, 1.0))], prints=[("tran", ["v(a)"])])
    assert len(rows(lines(whole, unfinished=2))) == 5
