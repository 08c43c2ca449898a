"""The workbench of a page: deck at the left, one light for text, part and body, panes on the whole screen, size of letters."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.outputs import html

SERVO = Path(__file__).resolve().parents[2] / "netlists/coupled/pendulum_servo.cir"
INSIDE = """a filter twice
V1 a 0 SIN(0 1 50)
X1 a b rc
.subckt rc in out
R1 in out
+ 1k
C1 out 0 1u
.ends
R2 b 0 1k
.tran 1m 40m
.end
"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("bench")
    found = {"servo": folder / "servo.html", "inside": folder / "inside.html"}
    html.write(str(found["servo"]), pipeline.run(str(SERVO), scene=True), SERVO.read_text())
    html.write(str(found["inside"]), pipeline.run(INSIDE, scene=True), INSIDE)
    return found


def line(page: Any, start: str) -> Any:
    """The line of the deck at the left that begins so."""
    return page.locator("#pane .deck > span").filter(has_text=re.compile("^" + re.escape(start))).first


def lit(page: Any) -> list[str]:
    found: list[str] = page.locator("#pane .deck > .lit").all_inner_texts()
    return [text.split()[0] for text in found]


def test_the_deck_stands_at_the_left_where_there_is_room_or_who_asks(
    visit: Callable[..., Any], pages: dict[str, Path]
) -> None:
    wide, narrow = visit(pages["servo"], width=1700), visit(pages["servo"], width=1400)
    assert wide.is_visible("#pane") and narrow.is_hidden("#pane")
    deck, drawing, curves = (wide.locator(at).bounding_box() for at in ("#pane", "#circuit", "#waves"))
    assert deck["x"] + deck["width"] <= drawing["x"] and drawing["x"] + drawing["width"] <= curves["x"]
    assert wide.locator("#stage").bounding_box()["y"] > drawing["y"], "the machine is below its circuit"
    narrow.keyboard.press("t")
    assert narrow.inner_text("#pane .deck").splitlines() == SERVO.read_text().splitlines()
    narrow.click("#text-too")
    assert narrow.is_hidden("#pane")


def test_text_part_and_body_light_each_other_up(visit: Callable[..., Any], pages: dict[str, Path]) -> None:
    page = visit(pages["servo"], width=1700)
    page.hover("#circuit [data-part=rload]")
    assert lit(page) == ["Rload"]
    line(page, "MOTOR").hover()
    assert page.get_attribute("#circuit [data-part=m1]", "class") == "part motor lit"
    assert page.evaluate("emsim.machine.lit") == "m1"
    line(page, "BODY").hover()
    assert page.evaluate("emsim.machine.lit") == "arm" and page.locator("#circuit .lit").count() == 0
    line(page, ".tran").hover()
    assert page.evaluate("emsim.machine.lit") is None and lit(page) == []
    # in the middle of the arm, which hangs straight down at first
    x, y = page.evaluate("emsim.machine.place(emsim.machine.scene.points.find(p => p.name === 'arm.com').at)")
    box = page.locator("#machine").bounding_box()
    page.mouse.move(box["x"] + x, box["y"] + y)
    assert lit(page) == ["BODY"]
    page.mouse.move(box["x"] + 3, box["y"] + 3)
    assert lit(page) == []


def test_lines_of_a_subcircuit_are_of_the_parts_in_it(
    visit: Callable[..., Any], pages: dict[str, Path]
) -> None:
    page = visit(pages["inside"], width=1700)
    line(page, "R1 in").hover()
    assert page.locator("#circuit .lit").count() == 0
    page.dblclick("#circuit [data-part=x1]")
    line(page, "+ 1k").hover()
    assert page.locator("#circuit .lit").get_attribute("data-part") == "x1.r1"
    page.hover("#circuit [data-part='x1.c1']")
    assert lit(page) == ["C1"]


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (3840, 2160), (400, 800)])
def test_each_pane_takes_the_screen_by_its_key(
    visit: Callable[..., Any], pages: dict[str, Path], width: int, height: int
) -> None:
    page = visit(pages["servo"], width=width, height=height)
    panes = {"1": "#pane", "2": "#circuit .picture", "3": "#machine", "4": "#waves"}
    for key, shown in panes.items():
        page.keyboard.press(key)
        for other, at in panes.items():
            assert page.is_visible(at) == (other == key), (key, at)
        box = page.locator(shown).bounding_box()
        assert box["width"] > 0.9 * width and (width < 800 or box["height"] > 0.6 * height)
        assert page.is_hidden("#below") and page.is_visible("#play")
    page.keyboard.press("0")
    assert all(page.is_visible(panes[key]) for key in "234")
    page.keyboard.press("Escape")
    assert page.is_visible("#below") and not page.evaluate("document.body.dataset.present")


def test_letters_are_as_large_as_the_screen_is(visit: Callable[..., Any], pages: dict[str, Path]) -> None:
    sizes = """() => [parseFloat(getComputedStyle(document.body).fontSize), emsim.machine.pen.ctx.font,
        emsim.waves.panels[0].plot.axes[1].font[0]]"""
    plain, large = visit(pages["servo"], width=1400), visit(pages["servo"], width=3840, height=2160)
    assert plain.evaluate(sizes)[:2] == [14, "12px system-ui"]
    before, font, axis = large.evaluate(sizes)
    assert before == pytest.approx(14 * 1.92) and float(font.split("px")[0]) == pytest.approx(
        12 * 1.92, abs=0.1
    )
    large.keyboard.press("p")
    assert large.evaluate(sizes)[0] == pytest.approx(14 * 3)
    large.keyboard.press("p")
    assert large.evaluate(sizes) == [before, font, axis]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(
    visit: Callable[..., Any],
    pages: dict[str, Path],
    axe: str,
    violations: Callable[[Any], list[Any]],
    scheme: str,
) -> None:
    page = visit(pages["servo"], width=1700, scheme=scheme)
    page.hover("#circuit [data-part=rload]")
    assert violations(page) == []
    for key in "1230":
        page.keyboard.press(key)
        assert violations(page) == [], key
