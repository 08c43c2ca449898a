"""Digital parts: instants by closed form, states by their rules, circuits and machines that hang on them."""

from __future__ import annotations

import itertools
import math

import pytest

import emsim

BRIDGES = """
.model adc adc_bridge(in_low=0.5 in_high=0.5 rise_delay=1n fall_delay=1n)
.model dac dac_bridge(out_low=0 out_high=1 t_rise=1n t_fall=1n)
"""


def run(*lines: str, tran: str = ".tran 10n 10u") -> emsim.Result:
    return emsim.run("\n".join(["t", *lines, BRIDGES, tran, ".end"]))


def changes(result: emsim.Result, node: str) -> list[tuple[float, str]]:
    return [(t, state) for t, name, state in result.table("tran").digital if name == node]


def test_a_crossing_is_where_the_voltage_is_not_where_a_step_ends():
    """An RC charges as 1 - exp(-t/RC): it passes half at RC ln 2."""
    r = run(
        "V1 a 0 PULSE(0 1 1u 1f 1f 1 2)", "R1 a b 1k", "C1 b 0 2n", "A1 [b] [d] adc", ".options reltol=1e-7",
        tran=".tran 1u 20u",
    )  # fmt: skip
    (_, first), (at, state) = changes(r, "d")
    assert (first, state) == ("0s", "1s")
    assert at == pytest.approx(1e-6 + 2e-6 * math.log(2) + 1e-9, abs=2e-12)


def test_between_the_thresholds_a_level_is_undefined():
    r = run(
        "V1 a 0 PWL(0 0 10u 1)", "A1 [a] [d] m", ".model m adc_bridge(in_low=0.2 in_high=0.7 rise_delay=5n)"
    )
    times, states = zip(*changes(r, "d"), strict=True)
    assert states == ("0s", "Us", "1s")
    assert times == pytest.approx((0.0, 2e-6 + 5e-9, 7e-6 + 5e-9), abs=1e-14)


def gate_table(kind: str, inputs: tuple[int, ...]) -> int:
    return {
        "and": all(inputs), "nand": not all(inputs), "or": any(inputs), "nor": not any(inputs),
        "xor": sum(inputs) % 2, "xnor": 1 - sum(inputs) % 2,
    }[kind]  # fmt: skip


@pytest.mark.parametrize("kind", ["and", "nand", "or", "nor", "xor", "xnor"])
def test_a_gate_is_its_table(kind):
    for inputs in itertools.product((0, 1), repeat=3):
        sources = [f"V{k} n{k} 0 {v}" for k, v in enumerate(inputs)]
        r = emsim.run("\n".join([
            "t", *sources, "A1 [n0 n1 n2] [a b c] adc", "A2 [a b c] y g", "A3 [a ~b c] z g", f".model g d_{kind}",
            BRIDGES, ".op", ".end",
        ]))  # fmt: skip
        op = r.table("op")
        assert float(op["v(y)"][0]) == gate_table(kind, inputs)
        assert float(op["v(z)"][0]) == gate_table(kind, (inputs[0], 1 - inputs[1], inputs[2]))


def test_a_ring_swings_with_twice_the_sum_of_its_delays():
    """Three inverters: every edge goes round in the sum of a rise and a fall in turn."""
    r = run(
        "V1 en 0 PULSE(0 1 50n 1n 1n 1 2)", "A1 [en] [e] adc", "A2 [e c] a nand", "A3 a b inv", "A4 b c inv",
        ".model nand d_nand(rise_delay=7n fall_delay=5n)", ".model inv d_inverter(rise_delay=6n fall_delay=9n)",
        tran=".tran 1n 2u",
    )  # fmt: skip
    ups = [t for t, state in changes(r, "c") if state == "1s"]
    periods = [b - a for a, b in itertools.pairwise(ups[1:])]
    assert len(periods) > 40
    # a falls, b rises, c falls, a rises, b falls, c rises
    assert periods == pytest.approx([(5 + 6 + 9 + 7 + 9 + 6) * 1e-9] * len(periods), abs=1e-14)


