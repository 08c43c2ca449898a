"""Behavioural expressions: figures of ngspice 39.3 for v(a) = 3, v(n) = -2, v(z) = 0, v(h) = 0.5."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from circuit_decks import codes, deck, problems, remarks, value

import emsim

SUPPLY = ("Va a 0 3", "Vn n 0 -2", "Vz z 0 0", "Vh h 0 0.5")
FIGURES = [
    ("v(a,n)", 5.0), ("abs(v(n))", 2.0), ("sqrt(v(a))", 1.732051), ("exp(v(a))", 20.08554),
    ("ln(v(a))", 1.0986123), ("log(v(a))", 1.0986123), ("log10(v(a))", 0.47712125),
    # powers take the magnitude of the base, pwr keeps its sign
    ("v(n)^2", 4.0), ("v(n)^3", 8.0), ("v(n)**3", 8.0), ("pow(v(n),3)", 8.0), ("v(n)^1", 2.0),
    ("pwr(v(n),3)", -8.0), ("pwr(v(n),2)", -4.0), ("v(a)^v(h)", 1.732051), ("v(z)^0", 1.0),
    ("pwr(v(z),0)", 1.0),
    ("2^3^2", 64.0), ("2**3**2", 64.0), ("-v(a)^2", -9.0), ("-2^2", -4.0), ("2-v(a)^2", -7.0),
    ("2*-v(a)", -6.0),
    ("v(z)/v(z)", 0.0), ("1/2/v(a)", 0.1666667),
    # steps and ramps
    ("sgn(v(n))", -1.0), ("sgn(v(z))", 0.0), ("u(v(z))", 0.5), ("u(v(a))", 1.0), ("u(v(n))", 0.0),
    ("u2(v(h))", 0.5), ("u2(v(a))", 1.0), ("u2(v(n))", 0.0), ("uramp(v(a))", 3.0), ("uramp(v(n))", 0.0),
    # rounding, halves to even
    ("floor(v(n)-0.3)", -3.0), ("ceil(v(n)-0.3)", -2.0), ("nint(v(h))", 0.0), ("nint(v(h)+1)", 2.0),
    ("nint(v(n)-0.5)", -2.0), ("nint(2.5)", 2.0), ("nint(3.5)", 4.0),
    ("sin(v(a))", 0.14112001), ("tan(v(a))", -0.14254654), ("atan(v(a))", 1.2490458),
    ("acos(v(h))", 1.0471976),
    ("sinh(v(a))", 10.017875), ("cosh(v(a))", 10.067662), ("tanh(v(a))", 0.99505475),
    ("asinh(v(a))", 1.8184465),
    ("min(v(a),v(n))", -2.0), ("max(v(a),v(n))", 3.0),
    # pwl goes on beyond its ends
    ("pwl(v(a),0,0,1,2,2,3)", 4.0), ("pwl(v(n),0,0,1,2,2,3)", -4.0), ("pwl(v(h),0,0,1,2,2,3)", 1.0),
    # conditions
    ("v(a)>2 ? 5 : 6", 5.0), ("v(a)>2 && v(n)>0", 0.0), ("v(a)>2 || v(n)>0", 1.0), ("!v(z)", 1.0),
    ("!v(h)", 0.0),
    ("v(a)==3", 1.0), ("v(a)!=3", 0.0), ("v(a)>=3", 1.0), ("(v(z)<=0)*2", 2.0), ("(v(a)>2)+(v(n)>2)", 1.0),
    ("v(a)>1?v(a)>2?7:8:9", 7.0), ("v(n)?1:2", 1.0), ("v(h) && 1 ? 4 : 6", 4.0),
    ("ternary_fcn(v(a),1,2)", 1.0),
    ("eq0(v(z))", 1.0), ("gt0(v(a))", 1.0), ("lt0(v(a))", 0.0),
    ("temper", 27.0), ("time", 0.0), ("hertz", 0.0), ("pi", math.pi), ("e", math.e), ("ddt(v(a))", 0.0),
    ("i(va)", 0.0), ("1k*v(a)", 3000.0),
]  # fmt: skip


def test_figures_of_ngspice() -> None:
    sources = [f"B{k} o{k} 0 V={{{text}}}" for k, (text, _) in enumerate(FIGURES)]
    table = emsim.run(deck(*SUPPLY, *sources, ".op")).table("op")
    for k, (text, figure) in enumerate(FIGURES):
        assert table[f"v(o{k})"][0] == pytest.approx(figure, rel=1e-6, abs=1e-9), text


def op(text: str, *more: str) -> float:
    return float(emsim.run(deck(*SUPPLY, f"B1 o 0 V={{{text}}}", *more, ".op")).table("op")["v(o)"][0])


def test_negative_arguments_take_the_magnitude() -> None:
    assert op("sqrt(v(n))") == pytest.approx(math.sqrt(2))
    assert op("ln(v(n))") == pytest.approx(math.log(2))
    assert op("v(n)^0.5") == pytest.approx(math.sqrt(2))


def test_limit_of_three_arguments_clamps_and_says_so() -> None:
    assert op("limit(8*v(a),-12,12)") == pytest.approx(12.0)
    assert op("limit(v(n),0,5)") == 0.0
    assert "W282" in [d.code for d in remarks(*SUPPLY, "B1 o 0 V={limit(v(a),0,1)}", ".op")]


def test_table_stays_at_its_ends() -> None:
    assert op("table(v(a),0,0,1,2,2,2.5)") == 2.5


@pytest.mark.parametrize(
    ("v", "figure"),
    # ngspice 39.3: corners, the end ones too, are rounded over a tenth of the shorter segment
    [
        (-2.1, 0.0),
        (-1.99, 0.03025),
        (-1.0, 1.025),
        (0.0, 3.0),
        (0.89, 4.75975),
        (1.0, 4.9),
        (1.12, 4.984),
        (2.0, 5.0),
    ],
)
def test_table_source_rounds_its_corners(v: float, figure: float) -> None:
    r = emsim.run(deck(f"Va a 0 {v}", "E1 t 0 TABLE {v(a)} = (-2,0) (-1,1) (1,5)", ".op"))
    assert r.table("op")["v(t)"][0] == pytest.approx(figure, abs=1e-9)


def test_poly_in_ngspice_order_and_one_coefficient_is_the_constant() -> None:
    two = "E1 o 0 POLY(2) a 0 b 0 1 2 3 4 5 6 7"
    table = emsim.run(deck("Va a 0 5", "Vb b 0 2", two, "E2 q 0 POLY(1) a 0 3", ".op")).table("op")
    assert table["v(o)"][0] == pytest.approx(1066.0)
    assert table["v(q)"][0] == pytest.approx(3.0)


def test_temperature_and_multiplier_of_b_sources() -> None:
    table = emsim.run(
        deck("Va a 0 5", "B1 o 0 V={v(a)} tc1=0.1", "B2 q 0 I={v(a)} m=3", "Rq q 0 1", ".temp 37", ".op")
    ).table("op")
    assert table["v(o)"][0] == pytest.approx(10.0)
    assert table["v(q)"][0] == pytest.approx(-15.0)


def test_ddt_is_the_derivative() -> None:
    r = emsim.run(
        deck("V1 a 0 SIN(0 1 1k)", "B1 o 0 V={ddt(v(a))/1k}", ".tran 10u 2m"), reltol=1e-6, method="radau"
    )
    late = r.time > 0.1e-3
    expected = 2 * math.pi * np.cos(2 * math.pi * 1e3 * r.time)
    np.testing.assert_allclose(r["v(o)"][late], expected[late], atol=2e-3)


def test_integral_starts_from_its_second_argument() -> None:
    r = emsim.run(deck("V1 a 0 2", "B1 o 0 V={idt(v(a),1)}", ".tran 10m 1"))
    np.testing.assert_allclose(r["v(o)"], 1 + 2 * r.time, atol=1e-9)


def test_incremental_capacitance_and_charge() -> None:
    # ngspice 39.3: i = C(v) dv/dt for C=, i = dQ/dt for Q=; i(v1) at 0.6 ms
    for line, figure in (("C1 a 0 c='v(a)*1u'", 7.1812e-3), ("C1 a 0 q='v(a)*v(a)*1u'", 14.364e-3)):
        r = emsim.run(deck("V1 a 0 SIN(2 1 1k)", line, ".tran 10u 1m"), method="radau", reltol=1e-6)
        assert r.at("i(v1)", 0.6e-3) == pytest.approx(figure, rel=1e-3)


def test_a_comparison_switches_at_its_threshold() -> None:
    r = emsim.run(deck("V1 a 0 PWL(0 0 1 1)", "B1 o 0 V={v(a)>0.3 ? 5 : 1}", ".tran 0.1 1"))
    jump = np.flatnonzero(np.diff(r["v(o)"]) > 1)
    assert len(jump) == 1
    assert r.time[jump[0]] == pytest.approx(0.3, abs=1e-6)


def test_random_functions_are_drawn_once_and_repeat() -> None:
    first, second = op("agauss(1,0.1,1)+0*v(a)"), op("agauss(1,0.1,1)+0*v(a)")
    assert first == second
    assert 0.4 < first < 1.6


@pytest.mark.parametrize(
    ("text", "code", "hint"),
    [
        ("v(aa)", "E289", "`a`"),
        ("i(vaa)", "E290", "`va`"),
        ("sinn(v(a))", "E122", "sin"),
        ("v(a)/0", "E283", None),
        ("tim", "E120", None),
        ("a+1", "E120", None),
        ("sin(v(a),1)", "E123", None),
        ("pwl(v(a),0,0,0,1,2,3)", "E286", None),
        ("pwl(v(a),0,0,1)", "E286", None),
        ("angle(hinge)", "E291", None),
        ("gauss(v(a),1,1)", "E286", None),
    ],
)
def test_errors_name_the_place(text: str, code: str, hint: str | None) -> None:
    found = problems(*SUPPLY, f"B1 o 0 V={{{text}}}", ".op")
    assert [d.code for d in found if d.severity == "error"] == [code]
    assert found[0].span is not None
    assert found[0].span.line == 6
    if hint:
        assert hint in (found[0].hint or "")


def test_all_errors_come_at_once() -> None:
    lines = ("B1 o 0 V={v(x1)+i(x2)+angle(j)}", "B2 p 0 V={v(x3)/0}")
    assert sorted(codes(*SUPPLY, *lines, ".op")) == ["E283", "E289", "E289", "E290", "E291"]


def test_leaving_a_domain_is_said_once_with_its_time() -> None:
    lines = (
        "V1 a 0 PWL(0 1 1 -1)",
        "B1 o 0 V={sqrt(v(a))+sqrt(v(a))}",
        "B2 p 0 V={ln(2+v(a))}",
        ".tran 0.01 1",
    )
    found = remarks(*lines)
    assert [d.code for d in found] == ["W402"]
    assert "t = 0.5 s" in found[0].message
    assert [d.code for d in remarks("V1 a 0 -1", "B1 o 0 V={log10(v(a))}", ".op")] == ["W402"]


def test_powers_of_negative_bases_are_spoken_of() -> None:
    def said(expression: str) -> list[str]:
        r = emsim.run(f"t\nV1 a 0 SIN(0.5 1 1k)\nB1 b 0 V={{{expression}}}\nR1 b 0 1\n.tran 10u 2m\n.end\n")
        return [d.message for d in r.diagnostics if d.code == "W402"]

    for negative in ("v(a)^3", "v(a)**1.5", "pow(v(a), 1)", "v(a)^v(a)"):
        (message,) = said(negative)
        assert "as in ngspice it is |x|^y" in message and "first at t = 0.0005" in message
    for harmless in ("v(a)^2", "abs(v(a))^3", "(v(a)*v(a)+1)^1.5", "(v(a)+0.6)^3", "pwr(v(a),3)"):
        assert said(harmless) == []


def test_a_divisor_that_is_zero_at_the_operating_point_is_named() -> None:
    def said(expression: str) -> list[str]:
        r = emsim.run(f"t\nV1 a 0 0\nB1 b 0 V={{{expression}}}\nR1 b 0 1\n.op\n.tran 1u 2u\n.end\n")
        return [d.span.text for d in r.diagnostics if d.code == "W403"]

    assert said("1/v(a)") == ["v(a)"]
    assert said("v(a)/v(a)") == said("1/(v(a)+1)") == []


@pytest.mark.parametrize(
    "behind", ["R1 a b 0.1", "L1 a s 10u\nR1 s b 0.1", "R1 a b 0.1\nC1 b 0 1u\nD1 0 b dd\n.model dd d"]
)
def test_a_load_of_constant_power_has_its_point(behind: str) -> None:
    """At v = 0 its guarded quotient and slope say that 1e-31 V away all is well: a small update is no solution yet."""
    text = f"t\nV1 a 0 12\n{behind}\nB1 b 0 I=10/v(b)\n.tran 1u 100u\n.end\n"
    result = emsim.run(text)
    exact = 6 + np.sqrt(36 - 1)
    assert np.abs(result["v(b)"] - exact).max() < 1e-5
    # L di/dt = 12 - R i - 10/i grows, with 10/i^2 - R = 14 ohm over 10 uH: the run stays at a rest that is none
    assert [d.code for d in result.diagnostics] == (["N403"] if "L1" in behind else [])


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("v(a)^-1", 1 / 3),
        ("v(a)^-3", 1 / 27),
        ("pow(v(a),-2)", 1 / 9),
        ("pwr(-v(a),-0.5)", -(3**-0.5)),
        ("v(a)**(-1.5)", 3**-1.5),
    ],
)
def test_negative_powers_are_solved_from_zero_volt(text: str, expected: float) -> None:
    assert value("v(b)", "V1 a 0 3", f"B1 b 0 V={text}", "R1 b 0 1k") == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("v(a)%3", lambda a, t: np.fmod(a, 3)),
        ("mod(v(a),v(b))", lambda a, t: np.fmod(a, 0.9)),
        ("fmod(v(a),-0.7)", lambda a, t: np.fmod(a, -0.7)),
        ("time%2.5m", lambda a, t: np.fmod(t, 2.5e-3)),
        ("sqr(v(a))", lambda a, t: a * a),
        ("round(v(a))", lambda a, t: np.round(a)),
        ("arctan(v(a))", lambda a, t: np.arctan(a)),
        ("sign(v(a))", lambda a, t: np.sign(a)),
        ("stp(v(a))", lambda a, t: (a > 0) * 1.0),
    ],
)
def test_what_parameters_know_sources_know(text: str, exact: Callable[..., np.ndarray]) -> None:
    r = emsim.run(deck("Va a 0 PWL(0 -3 10m 4.1)", "Vb b 0 0.9", f"B1 o 0 V={{{text}}}", ".tran 0.1m 10m"))

    def beside(shift: float) -> np.ndarray:
        t = r.time + shift
        return np.abs(r["v(o)"] - exact(np.interp(t, [0, 10e-3], [-3, 4.1]), t))

    on_a_jump = beside(0.0) > 1e-9  # there either side is right
    assert np.all(np.minimum(beside(-5e-12), beside(5e-12))[on_a_jump] < 1e-8)
    assert np.sum(on_a_jump) <= 16  # eleven jumps at most, each with a point on both sides


@pytest.mark.parametrize("method", ["auto", "trap", "gear", "radau", "trbdf2", "esdirk", "rk45"])
def test_a_quantizer_steps_where_its_input_crosses(method: str) -> None:
    """An RC behind floor(5 v)/5 of a sine: its exact answer, summed from step to step; radau was wrong by 0.38 of 1 V."""
    table = emsim.run(
        deck(
            "V1 a 0 SIN(0 1 1k)", "B1 q 0 V={floor(5*v(a))/5}", "R1 q o 1k", "C1 o 0 100n", ".tran 20u 3m",
        ),
        method=method,
        reltol=1e-6,
    )  # fmt: skip
    phases = np.arcsin(np.arange(-4, 5) / 5)
    crossings = [(p + np.pi * k if k % 2 == 0 else np.pi * k - p) for k in range(7) for p in phases]
    times = np.array([*sorted(t for t in np.array(crossings) / (2e3 * np.pi) if 0 < t < 3e-3), 3e-3])
    v, t0 = 0.0, 0.0
    for t in times:
        level = np.floor(5 * np.sin(2e3 * np.pi * (0.6 * t0 + 0.4 * t))) / 5
        v = level + (v - level) * np.exp(-(t - t0) / 1e-4)
        t0 = t
        assert float(table.at("v(o)", t)) == pytest.approx(v, abs=2e-4), t


def test_a_flag_that_rested_tells_the_truth_afterwards() -> None:
    """255 steps in 10 ns are too many to locate each; that the last is the right one holds for good."""
    table = emsim.run(
        deck(
            "V1 a 0 PULSE(0 255.3 0.1m 10n 10n 0.3m 1)", "B1 b 0 V={floor(v(a))}", "R1 b 0 1", ".tran 10u 1m"
        )
    )
    assert list(table.at("v(b)", [0.05e-3, 0.3e-3, 0.9e-3])) == pytest.approx([0, 255, 0], abs=1e-9)
    comparator = emsim.run(
        deck("V1 a 0 PWL(0 0 1m 0 " + " ".join(f"{1 + 1e-6 * k:.6f}m {k % 2}" for k in range(1, 10)) + " 2m 1)",
             "B1 b 0 V={v(a)>0.5}", "R1 b 0 1", ".tran 10u 2m")
    )  # fmt: skip
    assert comparator.at("v(b)", 1.9e-3) == pytest.approx(1.0)


@pytest.mark.parametrize("x", [3.0, -3.0, 2.5, 1e9, -7.2, 0.0, 2.999999])
def test_rounding_of_what_does_not_move(x: float) -> None:
    import math

    for fn, exact in (("floor", math.floor), ("ceil", math.ceil), ("int", math.trunc), ("nint", round)):
        assert value("v(b)", f"V1 a 0 {x!r}", f"B1 b 0 V={{{fn}(v(a))}}", "R1 b 0 1") == pytest.approx(
            exact(x)
        )
