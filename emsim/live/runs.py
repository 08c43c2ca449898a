"""At most one run at a time, each in a process of its own that is ended when a newer one starts.

A process that has finished its run takes the next one; beside one that is busy a spare waits, so that ending a run does
not cost the next one the time that Python needs to start.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from threading import Thread

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    Tell = Callable[[int, dict[str, Any], bytes], object]

# the same modules as here, whatever the working directory holds
START = (
    f"import sys; sys.path[:] = sys.argv[1].split({os.pathsep!r}); from emsim.live.worker import main; main()"
)


class Runs:
    """`tell(number, head, document)` is called from another thread for every answer to run `number`; a process that
    ended by itself answers {"kind": "died", "code": exit code}."""

    def __init__(self, tell: Tell) -> None:
        self.tell = tell
        self.number = 0
        self._now: _Process | None = None
        self._spare: _Process | None = None

    def start(self, job: dict[str, Any]) -> int:
        """Ends the run that is on its way and starts this one; returns its number."""
        self.number += 1
        if self._now is not None and not self._now.idle:
            self._now.end()
            self._now = None
        if self._now is None or self._now.gone:
            self._now, self._spare = self._spare, None
        if self._now is None or self._now.gone:
            self._now = _Process(self.tell)
        self._now.run(self.number, job)
        return self.number

    @property
    def busy(self) -> bool:
        return self._now is not None and not self._now.idle

    @property
    def pid(self) -> int | None:
        """The process that runs, or is to run next."""
        return None if self._now is None else self._now.process.pid

    def prepare(self) -> None:
        """For quiet moments: a process that waits for the next run."""
        if self._spare is None and (self._now is None or not self._now.idle):
            self._spare = _Process(self.tell)

    def end(self) -> None:
        """Ends every process and waits until it is gone."""
        for process in (self._now, self._spare):
            if process is not None:
                process.end()
                process.process.wait()
        self._now = self._spare = None


class _Process:
    def __init__(self, tell: Tell) -> None:
        self.tell, self.number, self.idle, self.ended = tell, 0, True, False
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-c", START, os.pathsep.join(sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C is for the session, which ends this process
        )
        Thread(target=self._listen, daemon=True).start()

    @property
    def gone(self) -> bool:
        return self.process.poll() is not None

    def run(self, number: int, job: dict[str, Any]) -> None:
        self.number, self.idle = number, False
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(job).encode() + b"\n")
            self.process.stdin.flush()
        except OSError:
            pass  # it is gone: the listener says so

    def end(self) -> None:
        self.ended = True
        self.process.kill()

    def _listen(self) -> None:
        out = self.process.stdout
        assert out is not None
        while (line := out.readline()).endswith(b"\n"):
            head, document, number = json.loads(line), b"", self.number
            if head["kind"] == "done":
                document = out.read(size := head.pop("size"))
                if len(document) < size:
                    break
                self.idle = True
            self.tell(number, head, document)
        code = self.process.wait()
        if not self.ended:
            self.tell(self.number, {"kind": "died", "code": code}, b"")
