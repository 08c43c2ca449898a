"""From saving a deck, or moving a slider, to the picture in the browser: `python tests/bench/live.py [deck [repetitions]]`.

Headless Chromium shows the live page. "at hand" is the time from the write to the moment when the server has the run for
the page, "painted" to the first frame after the page has drawn it; "run" is the work of the run's own process, from reading
the deck to the page's data. The slider changes the first .param; without one there is no such row. Medians, milliseconds.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
import time
from pathlib import Path
from shutil import which
from threading import Thread
from typing import Any

from emsim.live.server import Server
from emsim.live.session import Board, Session

ROOT = Path(__file__).resolve().parents[2]
# resolves with the time [ms since the epoch] of the first frame that holds another run than now
PAINTED = """() => { const before = window.emsim.run; window.painted = new Promise((done) => {
    const look = () => requestAnimationFrame(window.emsim && window.emsim.run !== before ? () => done(Date.now()) : look);
    look(); }); }"""
READY = "() => document.querySelector('#live.ok') && !document.body.classList.contains('busy') && window.emsim && 1"
MOVE = """(e, share) => { e.value = +e.min + share * (e.max - e.min); e.dispatchEvent(new Event('input')); return Date.now(); }"""


class Timed(Board):
    """Notes when the newest run was at hand [ms since the epoch] and how long its process worked [ms]."""

    at = worked = 0.0

    def put(self, **lines: bytes) -> None:
        if "state" in lines:
            self.at, self.worked = 1000 * time.time(), 1000 * json.loads(lines["state"])["seconds"]
        super().put(**lines)


def main(deck: str = str(ROOT / "netlists/coupled/pendulum_servo.cir"), repetitions: int = 15) -> None:
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        copy = Path(folder) / Path(deck).name
        text = Path(deck).read_text()
        copy.write_text(text)
        session = Session(str(copy))
        board = session.board = Timed()
        server = Server(board, session.ask)
        loop = Thread(target=session.serve, daemon=True)
        for thread in (loop, Thread(target=server.serve_forever, daemon=True)):
            thread.start()
        program = next(
            p for n in ("chromium", "chromium-browser", "google-chrome", "chrome") if (p := which(n))
        )
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.goto(server.url)
        wait(page)
        print(f"{copy.name}, medians of {repetitions} [ms]   run  at hand  painted")
        rows = []
        for k in range(repetitions):
            page.evaluate(PAINTED)
            fresh = copy.with_suffix(".new")
            fresh.write_text(text + f"* version {k}\n")
            began = 1000 * time.time()
            fresh.rename(copy)
            rows.append(times(page, board, began))
        told("a deck is saved", rows)
        if page.locator(".knob").count():
            rows = []
            for k in range(repetitions):
                page.evaluate(PAINTED)
                began = page.locator(".knob input[type=range]").first.evaluate(
                    MOVE, 0.4 + 0.2 * (k + 0.5) / repetitions
                )
                rows.append(times(page, board, began))
            told("a slider is moved", rows)
        browser.close()
        session.stop()
        loop.join()
        server.shutdown()


def times(page: Any, board: Timed, began: float) -> tuple[float, float, float]:
    painted = page.evaluate("() => window.painted")
    wait(page)
    return board.worked, board.at - began, painted - began


def wait(page: Any) -> None:
    while not page.evaluate(READY):
        time.sleep(0.01)


def told(what: str, rows: list[tuple[float, float, float]]) -> None:
    print(f"{what:<33}", *(f"{statistics.median(column):8.1f}" for column in zip(*rows, strict=True)))


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
