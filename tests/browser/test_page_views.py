"""How the page is looked at: wheel and fingers, zoom, cursors, files, links, themes, keys, and machines that were drawn wrong."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import emsim
from emsim import pipeline
from emsim.outputs import html
from emsim.result import Result

ROOT = Path(__file__).resolve().parents[2]
NOW = "() => ({ range: window.emsim.waves.range, t: window.emsim.clock.t, y: window.scrollY })"
SERVO = ROOT / "netlists/coupled/pendulum_servo.cir"


@pytest.fixture(scope="module")
def servo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "servo.html"
    html.write(str(path), pipeline.run(str(SERVO), scene=True), SERVO.read_text())
    return path


@pytest.fixture
def page_of(tmp_path: Path, visit: Any) -> Callable[..., Any]:
    def show(result: Result, **view: Any) -> Any:
        path = tmp_path / "page.html"
        html.write(str(path), result)
        return visit(path, **view)

    return show


def machine_of(deck: str, page_of: Any) -> Any:
    return page_of(pipeline.run(str(ROOT / "netlists" / f"{deck}.cir"), scene=True))


def settle(page: Any) -> None:
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


def fingers(page: Any) -> Callable[..., None]:
    """touch(kind, places): the browser's own touch events."""
    session = page.context.new_cdp_session(page)

    def touch(kind: str, *places: tuple[float, float]) -> None:
        points = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(places)]
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    return touch


# ---- wheel and fingers --------------------------------------------------------------------------


@pytest.mark.parametrize("over", ["#machine", "#panels .u-over"])
def test_the_wheel_scrolls_the_page_and_zooms_with_ctrl(servo: Path, visit: Any, over: str) -> None:
    """It zoomed, and a page could not be scrolled past its machine."""
    page = visit(servo, 1300, 500)
    box = page.locator(over).first.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 60)
    state = "() => [window.emsim.machine.scale, window.emsim.waves.range]"
    before = page.evaluate(state)
    page.mouse.wheel(0, 200)
    page.wait_for_function("() => window.scrollY > 100")
    assert page.evaluate(state) == before
    page.evaluate("() => scrollTo(0, 0)")
    page.wait_for_function("() => window.scrollY === 0")
    page.keyboard.down("Control")
    page.mouse.wheel(0, -120)
    page.keyboard.up("Control")
    page.wait_for_function(f"(b) => JSON.stringify(({state})()) !== JSON.stringify(b)", arg=before)
    assert page.evaluate("() => window.scrollY") == 0


def test_a_swipe_over_the_machine_scrolls_and_two_fingers_zoom(servo: Path, chromium: Any) -> None:
    context = chromium.new_context(viewport={"width": 390, "height": 800}, has_touch=True, bypass_csp=True)
    page = context.new_page()
    page.goto(servo.as_uri())
    page.wait_for_function("window.emsim && window.emsim.waves.panels.length > 0")
    touch = fingers(page)

    def middle() -> tuple[float, float]:
        page.evaluate("() => document.getElementById('machine').scrollIntoView({ block: 'center' })")
        settle(page)
        box = page.locator("#machine").bounding_box()
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    x, y = middle()
    start = page.evaluate("() => window.scrollY")
    view = "() => [window.emsim.machine.middle, window.emsim.machine.scale]"
    before = page.evaluate(view)
    touch("touchStart", (x, y))
    for k in range(1, 9):
        touch("touchMove", (x, y - 20 * k))
    touch("touchEnd")
    page.wait_for_function("(start) => window.scrollY > start + 50", arg=start)
    assert page.evaluate(view) == before
    x, y = middle()
    # two fingers that part
    touch("touchStart", (x - 30, y), (x + 30, y))
    for k in range(1, 5):
        touch("touchMove", (x - 30 - 10 * k, y), (x + 30 + 10 * k, y))
    touch("touchEnd")
    assert page.evaluate("() => window.emsim.machine.scale") > 1.5 * before[1]
    # on the curves: one finger moves the clock, two zoom
    page.locator("#panels .u-over").first.scroll_into_view_if_needed()
    box = page.locator("#panels .u-over").first.bounding_box()
    y = box["y"] + 40
    touch("touchStart", (box["x"] + 40, y))
    for k in range(1, 9):
        touch("touchMove", (box["x"] + 40 + 12 * k, y))
    touch("touchEnd")
    page.wait_for_function("() => window.emsim.clock.t > 0.3")
    touch("touchStart", (box["x"] + 100, y), (box["x"] + 150, y))
    for k in range(1, 5):
        touch("touchMove", (box["x"] + 100 - 8 * k, y), (box["x"] + 150 + 8 * k, y))
    touch("touchEnd")
    first, last = page.evaluate("() => window.emsim.waves.range")
    assert last - first < 1.0
    # both cursors, and the speed, are within reach
    page.tap("#mark-a")
    page.evaluate("() => window.emsim.clock.set(1.0)")
    settle(page)
    page.tap("#mark-b")
    assert re.search(r"A \d.*B 1 s", page.text_content("#delta"))
    assert page.locator("#speed").is_visible()
    assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
    context.close()


