"""Variables that keep their value without an event: latches, what was held, and what is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from module_decks import run

import emsim

METHODS = ["auto", "radau", "gear", "trap", "esdirk", "trbdf2", "dop853"]
SWING = "pwl(0 0 1 1 2 0 3 1)"


def course(tmp_path: Path, body: str, declared: str, tail: str = "") -> emsim.Result:
    module = f"module m(in, out); inout in, out; electrical in, out; {declared}\nanalog begin {body} end\nendmodule\n"
    deck = f"V1 in 0 {SWING}\nN1 in out n\nR1 out 0 1k\n.model n m\n.save v(out)\n{tail or '.tran 10m 3'}"
    return run(tmp_path, module, deck)


LATCH = "if (V(in) > 0.6) s = 1; else if (V(in) < 0.4) s = 0;"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "start", ["real s = 0;", "integer s; analog initial s = 0;", "real s;", "integer s;"]
)
def test_a_latch(start: str, method: str, tmp_path: Path) -> None:
    """Between its thresholds it is what it was: 1 from 0.6 s to 1.6 s, and again from 2.6 s on."""
    declared, _, first = start.partition(" analog ")
    module = (
        f"module m(in, out); inout in, out; electrical in, out; {declared} {'analog ' + first if first else ''}\n"
        f"analog begin {LATCH} V(out) <+ s; end\nendmodule\n"
    )
    deck = f"V1 in 0 {SWING}\nN1 in out n\nR1 out 0 1k\n.model n m\n.options method={method}\n.tran 10m 3\n.save v(out)"
    found = run(tmp_path, module, deck)
    for k in range(300):
        t = 0.01 * k + 0.003
        assert found.at("v(out)", t) == pytest.approx(float(0.6 < t < 1.6 or t > 2.6), abs=1e-6)


def test_what_the_start_gives_and_once_for_all(tmp_path: Path) -> None:
    found = course(tmp_path, "@(initial_step) s = 3; if (V(in) > 0.5) s = 1; V(out) <+ s;", "real s;")
    assert [found.at("v(out)", t) for t in (0.3, 0.7, 1.3, 1.7, 2.2)] == pytest.approx(
        [3, 1, 1, 1, 1], abs=1e-6
    )


@pytest.mark.parametrize("method", METHODS)
def test_follow_and_hold(method: str, tmp_path: Path) -> None:
    """It follows while the input is above 0.5, and holds what it was there."""
    tail = f".options method={method} reltol=1e-6\n.tran 10m 3"
    found = course(tmp_path, "if (V(in) > 0.5) x = V(in) * V(in); V(out) <+ x;", "real x = 0.1;", tail)
    for t, wanted in ((0.3, 0.1), (0.7, 0.49), (1.2, 0.64), (1.6, 0.25), (2.4, 0.25), (2.8, 0.64)):
        assert found.at("v(out)", t) == pytest.approx(wanted, abs=1e-4)


def test_one_that_hangs_on_another(tmp_path: Path) -> None:
    """x is held by the latch, in either order of the text."""
    for body in (f"{LATCH} if (s) x = V(in);", f"if (s) x = V(in); {LATCH}"):
        found = course(
            tmp_path,
            body + " V(out) <+ x;",
            "real x = 0; integer s = 0;",
            ".options reltol=1e-6\n.tran 10m 3",
        )
        for t, wanted in (
            (0.5, 0.0),
            (0.8, 0.8),
            (1.3, 0.7),
            (1.55, 0.45),
            (1.8, 0.4),
            (2.3, 0.4),
            (2.8, 0.8),
        ):
            assert found.at("v(out)", t) == pytest.approx(wanted, abs=1e-4)


def test_hysteresis_in_a_sweep(tmp_path: Path) -> None:
    up = course(tmp_path, LATCH + " V(out) <+ s;", "real s = 0;", ".dc V1 0 1 0.25")
    assert list(up["v(out)"]) == [0, 0, 0, 1, 1]
    down = course(tmp_path, LATCH + " V(out) <+ s;", "real s = 0;", ".dc V1 1 0 -0.25")
    assert list(down["v(out)"]) == [1, 1, 1, 0, 0]


@pytest.mark.parametrize(
    ("body", "declared", "said"),
    [
        (
            "if (V(in) > x) x = V(in); V(out) <+ x;",
            "real x = 0;",
            "x keeps its value .* and is computed of it",
        ),
        (
            "if (V(in) > 0.5) x = x + 1; V(out) <+ x;",
            "real x = 0;",
            "x keeps its value .* and is computed of it",
        ),
        (
            "if (V(in) > 0.5) x[0] = 1; V(out) <+ x[0];",
            "real x[0:1] = '{0, 0};",
            "x has a value at the start",
        ),
    ],
)
def test_what_hangs_on_how_often_it_is_evaluated(body: str, declared: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(emsim.DeckError, match=said):
        course(tmp_path, body, declared)
