"""Raw files: our own reader, ngspice's load, spicelib and ltspice all see the same numbers."""

from __future__ import annotations

import subprocess

import numpy as np
import pytest
from support import needs_ngspice

from emsim.outputs import raw
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

N = 200


def example():
    """Values that need all their digits, tiny and huge ones, and mechanical names."""
    t = np.linspace(0, 1e-3, N)
    columns = [t, np.sin(1e4 * t) / 3, 1e-15 * np.cos(t), 1e300 * t, -(t**2)]
    names = ["time", "v(out)", "i(v1)", "angle(hinge)", "torque(m1)"]
    tran = Table(
        "tran", names, ["s", "V", "A", "rad", "N m"], Columns(c.tolist() for c in columns), title="raw test"
    )
    op = Table(
        "op", ["v(out)", "i(v1)"], ["V", "A"], Columns([[1 / 3], [-0.1]]), axis=False, title="raw test"
    )
    return Result("raw test", [op, tran])


@pytest.fixture(params=[False, True], ids=["binary", "ascii"])
def written(request, tmp_path):
    path = str(tmp_path / "x.raw")
    raw.write(path, example(), ascii=request.param)
    return path


def test_round_trip_is_exact(written):
    result, want = raw.read(written), example()
    assert [p.kind for p in result.plots] == ["op", "tran"] and result.title == "raw test"
    for got, table in zip(result.plots, want.plots, strict=True):
        assert got.names == table.names and got.units == table.units and got.axis == table.axis
        for name in table.names:
            assert got[name].tolist() == table[name].tolist()


def test_header_is_ngspices_and_names_the_dialect(written):
    with open(written, "rb") as file:
        head = file.read(400).decode("latin1").splitlines()
    assert (
        head[0] == "Title: raw test" and head[2] == "Plotname: Operating Point" and head[3] == "Flags: real"
    )
    assert head[6].startswith("Command: * emsim ") and "ngspice" in head[6]


