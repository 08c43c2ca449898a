"""Raw, CSV, Parquet, NetCDF: every road between two of them keeps names, units and the bits of every number."""

from __future__ import annotations

import itertools
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emsim.cli import main
from emsim.diagnostics import OutsideError
from emsim.outputs import READERS, load, save
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

EXTENSIONS = list(READERS)
NAMES = ["time", "v(out)", "v(/top/in)", "x(pole(0.6,0))", "omega(hinge)", 'i("odd")', "energy()"]
UNITS = ["s", "V", "V", "m", "rad/s", "A", "J"]


def example() -> Result:
    numbers = np.random.default_rng(1).standard_normal((len(NAMES), 50)) * 10.0 ** np.arange(-9, 41, 1.0)
    numbers[0] = np.sort(np.abs(numbers[0]))
    numbers[0, 7] = numbers[0, 6]  # two points at one time, as at a jump
    numbers[1, :6] = [np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324]
    return Result(
        "a title", [Table("tran", NAMES, UNITS, Columns(map(np.ndarray.tobytes, numbers)), title="a title")]
    )


def same(a: Table, b: Table) -> None:
    assert (a.names, a.units, a.kind, a.axis, a.plotname) == (b.names, b.units, b.kind, b.axis, b.plotname)
    for k in range(len(a.names)):
        assert a.waves.column(k) == b.waves.column(k), a.names[k]


@pytest.mark.parametrize("road", list(itertools.permutations(EXTENSIONS, 2)), ids="-".join)
def test_there_and_back(road, scratch):
    first, second = (f"x{extension}" for extension in road)
    result = example()
    save(result, first, **({"units": True} if first.endswith("csv") else {}))
    same(load(first).main, result.main)
    assert main(["convert", first, second, *(["--units"] if second.endswith("csv") else [])]) == 0
    assert main(["convert", second, "back.raw", "-q"]) == 0
    same(load("back.raw").main, result.main)


@pytest.mark.parametrize("extension", [".parquet", ".nc", ".raw"])
def test_the_title_stays(extension, scratch):
    save(example(), f"x{extension}")
    assert load(f"x{extension}").title == "a title"


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(width=64), min_size=1, max_size=20))
def test_any_double_stays_itself(tmp_path_factory, values):
    path = tmp_path_factory.getbasetemp() / "any"
    table = Table("op", ["v(a)"], ["V"], Columns([values]), axis=False)
    for extension in EXTENSIONS:
        file = path.with_suffix(extension)
        save(Result("", [table]), file)
        got = load(file).main.floats(0)
        assert [repr(x) for x in got] == [repr(x) for x in values]


def test_all_analyses_go_to_netcdf_and_one_to_the_others(scratch, capsys):
    (scratch / "d.cir").write_text("two analyses\nV1 a 0 SIN(0 1 1k)\nR1 a 0 1k\n.op\n.tran 10u 1m\n.end\n")
    assert main(["d.cir", "-q"]) == 0
    assert main(["convert", "d.raw", "d.nc"]) == main(["convert", "d.nc", "e.raw"]) == 0
    before, after = load("d.raw"), load("e.raw")
    assert [t.kind for t in after.plots] == ["op", "tran"]
    for a, b in zip(before.plots, after.plots, strict=True):
        same(a, b)
    capsys.readouterr()
    assert main(["convert", "d.raw", "d.csv"]) == 0
    assert "choose with --plot" in capsys.readouterr().err
    same(load("d.csv").main, before.table("tran"))
    for choice in "op", "1":
        assert main(["convert", "d.raw", "op.parquet", "--plot", choice]) == 0
        same(load("op.parquet").main, before.table("op"))
    assert main(["convert", "d.raw", "op.csv", "--plot", "ac"]) == 2
    assert main(["convert", "d.raw", "op.csv", "--plot", "3"]) == 2


def test_what_pandas_and_xarray_read(scratch):
    import pandas as pd
    import xarray as xr

    result = example()
    save(result, "x.parquet")
    save(result, "x.nc")
    frame = pd.read_parquet("x.parquet")
    assert list(frame.columns) == NAMES
    np.testing.assert_array_equal(frame["omega(hinge)"], result["omega(hinge)"])
    with xr.open_dataset("x.nc", engine="h5netcdf", decode_times=False) as data:
        assert data["omega(hinge)"].attrs["units"] == "rad/s" and data.attrs["title"] == "a title"
        np.testing.assert_array_equal(data["omega(hinge)"], result["omega(hinge)"])
        np.testing.assert_array_equal(data["time"], result.time)


def test_files_that_pandas_and_xarray_wrote(scratch):
    import pandas as pd

    frame = pd.DataFrame({"time": [0.0, 1.0], "n": [1, 2], "note": ["a", "b"], "gap": [None, 2.5]})
    frame.to_parquet("p.parquet")
    table = load("p.parquet").main
    assert table.names == ["time", "n", "gap"] and table.axis and list(table["n"]) == [1.0, 2.0]
    assert np.isnan(table["gap"][0]) and table["gap"][1] == 2.5
    result = example()
    result.to_xarray().drop_vars("v(/top/in)").to_netcdf("w.nc", engine="h5netcdf")
    again = load("w.nc").main
    assert again.unit("energy()") == "J" and again.kind == "tran" and again.names[0] == "time"
    np.testing.assert_array_equal(again["energy()"], result["energy()"])


@pytest.mark.parametrize("extension", EXTENSIONS)
def test_what_is_no_such_file(extension, scratch, capsys):
    with pytest.raises(OutsideError) as found:
        load(f"none{extension}")
    assert found.value.diagnostics[0].code == "E500"
    for junk in b"", b"no\nresult\n", b"Title: x\n", b"\x89HDF\r\n\x1a\nrest", b"PAR1":
        (scratch / f"x{extension}").write_bytes(junk)
        assert main(["convert", f"x{extension}", "y.raw" if extension == ".csv" else "y.csv"]) in (2, 5)
        said = capsys.readouterr().err
        assert f"x{extension}" in said and "internal" not in said


@pytest.mark.parametrize(
    ("text", "says"), [("a,b\n1,2\n3\n", ":3: 1 values"), ("a,b\n1,2\nx,y\n", ":3: 'x'")]
)
def test_a_broken_csv_names_its_line(text, says, scratch):
    (scratch / "x.csv").write_text(text)
    with pytest.raises(OutsideError, match=says):
        load("x.csv")


@pytest.mark.parametrize(
    "args",
    [["a.raw"], ["a.raw", "a.raw"], ["a.raw", "b.xls"], ["a.txt", "b.csv"], ["a.raw", "b.nc", "--units"],
     ["a.raw", "b.csv", "--ascii"]],
)  # fmt: skip
def test_wrong_command_lines(args, scratch):
    assert main(["convert", *args]) == 2


@pytest.mark.parametrize(("package", "extension"), [("pyarrow", ".parquet"), ("h5netcdf", ".nc")])
def test_a_missing_library_is_named(package, extension, scratch, monkeypatch, capsys):
    save(example(), "x.raw")
    monkeypatch.setitem(sys.modules, package, None)
    assert main(["convert", "x.raw", f"x{extension}"]) == 5
    said = capsys.readouterr().err
    assert package in said and "emsim[files]" in said
