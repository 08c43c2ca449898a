"""@(initial_step), @(cross), @(above) and @(timer): variables that keep what an event gave them."""

from __future__ import annotations

from math import asin, exp, log, pi, sin
from pathlib import Path

import pytest
from module_decks import HEAD, run

import emsim

METHODS = ["auto", "radau", "gear", "trap", "dop853"]

# an oscillator of relaxation: out is 1 until the capacitor has come to 2/3, then 0 down to 1/3
COMPARATOR = """module comparator(in, out); inout in, out; electrical in, out;
parameter real low = 1.0 / 3, high = 2.0 / 3;
integer up;
analog begin
    @(initial_step) up = 1;
    @(cross(V(in) - high, 1)) up = 0;
    @(cross(V(in) - low, -1)) up = 1;
    V(out) <+ up;
end
endmodule
"""
SAMPLE = """module sample(in, clock, out); inout in, clock, out; electrical in, clock, out;
real kept, when;
analog begin
    @(initial_step or cross(V(clock), +1)) begin kept = V(in); when = $abstime; end
    V(out) <+ kept + 1k * when;
end
endmodule
"""
DIVIDER = """module divider(in, out); inout in, out; electrical in, out;
parameter integer by = 3;
(* desc="edges so far" *) integer n;
integer out_is;
analog begin
    @(cross(V(in), 1)) begin
        n = n + 1;
        if (n % by == 0) out_is = 1 - out_is;
    end
    V(out) <+ out_is;
end
endmodule
"""
MODULATOR = """module modulator(in, clock, out); inout in, clock, out; electrical in, clock, out;
real sum, bit;
analog begin
    @(initial_step) bit = -1;
    @(cross(V(clock), 1)) begin
        sum = sum + V(in) - bit;
        bit = sum > 0 ? 1 : -1;
    end
    V(out) <+ bit;
end
endmodule
"""


@pytest.mark.parametrize("method", METHODS)
def test_a_comparator_with_hysteresis_swings(method: str, tmp_path: Path) -> None:
    """From 0 to 2/3 takes rc ln 3, each way between the thresholds rc ln 2; in between v is an exponential."""
    deck = f"N1 in out m\nR1 out in 1k\nC1 in 0 1u ic=0\n.model m comparator\n.options method={method} reltol=1e-8\n"
    found = run(tmp_path, COMPARATOR, f"{deck}.tran 10u 6m uic\n.save v(in) v(out)")
    rc = 1e-3
    for k in range(1, 60):
        t = k * 1e-4
        if t < rc * log(3):
            v, up = 1 - exp(-t / rc), 1
        else:
            turns, since = divmod((t - rc * log(3)) / (rc * log(2)), 1)
            up = int(turns) % 2
            v = 1 - 2 / 3 * 2**-since if up else 2 / 3 * 2**-since
        assert found.at("v(out)", t) == pytest.approx(up, abs=1e-9)
        assert found.at("v(in)", t) == pytest.approx(v, abs=2e-5)


@pytest.mark.parametrize("method", METHODS)
def test_what_is_sampled_is_held(method: str, tmp_path: Path) -> None:
    """The clock sin(2 pi 10k t + 1) rises through 0 where 2 pi 10k t + 1 = 2 pi k; the input and time of then are kept."""
    deck = (
        "V1 in 0 sin(0.2 1 700)\nV2 clock 0 sin(0 1 10k 0 0 57.29577951308232)\nN1 in clock out m\nR1 out 0 1k\n"
        f".model m sample\n.options method={method} reltol=1e-6\n.tran 5u 2m\n.save v(out)"
    )
    found = run(tmp_path, SAMPLE, deck)
    for k in range(1, 40):
        t = k * 5e-5
        edges = int((2 * pi * 1e4 * t + 1) / (2 * pi))
        then = (2 * pi * edges - 1) / (2 * pi * 1e4) if edges else 0.0
        kept = 0.2 + sin(2 * pi * 700 * then)
        assert found.at("v(out)", t) == pytest.approx(kept + 1e3 * then, abs=2e-6)


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_dividers_in_a_row_count(method: str, tmp_path: Path) -> None:
    """Every third edge turns the first output, every second edge of that the second one: 12 edges make one period of it."""
    deck = (
        "V1 in 0 sin(0 1 1k 0 0 -90)\nN1 in a m\nN2 x b n\nB1 x 0 v=v(a)-0.5\nR1 a 0 1k\nR2 b 0 1k\n.model m divider\n"
        f".model n divider by=2\n.options method={method}\n.tran 50u 30m\n.save v(a) v(b) @n1[n]"
    )
    found = run(tmp_path, DIVIDER, deck)
    for k in range(29):
        t = k * 1e-3  # edges are at (k + 1/4) ms
        thirds = k // 3
        assert found.at("@n1[n]", t) == k
        assert found.at("v(a)", t) == thirds % 2
        rises = (thirds + 1) // 2
        assert found.at("v(b)", t) == rises // 2 % 2


