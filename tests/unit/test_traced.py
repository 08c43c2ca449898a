"""Numbers that remember what they were computed from: the same for other values to the last bit, or said to be lost."""

from __future__ import annotations

import math
import random

import pytest

from emsim._engine import Builder
from emsim.build import parse_expression
from emsim.expr import Scope, evaluate
from emsim.traced import Trace, Traced, applied, holds, number


class Names(Scope):
    """Two parameters."""

    def __init__(self, a: float, b: float) -> None:
        self.values = {"a": a, "b": b}

    def lookup(self, name: str) -> float | None:
        return self.values.get(name)


FORMULAS = [
    "a+b*2-1/a", "a**b+b^2", "-a*abs(b-3)", "sqrt(a)*exp(-b)+sin(a)", "max(a,b)+min(a,2)", "a>b ? a : 2*b", "a&&b",
    "pow(a,3)/(1+b)", "atan2(a,b)+limit(a,0,2)", "!a+b", "int(a)+b", "ln(a)*log10(b)+floor(a*10)",
]  # fmt: skip


@pytest.mark.parametrize("text", FORMULAS)
def test_formulas_are_computed_again_to_the_bit(text):
    trace = Trace()
    value = evaluate(parse_expression(text, "t"), Names(trace.root(1.25), trace.root(0.75)))
    assert value.__class__ is Traced and not trace.lost
    assert trace.again([1.25, 0.75]) == trace.values
    draws, kept = random.Random(1), 0
    for _ in range(200):
        a, b = draws.uniform(0.1, 5.0), draws.uniform(0.1, 5.0)
        again = trace.again([a, b])
        if again is not None:
            kept += 1
            assert again[value.number] == evaluate(parse_expression(text, "t"), Names(a, b))
    assert kept > 20


def test_a_decision_has_to_stay():
    trace = Trace()
    a = trace.root(1.0)
    low = a < 2.0
    x = 1.0 / a if a else 0.0
    assert low is True and x.plain == 1.0
    assert trace.again([0.5])[x.number] == 2.0
    assert trace.again([3.0]) is None and trace.again([0.0]) is None


def test_what_has_no_finite_value_is_not_computed():
    trace = Trace()
    a = trace.root(2.0)
    assert ((a - 1.0) ** 0.5).plain == 1.0 and (1.0 / a).plain == 0.5
    assert trace.again([5.0]) == [5.0, 4.0, 2.0, 0.2]
    assert trace.again([0.5]) is None  # a complex number
    assert trace.again([0.0]) is None and trace.again([1e-320]) is None
    assert trace.again([math.nan]) is None


@pytest.mark.parametrize(
    "take",
    [float, int, round, hash, str, repr, math.floor, math.ceil, "{:g}".format, lambda x: divmod(x, 2.0)],
)
def test_what_takes_it_as_a_plain_number_loses_it(take):
    trace = Trace()
    traced, plain = take(trace.root(1.5)), take(1.5)
    assert (traced == plain or take is hash) and trace.lost


def test_the_engine_takes_it_as_a_number_and_loses_it():
    trace, b = Trace(), Builder()
    x = b.x(b.unknown("a", "node", "V"))
    for made in (trace.root(2.0) * x, x * trace.root(2.0), x / trace.root(2.0)):
        assert made.value is None
    assert len(trace.lost) == 3


def test_small_parts():
    trace = Trace()
    a = trace.root(2.0)
    assert number(a) is a and number(3) == 3.0 and isinstance(number(3), float)
    assert holds([1.0, (a,)]) and holds({"k": [a]}) and not holds([1.0, "a", None])
    assert (
        applied(math.hypot, (a, 1.5)).__class__ is Traced
        and applied(math.hypot, (2.0, 1.5)).__class__ is float
    )
    with pytest.raises(AssertionError):
        trace.root(1.0)
