"""Transfer functions of E, G and B: LAPLACE of an expression in s, FREQ by a table over frequency.

What is rational in s, with exp(-s td) for delays, is H(s) = sum_d exp(-s d) N_d(s)/D(s). With D = sum a_k s^k and X = u/D the
states are z_k = c_k s^k X, k below the degree of D:

    c_{k+1}/c_k dz_k/dt = z_{k+1},    z_n = c_n/a_n (u - sum_{k<n} a_k/c_k z_k)                             (1)

and N_d X is a sum of them. With c_k = |a_k| each is about as large as u, since they add up to it. What of N_d is of a higher
degree than D are derivatives of u. Anything else, sqrt(s) say, is a number at each frequency: small signals know it, a run
does not.
"""

from __future__ import annotations

import cmath
import math
from itertools import pairwise

from ..expr import TRANSFORM, Binary, Call, Name, Num, Unary
from ..functions import IN_SOURCES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..diagnostics import Span
    from ..expr import Node
    from .contract import Circuit, Expr

    Coefficients = list[float]  # of powers of s, the lowest first

SAME = 1e-12  # of the longest delay: less is none
DEGREE = 64  # of a numerator or denominator, at most
# functions of complex numbers, by their arguments
ONE, TWO = (
    {
        name: of
        for name, f in IN_SOURCES.items()
        if f.most == count and (of := f.of_complex(cmath)) is not None
    }
    for count in (1, 2)
)
SUMS = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
    "**": lambda a, b: a**b,
}  # fmt: skip


class NotRational(Exception):
    """A part of the function that is no quotient of polynomials times a delay."""

    def __init__(self, node: Node) -> None:
        self.node = node


# ---- polynomials ----


def _trim(p: Coefficients) -> Coefficients:
    while len(p) > 1 and p[-1] == 0.0:
        p.pop()
    return p


def _plus(p: Coefficients, q: Coefficients, factor: float = 1.0) -> Coefficients:
    size = max(len(p), len(q))
    at = [(p[k] if k < len(p) else 0.0, q[k] if k < len(q) else 0.0) for k in range(size)]
    return _trim([a + factor * b for a, b in at])


def _times(p: Coefficients, q: Coefficients) -> Coefficients:
    product = [0.0] * (len(p) + len(q) - 1)
    for j, a in enumerate(p):
        for k, b in enumerate(q):
            product[j + k] += a * b
    return _trim(product)


def divided(p: Coefficients, q: Coefficients) -> tuple[Coefficients, Coefficients]:
    """Quotient and remainder; the leading coefficient of q is not 0."""
    rest, whole = list(p), [0.0] * max(len(p) - len(q) + 1, 1)
    for k in range(len(p) - len(q), -1, -1):
        whole[k] = rest[k + len(q) - 1] / q[-1]
        for j, b in enumerate(q):
            rest[k + j] -= whole[k] * b
    return _trim(whole), _trim(rest[: max(len(q) - 1, 1)] if len(p) >= len(q) else rest)


