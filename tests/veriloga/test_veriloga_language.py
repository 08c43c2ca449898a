"""What Verilog-A's constructs mean: every value beside a closed form, or beside the standard's rule."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import pytest

import emsim
from emsim import _engine

HEAD = '`include "disciplines.vams"\n`include "constants.vams"\n'


def read(text, folders=()):
    reading = _engine.veriloga(HEAD + text, "here.va", list(folders))
    assert reading.messages == []
    return reading


def module(body, declared="", name="m"):
    return f"""module {name}(a, b); inout a, b; electrical a, b, n, k; {declared}
    analog begin {body} end endmodule"""


def run(body, declared="", parameters=None, voltages=None, **more):
    reading = read(module(body, declared))
    return reading.evaluate("m", parameters or {}, voltages=voltages or {}, **more)


def current(result, start="a", end="b"):
    """(i, q) from one unknown to another."""
    i = q = 0.0
    for one, other, flow, charge in result["flows"]:
        if (one, other) == (start, end):
            i, q = i + flow, q + charge
        elif (one, other) == (end, start):
            i, q = i - flow, q - charge
    return i, q


def value(expression, declared="", parameters=None, v=0.0, before="", **more):
    return current(run(f"{before} I(a, b) <+ {expression};", declared, parameters, {"a": v}, **more))[0]


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        # whole numbers divide without remainder, towards zero
        ("7 / 2", 3),
        ("-7 / 2", -3),
        ("7 / 2.0", 3.5),
        ("-7 % 3", -1),
        ("7.5 % 2", 1.5),
        ("2 ** 3 ** 2", 64),  # from the left
        ("-2 ** 2", 4),  # a sign binds tighter
        ("2 ** -1", 0),  # whole
        ("2.0 ** -1", 0.5),
        ("pow(2, -1)", 0.5),
        ("1 + 2 * 3 - 4 / 2", 5),
        ("1 ? 2 : 0 ? 3 : 4", 2),
        ("0 ? 2 : 0 ? 3 : 4", 4),
        ("(3 > 2) + (2 >= 2) + (1 == 2) + (1 != 2)", 3),
        ("!0 + !5", 1),
        ("1 || 0 && 0", 1),
        ("5 & 3", 1),
        ("5 | 3", 7),
        ("5 ^ 3", 6),
        ("5 ~^ 3", -7),
        ("~5", -6),
        ("1 << 4", 16),
        ("-16 >>> 0", -16),
        ("16 >> 2", 4),
        ("1.5k + 2m + 3u", 1500.002003),
        ("1_000", 1000),
        ("1e3", 1000),
        (".5 + 1.", 1.5),
        ("min(2, 3) + max(2.5, 1)", 4.5),
        ("abs(-3) + floor(2.7) + ceil(2.2)", 8),
        ("ln(exp(2)) + log(100) + sqrt(16)", 8),
        ("hypot(3, 4) + atan2(1, 1)", 5 + math.pi / 4),
        ("sin(1) + cos(1) + tan(1)", math.sin(1) + math.cos(1) + math.tan(1)),
        ("sinh(1) + cosh(1) + tanh(1)", math.sinh(1) + math.cosh(1) + math.tanh(1)),
        ("asin(0.5) + acos(0.5) + atan(0.5)", math.asin(0.5) + math.acos(0.5) + math.atan(0.5)),
        ("asinh(0.5) + acosh(1.5) + atanh(0.5)", math.asinh(0.5) + math.acosh(1.5) + math.atanh(0.5)),
        ("`M_PI", math.pi),
        ("$temperature", 300.15),
        ("$vt", 1.380649e-23 / 1.602176634e-19 * 300.15),
        ("$vt(100)", 1.380649e-23 / 1.602176634e-19 * 100),
        ('$simparam("nothing", 5)', 5),
        ('"abc" == "abc"', 1),
        ('"abc" != "abd"', 1),
        ("$mfactor", 1),
    ],
)
def test_constant_expressions_follow_the_standard(expression, expected):
    assert value(expression) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("v", [-2.0, -0.5, 0.0, 0.5, 1.0, 2.0])
@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("V(a) > 0.5 ? V(a) : 2 * V(a)", lambda v: v if v > 0.5 else 2 * v),
        ("(V(a) < 1) + 2 * (V(a) <= 1) + 4 * (V(a) >= 1)", lambda v: (v < 1) + 2 * (v <= 1) + 4 * (v >= 1)),
        ("(V(a) == 1) + 2 * (V(a) != 1)", lambda v: (v == 1) + 2 * (v != 1)),
        ("V(a) > 0 && V(a) < 1", lambda v: float(0 < v < 1)),
        ("V(a) < 0 || V(a) > 1", lambda v: float(v < 0 or v > 1)),
        ("!(V(a) > 0)", lambda v: float(not v > 0)),
        ("!V(a)", lambda v: float(not v)),
        ("min(V(a), 1) + max(V(a), -1)", lambda v: min(v, 1) + max(v, -1)),
        ("limexp(V(a))", math.exp),
        (
            "limexp(100 * V(a))",
            lambda v: math.exp(100 * v) if v <= 0.8 else math.exp(80) * (1 + 100 * v - 80),
        ),
        ("V(b, a)", lambda v: -v),
        ("V(a) % 0.75", lambda v: math.fmod(v, 0.75)),
        ("abs(V(a)) ** 3", lambda v: abs(v) ** 3),
        ("ddx(V(a) * V(a), V(a))", lambda v: 2 * v),
        ("ddx(sin(V(a, b)), V(b))", lambda v: -math.cos(v)),
        ("ddx(V(a), V(n))", lambda v: 0),
    ],
)
def test_expressions_of_voltages(expression, expected, v):
    assert value(expression, v=v) == pytest.approx(expected(v), rel=1e-14, abs=1e-300)


@pytest.mark.parametrize(
    ("x", "expected"),
    [(2.5, 3), (-2.5, -3), (2.4, 2), (-0.4, 0)],
    ids=["half", "minus half", "below", "small"],
)
def test_reals_round_away_from_zero_into_integers(x, expected):
    assert value("i", "integer i;", before=f"i = {x};") == expected
    assert value("i", "integer i;", before="i = V(a);", v=x) == expected


def test_loops():
    declared = "integer i, s; real p;"
    assert value("s", declared, before="s = 0; for (i = 1; i <= 10; i = i + 1) s = s + i;") == 55
    assert value("s", declared, before="s = 1; while (s < 100) s = 2 * s;") == 128
    assert value("p", declared, before="p = 1; repeat (5) p = p * 3;") == 243
    # powers of a voltage by a loop
    assert value("p", declared, before="p = 1; for (i = 0; i < 4; i = i + 1) p = p * V(a);", v=1.5) == 1.5**4


def test_a_loop_that_ends_on_a_voltage_is_run_or_bounded():
    newton = (
        "x = 1; i = 0; {} while (abs(x * x - V(a)) > 1e-12 {}) begin x = (x + V(a) / x) / 2; i = i + 1; end"
    )
    declared = "real x; integer i;"
    assert value("x", declared, before=newton.format("", "&& i < 8"), v=3.0) == pytest.approx(
        math.sqrt(3), abs=1e-12
    )
    assert value("x", declared, before=newton.format("(* unroll = 7 *)", ""), v=3.0) == pytest.approx(
        math.sqrt(3)
    )
    assert value("x", declared, before=newton.format("", ""), v=3.0) == pytest.approx(math.sqrt(3), abs=1e-12)


@pytest.mark.parametrize("v", [0.0, 1.0, 2.0, 3.0, 7.0])
def test_case_of_parameters_and_of_voltages(v):
    expected = {0.0: 10, 1.0: 20, 2.0: 20, 3.0: 30}.get(v, 40)
    body = "case ({}) 0: x = 10; 1, 2: x = 20; 3: begin x = 30; end default: x = 40; endcase"
    assert value("x", "real x;", before=body.format("V(a)"), v=v) == expected
    declared = "real x; parameter integer p = 0;"
    assert value("x", declared, {"p": v}, before=body.format("p")) == expected


def test_case_of_strings():
    declared = 'real x; parameter string kind = "n" from {"n", "p"};'
    body = 'case (kind) "n": x = 1; "p": x = -1; endcase'
    assert value("x", declared, before=body) == 1
    assert value("x", declared, {"kind": "p"}, before=body) == -1


def test_arrays_and_blocks():
    declared = "real w[0:3]; integer i; real s;"
    body = "for (i = 0; i < 4; i = i + 1) w[i] = i * V(a); s = 0; for (i = 3; i >= 0; i = i - 1) s = s + i * w[i];"
    assert value("s", declared, before=body, v=2.0) == 28
    nested = "begin : inner real x; x = 3; begin : more real x; x = 4; s = x; end s = s + x; end"
    assert value("s", "real s;", before=nested) == 7
    assert value("t[2]", "parameter real t[1:3] = '{5, 6, 7};") == 6
    assert value("t[2]", "parameter real t[1:3] = '{5, 6, 7};", {"t": [1, 2, 3]}) == 2


def test_functions_with_results_by_argument():
    declared = """
    analog function real both;
        input x; output square; inout sum;
        real x, square, sum;
        begin square = x * x; sum = sum + x; both = x * square; end
    endfunction
    analog function integer twice; input i; integer i; twice = 2 * i; endfunction
    real p, q, r;"""
    body = "r = 1; p = both(V(a), q, r);"
    assert value("p + 100 * q + 10000 * r", declared, before=body, v=2.0) == 8 + 400 + 30000
    assert value("twice(2.6) / 4", declared) == 1  # 3, then whole numbers


def test_conditions_of_voltages_merge_what_both_sides_did():
    body = """x = 1; y = 5;
    if (V(a) > 0) begin x = V(a); if (V(a) > 1) y = x; end else begin y = -V(a); I(a, b) <+ 100; end
    I(a, b) <+ x + 10 * y;"""
    for v, expected in [(0.5, 50.5), (2.0, 22.0), (-1.0, 111.0)]:
        assert current(run(body, "real x, y;", voltages={"a": v}))[0] == expected


def test_charges_go_along_with_what_is_linear():
    body = "x = 3 * ddt(2p * V(a, b)); I(a, b) <+ -x + ddt(1p * V(a, b) * V(a, b)) / 2 + V(a, b);"
    assert current(run(body, "real x;", voltages={"a": 2.0})) == (2.0, pytest.approx(-12e-12 + 2e-12))


def test_a_charge_times_a_voltage_becomes_an_unknown():
    result = run("I(a, b) <+ V(a, b) * ddt(V(a, b));", voltages={"a": 2.0})
    [u] = [name for name, kind in result["unknowns"] if kind == "current"]
    result = run("I(a, b) <+ V(a, b) * ddt(V(a, b));", voltages={"a": 2.0, u: 5.0})
    assert current(result) == (10.0, 0.0)
    # its row: dq/dt - u = 0
    assert current(result, u, "0") == (-5.0, 2.0)


def test_an_integral_is_an_unknown():
    result = run("I(a, b) <+ idt(V(a, b), 0.25);", voltages={"a": 3.0})
    [u] = [name for name, kind in result["unknowns"] if kind == "current"]
    told = {"a": 3.0, u: 7.0}
    result = run("I(a, b) <+ idt(V(a, b), 0.25);", voltages=told)
    assert current(result) == (7.0, 0.0) and current(result, u, "0") == (-3.0, 7.0)
    # an operating point holds the initial value
    assert result["starts"] == [(u, 0.25)]


def test_potentials():
    # V = 2 I + d(3 I)/dt: an inductor with its resistance
    body = "V(a, b) <+ 2 * I(a, b) + ddt(3 * I(a, b));"
    result = run(body, voltages={"a": 5.0, "I(a,b)": 2.0})
    assert current(result) == (2.0, 0.0)
    assert current(result, "I(a,b)", "0") == (1.0, -6.0)
    # a resistance of 0 between a terminal and a node inside makes them one
    result = run("V(a, n) <+ 0; I(n, b) <+ V(n, b);")
    assert result["merged"] == [("a", "n")]
    # two terminals stay two
    result = run("V(a, b) <+ 0;")
    assert result["merged"] == [] and ("I(a,b)", "current") in result["unknowns"]


@pytest.mark.parametrize(("r", "merged"), [(0.0, [("a", "n")]), (2.0, [])])
def test_a_resistance_that_may_be_zero(r, merged):
    body = "if (r > 0) I(a, n) <+ V(a, n) / r; else V(a, n) <+ 0; I(n, b) <+ V(n, b);"
    result = run(body, "parameter real r = 0;", {"r": r}, voltages={"a": 3.0, "n": 1.0})
    assert result["merged"] == merged
    assert current(result, "a", "n")[0] == (1.0 if r else 0.0)


@pytest.mark.parametrize(("v", "row"), [(1.0, 1.0), (-1.0, 2.0 + 1e-3)])
def test_a_switch_is_a_potential_or_a_flow(v, row):
    # closed: V(a, b) = 0; open: I = 1m V
    body = "if (V(n) > 0) V(a, b) <+ 0; else I(a, b) <+ 1m * V(a, b);"
    result = run(body, voltages={"a": 1.0 if v > 0 else -1.0, "n": v, "I(a,b)": 2.0})
    assert current(result) == (2.0, 0.0)
    assert current(result, "I(a,b)", "0")[0] == pytest.approx(row)


def test_the_last_kind_of_contribution_counts():
    assert current(run("V(a, b) <+ 1; I(a, b) <+ 2; I(a, b) <+ 3;"))[0] == 5
    # ... where it is made; elsewhere what was before stays
    body = "I(a, b) <+ 1; if (V(n) > 0) begin V(a, b) <+ 7; I(a, b) <+ 2; end"
    assert current(run(body, voltages={"n": 1.0}))[0] == 2
    assert current(run(body, voltages={"n": -1.0}))[0] == 1


def test_an_indirect_contribution_is_an_equation():
    result = run("V(n) : V(a, b) == 0.5 * V(n);", voltages={"a": 3.0, "n": 4.0, "I(n,0)": 2.0})
    assert current(result, "n", "0")[0] == 2.0
    assert current(result, "I(n,0)", "0")[0] == 1.0


def test_a_flow_that_is_read_and_not_given_is_a_short():
    result = run("I(n, b) <+ 10 * I(a, n);", voltages={"a": 1.0, "n": 0.25, "I(a,n)": 3.0})
    assert current(result, "n", "b")[0] == 30.0
    assert current(result, "a", "n")[0] == 3.0
    assert current(result, "I(a,n)", "0")[0] == 0.75


def test_the_flow_into_a_port():
    result = run("I(a, b) <+ 2 * V(a, b); I(n) <+ I(<a>);", voltages={"a": 1.0, "I(<a>)": 5.0})
    assert current(result, "n", "0")[0] == 5.0
    assert current(result, "I(<a>)", "0")[0] == -3.0


def test_named_branches_and_their_sides():
    body = "I(x) <+ 2 * V(x); I(y) <+ 3 * V(y); I(z) <+ V(z);"
    result = run(body, "branch (a, b) x, y; branch (n) z;", voltages={"a": 1.0, "n": 4.0})
    assert current(result)[0] == 5.0 and current(result, "n", "0")[0] == 4.0


def test_rows_of_nodes_and_generated_loops():
    text = """module line(a, b); inout a, b; electrical a, b; electrical [0:4] n; genvar i;
    parameter real r = 2;
    analog begin
        V(a, n[0]) <+ 0; V(n[4], b) <+ 0;
        for (i = 0; i < 4; i = i + 1) I(n[i], n[i + 1]) <+ V(n[i], n[i + 1]) / r;
    end endmodule"""
    result = read(text).evaluate("line", voltages={f"n[{k}]": 4.0 - k for k in range(5)})
    assert [current(result, f"n[{k}]", f"n[{k + 1}]")[0] for k in range(4)] == [0.5] * 4
    assert result["merged"] == [("a", "n[0]"), ("n[4]", "b")]


@pytest.mark.parametrize("row", ["[0:1]", "[1:0]"])
def test_a_part_of_a_row_of_nodes_is_a_port_from_left_to_right(row):
    """`w[2:3]` was no syntax, and a whole row refused."""
    text = f"""module pair(a, b); inout {row} a; inout b; electrical {row} a; electrical b;
    analog begin I(a[0], b) <+ V(a[0], b); I(a[1], b) <+ 2 * V(a[1], b); end endmodule
    module m(a, b); inout a, b; electrical a, b; electrical [0:3] w; electrical [3:2] z;
    pair one(w[2:3], b); pair two(.a(w[1:0]), .b(b)); pair three(z, b); endmodule"""
    result = read(text).evaluate(
        "m", voltages={**{f"w[{k}]": 1.0 for k in range(4)}, "z[3]": 1.0, "z[2]": 1.0}
    )
    first, second = (1.0, 2.0) if row == "[0:1]" else (2.0, 1.0)
    found = [current(result, n, "b")[0] for n in ("w[2]", "w[3]", "w[1]", "w[0]", "z[3]", "z[2]")]
    assert found == [first, second] * 3
    short = _engine.veriloga(HEAD + text.replace("w[2:3]", "w[1:3]"), "here.va", [])
    with pytest.raises(ValueError, match="port a has 2 nodes, here are 3"):
        short.evaluate("m", voltages={})


def test_a_loop_that_sets_its_own_counter_ends():
    """The form of all HiSIM models; the condition decides the counter: "the end of this loop hangs on voltages" before."""
    newton = (
        """for (i = 1; i <= most + 1; i = i + 1) begin dx = (x * x - V(a)) / (2.0 * x); x = x - dx; {} end"""
    )
    declared = "parameter integer most = 20; real x, dx; integer i, found;"
    once = "if (abs(dx) < 1e-13) i = most + 1;"
    by_flag = "if (abs(dx) < 1e-13 && V(a) > 0) found = 1; if (found == 1) i = most + 1;"
    for ends in (once, by_flag):
        text = "x = 1; found = 0; " + newton.format(ends)
        assert value("x", declared, before=text, v=2.0) == pytest.approx(math.sqrt(2.0), rel=1e-14)
    # ... after so many repetitions
    assert value("x", declared, {"most": 1}, before="x = 1;" + newton.format(once), v=2.0) == pytest.approx(
        17 / 12
    )


def test_attributes_behind_what_they_describe_and_without_commas():
    """ADMS's way, in which Xyce's models are written."""
    text = """module m(a, b) (* info="conductor" *); inout a, b; electrical a, b;
    parameter real g = 1m (* info="conductance" unit="S" *); analog I(a, b) <+ g * V(a, b); endmodule"""
    reading = read(text)
    assert reading.evaluate("m", voltages={"a": 2.0})["flows"][0][2] == 2e-3


def test_the_least_conductance_may_be_a_default():
    """BSIM6 is written so: "the value of g hangs on voltages" before."""
    deck = 'gmin\n.hdl "leak.va"\nV1 p 0 1\nN1 p 0 m\n.model m leak\n.options gmin=1e-11\n.op\n.end\n'
    text = 'module leak(p, n); inout p, n; electrical p, n; parameter real g = $simparam("gmin", 1e-12);'
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "leak.va").write_text(HEAD + text + " analog I(p, n) <+ 1e9 * g * V(p, n); endmodule")
        (Path(folder) / "leak.cir").write_text(deck)
        assert emsim.run(Path(folder) / "leak.cir")["i(v1)"][0] == pytest.approx(-1e-2)
    with pytest.raises(ValueError, match="hangs on voltages"):
        value("g", "parameter real g = V(a);")


def test_limited_voltages_are_ports_of_their_own():
    result = run(
        'I(a, b) <+ $limit(V(a, b), "pnjlim", 0.025, 0.7) + V(a, b);', voltages={"a": 1.0}, slopes=True
    )
    assert ("a", "b", ("pnjlim", [0.025, 0.7])) in result["ports"] and ("a", "b", None) in result["ports"]
    assert current(result)[0] == 2.0
    assert sorted(result["slopes"][0]) == [1.0, 1.0]


def test_noise():
    body = 'I(a, b) <+ 2 * white_noise(3, "thermal"); I(n) <+ flicker_noise(4 * V(a), 1.5, "flicker");'
    result = run(body, voltages={"a": 2.0})
    assert ("a", "b", "thermal", 12.0, None) in result["noise"]
    assert ("n", "0", "flicker", 8.0, 1.5) in result["noise"]


def test_noise_at_two_places_is_one_source():
    body = 'x = white_noise(9, "one"); I(a, b) <+ x; I(n) <+ 0.5 * x;'
    result = run(body, "real x;")
    [(start, end, name, power, _)] = result["noise"]
    assert (end, name, power) == ("0", "one", 9.0)
    told = run(body, "real x;", voltages={start: 3.0})
    assert current(told)[0] == 3.0 and current(told, "n", "0")[0] == 1.5
    assert current(told, start, "0")[0] == 3.0


def test_parameters():
    declared = """(* desc="gain", units="V/V", type="instance" *) parameter real g = 2 from [0:10) exclude 5;
    parameter real h = 2 * g; parameter integer n1 = 3; aliasparam gain = g; localparam real l = 7;"""
    assert value("g + 10 * h", declared) == 42
    assert value("g + 10 * h", declared, {"gain": 1.0}) == 21
    assert value("g + 10 * h", declared, {"G": 1.0}, instance={"g": 3.0}) == 63
    assert value("n1", declared, {"n1": 2.6}) == 3
    assert value("$param_given(g) + 2 * $param_given(h)", declared, {"gain": 2.0}) == 1
    for wrong in [{"g": 5.0}, {"g": 10.0}, {"g": -1.0}]:
        with pytest.raises(ValueError, match="is not allowed"):
            value("g", declared, wrong)
    for unknown in [{"l": 1.0}, {"x": 1.0}]:
        with pytest.raises(ValueError, match="has no parameter"):
            value("g", declared, unknown)
    about = read(module("I(a) <+ g;", declared)).describe("m")
    first, second = about["parameters"][:2]
    assert about["terminals"] == ["a", "b"]
    assert (first["names"], first["unit"], first["meaning"]) == (["g", "gain"], "V/V", "gain")
    assert first["default"] == 2 and first["instance"] and not first["integer"]
    assert second["default"] is None


def test_operating_values_bounds_and_words():
    declared = '(* desc="power", units="W" *) real p; parameter real r = 2;'
    body = """p = V(a, b) * V(a, b) / r; I(a, b) <+ V(a, b) / r; $bound_step(1n); $bound_step(0.5n * r);
    $strobe("r is %g", r); if (V(a) > 0) $strobe("never");"""
    result = run(body, declared, {"r": 3.0}, voltages={"a": 6.0})
    assert result["outputs"] == {"p": 12.0} and result["bound_step"] == pytest.approx(1e-9)
    assert result["said"] == ["r is 3"]
    with pytest.raises(ValueError, match="r is too small: 1"):
        run('if (r < 2) $error("r is too small: %g", r); I(a) <+ r;', declared, {"r": 1.0})


def test_ports_that_are_not_connected():
    body = "if ($port_connected(b)) I(a, b) <+ 1; else I(a) <+ 2;"
    assert current(run(body))[0] == 1
    assert current(run(body, connected=1), "a", "0")[0] == 2


def test_modules_in_modules():
    text = (
        module("I(a, b) <+ V(a, b) / r; V(b, n) <+ 0;", "parameter real r = 1;", "res")
        + """
    module pair(p, q); inout p, q; electrical p, q, mid; parameter real r = 5;
        res #(.r(2 * r)) upper (.a(p), .b(mid));
        res #(r) lower (mid, q);
    endmodule"""
    )
    result = read(text).evaluate("pair", voltages={"p": 10.0, "mid": 5.0})
    assert current(result, "p", "mid")[0] == 0.5 and current(result, "mid", "q")[0] == 1.0
    assert [name for name, _ in result["unknowns"]] == [
        "p",
        "q",
        "mid",
        "upper.n",
        "upper.k",
        "lower.n",
        "lower.k",
    ]


def test_paramsets_choose_by_range():
    text = (
        module("I(a, b) <+ k1 * l;", "parameter real k1 = 1; parameter real l = 1;", "base")
        + """
    paramset res base; parameter real l = 1 from (0:2]; .k1 = 10; .l = l; endparamset
    paramset res base; parameter real l = 1 from (2:inf); .k1 = 100; .l = l; endparamset"""
    )
    reading = read(text)
    assert current(reading.evaluate("res", {"l": 2.0}))[0] == 20
    assert current(reading.evaluate("res", {"l": 3.0}))[0] == 300


def test_the_preprocessor():
    text = """
    `define TWO 2
    `define SUM(x, y) ((x) + (y))
    `define LONG(x) x = x + 1; \\
                    x = x * `TWO;
    `ifdef NOTHING
        this is not read "
    `elsif TWO
        `define CHOSEN 5
    `else
        `define CHOSEN 6
    `endif
    `undef TWO
    `ifndef TWO
    `define TWO 3
    `endif
    """ + module("x = 1; `LONG(x) I(a, b) <+ `SUM(x, `SUM(`CHOSEN, `TWO));", "real x;")
    assert current(read(text).evaluate("m"))[0] == 6 + 5 + 3


def test_includes_are_found_beside_the_file_and_in_folders(tmp_path):
    (tmp_path / "inner.va").write_text("`define GAIN 4\n")
    text = '`include "inner.va"\n' + module("I(a, b) <+ `GAIN;")
    reading = read(text, [str(tmp_path)])
    assert current(reading.evaluate("m"))[0] == 4
    assert reading.files[-1].endswith("inner.va")


def test_what_is_done_at_the_first_step_may_hang_on_parameters():
    body = '@(initial_step) begin x = 2 * r; end I(a, b) <+ x; @(final_step) $strobe("end");'
    assert current(run(body, "real x; parameter real r = 3;"))[0] == 6


def test_state_between_evaluations_is_refused():
    with pytest.raises(
        ValueError, match="keeps its value from one evaluation to the next, and is computed of it"
    ):
        run("if (V(a) > 1) on = on + 1; else if (V(a) < 0) on = 0; I(a, b) <+ on;", "real on = 0;")
    with pytest.raises(ValueError, match="keeps that of an earlier evaluation"):
        run("x = x + V(a); I(a, b) <+ x;", "real x;")
    # what is set and read behind one condition is no state
    body = "if (V(a) > 0) x = V(a); I(a, b) <+ (V(a) > 0 ? 2 * x : 1);"
    assert current(run(body, "real x;", voltages={"a": 3.0}))[0] == 6


@pytest.mark.parametrize(
    ("form", "top", "bottom"),
    [
        ("nd", "'{1, 2}", "'{1, 3, 2}"),
        ("np", "'{1, 2}", "'{-1, 0, -0.5, 0}"),
        ("zp", "'{-0.5, 0}", "'{-1, 0, -0.5, 0}"),
    ],
)
def test_laplace_is_the_transfer_function(form, top, bottom):
    # (1 + 2 s)/((1 + s)(1 + 2 s)): in equilibrium and along e^(s t), s = 3
    body = f"I(a, b) <+ laplace_{form}(V(a, b), {top}, {bottom});"
    names = [n for n, kind in run(body)["unknowns"] if kind == "current"]
    s, x = 3.0, 1.0
    w = {n: x / ((1 + s) * (1 + 2 * s)) * s**k for k, n in enumerate(names)}
    result = run(body, voltages={"a": x, **w})
    assert current(result)[0] == pytest.approx(1 / (1 + s))
    for n in names:
        i, q = current(result, n, "0")
        assert i + s * q == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("body", "word"),
    [
        ("I(a) <+ transition(V(a), 0, 1n);", "transition"),
        ("I(a) <+ slew(V(a), V(b));", "slew"),
        ("@(absdelta(V(a), V(b))) x = 1; I(a) <+ x;", "absdelta"),
        ("I(a) <+ zi_nd(V(a), '{1}, '{1}, 0);", "zi_nd"),
    ],
)
def test_what_cannot_be_done_is_refused_by_name_and_line(body, word):
    reading = read("\n\n" + module(body, "real x;"))
    with pytest.raises(ValueError) as error:
        reading.evaluate("m")
    [message] = error.value.args[0]
    assert word in message["text"] and message["line"] == 6


def test_macros_are_told_in_messages():
    text = (
        HEAD
        + "`define INNER(x) V(x, nowhere)\n`define OUTER(x) 2 * `INNER(x)\n"
        + module("I(a, b) <+ `OUTER(a);")
    )
    [message] = _engine.veriloga(text, "here.va").messages
    assert message["text"] == "there is no node or branch nowhere"
    assert (message["line"], message["source"][message["column"] - 1 :][:7]) == (3, "nowhere")
    assert [(name, line) for name, _, line, _ in message["through"]] == [("INNER", 4), ("OUTER", 6)]


@pytest.mark.parametrize(
    "after", ['I(a, n) <+ white_noise(4.0 * `P_K * 300.0 * g, "thermal");', "I(a, n) <+ g * V(a, n);"]
)
def test_noise_or_a_conductance_of_zero_opens_no_short_circuit(after):
    """As BSIM4 has it: V(d, di) <+ 0 without a resistance, and the noise of that resistance behind it."""
    body = f"V(a, n) <+ 0; {after} I(n, b) <+ V(n, b) / r;"
    declared = "parameter real g = 0; parameter real r = 10;"
    result = run(body, declared, voltages={"a": 2.0, "n": 2.0})
    assert {"a", "n"} in [set(pair) for pair in result["merged"]]
    assert sum(flow for _, _, flow, _ in result["flows"]) == pytest.approx(0.2)
    # with a conductance it is the flow that counts, the last kind that was given
    open_end = run(body, declared, {"g": 1.0}, {"a": 2.0})
    assert bool(open_end["merged"]) == ("noise" in after)


def test_what_only_noise_needs_is_there_for_noise():
    """As BSIM3 has it: variables that are assigned, and read, where analysis("noise") holds."""
    body = 'if (analysis("noise")) x = V(a, b); if (analysis("noise")) y = 2.0 * x; I(a, b) <+ V(a, b) + white_noise(y, "own");'
    result = run(body, "real x, y;", voltages={"a": 3.0})
    assert current(result) == (3.0, 0.0)
    assert [n[3] for n in result["noise"]] == [6.0]


CLAMP = """module clamp(a, b); inout a, b; electrical a, b;
    analog begin
        I(a, b) <+ V(a, b) / 1k;
        %s
    end endmodule
