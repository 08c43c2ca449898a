"""When a deck is run, and what the page is to know of it: one loop, which alone decides.

Files are looked at, the page's wishes and the runs' answers come through one queue. What the page is to know lies on the
`Board`: the newest message of each kind, so that a slow reader skips what is out of date.
"""

from __future__ import annotations

import json
import re
import time
from queue import Empty, SimpleQueue
from threading import Condition, Event

from ..outputs.beside import replacing
from .runs import Runs
from .watch import Watch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

LOOK = 0.01  # seconds between looks at the files
QUIET = 0.3  # seconds after a good run in which nothing is asked: then its equations are written
_PAINT = re.compile("\033\\[([\\d;]*)m")
CLASSES = {"1;31": "error", "1;33": "warning", "1;36": "note", "1": "strong", "1;34": "rule"}


class Board:
    """Messages for any number of readers, the newest of each kind; each a line of JSON."""

    def __init__(self) -> None:
        self._news = Condition()
        self._lines: dict[str, tuple[int, bytes]] = {}
        self._version = 0
        self.closed = False

    def put(self, **lines: bytes) -> None:
        """All at once: no reader sees one without the other. They are read in the order given."""
        with self._news:
            for kind, line in lines.items():
                self._version += 1
                self._lines[kind] = (self._version, line)
            self._news.notify_all()

    def after(self, version: int, wait: float) -> tuple[int, list[bytes]]:
        """What is newer than `version`, oldest first, and the version now; nothing after `wait` seconds."""
        with self._news:
            self._news.wait_for(lambda: self._version > version or self.closed, wait)
            found = sorted(entry for entry in self._lines.values() if entry[0] > version)
            return self._version, [line for _, line in found]

    def close(self) -> None:
        with self._news:
            self.closed = True
            self._news.notify_all()