# ---- zoom, scales, cursors ----------------------------------------------------------------------


def test_a_box_zooms_both_axes_and_double_click_shows_all(servo: Path, visit: Any) -> None:
    page = visit(servo)
    box = page.locator("#panels .u-over").first.bounding_box()
    page.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 0.2 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 0.6 * box["height"], steps=5)
    page.mouse.up()
    scale = "() => { const s = window.emsim.waves.panels[0].plot.scales.y; return [s.min, s.max]; }"
    settle(page)
    low, high = page.evaluate(scale)
    assert page.evaluate("() => window.emsim.waves.range") == pytest.approx([0.3, 0.6], abs=0.01)
    assert 0.5 < low < 0.8 and 1.2 < high < 1.6
    page.mouse.dblclick(box["x"] + 50, box["y"] + 50)
    settle(page)
    assert page.evaluate("() => window.emsim.waves.range") == [0, 1.5]
    assert page.evaluate(scale)[0] < 0


def test_two_units_share_a_panel_and_a_panel_may_be_one_signal(servo: Path, visit: Any) -> None:
    page = visit(servo)
    units = "() => window.emsim.waves.panels.map((p) => p.units)"
    page.select_option("#layout", "two")
    assert page.evaluate(units) == [["V", "A"], ["rad", "rad/s"], ["N m"]]
    scales = page.evaluate("() => Object.keys(window.emsim.waves.panels[0].plot.scales)")
    assert scales == ["x", "y", "y1"]
    page.select_option("#layout", "signal")
    assert page.evaluate("() => window.emsim.waves.panels.map((p) => p.columns.length)") == [1] * 6


def test_logarithmic_scales(page_of: Any) -> None:
    page = page_of(
        emsim.run("t\nV1 a 0 1\nR1 a b 1k\nC1 b 0 1u ic=0\n.tran 10u 10m uic\n.print tran i(v1) v(b)\n")
    )
    page.check("#logx")
    for button in page.locator(".log").all():
        button.click()
    x, y = page.evaluate(
        """() => ['x', 'y'].map((k) => window.emsim.waves.panels.at(-1).plot.scales[k]).map((s) => [s.distr, s.min, s.max])"""
    )
    assert x[0] == y[0] == 3 and 0 < x[1] < 1e-4 and y[1] > 0


def test_cursors_tell_values_means_periods_peaks_and_crossings(page_of: Any) -> None:
    page = page_of(emsim.run("t\nV1 a 0 SIN(1 2 50)\nR1 a 0 1\n.tran 10u 0.1\n.print tran v(a)\n"))
    page.evaluate("() => { const { waves } = window.emsim; waves.mark('a', 0.02); waves.mark('b', 0.08); }")
    assert "A 1 V" in page.inner_text(".legend") and "B 1 V" in page.inner_text(".legend")
    page.click("[data-sheet=cursors]")
    cells = page.eval_on_selector_all(
        "#sheet-cursors tbody tr:first-child td", "(all) => all.map((e) => e.textContent)"
    )
    a, b, difference, mean, rms, low, high, span, period, frequency = cells
    assert (a, b, low, high, span) == ("1 V", "1 V", "-1 V", "3 V", "4 V") and difference == "0 V"
    assert mean == "1 V" and rms == "1.732 V"  # sqrt(1 + 2)
    assert period == "20 ms" and frequency == "50 Hz"
    said = page.inner_text("#sheet-cursors .signals")
    assert "peaks: 3" in said and "3 V at 25 ms" in said
    page.fill("#level", "2")
    page.keyboard.press("Enter")
    said = page.inner_text("#sheet-cursors .signals")
    assert "passes 2 V: 6" in said and "\u2191 21.66" in said  # 20 ms + asin(1/2)/(100 pi)
    page.click("#sheet-cursors .chip >> nth=0")
    settle(page)
    assert page.evaluate("() => window.emsim.clock.t") == pytest.approx(0.025, abs=2e-5)


