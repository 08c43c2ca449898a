"""Expressions: precedence, functions, folding; the rules were read off ngspice 39."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from emsim.build import parse_expression
from emsim.expr import Call, ExprError, Name, Num, Scope, evaluate, fold, is_constant, to_text

from .support import codes, element, flat


def value(text: str, **names: float) -> float:
    return evaluate(parse_expression(text), Scope(names))


def folded(text: str, **names: float) -> str:
    return to_text(fold(parse_expression(text), Scope(names)))


@pytest.mark.parametrize(
    ("text", "result"),
    [
        # what ngspice prints for these, in .param and in B sources alike
        ("-2^2", -4), ("2^3^2", 64), ("2**3**2", 64), ("1-2-3", -4), ("2*3/4*2", 3), ("-2**2", -4), ("1<2", 1),
        ("1?2:3", 2), ("!0", 1), ("2^-1", 0.5), ("-2^-2", -0.25), ("2*-3", -6), ("- -2", 2), ("--2", 2), ("!0^2", 1),
        ("!0+1", 2), ("0||1&&0", 0), ("-2-3", -5), ("1+1<3", 1), ("1<2==1", 1), ("3>2>1", 0), ("2^2*3", 12),
        ("(-2)^3", 8), ("(-2)**2", 4), ("1>2?3:4>3?5:6", 5), ("1<>2", 1), ("1!=2", 1), ("1k+1meg", 1.001e6),
        ("1kohm", 1e3), ("1.5e-3k", 1.5), ("log(10)", math.log(10)), ("ln(10)", math.log(10)), ("log10(10)", 1),
        ("nint(2.5)", 2), ("nint(-0.5)", 0), ("int(-1.5)", -1), ("sgn(-3)", -1), ("sgn(0)", 0), ("sqr(3)", 9),
        ("floor(-1.5)", -2), ("ceil(1.2)", 2), ("min(1,2,3)", 1), ("max(1,2)", 2), ("ternary_fcn(1,2,3)", 2),
        ("pow(-2,3)", -8), ("pwr(-2,3)", 8), ("arctan(1)", math.pi / 4), ("0^0", 1), ("5%3", 2), ("1e-400", 0),
        # the two letters of a power, words for signs, brackets of every kind
        ("2 ** 3", 8), ("1 and 0", 0), ("1 or 0", 1), ("{1+2}*3", 9), ("'1+2'*3", 9), ('"1+2"*3', 9),
        ("pi", math.pi), ("u(2)", 1), ("u(-1)", 0), ("u2(0.3)", 0.3), ("uramp(-2)", 0), ("if(0,1,2)", 2),
        ("table(1,0,0,2,4)", 2), ("pwl(9,0,0,2,4)", 18), ("pwl(-1,0,0,2,4)", -2), ("table(9,0,0,2,4)", 4),
    ],
)  # fmt: skip
def test_value(text, result):
    assert value(text) == pytest.approx(result, rel=1e-15, abs=1e-300)


@pytest.mark.parametrize(
    ("text", "result"),
    [
        ("pow(-2,3)", 8),
        ("pwr(-2,3)", -8),
        ("(-2)^3", 8),
        ("pow(2,0.5)", math.sqrt(2)),
        ("u(0)", 0.5),
        ("e", math.e),
    ],
)
def test_sources_fold_by_their_own_rules(text, result):
    node = fold(parse_expression(text), Scope())
    assert isinstance(node, Num) and node.value == pytest.approx(result)


@pytest.mark.parametrize(
    ("text", "code", "under"),
    [
        ("1/0", "E124", "1/0"), ("2*sqrt(-1)", "E124", "sqrt(-1)"), ("ln(0)", "E124", "ln(0)"), ("x+1", "E120", "x"),
        ("exp(1000)", "E124", "exp(1000)"), ("foo(1)", "E122", "foo(1)"), ("sin(1,2)", "E123", "sin(1,2)"),
        ("1+time", "E125", "time"), ("2*v(a,b)", "E125", "v(a,b)"), ("1/(a-2)", "E124", "1/(a-2)"),
    ],
)  # fmt: skip
def test_what_has_no_value_says_why_and_where(text, code, under):
    with pytest.raises(ExprError) as caught:
        value(text, a=2.0)
    assert (caught.value.code, caught.value.span.text) == (code, under)


def test_a_misspelt_probe_is_told_before_what_it_takes():
    """`hinge` is no parameter, and nobody meant one."""
    with pytest.raises(ExprError) as caught:
        fold(parse_expression("2*angel(hinge)"), Scope())
    assert (caught.value.code, caught.value.span.text) == ("E122", "angel(hinge)")
    assert caught.value.hint == "did you mean `angle(hinge)`?"


def test_a_condition_shields_its_other_branch():
    assert value("a>0 ? 1/a : 0", a=0.0) == 0 and value("a!=0 && 1/a>1", a=0.0) == 0


def test_fold_leaves_what_only_the_run_knows():
    assert folded("k*v(a,b)+2*3", k=4.0) == "(4*v(a,b))+6"
    assert folded("k>1 ? v(a) : i(v1)", k=4.0) == "v(a)"
    assert folded("time*temper + 0*angle(hinge)") == "(time*temper)+(0*angle(hinge))"
    assert folded("x(pole(l,0))", l=0.6) == "x(pole(0.6,0))"
    assert folded("ddt(2*v(2))") == "ddt(2*v(2))"
    assert folded("1/0") == "1/0"  # ngspice goes on with 1e32; the run judges it
    assert not is_constant(parse_expression("1+sin(time)")) and is_constant(parse_expression("1+sin(x)"))


def test_names_in_probes_are_names():
    node = parse_expression("v(2, N+x) + i(V1)")
    assert node.a == Call("v", [Name("2"), Name("n+x")]) and node.b == Call("i", [Name("v1")])
    assert parse_expression("v(gnd)") == Call("v", [Name("0")])
    assert parse_expression("x(0(0.1,0.2))") == Call("x", [Call("0", [Num(0.1), Num(0.2)])])
    assert parse_expression("vdb(2)") == Call("vdb", [Name("2")])
    assert parse_expression("@m1[id]") == Name("@m1[id]")


def test_functions_see_their_arguments_first():
    text = ".param a=5\n.func f(a,b) {a*b+c}\n.func g(x)={f(x,2)}\n.param c=1\n"
    assert element(text + "R1 n 0 {g(3)+a}").value == 12
    assert str(element(text + "B1 n 0 V={g(v(a))}").value) == "(v(a)*2)+1"
    # a parameter resistor whose function reads the solution is a behavioural one
    assert str(element(".func f(x) {v(x)*2}\nR1 n 0 {f(n)}").value) == "v(n)*2"


def test_parameters_called_like_keywords():
    deck = flat(".param v=2 i=3 r=4 tran=5 value=6 e=7\nR1 a 0 {v*i*r*tran*value*e}")
    assert deck.elements[0].value == 2 * 3 * 4 * 5 * 6 * 7


def test_a_long_sum_equals_the_short_way():
    terms = [f"{'-' if k % 3 else '+'}{k}.5" for k in range(1, 400)]
    assert value("0" + "".join(terms)) == pytest.approx(sum(float(t) for t in terms), rel=1e-14)
    factors = [f"{'/' if k % 2 else '*'}{1 + k / 100}" for k in range(1, 300)]
    assert value("2" + "".join(factors)) == pytest.approx(eval("2" + "".join(factors)), rel=1e-13)


_OPERATORS = ["+", "-", "*", "/", "<", "<=", ">", ">=", "==", "!=", "&&", "||"]


@st.composite
def expressions(draw, depth=0):
    """(SPICE text, the same for Python). Powers are left out: Python's bind from the right."""
    if depth > 4 or draw(st.booleans()):
        number = draw(st.integers(0, 9))
        return str(number), f"{number}.0"
    kind = draw(st.sampled_from(["binary"] * 5 + ["sign", "not", "bracket", "condition"]))
    a, pa = draw(expressions(depth + 1))
    if kind == "sign":
        return f"-({a})", f"(-({pa}))"
    if kind == "not":
        return f"!({a})", f"(not ({pa}))"
    if kind == "bracket":
        return f"({a})", f"({pa})"
    b, pb = draw(expressions(depth + 1))
    if kind == "condition":
        c, pc = draw(expressions(depth + 1))
        return f"({a}?{b}:{c})", f"(({pb}) if ({pa}) else ({pc}))"
    op = draw(st.sampled_from(_OPERATORS))
    return f"{a}{op}{b}", f"{pa} {op} {pb}"


