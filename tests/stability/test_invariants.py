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
