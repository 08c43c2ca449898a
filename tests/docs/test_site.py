"""The docs site builds without a warning, its links lead somewhere, and looking at it asks nothing of the network."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import pytest
from support import ROOT

from emsim.assemble import waves
from emsim.cards import CARDS
from emsim.editor import words

DOCS = ROOT / "emsim" / "docs"


@pytest.fixture(scope="module")
def links():
    sys.path.insert(0, str(DOCS))
    try:
        import links
        import reference

        yield links, reference
    finally:
        sys.path.remove(str(DOCS))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, DOCS / "build.py", folder], capture_output=True, text=True, stdin=subprocess.DEVNULL
    )
    # the theme's, mkdocs' or a plugin's words would be warnings here
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    assert done.stdout == f"site: {folder / 'index.html'}\n"
    return folder


def test_builds_strictly_and_every_link_leads_somewhere(site):
    assert len(list(site.rglob("*.html"))) > 40


def test_every_card_has_its_place_in_the_reference(site):
    text = (site / "reference" / "cards.html").read_text()
    for word in CARDS:
        assert f'id="{word.lower()}"' in text


def test_lessons_show_their_deck_and_their_run(site):
    for path in sorted((ROOT / "netlists" / "lessons").glob("*.cir")):
        text = (site / "decks" / "lessons" / f"{path.stem}.html").read_text()
        assert f"runs/lessons/{path.stem}.html" in text and ".tran" in text and "<math" in text
        assert (site / "runs" / "lessons" / f"{path.stem}.html").stat().st_size > 50_000
        assert "\\(" not in text and "<!--" not in text.partition("<article")[2].partition("</article")[0]


def test_waveforms_have_the_defaults_that_are_told():
    tstep, tstop = 0.25, 8.0
    meanings = {"0": 0.0, "tstep": tstep, "tstop": tstop, "1/tstop": 1 / tstop, "without_end": 0.0}
    assert {word.lower() for word in words.WAVES} == set(waves.RULES) - {"dc"}
    for word, (_, told) in words.WAVES.items():
        if word in ("PWL", "TRNOISE", "TRRANDOM"):
            continue  # points
        rows = [row.split() for row in told.split(",")]
        given = [3.0, 4.0][: sum(value == "-" for _, _, value in rows)]
        out = waves.RULES[word.lower()](waves.Arguments(given), SimpleNamespace(params={}), tstep, tstop)
        rows = [row for row in rows if row[0] != "-"]
        for (name, _, value), got in zip(rows[len(given) :], out[len(given) :], strict=True):
            value = value.removeprefix("~")
            want = sum(meanings[v] if v != "td1" else tstep for v in value.split("+"))
            assert got == pytest.approx(want), (word, name)


def test_broken_links_are_found(links, tmp_path):
    checker, _ = links
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#there">x</a><a href="#here">x</a><a href="none.html">x</a><a href="#gone">x</a>'
        '<img src="p.png"><script src="https://cdn.invalid/x.js"></script><a href="https://elsewhere.invalid">x</a>'
    )
    (tmp_path / "b.html").write_text('<link rel="stylesheet" href="https://cdn.invalid/x.css"><p id="where">')
    assert checker.site(tmp_path) == [
        "a.html: no anchor b.html#there",
        "a.html: no none.html",
        "a.html: no anchor #gone",
        "a.html: no p.png",
        "a.html: fetches https://cdn.invalid/x.js",
        "b.html: fetches https://cdn.invalid/x.css",
    ]
    (tmp_path / "netlists").mkdir()
    (tmp_path / "emsim").mkdir()
    (tmp_path / "README.md").write_text(
        "# A b\n[x](#a-b) [x](#b) [x](no.md) [x](netlists)\n```\n[x](y)\n```\n"
    )
    (tmp_path / "emsim" / "README.md").write_text("[x](../README.md#a-b)")
    assert checker.sources(tmp_path) == ["README.md: no heading #b", "README.md: no no.md"]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1280, 390])
def test_pages_open_from_disk_without_an_error_or_a_request(site, chromium, scheme, width):
    asked, said = [], []
    page = chromium.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    page.on("request", lambda r: asked.append(r.url) if r.url.startswith("http") else None)
    page.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    page.on("pageerror", lambda e: said.append(str(e)))
    # every page once; in the other shapes one of each sort
    every = [p.relative_to(site).as_posix() for p in sorted(site.rglob("*.html")) if p.name != "404.html"]
    some = ["index.html", "decks/lessons/04_motor.html", "reference/cards.html", "decks/hard/index.html"]
    for name in every if (width, scheme) == (390, "dark") else some:
        page.goto((site / name).as_uri())
        page.wait_for_load_state("load")
        # nothing is wider than the window but what scrolls by itself
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name
        if not name.startswith("runs/"):
            dark = page.evaluate("document.body.dataset.mdColorScheme === 'slate'")
            assert dark is (scheme == "dark"), name
    if width > 1000:
        page.click("input.md-search__input")
        page.wait_for_selector(".md-search-result__meta:has-text('Type to start')")
        page.keyboard.type("transducer")
        page.wait_for_selector(".md-search-result__item a[href*='reference/cards.html']", state="attached")
    page.close()
    assert (asked, said) == ([], [])