def test_nyquist_plots_keep_circles_round(page_of: Any) -> None:
    page = page_of(
        emsim.run("t\nV1 a 0 ac 1\nR1 a b 1k\nC1 b 0 1u\n.ac dec 50 1 100k\n.print ac v(b)\n.end\n")
    )
    page.select_option("#xaxis", label="Nyquist")
    p = "window.emsim.waves.panels[0]"
    assert page.evaluate(f"() => {p}.columns.map((c) => [c.name, c.over.name])") == [["im(v(b))", "re(v(b))"]]
    found = page.evaluate(
        """() => { const c = document.querySelector('#panels canvas');
            const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data, blue = [11, 98, 196];
            let x0 = 1e9, x1 = 0, y0 = 1e9, y1 = 0;
            for (let k = 0; k < d.length; k += 4) if (d[k + 3] > 200 && blue.every((v, i) => Math.abs(d[k + i] - v) < 25)) {
                const p = k / 4, x = p % c.width, y = (p - x) / c.width;
                x0 = Math.min(x0, x); x1 = Math.max(x1, x); y0 = Math.min(y0, y); y1 = Math.max(y1, y); }
            return [x1 - x0, y1 - y0]; }"""
    )
    # the half circle from 1 to 0: twice as wide as high, but for the clock's dot
    assert found[0] == pytest.approx(2 * found[1], rel=0.08)


# ---- files, links -------------------------------------------------------------------------------


def test_what_is_drawn_is_saved_as_csv_svg_and_png(servo: Path, visit: Any) -> None:
    page = visit(servo)
    page.evaluate("() => window.emsim.waves.zoom(0.5, 1)")
    rows = list(
        csv.reader(io.StringIO(page.evaluate("() => rowsAsCsv(window.emsim.run, window.emsim.waves)")))
    )
    assert rows[0][:3] == ["time [s]", "v(wip) [V]", "v(set) [V]"]
    assert float(rows[1][0]) == pytest.approx(0.5, abs=2e-3) and float(rows[-1][0]) <= 1.0
    assert float(rows[1][2]) == 1.5
    svg = page.evaluate("() => curvesAsSvg(window.emsim.run, window.emsim.waves)")
    assert svg.count("<path") == 6 and "v(wip)" in svg and "500 ms" in svg
    kind = "(s) => new DOMParser().parseFromString(s, 'image/svg+xml').documentElement.nodeName"
    assert page.evaluate(kind, svg) == "svg"
    with page.expect_download() as download:
        page.click("[data-save=png]")
    assert Path(download.value.path()).read_bytes()[:4] == b"\x89PNG"
    with page.expect_download() as download:
        page.click("[data-save=csv]")
    assert download.value.suggested_filename.endswith(".csv")


def test_a_link_shows_what_its_sender_saw(servo: Path, visit: Any) -> None:
    page = visit(servo)
    page.evaluate(
        """() => { const { waves } = window.emsim;
            waves.zoom(0.2, 0.7); waves.mark('a', 0.3); waves.layout = 'signal';
            waves.shown = new Set(['v(wip)']); waves.build(); }"""
    )
    page.fill("#expression", "v(wip)/v(set)")
    page.keyboard.press("Enter")
    page.wait_for_function("() => location.hash.includes('v%28set%29')")
    link = page.evaluate("() => location.href")
    other = visit(link)
    kept = "() => { const { waves } = window.emsim; return [waves.range, waves.marks, waves.layout, [...waves.shown]]; }"
    assert other.evaluate(kept) == page.evaluate(kept) == [
        [0.2, 0.7], {"a": 0.3, "b": None}, "signal", ["v(wip)", "v(wip)/v(set)"],
    ]  # fmt: skip


# ---- who cannot see or point --------------------------------------------------------------------