class Rational:
    """sum_d exp(-s d) terms[d](s)/below(s), delays d [s]."""

    __slots__ = ("below", "terms")

    def __init__(self, terms: dict[float, Coefficients], below: Coefficients | None = None) -> None:
        self.terms = {d: p for d, p in terms.items() if p != [0.0]} or {0.0: [0.0]}
        self.below = [1.0] if below is None else below

    def constant(self) -> float | None:
        if len(self.below) > 1 or list(self.terms) != [0.0] or len(self.terms[0.0]) > 1:
            return None
        return self.terms[0.0][0] / self.below[0]

    def plus(self, other: Rational, factor: float) -> Rational:
        same = self.below == other.below
        terms = {d: p if same else _times(p, other.below) for d, p in self.terms.items()}
        for d, p in other.terms.items():
            terms[d] = _plus(terms.get(d, [0.0]), p if same else _times(p, self.below), factor)
        return Rational(terms, self.below if same else _times(self.below, other.below))

    def times(self, other: Rational) -> Rational:
        terms: dict[float, Coefficients] = {}
        for d, p in self.terms.items():
            for e, q in other.terms.items():
                terms[d + e] = _plus(terms.get(d + e, [0.0]), _times(p, q))
        return Rational(terms, _times(self.below, other.below))

    def inverse(self) -> Rational | None:
        """None for a sum of several delays. ZeroDivisionError for 0."""
        if len(self.terms) > 1:
            return None
        ((d, p),) = self.terms.items()
        if p == [0.0]:
            raise ZeroDivisionError
        return Rational({-d: self.below}, p)

    def power(self, n: int) -> Rational | None:
        base = self if n >= 0 else self.inverse()
        if base is None or abs(n) > DEGREE:
            return None
        found = Rational({0.0: [1.0]})
        for _ in range(abs(n)):
            found = found.times(base)
        return found

    def reduced(self) -> Rational:
        """Without powers of s that stand above and below, and without delays that are rounding."""
        below, late = self.below, max(map(abs, self.terms))
        terms: dict[float, Coefficients] = {}
        for d, p in self.terms.items():
            d = d if abs(d) > SAME * late else 0.0
            terms[d] = _plus(terms.get(d, [0.0]), p)
        while len(below) > 1 and below[0] == 0.0 and all(p[0] == 0.0 for p in terms.values()):
            below, terms = below[1:], {d: p[1:] or [0.0] for d, p in terms.items()}
        return Rational(terms, below)


def rational(node: Node) -> Rational:
    """An expression of s. Raises NotRational, and ZeroDivisionError for a division by 0."""
    found = _rational(node)
    if max(map(len, (found.below, *found.terms.values()))) > DEGREE + 1:
        raise NotRational(node)
    return found


def _rational(node: Node) -> Rational:
    if isinstance(node, Num):
        return Rational({0.0: [node.value]})
    if isinstance(node, Name) and node.id == TRANSFORM:
        return Rational({0.0: [0.0, 1.0]})
    found: Rational | None = None
    if isinstance(node, Unary) and node.op in "+-":
        found = Rational({0.0: [-1.0 if node.op == "-" else 1.0]}).times(rational(node.a))
    elif isinstance(node, Binary) and node.op in SUMS:
        a, b = rational(node.a), rational(node.b)
        if node.op in "+-":
            found = a.plus(b, 1.0 if node.op == "+" else -1.0)
        elif node.op == "*":
            found = a.times(b)
        elif node.op == "/":
            below = b.inverse()
            found = None if below is None else a.times(below)
        else:
            found = _power(a, b.constant())
    elif isinstance(node, Call) and node.fn in TWO and len(node.args) == 2:
        found = _power(rational(node.args[0]), rational(node.args[1]).constant())
    elif isinstance(node, Call) and node.fn in ONE and len(node.args) == 1:
        a = rational(node.args[0])
        at = a.constant()
        if at is not None:
            value = ONE[node.fn](complex(at))
            found = Rational({0.0: [value.real]}) if value.imag == 0.0 else None
        elif node.fn == "exp" and len(a.below) == 1 and list(a.terms) == [0.0] and len(a.terms[0.0]) == 2:
            fixed, slope = (v / a.below[0] for v in a.terms[0.0])
            found = Rational({-slope: [math.exp(fixed)]})
        elif node.fn == "sqr":
            found = a.times(a)
    if found is None:
        raise NotRational(node)
    return found


def _power(a: Rational, n: float | None) -> Rational | None:
    at = a.constant()
    if n is not None and at is not None and (at > 0.0 or n == round(n)):
        return Rational({0.0: [float(at**n)]})
    return a.power(int(n)) if n is not None and n == round(n) else None


def value(node: Node, s: complex) -> complex:
    """An expression of s there. Raises ArithmeticError and ValueError as complex arithmetic does,
    NotRational for what has no complex value."""
    if isinstance(node, Num):
        return complex(node.value)
    if isinstance(node, Name) and node.id == TRANSFORM:
        return s
    if isinstance(node, Unary) and node.op in "+-":
        found = value(node.a, s)
        return -found if node.op == "-" else found
    if isinstance(node, Binary) and node.op in SUMS:
        return complex(SUMS[node.op](value(node.a, s), value(node.b, s)))
    if isinstance(node, Call) and len(node.args) == 1 and node.fn in ONE:
        return ONE[node.fn](value(node.args[0], s))
    if isinstance(node, Call) and len(node.args) == 2 and node.fn in TWO:
        return complex(TWO[node.fn](*(value(a, s) for a in node.args)))
    raise NotRational(node)


