"""The playground: a folder that a web server gives out, in which decks are written, mended and run by emsim in the browser."""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

import emsim
from emsim.cli import main
from emsim.playground import site

RC = """a low pass
V1 in 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 in out 1k
C1 out 0 100n
.tran 10u 5m
.print tran v(out)
.end
"""
SPRING = """a mass on a spring
BODY m m=2
JOINT guide 0 m slide ic=0.1
SPRING s guide k=50
.tran 1m 5
.print tran pos(guide)
.end
"""
SOON = 60_000  # ms: Python begins in seconds, on a machine that does nothing else


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if not site.there():  # .ci/run makes it, and says that it has to be there
        how = pytest.fail if os.environ.get("EMSIM_TEST_PLAYGROUND") else pytest.skip
        how("without the parts of the playground: emsim/engine/page.sh, emsim/playground/build.sh")
    target = tmp_path_factory.mktemp("playground") / "site"
    assert main(["playground", "-o", str(target), "-q"]) == 0
    return target


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture(scope="module")
def address(folder: Path) -> Iterator[str]:
    types = {".wasm": "application/wasm", ".mjs": "text/javascript"}
    Quiet.extensions_map = {**SimpleHTTPRequestHandler.extensions_map, **types}
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}/"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def opened(chromium: Any, address: str) -> Iterator[Callable[..., Any]]:
    """opened() opens it; nothing may be said on the console, and nothing asked of another server."""
    said: list[str] = []
    asked: list[str] = []
    contexts = []

    def new_page(behind: str = "") -> Any:
        context = chromium.new_context(bypass_csp=True, viewport={"width": 1500, "height": 900})
        contexts.append(context)
        own = (address, "blob:", "data:")
        context.on("request", lambda r: None if r.url.startswith(own) else asked.append(r.url))
        page = context.new_page()
        page.on("console", lambda m: said.append(m.text))
        page.on("pageerror", lambda e: said.append(str(e)))
        page.goto(address + behind)
        page.wait_for_function("window.playground")
        return page

    yield new_page
    for context in contexts:
        context.close()
    assert said == []
    assert asked == []


@pytest.fixture(scope="module")
def page(opened: Callable[..., Any]) -> Any:
    """One for all tests: Python takes seconds to begin."""
    return opened()


def typed(page: Any, text: str) -> None:
    page.evaluate("text => window.playground.editor.put(text)", text)


def ran(page: Any, title: str) -> None:
    """The run of the deck with that title is shown."""
    page.wait_for_function(
        "title => window.emsim?.run.title === title && !window.playground.busy", arg=title, timeout=SOON
    )


def moving(page: Any) -> None:
    before = page.evaluate("window.emsim.clock.t")
    page.wait_for_function("t => window.emsim.clock.playing && window.emsim.clock.t !== t", arg=before)


def column(page: Any, name: str) -> list[float]:
    found: list[float] = page.evaluate(
        "name => Array.from(window.emsim.run.columns.find(c => c.name === name).values)", name
    )
    return found


def test_it_opens_moving_before_python_is_there(page: Any) -> None:
    page.wait_for_function("window.emsim?.clock.playing && window.engine", timeout=SOON)
    assert not page.evaluate("window.playground.emsim.ready")
    moving(page)


def test_a_deck_is_typed_a_mistake_marked_and_mended_and_it_moves(page: Any) -> None:
    typed(page, SPRING.replace("SPRING s guide", "SPRING s giude"))
    page.wait_for_selector(".cm-lintRange-error", timeout=SOON)
    page.wait_for_function("document.body.classList.contains('stale')")
    assert "giude" in page.inner_text("#said pre")
    mending = page.locator("#said .mend")
    assert mending.count() == 1 and mending.inner_text().startswith("line 4:")
    mending.click()
    ran(page, "a mass on a spring")
    assert page.evaluate("window.playground.editor.text()") == SPRING
    assert page.locator(".cm-lintRange-error").count() == 0
    assert page.is_hidden("#said")
    moving(page)
    # as the command line has it: float32 in the page
    position = emsim.run(SPRING).main["pos(guide)"]
    assert column(page, "pos(guide)") == pytest.approx(list(position), abs=1e-7)


