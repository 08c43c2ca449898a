"""auto: explicit where nothing is stiff, implicit where it is, both ways in one run; another method where one gives up."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from support import deck, run

import emsim

tight = cache(run)  # one run for all the tolerances that are held against it

# a low-pass of 1 ns beside an oscillator of 1 Hz, joined by a switch for a while in the middle of the run
COMES_AND_GOES = """a fast low-pass that is there from 3 s to 6 s
L1 a 0 {1/6.283185307179586}
C1 a 0 {1/6.283185307179586} IC=1
Vg g 0 PULSE(0 1 3 1m 1m 3 100)
S1 a b g 0 sw
R1 b 0 1meg
C2 b 0 1p
.model sw SW(vt=0.5 ron=1k roff=1e18)
.print tran v(a)
.tran 0.1 10 uic
.end
"""
SMOOTH = """an oscillator whose damping fades away
C1 x 0 1 IC=1
C2 y 0 1 IC=0
B1 0 x I={v(y)}
B2 0 y I={-v(x) - 2e5*exp(-time)*v(y)}
.print tran v(x) v(y)
.tran 0.5 80 uic
.end
"""
DIODE_AND_COIL = "electrical/flyback"
RUNG = """a tank that a pulse charges through a diode, and that rings for eighty periods
V1 in 0 PULSE(0 5 1u 10n 10n 5u 1m)
D1 in a dm
L1 a 0 100u
C1 a 0 1n
R1 a 0 100k
.model dm D(is=1e-14 rs=1 cjo=5p)
.tran 0.1u 200u
.end
"""
LEAKS = """a flyback converter whose leakage inductance rings with the capacitance of its switch
V1 in 0 12
L1 in d 100u
L2 0 s 100u
K1 L1 L2 0.98
S1 d 0 g 0 sw
Vg g 0 PULSE(0 5 0 10n 10n 5u 10u)
D1 s out dm
C1 out 0 10u ic=12
R1 out 0 10
Cd d 0 200p
.model sw SW(vt=2.5 vh=0.1 ron=0.05 roff=1meg)
.model dm D(is=1e-12 rs=0.02 cjo=50p)
.tran 0.1u 20u uic
.end
"""


def methods(result: emsim.Result) -> list[str]:
    return [name for _, name, _ in result.stats["methods"]]


def test_nothing_stiff_is_explicit():
    result = run(deck("mechanical/ref_double_pendulum"), "reltol=1e-6")
    assert methods(result) == ["dop853"]


@pytest.mark.parametrize("spacing", ["10u", "80u", "200u"])
@pytest.mark.parametrize("reltol", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
def test_an_oscillation_is_not_a_silent_mode(reltol, spacing):
    """The conductance of a limit cycle is beyond the explicit bound for a step now and then: looked at once in 64 steps, two runs
    of five went on implicitly, at twice the price. Without corners dop853 is the cheaper explicit method at any tolerance."""
    found = run(deck("bench/lc_oscillator"), f"reltol={reltol!r}", tran=f"{spacing} 4m uic")
    assert methods(found) == ["dop853"]
    other = run(deck("bench/lc_oscillator"), f"method=dop853 reltol={reltol!r}", tran=f"{spacing} 4m uic")
    assert found.stats["steps"] == other.stats["steps"]


def test_stiff_from_the_start_is_implicit():
    result = run(deck("hard/step_collapse"), "method=auto reltol=1e-6")
    assert methods(result)[0] == "radau" and result.stats["steps"] < 2000


@pytest.mark.parametrize("reltol", [1e-3, 1e-6, 1e-9])
def test_linear_machines_are_solved_like_linear_circuits(reltol):
    """A mass on a spring, pushed: one solution a step, its factorisation kept, of order 13. x'' + 2 d x' + w^2 x = F/m."""
    text = """a mass on a spring
BODY   m m=2
JOINT  x 0 m slide axis=(1,0) damp=0.4
SPRING k x k=50
FORCE  push m dir=(1,0) PULSE(0 3 0 1u 1u 100 200)
.print tran pos(x) vel(x)
.tran 50m 20
.end
"""
    found = run(text, f"reltol={reltol!r}")
    assert found.stats["methods"] == [(0.0, "radau", "linear equations")]
    taken = found.stats["steps"] + found.stats["rejected"]
    assert found.stats["iterations"] <= taken + 10, found.stats
    assert found.stats["factorisations"] <= 4 * taken, found.stats
    other = run(text, f"method=dop853 reltol={reltol!r}")
    assert found.stats["evaluations"] < 0.5 * other.stats["evaluations"]
    # the ramp of 1 us is a step half of it later
    t, d, w = np.asarray(found.time) - 0.5e-6, 0.1, np.sqrt(25 - 0.01)
    want = 3 / 50 * (1 - np.exp(-d * t) * (np.cos(w * t) + d / w * np.sin(w * t)))
    assert np.abs(found["pos(x)"] - want)[t > 0].max() <= max(10 * reltol * np.ptp(want), 1e-11)


