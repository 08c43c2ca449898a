"""The circuit in the page of a run: colours, dots that move with the sign of the current, touching, insides of subcircuits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from emsim import pipeline
from emsim.outputs import html

ROOT = Path(__file__).resolve().parents[2]

# a sine through a resistor; a source that turns about at 1 ms
SWING = """swing
V1 in 0 PULSE(5 -5 1m 1u 1u 5m 10m)
R1 in out 1k
R2 out 0 1k
.tran 10u 2m
.print tran v(out)
.end
"""


def written(folder: Path, deck: str | Path, name: str) -> Path:
    result = pipeline.run(deck, scene=True)
    path = folder / f"{name}.html"
    html.write(str(path), result)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("circuit")


@pytest.fixture(scope="module")
def swing(folder: Path) -> Path:
    return written(folder, SWING, "swing")


@pytest.fixture(scope="module")
def servo(folder: Path) -> Path:
    return written(folder, ROOT / "netlists/coupled/pendulum_servo.cir", "servo")


def set_clock(page: Any, t: float) -> None:
    page.evaluate("(t) => window.emsim.clock.set(t)", t)
    page.wait_for_function("(t) => !window.emsim.clock.waiting && window.emsim.clock.t === t", arg=t)


PHASE = (
    "() => window.emsim.circuit.phases[window.emsim.circuit.wires.findIndex((w) => w.part?.name === 'r1')]"
)


def test_dots_move_with_the_sign_of_the_current(swing: Path, visit: Any) -> None:
    page = visit(swing)
    set_clock(page, 0.5e-3)
    before = page.evaluate(PHASE)
    page.evaluate("() => window.emsim.circuit.step(0.05)")
    forwards = page.evaluate(PHASE)
    assert forwards > before  # into R1's first pin
    set_clock(page, 1.5e-3)
    page.evaluate("() => window.emsim.circuit.step(0.05)")
    assert page.evaluate("() => window.emsim.circuit.wires.find((w) => w.part?.name === 'r1').speed") < 0


def test_the_current_of_a_wire_is_that_of_the_part_behind_it(swing: Path, visit: Any) -> None:
    page = visit(swing)
    set_clock(page, 0.5e-3)
    flows = page.evaluate(
        "() => window.emsim.circuit.wires.filter((w) => !w.part).map((w) => Math.abs(w.now))"
    )
    assert flows and all(abs(i - 2.5e-3) < 1e-6 for i in flows)


def test_dots_can_be_switched_off(swing: Path, visit: Any) -> None:
    page = visit(swing)
    set_clock(page, 0.5e-3)
    shown = (
        "() => [...document.querySelectorAll('#circuit .dots')].filter((d) => +d.style.opacity > 0).length"
    )
    assert page.evaluate(shown) > 3
    page.click("#flows")
    assert page.evaluate(shown) == 0
    page.click("#flows")
    assert page.evaluate(shown) > 3


def test_wires_have_the_colour_of_their_voltage(swing: Path, visit: Any) -> None:
    page = visit(swing)
    stroke = "() => document.querySelector('#circuit [data-net=in] path').style.stroke"
    set_clock(page, 0.5e-3)
    positive = page.evaluate(stroke)
    set_clock(page, 1.5e-3)
    negative = page.evaluate(stroke)
    assert "--over" in positive and "--under" in negative
    page.click("#volts")
    assert "--over" not in page.evaluate(stroke) and "--under" not in page.evaluate(stroke)


def test_touching_a_part_tells_its_values(swing: Path, visit: Any) -> None:
    page = visit(swing)
    set_clock(page, 0.5e-3)
    page.hover("[data-part=r1] .lamp")
    assert "v = 2.5 V" in page.inner_text("#circuit .told") and "i = 2.5 mA" in page.inner_text(
        "#circuit .told"
    )
    set_clock(page, 1.5e-3)
    assert "i = -2.5 mA" in page.inner_text("#circuit .told")


def test_a_click_adds_the_signal_to_the_waves_and_takes_it_away(swing: Path, visit: Any) -> None:
    page = visit(swing)
    page.click("[data-part=r1] .lamp")
    assert page.evaluate("() => [...window.emsim.waves.shown]") == ["v(out)", "i(r1)"]
    value = "() => { const c = window.emsim.run.columns.find((c) => c.name === 'i(r1)'); return [c.unit, c.values[5]]; }"
    unit, i = page.evaluate(value)
    assert unit == "A" and abs(i - 2.5e-3) < 1e-8
    page.click("[data-part=r1] .lamp")
    assert page.evaluate("() => [...window.emsim.waves.shown]") == ["v(out)"]


def test_a_touched_wire_tells_its_voltage(swing: Path, visit: Any) -> None:
    page = visit(swing)
    set_clock(page, 0.5e-3)
    page.dispatch_event("#circuit [data-net=out] .grip", "pointerenter")
    assert page.inner_text("#circuit .told") == "v(out) = 2.5 V"


def test_a_motor_lights_up_in_both_worlds(servo: Path, visit: Any) -> None:
    page = visit(servo)
    page.hover("[data-part=m1] .lamp")
    assert page.evaluate("() => window.emsim.machine.lit") == "m1"
    page.mouse.move(5, 5)
    assert page.evaluate("() => window.emsim.machine.lit") is None
    # and from the machine
    x, y = page.evaluate(
        """() => { const m = window.emsim.machine, s = m.scene.shapes.find((s) => s.name === 'm1');
            const r = m.canvas.getBoundingClientRect(), [x, y] = m.place(s.a); return [r.x + x, r.y + y]; }"""
    )
    page.mouse.move(x, y)
    lit = page.evaluate("() => [...document.querySelectorAll('#circuit .lit')].map((g) => g.dataset.part)")
    assert lit in (["m1"], ["p1"])  # both sit on the hinge


def test_a_subcircuit_opens_and_closes(folder: Path, visit: Any) -> None:
    page = visit(written(folder, ROOT / "netlists/electrical/sallen_key.cir", "filter"))
    page.dblclick("[data-part=x1] .lamp")
    inside = page.evaluate(
        "() => [...document.querySelectorAll('#circuit .part')].map((g) => g.dataset.part)"
    )
    assert "x1.g1" in inside and "c1" not in inside
    page.click("#circuit .way button")
    assert page.locator("[data-part=c1]").count() == 1


def test_what_flows_into_a_subcircuit_is_what_its_inside_takes(folder: Path, visit: Any) -> None:
    page = visit(written(folder, ROOT / "netlists/electrical/sallen_key.cir", "filter2"))
    set_clock(page, 0.5e-3)
    ends = """() => { const c = window.emsim.circuit, at = (n) => c.parts.find((p) => p.part.name === n).part, t = c.clock.t;
        return [c.current(at('x1'), 2, t), c.current(at('rl'), 0, t), c.current(at('c1'), 1, t), c.current(at('x1'), 1, t)]; }"""
    out, load, feedback, inverting = page.evaluate(ends)
    assert inverting == 0 and abs(out + load + feedback) < 0.02 * abs(load)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1400])
def test_it_fits_on_phone_and_desk(servo: Path, visit: Any, width: int, scheme: str) -> None:
    page = visit(servo, width=width, scheme=scheme)
    box = page.locator("#circuit svg").bounding_box()
    assert box["width"] > 200 and box["x"] >= 0 and box["x"] + box["width"] <= width
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width


def test_a_machine_without_a_circuit_has_no_empty_pane(folder: Path, visit: Any) -> None:
    page = visit(written(folder, ROOT / "netlists/mechanical/ref_four_bar.cir", "bar"))
    assert page.locator("#circuit").count() == 0 or not page.is_visible("#circuit")
    assert page.is_visible("#machine")


def test_a_circuit_too_large_to_read_is_told(folder: Path, visit: Any) -> None:
    lines = "\n".join(f"R{k} n{k} n{k + 1} 1k" for k in range(70))
    deck = f"chain\nV1 n0 0 SIN(0 1 1k)\n{lines}\nR99 n70 0 1k\n.tran 10u 1m\n.end\n"
    page = visit(written(folder, deck, "chain"))
    assert "72 parts on one level" in page.inner_text("#within")
    assert not page.is_visible("#circuit .picture")


def test_a_circuit_of_many_elements_is_drawn_without_its_currents(folder: Path, visit: Any) -> None:
    stages = "\n".join(f"X{k} n{k} n{k + 1} stage" for k in range(30))
    inside = "\n".join(f"R{k} a{k} a{k + 1} 1k" for k in range(8))
    deck = f"stages\nV1 n0 0 SIN(0 1 1k)\n{stages}\n.subckt stage a0 a8\n{inside}\n.ends\nRL n30 0 1k\n.tran 10u 1m\n.end\n"
    page = visit(written(folder, deck, "stages"))
    assert page.locator("#circuit .part").count() == 32
    assert page.evaluate("() => window.emsim.circuit.wires.every((w) => !w.speed)")


STAGE = """a transistor between its resistors
VCC vcc 0 12
R1 vcc b 47k
R2 b 0 10k
RC vcc c 2.2k
RE e 0 470
Q1 c b e n1
.model n1 npn(bf=200)
.tran 10u 2m
.end
"""


def test_dots_run_along_the_leads_of_a_transistor(folder: Path, visit: Any) -> None:
    page = visit(written(folder, STAGE, "stage"))
    leads = """() => { const own = window.emsim.circuit.wires.filter((w) => w.part?.name === 'q1');
        return Object.fromEntries(own.map((w) => [w.pin, w.now])); }"""
    collector, base, emitter = (page.evaluate(leads)[k] for k in "012")
    # into collector and base, out of the emitter
    assert collector > 100 * base > 0 > emitter and abs(collector + base + emitter) < 1e-3 * collector


def test_a_long_drawing_scrolls_and_stays_readable(folder: Path, visit: Any) -> None:
    """A ladder of many stages was made as small as the pane."""
    page = visit(written(folder, ROOT / "netlists/bench/rlc_ladder.cir", "ladder"))
    wide, tall = page.evaluate(
        """() => { const p = document.querySelector('.picture'), t = p.querySelector('.part text').getBoundingClientRect();
            return [p.scrollWidth - p.clientWidth, t.height]; }"""
    )
    assert wide > 100 and tall > 7
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")


def test_a_page_opens_playing_unless_its_reader_wants_no_motion(servo: Path, visit: Any) -> None:
    page = visit(servo, playing=True)
    page.wait_for_function("window.emsim.clock.t > 0.01", timeout=5000)
    page.emulate_media(reduced_motion="reduce")
    page.reload()
    page.wait_for_function("window.emsim && window.emsim.waves.panels.length > 0")
    page.wait_for_timeout(200)
    assert page.evaluate("() => [window.emsim.clock.playing, window.emsim.clock.t]") == [False, 0]


def test_large_enlarges_the_drawing_and_not_the_box_alone(servo: Path, visit: Any) -> None:
    page = visit(servo)
    wide = "() => document.querySelector('#circuit svg').getBoundingClientRect().width"
    drawn = "() => { const m = document.querySelector('#circuit svg').getScreenCTM(); return m.a; }"
    before, scale = page.evaluate(wide), page.evaluate(drawn)
    page.click("#large")
    assert page.evaluate(wide) > 1.3 * before and page.evaluate(drawn) > 1.3 * scale


HBRIDGE = """both supplies, two outputs, an input: terminals on four sides
.subckt bridge vp vn a b in
B1 a vn V={v(in)>0 ? v(vp,vn) : 0}
B2 b vn V={v(in)>0 ? 0 : v(vp,vn)}
.ends
Vp vp 0 12
Vin in 0 PULSE(-1 1 0 1u 1u 1m 2m)
X1 vp 0 a b in bridge
R1 a b 10
.tran 10u 4m
.print tran v(a,b)
.end
"""


def test_a_box_with_terminals_on_four_sides_has_its_page(folder: Path, visit: Any) -> None:
    page = visit(written(folder, HBRIDGE, "bridge"))
    texts = page.evaluate("() => [...document.querySelectorAll('#circuit text')].map((t) => t.textContent)")
    assert {"vp", "vn", "a", "b", "in", "x1", "bridge"} <= set(texts)


def test_a_drawing_that_fails_takes_neither_run_nor_page_with_it(
    folder: Path, visit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from emsim import _engine

    def fails(*_: Any) -> None:
        raise ValueError("a part needs a variant with a rectangle")

    monkeypatch.setattr(_engine, "arrange_diagram", fails)
    result = pipeline.run(SWING, scene=True)
    assert [d.code for d in result.diagnostics] == ["W352"] and len(result.main) > 10
    page = visit(written(folder, SWING, "failed"))
    assert "could not be drawn" in page.inner_text("#within")


SMALL = """small values first: their inverse is 1e23
V1 a 0 PWL(0 1e-23 1u 1e-23 2u 1.416)
R1 a 0 1k
.tran 10n 4u
.print tran v(a)
.end
"""


def expression(page: Any, text: str) -> None:
    page.click("#tab-signals")
    page.fill("#expression", text)
    page.keyboard.press("Enter")
    page.wait_for_function("(text) => window.emsim.waves.shown.has(text)", arg=text)


def test_no_value_is_rounded_by_the_size_of_other_rows(folder: Path, visit: Any) -> None:
    page = visit(written(folder, SMALL, "small"))
    expression(page, "1/v(a)")
    set_clock(page, 3e-6)
    legends = "() => [...document.querySelectorAll('.legend')].map((l) => l.textContent).join(' ')"
    assert "1/v(a) = 0.7062" in page.evaluate(legends)
    set_clock(page, 0.5e-6)
    assert "1/v(a) = 1e+23" in page.evaluate(legends) or "1/v(a) = 1e23" in page.evaluate(legends)


def test_one_row_without_a_value_does_not_empty_the_cursors_sheet(folder: Path, visit: Any) -> None:
    deck = SMALL.replace("PWL(0 1e-23 1u 1e-23 2u 1.416)", "PWL(0 0 1u 2)")
    page = visit(written(folder, deck, "gap"))
    expression(page, "v(a)/v(a)")  # 0/0 in its first row
    page.click("#tab-cursors")
    rows = page.evaluate(
        "() => [...document.querySelectorAll('#sheet-cursors tr')].map((r) => [...r.cells].map((c) => c.textContent))"
    )
    row = next(r for r in rows if r[0] == "v(a)/v(a)")
    assert row[4:8] == ["1", "1", "1", "1"]
    assert "1 row of v(a)/v(a)" in page.inner_text("#sheet-cursors .note")


def test_decibels_of_amperes_and_of_volts_have_panels_of_their_own(folder: Path, visit: Any) -> None:
    deck = "ac\nV1 in 0 AC 1\nR1 in out 1k\nC1 out 0 1u\n.ac dec 10 1 1k\n.print ac v(out) i(v1)\n.end\n"
    page = visit(written(folder, deck, "decibels"))
    groups = "() => window.emsim.waves.groups().map(([, , columns]) => columns.map((c) => c.name))"
    assert ["db(v(out))"] in page.evaluate(groups) and ["db(i(v1))"] in page.evaluate(groups)
