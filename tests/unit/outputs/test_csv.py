"""CSV: names, units on request, exact numbers."""

from __future__ import annotations

import csv

from emsim.outputs.csv import lines, write
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table


def example():
    names, units = ["time", "v(out)", "x(pole(0.6,0))"], ["s", "V", "m"]
    return Table("tran", names, units, Columns([[0.0, 0.1], [1 / 3, 1e-300], [2.0, -3.0]]))


def test_names_with_a_comma_survive_a_csv_reader():
    rows = list(csv.reader(lines(example(), units=True)))
    assert rows[0] == ["time", "v(out)", "x(pole(0.6,0))"] and rows[1] == ["s", "V", "m"]


def test_numbers_are_the_same_doubles(tmp_path):
    path = str(tmp_path / "a.csv")
    write(path, Result("", [example()]))
    with open(path, newline="") as file:
        rows = [[float(word) for word in row] for row in list(csv.reader(file))[1:]]
    assert rows == [[0.0, 1 / 3, 2.0], [0.1, 1e-300, -3.0]]
