"""The circuit, and the machine, beside analyses other than one transient: a point, frequencies, sweeps, the runs of `.step`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import emsim
from emsim import pipeline
from emsim.outputs import html

STAGE = """a stage: bias, gain, and its supply swept
VCC vcc 0 12
R1 vcc b 47k
R2 b 0 10k
RC vcc c 2.2k
RE e 0 470
Q1 c b e n1
C1 in b 10u
V1 in 0 dc 0 ac 1m
.model n1 npn(bf=200)
.op
.ac dec 20 1 1meg
.dc VCC 0 12 0.5
.end
"""
RINGING = """ringing, three resistors
V1 in 0 PULSE(0 5 0 1u 1u 5m 10m)
R1 in a {r}
L1 a out 1m
C1 out 0 1u
.param r=10
.tran 5u 2m
.step param r list 5 20 80
.print tran v(out) i(l1)
.end
"""
RESTING = """an arm comes to rest on the spring of its hinge
.gravity 9.81
BODY arm shape=rod(0.3) m=0.2
JOINT hinge 0 arm pin
SPRING s1 hinge k=1 q0=0.2
MOTOR m1 a 0 hinge kt=20m r=2 l=1m j=2u
V1 a 0 3
.op static
.end
"""
NOW = "(window.emsim ?? window.still)"
VALUES = f"""() => {{ const c = {NOW}.circuit, t = c.t;
    return Object.fromEntries(c.parts.map(({{ part }}) => [part.name, c.polar((half) => c.current(part, 0, t, half))])); }}"""
LABELS = "() => [...document.querySelectorAll('#circuit .value')].map((e) => e.textContent).filter(Boolean)"


@pytest.fixture
def shown(tmp_path: Path, visit: Any) -> Any:
    def show(deck: str, **how: Any) -> tuple[Any, emsim.Result]:
        result = pipeline.run(deck, scene=True)
        path = tmp_path / "page.html"
        html.write(str(path), result)
        assert path.stat().st_size < 600_000
        return visit(path, **how), result

    return show


def choose(page: Any, name: str) -> None:
    label = next(
        text for text in page.locator("#analysis option").all_text_contents() if text.startswith(name)
    )
    page.select_option("#analysis", label=label)
    page.wait_for_function(
        "(name) => { const now = window.emsim ?? window.still; return now?.run.facts.startsWith(name); }",
        arg=name,
    )


def set_clock(page: Any, t: float) -> None:
    page.evaluate("(t) => window.emsim.clock.set(t)", t)
    page.wait_for_function("(t) => !window.emsim.clock.waiting && window.emsim.clock.t === t", arg=t)


def table(result: emsim.Result, kind: str) -> Any:
    return next(t for t in result.plots if t.kind == kind)


def test_an_operating_point_stands_beside_wires_and_parts(shown: Any) -> None:
    page, result = shown(STAGE)
    choose(page, "Operating Point")
    op, values, labels = table(result, "op"), page.evaluate(VALUES), page.evaluate(LABELS)
    v = {name: op[f"v({name})"][0] for name in ("vcc", "b", "c", "e")}
    assert values["rc"][0] == pytest.approx((v["vcc"] - v["c"]) / 2200, rel=1e-3)
    assert values["c1"][0] == 0
    assert values["q1"][0] == pytest.approx((v["vcc"] - v["c"]) / 2200, rel=1e-3)
    assert "12 V" in labels and f"{v['c']:.3g} V" in labels and f"{1e3 * values['rc'][0]:.3g} mA" in labels
    page.hover("[data-part=rc] .lamp")
    assert f"v = {v['vcc'] - v['c']:.4g} V" in page.inner_text("#circuit .told")
    page.click("#values")
    assert page.evaluate(LABELS) == []
    assert page.locator("#sheet-signals table").count() == 1


def test_small_signals_are_sizes_at_the_cursors_frequency(shown: Any) -> None:
    page, result = shown(STAGE)
    choose(page, "AC Analysis")
    ac = table(result, "ac")
    f, b, source = ac["frequency"], ac["v(b)"], ac["v(in)"]
    for k in (0, 60, 120):
        set_clock(page, f[k])
        values = page.evaluate(VALUES)
        through = 2j * math.pi * f[k] * 1e-5 * (source[k] - b[k])  # C1, whose current is a rate
        assert values["c1"][0] == pytest.approx(abs(through), rel=2e-3)
        assert math.sin(values["c1"][1] - np.angle(through)) == pytest.approx(0, abs=0.02)
    page.hover("[data-part=c1] .lamp")
    assert "\u2220" in page.inner_text("#circuit .told")
    # dots swing about where they are
    offset = """() => { const c = window.emsim.circuit, w = c.wires.find((w) => w.part?.name === 'c1');
        c.step(0.1); return parseFloat(w.dots.style.strokeDashoffset); }"""
    seen = [page.evaluate(offset) for _ in range(60)]
    assert min(seen) < -1 and max(seen) > 1 and max(map(abs, seen)) <= 12


def test_a_sweep_shows_the_point_that_the_cursor_is_at(shown: Any) -> None:
    page, result = shown(STAGE)
    dc = table(result, "dc")
    for k in (4, 24):
        set_clock(page, float(dc["v-sweep"][k]))
        assert page.evaluate(VALUES)["r2"][0] == pytest.approx(dc["v(b)"][k] / 1e4, rel=1e-3, abs=1e-12)


def test_the_current_of_a_swept_resistor_follows_its_value(shown: Any) -> None:
    """It was taken with the value on the card."""
    page, _ = shown("t\nV1 a 0 10\nR1 a b 1k\nR2 b 0 1k\n.dc R1 1k 9k 1k\n.end\n")
    set_clock(page, 9e3)
    values = page.evaluate(VALUES)
    assert values["r1"][0] == pytest.approx(1e-3, rel=1e-3)
    assert values["r2"][0] == pytest.approx(1e-3, rel=1e-3)


def test_the_run_of_a_stepped_deck_is_chosen(shown: Any) -> None:
    page, result = shown(RINGING)
    assert page.locator("#course option").all_text_contents() == ["r = 5", "r = 20", "r = 80"]
    courses = result.main.courses()
    for n, own in enumerate(courses):
        page.select_option("#course", str(n))
        page.wait_for_function("(n) => window.emsim.circuit.n === n", arg=n)
        first = sum(map(len, courses[:n]))
        k = int(np.argmax(own["v(out)"]))
        set_clock(page, first + k)
        volt = page.evaluate("() => window.emsim.circuit.volt('out', window.emsim.circuit.t)")
        assert volt == pytest.approx(own["v(out)"][k], rel=1e-2)
        # its own values are on its parts
        assert f"{(5, 20, 80)[n]} \u03a9" in page.text_content("#circuit svg")
        assert page.inner_text("#clock").startswith(f"r = {(5, 20, 80)[n]}, ")


def test_a_click_on_a_curve_of_a_family_chooses_its_run(shown: Any) -> None:
    page, _ = shown(RINGING)
    where = """() => { const p = window.emsim.waves.panels[0], { run } = window.emsim, box = p.canvas.getBoundingClientRect();
        const own = run.columns.find((c) => c.name === 'v(out)').values, row = run.blocks[1] + 40; // of the last run
        let best = null;
        for (let x = 60; x < box.width; x += 2)
            for (let y = 10; y < box.height - 40; y += 2) if (p.row(x, y, true) === row) best = [box.x + x, box.y + y];
        return best; }"""
    found = page.evaluate(where)
    assert found is not None
    page.mouse.click(*found)
    page.wait_for_function("() => window.emsim.circuit.n === 2")


def test_machine_and_circuit_at_rest(shown: Any) -> None:
    page, result = shown(RESTING)
    assert page.is_visible("#machine") and page.is_visible("#circuit") and not page.is_visible("#transport")
    angle = page.evaluate("() => window.still.machine.pose(1, 0).angle")
    assert angle == pytest.approx(result.main["angle(hinge)"][0], abs=1e-6)
    assert "1.5 A" in page.evaluate(LABELS)


def test_the_machine_of_a_stepped_deck_is_that_of_the_run(shown: Any) -> None:
    """There was none."""
    deck = """a fall from two heights
