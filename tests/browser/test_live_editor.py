"""`emsim view --live` with the editor of the playground at the left of its page, where its parts have been made."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from emsim.live import server as live
from emsim.live.session import Session

DECK = """a low pass
V1 in 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 in out {r}
C1 out 0 100n
.param r=1k
.tran 10u 5m
.print tran v(out)
.end
"""


@pytest.fixture
def opened(tmp_path: Path, chromium: Any) -> Iterator[tuple[Path, Any]]:
    """The deck's file, and its page; at the end nothing may have been said on the console."""
    if not Path(live.EDITOR).exists():  # .ci/run makes it, and says that it has to be there
        how = pytest.fail if os.environ.get("EMSIM_TEST_PLAYGROUND") else pytest.skip
        how("without the editor of pages: emsim/playground/build.sh")
    deck = tmp_path / "rc.cir"
    deck.write_text(DECK)
    session = Session(str(deck))
    server = live.Server(session.board, session.ask, edit=session.edit, deck=str(deck))
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
    loop = Thread(target=session.serve, daemon=True)
    loop.start()
    said: list[str] = []
    context = chromium.new_context(viewport={"width": 1600, "height": 900})
    page = context.new_page()
    page.on("console", lambda m: said.append(m.text))
    page.on("pageerror", lambda e: said.append(str(e)))
    page.goto(server.url)
    page.wait_for_selector("#live.ok")
    page.wait_for_selector("#pane .cm-content")
    yield deck, page
    context.close()
    session.stop()
    loop.join(60)
    server.shutdown()
    server.server_close()
    assert said == []


def typed(page: Any, line: int, text: str) -> None:
    """Another text in a line of the editor, from 1."""
    page.locator("#pane .cm-line").nth(line - 1).click()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+End")
    page.keyboard.type(text)
    page.keyboard.press("Escape")  # what may be completed


def test_it_opens_moving(opened: tuple[Path, Any]) -> None:
    page = opened[1]
    assert page.evaluate("() => window.emsim.clock.playing")
    page.wait_for_function("() => window.emsim.clock.t > 0")


def test_a_mistake_is_marked_mended_and_saved(opened: tuple[Path, Any]) -> None:
    deck, page = opened
    typed(page, 4, "C1 out 0 100n icc=1")
    assert deck.read_text() == DECK and page.is_enabled("text=save")
    page.keyboard.press("Control+s")
    page.wait_for_selector("#live.wrong")
    page.wait_for_selector(".cm-lintRange-error")
    assert "icc" in page.inner_text("#pane #said") and deck.read_text() == DECK.replace("100n", "100n icc=1")
    page.locator("#said .mend").first.click()
    page.click("text=save")
    page.wait_for_selector("#live.ok")
    page.wait_for_function("() => !document.querySelector('.cm-lintRange-error')")
    assert deck.read_text() == DECK.replace("100n", "100n ic=1")


def test_letters_of_the_editor_are_no_keys_of_the_page(opened: tuple[Path, Any]) -> None:
    _, page = opened
    typed(page, 1, "pdt 1234")
    assert not page.evaluate("() => document.body.dataset.present")
    assert page.inner_text("#pane .cm-line >> nth=0") == "pdt 1234"
    assert not page.evaluate("() => document.documentElement.classList.contains('dark')")


def test_a_file_that_changes_is_followed_and_one_that_both_change_is_told(opened: tuple[Path, Any]) -> None:
    deck, page = opened
    deck.write_text(DECK.replace("100n", "200n"))
    page.wait_for_function("() => window.bench.editor.text().includes('200n')")
    typed(page, 1, "mine")
    deck.write_text(DECK.replace("100n", "300n"))
    page.click("text=take it")
    assert page.evaluate("() => window.bench.editor.text()") == DECK.replace("100n", "300n")


def test_lines_and_parts_light_each_other_up(opened: tuple[Path, Any]) -> None:
    _, page = opened
    page.hover("#circuit [data-part=c1]")
    assert page.inner_text(".cm-lit") == "C1 out 0 100n"
    page.locator("#pane .cm-line").nth(1).hover()
    assert page.get_attribute("#circuit .lit", "data-part") == "v1"


def test_completion_and_help_are_the_language_servers(opened: tuple[Path, Any]) -> None:
    _, page = opened
    typed(page, 6, ".tra")
    page.keyboard.press("Control+Space")
    page.wait_for_selector(".cm-tooltip-autocomplete")
    assert ".tran" in page.inner_text(".cm-tooltip-autocomplete")


def test_a_slider_writes_its_value_into_the_text_and_the_file(opened: tuple[Path, Any]) -> None:
    deck, page = opened
    page.locator("#params input[type=text]").fill("2k")
    page.keyboard.press("Enter")
    page.click("#written button:has-text('write')")
    page.wait_for_function("() => window.bench.editor.text().includes('.param r=2k')")
    end = "() => document.querySelector('#pane .tools [role=status]').textContent === 'saved'"
    page.wait_for_function(end)
    assert deck.read_text() == DECK.replace("r=1k", "r=2k")
