"""memristor, filesource, cmeter, lmeter, d_genlut, oneshot with clear and retrig: closed forms, and ngspice's own runs; what
XSPICE has besides is told with what to write instead."""

from __future__ import annotations

import math
import subprocess

import numpy as np
import pytest
from support import needs_ngspice

import emsim
from emsim.elements.xspice import ABSENT

COURSE = "# a course\n0.2 1 5\n0.4 2, 6\n0.9 -1 2 ; the end\n"


def run(cards: str, folder=None, **options) -> emsim.Result:
    text = f"t\n{cards}\n.end\n"
    if folder is None:
        return emsim.run(text, options=options)
    (folder / "deck.cir").write_text(text, encoding="utf-8")
    return emsim.run(folder / "deck.cir", options=options)


def at(result: emsim.Result, signal: str, t: float) -> float:
    return float(np.interp(t, result["time"], result[signal]))


# ---- memristor ----


def test_a_memristor_integrates_what_is_beyond_its_threshold():
    cards = "V1 a 0 {v}\nA1 %gd(a 0) m\n.model m memristor(rmin=1k rmax=10k rinit=5k alpha=1e8 beta=2e9 vt=1)\n.tran 1u {t}"
    # below: alpha v; beyond: beta (v - vt) + alpha vt
    for v, t in ((0.5, 20e-6), (1.5, 1e-6), (-1.5, 1e-6), (-0.5, 20e-6)):
        rate = math.copysign(1e8 * min(abs(v), 1.0) + 2e9 * max(abs(v) - 1.0, 0.0), v)
        found = run(cards.format(v=v, t=t), reltol=1e-8)
        assert -v / float(found["i(v1)"][-1]) == pytest.approx(5e3 + rate * t, rel=1e-6)


def test_a_memristor_stands_at_its_bounds_and_comes_back():
    cards = "V1 a 0 PULSE(2 -2 20u 1n 1n 20u 40u)\nA1 %gd(a 0) m\n"
    model = ".model m memristor(rmin=1k rmax=10k rinit=5k alpha=0 beta=2e9 vt=1)"
    found = run(cards + model + "\n.tran 0.1u 80u", reltol=1e-8)
    r = -found["v(a)"] / found["i(v1)"]
    still = np.abs(found["v(a)"]) > 1.9
    assert r[still].min() == pytest.approx(1e3, rel=1e-6) and r[still].max() == pytest.approx(1e4, rel=1e-6)
    assert not found.diagnostics
    # 2e9 a second: a bound is left at once, and the other one reached after 4.5 us
    assert at(found, "i(v1)", 22e-6) == pytest.approx(2 / (1e4 - 2e9 * 2e-6), rel=1e-3)


# ---- filesource ----


def test_a_file_gives_the_courses(tmp_path):
    (tmp_path / "course.txt").write_text(COURSE, encoding="utf-8")
    cards = (
        "A1 [x y] m\nR1 x 0 1k\nR2 y 0 1k\n"
        '.model m filesource(file="course.txt" timescale=1m timeoffset=0.1m amploffset=[0.5 0] amplscale=[2 1])\n.tran 10u 1.5m'
    )
    found = run(cards, tmp_path)
    for t, x, y in (
        (0.05, 0.5, 0),
        (0.2, 1.5, 2.5),
        (0.3, 2.5, 5),
        (0.5, 4.5, 6),
        (0.75, 1.5, 4),
        (1.4, -1.5, 2),
    ):
        assert at(found, "v(x)", t * 1e-3) == pytest.approx(x, abs=1e-9)
        assert at(found, "v(y)", t * 1e-3) == pytest.approx(y, abs=1e-9)


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("timerelative=true", {0.1: 0.5, 0.2: 1.0, 0.4: 1.5, 0.6: 2.0, 1.05: 0.5, 1.6: -1.0}),
        ("amplstep=true", {0.1: 0.0, 0.3: 1.0, 0.39: 1.0, 0.5: 2.0, 0.89: 2.0, 1.0: -1.0}),
    ],
)
def test_times_may_count_from_the_line_before_and_values_may_hold(words, values, tmp_path):
    (tmp_path / "course.txt").write_text(COURSE, encoding="utf-8")
    found = run(
        f'A1 [x y] m\nR1 x 0 1k\nR2 y 0 1k\n.model m filesource(file="course.txt" timescale=1m {words})\n.tran 10u 1.7m',
        tmp_path,
    )
    for t, x in values.items():
        assert at(found, "v(x)", t * 1e-3) == pytest.approx(x, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0 1\n", "has 1 values"),
        ("0 1 2\n-1 1 2\n", "do not ascend"),
        ("0 a b\n", "is no number"),
        ("# none\n", "no line"),
    ],
)
def test_a_file_that_is_wrong_is_told(text, said, tmp_path):
    (tmp_path / "c.txt").write_text(text, encoding="utf-8")
    with pytest.raises(emsim.DeckError) as error:
        run('A1 [x y] m\nR1 x 0 1k\nR2 y 0 1k\n.model m filesource(file="c.txt")\n.tran 1u 1m', tmp_path)
    assert [d.code for d in error.value.diagnostics] == ["E340"] and said in error.value.diagnostics[
        0
    ].message