.param h=1
.gravity 9.81
BODY b m=1 shape=disc(0.1)
JOINT j 0 b slide axis=(0,1) ic={h}
V1 a 0 1
R1 a 0 1k
.tran 10m 0.4
.step param h list 1 2
.end
"""
    page, result = shown(deck)
    first = len(result.main.courses()[0])
    for row, at in ((0, 1.0), (first, 2.0)):
        set_clock(page, row)
        assert page.evaluate(
            "() => { const m = window.emsim.machine; m.draw(); return m.pose(1, 0).o[1]; }"
        ) == pytest.approx(at)


def test_of_many_runs_some_are_drawn_and_the_rest_say_nothing_wrong(shown: Any) -> None:
    page, _ = shown("t\n.param r=1k\nV1 a 0 1\nR1 a 0 {r}\n.tran 1m 2m\n.step param r 1k 100k 1k\n.end\n")
    runs = page.evaluate("() => window.emsim.run.runs.map((one) => [one.first, one.rows])")
    assert len(runs) == 24 and runs[0][0] == 0
    between = runs[1][0] - 1
    set_clock(page, between)
    assert page.evaluate("() => Number.isNaN(window.emsim.circuit.volt('a', window.emsim.circuit.t))")


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1400, "dark")])
def test_a_point_fits_on_phone_and_desk(shown: Any, width: int, scheme: str) -> None:
    page, _ = shown(RESTING, width=width, scheme=scheme)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    box = page.locator("#circuit svg").bounding_box()
    assert box["width"] > 200


def test_the_clock_of_frequencies_goes_by_ratios(shown: Any) -> None:
    page, _ = shown(STAGE)
    choose(page, "AC Analysis")
    set_clock(page, 1e3)
    assert page.evaluate("() => +document.getElementById('scrub').value") == pytest.approx(0.5, abs=1e-6)