def test_the_mean_of_a_modulator_is_its_input(tmp_path: Path) -> None:
    """Of first order: n bits add up to n x but for the integrator, which stays within -2 .. 2."""
    deck = (
        "V1 in 0 0.3713\nV2 clock 0 sin(0 -1 100k)\nN1 in clock out m\nR1 out 0 1k\n.model m modulator\n"
        ".tran 1u 3m\n.save v(out)"
    )
    found = run(tmp_path, MODULATOR, deck)
    bits = [found.at("v(out)", (k + 1) * 1e-5) for k in range(299)]  # an edge at every (k + 1/2) 10 us
    total, bit = 0.0, -1.0
    for found_bit in bits:
        total += 0.3713 - bit
        bit = 1.0 if total > 0 else -1.0
        assert found_bit == bit
    assert sum(bits) / len(bits) == pytest.approx(0.3713, abs=2 / len(bits))


ABOVE = """module ceiling(in, a, c); inout in, a, c; electrical in, a, c;
parameter real top = 1;
real rises, crossed, first;
analog begin
    @(initial_step) first = V(in);
    @(above(V(in) - top)) rises = rises + 1;
    @(cross(V(in) - top)) crossed = crossed + 1;
    V(a) <+ rises + 10 * first;
    V(c) <+ crossed;
end
endmodule
"""


def test_above_fires_at_the_start_and_cross_does_not(tmp_path: Path) -> None:
    """1.5 + sin wt lies above 1 at the start; it falls through 1 at 7/12 of each period and rises through it at 11/12."""
    deck = "V1 in 0 sin(1.5 1 1k)\nN1 in a c m\nR1 a 0 1k\nR2 c 0 1k\n.model m ceiling\n"
    found = run(tmp_path, ABOVE, f"{deck}.tran 10u 3m\n.save v(a) v(c)")
    assert asin(-0.5) == pytest.approx(-pi / 6)
    for k in range(1, 30):
        t = k * 1e-4 + 1e-5
        falls, rises = int(t * 1e3 + 5 / 12), int(t * 1e3 + 1 / 12)
        assert found.at("v(a)", t) == pytest.approx(1 + rises + 15, abs=1e-9)
        assert found.at("v(c)", t) == falls + rises
    assert run(tmp_path, ABOVE, f"{deck}.op\n.save v(a)")["v(a)"][-1] == pytest.approx(16, abs=1e-9)
    # sweeps see above alone
    swept = run(tmp_path, ABOVE, f"{deck}.dc V1 0 2 0.5\n.save v(a) v(c)")
    assert list(swept["v(a)"]) == pytest.approx([0, 0, 0, 1, 1], abs=1e-9)
    assert list(swept["v(c)"]) == [0] * 5


TIMER = """module clocked(a, b, c); inout a, b, c; electrical a, b, c;
parameter real start = 0.3m, period = 0.25m;
integer n, once;
real when;
analog begin
    @(timer(start, period)) begin n = n + 1; when = $abstime; end
    @(timer(0.7m)) once = 1;
    V(a) <+ n;
    V(b) <+ 1k * when;
    V(c) <+ once;
end
endmodule
"""


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("start", [0.3e-3, 0.0, -0.1e-3])
def test_timers_fire_when_they_say(start: float, method: str, tmp_path: Path) -> None:
    """At start + k period, from the run's beginning on."""
    deck = f"N1 a b c m\nR1 a d 1k\nC1 d 0 1n\nR2 b 0 1k\nR3 c 0 1k\n.model m clocked start={start}\n"
    found = run(tmp_path, TIMER, f"{deck}.options method={method}\n.tran 50u 3m\n.save v(a) v(b) v(c)")
    instants = [start + k * 0.25e-3 for k in range(20) if start + k * 0.25e-3 > -1e-9]
    for k in range(1, 29):
        t = k * 1e-4 + 2e-5
        gone = [i for i in instants if i < t]
        assert found.at("v(a)", t) == pytest.approx(len(gone), rel=1e-12)
        assert found.at("v(b)", t) == pytest.approx(1e3 * gone[-1] if gone else 0, abs=1e-9)
        assert found.at("v(c)", t) == pytest.approx(float(t > 0.7e-3), rel=1e-12)