# ---- meters ----

METERED = """V1 s 0 1
R1 s a 1k
C1 a 0 1u
C2 a b 2u
Vz a c 0
C3 c 0 4u
L1 b 0 1m
L2 b d 2m
R2 d 0 1
R3 c 0 1k
A1 {node} o m
Ro o 0 1k
.model m {model}
.op"""


def test_meters_add_what_lies_at_a_node():
    assert float(run(METERED.format(node="a", model="cmeter(gain=1e6)"))["v(o)"][0]) == pytest.approx(7.0)
    assert float(run(METERED.format(node="b", model="lmeter(gain=1e3)"))["v(o)"][0]) == pytest.approx(2 / 3)


# ---- oneshot ----

PULSES = """V1 clk 0 PWL(0 0 1u 0 1.01u 1 2u 1 2.01u 0 4u 0 4.01u 1 5u 1 5.01u 0 12u 0 12.01u 1 13u 1 13.01u 0)
V2 clr 0 PWL(0 0 14u 0 14.01u 1 15u 1 15.01u 0)
A1 clk null {clear} o m
R1 o 0 1k
.model m oneshot(cntl_array=[0 10] pw_array=[5u 5u] clk_trig=0.5 rise_time=0.1u fall_time=0.1u rise_delay=0.2u fall_delay=0.3u
+ out_high=3 retrig={retrig})
.tran 50n 20u 0 20n"""
# rises and falls through the middle [us]: a trigger at 1.005, 4.005 and 12.005
HALF = {"rise": 0.25, "fall": 5.65}


@pytest.mark.parametrize(
    ("clear", "retrig", "edges"),
    [
        ("null", "false", [1.255, 6.655, 12.255, 17.655]),
        ("null", "true", [1.255, 9.655, 12.255, 17.655]),
        ("clr", "false", [1.255, 6.655, 12.255, 14.005]),
        ("clr", "true", [1.255, 9.655, 12.255, 14.005]),
    ],
)
def test_a_pulse_is_put_off_by_a_further_trigger_and_ended_by_clear(clear, retrig, edges):
    found = run(PULSES.format(clear=clear, retrig=retrig))
    t, v = found["time"], found["v(o)"]
    k = np.flatnonzero((v[:-1] < 1.5) != (v[1:] < 1.5))
    crossings = np.where(
        t[k + 1] > t[k],
        t[k] + (1.5 - v[k]) / np.where(v[k + 1] == v[k], 1, v[k + 1] - v[k]) * (t[k + 1] - t[k]),
        t[k],
    )
    assert crossings * 1e6 == pytest.approx(edges, abs=0.011)


# ---- d_genlut ----

GENLUT = """V1 a 0 PULSE(0 1 0 1n 1n 10u 20u)
V2 b 0 PULSE(0 1 0 1n 1n 20u 40u)
A0 [a b] [da db] ad
A1 [da db] [x y z] m
A2 [x y z] [vx vy vz] da
Rx vx 0 1k
Ry vy 0 1k
Rz vz 0 1k
.model ad adc_bridge
.model da dac_bridge(out_undef=0.3 t_rise=10n t_fall=10n)
.model m d_genlut(rise_delay=[100n 200n] fall_delay=[300n] input_delay=[50n 500n] input_load=[1p 1p] table_values="011001z10x11")
.tran 50n 60u 0 20n"""


def test_a_general_table_gives_each_output_its_part():
    found = run(GENLUT)
    assert not found.diagnostics
    # a and b as bits 0 and 1 -> entries 0110, 01z1, 0x11
    for t, values in ((5e-6, (0, 1, 1)), (15e-6, (1, 0.3, 1)), (25e-6, (1, 1, 0.3)), (35e-6, (0, 0, 0))):
        assert [at(found, f"v(v{n})", t) for n in "xyz"] == pytest.approx(values, abs=1e-9)
    # a falls at 50 us: the delay of its input, that of what rises, the bridges'
    later = found["time"] > 48e-6
    up = float(found["time"][later][np.flatnonzero(found["v(vx)"][later] >= 0.5)[0]])
    assert up == pytest.approx(50e-6 + 50e-9 + 100e-9 + 7e-9, abs=3e-9)


# ---- tables ----

# places of each input, not evenly apart; values that no plane or parabola goes through
AXES = ([0.0, 0.5, 1.5, 2.0, 3.0, 4.5], [0.0, 1.0, 1.5, 3.0, 3.5, 4.0], [-1.0, 0.0, 0.5, 2.0, 2.5, 3.0])


