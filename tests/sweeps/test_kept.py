"""Runs whose equations differ in numbers alone are made from the equations of one, and are single runs to the last bit; what
is not of that kind is assembled anew."""

from __future__ import annotations

from pathlib import Path

import pytest

import emsim
from emsim.sweeps.kept import _same
from emsim.sweeps.runs import Point, Runner, Task
from emsim.sweeps.samples import SCHEMES

NETLISTS = Path(__file__).parents[2] / "netlists"

RC = """an RC whose values are parameters of parameters
.param r=1k tau=1m c={tau/r} top={5*sqrt(r/1k)}
V1 in 0 PULSE(0 {top} 0 {tau/100} 1n {2*tau} {5*tau})
R1 in out {r}
C1 out 0 {c*(1+0.1*sin(r))} ic=0
.tran 50u 5m
.meas tran high MAX v(out)
.meas tran half WHEN v(out)=1
.meas tran never WHEN v(out)=1000
.end
"""
# nested levels, multipliers, tolerances, a model's temperature, coupled coils, controlled sources, a diode beside
TOLERANCES = """parts that are off
.param n=2 gain={unif(3,0.1)}
V1 in 0 AC 1 SIN(0 {agauss(1,0.05,3)} 1k)
R1 in a {agauss(1k,50,3)} tc=1m
R2 a 0 10k tol=5%
L1 a 0 {gauss(10m,0.1,3)}
L2 b 0 40m tol=10%
K1 L1 L2 {unif(0.9,0.05)}
Rb b 0 1k
E1 c 0 b 0 {gain}
G1 0 d c 0 {1m*gain}
X1 c d half r={n*1k}
X2 d 0 half r={n*2k} m=2
.subckt half p q r=1
R1 p m {agauss(r/2,r/100,3)}
R2 m q {r/2} tol=1%
C1 m 0 10n tol=10%
.ends
D1 d 0 dd
.model dd D(is=1f rs=1)
.temp 50
.tran 10u 2m
.ac dec 2 10 10k
.save v(d) i(v1) i(l1)
.meas tran high MAX v(d)
.meas tran loss RMS i(v1)
.meas ac flat FIND db(v(d)) AT=1k
.end
"""
# the resistor's noise is of the value of the run
NOISE = """noise of a divider
.param r=1k
V1 in 0 1 AC 1
R1 in out {r}
R2 out 0 1k
C1 out 0 1n
.op
.noise v(out) v1 dec 2 1k 100k
.dc v1 0 2 0.5
.meas noise all INTEG onoise_spectrum
.meas dc most MAX v(out)
.end
"""
CASES = {
    "rc": (RC, ("r", "tau"), [(1e3 * 1.3**k, 1e-3 * 1.1**k) for k in range(5)]),
    "an element": (RC.replace("{c*(1+0.1*sin(r))}", "1u"), ("c1", "r"), [(1e-6 * 1.5**k, 1e3 + k) for k in range(4)]),
    "noise": (NOISE, ("r",), [(100.0 * 3**k,) for k in range(5)]),
    "servo": (NETLISTS / "coupled" / "pendulum_servo.cir", ("vp", "rload"), [(4.5 + k / 4, 1e5 + k) for k in range(4)]),
    "741": (
        NETLISTS / "electrical" / "opamp_741.cir", ("rl", "vcc", "x1.r8"),
        [(2e3 + 100 * k, 15.0 - k / 8, 100.0 + k) for k in range(3)],
    ),
}  # fmt: skip


def runner(
    source: object, names: tuple[str, ...] = (), signals: tuple[str, ...] = (), **options: object
) -> Runner:
    return Runner(Task(str(source), {}, names, signals, options, 1))


@pytest.mark.parametrize("case", CASES)
def test_runs_of_kept_equations_are_single_runs(case):
    source, names, values = CASES[case]
    made = runner(source, names, () if case == "noise" else ("v(out)",) if case != "servo" else ("i(m1)",))
    points = [Point(k, v, None) for k, v in enumerate(values)]
    found = [made.run(point) for point in points]
    assert made.kept is not None
    for point, outcome in zip(points, found, strict=True):
        assert _same(outcome, made.alone(point)), point
        assert made.kept.run(point) is not None
    # other values give other results
    assert len({str(o.measures) for o in found} | {str(o.signals) for o in found}) > 1