# ---- in equation (1) ----


def chain(
    ctx: Circuit,
    name: str,
    u: Expr,
    below: Sequence[float],
    scales: Sequence[float],
    of: tuple[str, str] = ("branch", "A"),
    starts: Sequence[float] = (),
) -> list[Expr]:
    """z_0 .. z_n of (1), the last by the others. States: kind and unit `of`, `starts` before a start from given values."""
    b, n = ctx.b, len(below) - 1
    states = [b.unknown(f"{name}#{n - 1 - k}", *of, starts[k] if k < len(starts) else 0.0) for k in range(n)]
    top = u
    for k, state in enumerate(states):
        if below[k]:
            top = top - below[k] / scales[k] * b.x(state)
    z = [*map(b.x, states), scales[n] / below[n] * top]
    for k, state in enumerate(states):
        b.c(state, state, scales[k + 1] / scales[k])
        b.add_f(state, -z[k + 1])
    return z


def output(ctx: Circuit, name: str, u: Expr, h: Rational) -> Expr:
    """H u of a rational H without negative delays."""
    h = h.reduced()
    n, total = len(h.below) - 1, ctx.b.const(0.0)
    parts = {d: divided(p, h.below) for d, p in h.terms.items()}
    scales = _scales(h.below, [rest for _, rest in parts.values()])
    z = chain(ctx, name, u, h.below, scales) if n else []
    for d, (whole, rest) in parts.items():
        found, slope = ctx.b.const(0.0), u
        for k, factor in enumerate(whole):
            slope = ctx.ddt(slope, f"{name}#ddt{k}") if k else slope
            found = found + factor * slope
        for k, factor in enumerate(rest):
            if n and factor:
                found = found + factor / scales[k] * z[k]
        total = total + (ctx.delay(found, d, f"{name}#late{d:g}") if d and found.value is None else found)
    return total


def _scales(below: Coefficients, above: list[Coefficients]) -> list[float]:
    """c_k of (1): |a_k|, or where that is 0 what stands above it, or what lies between its neighbours."""
    size = [abs(a) or max((abs(p[k]) for p in above if k < len(p)), default=0.0) for k, a in enumerate(below)]
    known = [k for k, v in enumerate(size) if v]
    for k, v in enumerate(size):
        if v:
            continue
        left, right = max((j for j in known if j < k), default=None), min(j for j in known if j > k)
        if left is None:
            size[k] = size[right]
        else:
            size[k] = size[left] * (size[right] / size[left]) ** ((k - left) / (right - left))
    return size


class Response:
    """H of a frequency, for small signals: what the engine asks at each s [rad/s] as (re, im)."""

    def at(self, s: complex) -> complex:
        raise NotImplementedError

    def __call__(self, re: float, im: float) -> tuple[float, float]:
        try:
            found = self.at(complex(re, im))
        except (ArithmeticError, ValueError, NotRational):
            return math.nan, math.nan
        return found.real, found.imag


class OfExpression(Response):
    def __init__(self, node: Node) -> None:
        self.node = node

    def at(self, s: complex) -> complex:
        return value(self.node, s)


class OfTable(Response):
    """Between its points the logarithm of the magnitude and the phase are straight lines over frequency, outside it is 0, as in
    PSpice. rows: frequency [Hz], magnitude, phase [rad]; what comes before the first row is its `delay` [s] later."""

    def __init__(self, rows: list[tuple[float, float, float]], delay: float) -> None:
        self.rows, self.delay = rows, delay

    def at(self, s: complex) -> complex:
        from bisect import bisect_left

        rows, f = self.rows, abs(s.imag) / (2.0 * math.pi)
        if not rows[0][0] <= f <= rows[-1][0] * (1.0 + 1e-12):
            return 0j
        k = min(max(bisect_left(rows, (f,)), 1), len(rows) - 1)
        (f0, m0, p0), (f1, m1, p1) = rows[k - 1], rows[k]
        share = min((f - f0) / (f1 - f0), 1.0)
        size = (
            math.exp(math.log(m0) + share * math.log(m1 / m0))
            if m0 > 0.0 and m1 > 0.0
            else m0 + share * (m1 - m0)
        )
        found = cmath.rect(size, p0 + share * (p1 - p0) - 2.0 * math.pi * f * self.delay)
        return found if s.imag >= 0.0 else found.conjugate()


