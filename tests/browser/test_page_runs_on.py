"""Pages whose run goes on for ever, hands on bodies and switches: beside closed forms and the command line's run of the deck
that says the same."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

import emsim

FINE = ".options reltol=1e-7\n"
RC = f"an RC\n{FINE}V1 in 0 5\nR1 in out 1k\nC1 out 0 1u ic=0\n.tran 20u 3m uic\n.end\n"
SWING = f"""a pendulum
{FINE}BODY arm m=0.2 shape=rod(0.3)
JOINT hinge 0 arm pin ic=0.5
.gravity 9.81
.tran 5m 1
.end
"""
TWO = """two links, and a slider that nothing pushes
BODY one m=0.2 shape=rod(0.3)
BODY two m=0.1 shape=rod(0.25)
JOINT h1 0 one pin ic=-1
JOINT h2 one(0.3,0) two pin ic=0.5
.gravity 9.81
.tran 5m 1
.end
"""
LOOP = """a four bar linkage
BODY crank m=0.2 shape=rod(0.1)
BODY coupler m=0.2 shape=rod(0.3)
BODY rocker m=0.2 shape=rod(0.25)
JOINT a 0 crank pin ic=1
JOINT b crank(0.1,0) coupler pin
JOINT c coupler(0.3,0) rocker(0.25,0) pin
JOINT d 0(0.3,0) rocker pin guess=1.5
.gravity 9.81
.tran 5m 1
.end
"""
SWITCH = f"""a capacitor behind a switch that stays open
{FINE}V1 in 0 5
S1 in out g 0 sw
Vg g 0 {{level}}
R1 out 0 1k
C1 out 0 1u
.model sw SW(vt=0.5 ron=100 roff=1g)
.tran 20u 3m
.end
"""
PLACE = """(k, x) => { const m = window.emsim.machine, r = m.canvas.getBoundingClientRect(), p = m.place([k, x, 0, 0]);
    return [r.left + p[0], r.top + p[1]]; }"""
SIGNAL = (
    "name => [[...window.emsim.run.time], [...window.emsim.run.columns.find(c => c.name === name).values]]"
)


@pytest.fixture
def opened(computing: Callable[..., Any]) -> Callable[..., Any]:
    def page_of(text: str, on: bool = False, **size: Any) -> Any:
        seen = computing(text, **size)
        if on:
            seen.click("text=runs on")
            seen.wait_for_function("window.engine.running?.view")
        return seen

    return page_of


def until(seen: Any, t: float) -> None:
    seen.wait_for_function(f"window.engine.running.t > {t}", timeout=20_000)


def paused(seen: Any) -> None:
    seen.evaluate("window.engine.running.play(false)")
    seen.wait_for_function("!window.engine.running.waiting")


def _line(found: tuple[list[float], list[float]], t: float) -> float:
    x, y = found
    k = max(1, min(len(x) - 1, next((k for k, v in enumerate(x) if v >= t), len(x) - 1)))
    share = (t - x[k - 1]) / (x[k] - x[k - 1]) if x[k] > x[k - 1] else 1.0
    return y[k - 1] + share * (y[k] - y[k - 1])


def test_the_clock_runs_beyond_the_decks_end_and_the_curve_is_that_of_a_longer_run(
    opened: Callable[..., Any],
) -> None:
    seen = opened(SWING, on=True)
    until(seen, 1.6)
    paused(seen)
    time, angle = seen.evaluate(SIGNAL, "angle(hinge)")
    assert time[0] > 0.3 and time[-1] > 1.6  # the window is as long as the deck's run, and goes along
    table = emsim.run(SWING.replace(".tran 5m 1", f".tran 5m {time[-1]!r}")).main
    known = (list(table.floats(0)), list(table.floats(table.names.index("angle(hinge)"))))
    # rows of both lie on one smooth curve: 5 ms apart, a straight line is off by h^2/8 of its bend
    bend = 5e-3**2 / 8 * 9.81 / 0.2
    assert max(abs(v - _line(known, t)) for t, v in zip(time, angle, strict=True)) < bend
    assert time == sorted(time)


def test_a_value_moved_acts_at_once_and_states_stay(opened: Callable[..., Any]) -> None:
    seen = opened(RC, on=True)
    until(seen, 5e-4)
    paused(seen)
    seen.click("#knobs .fold")
    time, before = seen.evaluate(SIGNAL, "v(out)")
    t0, v0 = time[-1], before[-1]
    assert v0 == pytest.approx(5.0 * (1.0 - math.exp(-t0 / 1e-3)), abs=1e-5)
    field = seen.get_by_label("v1, as text")
    field.fill("-2")
    field.press("Enter")
    seen.evaluate("window.engine.running.play(true)")
    until(seen, t0 + 1e-3)
    paused(seen)
    time, after = seen.evaluate(SIGNAL, "v(out)")
    for t, v in zip(time, after, strict=True):
        if t > t0:
            assert v == pytest.approx(-2.0 + (v0 + 2.0) * math.exp(-(t - t0) / 1e-3), abs=1e-5)
    assert "v1 = -2" in seen.inner_text("#facts")


def test_single_steps_and_a_new_start(opened: Callable[..., Any]) -> None:
    seen = opened(RC, on=True)
    until(seen, 2e-4)
    paused(seen)
    t = seen.evaluate("window.engine.running.t")
    seen.click("#forward")
    seen.wait_for_function("t => window.engine.running.t > t && !window.engine.running.waiting", arg=t)
    assert not seen.evaluate("window.engine.running.playing")
    seen.click("#restart")
    seen.wait_for_function("t => window.engine.running.t < t", arg=t)
    seen.click("text=whole run >> nth=0")
    seen.wait_for_function("!window.engine.running && window.emsim.run.rows > 100")


def test_a_run_that_fails_says_why_and_stands_there(opened: Callable[..., Any]) -> None:
    runaway = f"what grows without end\n{FINE}B1 0 x i='v(x)*v(x)'\nC1 x 0 1 ic=1\nR1 x 0 1g\n.tran 5m 0.5 uic\n.end\n"
    seen = opened(runaway, on=True)
    # v = 1/(1 - t)
    seen.wait_for_function("window.engine.running.failed", timeout=30_000)
    said = seen.inner_text("#computing")
    assert "at t = " in said or "too" in said
    assert seen.evaluate("window.engine.running.t") == pytest.approx(1.0, abs=0.02)
    assert not seen.evaluate("window.engine.running.playing")


def hold(seen: Any, body: int, x: float, by: tuple[float, float], steps: int = 4) -> list[float]:
    place = seen.evaluate(f"({PLACE})({body}, {x})")
    seen.mouse.move(*place)
    seen.mouse.down()
    to = [place[0] + by[0], place[1] + by[1]]
    seen.mouse.move(*to, steps=steps)
    return to


def still(seen: Any) -> None:
    seen.wait_for_function("!window.engine.busy && !window.engine.hands.aiming && !window.engine.hands.next")


@pytest.mark.parametrize(
    ("text", "joint", "body", "by"), [(TWO, "h2", 2, (20.0, -50.0)), (LOOP, "a", 1, (-15.0, -10.0))]
)
def test_a_body_dragged_starts_there(
    opened: Callable[..., Any], text: str, joint: str, body: int, by: tuple[float, float]
) -> None:
    seen = opened(text)
    to = hold(seen, body, 0.1, by)
    still(seen)
    seen.wait_for_timeout(50)
    still(seen)
    angle = seen.evaluate("[...window.engine.values.values()][0]")
    # the point of the body lies on the line from its joint to the pointer
    joint_at, point = seen.evaluate(f"[({PLACE})({body}, 0), ({PLACE})({body}, 0.1)]")
    a, b = ([p[i] - joint_at[i] for i in (0, 1)] for p in (point, to))
    assert a[0] * b[1] - a[1] * b[0] == pytest.approx(0.0, abs=3e-3 * math.hypot(*a) * math.hypot(*b))
    seen.mouse.up()
    lines = [
        " ".join([*(w for w in line.split() if not w.startswith("ic=")), f"ic={angle!r}"])
        if line.startswith(f"JOINT {joint} ")
        else line
        for line in text.splitlines()
    ]
    table = emsim.run("\n".join(lines)).main
    for name in table.signals:
        if not name.startswith("angle("):
            continue
        known = list(table.floats(table.names.index(name)))
        _, mine = seen.evaluate(SIGNAL, name)
        assert mine[0] == pytest.approx(known[0], abs=1e-9)
        assert mine[-1] == pytest.approx(known[-1], abs=1e-5 * max(map(abs, known)))
    assert f"angle({joint})" in seen.inner_text("#facts")


def test_a_body_held_while_the_clock_runs_rests_where_spring_and_weight_balance(
    opened: Callable[..., Any],
) -> None:
    seen = opened(SWING.replace("pin ic=0.5", "pin ic=-1.5707963 damp=0.02"), on=True)
    hold(seen, 1, 0.2, (60.0, -20.0))
    t = seen.evaluate("window.engine.running.t")
    until(seen, t + 3.0)
    values = seen.evaluate("""Object.fromEntries(Object.entries(window.engine.deck.hands).map(([name, k]) =>
        [name.replace("hand ", ""), window.engine.values.get(k)]))""")
    angle = seen.evaluate(SIGNAL, "angle(hinge)")[1][-1]
    assert values["on arm"] == 1
    px, py = values["px"], values["py"]
    c, s = math.cos(angle), math.sin(angle)
    x, y = c * px - s * py, s * px + c * py
    pulled = values["k"] * (x * (values["y"] - y) - y * (values["x"] - x))
    weight = 0.2 * 9.81 * 0.15 * c
    assert pulled == pytest.approx(weight, abs=2e-3 * values["k"] * 0.04)
    assert abs(weight) > 0.02
    seen.mouse.up()
    until(seen, t + 3.4)
    assert seen.evaluate("window.engine.values.get(window.engine.deck.hands['hand on arm'])") == 0
    assert abs(seen.evaluate(SIGNAL, "angle(hinge)")[1][-1] - angle) > 0.02


def test_the_ground_and_what_cannot_move_are_not_taken(opened: Callable[..., Any]) -> None:
    driven = TWO.replace("pin ic=-1", "pin").replace("JOINT h2", "DRIVE d h1 q={sin(time)}\nJOINT h2")
    seen = opened(driven)
    assert seen.evaluate("Object.keys(window.engine.deck.grips)") == ["2"]
    hold(seen, 1, 0.15, (10.0, 10.0))
    assert not seen.evaluate("window.engine.hands.hold")
    seen.mouse.up()


def test_a_finger_takes_a_body_as_the_mouse_does(opened: Callable[..., Any]) -> None:
    seen = opened(TWO, width=400, height=800)
    x, y = seen.evaluate(f"({PLACE})(2, 0.2)")
    touch = """([kind, x, y]) => { const c = document.getElementById("machine");
        const how = { pointerType: "touch", pointerId: 7, clientX: x, clientY: y, button: 0, bubbles: true, isPrimary: true };
        c.dispatchEvent(new PointerEvent(kind, how)); }"""
    seen.evaluate("HTMLCanvasElement.prototype.setPointerCapture = () => {}")
    for kind, dx in (("pointerdown", 0), ("pointermove", 20), ("pointermove", 30)):
        seen.evaluate(touch, [kind, x + dx, y])
    still(seen)
    assert "angle(h2)" in seen.inner_text("#facts")
    seen.evaluate(touch, ["pointerup", x + 30, y])
    assert not seen.evaluate("window.engine.hands.hold")
    assert seen.evaluate("document.documentElement.scrollWidth") <= 400


@pytest.mark.parametrize(
    "model",
    [
        "SW(vt=0.5 ron=100 roff=1g)",
        "VSWITCH(von=1 voff=0 ron=100 roff=1g)",
        "SW(vt=0.5 vh=0.2 ron=100 roff=1g)",
    ],
)
def test_a_switch_that_was_clicked_is_held_against_its_control(
    opened: Callable[..., Any], model: str
) -> None:
    text = SWITCH.replace("SW(vt=0.5 ron=100 roff=1g)", model)
    seen = opened(text.replace("{level}", "0"))
    part = seen.locator("#circuit .part[data-part=s1]")
    part.click()
    seen.wait_for_function("window.engine.hands.turned.size && !window.engine.busy")
    assert "s1 held closed" in seen.inner_text("#facts")
    assert seen.evaluate(SIGNAL, "v(out)")[1][-1] == pytest.approx(
        emsim.run(text.replace("{level}", "2")).main["v(out)"][-1], rel=1e-6
    )
    assert seen.locator("#circuit .held .lamp").count() == 1
    part.click()
    seen.wait_for_function("!window.engine.hands.turned.size && !window.engine.busy")
    assert abs(seen.evaluate(SIGNAL, "v(out)")[1][-1]) < 1e-4


def test_a_switch_closes_at_once_while_the_clock_runs_and_opens_with_the_finger(
    opened: Callable[..., Any],
) -> None:
    seen = opened(SWITCH.replace("{level}", "0"), on=True)
    until(seen, 3e-4)
    part = seen.locator("#circuit .part[data-part=s1]")
    part.hover()
    seen.mouse.down()
    t = seen.evaluate("window.engine.running.t")
    until(seen, t + 1.2e-3)
    # 100 Ohm and 1 kOhm: 4.545 V, within 91 us
    assert seen.evaluate(SIGNAL, "v(out)")[1][-1] == pytest.approx(5.0 / 1.1, rel=1e-3)
    seen.mouse.up()
    until(seen, t + 3e-3)
    paused(seen)
    time, v = seen.evaluate(SIGNAL, "v(out)")
    opened_at = max(k for k, one in enumerate(v) if one > 4.5454)
    t0, v0 = time[opened_at], v[opened_at]
    assert v[-1] == pytest.approx(v0 * math.exp(-(time[-1] - t0) / 1e-3), abs=2e-3)
    assert seen.evaluate("window.engine.hands.turned.size") == 0