MOVING = """module moving(in, out); inout in, out; electrical in, out;
real threshold, beyond;
analog begin
    @(initial_step) threshold = 0.5;
    beyond = V(in) - threshold;
    @(cross(beyond) or timer(2m)) threshold = -threshold;
    V(out) <+ threshold;
end
endmodule
"""


@pytest.mark.parametrize("method", ["auto", "radau", "gear"])
def test_a_threshold_moves_with_what_its_event_sets(method: str, tmp_path: Path) -> None:
    """sin wt comes to 1/2 at 1/12 of a period, then to -1/2 at 7/12. A timer at 2 ms turns the threshold to -1/2, which is
    crossed at 2 ms + 7/12 downwards, and 1/2 at 3 ms + 1/12 upwards."""
    deck = f"V1 in 0 sin(0 1 1k)\nN1 in out m\nR1 out 0 1k\n.model m moving\n.options method={method}\n"
    found = run(tmp_path, MOVING, f"{deck}.tran 10u 4m\n.save v(out)")
    turns = [1 / 12, 7 / 12, 13 / 12, 19 / 12, 2, 2 + 7 / 12, 3 + 1 / 12, 3 + 7 / 12]
    for k in range(80):
        t = 0.05 * k + 0.02
        assert found.at("v(out)", t * 1e-3) == pytest.approx(
            0.5 * (-1) ** sum(t > u for u in turns), abs=1e-12
        )


LAST = """module last(in, a, b); inout in, a, b; electrical in, a, b;
real first, twice, since;
analog begin
    @(initial_step) first = V(in);
    @(initial_step) twice = 2 * first;
    since = last_crossing(V(in) - 0.5, -1);
    V(a) <+ since < 0 ? -1 : 1k * since;
    V(b) <+ twice;
end
endmodule
"""


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_the_last_crossing_and_the_first_values(method: str, tmp_path: Path) -> None:
    """sin(wt + pi/2) falls through 1/2 at 1/6 of a period and each period later; at the start it is 1."""
    deck = f"V1 in 0 sin(0 1 1k 0 0 90)\nN1 in a b m\nR1 a 0 1k\nR2 b 0 1k\n.model m last\n.options method={method}\n"
    found = run(tmp_path, LAST, f"{deck}.tran 10u 3m\n.save v(a) v(b)")
    for k in range(1, 30):
        t = 0.1 * k  # ms
        then = int(t - 1 / 6) + 1 / 6 if t > 1 / 6 else -1
        assert found.at("v(a)", t * 1e-3) == pytest.approx(then, abs=1e-6)
        assert found.at("v(b)", t * 1e-3) == pytest.approx(2, rel=1e-12)


def test_a_run_of_the_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from emsim.cli import main

    (tmp_path / "m.va").write_text(HEAD + DIVIDER)
    (tmp_path / "deck.cir").write_text(
        "title\n.hdl m.va\nV1 in 0 sin(0 1 1k 0 0 -90)\nN1 in a m\nR1 a 0 1k\n.model m divider\n.tran 50u 10m\n"
        ".meas tran up when v(a)=0.5 rise=1\n.end\n"
    )
    assert main([str(tmp_path / "deck.cir"), "-q"]) == 0
    assert "2.250000e-03" in capfd.readouterr().out  # the third edge


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("@(absdelta(V(a), 0)) x = 1;", "a way of 0"),
        ("@(timer(V(a))) x = 1;", "a timer whose start or period hangs on voltages"),
        ("@(timer(0, -1)) x = 1;", "every -1 s"),
        ("@(cross(V(a), 2)) x = 1;", "a direction of 2"),
        ("@(cross(V(a), 1, 1n, 1n, 1, 1)) x = 1;", "takes 1 to 5 arguments"),
        ("@(cross(V(a), 1)) x = 1; x = 2;", "set at an event and here"),
        ("if (V(a) > 0) @(cross(V(a), 1)) x = 1;", "inside of a condition"),
        ("@(cross(V(a), 1)) I(a) <+ 1;", "contribution at an event"),
        ('@(cross(V(a), 1)) x = 1; I(a) <+ white_noise(x, "x");', "noise that hangs on events"),
    ],
)
def test_what_is_not_there_is_refused_by_name(statement: str, said: str, tmp_path: Path) -> None:
    module = f"module bad(a); inout a; electrical a; real x; real y[0:1]; analog begin {statement} I(a) <+ x; end\nendmodule\n"
    with pytest.raises(emsim.DeckError, match=said):
        run(tmp_path, module, "R1 a 0 1\nN1 a m\n.model m bad\n.op")
