"""Decks as they were met, with every option at its default, through the command line: exit 0 stands beside the right value."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.outputs import load

NARROW_PULSE = """a smooth pulse twice as wide as tstep
B1 0 a I={1m*exp(-((time-3.3m)/20u)^2)}
C1 a 0 1n
R1 a 0 1t
.tran 10u 10m
.end
"""
PWL_OF_CONSTANT = """pwl of a number beyond the table
v1 a 0 -100
b1 x 0 v=pwl(-100, -10,-8, 2,4, 12,9, 22,19)
b2 y 0 v=pwl(v(a), -10,-8, 2,4, 12,9, 22,19)
b3 z 0 v=pwl(50, -10,-8, 2,4, 12,9, 22,19)
b4 w 0 v=pwl(0.5, -10,-8, 2,4, 12,9, 22,19)
r1 a 0 1k
.op
.end
"""
AC_ONLY = """.title RLC filter
Vinput in 0 DC 0V AC SIN(0V 1V 50Hz 0s 0Hz)
R1 in out 1kOhm
L1 out a 10mH
C1 a 0 1uF
.options TEMP = 25
.ic
.ac dec 10 1Hz 1MegHz
.end
"""
DC_ONLY = """only a sweep
v1 a 0 1
r1 a 0 1k
.dc v1 0 5 0.1
.print dc v(a)
.end
"""
SPELLINGS = {
    "a micro sign that was encoded twice": (
        "V1 a 0 PULSE(0 5 0 1n 1n 1 2)\nR1 a b 1k\nC1 b 0 1\u00c2\u00b5\n.tran 10u 1m",
        5 * (1 - math.exp(-1e-6)),
    ),
    "points of PWL in brackets": ("V1 b 0 PWL (0,0) (100n,5) (200n,1)\nR1 b 0 1k\n.tran 1n 300n", 1.0),
    "parameters of a subcircuit on .params": (
        ".subckt half a b\n.params r1=1k\nR1 a b {r1}\nR2 b 0 {r1}\n.ends half\nV1 a 0 2\nX1 a b half\n.op",
        1.0,
    ),
    "a quoted name in a model that nobody uses": (
        'V1 b 0 1\nR1 b 0 1k\n.model ma d_source (input_file="abc.txt")\n.tran 1u 1m',
        1.0,
    ),
    "a model whose bracket closes on a line of its own": (
        "V1 a 0 1\nR1 a b 1k\nD1 b 0 dm\n.model dm d(\n+ is=(1e-14)\n+ n=1.2\n)\n.tran 1u 1m",
        0.74387,
    ),
    "a value that the control section sets": (
        "V1 a 0 PULSE(0 1 0 1n 1n 100m 200m)\nR1 a b 1k\nC1 b 0 1u\n"
        ".control\nalter R1 = 5k\ntran 10u 5m\n.endc",
        1 - math.exp(-1),
    ),
}


def status(scratch, text: str, *args: str) -> int:
    (scratch / "deck.cir").write_text(text, encoding="utf-8")
    return main([str(scratch / "deck.cir"), "-q", "-o", str(scratch / "deck.raw"), *args])


def test_a_narrow_pulse_charges_its_capacitor(scratch):
    """It ended at 0 V, with rows between -27.7 and 26.4 V."""
    assert status(scratch, NARROW_PULSE) == 0
    r = load(scratch / "deck.raw")
    t, v = np.asarray(r.time), np.asarray(r["v(a)"])
    z = (t - 3.3e-3) / 20e-6
    exact = 1e-3 / 1e-9 * 20e-6 * math.sqrt(math.pi) / 2 * (1 + np.array([math.erf(x) for x in z]))
    assert exact[-1] == pytest.approx(35.449, rel=1e-5)
    assert np.abs(v - exact).max() <= 1e-2 * exact[-1]
    assert v[-1] == pytest.approx(exact[-1], rel=1e-3)


def test_pwl_of_a_constant_goes_on_beyond_its_table_as_that_of_a_node_does(scratch):
    """-8 and 19, the ends of the table, where a node gave what ngspice gives."""
    assert status(scratch, PWL_OF_CONSTANT) == 0
    r = load(scratch / "deck.raw")
    assert [float(r[f"v({n})"][-1]) for n in "xyzw"] == pytest.approx([-98, -98, 47, 2.5], rel=1e-9)


def test_a_deck_of_ac_alone_computes_its_sweep(scratch):
    """Nothing was computed, without a word and with exit 0."""
    assert status(scratch, AC_ONLY) == 0
    r = load(scratch / "deck.raw")
    f = np.asarray(r["frequency"]).real
    jw = 2j * np.pi * f
    branch = jw * 10e-3 + 1 / (jw * 1e-6)
    assert len(f) == 61
    assert np.abs(np.asarray(r["v(out)"]) - branch / (1e3 + branch)).max() < 1e-9


def test_a_deck_of_dc_alone_computes_its_sweep(scratch, capsys):
    assert status(scratch, DC_ONLY) == 0
    r = load(scratch / "deck.raw")
    assert np.asarray(r["v(a)"]) == pytest.approx(0.1 * np.arange(51))
    assert np.asarray(r["i(v1)"]) == pytest.approx(-1e-4 * np.arange(51))


def test_a_deck_of_an_analysis_that_does_not_exist_is_no_success(scratch):
    assert status(scratch, "t\nV1 a 0 1\nR1 a 0 1k\n.hb 1k\n.end\n") == 1
    assert not (scratch / "deck.raw").exists()


@pytest.mark.parametrize("name", SPELLINGS)
def test_a_spelling_of_the_field_has_its_value(scratch, name):
    cards, value = SPELLINGS[name]
    (scratch / "deck.cir").write_text(f"{name}\n{cards}\n.end\n", encoding="utf-8")
    r = emsim.run(scratch / "deck.cir")
    assert float(r["v(b)"][-1]) == pytest.approx(value, rel=1e-3)


@pytest.mark.parametrize("value, code", [("5kg", "E256"), ("5mm", "E256")])
def test_a_unit_that_does_not_fit_is_refused_in_the_model_of_a_motor(value, code):
    """j=5kg of a data sheet was 5000 kg m^2."""
    model = f".model mm dcmotor(kt=25.5m r=1ohm j={value})"
    machine = "BODY rotor m=0.1 j=1e-4\nJOINT shaft 0 rotor pin\nMOTOR m1 a 0 shaft model=mm"
    text = f"t\nVs a 0 12\n{machine}\n{model}\n.tran 1m 5\n.end\n"
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run(text)
    assert [d.code for d in caught.value.diagnostics] == [code]
    assert caught.value.diagnostics[0].span.line == 6
