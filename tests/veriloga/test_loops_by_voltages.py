"""Loops that voltages end: Newton's method inside of a module, beside closed forms and beside the same laws as equations."""

from __future__ import annotations

import os
import subprocess
import sys
from math import cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from module_decks import HEAD
from scipy.optimize import brentq

import emsim
from emsim import _engine


def module(body: str, declared: str = "") -> str:
    inner = ", n" if "V(n)" in body else ""
    return (
        f"{HEAD}module m(a, b); inout a, b; electrical a, b{inner}; real x, y, dx, r, s; integer i, j, k;\n{declared}\n"
        f"analog begin\n{body}\nend endmodule\n"
    )


def at(body: str, v: float, declared: str = "") -> tuple[float, float]:
    """Current from a to b at so many volts, and its slope."""
    reading = _engine.veriloga(module(body, declared), "here.va", [])
    assert reading.messages == []
    found = reading.evaluate("m", {}, voltages={"a": v}, slopes=True)
    (flow,) = found["flows"]
    return flow[2], found["slopes"][0][0]


ROOT = "x = 1 + {0}; dx = 1; while (abs(dx) > 1e-13 * x) begin dx = (x - {0} / x) / 2; x = x - dx; end"


@pytest.mark.parametrize("v", [0.01, 0.5, 2.0, 3.0, 1e4])
def test_a_root_by_newtons_method(v: float) -> None:
    i, g = at(ROOT.format("V(a, b)") + " I(a, b) <+ x;", v)
    assert i == pytest.approx(sqrt(v), rel=1e-12)
    assert g == pytest.approx(0.5 / sqrt(v), rel=1e-12)


def test_passes_are_counted_and_variables_go_on_behind_the_loop() -> None:
    """Halved until it is below 1: x = v / 2^k after k passes, whose slope is 2^-k; k has none."""
    body = "x = V(a, b); for (k = 0; x > 1; k = k + 1) x = x / 2; y = x * x; I(a, b) <+ y + 10 * k;"
    for v, k in ((0.3, 0), (1.5, 1), (5.0, 3), (1000.0, 10)):
        i, g = at(body, v)
        assert i == pytest.approx((v / 2**k) ** 2 + 10 * k, rel=1e-12)
        assert g == pytest.approx(2 * v / 4**k, rel=1e-12)


def test_a_loop_of_loops() -> None:
    """The fourth root: Newton's method for a root whose radicand is a root by Newton's method, and a sum of roots in a loop."""
    inner = ROOT.format("r")
    body = f"r = V(a, b); {inner} r = x; {inner} I(a, b) <+ x;"
    for v in (0.2, 3.0):
        assert at(body, v) == pytest.approx((v**0.25, 0.25 * v**-0.75), rel=1e-12)
    # the sum of sqrt(v + j) over j while v + j < 7
    body = f"s = 0; j = 0; while (V(a, b) + j < 7) begin r = V(a, b) + j; {inner} s = s + x; j = j + 1; end I(a, b) <+ s;"
    for v in (0.5, 3.25, 6.5, 8.0):
        terms = [v + j for j in range(7) if v + j < 7]
        expected = sum(map(sqrt, terms)), sum(0.5 / sqrt(t) for t in terms)
        assert at(body, v) == pytest.approx(expected, rel=1e-12)


def test_a_loop_behind_a_condition_and_a_condition_in_a_loop() -> None:
    body = f"x = 0; if (V(a, b) > 0) begin {ROOT.format('V(a, b)')} end else x = V(a, b) * V(a, b); I(a, b) <+ x;"
    assert at(body, 2.0) == pytest.approx((sqrt(2), 0.5 / sqrt(2)), rel=1e-12)
    # (the root of what is negative is behind the condition: no slope that is no number comes out)
    assert at(body, -3.0) == pytest.approx((9.0, -6.0), rel=1e-12)
    body = """x = V(a, b); i = 0;
        while (i < 100 && x > 0.1) begin if (x > 1) x = x - 1; else begin r = sqrt(x); x = r * r / 2; end i = i + 1; end
        I(a, b) <+ x + 0.01 * i;"""
    assert at(body, 2.5) == pytest.approx((0.5 / 8 + 0.05, 0.125), rel=1e-12)