def laplace(ctx: Circuit, name: str, u: Expr, h: Node, where: Span | None) -> Expr:
    """H u of an expression of s; 0 with an error where it is none."""
    try:
        found = rational(h).reduced()
    except NotRational as odd:
        try:
            value(h, 1j)
        except NotRational as strange:
            at = strange.node.span
            ctx.sink.error(
                "E298", f"`{name}`: this is no function of s", at if at is not None else where,
                "a transfer function is made of s, numbers and parameters; what it is applied to stands before it",
            )  # fmt: skip
            return ctx.b.const(0.0)
        except (ArithmeticError, ValueError):
            pass
        return _response(ctx, name, u, OfExpression(h), where or odd.node.span)
    except ArithmeticError:
        ctx.sink.error("E298", f"`{name}`: its transfer function divides by zero, or overflows", where)
        return ctx.b.const(0.0)
    early = -min(found.terms)
    if early > 0.0:
        ctx.sink.error(
            "E298", f"`{name}`: its transfer function is {early:g} s ahead of its input", where,
            "a delay of td seconds is exp(-s*td)",
        )  # fmt: skip
        return ctx.b.const(0.0)
    return output(ctx, name, u, found)


def table(
    ctx: Circuit,
    name: str,
    u: Expr,
    numbers: Sequence[float],
    words: Sequence[str],
    delay: float,
    where: Span | None,
) -> Expr:
    """The input times a gain by a table: triples of frequency [Hz], magnitude [dB, or with `mag` 1], phase [deg, or with `rad`
    rad]; or with `r_i` real and imaginary part."""
    rows: list[tuple[float, float, float]] = []
    for f, a, b in zip(numbers[0::3], numbers[1::3], numbers[2::3], strict=True):
        if "r_i" in words:
            size, phase = cmath.polar(complex(a, b))
            if rows:  # on along the turn that is the shorter one
                phase += 2.0 * math.pi * round((rows[-1][2] - phase) / (2.0 * math.pi))
        else:
            size = a if "mag" in words else 10.0 ** (a / 20.0)
            phase = b if "rad" in words else math.radians(b)
        rows.append((f, size, phase))
    if rows[0][0] < 0.0 or any(a[0] >= b[0] for a, b in pairwise(rows)) or any(row[1] < 0.0 for row in rows):
        ctx.sink.error(
            "E298", f"`{name}`: the frequencies of FREQ must ascend from 0 or more, and no magnitude is negative", where,
            "without a word its triples are (frequency, magnitude in dB, phase in degrees); MAG, RAD and R_I say other ones",
        )  # fmt: skip
        return ctx.b.const(0.0)
    if rows[0][0] > 0.0:
        first, last = rows[0][0], rows[-1][0]
        ctx.sink.note(
            "N298", f"`{name}`: its table goes from {first:g} to {last:g} Hz; at DC and beside it the gain is 0", where,
            "as in PSpice; a row for 0 Hz is what DC gets",
        )  # fmt: skip
    return _response(ctx, name, u, OfTable(rows, delay), where)


def _response(ctx: Circuit, name: str, u: Expr, of: Response, where: Span | None) -> Expr:
    """An unknown that is H times another, which is u; H(0) at operating points."""
    b, (still, turned) = ctx.b, of(0.0, 0.0)
    if not math.isfinite(still + turned):
        ctx.sink.error(
            "E298", f"`{name}`: its transfer function has no value at s = 0, which an operating point needs", where,
            "a capacitor in parallel, or a zero at a low frequency, bounds it",
        )  # fmt: skip
        return b.const(0.0)
    into, out = (b.unknown(f"{name}#{word}", "branch", "A", 0.0) for word in ("in", "out"))
    b.add_f(into, b.x(into) - u)
    b.g(out, out, 1.0)
    b.g(out, into, -still)
    b.response(out, into, of)
    ctx.responses.append((name, where))
    return b.x(out)
