"""A tight run of ngspice whose steps come to nothing is ended when that is seen, not when patience is at its end."""

from __future__ import annotations

import stat
import sys
import time

import pytest

from emsim.interop import ngspice

PROGRAM = """#!{python}
import struct, sys, time
path = sys.argv[sys.argv.index("-r") + 1]
with open(path, "wb") as file:
    file.write(b"Title: t\\nDate: x\\nPlotname: Transient Analysis\\nFlags: real\\nNo. Variables: 2\\nNo. Points: {rows}\\n"
               b"Variables:\\n\\t0\\ttime\\ttime\\n\\t1\\tv(a)\\tvoltage\\nBinary:\\n")
    for k in range({rows}):
        file.write(struct.pack("<dd", {time}, 1.0))
        file.flush()
        time.sleep(0.02)
"""
DECK = "t\nV1 a 0 1\nR1 a 0 1\n.tran 1u 1m\n.end\n"


@pytest.fixture
def program(tmp_path, monkeypatch):
    def write(rows: int, time: str) -> None:
        path = tmp_path / "ngspice"
        path.write_text(PROGRAM.format(python=sys.executable, rows=rows, time=time), encoding="utf-8")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        monkeypatch.setattr(ngspice, "find", lambda: str(path))
        monkeypatch.setattr(ngspice, "STILL", 0.5)

    return write


def test_a_run_that_stands_still_is_ended_at_once(program):
    program(100_000, "5e-14 + 1e-20*k")
    begun = time.monotonic()
    with pytest.raises(ngspice.NgspiceError, match="stands still at t = 5"):
        ngspice.run(DECK, 300.0, 1e-3)
    assert time.monotonic() - begun < 60.0


def test_a_run_that_gets_on_is_left_alone(program):
    program(100, "1e-5*k")
    ngspice.run(DECK, 300.0, 1e-3)


def test_a_run_that_takes_too_long_is_ended_as_before(program):
    program(100_000, "1e-7*k")
    with pytest.raises(ngspice.NgspiceError, match="not done after 1 s"):
        ngspice.run(DECK, 1.0)
