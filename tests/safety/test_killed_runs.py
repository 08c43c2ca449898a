"""Runs that are killed or ended, and disks that are full: what was computed is in a file that all readers take, and the file of
the run before is there until a whole one takes its place."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest
from commands import LONG, command, finish, holds, start, wait_for
from support import needs_ngspice

import emsim
from emsim.outputs import raw
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of Unix")
RC = "rc\nV1 in 0 SIN(0 1 1k)\nR1 in out 1k\nC1 out 0 1u\n.op\n.tran 10u 5m\n.end\n"


def limited(size: int):
    def limit() -> None:
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


def whole(time: np.ndarray) -> None:
    """Rows up to the last one, none of them empty."""
    assert len(time) > 1000 and np.all(np.diff(time) >= 0) and time[-1] > 0


@posix
def test_a_killed_run_leaves_its_rows_and_the_file_before(scratch):
    (scratch / "long.cir").write_text(LONG)
    (scratch / "long.raw").write_text("what the last run gave")
    run = start("long.cir", "-q")
    wait_for(holds(scratch / "long.partial.raw", 1_000_000))
    run.kill()
    assert run.wait() == -signal.SIGKILL
    assert (scratch / "long.raw").read_text() == "what the last run gave"
    found = raw.read("long.partial.raw")
    assert [t.kind for t in found.plots] == ["op", "tran"]
    whole(found.time)
    assert found.at("v(in)", float(found.time[-1])) == pytest.approx(
        5 * np.sin(2e3 * np.pi * found.time[-1]), abs=1e-2
    )


@posix
@needs_ngspice
@pytest.mark.ngspice
def test_other_programs_read_what_a_killed_run_leaves(scratch):
    spicelib, ltspice = pytest.importorskip("spicelib"), pytest.importorskip("ltspice")
    (scratch / "long.cir").write_text(LONG.replace(".op\n", ""))
    # the header is patched after the rows: a kill may fall between the two, and ltspice reads no such file
    for _ in range(5):
        run = start("long.cir", "-q")
        wait_for(holds(scratch / "long.partial.raw", 1_000_000))
        run.kill()
        run.wait()
        time = raw.read("long.partial.raw").time
        whole(time)
        if counted(scratch / "long.partial.raw"):
            break
        (scratch / "long.partial.raw").unlink()
    by_spicelib = spicelib.RawRead("long.partial.raw", verbose=False)
    begins(time, np.asarray(by_spicelib.get_trace("time").get_wave()))
    by_ltspice = ltspice.Ltspice("long.partial.raw")
    by_ltspice.parse()
    begins(time, by_ltspice.get_time())
    (scratch / "load.cir").write_text(
        "* load\n.control\nload long.partial.raw\nset numdgt=12\nprint length(time)\nquit 0\n.endc\n.end\n"
    )
    done = subprocess.run(
        ["ngspice", "-b", "load.cir"], capture_output=True, text=True, stdin=subprocess.DEVNULL, timeout=60
    )
    counts = [float(line.split("=")[1]) for line in done.stdout.splitlines() if line.startswith("length")]
    assert len(counts) == 1 and len(time) // 2 <= counts[0] <= len(time)


def counted(path):
    """Are there as many rows as the header says?"""
    head, _, rows = path.read_bytes().partition(b"Binary:\n")
    points, variables = (
        int(re.search(rb"No\. " + word + rb": *(\d+)", head)[1]) for word in (b"Points", b"Variables")
    )
    return len(rows) == 8 * points * variables


def begins(time, theirs):
    assert len(time) // 2 <= len(theirs) and np.array_equal(theirs, time[: len(theirs)])


@posix
@pytest.mark.parametrize(("name", "code"), [("SIGTERM", 143), ("SIGHUP", 129), ("SIGINT", 130)])
def test_a_run_that_is_ended_keeps_its_rows(scratch, name, code):
    (scratch / "long.cir").write_text(LONG)
    run = start("long.cir", "--csv", "long.csv", "-q")
    wait_for(holds(scratch / "long.partial.raw", 300_000))
    run.send_signal(getattr(signal, name))
    _, said = run.communicate(timeout=60)
    assert run.returncode == code and "Traceback" not in said
    found = raw.read("long.raw")
    assert [t.kind for t in found.plots] == ["op", "tran"]
    whole(found.time)
    with open("long.csv", encoding="utf-8") as file:
        assert sum(1 for _ in file) == 1 + len(found.time)
    assert not [p for p in os.listdir() if "partial" in p or p.startswith(".")]


@posix
def test_nohup_is_heeded(scratch):
    (scratch / "long.cir").write_text(LONG)
    run = start("long.cir", "-q", preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    wait_for(holds(scratch / "long.partial.raw", 300_000))
    run.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        run.wait(0.5)
    run.kill()
    run.wait()


@posix
def test_a_full_disk_leaves_the_file_before_and_the_rows_that_fitted(scratch):
    (scratch / "long.cir").write_text(LONG.replace("1u 20 0 1u", "1u 0.4 0 1u"))
    (scratch / "long.raw").write_text("what the last run gave")
    done = finish("long.cir", "-q", preexec_fn=limited(2_000_000))
    assert done.returncode == 5 and "E503" in done.stderr and "Traceback" not in done.stderr
    assert (scratch / "long.raw").read_text() == "what the last run gave"
    left = raw.read("long.partial.raw")
    whole(left.time)
    assert f"long.partial.raw holds the first {len(left)} of" in done.stderr
    assert (scratch / "long.partial.raw").stat().st_size > 1_900_000


@posix
@pytest.mark.parametrize("option", ["-o", "--csv", "--html"])
def test_a_file_that_does_not_fit_is_no_file(scratch, option):
    (scratch / "rc.cir").write_text(RC)
    (scratch / "out.x").write_text("before")
    more = [] if option == "-o" else ["--no-files"]
    done = finish("rc.cir", "-q", option, "out.x", *more, preexec_fn=limited(8_000))
    assert done.returncode == 5 and "E503" in done.stderr
    assert sorted(os.listdir()) == ["out.x", "rc.cir"] and (scratch / "out.x").read_text() == "before"


@posix
def test_fmt_on_a_full_disk_leaves_the_deck(scratch):
    text = RC.replace("V1 in", "V1    in") + "* a comment\n" * 2000
    (scratch / "rc.cir").write_text(text)
    done = finish("fmt", "rc.cir", preexec_fn=limited(1000))
    assert done.returncode == 5 and (scratch / "rc.cir").read_text() == text
    assert os.listdir() == ["rc.cir"]
    os.chmod("rc.cir", 0o640)
    os.symlink("rc.cir", "link.cir")
    assert finish("fmt", "link.cir").returncode == 0
    assert os.path.islink("link.cir") and os.stat("rc.cir").st_mode & 0o777 == 0o640
    assert (scratch / "rc.cir").read_text() != text


def test_a_streamed_file_is_the_one_that_is_written_at_once(scratch):
    """Two transients of which the first is long enough to be streamed, with a machine's columns for the page beside it."""
    deck = (
        "rod on a pin, twice\n.gravity 9.81\nBODY arm shape=rod(0.3) m=0.2\nJOINT hinge 0 arm pin ic=30deg\n"
        ".op\n.tran 10u 3 0 10u\n.tran 1m 10m\n.end\n"
    )
    (scratch / "arm.cir").write_text(deck)
    assert finish("arm.cir", "-q", "--html", "arm.html").returncode == 0
    got, want = raw.read("arm.raw"), emsim.run("arm.cir")
    assert [t.kind for t in got.plots] == ["op", "tran", "tran"]
    for a, b in zip(got.plots, want.plots, strict=True):
        assert a.names == b.names and len(a) == len(b)
        for name in a.names:
            assert np.array_equal(a[name], b[name])


