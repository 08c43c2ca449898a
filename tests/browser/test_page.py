"""The page of a run in a real browser: it draws, it plays, the cursor moves the machine."""

from __future__ import annotations

import math
from array import array
from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.outputs import html
from emsim.reports import explained
from emsim.result import Result
from emsim.store import Columns
from emsim.table import Table

ROOT = Path(__file__).resolve().parents[2]

INKED = """(id) => { const c = document.getElementById(id), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
    let n = 0; for (let k = 3; k < d.length; k += 4) n += d[k] > 0; return n; }"""
PICTURE = "() => document.getElementById('machine').toDataURL()"


@pytest.fixture(scope="module")
def servo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    deck = ROOT / "netlists/coupled/pendulum_servo.cir"
    result = pipeline.run(str(deck), scene=True)
    path = tmp_path_factory.mktemp("page") / "servo.html"
    html.write(str(path), result, deck.read_text(), explained.sheets(pipeline.explain(str(deck))))
    return path, result


def set_clock(page: Any, t: float) -> None:
    page.evaluate("(t) => window.emsim.clock.set(t)", t)
    page.wait_for_timeout(60)


def test_page_is_small_and_alone(servo: tuple[Path, Result]) -> None:
    text = servo[0].read_text()
    assert len(text) < 215_000
    assert "src=" not in text.replace("img-src", "")
    assert "http-equiv" in text


