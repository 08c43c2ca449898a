"""What emsim starts ends with emsim, however that ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import start
from support import needs_ngspice

import emsim
from emsim.interop import ngspice

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals, and a shell as ngspice")
RC = "t\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m\n.end\n"
# computes for ever
NGSPICE = "#!/bin/sh\necho $$ > {}\nexec sleep 600\n"


def until(holds, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.01)


def runs(pid: int) -> bool:
    """A process that has ended and is still listed does not run. It may go between two looks."""
    try:
        os.kill(pid, 0)
        if not os.path.isdir("/proc/self"):  # a system that lists no processes as files
            return True
        state = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return state.rpartition(")")[2].split()[0] != "Z"


@pytest.fixture
def slow(scratch, monkeypatch):
    """An ngspice that never ends; the file with its number."""
    (scratch / "bin").mkdir()
    program, mark = scratch / "bin" / "ngspice", scratch / "pid"
    program.write_text(NGSPICE.format(mark))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    (scratch / "deck.cir").write_text(RC)
    return mark


def number(mark: Path) -> int:
    until(lambda: mark.exists() and mark.read_text().endswith("\n"))
    return int(mark.read_text())


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_ngspice_ends_with_a_comparison_that_is_killed(slow, how):
    """It went on for ever."""
    run = start("compare", "deck.cir")
    pid = number(slow)
    run.send_signal(how)
    run.communicate(timeout=60)
    until(lambda: not runs(pid))


def test_and_where_its_time_is_over(slow):
    with pytest.raises(ngspice.NgspiceError, match=r"not done after 0\.5 s"):
        ngspice.run(RC, 0.5)
    assert not runs(number(slow))


@needs_ngspice
@pytest.mark.ngspice
def test_what_it_says_and_how_it_ends_come_through(scratch):
    assert len(ngspice.run(RC).plots[0]) > 100
    with pytest.raises(ngspice.NgspiceError):
        ngspice.run(RC.replace("R1 a b 1k", "X1 a b nobody"))


def dies(task, points):
    os.kill(os.getpid(), signal.SIGKILL)


def waits(task, points):
    (Path(os.environ["EMSIM_TEST_MARKS"]) / f"{os.getpid()}").write_text("")
    time.sleep(600)


DIVIDER = ".param r=1k\nV1 a 0 1\nR1 a b {r}\nR2 b 0 1k\n.op\n.meas op v FIND v(b)\n.end\n"


def test_a_worker_that_was_killed_is_told_as_that(scratch, monkeypatch):
    """It was "a bug in emsim"."""
    from emsim.diagnostics import OutsideError
    from emsim.sweeps import pool

    monkeypatch.setattr(pool, "work", dies)
    with pytest.raises(OutsideError) as caught:
        emsim.sweep("t\n" + DIVIDER, {"r": [1e3, 2e3, 3e3]}, jobs=2)
    (found,) = caught.value.diagnostics
    assert found.code == "E523" and "worker" in found.message and "again" in found.hint


def test_what_a_worker_itself_finds_wrong_is_no_lost_worker():
    from emsim.sweeps.pool import told_lost

    for error in (OSError("no such file"), ValueError("no"), KeyboardInterrupt()):
        with pytest.raises(type(error)), told_lost("here", ""):
            raise error


SWEEP = """import sys; sys.path.insert(0, {here!r})
import emsim, test_nothing_runs_on as own
from emsim.sweeps import pool
pool.work = own.waits
emsim.sweep("t\\n" + own.DIVIDER, {{"r": [1e3, 2e3, 3e3]}}, jobs=2)
"""


def test_workers_end_with_a_sweep_that_is_killed(scratch, monkeypatch):
    monkeypatch.setenv("EMSIM_TEST_MARKS", str(scratch))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parent.parent))
    run = subprocess.Popen([sys.executable, "-c", SWEEP.format(here=str(Path(__file__).resolve().parent))])
    until(lambda: len(list(scratch.iterdir())) == 2)
    workers = [int(mark.name) for mark in scratch.iterdir()]
    run.kill()
    run.wait()
    until(lambda: not any(map(runs, workers)))