def _python(text: str) -> float:
    """Python's value; comparisons in C's precedence are bracketed by ast-free means: only arithmetic is compared."""
    return float(eval(text, {"__builtins__": {}}))


@settings(max_examples=300, deadline=None)
@given(expressions())
def test_arithmetic_agrees_with_python(pair):
    text, python = pair
    if any(op in text for op in ("<", ">", "=", "&", "|")):
        return  # chained comparisons mean something else in Python; see the next test
    try:
        expected = _python(python)
    except ZeroDivisionError:
        with pytest.raises(ExprError):
            value(text)
        return
    assert value(text) == pytest.approx(expected, rel=1e-12, abs=1e-12)


_LEVELS = [["||"], ["&&"], ["==", "!="], ["<", "<=", ">", ">="], ["+", "-"], ["*", "/"]]


@settings(max_examples=300, deadline=None)
@given(
    st.lists(
        st.tuples(st.sampled_from([op for level in _LEVELS for op in level]), st.integers(1, 5)),
        min_size=1,
        max_size=8,
    ),
    st.integers(1, 5),
)
def test_precedence_is_that_of_c(pairs, first):
    """Against precedence climbing written down once more."""
    text = str(first) + "".join(f"{op}{n}" for op, n in pairs)
    assert value(text) == pytest.approx(
        _climb([float(first)] + [x for op, n in pairs for x in (op, float(n))], 0)
    )