def luminance(colour: str) -> float:
    parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    r, g, b = (v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in parts)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_curves_and_words_stand_out_from_the_page(servo: Path, visit: Any, scheme: str) -> None:
    """In the dark theme the curves had the light theme's colours, 3:1."""
    page = visit(servo, scheme=scheme)
    colours, named = page.evaluate(
        """() => { const s = getComputedStyle(document.documentElement), of = (n) => s.getPropertyValue('--' + n).trim();
            const names = ['back', 'panel', 'ink', 'soft', 'accent', 'force', 'coil', 'wiper', 'ground', 'motor'];
            return [COLOURS.map((_, k) => colourOf(k)), Object.fromEntries(names.map((n) => [n, of(n)]))]; }"""
    )
    behind = [luminance(named.pop("back")), luminance(named.pop("panel"))]
    for colour in [*colours, *named.values()]:
        for back in behind:
            low, high = sorted([luminance(colour), back])
            assert (high + 0.05) / (low + 0.05) >= 4.5, colour


def test_canvases_have_names_and_tabs_take_arrow_keys(servo: Path, visit: Any) -> None:
    page = visit(servo)
    unnamed = (
        "(c) => c.filter((c) => c.getAttribute('role') !== 'img' || !c.ariaLabel).map((c) => c.outerHTML)"
    )
    assert page.eval_on_selector_all("canvas", unnamed) == []
    assert page.locator("#panels canvas").first.get_attribute("aria-label") == "v(wip), v(set) over time"
    page.focus("#tabs [aria-selected=true]")
    t = page.evaluate(NOW)["t"]
    page.keyboard.press("ArrowRight")
    chosen = (
        "() => { const e = document.activeElement; return [e.dataset.sheet, e.ariaSelected, e.tabIndex]; }"
    )
    assert page.evaluate(chosen) == ["cursors", "true", 0]
    page.keyboard.press("End")
    assert page.evaluate(chosen)[0] == "deck"
    assert page.locator("#sheet-deck").is_visible()
    assert page.evaluate(NOW)["t"] == t
    assert page.evaluate("() => document.querySelectorAll('#tabs [tabindex=\"0\"]').length") == 1


def test_a_filter_over_many_signals(page_of: Any) -> None:
    resistors = "\n".join(f"R{k} n{k} n{k + 1} 1k" for k in range(20))
    page = page_of(emsim.run(f"t\nV1 n0 0 SIN(0 1 1k)\n{resistors}\nR99 n20 0 1k\n.tran 10u 1m\n"))
    page.fill("#filter", "n1")
    shown = "() => [...document.querySelectorAll('.chip')].filter((c) => c.offsetParent).map((c) => c.textContent)"
    assert set(page.evaluate(shown)) == {"v(n1)", *(f"v(n{k})" for k in range(10, 20))}


# ---- machines -----------------------------------------------------------------------------------


def test_a_spring_hangs_on_what_it_is_fastened_to(page_of: Any) -> None:
    """In Andrews' squeezer it floated beside the body whose point it pulls."""
    page = machine_of("mechanical/ref_andrews_squeezer", page_of)
    tied = page.evaluate(
        """() => { const { shapes } = window.emsim.run.scene, spring = shapes.find((s) => s.kind === 'spring');
            return [spring.p, spring.q_].map((at) => at[0] === 0
                || shapes.some((s) => s.kind === 'bones' && s.at[0] === at[0] && s.to.some((p) => '' + p === '' + at))); }"""
    )
    assert tied == [True, True]


def test_a_gear_of_five_to_one_has_wheels_of_five_to_one(page_of: Any) -> None:
    page = machine_of("lessons/05_gear", page_of)
    gear, wheels = page.evaluate(
        """() => { const { shapes } = window.emsim.run.scene;
            return [shapes.find((s) => s.kind === 'gear'), shapes.filter((s) => s.spin).map((s) => s.spin)]; }"""
    )
    small, large = gear["radii"]
    assert large == pytest.approx(5 * small) and wheels == [small, large] and gear["law"] == "idler"


