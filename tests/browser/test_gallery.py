"""`emsim gallery`: a folder with a moving picture of each deck, from the file system; a click opens the page that computes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import emsim
from emsim.cli import main
from emsim.fmus.page import there

Image = pytest.importorskip("PIL.Image")

RC = """a low pass
V1 in 0 PULSE(0 1 0 1u 1u 1m 2m)
R1 in out 1k
C1 out 0 100n
.tran 10u 5m
.print tran v(out)
.end
"""
DECKS = {
    "rc.cir": RC,
    "sub/spring.cir": (
        "a mass on a spring\nBODY m m=2 shape=box(0.1,0.1)\nJOINT guide 0 m slide ic=0.1\nSPRING s guide k=50\n"
        ".tran 1m 5\n.print tran pos(guide)\n.end\n"
    ),
    "sub/lift.cir": (
        "a motor & its disc\nV1 a 0 3\nBODY disc shape=disc(0.05) m=1\nJOINT hinge 0 disc pin\n"
        "MOTOR m1 a 0 hinge kt=20m r=2 l=1m j=2u\n.tran 1m 0.5\n.end\n"
    ),
    "sweep.cir": "gain\nV1 a 0 dc 0 ac 1\nR1 a b 1k\nC1 b 0 1u\n.ac dec 10 1 1meg\n.print ac v(b)\n.end\n",
    "rest.cir": "divider\nV1 a 0 1\nR1 a b 1k\nR2 b 0 1k\n.op\n.end\n",
    "wrong.cir": "wrong\nR1 a 0 k1k\n.op\n.end\n",
}
SIZE = (320, 240)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gallery")
    for name, text in DECKS.items():
        (folder / "decks" / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / "decks" / name).write_text(text)
    assert main(["gallery", "-q", "-j", "1", "-o", str(folder / "site"), str(folder / "decks")]) == 0
    return folder / "site"


@pytest.fixture
def index(chromium: Any, built: Path) -> Iterator[Callable[..., Any]]:
    """index(..) opens it; nothing may be said on the console, and nothing asked of any network."""
    said: list[str] = []
    contexts = []

    def opened(width: int = 1300, scheme: str = "light", **more: Any) -> Any:
        context = chromium.new_context(
            viewport={"width": width, "height": 800}, color_scheme=scheme, bypass_csp=True, **more
        )
        contexts.append(context)
        page = context.new_page()
        page.on("console", lambda m: said.append(m.text))
        page.on("pageerror", lambda e: said.append(str(e)))
        page.on(
            "request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else said.append(r.url)
        )
        page.goto((built / "index.html").as_uri())
        return page

    yield opened
    for context in contexts:
        context.close()
    assert said == []


def titles(page: Any) -> list[str]:
    return [text.strip() for text in page.locator("#decks li:not([hidden]) span").all_inner_texts()]


def test_every_deck_with_a_result_is_there_and_the_others_are_told(
    tmp_path: Path, built: Path, capsys: Any
) -> None:
    pages = sorted(p.relative_to(built).as_posix() for p in built.rglob("decks/**/*.html"))
    assert pages == [
        f"decks/{n}.html" for n in ("decks/rc", "decks/rest", "decks/sweep", "sub/lift", "sub/spring")
    ]
    source = built.parent / "decks" / "wrong.cir"
    assert main(["gallery", "-j", "1", "-o", str(tmp_path / "site"), str(source)]) == 0
    said = capsys.readouterr().err
    assert "left out: decks/wrong" in said and "0 decks of which 0 compute" in said


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path, capsys: Any) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    deck = tmp_path / "rc.cir"
    deck.write_text(RC)
    assert main(["gallery", "-o", str(tmp_path), str(deck)]) != 0
    assert "E507" in capsys.readouterr().err


def test_pictures_move_over_time_and_along_other_axes(built: Path) -> None:
    for name, frames in (("sub/spring", 40), ("decks/rc", 40), ("decks/sweep", 40), ("decks/rest", 1)):
        with (
            Image.open(built / f"decks/{name}.webp") as film,
            Image.open(built / f"decks/{name}_still.webp") as still,
        ):
            assert film.size == still.size == SIZE
            assert getattr(film, "n_frames", 1) == frames
            assert still.convert("L").getextrema()[0] < 128, "something is drawn"
            if frames > 1:
                first = film.convert("RGB").tobytes()
                film.seek(frames // 2)
                assert film.convert("RGB").tobytes() != first


def test_subjects_and_words_filter_and_stay_in_the_address(index: Callable[..., Any]) -> None:
    page = index()
    assert len(titles(page)) == 5
    page.click("[data-subject='machine']")
    assert titles(page) == ["a mass on a spring"]
    page.click("[data-subject='machine']")
    page.click("[data-subject='motors']")
    assert titles(page) == ["a motor & its disc"]
    page.reload()
    assert titles(page) == ["a motor & its disc"] and page.inner_text("#count") == "1 of 5"
    page.click("[data-subject='motors']")
    page.fill("#words", "low")
    assert titles(page) == ["a low pass"]


def test_what_is_pointed_at_or_has_the_focus_moves(index: Callable[..., Any]) -> None:
    page = index()
    item = page.locator("#decks li", has_text="mass on a spring")
    shown = "img => img.getAttribute('src')"
    still = item.locator("img").evaluate(shown)
    item.hover()
    assert item.locator("img").evaluate(shown) == still.replace("_still", "")
    page.mouse.move(0, 0)
    assert item.locator("img").evaluate(shown) == still
    item.locator("a").focus()
    assert item.locator("img").evaluate(shown) == still.replace("_still", "")
    calm = index(reduced_motion="reduce").locator("#decks li", has_text="mass on a spring")
    calm.hover()
    assert calm.locator("img").evaluate(shown) == still


def test_where_nothing_can_point_what_is_seen_moves(index: Callable[..., Any]) -> None:
    page = index(width=400, has_touch=True, is_mobile=True)
    page.wait_for_function("!document.querySelector('#decks img').getAttribute('src').includes('_still')")
    last = page.locator("#decks img").last
    assert "_still" in last.get_attribute("src")
    last.scroll_into_view_if_needed()
    page.wait_for_function(
        "![...document.querySelectorAll('#decks img')].at(-1).getAttribute('src').includes('_still')"
    )


def test_a_click_opens_the_page_which_computes(index: Callable[..., Any]) -> None:
    if not there():  # .ci/run makes it, and says that it has to be there
        how = pytest.fail if os.environ.get("EMSIM_TEST_PAGES") else pytest.skip
        how("without the engine of pages: emsim/engine/page.sh")
    page = index()
    page.click("text=a low pass")
    page.wait_for_function("window.engine")
    page.click("#knobs .fold")
    field = page.get_by_label("r1, as text")
    field.fill("2k")
    field.press("Enter")
    page.wait_for_function("!window.engine.busy")
    wanted = emsim.run(RC.replace("1k", "2k")).main["v(out)"]
    found = page.evaluate("Array.from(window.emsim.run.columns.find(c => c.name === 'v(out)').values)")
    assert found[-1] == pytest.approx(wanted[-1], abs=1e-6)
    page.click("text=gallery")
    assert page.url.endswith("index.html") and len(titles(page)) == 5


@pytest.mark.parametrize(
    ("width", "scheme"), [(1300, "light"), (1300, "dark"), (400, "light"), (400, "dark")]
)
def test_axe_finds_nothing_and_it_fits(index: Callable[..., Any], axe: str, width: int, scheme: str) -> None:
    page = index(width=width, scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    page.click("[data-subject='circuit']")
    page.evaluate(axe)
    # a page from the file system cannot read its style sheet again, which axe-core would for what lies at the screen's turns
    assert page.evaluate("() => axe.run({ preload: false }).then((r) => r.violations.map((v) => v.id))") == []
