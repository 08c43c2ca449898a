"""The live page in a real browser: a deck is edited while its page is open.

The page's own policy is in force here, so nothing is evaluated in it but by the debugger; what is waited for are
conditions, not times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any

import pytest

from emsim.live.server import Server
from emsim.live.session import Session

DECK = """Swinging arm
.param len=0.3 m=200m
.param twice={2*len}
.gravity 9.81
BODY  arm   shape=rod({len}) m={m}
JOINT hinge 0 arm pin zero=-90deg ic=40deg
.tran 1m 2
.print tran angle(hinge) omega(hinge)
.end
"""
ENDLESS = DECK.replace(".tran 1m 2", ".tran 1u 1e6 999999 1u")
PATIENCE = 60.0  # seconds after which a condition is taken not to come


@pytest.fixture
def edited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, str, Session]]:
    """Without the playground's editor, whose parts need not be there; with it: test_live_editor.py."""
    monkeypatch.setattr("emsim.live.server.EDITOR", str(tmp_path / "none.js"))
    deck = tmp_path / "arm.cir"
    deck.write_text(DECK)
    session = Session(str(deck))
    server = Server(session.board, session.ask, edit=session.edit)
    Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True).start()
    loop = Thread(target=session.serve, daemon=True)
    loop.start()
    yield deck, server.url, session
    session.stop()
    loop.join(PATIENCE)
    server.shutdown()
    server.server_close()


@pytest.fixture
def watch(chromium: Any) -> Iterator[Callable[..., Any]]:
    """watch(url) opens the live page; at the end nothing may have been said on the console, no policy broken and nobody
    else asked for anything."""
    said: list[str] = []
    contexts = []

    def open_page(url: str, width: int = 1400, height: int = 900, scheme: str = "light") -> Any:
        context = chromium.new_context(
            viewport={"width": width, "height": height}, color_scheme=scheme, reduced_motion="reduce"
        )
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(1000 * PATIENCE)
        origin = url.partition("#")[0]
        page.on("console", lambda m: said.append(m.text))
        page.on("pageerror", lambda e: said.append(str(e)))
        page.on(
            "request", lambda r: None if r.url.startswith((origin, "data:", "blob:")) else said.append(r.url)
        )
        page.goto(url)
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert said == []


def until(page: Any, condition: str, argument: Any = None) -> Any:
    """The value of an expression as soon as it is true."""
    end = monotonic() + PATIENCE
    while not (found := page.evaluate(condition, argument)):
        assert monotonic() < end, condition
        sleep(0.02)
    return found


def tip(page: Any) -> float:
    """How far the arm reaches, as the page draws it [m]."""
    return page.evaluate("() => window.emsim.machine.scene.shapes.find((s) => s.kind === 'rod').sizes[0]")


SHOWN = "() => window.emsim && window.emsim.waves.panels.length && document.querySelector('#live.ok') && 1"
ARM = """(length) => { const e = window.emsim, rod = e && e.machine && e.machine.scene.shapes.find((s) => s.kind === 'rod');
    return rod && Math.abs(rod.sizes[0] - length) < 1e-9 && document.querySelector('#live.ok') && 1; }"""
DRAG = "(e, share) => { e.value = +e.min + share * (e.max - e.min); e.dispatchEvent(new Event('input')); }"