@pytest.mark.parametrize("name", ["bench/cart_pole", "coupled/pendulum_servo", "bench/two_link_arm"])
def test_a_mode_that_dies_long_before_the_end_is_implicit(name):
    """A winding settles 2000 to 15 000 times within the run: explicit steps would be cut by it to the end."""
    found = run(deck(name), "method=auto reltol=1e-6")
    assert methods(found) == ["radau"]
    assert found.stats["steps"] < 0.3 * run(deck(name), "method=dop853 reltol=1e-6").stats["steps"]


def test_from_explicit_to_implicit():
    """Stiffness that comes with the solution: a Van der Pol oscillator's slow branch."""
    text = "vdp\nC1 x 0 1 IC=2\nC2 y 0 1 IC=0\nB1 0 x I={v(y)}\nB2 0 y I={mu(time)*((1-v(x)^2)*v(y)-v(x))}\n"
    text += ".func mu(t)={1+1e4*(0.5+0.5*tanh(20*(t-2)))}\n.print tran v(x)\n.tran 0.1 20 uic\n.end\n"
    found, reference = run(text, "method=auto reltol=1e-6"), tight(text, "method=radau reltol=1e-9")
    names = methods(found)
    assert names[0] == "dop853" and "radau" in names
    assert found.stats["steps"] < 5000
    t = np.linspace(0.1, 20, 80)
    apart = np.abs([found.at("v(x)", x) - reference.at("v(x)", x) for x in t])
    # on a front v falls by 3 in a millisecond: an error in time shows a thousand times larger there
    assert np.sort(apart)[:-4].max() < 1e-4 and apart.max() < 1e-2


def test_stiffness_that_fades():
    """There is no way back: the run ends as it began, on the same solution."""
    found, reference = run(SMOOTH, "method=auto reltol=1e-6"), tight(SMOOTH, "method=radau reltol=1e-9")
    names = methods(found)
    assert names == ["radau"]
    t = np.linspace(0.5, 80, 160)
    apart = [found.at("v(x)", x) - reference.at("v(x)", x) for x in t]
    assert np.abs(apart).max() < 1e-4


def test_a_switch_brings_stiffness_and_takes_it_away():
    found, reference = (run(COMES_AND_GOES, f"method={m} reltol=1e-6") for m in ("auto", "radau"))
    t = np.linspace(0.1, 9.9, 99)
    apart = [found.at("v(a)", x) - reference.at("v(a)", x) for x in t]
    assert np.abs(apart).max() < 1e-4
    assert found.stats["steps"] < 20_000


def test_a_silent_fast_mode_is_not_stepped_over_explicitly():
    """A tank of 700 MHz has died down after a microsecond: it shows in no error, and would wake up."""
    found = run(deck("hard/vhf_beside_machine"), "method=auto")
    assert np.abs(np.asarray(found["v(a)"])[found.time > 1e-3]).max() < 1e-9


def test_what_no_explicit_method_can_do():
    """A capacitor across what an expression gives is of index 2: implicit, and the reason is told. Where all is linear
    nobody asks."""
    loop = "loop\n{}\nC1 a 0 1m\n.tran 10m 1\n.end\n"
    for cards, why in (
        ("V1 a 0 SIN(0 1 1)\nR1 a 0 1", "linear"),
        ("B2 a 0 V={sin(6.28*time)}\nB1 a 0 I={v(a)^3}", "index 2"),
    ):
        result = run(loop.format(cards), "method=auto")
        assert methods(result) == ["radau"]
        assert why in result.stats["methods"][0][2]


# gear holds its steps to a tenth of what is asked
TIGHT = [("auto", 1e-6), ("auto", 1e-8), ("trap", 1e-6), ("gear", 1e-5), ("radau", 1e-8), ("esdirk", 1e-6)]


@pytest.mark.parametrize("method, tight", TIGHT)
def test_flyback_turns_its_diode_off(method, tight):
    """A diode without capacitance, in series with an inductance: steps creep into the corner of its current."""
    rough, fine = (run(deck(DIODE_AND_COIL), f"method={method} reltol={r:g}") for r in (1e-4, tight))
    end = [float(np.asarray(r["v(out)"])[-1]) for r in (rough, fine)]
    assert fine.status == "ok" and end[0] == pytest.approx(end[1], rel=1e-2)


