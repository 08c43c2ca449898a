"""`emsim view --live` as a person starts and ends it. Each test runs the program itself."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import pytest

DECK = "rc\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m uic\n.end\n"
ENDLESS = "endless\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1n\n.tran 1u 1e4 9999.999 1u\n.end\n"


@pytest.fixture(autouse=True)
def deck(scratch: Path) -> Path:
    path = scratch / "rc.cir"
    path.write_text(DECK)
    return path


def emsim(*args: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "emsim", "view", *args], capture_output=True, text=True, timeout=120
    )


@pytest.fixture
def live() -> Iterator[subprocess.Popen[str]]:
    # a parent in the background may have told its children to ignore Ctrl-C
    listen = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    process = subprocess.Popen(
        [sys.executable, "-m", "emsim", "view", "--live", "--no-open", "rc.cir"],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen,
    )
    yield process
    if process.poll() is None:
        process.kill()
    process.communicate()


def address(process: subprocess.Popen[str]) -> str:
    assert process.stderr is not None
    line = process.stderr.readline()
    assert line.startswith("page: http://127.0.0.1:"), line
    return line.split()[1]


@pytest.mark.parametrize("sign", [signal.SIGINT, signal.SIGTERM])
def test_it_serves_until_it_is_told_to_end(live: subprocess.Popen[str], sign: int):
    url = urlsplit(address(live))
    assert url.hostname is not None
    connection = HTTPConnection(url.hostname, url.port, timeout=60)
    connection.request("GET", "/events", headers={"X-Emsim-Token": url.fragment})
    answer = connection.getresponse()
    while b'"kind":"state"' not in (line := answer.readline()):
        assert line
    assert b'"ok":true' in line
    children = Path(f"/proc/{live.pid}/task/{live.pid}/children").read_text().split()
    assert children
    live.send_signal(sign)
    _, said = live.communicate(timeout=60)
    assert live.returncode == 0
    assert "Transient Analysis" in said and "Traceback" not in said
    assert not any(os.path.exists(f"/proc/{child}") for child in children)


def test_a_run_is_ended_with_it(live: subprocess.Popen[str], deck: Path):
    deck.write_text(ENDLESS)
    url = urlsplit(address(live))
    assert url.hostname is not None
    connection = HTTPConnection(url.hostname, url.port, timeout=60)
    connection.request("GET", "/events", headers={"X-Emsim-Token": url.fragment})
    answer = connection.getresponse()
    while (share := re.search(rb'"share":([\d.e-]+)', line := answer.readline())) is None or float(
        share[1]
    ) == 0:
        assert line
    children = Path(f"/proc/{live.pid}/task/{live.pid}/children").read_text().split()
    live.send_signal(signal.SIGINT)
    _, said = live.communicate(timeout=60)
    assert (live.returncode, "Traceback" in said) == (0, False)
    assert children and not any(os.path.exists(f"/proc/{child}") for child in children)


def test_wrong_command_lines(deck: Path):
    for args, why in [
        (["--live", "-"], "watches a file"),
        (["--live", "-o", "x.html", "rc.cir"], "writes no file"),
        (["--live", "--port", "0", "rc.cir"], "no port number"),
        (["--live", "--port", "http", "rc.cir"], "no port number"),
        (["--port", "8000", "rc.cir"], "--port is for --live"),
    ]:
        done = emsim(*args)
        assert (done.returncode, why in done.stderr) == (2, True), done.stderr


def test_what_the_outside_world_refuses(live: subprocess.Popen[str]):
    done = emsim("--live", "--no-open", "there_is_none.cir")
    assert done.returncode == 5 and "there is no file" in done.stderr
    port = urlsplit(address(live)).port
    done = emsim("--live", "--no-open", "--port", str(port), "rc.cir")
    assert done.returncode == 5
    assert "E508" in done.stderr and "without --port" in done.stderr