class Session:
    """Runs `deck`, a path, whenever it or an included file changes or the page sets a parameter.

    defines, options   as the command line gives them
    say                is called with what is said of every run that a file caused (worker.work), for the terminal
    """

    def __init__(
        self,
        deck: str,
        defines: dict[str, str] | None = None,
        options: dict[str, float | str] | None = None,
        say: Callable[[dict[str, Any]], object] = lambda head: None,
    ) -> None:
        self.deck, self.defines, self.options, self.say = deck, dict(defines or {}), dict(options or {}), say
        self.board = Board()
        self.watch = Watch([deck])
        self.runs = Runs(lambda *answer: self._inbox.put(("answer", answer)))
        self._inbox: SimpleQueue[tuple[str, Any]] = SimpleQueue()
        self._stop = Event()
        self._params: dict[str, dict[str, Any]] = {}
        self._set: dict[str, list[str]] = {}  # name -> text, text in the deck
        self._asked = 0  # the last wish that the run at hand knows
        self._started = 0  # of the run at hand, by the clock of files [ns]
        self._by_file = True
        self._run = 0  # its number; a higher one is that of its equations
        self._explain: float | None = None  # when the equations are due

    # ---- from other threads ----

    def ask(self, change: dict[str, str | None], number: int) -> None:
        """Sets parameters, or with None gives them back to the deck. `number` comes back in the answer to it."""
        self._inbox.put(("ask", (change, number)))

    def edit(self, text: str, was: str) -> bool:
        """Writes the deck's file, as an editor would; False where it no longer holds `was`, as the page has it."""
        with open(self.deck, encoding="utf-8", newline="") as file:
            now = file.read()
        if now.replace("\r\n", "\n").removeprefix("\ufeff") != was:
            return False
        with replacing(self.deck) as beside, open(beside, "w", encoding="utf-8", newline="") as file:
            file.write(text.replace("\n", "\r\n") if "\r\n" in now else text)
        return True

    def stop(self) -> None:
        self._stop.set()

    # ---- the loop ----

    def serve(self) -> None:
        """Until `stop`, or an exception such as KeyboardInterrupt; afterwards no run is left."""
        try:
            self._launch(True)
            while not self._stop.is_set():
                self._turn()
        finally:
            self.runs.end()
            self.board.close()

    def _turn(self) -> None:
        wishes = False
        try:
            kind, what = self._inbox.get(timeout=LOOK)
            while True:
                if kind == "ask":
                    self._wish(*what)
                    wishes = True
                else:
                    self._answer(*what)
                kind, what = self._inbox.get_nowait()
        except Empty:
            pass
        if self.watch.changed():
            self._launch(True)
        elif wishes:
            self._launch(False)
        elif self._explain is not None and time.monotonic() >= self._explain:
            self._explain = None
            self.runs.start({**self._job(), "explain": True})
        elif self.runs.busy:
            self.runs.prepare()

    def _wish(self, change: dict[str, str | None], number: int) -> None:
        self._asked = number
        for name, text in change.items():
            if name in self._params and text is not None:
                self._set[name] = [text, self._params[name]["text"]]
            else:
                self._set.pop(name, None)

    def _launch(self, by_file: bool) -> None:
        self._started, self._by_file, self._explain = time.time_ns(), by_file, None
        number = self.runs.start(self._job())
        self._run = number
        self.board.put(busy=_line(kind="busy", number=number, share=0.0))

    def _job(self) -> dict[str, Any]:
        return {"deck": self.deck, "defines": self.defines, "set": self._set, "options": self.options}

    def _answer(self, number: int, head: dict[str, Any], document: bytes) -> None:
        if number != self.runs.number:
            return  # of a run that a newer one ended
        if number != self._run:
            # the equations of the last run; if their process died, the page does without them
            if "sheets" in head:
                self.board.put(sheets=_line(kind="sheets", number=self._run, sheets=head["sheets"]))
            return
        if head["kind"] == "progress":
            share = head["t"] / head["stop"] if head["stop"] else 0.0
            self.board.put(busy=_line(kind="busy", number=number, share=share))
            return
        if head["kind"] == "died":
            head = _died(head["code"])
        else:
            self.watch.follow([self.deck, *head["named"]], self._started - 20_000_000)
            self._set = head["set"]
            if head["read"] or not self._params:
                self._params = {p["name"]: p for p in [*head["params"], *head["values"]]}
        if self._by_file:
            self.say(head)
        state = _line(
            kind="state", number=number, asked=self._asked, deck=self.deck, ok=head["ok"], read=head["read"],
            drawn=bool(document), facts=head["facts"], seconds=head["seconds"], said=pieces(head["text"]),
            lines=head["lines"], fixes=head.get("fixes", []), sheet=head["sheet"], source=head.get("source"),
            marks=head.get("marks", []),
            params=[p for p in self._params.values() if "card" not in p],
            values=[p for p in self._params.values() if "card" in p],
            set={k: v for k, (v, _) in self._set.items()},
        )  # fmt: skip
        busy = _line(kind="busy", number=number, share=None)
        if document:
            run = b'{"kind":"run","number":%d,"run":%b}\n' % (number, document)
            self.board.put(run=run, state=state, busy=busy)
            self._explain = time.monotonic() + QUIET if head["ok"] else None
        else:
            self.board.put(state=state, busy=busy)


def _line(**message: Any) -> bytes:
    return json.dumps(message, separators=(",", ":")).encode() + b"\n"


def _died(code: int) -> dict[str, Any]:
    why = f"by signal {-code}" if code < 0 else f"with exit code {code}"
    text = f"error[E499]: the process of the run ended {why}; save the deck to run it again"
    return {"ok": False, "read": False, "text": text, "lines": [], "sheet": "", "facts": "", "seconds": 0.0}


def pieces(text: str) -> list[tuple[str, str]]:
    """Coloured text of a terminal as (class, text) for the page; "" is the class of plain text."""
    parts = _PAINT.split(text)
    found = [("", parts[0])] + [
        (CLASSES.get(code, ""), part) for code, part in zip(parts[1::2], parts[2::2], strict=True)
    ]
    return [(name, part) for name, part in found if part]