@pytest.mark.parametrize(("width", "comes_out"), [(4, False), (8, False), (10, True)])
def test_a_pulse_shorter_than_the_difference_of_the_delays_is_lost(width, comes_out):
    r = run(
        f"V1 a 0 PULSE(0 1 100n 1p 1p {width}n 1)", "A1 [a] [d] adc", "A2 d q slow",
        ".model slow d_buffer(rise_delay=12n fall_delay=3n)", tran=".tran 1n 200n",
    )  # fmt: skip
    ups = [t for t, state in changes(r, "q") if state == "1s"]
    assert bool(ups) == comes_out
    if ups:
        assert ups[0] == pytest.approx(113e-9, abs=1e-11)


def test_a_counter_counts_and_its_ladder_is_a_staircase():
    stages = "\n".join(
        f"A{k + 2} one {'clk' if k == 0 else f'n{k - 1}'} null null q{k} n{k} tff" for k in range(4)
    )
    r = run(
        "V1 c 0 PULSE(0 1 0.1u 1n 1n 0.1u 0.2u)", "A1 [c] [clk] adc", "A9 one pull", stages,
        ".model pull d_pullup", ".model tff d_tff", tran=".tran 5n 4u",
    )  # fmt: skip
    table = r.table("tran")
    for count in range(1, 16):
        at = 0.1e-6 + 0.2e-6 * count - 20e-9  # before the next rise
        assert sum(round(float(table.at(f"v(q{k})", at))) << k for k in range(4)) == count % 16


def test_a_bus_has_what_the_enabled_driver_says_and_its_pull_up_otherwise():
    r = run(
        "V1 a 0 0", "V2 e1 0 PULSE(0 1 1u 1n 1n 1u 10u)", "V3 e2 0 PULSE(0 1 3u 1n 1n 1u 10u)",
        "A1 [a e1 e2] [d x1 x2] adc", "A2 d x1 bus tri", "A3 ~d x2 bus tri", "A4 bus pull",
        ".model tri d_tristate(delay=1n)", ".model pull d_pullup", tran=".tran 10n 6u",
    )  # fmt: skip
    assert [state for _, state in changes(r, "bus")] == ["1r", "0s", "1r", "1s", "1r"]


def test_drivers_that_contradict_each_other_leave_a_node_undefined():
    r = run(
        "V1 a 0 PULSE(0 1 1u 1n 1n 1u 2u)", "A1 [a] [d] adc", "A2 d bus buf", "A3 ~d bus buf", "A4 d same buf",
        "A5 d same buf", ".model buf d_buffer", tran=".tran 10n 3u",
    )  # fmt: skip
    assert {state for _, state in changes(r, "bus")} == {"Us"}
    assert [state for _, state in changes(r, "same")] == ["0s", "1s", "0s"]


def test_a_bridge_goes_at_the_slope_of_a_whole_ramp():
    """A level that turns back half-way comes back from where it is."""
    r = run(
        "V1 a 0 PULSE(0 1 1u 1p 1p 0.4u 10u)", "A1 [a] [d] adc", "A2 [d] [out] m", "R1 out 0 1k",
        ".model m dac_bridge(out_low=-1 out_high=3 t_rise=0.8u t_fall=1.6u)", tran=".tran 10n 5u",
    )  # fmt: skip
    table = r.table("tran")
    top = -1 + 4 * 0.4 / 0.8
    for at, value in ((0.5e-6, -1), (1.201e-6, 0), (1.401e-6, top), (1.801e-6, top - 1), (4e-6, -1)):
        assert float(table.at("v(out)", at)) == pytest.approx(value, abs=1e-3)


def test_an_oscillator_keeps_every_edge_whatever_the_steps():
    """Phase 5e5 t + 1.5e10 t^2 periods, low first: a rise at every n + 0.7, a fall at every whole number."""
    r = run(
        "V1 c 0 PWL(0 0 100u 1)", "A1 c q osc",
        ".model osc d_osc(cntl_array=[0 1] freq_array=[500k 3.5meg] duty_cycle=0.3 rise_delay=1p fall_delay=1p)",
        tran=".tran 1u 100u",
    )  # fmt: skip

    def at(phase: float) -> float:
        a, b = 1.5e10, 5e5
        return 2.0 * phase / (b + math.sqrt(b * b + 4.0 * a * phase))

    found = changes(r, "q")[1:]
    assert len(found) == 2 * 200 - 1 or len(found) == 2 * 200
    for k, (t, state) in enumerate(found):
        n, rises = divmod(k, 2)
        assert state == ("0s" if rises else "1s")
        assert t == pytest.approx(at(n + (1.0 if rises else 0.7)), abs=2e-10)