def test_it_draws_machine_and_waves(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    assert page.title() == servo[1].title
    assert page.evaluate(INKED, "machine") > 2000
    assert page.evaluate("() => window.emsim.waves.panels.map((p) => p.unit)") == [
        "V",
        "A",
        "rad",
        "rad/s",
        "N m",
    ]
    canvases = page.evaluate(
        """() => [...document.querySelectorAll('#panels canvas')].map((c) => {
            const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
            let n = 0; for (let k = 3; k < d.length; k += 4) n += d[k] > 0; return n; })"""
    )
    assert len(canvases) == 5
    assert min(canvases) > 500


def test_columns_arrive_as_they_were(servo: tuple[Path, Result], visit: Any) -> None:
    page, result = visit(servo[0]), servo[1]
    time = page.evaluate("() => [...window.emsim.run.time]")
    assert time == list(result.main.floats("time"))
    angle = page.evaluate("() => [...window.emsim.run.columns.find((c) => c.name === 'angle(hinge)').values]")
    assert angle == list(array("f", result.main.floats("angle(hinge)")))


def test_cursor_over_a_wave_moves_the_machine(servo: tuple[Path, Result], visit: Any) -> None:
    page, result = visit(servo[0]), servo[1]
    before = page.evaluate(PICTURE)
    box = page.locator("#panels .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.16 * box["width"], box["y"] + 0.5 * box["height"])
    page.wait_for_timeout(100)
    t = page.evaluate("() => window.emsim.clock.t")
    assert 0.2 < t < 0.28
    assert page.evaluate(PICTURE) != before
    # the tip on the page is where the physics has it: angle(hinge) = 0 hangs straight down
    tip = page.evaluate(
        """() => { const { machine, clock } = window.emsim;
            return machine.world([1, 0.3, 0, 0], machine.scene.bodies.map((_, k) => machine.pose(k, clock.t))); }"""
    )
    angle = float(result.at("angle(hinge)", t)) - math.pi / 2
    assert tip[:2] == pytest.approx([0.3 * math.cos(angle), 0.3 * math.sin(angle)], abs=2e-4)


def test_play_pause_step_and_speed(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    page.keyboard.press(" ")
    page.wait_for_function("window.emsim.clock.t > 0.02")
    page.keyboard.press(" ")
    page.wait_for_timeout(80)
    t = page.evaluate("() => window.emsim.clock.t")
    page.wait_for_timeout(120)
    assert page.evaluate("() => window.emsim.clock.t") == t
    page.keyboard.press("ArrowRight")
    page.wait_for_timeout(60)
    assert page.evaluate("() => window.emsim.clock.t") == pytest.approx(t + 1.5 / 200, rel=1e-6)
    page.select_option("#speed", "1")
    page.click("#play")
    page.wait_for_function("!window.emsim.clock.playing", timeout=5000)
    assert page.evaluate("() => window.emsim.clock.t") == 1.5


def test_the_clock_moves_a_line_and_draws_no_curve(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    page.evaluate(
        """() => { window.drawn = 0;
            for (const p of window.emsim.waves.panels) p.plot.hooks.draw.push(() => window.drawn++); }"""
    )
    share = """() => { const { plot } = window.emsim.waves.panels[0], now = plot.over.querySelector('.now');
        const a = plot.over.getBoundingClientRect(), b = now.getBoundingClientRect();
        return now.hidden ? null : (b.left + b.width / 2 - a.left) / a.width; }"""
    set_clock(page, 0.6)
    assert page.evaluate(share) == pytest.approx(0.4, abs=0.003)
    assert page.evaluate("() => window.drawn") == 0
    page.evaluate("() => window.emsim.waves.zoom(0.5, 0.7)")
    assert page.evaluate(share) == pytest.approx(0.5, abs=0.003)
    set_clock(page, 1.2)
    assert page.evaluate(share) is None


def test_drag_zooms_and_double_click_shows_all(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    box = page.locator("#panels .u-over").first.bounding_box()
    y = box["y"] + 30
    page.mouse.move(box["x"] + 0.2 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.4 * box["width"], y, steps=5)
    page.mouse.up()
    assert page.evaluate("() => window.emsim.waves.range") == pytest.approx([0.3, 0.6], abs=0.01)
    page.mouse.dblclick(box["x"] + 50, y)
    assert page.evaluate("() => window.emsim.waves.range") == [0, 1.5]


def test_cursors_say_differences(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    set_clock(page, 0.1)
    page.keyboard.press("a")
    set_clock(page, 0.6)
    page.keyboard.press("b")
    said = page.text_content("#delta")
    assert "\u0394 500 ms" in said
    assert "1/\u0394 2 Hz" in said
    page.keyboard.press("Escape")
    assert page.text_content("#delta") == ""


def test_expressions_and_any_signal_as_axis(servo: tuple[Path, Result], visit: Any) -> None:
    page, result = visit(servo[0]), servo[1]
    page.fill("#expression", "v(set)-v(wip)*2^2")
    page.keyboard.press("Enter")
    values = page.evaluate("() => [...window.emsim.run.columns.at(-1).values]")
    expected = [
        s - 4 * w for s, w in zip(result.main.floats("v(set)"), result.main.floats("v(wip)"), strict=True)
    ]
    assert values == pytest.approx(expected, abs=1e-5)
    page.fill("#expression", "v(nowhere)")
    page.keyboard.press("Enter")
    assert "no signal v(nowhere)" in page.text_content("#sheet-signals")
    page.select_option("#xaxis", "angle(hinge)")
    assert page.locator("#panels canvas").count() >= 5


def test_expressions_write_numbers_as_spice_does_and_know_the_time(
    servo: tuple[Path, Result], visit: Any
) -> None:
    page = visit(servo[0])
    draw = """(text) => { document.getElementById('expression').value = text;
        document.querySelector('#sheet-signals form').requestSubmit(); }"""
    last = "() => { const c = window.emsim.run.columns.at(-1); return [c.name, c.values.at(-1)]; }"
    for text, value in [
        ("2k*time", 3000.0),
        ("3Meg", 3e6),
        ("1mil", 25.4e-6),
        (".5kOhm", 500.0),
        # powers and functions as in a deck's sources
        ("2^3^2", 64.0),
        ("-2^2", -4.0),
        ("2^-1", 0.5),
        ("(-2)^3", 8.0),
        ("pwr(-2,3)", -8.0),
        ("sqrt(-4)", 2.0),
        ("ln(-1)", 0.0),
        ("max(1,2*3,4)", 6.0),
        ("nint(2.5)", 2.0),
        ("limit(7,0,5)", 5.0),
        ("v(set,set)+atan2(0,1)", 0.0),
        ("2e-1m", 2e-4),
    ]:
        page.evaluate(draw, text)
        assert page.evaluate(last) == [text, pytest.approx(value)]
    page.evaluate(draw, "1.2.3")
    assert page.evaluate(last)[0] == "2e-1m"


def test_an_expression_that_is_a_signal_shows_that_signal(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    count = "() => [...document.querySelectorAll('.chip')].filter((c) => c.textContent === 'v(drive)').map((c) => c.ariaPressed)"
    assert page.evaluate(count) == ["false"]
    page.fill("#expression", "v(drive)")
    page.keyboard.press("Enter")
    assert page.evaluate(count) == ["true"]


def test_keys_of_the_help_are_its_own(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0])
    is_open = "() => document.getElementById('keys').open"
    page.keyboard.press("a")
    page.keyboard.press("?")
    assert page.evaluate(is_open)
    page.keyboard.press("Escape")
    page.wait_for_function("() => !document.getElementById('keys').open")
    assert page.evaluate("() => window.emsim.waves.marks.a") is not None
    page.keyboard.press("Escape")
    assert page.evaluate("() => window.emsim.waves.marks.a") is None


def test_space_presses_the_button_that_has_the_focus(servo: tuple[Path, Result], visit: Any) -> None:
    """It set the clock running instead: nobody could choose a signal by keys."""
    page = visit(servo[0])
    chip = page.locator("button.chip[aria-pressed]").first
    before = chip.get_attribute("aria-pressed")
    chip.focus()
    page.keyboard.press("Space")
    assert chip.get_attribute("aria-pressed") != before
    assert not page.evaluate("() => window.emsim.clock.playing")


def test_the_key_for_the_whole_machine_without_a_machine(tmp_path: Path, visit: Any) -> None:
    path, deck = tmp_path / "rc.html", "rc\nV1 a 0 SIN(0 1 1k)\nR1 a b 1k\nC1 b 0 1u\n.tran 10u 1m\n"
    html.write(str(path), pipeline.run(deck), deck)
    page = visit(path)
    page.keyboard.press("f")
    page.wait_for_timeout(50)


def test_dark_phone_and_keyboard_only(servo: tuple[Path, Result], visit: Any) -> None:
    page = visit(servo[0], 390, 800, "dark")
    assert page.evaluate("() => document.documentElement.classList.contains('dark')")
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    assert page.evaluate("() => document.getElementById('machine').getBoundingClientRect().width") > 300
    page.keyboard.press("?")
    assert page.evaluate("() => document.getElementById('keys').open")


@pytest.mark.parametrize(("width", "scheme"), [(1300, "light"), (390, "dark")])
def test_equations_are_set_in_type(servo: tuple[Path, Result], visit: Any, width: int, scheme: str) -> None:
    page = visit(servo[0], width, 900, scheme)
    page.click("button[data-sheet=equations]")
    page.wait_for_selector("#sheet-equations math")
    said = page.inner_text("#sheet-equations")
    assert "weight of arm" in said and "1 degree of freedom" in said and "Index 1" in said
    # drawn as mathematics: a fraction's parts stand one above the other
    above, below = (
        page.locator("#sheet-equations mfrac").first.locator(f":scope > :nth-child({k})").bounding_box()
        for k in (1, 2)
    )
    assert above["y"] + above["height"] <= below["y"] + 4
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width


def test_a_million_points_keep_their_extremes(tmp_path: Path, visit: Any) -> None:
    rows = 1_000_000
    time = array("d", (1e-6 * k for k in range(rows)))
    wave = array("d", (math.sin(0.01 * k) for k in range(rows)))
    wave[654_321] = 9.0  # one sample only
    table = Table("tran", ["time", "v(a)"], ["s", "V"], Columns([time, wave]))
    path = tmp_path / "long.html"
    html.write(str(path), Result("long", [table]))
    page = visit(path)
    drawn = page.evaluate(
        "() => { const d = window.emsim.waves.panels[0].plot.data; return [d[0].length, Math.max(...d[1])]; }"
    )
    assert drawn[0] < 6000
    assert drawn[1] == 9.0
    page.evaluate("() => window.emsim.waves.zoom(0.654, 0.655)")
    assert page.evaluate("() => Math.max(...window.emsim.waves.panels[0].plot.data[1])") == 9.0


def test_failed_runs_say_so(tmp_path: Path, visit: Any) -> None:
    table = Table(
        "tran", ["time", "v(a)"], ["s", "V"], Columns([[0.0, 1.0, 2.0], [0.0, 1.0, 4.0]]), status="failed"
    )
    path = tmp_path / "failed.html"
    html.write(str(path), Result("a </script> title", [table]), "a </script> title\nR1 a 0 1\n")
    page = visit(path)
    assert page.title() == "a </script> title"
    assert "failed" in page.text_content("#error")