def _climb(items: list, level: int) -> float:
    if level == len(_LEVELS):
        return items[0]
    parts, ops, part = [], [], []
    for item in items:
        if isinstance(item, str) and item in _LEVELS[level]:
            parts.append(part)
            ops.append(item)
            part = []
        else:
            part.append(item)
    parts.append(part)
    result = _climb(parts[0], level + 1)
    for op, right in zip(ops, parts[1:], strict=True):
        b = _climb(right, level + 1)
        result = {
            "+": lambda x, y: x + y, "-": lambda x, y: x - y, "*": lambda x, y: x * y, "/": lambda x, y: x / y if y else 0,
            "<": lambda x, y: float(x < y), "<=": lambda x, y: float(x <= y), ">": lambda x, y: float(x > y),
            ">=": lambda x, y: float(x >= y), "==": lambda x, y: float(x == y), "!=": lambda x, y: float(x != y),
            "&&": lambda x, y: float(bool(x and y)), "||": lambda x, y: float(bool(x or y)),
        }[op](result, b)  # fmt: skip
    return result


def test_errors_inside_expressions_point_at_the_operator():
    assert codes("R1 a 0 {1+*2}") == ["E102"]
    assert codes("R1 a 0 {1 2}") == ["E102"]
    assert codes("R1 a 0 {}") == ["E102"]


@pytest.mark.parametrize("call", ["R1 n 0 {f30(1)}", "B1 n 0 V={f30(time)}"])
def test_functions_that_double_thirty_times_are_refused(call):
    """A thousand million calls: evaluated they took minutes, folded all memory. Ten times is no more than a long function."""
    chain = "".join(f".func f{k}(x) {{f{k - 1}(x)+f{k - 1}(x)}}\n" for k in range(1, 31))
    text = f".func f0(x) {{x}}\n{chain}"
    assert codes(text + call) == ["E121"]
    assert codes(text + call.replace("f30", "f10")) == []
