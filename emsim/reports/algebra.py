"""Formulas as sums of products, tidied for reading: what the engine's graph says, in one form whatever way it was built.

A `Poly` is a sum of coefficient times monomial, a monomial a product of powers of atoms, an atom an unknown, the time, a source,
a function of Polys. Rules, none of which changes a value beyond rounding:

    products of sums are expanded while they stay short, else kept as factors
    sin a cos b = (sin(a + b) + sin(a - b))/2, and so on: a sum of sines and cosines in which sin^2 + cos^2 is 1
    sin(a - pi/2) = -cos a; odd and even functions of -a
    select on the condition a > b of a and b is a maximum, and so on: min, max, |a|
"""

from __future__ import annotations

from math import cos, inf, pi, sin

from ..functions import IN_SOURCES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from .._engine import Expr

    Monomial = tuple[tuple["Atom", int], ...]

MOST_TERMS = 64  # that a product of sums may have before it stays a product
CANCELS = 1e-13  # a sum that is smaller than this share of its parts is rounding
QUARTER = 1e-12  # a phase this near to a multiple of a right angle is one
GUARD = 1e-30


class Atom:
    """kind: x time wave flag name; sin cos and other functions, `pow` (base, exponent), `group` (a sum as a factor), `select`
    (condition, a, b), `min`, `max`, `abs`. `number` is the index of an unknown, a wave, a flag."""

    __slots__ = ("args", "kind", "number", "order", "text")

    def __init__(self, kind: str, number: int, args: tuple[Poly, ...], order: int, text: str) -> None:
        self.kind, self.number, self.args, self.order, self.text = kind, number, args, order, text

    @property
    def trig(self) -> bool:
        return self.kind in ("sin", "cos")


class Poly:
    """Immutable; equal ones are one object."""

    __slots__ = ("id", "terms")

    def __init__(self, terms: dict[Monomial, float], id: int) -> None:
        self.terms, self.id = terms, id

    @property
    def value(self) -> float | None:
        """The value where it is a constant."""
        if not self.terms:
            return 0.0
        if len(self.terms) == 1 and () in self.terms:
            return self.terms[()]
        return None

    def atoms(self) -> Iterable[Atom]:
        """Those of its monomials, not those inside of functions."""
        return dict.fromkeys(a for m in self.terms for a, _ in m)