def test_rails_reach_the_edge_and_labels_lie_apart(page_of: Any) -> None:
    for deck in (
        "coupled/slider_crank_hbridge",
        "coupled/voice_coil",
        "lessons/06_pot",
        "mechanical/lead_screw",
    ):
        page = machine_of(deck, page_of)
        page.evaluate("() => window.emsim.clock.set(window.emsim.clock.last * 0.3)")
        settle(page)
        over = page.evaluate(
            """() => { const labels = window.emsim.machine.pen.taken.filter((b) => Math.abs(b[3] - b[1] - 13) < 1e-6);
                const meet = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
                return labels.filter((a, i) => labels.some((b, j) => j < i && meet(a, b))).length; }"""
        )
        assert over == 0, deck
    page = machine_of("coupled/slider_crank_hbridge", page_of)
    ends = page.evaluate(
        """() => { const c = document.getElementById('machine'), y = Math.round(window.emsim.machine.place([0, 0, 0, 0])[1]);
            const d = c.getContext('2d').getImageData(0, y - 2, c.width, 5).data;
            const inked = (x) => [0, 1, 2, 3, 4].filter((k) => d[4 * (k * c.width + x) + 3] > 100).length;
            return [inked(2), inked(c.width - 3)]; }"""
    )
    assert min(ends) > 0


def test_the_camera_goes_with_what_would_be_lost(page_of: Any) -> None:
    page = machine_of("mechanical/thrown_disc", page_of)
    assert page.is_checked("#follow")
    middle = "() => [...window.emsim.machine.middle]"
    first = page.evaluate(middle)
    page.evaluate("() => window.emsim.clock.set(window.emsim.clock.last)")
    settle(page)
    assert page.evaluate(middle) != first
    page.uncheck("#follow")
    page.evaluate("() => window.emsim.clock.set(0)")
    settle(page)
    assert page.evaluate(middle) == page.evaluate(middle)
    assert page.evaluate("() => window.emsim.machine.scale * window.emsim.machine.size") > 100


def test_a_spatial_machine_turns_with_the_pointer_and_by_keys(page_of: Any) -> None:
    page = machine_of("mechanical/bricard", page_of)
    view = "() => [window.emsim.machine.yaw, window.emsim.machine.pitch]"
    yaw, pitch = page.evaluate(view)
    box = page.locator("#machine").bounding_box()
    page.mouse.move(box["x"] + 100, box["y"] + 100)
    page.mouse.down()
    page.mouse.move(box["x"] + 150, box["y"] + 120, steps=4)
    page.mouse.up()
    # what is in front goes with the pointer: to the right, and down, so that more is seen from above
    assert page.evaluate(view) == pytest.approx([yaw + 0.5, pitch - 0.2], abs=0.03)
    yaw, pitch = page.evaluate(view)
    page.focus("#machine")
    page.keyboard.press("Shift+ArrowRight")
    assert page.evaluate(view) == pytest.approx([yaw + 0.1, pitch], abs=1e-6)


def test_revolutions_have_no_prefix(page_of: Any) -> None:
    page = page_of(emsim.run("t\nV1 a 0 1\nR1 a 0 1\n.tran 1m 10m\n"))
    assert page.evaluate("() => [written(4200, 'rpm'), written(0.02, 'dB'), written(4200, 'V')]") == [
        "4200 rpm", "0.02 dB", "4.2 kV",
    ]  # fmt: skip


@pytest.mark.parametrize("window", ["hann", "none", "flattop"])
def test_spectra_are_those_of_the_command_line(page_of: Any, window: str) -> None:
    deck = "t\nV1 a 0 SIN(1 2 50)\nV2 b a SIN(0 0.1 150)\nR1 b 0 1\n.tran 20u 0.1 0 20u\n.print tran v(b)\n"
    result = emsim.run(deck)
    page = page_of(result)
    page.select_option("#xaxis", label=f"spectrum, window {window}")
    assert "v(b): largest 2" in page.inner_text(".legend")
    f, size = page.evaluate(
        """(w) => { const { run } = window.emsim, c = run.columns.find((c) => c.name === 'v(b)');
            const s = spectrumOf(run.time, c.values, 0, 0.1, w); return [[...s.f], [...s.size]]; }""",
        window,
    )
    spectrum = result.main.fft("v(b)", window=window, points=2 * (len(f) - 1), start=0.0, stop=0.1)
    assert f[:40] == pytest.approx(list(spectrum.column("frequency")[:40]))
    assert size[:40] == pytest.approx(list(abs(spectrum.column("fft(v(b))"))[:40]), abs=1e-3)
    assert size[15] == pytest.approx(0.1, abs=2e-3)
    page.select_option("#xaxis", label="time")
    assert page.evaluate("() => window.emsim.waves.panels[0].plot.scales.x.distr") == 1