def test_completion_is_the_language_servers(page: Any) -> None:
    typed(page, SPRING.replace("a mass", "a mass again").replace("k=50", "k=50 "))
    ran(page, "a mass again on a spring")
    page.evaluate("window.playground.editor.show(4)")
    page.keyboard.press("End")
    page.keyboard.press("Control+Space")
    page.wait_for_selector(".cm-tooltip-autocomplete", timeout=SOON)
    assert "q0" in page.inner_text(".cm-tooltip-autocomplete")


def test_its_sliders_compute_and_write_into_the_text(page: Any) -> None:
    typed(page, RC)
    ran(page, "a low pass")
    page.wait_for_function("window.engine")
    page.locator("#knobs .fold").click()
    field = page.get_by_label("r1, as text")
    field.fill("2k")
    field.press("Enter")
    page.wait_for_function("!window.engine.busy")
    other = RC.replace("R1 in out 1k", "R1 in out 2k")
    wanted = emsim.run(other).main
    assert column(page, "v(out)")[-1] == pytest.approx(wanted["v(out)"][-1], abs=1e-6)
    page.get_by_label("r1 into the deck's text").click()
    page.wait_for_function("text => window.playground.editor.text() === text", arg=other)


def test_small_values_are_spelled_with_their_suffix(page: Any) -> None:
    """Those that JavaScript itself writes with an exponent too."""
    assert page.evaluate("[2e-8, -4.7e-12, 0.005, 3e9].map(v => spelled(v, '1k'))") == [
        "20n",
        "-4.7p",
        "5m",
        "3g",
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(page: Any, violations: Callable[[Any], list[Any]], scheme: str) -> None:
    page.emulate_media(color_scheme=scheme)
    typed(page, SPRING.replace("a mass", f"a {scheme} mass"))
    ran(page, f"a {scheme} mass on a spring")
    page.wait_for_function("!document.body.classList.contains('stale')")
    assert violations(page) == []
    typed(page, SPRING.replace("k=50", "kk=50"))
    page.wait_for_selector(".cm-lintRange-error", timeout=SOON)
    assert violations(page) == []


def test_what_the_playground_cannot_do_is_named(page: Any) -> None:
    typed(page, RC.replace(".print tran v(out)", ".control\nrun\nprint v(out)[3]\n.endc"))
    page.wait_for_function("document.querySelector('#said pre')?.textContent.includes('E521')", timeout=SOON)
    assert "this needs numpy, which is not in the playground" in page.inner_text("#said pre")


def test_a_run_that_takes_for_ever_is_stopped(page: Any) -> None:
    typed(page, RC.replace("10u 5m", "1 1e5"))
    page.get_by_role("button", name="stop").click(timeout=SOON)
    typed(page, RC)
    ran(page, "a low pass")


def test_a_deck_travels_in_the_link(page: Any, opened: Callable[..., Any]) -> None:
    typed(page, RC.replace("a low pass", "another low pass"))
    ran(page, "another low pass")
    behind = page.evaluate("location.hash")
    assert behind.startswith("#deck=") and len(behind) < 300
    other = opened(behind)
    ran(other, "another low pass")
    assert other.evaluate("window.playground.editor.text()") == page.evaluate(
        "window.playground.editor.text()"
    )
    moving(other)


def test_every_template_and_lesson_is_in_the_menu(folder: Path) -> None:
    decks = json.loads((folder / "decks.json").read_text())
    assert next(d["name"] for d in decks) == "pendulum"
    assert {"01_rc", "foc", "servo"} <= {d["name"] for d in decks}
    assert sum(f.stat().st_size for f in folder.rglob("*") if f.is_file()) < 25_000_000


def test_it_writes_over_no_other_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.txt").write_text("kept")
    assert main(["playground", "-o", str(tmp_path)]) != 0
    assert "other files" in capsys.readouterr().err
    assert main(["playground"]) != 0
    assert "emsim playground -o site" in capsys.readouterr().err