def test_an_encoder_counts_and_a_flip_flop_stops_the_motor():
    """32 pulses a turn, the supply is cut at the 48th: at 47 whole pulses and 0.3 rad of the next."""
    deck = """t
BODY disc shape=disc(0.02) m=20m
JOINT shaft 0 disc pin
MOTOR m a 0 shaft kt=10m r=2 l=0.5m
DAMPER d shaft c=5u
B1 pulses 0 V={sin(32*angle(shaft)-0.3)}
A1 [pulses] [p] comparator
A2 p done count
A3 one pull
A4 one done null null off null latch
A5 [off] [gate] bridge
V1 supply 0 6
S1 supply a gate 0 switch
.model comparator adc_bridge(in_low=0 in_high=0 rise_delay=1n fall_delay=1n)
.model count d_fdiv(div_factor=100 high_cycles=50 i_count=53 rise_delay=1n fall_delay=1n)
.model pull d_pullup
.model latch d_dff(ic=0)
.model bridge dac_bridge(out_low=5 out_high=0 t_fall=1u)
.model switch sw(vt=2.5 ron=10m roff=1meg)
.tran 1m 0.6
.end
"""
    r = emsim.run(deck)
    (at, state) = changes(r, "off")[-1]
    assert state == "1s"
    table = r.table("tran")
    assert float(table.at("angle(shaft)", at)) == pytest.approx((47 * 2 * math.pi + 0.3) / 32, abs=1e-4)
    assert abs(float(table.at("i(m)", at - 1e-5))) > 0.1
    assert abs(float(table.at("i(m)", 0.6))) < 1e-5


def test_the_energy_balance_of_bridges_closes():
    r = emsim.run(
        "t\nV1 a 0 PULSE(0 1 0.2u 10n 10n 0.4u 1u)\nA1 [a] [d] adc\nA2 [d] [out] dac\nR1 out b 1k\nC1 b 0 100p\n"
        + BRIDGES + ".tran 10n 5u\n.end\n", energy=True,
    )  # fmt: skip
    assert r.energy.share < 1e-3


def test_levels_are_read_in_expressions_measured_and_printed():
    r = run(
        "V1 a 0 PULSE(0 1 1u 1n 1n 1u 10u)", "A1 [a] [d] adc", "B1 out 0 V={3*v(d)}", "R1 out 0 1k",
        ".print tran d v(d)", ".meas tran high when v(d)=0.75 rise=1", tran=".tran 10n 5u",
    )  # fmt: skip
    assert float(r.table("tran").at("v(out)", 1.5e-6)) == 3.0
    assert float(r.measures["high"]) == pytest.approx(1e-6 + 1.5e-9, abs=1e-11)
    assert r.unit("v(d)") == ""


@pytest.mark.parametrize("card", [".ss 10n 2u", ".sens v(a) tran by r1\n.tran 10n 2u"])
def test_what_goes_along_with_the_state_alone_is_refused_by_name(card):
    with pytest.raises((emsim.DeckError, emsim.ConvergenceError), match="digital nodes"):
        run("V1 a 0 PULSE(0 1 0 1n 1n 1u 2u)", "R1 a 0 1k", "A1 [a] [d] adc", tran=card)


def test_what_finds_no_rest_is_undefined_before_a_run():
    """A transparent latch that its own negation feeds; behind it, and beside it, everything is as it is."""
    r = run(
        "V1 a 0 1", "R1 a 0 1k", "A1 [a] [e] adc", "A2 nq e null null q nq latch", "A3 q x inv", "A4 e y inv",
        ".model latch d_dlatch(ic=0)", ".model inv d_inverter", tran=".tran 1n 50n",
    )  # fmt: skip
    assert [changes(r, node) for node in "qxy"] == [[(0.0, "Us")], [(0.0, "Us")], [(0.0, "0s")]]
