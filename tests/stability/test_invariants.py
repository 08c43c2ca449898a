"""What must hold at every recorded row, whichever method made it; a row in which it does not is told by name: Kirchhoff's laws,
and the closure of every loop."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim.assemble import options as settings

METHODS = ["auto", "trap", "gear", "radau", "trbdf2", "esdirk"]
TOLD = ("W406", "W407")

STAR = """three branches of a source and a coil, their star point free
V1 a 0 SIN(0 10 50)
V2 b 0 SIN(0 10 50 0 0 120)
V3 c 0 PWL(0 0 5m 0 7m 10 20m -5)
L1 a n 10m
L2 b n 20m
R3 c d 3
L3 d n 5m
.tran 0.1m 40m
.end
"""
BAR = """four-bar linkage
BODY crank shape=rod(0.10) m=0.10
BODY coupler shape=rod(0.24) m=0.24
BODY rocker shape=rod(0.20) m=0.20
JOINT a 0 crank pin ic=(0,10)
JOINT b crank(0.10,0) coupler pin guess=56deg
JOINT d 0(0.22,0) rocker pin guess=86deg
JOINT close coupler(0.24,0) rocker(0.20,0) pin
.gravity 9.81
.tran 5m 0.5
.end
"""


# an exponential of which tolerances of 12 V are worth any current
CLAMP = """a clamp to 12 V
V1 b 0 12
I1 0 a SIN(1m 0.5m 1k)
D1 a b d
.model d D(is=1p)
.tran 20u 4m
.end
"""
FLOATING = {
    "capacitors": ("C2 x 0 2n", "1n"),
    "a resistance between": ("C2 x y 2n\nR1 y z 1k\nC3 z 0 3n", "1n"),
    "a gate": (
        "M1 d x 0 0 nm\nRd vdd d 10k\nVd vdd 0 5\n.model nm nmos(vto=1 kp=1m cgso=1u cgdo=0.2u)",
        "100p",
    ),
}
BRAKE = """a shaft that is braked
BODY a shape=disc(0.1) m=1
JOINT p 0 a pin ic=(0,10)
FRICTION f p fc=0.01
.tran 10m 2
.save all torque(f)
.end
"""


def told(result):
    return [d for d in result.diagnostics if d.code in TOLD]


def spoiled(monkeypatch, deck, name):
    """From now on rows show this unknown wrongly by a tenth."""
    place = emsim.compile(deck).names.index(name)
    resolve = settings.resolve
    monkeypatch.setattr(settings, "resolve", lambda *a, **k: {**resolve(*a, **k), "spoiled": place})


@pytest.mark.parametrize("method", METHODS)
def test_a_node_whose_currents_do_not_cancel_is_named(method, monkeypatch):
    assert not told(emsim.run(STAR, method=method))
    spoiled(monkeypatch, STAR, "l2")
    found = told(emsim.run(STAR, method=method))
    assert any("node `n`" in d.message for d in found), found
    assert all(d.code == "W406" and d.span is not None for d in found)


@pytest.mark.parametrize("method", METHODS)
def test_a_source_that_is_not_followed_is_named(method, monkeypatch):
    spoiled(monkeypatch, STAR, "d")
    assert told(emsim.run(STAR, method=method))


@pytest.mark.parametrize("method", [*METHODS, "dop853"])
def test_a_loop_that_is_open_is_named(method, monkeypatch):
    right = emsim.run(BAR, method=method)
    assert not told(right)
    assert right.stats["open"]["m"] < 1e-3 * 0.24  # of links this long, at reltol 1e-3
    spoiled(monkeypatch, BAR, "angle(b)")
    wrong = emsim.run(BAR, method=method)
    assert any(d.code == "W407" and "closed by close" in d.message for d in told(wrong)), told(wrong)
    assert wrong.stats["open"]["m"] > 0.01


def test_the_line_at_the_end_of_a_run_tells_how_far_loops_were_open(tmp_path, capsys):
    from emsim.cli import main

    (tmp_path / "bar.cir").write_text(BAR)
    assert main([str(tmp_path / "bar.cir"), "-o", str(tmp_path / "bar.raw")]) == 0
    assert ", loops closed to " in capsys.readouterr().err


@pytest.mark.parametrize("method", METHODS)
def test_the_first_row_fits_what_is_given_there(method):
    """The source's current at the start belonged to a nanosecond later: -1 A for (12 V - 0 V)/10 ohm."""
    deck = """a coil beside an RC of one nanosecond, from nothing
V1 a 0 12
Rs a s 10
Cs s 0 100p
L1 a b 0.5m
R1 b 0 1
.options reltol=1e-4
.tran 50u 1m UIC
.end
"""
    r = emsim.run(deck, method=method)
    assert float(r["i(v1)"][0]) == pytest.approx(-1.2, rel=1e-4)
    assert not told(r)


