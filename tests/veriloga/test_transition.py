"""transition(): ramps in place of jumps, beside courses made from event to event by the words of LRM 4.5.8."""

from __future__ import annotations

from itertools import pairwise
from math import floor, pi, sin
from pathlib import Path

import pytest
from module_decks import HEAD, run

import emsim

METHODS = ["auto", "radau", "gear", "trap", "esdirk", "trbdf2", "dop853"]


class Ramp:
    """What transition gives, of the changes so far."""

    def __init__(self, first: float, rise: float, fall: float) -> None:
        self.origin = self.target = first
        self.times = fall, rise
        self.slope = 0.0
        self.end = -1.0

    def at(self, t: float) -> float:
        return self.target if t >= self.end else self.target + self.slope * (t - self.end)

    def change(self, t: float, target: float) -> None:
        if target == self.target:
            return
        y = self.at(t)
        goes_on = (target - y) * (self.target - y) > 0
        self.origin = self.origin if goes_on else self.target
        self.target, takes = target, self.times[target > y]
        self.slope = (target - self.origin) / takes if takes else 0.0
        self.end = t + (target - y) / self.slope if takes else t


def test_the_words_of_the_manual() -> None:
    """A rise of 1 in 2 s that turns at half of it falls with the slope of the whole way; one that goes on to 2 takes 2 s from
    its origin."""
    ramp = Ramp(0.0, 2.0, 4.0)
    ramp.change(1.0, 1.0)
    ramp.change(2.0, 0.0)
    assert [ramp.at(t) for t in (2.0, 3.0, 4.0)] == [0.5, 0.25, 0.0]
    ramp = Ramp(0.0, 2.0, 4.0)
    ramp.change(1.0, 1.0)
    ramp.change(2.0, 2.0)
    assert [ramp.at(t) for t in (2.0, 3.0, 3.5)] == [0.5, 1.5, 2.0]


STAIRS = """module stairs(in, out); inout in, out; electrical in, out;
parameter real td = 0, tr = 0.2m, tf = 0.2m;
analog V(out) <+ transition((V(in) > 0 ? 1 : 0) + (V(in) > 0.5 ? 1 : 0), td, tr, tf);
endmodule
"""
STAIRS_DECK = "V1 in 0 sin(0 1 1k 0 0 -90) ac 1\nN1 in out m\nR1 out 0 1k\n"


def stairs(t: float, td: float, tr: float, tf: float) -> float:
    """The input sin(wt - pi/2) passes 0 and 1/2 upwards at 1/4 and 1/3 of each period, and downwards at 2/3 and 3/4."""
    ramp = Ramp(0.0, tr, tf)
    for k in range(5):
        for part, level in ((1 / 4, 1.0), (1 / 3, 2.0), (2 / 3, 1.0), (3 / 4, 0.0)):
            if (k + part) * 1e-3 + td < t:
                ramp.change((k + part) * 1e-3 + td, level)
    return ramp.at(t)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("td", "tr", "tf"),
    [(0.0, 0.2e-3, 0.3e-3), (0.15e-3, 0.2e-3, 0.3e-3), (0.0, 0.05e-3, 1.1e-3), (0.0, 0.0, 0.4e-3)],
)
def test_ramps_are_interrupted(td: float, tr: float, tf: float, method: str, tmp_path: Path) -> None:
    card = f".model m stairs td={td} tr={tr} tf={tf}\n.options method={method} reltol=1e-6\n"
    if td > 0 and method == "dop853":
        with pytest.raises(emsim.ConvergenceError, match="it reads what was a time ago"):
            run(tmp_path, STAIRS, f"{STAIRS_DECK}{card}.tran 20u 3.5m\n.save v(out)")
        return
    found = run(tmp_path, STAIRS, f"{STAIRS_DECK}{card}.tran 20u 3.5m\n.save v(out)")
    for k in range(2, 345):
        t = k * 1e-5 + 3e-6
        # slopes are 2 in 0.05 ms at most, and crossings of the sine are known to a nanosecond
        assert found.at("v(out)", t) == pytest.approx(stairs(t, td, tr, tf), abs=2e-4)