def test_rows_that_nobody_counted_any_more_are_read(scratch):
    """Killed between writing rows and their number."""
    table = Table(
        "tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 1.0, 2.0], [5.0, 6.0, 7.0]]), title="t"
    )
    raw.write("x.raw", Result("t", [table]))
    data = (scratch / "x.raw").read_bytes()
    head, body = data[:-48], data[-48:]
    (scratch / "x.raw").write_bytes(head.replace(b"Points: 3", b"Points: 1") + body[:-3])
    assert raw.read("x.raw")["v(a)"].tolist() == [5.0, 6.0]


def test_a_raw_file_is_read_where_it_lies(scratch):
    """Columns of which nobody asks are not read; a file that was cut since is an error, not a crash of the process."""
    rows = 500_000
    with open("big.raw", "wb") as file:
        names = "".join(f"\t{k}\tv({k})\tvoltage\n" for k in range(1, 100))
        file.write(
            f"Title: t\nDate: x\nPlotname: Transient Analysis\nFlags: real\nNo. Variables: 100\nNo. Points: {rows}\n"
            f"Variables:\n\t0\ttime\ttime\n{names}Binary:\n".encode()
        )
        file.truncate(file.tell() + 800 * rows)  # a hole: nothing of it is on the disk
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_DATA, (300 << 20,) * 2)\n"
        "from emsim.outputs import raw\n"
        "r = raw.read('big.raw'); assert len(r.main) == 500_000 and not r['v(7)'].any()\n"
        "open('big.raw', 'rb+').truncate(10_000_000)\n"
        "try: r['v(8)']\n"
        "except OSError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "has become shorter" in done.stdout, done.stderr


@posix
def test_a_folder_that_takes_no_file_is_known_before_the_run(scratch):
    (scratch / "long.cir").write_text(LONG)
    (scratch / "closed").mkdir(mode=0o555)
    words = command("long.cir", "-o", "closed/long.raw")
    if os.getuid() == 0:  # who may do anything finds no closed folder
        if shutil.which("setpriv") is None:
            pytest.skip("needs setpriv")
        words = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search", *words]
    done = subprocess.run(words, capture_output=True, text=True, timeout=20)
    assert done.returncode == 5 and "no file can be made in the folder" in done.stderr


@posix
def test_what_is_no_file_is_written_to_as_it_is(scratch):
    (scratch / "rc.cir").write_text(RC)
    assert finish("rc.cir", "-q", "-o", "/dev/null", "--csv", "/dev/null").returncode == 0
    os.mkfifo("pipe")
    reader = subprocess.Popen(["cat", "pipe"], stdout=subprocess.PIPE)
    assert finish("rc.cir", "-q", "--no-files", "--csv", "pipe").returncode == 0
    out, _ = reader.communicate(timeout=10)
    assert out.startswith(b"time,v(in)")


@posix
@pytest.mark.parametrize("rows", ["1p 80u", "1n 80u 0 1n"], ids=["on the grid", "step by step"])
def test_a_limit_of_memory_is_a_message(scratch, rows):
    """80 million rows that are asked for; rows that the steps make one by one."""
    deck = LONG.replace("1u 20 0 1u", rows if "1p" in rows else "1m 2 0 100n")
    (scratch / "many.cir").write_text(deck)
    shell = "ulimit -v 200000; exec " + " ".join(command("many.cir"))
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, timeout=120)
    assert done.returncode == 5 and "E509" in done.stderr, done.stderr
    assert "many.cir:" in done.stderr and "Traceback" not in done.stderr
    if "1p" not in rows:
        whole(raw.read("many.raw").time)