@needs_ngspice
@pytest.mark.ngspice
def test_ngspice_loads_it(written, tmp_path):
    probe = "print length(v(out)) v(out)[100] angle(hinge)[100]\n"
    (tmp_path / "load.cir").write_text(
        f"* load\n.control\nload {written}\nset numdgt=12\n{probe}quit 0\n.endc\n.end\n"
    )
    done = subprocess.run(
        ["ngspice", "-b", "load.cir"], cwd=tmp_path, capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    values = [float(line.split("=")[1]) for line in done.stdout.splitlines() if " = " in line]
    table = example().main
    assert values == pytest.approx([N, table["v(out)"][100], table["angle(hinge)"][100]], rel=1e-9), (
        done.stdout
    )
    # it runs what stands behind `Command:`
    assert "no such command" not in done.stdout + done.stderr


def test_spicelib_reads_it(written):
    spicelib = pytest.importorskip("spicelib")
    table = example().main
    # spicelib reads the last or the first plot of a file by its version: give it one plot
    raw.write(written, Result("raw test", [table]), ascii=b"Values:" in open(written, "rb").read())  # noqa: SIM115
    file = spicelib.RawRead(written, verbose=False)
    assert [name.lower() for name in file.get_trace_names()] == table.names
    np.testing.assert_allclose(file.get_trace("v(out)").get_wave(), table["v(out)"], rtol=1e-15)
    np.testing.assert_allclose(np.asarray(file.get_axis()), table.time, rtol=1e-15)


def test_ltspice_reads_the_binary_form(tmp_path):
    ltspice = pytest.importorskip("ltspice")
    table, path = example().main, str(tmp_path / "one.raw")
    raw.write(path, Result("raw test", [table]))
    file = ltspice.Ltspice(path)
    file.parse()
    np.testing.assert_allclose(file.get_data("v(out)"), table["v(out)"], rtol=1e-12, atol=1e-300)


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("filetype", ["binary", "ascii"])
def test_reads_what_ngspice_writes(tmp_path, filetype):
    deck = (
        "rc\nV1 in 0 DC 1 AC 1 PULSE(0 1 0 1n 1n 1u 2u)\nR1 in out 1k\nC1 out 0 1n\n.end\n"
        f".control\nset filetype={filetype}\nset appendwrite\nop\nwrite x.raw\nac dec 2 1 100\nwrite x.raw\n"
        "tran 0.1u 4u\nwrite x.raw\nquit 0\n.endc\n"
    )
    (tmp_path / "d.cir").write_text(deck)
    subprocess.run(["ngspice", "-b", "d.cir"], cwd=tmp_path, capture_output=True, stdin=subprocess.DEVNULL)
    result = raw.read(str(tmp_path / "x.raw"))
    assert [p.kind for p in result.plots] == ["op", "ac", "tran"]
    small = result.table("ac")
    assert small.axis.log and not small.is_complex("frequency") and small.is_complex("v(out)")
    answer = 1 / (1 + 2j * np.pi * small["frequency"] * 1e-6)
    np.testing.assert_allclose(small["v(out)"], answer, rtol=1e-12)
    assert result.time[-1] == pytest.approx(4e-6) and result.unit("v(out)") == "V"
    assert result.at("v(out)", 1e-6) == pytest.approx(1 - np.exp(-1), abs=2e-3)


@pytest.mark.parametrize("flags", ["real forward", "real forward double", "real forward fastaccess"])
@pytest.mark.parametrize("encoding", ["utf-16-le", "ascii"])
def test_reads_what_ltspice_writes(tmp_path, flags, encoding):
    """By the layout that the manuals of ltspice and spicelib describe: time as float64, the rest as float32 unless told, one
    record a point unless `fastaccess`, the sign of a time set where compression made the point; a complex plot before it."""
    variables = ["time\ttime", "V(out)\tvoltage", "I(R1)\tdevice_current"]
    t = np.linspace(0, 1e-3, 7)
    columns = [np.where(np.arange(7) % 3 == 2, -t, t), np.sin(3e3 * t), 1e-6 * t]
    narrow = "double" not in flags
    fields = [(f"x{k}", "<f4" if narrow and k else "<f8") for k in range(3)]
    records = np.zeros(7, dtype=fields)
    for k, column in enumerate(columns):
        records[f"x{k}"] = column
    body = records.tobytes()
    if "fastaccess" in flags:
        body = b"".join(records[f"x{k}"].tobytes() for k in range(3))

    def plot(name: str, flags: str, body: bytes) -> bytes:
        listed = "".join(f"\t{k}\t{v}\n" for k, v in enumerate(variables))
        head = (
            f"Title: * C:\\rc.asc\nDate: Mon Nov 23 10:00:00 2026\nPlotname: {name}\nFlags: {flags}\nNo. Variables: 3\n"
            "No. Points:            7\nOffset:   0.0000000000000000e+000\n"
            f"Command: Linear Technology Corporation LTspice XVII\nVariables:\n{listed}Binary:\n"
        )
        return head.encode(encoding) + body

    path = tmp_path / "x.raw"
    path.write_bytes(
        plot("AC Analysis", "complex forward", bytes(7 * 48)) + plot("Transient Analysis", flags, body)
    )
    result = raw.read(str(path))
    assert [p.kind for p in result.plots] == ["ac", "tran"] and result.names == ["time", "v(out)", "i(r1)"]
    assert np.array_equal(result.time, t) and result.unit("i(r1)") == "A"
    for name, exact in zip(result.names[1:], columns[1:], strict=True):
        np.testing.assert_allclose(result[name], exact, rtol=6e-8 if narrow else 0)


HEAD = b"Title: x\nFlags: real\nNo. Variables: %d\nNo. Points: %d\nVariables:\n\t0\ttime\ttime\n"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"\x00\x01\x02 junk", "not a raw file"),
        (b"Title: x\nDate: y\n", "ends within a header"),
        (b"Title: x\nPlotname: y\nBinary:\n", "lacks its counts"),
        (HEAD % (1, 3) + b"Binary:\n" + bytes(17), "2 of 3"),
        (HEAD % (1, 2) + b"Values:\n0\t1\n", "1 of 2"),
        (HEAD % (1, 1) + b"Values:\n0\tpig\n", "is not a point"),
        (HEAD % (2, 1) + b"Values:\n0\t1\n", "2 variables announced"),
    ],
)
def test_broken_files_say_what_is_wrong(tmp_path, content, says):
    path = tmp_path / "broken.raw"
    path.write_bytes(content)
    with pytest.raises(raw.RawFileError, match=says):
        raw.read(str(path))


def test_an_empty_file_has_no_plots(tmp_path):
    (tmp_path / "empty.raw").write_bytes(b"")
    assert raw.read(str(tmp_path / "empty.raw")).plots == []


def test_a_title_with_line_breaks_stays_on_its_line(tmp_path):
    table = Table("op", ["v(a)"], ["V"], Columns([[1.0]]), axis=False, title="two\nlines")
    raw.write(str(tmp_path / "x.raw"), Result("two\nlines", [table]))
    assert raw.read(str(tmp_path / "x.raw")).title == "two lines"


def test_nothing_to_write(tmp_path):
    with pytest.raises(ValueError, match="no analysis ran"):
        raw.write(str(tmp_path / "x.raw"), Result("", []))
