"""Commands of emsim as programs of their own: what signals, limits and full disks do to them."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# a run of half a minute, with rows from the first moment on
LONG = """band pass
V1 in 0 SIN(0 5 1k)
R1 in a 100
L1 a b 10m
C1 b out 25.33n
R2 out 0 200
.op
.tran 1u 20 0 1u
.end
"""


def command(*words: str) -> list[str]:
    # -B: a limit on sizes of files leaves no half of a compiled module behind
    return [sys.executable, "-B", "-m", "emsim", *words]


def start(*words: str, **more: Any) -> subprocess.Popen[str]:
    """The program as a child that listens to signals, even where the tests run in the background."""

    def listen() -> None:
        for number in (signal.SIGINT, signal.SIGHUP):
            signal.signal(number, signal.SIG_DFL)

    if os.name == "posix":
        more.setdefault("preexec_fn", listen)
    return subprocess.Popen(
        command(*words), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **more
    )


def finish(*words: str, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command(*words), capture_output=True, text=True, timeout=120, **more)


def wait_for(what: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.02)


def holds(path: Path, size: int) -> Callable[[], bool]:
    return lambda: path.exists() and path.stat().st_size > size