def table(inputs: int, order: int | None, sources: str, folder) -> str:
    """Cards of a table of `inputs` inputs, whose file they write."""
    axes = AXES[:inputs]
    values = [math.sin(3.0 * k * k) for k in range(math.prod(map(len, axes)))]
    rows = [" ".join(map(str, axis)) for axis in axes]
    rows += [
        " ".join(f"{v:.12g}" for v in values[k : k + len(axes[0])])
        for k in range(0, len(values), len(axes[0]))
    ]
    counts = "\n".join(str(len(axis)) for axis in axes)
    (folder / "values.txt").write_text("* table\n" + counts + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    said = "" if order is None else f" order={order}"
    ins = " ".join(f"%vd({n} 0)" for n in "xyz"[:inputs])
    return f'{sources}\nA1 {ins} %id(0 o) m\nR1 o 0 1\n.model m table{inputs}d(file="values.txt"{said})'


PLACES = "Vx x 0 0\nVy y 0 0\nVz z 0 1.2"
SWEEP = "\n.dc vx -0.5 5 0.25 vy -0.3 4.3 0.7"


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("order", [None, 2, 3])
@pytest.mark.parametrize("inputs", [2, 3])
def test_a_table_has_the_values_of_ngspice_at_every_order(inputs, order, tmp_path):
    cards = table(inputs, order, PLACES, tmp_path) + SWEEP
    tight = ".options reltol=1e-12 abstol=1e-15 vntol=1e-13 numdgt=14"
    text = f"t\n{cards}\n{tight}\n.control\nset numdgt=14\nrun\nwrdata ng.txt v(o)\nquit\n.endc\n.end\n"
    (tmp_path / "ng.cir").write_text(text, encoding="utf-8")
    subprocess.run(
        ["ngspice", "-b", "ng.cir"], cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, timeout=60
    )
    theirs = np.loadtxt(tmp_path / "ng.txt")[:, 1]
    ours = run(cards, tmp_path, reltol=1e-10)
    assert [d.code for d in ours.diagnostics] == ([] if order == 2 else ["W284"])
    values = np.ravel(ours.table("dc")["v(o)"])
    assert len(values) == len(theirs) and float(np.ptp(theirs)) > 1.0
    assert values == pytest.approx(theirs, abs=1e-9)


@pytest.mark.parametrize("order", [2, 3])
def test_small_signals_take_the_slope_of_a_tables_values(order, tmp_path):
    sources = "Vx x 0 {} ac 1\nVy y 0 1.2"
    gains = np.abs(
        run(table(2, order, sources.format(1.0), tmp_path) + "\n.ac lin 1 1 1", tmp_path).table("ac")["v(o)"]
    )
    low, high = (
        float(run(table(2, order, sources.format(x), tmp_path) + "\n.op", tmp_path).table("op")["v(o)"][0])
        for x in (0.9, 1.1)
    )
    assert float(gains[0]) == pytest.approx(abs(high - low) / 0.2, rel=1e-6) and float(gains[0]) > 0.1


# ---- ngspice ----

BESIDE = {
    "memristor": (
        "V1 s 0 SIN(0 3 1e6)\nR1 s a 500\nA1 %gd(a b) m\nRb b 0 100\n"
        ".model m memristor(rmin=1k rmax=10k rinit=7k alpha=1e8 beta=2e10 vt=1.0)\n.tran 5n 1.5u", ("v(a)", "v(b)")),
    "cmeter": (METERED.format(node="a", model="cmeter(gain=1e6)").replace(".op", ".tran 1u 10u"), ("v(o)",)),
    "lmeter": (METERED.format(node="b", model="lmeter(gain=1e3)").replace(".op", ".tran 1u 10u"), ("v(o)",)),
    **{f"oneshot {c} {r}": (PULSES.format(clear=c, retrig=r), ("v(o)",)) for c in ("null", "clr") for r in ("true", "false")},
    # of y not: ngspice makes a 0 of an undefined level that only becomes weaker
    "d_genlut": (GENLUT, ("v(vx)", "v(vz)")),
}  # fmt: skip


@needs_ngspice
@pytest.mark.ngspice
@pytest.mark.parametrize("name", BESIDE)
def test_ngspice_computes_the_same(name, tmp_path):
    cards, signals = BESIDE[name]
    # ngspice takes a million steps for a memristor at 1e-6
    reltol = 1e-4 if name == "memristor" else 1e-6
    text = f"t\n{cards}\n.options reltol={reltol}\n.control\nrun\nwrdata ng.txt {' '.join(signals)}\nquit\n.endc\n.end\n"
    (tmp_path / "ng.cir").write_text(text, encoding="utf-8")
    subprocess.run(
        ["ngspice", "-b", "ng.cir"], cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, timeout=120
    )
    theirs = np.loadtxt(tmp_path / "ng.txt")
    ours = run(cards, reltol=1e-6)
    for k, signal in enumerate(signals):
        values = theirs[:, 2 * k + 1]
        away = np.abs(np.interp(theirs[:, 0], ours["time"], ours[signal]) - values)
        size = max(float(np.ptp(values)), float(np.abs(values).max()))
        assert away.mean() < 0.01 * size, signal


@pytest.mark.parametrize("name", ABSENT)
def test_what_is_absent_is_told_with_what_to_write(name):
    with pytest.raises(emsim.DeckError) as error:
        run(f"V1 a 0 1\nA1 a b m\nR1 b 0 1\n.model m {name}\n.op")
    found = error.value.diagnostics[0]
    assert found.code == "E141" and f"{name} is not supported: write {ABSENT[name]}" in str(found.hint)