class Algebra:
    """Makes Polys. `flags` are those of the engine's system, (name, up, down); `waves` constants by number of a wave."""

    def __init__(
        self, flags: Sequence[tuple[str, Expr, Expr]] = (), waves: dict[int, float] | None = None
    ) -> None:
        self._atoms: dict[tuple[object, ...], Atom] = {}
        self._polys: dict[frozenset[tuple[Monomial, float]], Poly] = {}
        self._known: dict[int, Poly] = {}
        self._flags, self._waves = flags, waves or {}
        self.zero, self.one = self.number(0.0), self.number(1.0)

    # making ----------------------------------------------------------------------------------------

    def poly(self, terms: dict[Monomial, float]) -> Poly:
        key = frozenset(terms.items())
        found = self._polys.get(key)
        if found is None:
            found = self._polys[key] = Poly(terms, len(self._polys))
        return found

    def number(self, value: float) -> Poly:
        return self.poly({(): value} if value else {})

    def atom(self, kind: str, number: int = 0, args: tuple[Poly, ...] = (), text: str = "") -> Poly:
        return self.poly({((self._atom(kind, number, args, text), 1),): 1.0})

    def _atom(self, kind: str, number: int = 0, args: tuple[Poly, ...] = (), text: str = "") -> Atom:
        key = (kind, number, text, *(p.id for p in args))
        found = self._atoms.get(key)
        if found is None:
            found = self._atoms[key] = Atom(kind, number, args, len(self._atoms), text)
        return found

    def x(self, i: int) -> Poly:
        return self.atom("x", i)

    # sums and products -----------------------------------------------------------------------------

    def sum(self, parts: Iterable[tuple[float, Poly]]) -> Poly:
        total: dict[Monomial, float] = {}
        largest: dict[Monomial, float] = {}
        for factor, part in parts:
            for monomial, c in part.terms.items():
                c *= factor
                total[monomial] = total.get(monomial, 0.0) + c
                largest[monomial] = max(largest.get(monomial, 0.0), abs(c))
        return self.poly({m: c for m, c in total.items() if abs(c) > CANCELS * largest[m]})

    def add(self, a: Poly, b: Poly) -> Poly:
        return self.sum(((1.0, a), (1.0, b)))

    def sub(self, a: Poly, b: Poly) -> Poly:
        return self.sum(((1.0, a), (-1.0, b)))

    def scale(self, factor: float, a: Poly) -> Poly:
        return self.poly({m: factor * c for m, c in a.terms.items()}) if factor else self.zero

    def mul(self, a: Poly, b: Poly) -> Poly:
        for p, q in ((a, b), (b, a)):
            if (value := p.value) is not None:
                return self.scale(value, q)
        if len(a.terms) * len(b.terms) > MOST_TERMS:
            a, b = (self.grouped(p) if len(p.terms) > 1 else p for p in (a, b))
        parts = []
        for m, c in a.terms.items():
            for n, d in b.terms.items():
                parts.append((c * d, self._times(m, n)))
        return self.sum(parts)

    def grouped(self, p: Poly) -> Poly:
        """A sum as one factor."""
        return self.atom("group", 0, (p,))

    def _times(self, m: Monomial, n: Monomial) -> Poly:
        """The product of two monomials; of two sines a sum."""
        powers: dict[Atom, int] = {}
        waves: list[Atom] = []
        for atom, power in (*m, *n):
            if atom.trig and power == 1:
                waves.append(atom)
            else:
                powers[atom] = powers.get(atom, 0) + power
        roots = self.one
        for atom, power in powers.items():
            if atom.kind in ("sqrt", "abs") and abs(power) >= 2:
                even = 2 * int(power / 2)
                powers[atom] = power - even
                exponent = even if atom.kind == "abs" else even // 2
                roots = self.mul(roots, self.power(atom.args[0], exponent))
        rest = tuple(sorted(((a, p) for a, p in powers.items() if p), key=lambda pair: pair[0].order))
        if roots is not self.one:
            whole = tuple(sorted((*rest, *((w, 1) for w in waves[:1])), key=lambda pair: pair[0].order))
            product = self.mul(roots, self.poly({whole: 1.0}))
            return self.mul(product, self.poly({((waves[1], 1),): 1.0})) if waves[1:] else product
        if len(waves) < 2:
            if waves:
                rest = tuple(sorted((*rest, (waves[0], 1)), key=lambda pair: pair[0].order))
            return self.poly({rest: 1.0})
        a, b = waves
        low, high = self.sub(a.args[0], b.args[0]), self.add(a.args[0], b.args[0])
        if a.kind == b.kind:  # cos cos, sin sin
            sign = 1.0 if a.kind == "cos" else -1.0
            both = self.sum(((0.5, self.cos(low)), (0.5 * sign, self.cos(high))))
        else:  # sin a cos b = (sin(a + b) + sin(a - b))/2
            both = self.sum(((0.5, self.sin(high)), (0.5 if a.kind == "sin" else -0.5, self.sin(low))))
        return self.sum((c, self._times(rest, k)) for k, c in both.terms.items()) if rest else both

    def div(self, a: Poly, b: Poly) -> Poly:
        if (value := b.value) is not None:
            return self.scale(1.0 / value, a) if value else self.mul(a, self.power(self.grouped(b), -1))
        ratio = self.ratio(a, b)
        return self.number(ratio) if ratio is not None else self.mul(a, self.power(b, -1))

    def ratio(self, a: Poly, b: Poly) -> float | None:
        """c where a = c b, else None."""
        if not b.terms or a.terms.keys() != b.terms.keys():
            return None
        ratios = [c / b.terms[m] for m, c in a.terms.items()]
        return ratios[0] if all(abs(r - ratios[0]) <= 1e-12 * abs(r) for r in ratios) else None

    def power(self, a: Poly, n: int) -> Poly:
        if n < 0:
            if len(a.terms) == 1:
                ((monomial, c),) = a.terms.items()
                if c and not any(atom.trig for atom, _ in monomial):
                    return self.poly({tuple((atom, n * p) for atom, p in monomial): c**n})
            base = self._atom("group", 0, (a,))
            return self.poly({((base, n),): 1.0})
        result = self.one
        if n > 3 and len(a.terms) > 1:
            return self.poly({((self._atom("group", 0, (a,)), n),): 1.0})
        for _ in range(n):
            result = self.mul(result, a)
        return result

    # functions ---------------------------------------------------------------------------------------

    def sin(self, a: Poly) -> Poly:
        return self._wave(a, 0)

    def cos(self, a: Poly) -> Poly:
        return self._wave(a, 1)

    def _wave(self, a: Poly, quarter: int) -> Poly:
        """sin(a + quarter pi/2), of an argument without right angles and with a positive first term."""
        if a.value is not None:
            return self.number((sin, cos)[quarter](a.value))
        phase = a.terms.get((), 0.0)
        turns = round(phase / (pi / 2))
        if turns and abs(phase - turns * pi / 2) <= QUARTER * max(1.0, abs(phase)):
            a = self.poly({m: c for m, c in a.terms.items() if m})
            quarter += turns
        quarter %= 4
        sign = -1.0 if quarter >= 2 else 1.0
        kind = "cos" if quarter % 2 else "sin"
        if self.leading(a) < 0:
            a = self.scale(-1.0, a)
            sign = -sign if kind == "sin" else sign
        return self.scale(sign, self.atom(kind, 0, (a,)))

    def leading(self, a: Poly) -> float:
        """The coefficient of its first term, by order of appearance of its atoms; the constant comes last."""
        first = min(a.terms, key=lambda m: tuple(x.order for x, _ in m) or (1 << 60,))
        return a.terms[first]

    def call(self, name: str, a: Poly) -> Poly:
        if name in ("sin", "cos"):
            return self._wave(a, name == "cos")
        if name == "abs":
            return self.absolute(a)
        if a.terms and self.leading(a) < 0 and all(c <= 0 for c in a.terms.values()):
            known = IN_SOURCES.get(name)
            if known is not None and known.odd:
                return self.scale(-1.0, self.atom(name, 0, (self.scale(-1.0, a),)))
            if known is not None and known.even:
                a = self.scale(-1.0, a)
        return self.atom(name, 0, (a,))

    def select(self, condition: Poly, a: Poly, b: Poly) -> Poly:
        """a where the condition is not 0, else b; as min, max or |a| where it is that."""
        if (value := condition.value) is not None:
            return a if value else b
        up = self._threshold(condition)
        if up is not None and not (_endless(a) or _endless(b)):
            difference = self.sub(a, b)
            r = self.ratio(up, difference)
            if r is not None:
                if self.add(a, b).value == 0.0:
                    return self.scale(1.0 if r > 0 else -1.0, self.absolute(a))
                return self.extreme("max" if r > 0 else "min", a, b)
            # a > hi: hi, else max(lo, a)
            inner = self._single(b, "max")
            if inner is not None and a.value is not None:
                low, e = inner.args
                if low.value is not None and low.value <= a.value and up is self.sub(e, a):
                    return self.extreme("min", a, b)
        return self.atom("select", 0, (condition, a, b))

    def extreme(self, kind: str, a: Poly, b: Poly) -> Poly:
        """The constant first, so that min(x, 1) and min(1, x) are one."""
        if b.value is not None and a.value is None:
            a, b = b, a
        return self.atom(kind, 0, (a, b))

    def absolute(self, a: Poly) -> Poly:
        return a if self._single(a, "abs") is not None else self.atom("abs", 0, (self._positive(a),))

    def _positive(self, a: Poly) -> Poly:
        return a if self.leading(a) > 0 else self.scale(-1.0, a)

    def _single(self, p: Poly, kind: str) -> Atom | None:
        if len(p.terms) != 1:
            return None
        ((monomial, c),) = p.terms.items()
        plain = c == 1.0 and len(monomial) == 1 and monomial[0][1] == 1 and monomial[0][0].kind == kind
        return monomial[0][0] if plain else None

    def _threshold(self, condition: Poly) -> Poly | None:
        """What is above zero where a flag without hysteresis is 1."""
        flag = self._single(condition, "flag")
        if flag is None or flag.number >= len(self._flags):
            return None
        _, up, down = self._flags[flag.number]
        return self.of(up) if up.id == down.id else None

    # from the engine's graph -------------------------------------------------------------------------

    def of(self, e: Expr | float) -> Poly:
        """The tidied form of an expression."""
        if isinstance(e, (int, float)):
            return self.number(float(e))
        stack = [e]
        while stack:
            top = stack[-1]
            if top.id in self._known:
                stack.pop()
                continue
            name, number, operands = top.node
            missing = [o for o in operands if o.id not in self._known]
            if missing:
                stack += missing
                continue
            self._known[top.id] = self._made(name, number, [self._known[o.id] for o in operands])
            stack.pop()
        return self._known[e.id]

    def _made(self, name: str, number: float, args: list[Poly]) -> Poly:
        if name == "const":
            return self.number(number)
        if name == "wave" and int(number) in self._waves:
            return self.number(self._waves[int(number)])
        if not args:
            return self.atom(name, int(number))
        if name == "neg":
            return self.scale(-1.0, args[0])
        if name == "add":
            # what keeps a root or a quotient finite at exactly 0 is left out
            args = [a for a in args if a.value is None or abs(a.value) > GUARD]
            return self.sum((1.0, a) for a in args)
        if name == "sub":
            return self.sum(((1.0, args[0]), (-1.0, args[1])))
        if name == "mul":
            return self.mul(*args)
        if name == "div":
            return self.div(*args)
        if name == "powi":
            return self.power(args[0], int(number))
        if name == "select":
            return self.select(*args)
        if name in ("pow", "atan2"):
            return self.atom(name, 0, tuple(args))
        if name == "sqrt" and (root := self._root(args[0])) is not None:
            return root
        return self.call(name, args[0])

    def _root(self, a: Poly) -> Poly | None:
        """sqrt(c^2 (x + b)^2) is c |x + b|, of one atom x; None of what is no square."""
        squares = [(m[0][0], c) for m, c in a.terms.items() if len(m) == 1 and m[0][1] == 2]
        if len(squares) != 1 or squares[0][1] <= 0:
            return None
        x, c = squares[0]
        linear, constant = a.terms.get(((x, 1),), 0.0), a.terms.get((), 0.0)
        if (
            len(a.terms) != 1 + bool(linear) + bool(constant)
            or abs(linear**2 - 4 * c * constant) > 1e-13 * linear**2
        ):
            return None
        root = self.sum(((1.0, self.poly({((x, 1),): 1.0})), (1.0, self.number(linear / (2 * c)))))
        return self.scale(c**0.5, self.absolute(root))


def _endless(p: Poly) -> bool:
    return any(abs(c) == inf for c in p.terms.values())
