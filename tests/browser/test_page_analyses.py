"""Pages of decks with several analyses: each can be chosen; poles and zeros in the plane; spectra over decades."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import emsim
from emsim.outputs import html

DECK = """amplifier: a family of Bode plots, noise, poles
V1 in 0 dc 0 ac 1
R1 in a {r}
C1 a 0 1n
L1 a out 1m
C2 out 0 10n
R2 out 0 1k
.ac dec 20 1k 10meg
.noise v(out) V1 dec 10 1k 1meg
.pz in 0 out 0 vol pz
.step param r list 1k 3k 10k
.end
"""
SIGNS = "() => document.querySelectorAll('.u-over').length"


@pytest.fixture
def page(tmp_path: Path, chromium: Any) -> Any:
    path = tmp_path / "page.html"
    html.write(str(path), emsim.run(DECK), DECK)
    context = chromium.new_context(viewport={"width": 1200, "height": 900}, bypass_csp=True)
    page = context.new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda e: wrong.append(str(e)))
    page.goto(path.as_uri())
    page.wait_for_selector("#analysis:visible")
    yield page
    context.close()
    assert wrong == []


def choose(page: Any, name: str) -> None:
    label = next(
        text for text in page.locator("#analysis option").all_text_contents() if text.startswith(name)
    )
    page.select_option("#analysis", label=label)


def drawn(page: Any) -> Any:
    page.wait_for_function("() => window.emsim && window.emsim.waves.panels.length")
    return page.evaluate(
        "() => window.emsim.waves.panels.map((p) => [p.units, p.columns.map((c) => c.name)])"
    )


def test_every_analysis_has_its_picture(page: Any) -> None:
    """Only the last analysis over an axis was in the page."""
    names = [text.split(" \u00b7 ")[0] for text in page.locator("#analysis option").all_text_contents()]
    assert sorted(names) == [
        "AC Analysis", "Integrated Noise", "Noise Spectral Density Curves", "Pole-Zero Analysis",
    ]  # fmt: skip
    choose(page, "AC Analysis")
    panels = drawn(page)
    assert panels[0][0] == ["dB"] and panels[1][0] == ["\u00b0"]  # a family's phase was in radians
    choose(page, "Noise Spectral")
    assert drawn(page)[0][0] == ["V/sqrt(Hz)"]
    assert page.get_attribute(".log", "aria-pressed") == "true"
    page.wait_for_function("() => location.hash.includes('analysis')")
    link = page.evaluate("() => location.href")
    other = page.context.new_page()
    other.goto(link)
    assert drawn(other)[0][1] == ["onoise_spectrum", "inoise_spectrum"]


def test_poles_stand_in_the_plane_with_their_steps(page: Any) -> None:
    choose(page, "Pole-Zero")
    page.wait_for_selector("canvas.roots")
    rows = page.locator("#sheet-signals tr").all_text_contents()
    assert len(rows) == 9 and "r = 1000" in rows[0]
    assert any(" j " in row for row in rows)  # a complex pair had lost its imaginary parts