def test_a_delay_without_ramps(tmp_path: Path) -> None:
    deck = f"{STAIRS_DECK}.model m stairs td=0.3m tr=0 tf=0\n.options reltol=1e-6\n.tran 10u 2m\n.save v(out)"
    found = run(tmp_path, STAIRS, deck)
    for k in range(2, 195):
        t = k * 1e-5 + 4e-6
        assert found.at("v(out)", t) == pytest.approx(stairs(t, 0.3e-3, 0.0, 0.0), abs=1e-6)


def test_operating_points_sweeps_and_small_signals(tmp_path: Path) -> None:
    """There it is its operand; a small signal does not pass a comparison."""
    deck = f"{STAIRS_DECK}.model m stairs td=0.1m\n.save v(out)\n"
    assert run(tmp_path, STAIRS, deck + ".op")["v(out)"][-1] == 0
    assert list(run(tmp_path, STAIRS, deck + ".dc V1 -0.25 1 0.5")["v(out)"]) == [0, 1, 2]
    assert abs(run(tmp_path, STAIRS, deck + ".ac lin 1 1k 1k")["v(out)"][0]) == 0


MODULATOR = """module modulator(in, out); inout in, out; electrical in, out;
parameter real period = 10u, edge = 2u;
real bit;
(* desc="of what is left" *) real sum;
analog begin
    @(initial_step) bit = 1;
    sum = idt((V(in) - V(out)) / period, 0);
    @(timer(period, period)) bit = sum > 0 ? 1 : -1;
    V(out) <+ transition(bit, 0, edge, 2 * edge);
end
endmodule
"""


@pytest.mark.parametrize("method", ["auto", "radau", "trap"])
def test_a_sigma_delta_modulator_of_continuous_time(method: str, tmp_path: Path) -> None:
    """Between instants of the clock the integral of the ramps is known: each change costs half of an edge."""
    deck = f"V1 in 0 0.3713\nN1 in out m\nR1 out 0 1k\n.model m modulator\n.options method={method} reltol=1e-7\n"
    found = run(tmp_path, MODULATOR, f"{deck}.tran 1u 2m\n.save v(out) @n1[sum]")
    bit, total, bits = 1.0, 0.0, []
    edges = {1.0: 0.2, -1.0: 0.4}  # of a period
    for k in range(199):
        old = bit
        if k > 0:
            bit = 1.0 if total > 0 else -1.0
        total += 0.3713 - bit + (bit - old) * edges[bit] / 2
        bits.append(bit)
        assert found.at("v(out)", (k + 0.9) * 1e-5) == pytest.approx(bit, abs=1e-9)
        assert found.at("@n1[sum]", (k + 1) * 1e-5) == pytest.approx(total, abs=2e-5)
    assert len(set(bits)) == 2


LOOP = """module vco(control, out); inout control, out; electrical control, out;
parameter real f0 = 1M, kv = 0.1M;
real phase;
analog begin
    phase = idtmod(f0 + kv * V(control), 0.25, 1.0);
    V(out) <+ sin(6.283185307179586 * phase);
end
endmodule
module pump(ref, vco, out); inout ref, vco, out; electrical ref, vco, out;
parameter real size = 100u, edge = 20n;
integer up, down;
analog begin
    @(cross(V(ref), 1)) begin
        if (down) down = 0; else up = 1;
    end
    @(cross(V(vco), 1)) begin
        if (up) up = 0; else down = 1;
    end
    I(out) <+ -transition(size * (up - down), 0, edge, edge);
end
endmodule
"""
F0, KV, REF, R, C, SIZE = 1e6, 1e5, 1.05e6, 10e3, 1e-9, 100e-6