@pytest.mark.parametrize("scheme", ["mc", "corners", "sensitivity"])
def test_random_values_and_tolerances(scheme):
    made = runner(TOLERANCES, ("n",), ("v(d)", "i(l1)"))
    places = SCHEMES[scheme](6, 3).places(len(made.draws().drawn)) if scheme != "corners" else None
    if places is None:
        places = SCHEMES["mc"](8, 1).places(len(made.draws().drawn))
        places = [tuple(float(u > 0.5) for u in row) for row in places]
    points = [Point(k, (2.0 + k % 3,), row) for k, row in enumerate(places)]
    found = [made.run(point) for point in points]
    assert made.kept is not None
    for point, outcome in zip(points, found, strict=True):
        assert _same(outcome, made.alone(point)), point
    assert all(made.kept.run(point) is not None for point in points)


def test_it_is_the_run_of_its_deck():
    made = runner(RC, ("r",), ("v(out)",))
    found = [made.run(Point(k, (1e3 * 2**k,), None)) for k in range(4)]
    assert made.kept is not None
    one = emsim.run(RC, {"r": 8e3})
    assert (
        found[3].measures["high"] == one.measures["high"]
        and found[3].measures["half"] == one.measures["half"]
    )


# what is chosen by a value, is an expression of the engine, or is a device's is not of that kind
ANEW = {
    "expression": ("B1 b 0 V={r*v(a)}", "r"),
    "current of r that a column reads": ("R2 a b {r}\nR3 b 0 1\n.save i(r2) @r2[p]", "r"),
    "model": (".model dd D(is={r*1f})\nD1 a 0 dd", "r"),
    "area": ("D1 a 0 dd {r}\n.model dd D(is=1f)", "r"),
    "integer": ("R2 a 0 {int(r)}", "never"),
    "time": (".ic v(a)={r}", "r"),
    "option": (".options reltol={r*1m}", "r"),
    "measure": (".meas op two PARAM='2*r'", "r"),
    "temperature": ("R2 a 0 1k tc=1m", "temp"),
}


@pytest.mark.parametrize("case", ANEW)
def test_what_is_assembled_anew_is_right_too(case):
    added, name = ANEW[case]
    deck = f"t\n.param r=1\nV1 in 0 10\nR1 in a {{r}}\nRa a 0 1k\n{added}\n.op\n.save v(a)\n.meas op v FIND v(a)\n.end\n"
    names = ("r",) if name == "never" else (name,)
    made = runner(deck, names, ("v(a)",))
    points = [Point(k, (1.0 + k / 7,), None) for k in range(4)]
    found = [made.run(point) for point in points]
    assert all(_same(o, made.alone(p)) for o, p in zip(found, points, strict=True))
    assert not found[0].error and len({o.measures["v"] for o in found}) > 1
    assert (made.kept is None) == (case not in ("integer",))


def test_a_decision_that_falls_otherwise_is_made_anew():
    """A resistance of 0 is taken as 1 milliohm with a warning; a condition of parameters chooses a part."""
    deck = "t\n.param r=1\nV1 in 0 1\nR1 in a {r > 2 ? r : 10*r}\nRa a 0 1\n.op\n.meas op v FIND v(a)\n.end\n"
    made = runner(deck, ("r",))
    points = [Point(k, (v,), None) for k, v in enumerate((1.0, 1.5, 0.0, 1.9, 3.0))]
    found = [made.run(p) for p in points]
    assert made.kept is not None
    assert [made.kept.run(p) is not None for p in points] == [True, True, False, True, False]
    assert [o.measures["v"] for o in found] == pytest.approx([1 / 11, 1 / 16, 1 / 1.001, 1 / 20, 1 / 4])
    assert "W281" in found[2].warnings[0] and not found[3].warnings


def test_runs_that_fail_say_the_same():
    deck = (
        "t\n.param r=1\nV1 a 0 {1/r}\nR1 a b {r}\nD1 b 0 d\n.model d D(is=1f)\n"
        ".op\n.meas op v FIND v(b)\n.end\n"
    )
    made = runner(deck, ("r",))
    points = [Point(k, (v,), None) for k, v in enumerate((1.0, 2.0, 0.0, 1e-200, 3.0))]
    found = [made.run(p) for p in points]
    assert made.kept is not None
    assert all(_same(o, made.alone(p)) for o, p in zip(found, points, strict=True))
    assert "E124" in found[2].error and not found[4].error


def test_the_deck_is_as_it_was_behind_its_runs():
    """Other runs of the process read the deck's own lines."""
    made = runner(RC, ("r",))
    before = made.alone(Point(0, (1e3,), None))
    for k in range(5):
        made.run(Point(k, (2e3 + k,), None))
    assert made.kept is not None and _same(made.alone(Point(0, (1e3,), None)), before)