def test_equal_decks_take_equal_steps():
    """Nothing is measured with a clock."""
    runs = [run(deck("bench/two_link_arm"), "method=auto reltol=1e-6") for _ in range(3)]
    assert all(np.array_equal(r.time, runs[0].time) for r in runs)
    assert all(r.stats["methods"] == runs[0].stats["methods"] for r in runs)


@pytest.mark.parametrize("reltol", [1e-2, 3e-3, 1e-3, 3e-4, 1e-5, 1e-7])
def test_loops_at_loose_tolerances(reltol):
    """Two windows that pass positions in which their constraints lose rank: explicit steps magnify what they are off them
    (omega by 0.2 of its range at 1e-3), so that an implicit method takes over near the first one. A single window has
    none and stays explicit."""
    for name, signal, step, used in (
        ("mechanical/ref_n_four_bar", "omega(q2)", 0.2, ["dop853", "radau"]),
        ("mechanical/ref_four_bar", "omega(a)", 0.05, ["dop853"]),
    ):
        tran = f"{step} {50 * step}"
        exact = tight(deck(name), "method=radau reltol=1e-9", tran=tran)
        found = run(deck(name), f"reltol={reltol!r}", tran=tran)
        assert methods(found) == used
        apart = [abs(found.at(signal, t) - exact.at(signal, t)) for t in step * np.arange(1, 50)]
        assert max(apart) <= 10 * reltol * np.ptp(exact[signal]), (name, max(apart))


TRANSIT_TIME = "transit time\nV1 a 0 SIN(0 10 100k)\nD1 a o d\nR1 o 0 1k\n.model d D(is=1n rs=1 tt=20n)\n.tran 0.1u 50u\n.end\n"


@pytest.mark.parametrize("reltol", [1e-4, 1e-6, 1e-8, 1e-9])
def test_transit_time_is_within_reach(reltol):
    """Steps of 0.03 ps at order 1 were all that was left to gear at 1e-9, 1e9 of them to go, and the run was refused."""
    found, reference = (
        run(TRANSIT_TIME, f"reltol={reltol!r}"),
        tight(TRANSIT_TIME, "method=radau reltol=1e-10"),
    )
    assert methods(found) == ["gear" if reltol >= 5e-7 else "radau"] and found.stats["steps"] < 300_000
    t = 1e-7 * np.arange(1, 500)
    assert np.abs(found.at("v(o)", t) - reference.at("v(o)", t)).max() < 10 * reltol


def apart(found: emsim.Result, exact: emsim.Result, signal: str, times: np.ndarray) -> float:
    off = np.abs(found.at(signal, times) - exact.at(signal, times))
    return float(off.max() / np.ptp(exact[signal]))


@pytest.mark.parametrize("reltol", [1e-2, 1e-3, 1e-4])
def test_what_rings_behind_a_diode(reltol):
    """By trbdf2, which no source's swing bounds either, v(a) was late by a twentieth of a period at 1e-3, 1.7 % of its range."""
    exact, found = tight(RUNG, "method=radau reltol=1e-9"), run(RUNG, f"reltol={reltol!r}")
    other = run(RUNG, f"method=trbdf2 reltol={reltol!r}")
    assert methods(found) == ["esdirk"] and found.stats["iterations"] < other.stats["iterations"]
    assert apart(found, exact, "v(a)", 1.01e-7 * np.arange(1, 1900)) <= 10 * reltol


DISCONTINUOUS = """a boost converter that lets its coil run empty: the switch's node rings in every other stretch
Vin in 0 12
L1 in d 10u
S1 d 0 g 0 sw
D1 d out dm
Cd d 0 100p
C1 out 0 10u ic=20
R1 out 0 400
Vg g 0 PULSE(0 5 0 20n 20n 1u 10u)
.model sw SW(vt=2.5 vh=0.2 ron=50m roff=1meg)
.model dm D(is=1e-11 rs=0.02 cjo=100p)
.tran 0.1u 100u uic
.save v(out) i(l1)
.end
"""


@pytest.mark.parametrize("text", [LEAKS, DISCONTINUOUS], ids=["leaks", "discontinuous"])
@pytest.mark.parametrize("reltol", [1e-3, 1e-4])
def test_many_steps_between_restarts(text, reltol):
    """A leakage that rings for a thousand steps from edge to edge; a coil that runs empty in every other stretch."""
    exact, found = tight(text, "method=radau reltol=1e-8"), run(text, f"reltol={reltol!r}")
    assert methods(found) == ["esdirk"]
    span = float(found.time[-1])
    for signal in ("v(out)", "i(l1)"):
        assert apart(found, exact, signal, span * (np.arange(1, 1980) / 1980.3)) <= 10 * reltol
