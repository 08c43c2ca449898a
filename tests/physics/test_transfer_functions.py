"""LAPLACE and FREQ of E, G and B sources: closed forms over frequency and in time, what has no transient, what is none."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

import emsim
from emsim.elements.transfer import Rational, divided

HEAD = "t\nV1 in 0 dc 1 ac 1\n.param tau=1m td=0.2m\n"
TAU, TD = 1e-3, 0.2e-3


def spectrum(source: str, points: str = "dec 5 1 10k") -> tuple[np.ndarray, np.ndarray]:
    """s and v(out) of a source that is the output."""
    table = emsim.run(f"{HEAD}{source}\nR9 out 0 1\n.ac {points}\n.end\n").table("ac")
    return 2j * math.pi * np.real(table["frequency"]), np.asarray(table["v(out)"])


FUNCTIONS = {
    "{1/(1+s*tau)}": lambda s: 1 / (1 + s * TAU),
    "{s*tau/(1+s*tau)}": lambda s: s * TAU / (1 + s * TAU),
    "{exp(-s*td)/(1+tau*s)**2}": lambda s: np.exp(-s * TD) / (1 + s * TAU) ** 2,
    "{1/(1+0.1*tau*s+tau^2*s^2)}": lambda s: 1 / (1 + 0.1 * TAU * s + (TAU * s) ** 2),
    "{(1+exp(-s*td))/2}": lambda s: (1 + np.exp(-s * TD)) / 2,
    "{(1+s*tau+s*s*1u)/(3+s*1u)}": lambda s: (1 + s * TAU + s * s * 1e-6) / (3 + s * 1e-6),
    "{1/((1+s)*(1+s*1u)*(1+s*1n))}": lambda s: 1 / ((1 + s) * (1 + 1e-6 * s) * (1 + 1e-9 * s)),
    "{1/(1+sqrt(s*tau))}": lambda s: 1 / (1 + np.sqrt(s * TAU)),
    "{exp(-sqrt(s*tau))}": lambda s: np.exp(-np.sqrt(s * TAU)),
    "{tanh(sqrt(s*1u)+1n)/(sqrt(s*1u)+1n)}": lambda s: (
        np.tanh(np.sqrt(s * 1e-6) + 1e-9) / (np.sqrt(s * 1e-6) + 1e-9)
    ),
}
FORMS = (
    "E1 out 0 LAPLACE {{V(in)}} {}", "E1 out 0 LAPLACE {{V(in)}} = {}", "G1 0 out LAPLACE {{V(in)}} {}",
    "E1 out 0 in 0 Laplace={}", "B1 out 0 V=V(in) Laplace={}", "B1 0 out I=V(in) laplace={}",
)  # fmt: skip


@pytest.mark.parametrize("function", FUNCTIONS)
def test_the_response_is_the_function(function):
    for form in FORMS:
        s, out = spectrum(form.format(function))
        wanted = FUNCTIONS[function](s)
        assert np.abs(out - wanted).max() < 1e-11 * np.abs(wanted).max(), form


def test_the_input_is_any_expression_and_m_counts():
    s, out = spectrum("R1 in b 1k\nR2 b 0 1k\nG1 0 out LAPLACE {2*V(in)-V(b)} {1/(1+s*tau)} m=3")
    assert np.abs(out - 4.5 / (1 + s * TAU)).max() < 1e-11


def test_a_step_through_two_poles_and_a_delay():
    deck = (
        "t\nV1 in 0 PULSE(1 2 0 1p 1p 1 2)\nE1 out 0 LAPLACE {V(in)} {exp(-s*0.5m)/((1+s*1m)*(1+s*2m))}\nR1 out 0 1\n"
        ".tran 10u 20m\n.options reltol=1e-8\n.end\n"
    )
    result = emsim.run(deck)
    t = np.asarray(result["time"]) - 0.5e-3
    late = t > 0
    t = t[late]
    wanted = 2.0 + np.exp(-t / 1e-3) - 2.0 * np.exp(-t / 2e-3)
    out = np.asarray(result["v(out)"])
    assert np.abs(out[late] - wanted).max() < 1e-6 and np.abs(out[~late] - 1.0).max() < 1e-9


def test_a_loop_with_an_integrator_finds_its_point_and_its_poles():
    deck = "t\nV1 in 0 PULSE(1 2 0 1p 1p 1 2)\nE1 out 0 LAPLACE {V(in)-V(out)} {10/s}\nR1 out 0 1\n"
    result = emsim.run(deck + ".tran 1m 0.5\n.options reltol=1e-8\n.end\n")
    t, out = np.asarray(result["time"]), np.asarray(result["v(out)"])
    assert np.abs(out - 2.0 + np.exp(-10.0 * t)).max() < 1e-6
    poles = emsim.run(deck + ".pz in 0 out 0 vol pol\n.end\n").table("pz")
    assert complex(poles[poles.names[0]][0]) == pytest.approx(-10.0, rel=1e-9)


def test_what_is_above_a_denominator_is_a_derivative():
    result = emsim.run(
        "t\nV1 in 0 SIN(0 1 50)\nE1 out 0 LAPLACE {V(in)} {1+s*1m}\nR1 out 0 1\n.tran 10u 40m\n.end\n"
    )
    t, out = np.asarray(result["time"]), np.asarray(result["v(out)"])
    w = 100 * math.pi
    assert np.abs(out - np.sin(w * t) - 1e-3 * w * np.cos(w * t))[t > 1e-3].max() < 1e-3


def test_a_table_is_interpolated_as_in_pspice():
    table = "(0, 0, 0) (100, 0, 0) (1k -20 -90) (10k, -60, -180)"
    s, out = spectrum(f"E1 out 0 FREQ {{V(in)}} = {table} DELAY=1u", "lin 5 100 20.1k")
    for z, found in zip(s, out, strict=True):
        f = z.imag / (2 * math.pi)
        db = np.interp(f, (0, 100, 1e3, 1e4), (0, 0, -20, -60))
        phase = np.radians(np.interp(f, (0, 100, 1e3, 1e4), (0, 0, -90, -180)))
        wanted = 0 if f > 1e4 else 10 ** (db / 20) * cmath.exp(1j * phase - z * 1e-6)
        assert abs(found - wanted) < 1e-12
    _, out = spectrum("E1 out 0 FREQ {V(in)} MAG RAD (10, 1, 0) (1k, 0.5, -1)", "lin 2 10 1k")
    assert np.abs(out - [1.0, 0.5 * cmath.exp(-1j)]).max() < 1e-12
    _, out = spectrum("E1 out 0 FREQ {V(in)} R_I (10, 1, 0) (1k, 0.5, -0.5)", "lin 2 10 1k")
    assert np.abs(out - [1.0, 0.5 - 0.5j]).max() < 1e-12


def test_noise_goes_through_a_function_of_frequency():
    deck = "t\nV1 in 0 0\nR1 in a 1k\nE1 out 0 LAPLACE {V(a)} {1/(1+sqrt(s*1m))}\n.noise v(out) V1 dec 5 1 1k 1\n.end\n"
    found = emsim.run(deck).table("noise")
    s = 2j * math.pi * np.asarray(found["frequency"])
    wanted = math.sqrt(4 * 1.38064852e-23 * 300.15 * 1e3) * np.abs(1 / (1 + np.sqrt(s * 1e-3)))
    assert np.allclose(found["onoise_spectrum"], wanted, rtol=1e-9, atol=0.0)


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("E1 out 0 LAPLACE {V(in)} {1/(1+sqrt(s))}", "known at each frequency alone, and .tran"),
        ("E1 out 0 FREQ {V(in)} = (0 0 0) (1k -3 -45)", "known at each frequency alone, and .tran"),
        ("E1 out 0 LAPLACE {V(in)} {1/sqrt(s)}", "no value at s = 0"),
        ("E1 out 0 LAPLACE {V(in)} {exp(s*1m)/(1+s)}", "0.001 s ahead"),
        ("E1 out 0 LAPLACE {V(in)} {1/(s-s)}", "divides by zero"),
        ("E1 out 0 LAPLACE {V(in)} {1/(1+s*v(in))}", "no function of s"),
        ("E1 out 0 FREQ {V(in)} = (1k 0 0) (10 -3 -45)", "must ascend"),
    ],
)
def test_what_no_run_can_have_is_told(source, said):
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(f"{HEAD}{source}\nR9 out 0 1\n.tran 1u 1m\n.end\n")
    assert any(d.code == "E298" and said in d.message for d in error.value.diagnostics)


def test_polynomials():
    assert divided([1.0, 0.0, 2.0, 4.0], [1.0, 2.0]) == ([0.0, 0.0, 2.0], [1.0])
    assert divided([1.0], [1.0, 2.0]) == ([0.0], [1.0])
    # s/(s (1 + s)) has no pole at 0, and what two delays leave by rounding is none
    assert Rational({0.0: [0.0, 1.0]}, [0.0, 1.0, 1.0]).reduced().below == [1.0, 1.0]
    assert list(Rational({1e-3: [1.0], 1e-19: [2.0]}).reduced().terms) == [1e-3, 0.0]
