"""Pages that compute: what a reader moves gives what the command line gives for the deck so altered."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from support import NETLISTS

import emsim

NEAR = 1e-8  # of a column's largest value: the page's engine interprets, and values from outside are no constants to it
STOP = """a bouncing ball, drawn
BODY ball m=0.1 shape=disc(0.05)
JOINT way 0 ball slide axis=(0,1) ic=1
STOP floor way min=0 e=0.7
.gravity 9.81
.tran 1m 2
.end
"""
RLC = """a tank behind a switch
V1 in 0 5
S1 in a g 0 sw
Vg g 0 PULSE(0 1 1m 1u 1u 2m 4m)
R1 a b 10
L1 b out 1m
C1 out 0 10u
D1 0 out dd
.model dd D(is=1f)
.model sw SW(vt=0.5 ron=1 roff=1meg)
.tran 10u 8m
.end
"""
CORNERS = """currents that follow from slopes
V1 a 0 PULSE(0 1 1m 1m 1m 2m)
C1 a 0 1u
R1 a b 1k
C2 b 0 1u
I2 0 d PULSE(0 1 1m 1m 1m 2m)
R2 d e 2
L2 e 0 5m
.tran 10u 6m
.options reltol=1e-6
.end
"""
ALL = """Object.fromEntries([["time", [...window.emsim.run.time]],
    ...window.emsim.run.columns.map(c => [c.name, [...c.values]])])"""

CASES = {
    "servo": ((NETLISTS / "coupled/pendulum_servo.cir").read_text(), {"arm(m)": ("m=0.20", "0.3"), "m1(kt)": ("kt=20m", "10m")}),
    "switched": (RLC, {"l1": ("1m", "2m"), "v1": ("5", "7")}),
    "corners": (CORNERS, {"r1": ("1k", "2k"), "l2": ("5m", "4m")}),
    "ball": (STOP, {"ball(m)": ("m=0.1", "0.3")}),
}  # fmt: skip


def columns(seen: Any) -> dict[str, list[float]]:
    return seen.evaluate(ALL)


def agree(table: Any, found: dict[str, list[float]], near: float) -> None:
    """At the rows that both have: where steps part by rounding, the rows between do too."""
    times = table.floats(0)
    assert len(found["time"]) == pytest.approx(len(times), rel=0.02)
    for name in table.signals:
        values = table.floats(table.names.index(name))
        mine = dict(zip(found["time"], found[name], strict=True))
        both = [(mine[t], v) for t, v in zip(times, values, strict=True) if t in mine]
        assert len(both) > 0.5 * len(times)
        assert max(abs(a - b) for a, b in both) <= near * max(map(abs, values)), name


@pytest.mark.parametrize("case", CASES)
def test_a_value_moved_gives_what_the_command_line_gives(moved: Callable[..., Any], case: str) -> None:
    text, changes = CASES[case]
    seen = moved(text, {name: value for name, (_, value) in changes.items()})
    for name, (was, value) in changes.items():
        new = was.partition("=")[0] + "=" + value if "=" in was else value
        assert name.partition("(")[0] in text.lower() and was in text
        lines = text.split("\n")
        at = next(
            k
            for k, line in enumerate(lines)
            if name.partition("(")[0] in line.lower().split() and was in line.split()
        )
        lines[at] = " ".join(new if word == was else word for word in lines[at].split())
        text = "\n".join(lines)
    table = emsim.run(text, scene=True).main
    found = columns(seen)
    agree(table, found, 1e-6)
    assert [name for name in changes if name in seen.inner_text("#facts")] == [*changes]


def test_the_deck_as_it_stands_is_the_recorded_run(moved: Callable[..., Any]) -> None:
    text = CASES["servo"][0]
    seen = moved(text, {"arm(m)": "0.3"})
    seen.click("text=↺ >> visible=true")
    seen.wait_for_function("!window.engine.busy")
    table, found = emsim.run(text, scene=True).main, columns(seen)
    agree(table, found, NEAR)


def test_what_has_other_equations_is_told(moved: Callable[..., Any]) -> None:
    seen = moved(CASES["servo"][0], {"m1(r)": "-2"})
    assert "other equations" in seen.inner_text("#computing")


def test_the_machine_and_the_circuit_follow(moved: Callable[..., Any]) -> None:
    seen = moved(CASES["servo"][0], {"arm(m)": "0.3"}, width=400, height=800)
    moves = "window.emsim.run.scene.channels.find(c => c.name === 'angle(arm)')"
    angle = seen.evaluate(
        f"[{moves}.values.at(-1), window.emsim.run.columns.find(c => c.name === 'angle(hinge)').values.at(-1)]"
    )
    assert angle[0] == pytest.approx(angle[1] - 1.5707963267948966, abs=1e-9)
    assert seen.evaluate("document.documentElement.scrollWidth") <= 400
