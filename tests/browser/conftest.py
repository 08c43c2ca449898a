"""Pages that emsim writes, in headless Chromium."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def visit(chromium: Any) -> Iterator[Callable[..., Any]]:
    """visit(path) opens a page file and waits until it has drawn; at the end nothing may have been said on the
    console and nothing asked of any network."""
    said: list[str] = []
    asked: list[str] = []
    contexts = []

    def open_page(
        where: Path | str, width: int = 1400, height: int = 900, scheme: str = "light", playing: bool = False
    ) -> Any:
        # scripts of the test itself are evaluated, which the page's own policy forbids
        context = chromium.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, bypass_csp=True
        )
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: said.append(m.text))
        page.on("pageerror", lambda e: said.append(str(e)))
        url = where if isinstance(where, str) else where.as_uri()
        page.on(
            "request",
            lambda r: None if r.url.startswith(("file:", "data:", "blob:", url)) else asked.append(r.url),
        )
        page.goto(url)
        page.wait_for_function(
            "window.emsim ? window.emsim.waves.panels.length > 0 : window.still", timeout=20_000
        )
        if not playing:  # a page begins to play; most tests begin at rest, at its first instant
            page.evaluate("() => { const c = window.emsim?.clock; c?.play(false); c?.set(c.first); }")
            page.wait_for_function(
                "() => !window.emsim || (!window.emsim.clock.waiting && window.emsim.clock.t === window.emsim.clock.first)"
            )
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []
    assert asked == []