"""


def of_deck(tmp_path, statement, tran="10u 1m"):
    (tmp_path / "clamp.va").write_text(HEAD + CLAMP % statement)
    deck = tmp_path / "deck.cir"
    deck.write_text(
        f'clamp\n.hdl "clamp.va"\nV1 a 0 SIN(0 2 1k)\nN1 a 0 c\n.model c clamp\nR1 a b 1k\nC1 b 0 10n\n.tran {tran}\n.end\n'
    )
    return emsim.run(deck)


@pytest.mark.parametrize("task", ["$strobe(V(a, b))", '$error("high")', "$finish", "$bound_step(1u)"])
def test_a_task_behind_a_condition_of_voltages_is_not_left_out_in_silence(tmp_path, task):
    result = of_deck(tmp_path, f"if (V(a, b) > 1) {task};")
    said = [d.message for d in result.diagnostics if d.code == "W288"]
    assert len(said) == 1 and task.partition("(")[0] in said[0], result.diagnostics


def test_a_bound_step_bounds_the_steps(tmp_path):
    """It was read, and nothing was done about it."""
    assert of_deck(tmp_path, "").stats["steps"] < 500
    result = of_deck(tmp_path, "$bound_step(1u);")
    assert not result.diagnostics
    assert result.stats["steps"] >= 1000