@pytest.mark.parametrize("method", METHODS)
def test_currents_of_one_loop_are_equal_in_the_rows_behind_a_corner(method):
    """Behind a corner rows had a source's current by another polynomial than the coil's: -0.026 A beside 0.010 A."""
    deck = """a ramp into a coil
V1 a 0 PWL(0 0 0.2 0 1 100)
R1 a b 0.05
L1 b 0 1.5m
.tran 25m 2
.end
"""
    r = emsim.run(deck, method=method)
    coil, source = np.asarray(r["i(l1)"]), np.asarray(r["i(v1)"])
    assert np.all(np.abs(coil + source) <= 1e-2 * np.abs(coil) + 1e-5)
    assert not told(r)


@pytest.mark.parametrize("method", ["auto", "esdirk", "radau", "trbdf2"])
def test_a_row_behind_a_switch_does_not_go_up_an_exponential(method):
    """A row 8 ns behind the edge had 1e17 A in the diode: the polynomial of the step that leapt over the edge."""
    deck = """flyback converter
Vin in 0 24
L1 in sw 100u
L2 0 sec 25u
K1 L1 L2 0.98
S1 sw 0 gate 0 sw1
D1 sec out df
C1 out 0 100u
RL out 0 10
Rsn sw sn 100
Csn sn 0 2n
Vg gate 0 PULSE(0 5 2u 200n 200n 6.8u 20u)
.model sw1 SW(vt=2.5 vh=0.2 ron=50m roff=1meg)
.model df D(is=1u n=1.1 rs=20m)
.tran 0.2u 400u
.end
"""
    r = emsim.run(deck, method=method)
    assert not told(r)
    on = np.asarray(r["v(sec)"]) - np.asarray(r["v(out)"])
    assert on.max() < 1.0


@pytest.mark.parametrize("method", METHODS)
def test_a_voltage_up_an_exponential_is_named(method, monkeypatch):
    """Ten tolerances of 12 V are ten factors of e: the bound of this row admitted 1e20 A."""
    assert not told(emsim.run(CLAMP, method=method))
    spoiled(monkeypatch, CLAMP, "a")
    assert any("node `a`" in d.message for d in told(emsim.run(CLAMP, method=method)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("below", FLOATING)
def test_charge_that_comes_from_nowhere_is_named(below, method, monkeypatch):
    """No row without a derivative sees a node that hangs on capacitances alone."""
    cards, farads = FLOATING[below]
    deck = f"a divider of charge\nV1 in 0 SIN(0 3 1k)\nC1 in x {farads}\n{cards}\n.tran 20u 3.7m\n.end\n"
    assert not told(emsim.run(deck, method=method))
    spoiled(monkeypatch, deck, "x")
    found = told(emsim.run(deck, method=method))
    assert any("the charge of" in d.message for d in found), found


@pytest.mark.parametrize("method", METHODS)
def test_an_effort_that_is_not_what_its_law_says_is_named(method, monkeypatch):
    assert not told(emsim.run(BRAKE, method=method))
    spoiled(monkeypatch, BRAKE, "lambda(f,1)")
    assert any("the law of FRICTION f" in d.message for d in told(emsim.run(BRAKE, method=method)))
