"""Programs that end with emsim, however that ends.

A program that computes for minutes must not go on for nobody. A signal that kills emsim outright leaves no time to tell it; so a
shell beside it waits for the end of a pipe whose other end emsim holds, which the system closes for whoever has died. On Windows,
where there is no such shell, a program is ended where emsim is told to end.
"""

from __future__ import annotations

import os
import subprocess

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import IO

# the program's own input is empty; the watcher goes when the program has ended, before its number can be another's
BESIDE = """exec 3<&0 </dev/null
"$@" 3<&- & program=$!
{ cat <&3; kill -9 $program; } >/dev/null 2>&1 & watcher=$!
exec 3<&-
wait $program; code=$?
kill -9 $watcher 2>/dev/null
exit $code"""


class Child:
    """`with Child(command, ..) as child`: at the end of the block the program has ended."""

    __slots__ = ("_run",)

    def __init__(self, command: Sequence[str], folder: str, env: Mapping[str, str], log: IO[bytes]) -> None:
        watched = os.name == "posix"
        self._run = subprocess.Popen(
            ["/bin/sh", "-c", BESIDE, "sh", *command] if watched else list(command), cwd=folder, env=env,
            stdin=subprocess.PIPE if watched else subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
        )  # fmt: skip

    def wait(self, seconds: float) -> int | None:
        """Its exit code; None where it runs on after so long."""
        try:
            return self._run.wait(seconds)
        except subprocess.TimeoutExpired:
            return None

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        if self._run.stdin is not None:
            self._run.stdin.close()
        else:
            self._run.kill()
        self._run.wait()