def test_a_saved_deck_moves_anew_and_the_page_stays_as_it_was(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    assert page.title() == "Swinging arm"
    # the first run is drawn for the page's width
    assert page.evaluate("() => window.emsim.waves.width()") > 600
    assert page.evaluate("() => window.emsim.waves.drawn") == page.evaluate(
        "() => window.emsim.waves.width()"
    )
    picture = page.evaluate("() => document.getElementById('machine').toDataURL()")
    # what a reader has set up
    page.evaluate(
        "() => { const e = window.emsim; e.waves.zoom(0.5, 1); e.waves.mark('a', 0.6); e.clock.set(0.75); }"
    )
    page.locator("#degrees").check()
    page.locator(".chip", has_text="omega(hinge)").click()
    page.locator("#expression").fill("2*angle(hinge)")
    page.locator("#expression").press("Enter")
    page.select_option("#trace", index=1)
    page.locator("#tabs [data-sheet=deck]").click()
    page.select_option("#speed", "0.1")
    deck.write_text(DECK.replace("len=0.3", "len=0.2"))
    until(page, ARM, 0.2)
    kept = page.evaluate(
        """() => { const { waves, clock, machine } = window.emsim;
            return { range: waves.range, mark: waves.marks.a, time: clock.t, degrees: waves.degrees, shown: [...waves.shown],
                speed: clock.speed, traced: machine.trace !== null,
                sheet: document.querySelector('#tabs [aria-selected=true]').dataset.sheet }; }"""
    )
    assert kept == {
        "range": [0.5, 1], "mark": 0.6, "time": 0.75, "degrees": True, "shown": ["angle(hinge)", "2*angle(hinge)"],
        "speed": 0.1, "traced": True, "sheet": "deck",
    }  # fmt: skip
    assert "len=0.2" in page.text_content("#sheet-deck")
    page.evaluate("() => window.emsim.clock.set(0)")
    until(page, "(before) => document.getElementById('machine').toDataURL() !== before", picture)
    # it goes on playing through a new run
    page.locator("#play").click()
    deck.write_text(DECK)
    until(page, ARM, 0.3)
    assert page.evaluate("() => window.emsim.clock.playing")


def test_print_cards_choose_signals_anew(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    deck.write_text(
        DECK.replace(".print tran angle(hinge) omega(hinge)", ".print tran angle(hinge) energy()")
    )
    until(page, "() => String([...window.emsim.waves.shown]) === 'angle(hinge),energy()'")


def test_a_mistake_appears_at_its_line_and_goes_with_the_fix(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    assert page.locator("#said").is_hidden()
    deck.write_text(DECK.replace("m={m}", "m={mm}"))
    page.locator("#said pre").wait_for()
    said = page.text_content("#said pre")
    assert "arm.cir:5:" in said and "^^" in said and "help: did you mean `m`?" in said
    assert "line 5" in page.text_content("#live")
    assert page.evaluate("() => getComputedStyle(document.querySelector('main')).filter") == "grayscale(1)"
    # the last good run is still there
    assert page.evaluate("() => window.emsim.waves.panels.length") == 2
    page.get_by_role("button", name="show the line").click()
    line = page.locator("#sheet-deck .bad")
    assert line.text_content() == DECK.splitlines()[4].replace("m={m}", "m={mm}")
    assert line.is_visible()
    assert "mm" in page.text_content("#sheet-deck .bad + em")
    deck.write_text(DECK)
    page.locator("#said").wait_for(state="hidden")
    assert page.evaluate("() => getComputedStyle(document.querySelector('main')).filter") == "none"
    assert page.locator("#sheet-deck .bad").count() == 0


def test_a_page_that_begins_with_a_mistake(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    deck.write_text("nothing good\nR1 a\n.end\n")
    page = watch(url)
    page.locator("#said pre").wait_for()
    assert page.locator("main").is_hidden()
    page.get_by_role("button", name="show the line").click()
    assert page.locator("#sheet-deck .bad").is_visible()
    deck.write_text(DECK)
    until(page, SHOWN)
    assert page.locator("main").is_visible()


def test_a_slider_changes_the_run(edited: Any, watch: Any) -> None:
    _, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    rows = page.locator("#params .knob")
    assert rows.locator("label").all_text_contents() == ["len", "m"]
    assert page.locator(".computed").text_content() == "twice = 2*len = 0.6"
    slider, field = rows.nth(0).locator("input[type=range]"), rows.nth(0).locator("input[type=text]")
    ends = slider.evaluate("(e) => [+e.min, +e.max, +e.value]")
    assert ends == [0, 0.6, 0.3]
    slider.evaluate(DRAG, 0.75)
    until(page, ARM, 0.45)
    assert field.input_value() == "0.45"
    assert page.locator(".computed").text_content() == "twice = 2*len = 0.9"
    # what to write in the deck, at its place
    assert page.locator("#written code").text_content() == ".param len=0.45 m=200m"
    assert page.locator("#written mark").text_content() == "0.45"
    # a scale suffix stays where the deck has one
    rows.nth(1).locator("input[type=range]").evaluate(DRAG, 0.25)
    until(page, "() => document.querySelector('#written code')?.textContent === '.param len=0.45 m=100m'")
    # text with a unit behind it, beyond the slider's end
    field.fill("1200mmeter")
    field.press("Enter")
    until(page, ARM, 1.2)
    assert slider.evaluate("(e) => [+e.max, +e.value]") == [1.2, 1.2]
    # what cannot be is said, and the field stays
    field.fill("2*")
    field.press("Enter")
    page.locator("#said pre").wait_for()
    assert "-D len" in page.text_content("#said pre")
    assert field.input_value() == "2*"
    # back to the deck's own
    rows.nth(0).locator("button").click()
    until(page, ARM, 0.3)
    assert field.input_value() == "0.3"
    assert page.locator("#written code").text_content() == ".param len=0.3 m=100m"
    page.locator("#written button", has_text="reset all").click()
    until(page, "() => !document.querySelector('#written code')")


def test_equations_follow_the_slider(edited: Any, watch: Any) -> None:
    _, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    tab, sheet = page.locator("#tabs [data-sheet=equations]"), page.locator("#sheet-equations")
    tab.click()
    page.locator("#sheet-equations math").first.wait_for()
    # m g l / 2 of a rod of 0.3 m
    assert "0.2943" in sheet.text_content()
    page.locator("#params .knob input[type=range]").first.evaluate(DRAG, 0.75)
    until(page, "() => document.getElementById('sheet-equations').textContent.includes('0.44145')")
    assert tab.get_attribute("aria-selected") == "true"
    assert "before" not in sheet.get_attribute("class")


def test_a_slider_that_is_dragged_ends_where_it_was_left(edited: Any, watch: Any) -> None:
    _, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    slider = page.locator("#params .knob input[type=range]").first
    # a busy page follows the pointer later: it has let go when it says so
    slider.evaluate("(e) => e.addEventListener('change', () => { window.left = +e.value; })")
    box = slider.bounding_box()
    y = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + box["width"] / 2, y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.9 * box["width"], y, steps=60)
    page.mouse.up()
    assert until(page, "() => window.left") > 0.5
    wanted = float(page.locator("#params .knob input[type=text]").first.input_value())
    until(page, ARM, wanted)


def test_an_operating_point_is_a_table(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    deck.write_text("divider\n.param r=1k\nV1 a 0 10\nR1 a b {r}\nR2 b 0 1k\n.op\n.end\n")
    cells = (
        "() => [...document.querySelectorAll('#sheet-signals td')].map((c) => c.textContent).join(' ') === "
    )
    until(page, cells + "'v(a) 10 V v(b) 5 V i(v1) -5 mA'")
    assert page.locator("#waves").is_hidden() and page.locator("#transport").is_hidden()
    assert page.locator("#circuit").is_visible()
    page.locator("#params .knob input[type=text]").fill("4k")
    page.locator("#params .knob input[type=text]").press("Enter")
    until(page, cells + "'v(a) 10 V v(b) 2 V i(v1) -2 mA'")
    deck.write_text(DECK)
    until(page, SHOWN)
    assert page.locator("#waves").is_visible() and page.locator("#transport").is_visible()


def test_a_run_that_stops_is_shown_with_its_reason_and_its_parameters(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    # v(b)^2 + v(b) + v(a) = 0 has no real solution once v(a) is above 1/4
    deck.write_text(
        "stuck\n.param up=1\nV1 a 0 PULSE(0 {up} 1m 1m 1m 1 2)\nR1 a 0 1\nB1 b 0 I={v(a)+v(b)*v(b)}\nR2 b 0 1\n"
        ".tran 10u 5m\n.end\n"
    )
    page.locator("#said pre").wait_for()
    assert "E410" in page.text_content("#said pre")
    assert page.title() == "stuck"
    assert page.evaluate("() => getComputedStyle(document.querySelector('main')).filter") == "none"
    assert page.locator("#params .knob label").all_text_contents() == ["up"]
    page.locator("#params .knob input[type=text]").fill("0.2")
    page.locator("#params .knob input[type=text]").press("Enter")
    page.locator("#said").wait_for(state="hidden")
    assert page.evaluate("() => window.emsim.clock.last") == 5e-3


def test_two_pages_show_the_same(edited: Any, watch: Any) -> None:
    _, url, _ = edited
    one, two = watch(url), watch(url, 390, 800, "dark")
    until(one, SHOWN)
    until(two, SHOWN)
    one.locator("#params .knob input[type=range]").first.evaluate(DRAG, 0.75)
    until(one, ARM, 0.45)
    until(two, ARM, 0.45)
    until(two, "() => document.querySelector('#params .knob input[type=text]').value === '0.45'")
    assert two.evaluate("() => document.documentElement.scrollWidth") <= 390


def test_a_long_run_shows_how_far_it_is_and_is_ended(edited: Any, watch: Any) -> None:
    deck, url, session = edited
    page = watch(url)
    until(page, SHOWN)
    deck.write_text(ENDLESS)
    until(
        page,
        "() => document.body.classList.contains('busy') && parseFloat(document.getElementById('share').style.width) > 0",
    )
    # the run before is still on the page, and can be played
    assert page.locator("main").is_visible()
    deck.write_text(DECK.replace("len=0.3", "len=0.25"))
    until(page, ARM, 0.25)
    assert not page.evaluate("() => document.body.classList.contains('busy')")
    assert not session.runs.busy


def test_a_page_outlives_the_program(edited: Any, chromium: Any) -> None:
    """Here the browser itself complains on the console that nobody answers."""
    _, url, session = edited
    page = chromium.new_page()
    page.goto(url)
    until(page, SHOWN)
    session.stop()
    until(page, "() => document.querySelector('#live.lost') && 1")
    assert "has ended" in page.text_content("#live")
    assert page.locator("#machine").is_visible()
    page.close()


def test_without_its_token_the_page_says_what_to_do(edited: Any, watch: Any, chromium: Any) -> None:
    _, url, _ = edited
    page = watch(url.partition("#")[0])
    until(page, "() => document.querySelector('#live.lost') && 1")
    assert "open the address that emsim printed" in page.text_content("#live")
    other = chromium.new_page()
    other.goto(url.partition("#")[0] + "#of-another-run")
    until(other, "() => document.querySelector('#live.lost') && 1")
    assert "ended" in other.text_content("#live")
    other.close()


def test_pages_of_other_origins_learn_nothing(edited: Any, chromium: Any) -> None:
    _, url, session = edited
    origin, _, token = url.partition("#")
    page = chromium.new_page()
    page.goto("data:text/html,<title>elsewhere</title>")
    tried = page.evaluate(
        """async ([origin, token]) => {
            const body = '{"set":{"m":"1"},"number":1}', own = { "X-Emsim-Token": token };
            const tries = [["events", {}], ["events", { headers: own }], ["", {}], ["set", { method: "POST", body }],
                ["set", { method: "POST", body, headers: { ...own, "Content-Type": "application/json" } }]];
            return Promise.all(tries.map(([path, given]) => fetch(origin + path, given).then((r) => r.status, () => "refused")));
        }""",
        [origin, token],
    )
    assert tried == ["refused"] * 5
    assert session._set == {}
    page.close()


def test_numbers_of_cards_are_sliders(edited: Any, watch: Any) -> None:
    """Only .param were: a deck without one had nothing to move."""
    deck, url, _ = edited
    deck.write_text(
        DECK.replace(".param len=0.3 m=200m\n.param twice={2*len}\n", "")
        .replace("{len}", "0.3")
        .replace("{m}", "200m")
    )
    page = watch(url)
    until(page, SHOWN)
    page.get_by_role("button", name="Values").click()
    until(
        page,
        "() => [...document.querySelectorAll('.knob label')].some((e) => e.textContent === 'arm m' && e.offsetParent)",
    )
    field = page.get_by_label("hinge ic, as text")
    field.fill("80deg")
    field.press("Enter")
    until(
        page,
        "() => Math.abs(window.emsim.run.columns.find((c) => c.name === 'angle(hinge)').values[0] - 80 * Math.PI / 180) < 1e-6",
    )
    assert "ic=40deg" in deck.read_text()
    assert "ic=80deg" in page.inner_text("#written")


def test_earlier_runs_stay_below_the_curves(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    page.check("#family")
    until(page, ARM, 0.3)
    for length in (0.2, 0.4):
        deck.write_text(DECK.replace("len=0.3", f"len={length}"))
        until(page, ARM, length)
    ghosts = "() => window.emsim.waves.ghosts.map((g) => g.columns.get('omega(hinge)').reduce((m, v) => Math.max(m, v), 0))"
    first, second = page.evaluate(ghosts)
    assert first < second  # the shorter arm swings faster
    high = page.evaluate("() => window.emsim.waves.panels.at(-1).plot.scales.y.max")
    assert high > second  # the scale holds them too
    page.uncheck("#family")
    assert page.evaluate(ghosts) == []


def test_the_deck_is_edited_in_its_page(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    page.locator("#tabs [data-sheet=deck]").click()
    page.get_by_role("button", name="edit", exact=True).click()
    text = page.get_by_label("the deck's text")
    assert text.input_value() == DECK
    text.fill(DECK.replace("len=0.3", "len=0.25"))
    text.press("Control+s")
    until(page, ARM, 0.25)
    assert deck.read_text() == DECK.replace("len=0.3", "len=0.25")
    # the text keeps the keys while runs come, and what is wrong stands at its line
    assert page.evaluate("() => document.activeElement.id") == "deck-text"
    text.fill(DECK.replace("len=0.3", "len=0.25 bad"))
    text.press("Control+s")
    until(page, "() => document.querySelector('#live.wrong') && document.querySelector('.deck em') && 1")
    # changed elsewhere meanwhile: nothing is lost
    deck.write_text(DECK.replace("len=0.3", "len=0.31"))
    until(page, ARM, 0.31)
    text.fill(DECK.replace("len=0.3", "len=0.22"))
    text.press("Control+s")
    until(page, "() => document.getElementById('desk').textContent.includes('changed')")
    assert "len=0.31" in deck.read_text()


def test_a_button_mends_what_the_message_is_about(edited: Any, watch: Any) -> None:
    deck, url, _ = edited
    page = watch(url)
    until(page, SHOWN)
    deck.write_text(DECK.replace("m={m}", "m={mm}"))
    page.locator("#said .mend").first.wait_for()
    page.locator("#said .mend").first.click()
    text = page.get_by_label("the deck's text")
    assert text.input_value() == DECK
    text.press("Control+s")
    page.locator("#said").wait_for(state="hidden")
    assert deck.read_text() == DECK