def loop(stop: float) -> list[tuple[float, float]]:
    """Times and voltages of the filter's capacitor, from event to event: the current is a line in between, so the voltage is a
    square and the oscillator's phase a cube, whose next whole number is found by halving."""
    t, v, phase, up, down = 0.0, 0.0, 0.25, 0, 0
    ramp, edges, points = Ramp(0.0, 20e-9, 20e-9), 0, [(0.0, 0.0)]
    while t < stop:
        i = ramp.at(t)
        slope = ramp.slope if t < ramp.end else 0.0

        def later(
            s: float, i: float = i, slope: float = slope, v: float = v, p: float = phase
        ) -> tuple[float, float]:
            charge, moment = i * s + slope * s * s / 2, i * s * s / 2 + slope * s**3 / 6
            return v + charge / C, p + F0 * s + KV * (v * s + moment / C + R * charge)

        reference = (edges + 1 / 12) / REF
        corners = [reference] + ([ramp.end] if t < ramp.end else [])
        step, whole = min(corners) - t, floor(phase + 1e-9) + 1
        crosses = later(step)[1] > whole
        if crosses:
            low, high = 0.0, step
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (middle, high) if later(middle)[1] < whole else (low, middle)
            step = high
        v, phase = later(step)
        t = t + step if crosses else min(corners)
        if crosses:
            phase = float(whole)
            up, down = (0, down) if up else (up, 1)
        elif t == reference:
            edges += 1
            up, down = (up, 0) if down else (1, down)
        ramp.change(t, SIZE * (up - down))
        points.append((t, v))
    return points


@pytest.mark.parametrize("method", ["auto", "radau"])
def test_a_phase_locked_loop(method: str, tmp_path: Path) -> None:
    """1 MHz is pulled to 1.05 MHz: the capacitor ends at 0.5 V."""
    deck = (
        f"V1 ref 0 sin(0 1 {REF} 0 0 -30)\nN1 c o vco\nN2 ref o c pump\nR1 c f {R}\nC1 f 0 {C}\n.model vco vco\n"
        f".model pump pump\n.options method={method} reltol=1e-6\n.tran 50n 60u\n.save v(f)"
    )
    found = run(tmp_path, LOOP, deck)
    points = loop(60e-6)
    assert sin(2 * pi / 12) == pytest.approx(0.5)  # the source's phase of 30 degrees
    assert max(v for _, v in points) > 0.55
    # where the current is 0 between two events the voltage stands still
    quiet = [(a, b) for a, b in pairwise(points) if b[0] < 60e-6 and a[1] == b[1] and b[0] - a[0] > 1e-7]
    assert len(quiet) > 30
    for (begins, v), (ends, _) in quiet:
        assert found.at("v(f)", (begins + ends) / 2) == pytest.approx(v, abs=3e-4)


def test_a_run_of_the_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from emsim.cli import main

    (tmp_path / "m.va").write_text(HEAD + STAIRS)
    (tmp_path / "deck.cir").write_text(
        f"title\n.hdl m.va\n{STAIRS_DECK}.model m stairs tr=0.05m tf=0.1m td=0.1m\n.tran 10u 1m\n"
        ".meas tran half when v(out)=0.5 rise=1\n.end\n"
    )
    assert main([str(tmp_path / "deck.cir"), "-q"]) == 0
    assert "3.750" in capfd.readouterr().out  # 1/4 ms, the delay, half of the rise


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("V(out) <+ transition(V(in), 0, 1n);", "changes between events"),
        ("V(out) <+ transition(transition(V(in) > 0 ? 1 : 0, 0, 1n), 0, 1n);", "changes between events"),
        ("V(out) <+ transition($abstime, 0, 1n);", "changes between events"),
        ("V(out) <+ transition(V(in) > 0 ? 1 : 0, 0, V(in));", "a time of transition hangs on voltages"),
        ("V(out) <+ transition(V(in) > 0 ? 1 : 0, 0, -1n);", "a time of -0.000000001 s"),
        ("@(cross(V(in))) x = transition(V(in) > 0 ? 1 : 0, 0, 1n);", "transition at an event"),
    ],
)
def test_what_is_not_there_is_refused_by_name(statement: str, said: str, tmp_path: Path) -> None:
    module = f"module bad(in, out); inout in, out; electrical in, out; real x; analog begin {statement} end\nendmodule\n"
    with pytest.raises(emsim.DeckError, match=said):
        run(tmp_path, module, f"{STAIRS_DECK}.model m bad\n.op")