def test_a_function_holds_a_loop_and_repeat_counts_by_voltages() -> None:
    declared = """analog function real root; input a; real a, x, d;
        begin x = 1 + a; d = 1; while (abs(d) > 1e-14 * x) begin d = (x - a / x) / 2; x = x - d; end root = x; end endfunction"""
    assert at("I(a, b) <+ root(V(a, b)) + root(2 * V(a, b));", 2.0, declared) == pytest.approx(
        (sqrt(2) + 2, 0.5 / sqrt(2) + 0.5), rel=1e-12
    )
    body = "x = 1; repeat (V(a, b)) x = x * V(a, b); I(a, b) <+ x;"
    for v, n in ((0.4, 0), (0.5, 1), (2.4, 2), (2.5, 3)):
        assert at(body, v) == pytest.approx((v**n, n * v ** (n - 1) if n else 0.0), rel=1e-12)


def test_slopes_of_slopes() -> None:
    """ddx of what a loop gave is a second loop; the slope of that a third one."""
    body = ROOT.format("V(a, b)") + " I(a, b) <+ ddx(x, V(a));"
    assert at(body, 3.0) == pytest.approx((0.5 / sqrt(3), -0.25 * 3**-1.5), rel=1e-11)


REFUSED = {
    "ddt": ("x = 1; while (V(a) > x) begin y = ddt(V(a)); x = x + 1; end I(a) <+ x;", "ddt stands in a loop whose end"),
    "noise": ("x = 1; while (V(a) > x) begin x = x + white_noise(1); end I(a) <+ x;", "white_noise stands in a loop"),
    "limit": (
        'x = 1; while (V(a) > x) x = x + $limit(V(a), "pnjlim", 0.02, 0.6); I(a) <+ x;', r"\$limit stands in a loop"),
    "ddx": ("x = 1; while (V(a) > x) x = x + ddx(x * V(a), V(a)); I(a) <+ x;", "ddx stands in a loop whose end"),
    "contribution": ("x = 1; while (V(a) > x) begin x = x + 1; I(a) <+ x; end", "a contribution stands in a loop"),
    "repeat": ("repeat (V(a)) I(a) <+ 1;", "how often this is repeated hangs on voltages"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_stand_in_such_a_loop_is_told_by_name(what: str) -> None:
    body, said = REFUSED[what]
    reading = _engine.veriloga(module(body), "here.va", [])
    with pytest.raises(ValueError, match=said):
        reading.evaluate("m")


# Kepler's equation, E - e sin(E) = M, by Newton's method; and as an equation of the circuit
ECCENTRICITY = 0.6
KEPLER = f"""x = V(a, b); dx = 1;
    while (abs(dx) > 1e-14) begin dx = (x - {ECCENTRICITY} * sin(x) - V(a, b)) / (1 - {ECCENTRICITY} * cos(x)); x = x - dx; end
    """
IMPLICIT = f"V(n) : V(n) - {ECCENTRICITY} * sin(V(n)) == V(a, b); x = V(n);"
LAW = "I(a, b) <+ 1m * x + ddt(1u * x);"
DECK = """Kepler
.hdl "m.va"
V1 p 0 dc 1 ac 1 sin(0.5 2 1k)
R1 p a 1k
N1 a 0 m
.model m m
.op
.ac dec 3 10 100k
.tran 1u 2m
.options method={method} reltol=1e-9 abstol=1e-15 vntol=1e-12
.end
"""


def solution(tmp_path: Path, law: str, method: str = "radau") -> emsim.Result:
    (tmp_path / "m.va").write_text(module(law + LAW))
    (tmp_path / "k.cir").write_text(DECK.format(method=method))
    return emsim.run(tmp_path / "k.cir")


def test_keplers_equation_beside_itself_as_an_equation(tmp_path: Path) -> None:
    looped = solution(tmp_path, KEPLER)
    implicit = solution(tmp_path, IMPLICIT)
    for one, other in ((looped.op, implicit.op), (looped.ac, implicit.ac)):
        assert np.allclose(one["v(a)"], other["v(a)"], rtol=1e-9, atol=0)
    one, other = looped.tran, implicit.tran
    times = np.linspace(0, 2e-3, 400)
    assert np.allclose(
        np.interp(times, one["time"], one["v(a)"]), np.interp(times, other["time"], other["v(a)"]), atol=3e-5
    )
    # at rest: (1 - v) / 1k = 1m E, E - e sin E = v
    e = brentq(lambda e: e - ECCENTRICITY * sin(e) - (1 - e), 0, 2, xtol=1e-15)
    assert looped.op["v(a)"][0] == pytest.approx(1 - e, rel=1e-9)
    slope = 1 / (1 - ECCENTRICITY * cos(e))
    f = looped.ac["frequency"]
    assert np.allclose(looped.ac["v(a)"], 1 / (1 + slope * (1 + 2j * pi * f * 1e-3)), rtol=1e-8)


END = """
import sys, emsim
result = emsim.run(sys.argv[1])
print(repr(emsim._engine.code), *(float(v).hex() for v in [result.op["v(a)"][0], *result.tran["v(a)"][-5:]]))
"""


def test_machine_code_and_interpreter_run_the_same_loop(tmp_path: Path) -> None:
    (tmp_path / "m.va").write_text(module(KEPLER + LAW))
    elements = "".join(f"R{k} p a{k} {k}k\nN{k} a{k} 0 m\n" for k in range(2, 9))
    (tmp_path / "k.cir").write_text(DECK.format(method="trap").replace("N1 a 0 m\n", "N1 a 0 m\n" + elements))
    told = {}
    for code in ("native", "cranelift", "interpreted"):
        done = subprocess.run(
            [sys.executable, "-c", END, tmp_path / "k.cir"],
            env={**os.environ, "EMSIM_CODE": code},
            capture_output=True,
            text=True,
        )
        if done.returncode and "knows" in done.stderr:
            continue
        assert done.returncode == 0, done.stderr
        told[code] = done.stdout.split()[1:]
    values = {code: np.array([float.fromhex(v) for v in said]) for code, said in told.items()}
    assert "interpreted" in values
    for of in values.values():
        assert of == pytest.approx(values["interpreted"], rel=1e-9)


def test_a_loop_that_never_ends_is_an_error_by_name(tmp_path: Path) -> None:
    deck = 'endless\n.hdl "m.va"\nV1 a 0 dc 1 pwl(0 1 1m 3)\nN1 a 0 m\n.model m m\n.{}\n.end\n'
    # beyond 2 V nothing changes any more; beyond 1.5 V it goes on for ever
    for body, line in (
        ("x = 0; while (x < V(a, b)) begin\nif (x < 2) x = x + 1; end I(a, b) <+ x;", 5),
        ("x = 0;\nwhile (x < V(a, b)) begin x = (V(a, b) > 1.5) ? -x - 1 : x + 1; end I(a, b) <+ x;", 6),
    ):
        (tmp_path / "m.va").write_text(module(body))
        (tmp_path / "k.cir").write_text(deck.format("op"))
        assert emsim.run(tmp_path / "k.cir")["i(v1)"][0] == pytest.approx(-1)
        (tmp_path / "k.cir").write_text(deck.format("tran 10u 1m"))
        with pytest.raises(emsim.ConvergenceError, match=rf"m.va:{line}: this loop does not end"):
            emsim.run(tmp_path / "k.cir")
    # the next run is none the worse
    (tmp_path / "m.va").write_text(module(KEPLER + LAW))
    (tmp_path / "k.cir").write_text(deck.format("op"))
    assert emsim.run(tmp_path / "k.cir")["i(v1)"][0] < 0


def test_operating_point_values_and_a_session(tmp_path: Path) -> None:
    """What a loop gave is told of an instance, and a packed deck takes its loops along."""
    declared = '(* desc="anomaly" *) real anomaly;'
    (tmp_path / "m.va").write_text(module(KEPLER + " anomaly = x; I(a, b) <+ 1m * x;", declared))
    (tmp_path / "k.cir").write_text(
        'k\n.hdl "m.va"\nV1 a 0 1\nN1 a 0 m\n.model m m\n.save i(v1) @n1[anomaly]\n\n.fmu out=i(v1)\n.tran 1m 10m\n.end\n'
    )
    e = brentq(lambda e: e - ECCENTRICITY * sin(e) - 1, 0, 3, xtol=1e-15)
    result = emsim.run(tmp_path / "k.cir")
    assert result["@n1[anomaly]"][-1] == pytest.approx(e, rel=1e-12)
    session = emsim.Session(tmp_path / "k.cir")
    session.step(1e-3)
    assert session["i(v1)"] == pytest.approx(-1e-3 * e, rel=1e-9)
