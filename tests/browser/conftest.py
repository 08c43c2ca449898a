"""Pages that emsim writes, in headless Chromium."""

from __future__ import annotations

import os
import shutil
import subprocess
import tarfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from emsim.cli import main
from emsim.fmus.page import there

AXE = "axe-core@4.10.3"
RULES = (
    "() => axe.run().then((r) => r.violations.map((v) => [v.id, v.nodes.map((n) => n.html.slice(0, 200))]))"
)


@pytest.fixture(scope="session")
def axe(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The text of axe.min.js (MPL 2.0, part of nothing that is shipped): of the file that EMSIM_AXE names, or from npm."""
    if given := os.environ.get("EMSIM_AXE"):
        return Path(given).read_text()
    folder = tmp_path_factory.mktemp("axe")
    npm = shutil.which("npm")
    if npm is None:
        pytest.skip("axe-core needs npm, or EMSIM_AXE")
    got = subprocess.run(
        [npm, "pack", AXE], cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )
    packed = list(folder.glob("axe-core-*.tgz"))
    if not packed:
        pytest.skip(f"npm has no axe-core for us: {got.stderr.strip()[-200:]}")
    with tarfile.open(packed[0]) as archive:
        file = archive.extractfile("package/axe.min.js")
        assert file is not None
        return file.read().decode()


@pytest.fixture
def violations(axe: str) -> Callable[[Any], list[Any]]:
    """violations(page): the rules of axe-core that it breaks, each with its elements."""

    def found(page: Any) -> list[Any]:
        if page.evaluate("typeof axe === 'undefined'"):
            page.evaluate(axe)
        broken: list[Any] = page.evaluate(RULES)
        return broken

    return found


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


@pytest.fixture
def computing(tmp_path: Path, visit: Callable[..., Any], capsys: Any) -> Callable[..., Any]:
    """computing(text) opens the page of a deck, with the engine that computes there."""
    if not there():  # .ci/run makes it, and says that it has to be there
        how = pytest.fail if os.environ.get("EMSIM_TEST_PAGES") else pytest.skip
        how("without the engine of pages: emsim/engine/page.sh")

    def opened(text: str, **size: Any) -> Any:
        deck, page = tmp_path / "deck.cir", tmp_path / "page.html"
        deck.write_text(text)
        assert main([str(deck), "--html", str(page), "-q"]) == 0
        assert page.stat().st_size < 1_150_000
        capsys.readouterr()
        seen = visit(page, **size)
        seen.wait_for_function("window.engine")
        return seen

    return opened


@pytest.fixture
def moved(computing: Callable[..., Any]) -> Callable[..., Any]:
    """moved(text, values) opens it, and gives its sliders other values."""

    def move(text: str, values: dict[str, str], **size: Any) -> Any:
        seen = computing(text, **size)
        seen.click("#knobs .fold")
        for name, value in values.items():
            field = seen.get_by_label(f"{name}, as text")
            field.fill(value)
            field.press("Enter")
            seen.wait_for_function("!window.engine.busy")
        return seen

    return move
