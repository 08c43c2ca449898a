"""What the page asks of emsim in its own Python: runs of the deck that is being edited, what the page computes with, the sheet of
its equations, and what the language server says at a place. outputs/web/playground-worker.js calls it; answers are JSON.
"""

from __future__ import annotations

import json
from time import monotonic

from ..fmus import page
from ..live.helping import Helper
from ..live.session import pieces
from ..live.worker import TELL_EVERY, carried, explain

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from ..result import Result

FILE = "deck.cir"  # in a folder of its own, which is the working directory


class Desk:
    """`tell(share)` is called with how much of a run is done, 0 to 1."""

    def __init__(self, tell: Callable[[float], object]) -> None:
        self._tell, self._then = tell, 0.0
        self._result: Result | None = None
        self._helper = Helper()

    def run(self, text: str) -> str:
        """{ok, seconds, said: the messages as on a terminal, marks: see `helping.mark`, run: as the page takes it, or null}."""
        with open(FILE, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        head, run, result, _ = carried(_JOB, self._progress)
        self._result = result if head["ok"] else None
        words = {"ok": head["ok"], "seconds": head["seconds"], "said": pieces(head["text"])}
        return _text({**words, "marks": head["marks"], "run": run})

    def engine(self) -> str:
        """What the last run's page computes with, or null."""
        return _text(None if self._result is None else page.opened(FILE, self._result, {}, {}))

    def explain(self) -> str:
        return _text(explain(_JOB)["sheets"])

    def complete(self, text: str, row: int, col: int) -> str:
        return _text(self._helper.complete(text, row, col))

    def hover(self, text: str, row: int, col: int) -> str:
        return _text(self._helper.hover(text, row, col))

    def _progress(self, t: float, stop: float, step: float, steps: int, events: int) -> None:
        now = monotonic()
        if now - self._then >= TELL_EVERY:
            self._then = now
            self._tell(t / stop if stop else 0.0)


_JOB: dict[str, Any] = {"deck": FILE, "defines": {}, "set": {}, "options": {}}


def _text(answer: Any) -> str:
    return json.dumps(answer, separators=(",", ":"), allow_nan=False)
