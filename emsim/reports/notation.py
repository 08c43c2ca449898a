"""Formulas on paper: a tidied sum (algebra.py) laid out as a tree, and the tree as text, as LaTeX, as MathML.

The tree is made of tuples:
    ("num", value)   ("sym", Atom)   ("name", s)   ("sum", [(sign, node) ..])   ("prod", [node ..])   ("frac", above, below)
    ("pow", base, exponent)   ("call", function, [node ..])   ("abs", node)   ("cases", condition, a, b)   ("rate", node)
    ("more", number of terms left out)
Text is what a deck's expressions look like, `0.6*i(m1) - 0.29*sin(angle(hinge))`; select(c, a, b) is a where c holds, else b.
"""

from __future__ import annotations

from html import escape

from ..functions import IN_SOURCES

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .algebra import Atom, Monomial, Poly

    Tree = tuple[Any, ...]

MINUS = "\u2212"
LETTERS = {
    "angle": "theta", "omega": "omega", "lambda": "lambda", "mu": "mu", "pos": "x", "vel": "x", "vx": "x", "vy": "y", "vz": "z",
}  # fmt: skip
GREEK = {"theta": "\u03b8", "omega": "\u03c9", "lambda": "\u03bb", "mu": "\u03bc"}
FEW = 6  # terms that every sum shows
DOTTED = ("vel", "vx", "vy", "vz")


def spelled(function: str) -> str:
    """A function as LaTeX has it: a command, or a word without a backslash."""
    known = IN_SOURCES.get(function)
    return function if known is None else known.latex


class Names:
    """What the unknowns, sources and conditions are called. `named` are functions and factors with a name of their own, s_1."""

    def __init__(
        self, names: Sequence[str], kinds: Sequence[str], waves: dict[int, str], flags: Sequence[str]
    ):
        self.names, self.kinds, self.waves, self.flags = names, kinds, waves, flags
        self.named: dict[Atom, str] = {}

    def unknown(self, i: int) -> str:
        """v(out), i(v1), angle(hinge)"""
        name, kind = self.names[i], self.kinds[i]
        return f"v({name})" if kind == "node" else f"i({name})" if kind == "branch" else name

    def of(self, atom: Atom) -> str:
        if atom.kind == "x":
            return self.unknown(atom.number)
        if atom.kind == "wave":
            return f"{self.waves.get(atom.number, f'source{atom.number + 1}')}(t)"
        if atom.kind == "flag":
            return f"c{atom.number + 1}"
        return "t" if atom.kind == "time" else atom.text

    def parts(self, atom: Atom) -> tuple[str, str, bool]:
        """(letter, index, dotted) of a symbol: theta, hinge."""
        if atom.kind == "wave":
            return self.waves.get(atom.number, f"source{atom.number + 1}"), "(t)", False
        if atom.kind == "flag":
            return "c", str(atom.number + 1), False
        if atom.kind != "x":
            head, _, tail = (atom.text or "t").partition("_")
            return head, tail, False
        word, _, rest = self.unknown(atom.number).partition("(")
        if not rest:
            return word, "", False
        return LETTERS.get(word, word), rest.rstrip(")"), word in DOTTED


# ---- layout ---------------------------------------------------------------------------------------


class Layout:
    """Poly -> tree. `quotients`: a coefficient c is written as a division by 1/c, as of a resistance. A sum shows `most`
    terms and says how many more there are; deep inside of a formula that has shown as many already it shows a few."""

    def __init__(self, names: Names, most: int = 48) -> None:
        self.names, self.most = names, most
        self._shown, self._depth = 0, 0

    def tree(self, p: Poly, quotients: bool = False) -> Tree:
        if not p.terms:
            return ("num", 0.0)
        if self._depth == 0:
            self._shown = 0
        self._depth += 1
        try:
            return self._tree(p, quotients)
        finally:
            self._depth -= 1

    def _tree(self, p: Poly, quotients: bool) -> Tree:
        self._shown += len(p.terms)
        room = self.most if self._shown <= self.most or self._depth == 1 else FEW
        if len(p.terms) > room:
            first = sorted(p.terms, key=_rank)[:room]
            node = self._sum({m: p.terms[m] for m in first})
            terms = node[1] if node[0] == "sum" else [(1, node)]
            return ("sum", [*terms, (1, ("more", len(p.terms) - room))])
        if len(p.terms) == 1:
            ((monomial, c),) = p.terms.items()
            return self._term(monomial, c, None, quotients)
        return self._factored(p.terms, quotients)

    def _factored(self, terms: dict[Monomial, float], quotients: bool) -> Tree:
        """Factors that all terms share in front; then terms in groups of the same unknowns."""
        common = dict(next(iter(terms)))
        for monomial in terms:
            powers = dict(monomial)
            common = {
                a: p if abs(p) < abs(powers[a]) else powers[a]
                for a, p in common.items()
                if a in powers and (p > 0) == (powers[a] > 0)
            }
        sizes = {abs(c) for c in terms.values()}
        least = min(sizes)
        same = least != 1.0 and max(sizes) - least <= 1e-12 * least
        if not common and not same:
            return self._sum(terms, quotients)
        factor = tuple(sorted(common.items(), key=lambda pair: pair[0].order))
        rest = {
            tuple((a, q) for a, p in m if (q := p - common.get(a, 0))): (c / least if same else c)
            for m, c in terms.items()
        }
        inner = self._sum(rest)
        sign = 1.0
        if inner[0] == "sum" and all(s < 0 for s, _ in inner[1]):
            inner, sign = ("sum", [(1, node) for _, node in inner[1]]), -1.0
        return self._term(factor, sign * (least if same else 1.0), inner, quotients)

    def _sum(self, terms: dict[Monomial, float], quotients: bool = False) -> Tree:
        """Terms in groups: of the same quotient or function, else of the same unknowns: (a + b cos theta) omega."""
        if (square := self._square(terms, quotients)) is not None:
            return square
        heavy = any(_heavy(a) for m in terms for a, _ in m)
        groups: dict[Monomial, dict[Monomial, float]] = {}
        for monomial, c in terms.items():
            inside = [not _heavy(a) if heavy else a.trig for a, _ in monomial]
            rest = tuple(pair for pair, is_inside in zip(monomial, inside, strict=True) if not is_inside)
            inner = tuple(pair for pair, is_inside in zip(monomial, inside, strict=True) if is_inside)
            groups.setdefault(rest, {})[inner] = c
        found: list[tuple[Any, Tree]] = []
        for rest, group in groups.items():
            if len(group) == 1 or (not rest and not heavy):
                for inner, c in group.items():
                    found.append((_rank(rest + inner), self._term(rest + inner, c, None, False)))
            elif not rest:
                node = self._factored(group, False)
                parts = node[1] if node[0] == "sum" else [(1, node)]
                found += [(_rank(min(group, key=_rank)), _unsigned(part)) for part in parts]
            else:
                whole = {rest + inner: c for inner, c in group.items()}
                product = self._factored(whole, False) if heavy else self._times(rest, self._sum(group))
                found.append((_rank(rest), product))
        signed = [_signed(node) for _, node in sorted(found, key=lambda pair: pair[0])]
        first = next((k for k, (sign, _) in enumerate(signed) if sign > 0), 0)
        signed.insert(0, signed.pop(first))
        return ("sum", signed) if len(signed) > 1 else _unsigned(signed[0])

    def _times(self, rest: Monomial, inner: Tree) -> Tree:
        """(-a - b cos theta) omega as -(a + b cos theta) omega"""
        if inner[0] == "sum" and all(sign < 0 for sign, _ in inner[1]):
            return self._term(rest, -1.0, negated(inner), False)
        return self._term(rest, 1.0, inner, False)

    def _square(self, terms: dict[Monomial, float], quotients: bool) -> Tree | None:
        """a^2 - 2 a b + b^2 = (a - b)^2"""
        if len(terms) != 3:
            return None
        squares = [(m[0][0], c) for m, c in terms.items() if len(m) == 1 and m[0][1] == 2]
        mixed = [(m, c) for m, c in terms.items() if len(m) == 2 and m[0][1] == m[1][1] == 1]
        if len(squares) != 2 or not mixed or {a for a, _ in squares} != {a for a, _ in mixed[0][0]}:
            return None
        (a, ca), (b, cb) = squares
        product = mixed[0][1]
        if ca <= 0 or abs(ca - cb) > 1e-12 * ca or abs(abs(product) - 2 * ca) > 1e-12 * ca:
            return None
        base = ("sum", [(1, self._atom(a)), (1 if product > 0 else -1, self._atom(b))])
        node = ("pow", base, ("num", 2.0))
        if ca == 1.0:
            return node
        return ("frac", node, ("num", 1.0 / ca)) if quotients else ("prod", [("num", ca), node])

    def _term(self, monomial: Monomial, c: float, inner: Tree | None, quotients: bool) -> Tree:
        """c times powers, times a sum."""
        above: list[Tree] = []
        below: list[Tree] = []
        for atom, power in sorted(monomial, key=lambda pair: (pair[0].trig, pair[0].order)):
            node, size = self._atom(atom), abs(power)
            (above if power > 0 else below).append(node if size == 1 else ("pow", node, ("num", float(size))))
        if inner is not None:
            # (a + b cos theta) before the speed, a sum of voltages behind what it is multiplied by
            above = (
                [inner, *above] if monomial and all(a.kind == "x" for a, _ in monomial) else [*above, inner]
            )
        factor = abs(c)
        if factor != 1.0 and (
            quotients or (factor < 1.0 and (_third(factor) or (below and _shorter(factor))))
        ):
            below.insert(0, ("num", 1.0 / factor))
        elif factor != 1.0:
            above.insert(0, ("num", factor))
        above = above or [("num", 1.0)]
        term: Tree = above[0] if len(above) == 1 else ("prod", above)
        if below:
            term = ("frac", term, below[0] if len(below) == 1 else ("prod", below))
        return term if c >= 0 else ("sum", [(-1, term)])

    def _atom(self, atom: Atom) -> Tree:
        name = self.names.named.get(atom)
        return ("name", name) if name is not None else self.written(atom)

    def written(self, atom: Atom) -> Tree:
        """An atom in full, even where it has a name."""
        kind = atom.kind
        if kind == "group":
            return self.tree(atom.args[0])
        if kind == "pow":
            return ("pow", self.tree(atom.args[0]), self.tree(atom.args[1]))
        if kind == "select":
            return ("cases", *(self.tree(p) for p in atom.args))
        if kind in ("min", "max"):  # the constant is said last
            return ("call", kind, [self.tree(p) for p in reversed(atom.args)])
        if kind == "abs":
            return ("abs", self.tree(atom.args[0]))
        if atom.args:
            return ("call", kind, [self.tree(p) for p in atom.args])
        return ("sym", atom)


def _rank(monomial: Monomial) -> tuple[Any, ...]:
    """Constants last, otherwise as the unknowns come."""
    return (
        not monomial,
        [a.order for a, _ in monomial if not a.trig] or [-1],
        [a.order for a, _ in monomial],
    )


def _signed(node: Tree) -> tuple[int, Tree]:
    if node[0] == "sum" and len(node[1]) == 1:
        sign, inner = node[1][0]
        return sign, inner
    return 1, node


def _unsigned(pair: tuple[int, Tree]) -> Tree:
    return pair[1] if pair[0] > 0 else ("sum", [pair])


def _heavy(atom: Atom) -> bool:
    """Neither a symbol nor its sine."""
    return bool(atom.args) and not atom.trig


def _shorter(size: float) -> bool:
    """In a quotient: is it as short below the line?"""
    return len(number(1.0 / size).rstrip("0")) <= len(number(size))


def _third(size: float) -> bool:
    """Is 1/c a small whole number while c is an endless fraction? 1/3 says more than 0.333333."""
    inverse = 1.0 / size
    return (
        inverse < 13.0
        and abs(inverse - round(inverse)) < 1e-9 * inverse
        and round(inverse) in (3, 6, 7, 9, 12)
    )


def negated(node: Tree) -> Tree:
    if node[0] == "sum":
        return (
            _unsigned((-node[1][0][0], node[1][0][1]))
            if len(node[1]) == 1
            else ("sum", [(-s, n) for s, n in node[1]])
        )
    return ("sum", [(-1, node)])


# ---- text -----------------------------------------------------------------------------------------


def number(value: float, digits: int = 6) -> str:
    return f"{value:.{digits}g}".replace("e-0", "e-").replace("e+0", "e")


def text(node: Tree, names: Names, digits: int = 6) -> str:
    """As an expression of a deck is written."""

    def go(n: Tree) -> str:
        kind = n[0]
        if kind == "num":
            return number(n[1], digits)
        if kind == "sym":
            return names.of(n[1])
        if kind == "name":
            return str(n[1])
        if kind == "sum":
            parts = [("-" if s < 0 else "") + inner(m, s < 0) if k == 0 else (" - " if s < 0 else " + ") + inner(m, s < 0)
                     for k, (s, m) in enumerate(n[1])]  # fmt: skip
            return "".join(parts)
        if kind == "prod":
            return "*".join(bracketed(m) if m[0] in ("sum", "frac") else go(m) for m in n[1])
        if kind == "frac":
            above = bracketed(n[1]) if n[1][0] == "sum" else go(n[1])
            return above + "/" + (bracketed(n[2]) if n[2][0] in ("sum", "prod", "frac") else go(n[2]))
        if kind == "pow":
            base, exponent = n[1:]
            low = go(base) if base[0] in ("sym", "call", "abs", "name") else bracketed(base)
            return f"{low}^{go(exponent) if exponent[0] in ('num', 'sym') else bracketed(exponent)}"
        if kind == "call":
            return f"{n[1]}({', '.join(map(go, n[2]))})"
        if kind == "abs":
            return f"abs({go(n[1])})"
        if kind == "more":
            return f"... {n[1]} more"
        if kind == "cases":
            return f"select({', '.join(map(go, n[1:]))})"
        return f"d/dt {go(n[1])}" if n[1][0] in ("sym", "name") else f"d/dt [{go(n[1])}]"

    def inner(n: Tree, minus: bool) -> str:
        return bracketed(n) if n[0] == "sum" and (minus or len(n[1]) == 1) else go(n)

    def bracketed(n: Tree) -> str:
        return f"({go(n)})"

    return go(node)


# ---- LaTeX ----------------------------------------------------------------------------------------


def latex(node: Tree, names: Names, digits: int = 6) -> str:
    """For amsmath."""

    def go(n: Tree) -> str:
        kind = n[0]
        if kind == "num":
            return latex_number(n[1], digits)
        if kind == "sym":
            return latex_symbol(*names.parts(n[1]))
        if kind == "name":
            head, _, tail = str(n[1]).partition("_")
            return f"{head}_{{{tail}}}" if tail else head
        if kind == "sum":
            return "".join(
                ("-" if s < 0 else "" if k == 0 else "+") + (" " if k else "") + (bracketed(m) if m[0] == "sum" else go(m)) + " "
                for k, (s, m) in enumerate(n[1])
            ).strip()  # fmt: skip
        if kind == "prod":
            return _joined([(bracketed(m) if m[0] == "sum" else go(m)) for m in n[1]], n[1], r"\cdot ", r"\,")
        if kind == "frac":
            return rf"\frac{{{go(n[1])}}}{{{go(n[2])}}}"
        if kind == "pow":
            low = go(n[1]) if n[1][0] in ("sym", "name") else bracketed(n[1])
            return f"{{{low}}}^{{{go(n[2])}}}"
        if kind == "call" and n[1] == "sqrt":
            return rf"\sqrt{{{go(n[2][0])}}}"
        if kind == "call":
            word = spelled(n[1])
            head = word if word.startswith("\\") else rf"\operatorname{{{word}}}"
            return rf"{head}\left({', '.join(map(go, n[2]))}\right)"
        if kind == "abs":
            return rf"\left|{go(n[1])}\right|"
        if kind == "more":
            return rf"\cdots\text{{ ({n[1]} more)}}"
        if kind == "cases":
            return rf"\begin{{cases}}{go(n[2])} & \text{{if }} {go(n[1])}\\ {go(n[3])} & \text{{otherwise}}\end{{cases}}"
        return r"\frac{\mathrm{d}}{\mathrm{d}t}" + (
            go(n[1]) if n[1][0] in ("sym", "name") else rf"\left[{go(n[1])}\right]"
        )

    def bracketed(n: Tree) -> str:
        return rf"\left({go(n)}\right)"

    return go(node)


def latex_number(value: float, digits: int = 6) -> str:
    head, _, exponent = number(value, digits).partition("e")
    if not exponent:
        return head
    power = f"10^{{{int(exponent)}}}"
    return power if head == "1" else rf"{head}\cdot {power}"


def latex_symbol(letter: str, index: str, dotted: bool) -> str:
    if index == "(t)":
        return rf"\mathrm{{{latex_name(letter)}}}(t)"
    head = (
        rf"\{letter}"
        if letter in GREEK
        else letter
        if len(letter) == 1
        else rf"\mathrm{{{latex_name(letter)}}}"
    )
    head = rf"\dot{{{head}}}" if dotted else head
    return head + (rf"_{{\mathrm{{{latex_name(index)}}}}}" if index else "")


def latex_name(s: str) -> str:
    """A name inside of a formula, where the accents that stand for ^ and ~ in text are not allowed."""
    signs = {"^": r"\wedge ", "~": r"\sim ", "\\": r"\backslash "}
    return "".join(signs.get(c) or latex_text(c) for c in s)


def latex_text(s: str) -> str:
    for plain, escaped in (("\\", r"\textbackslash "), ("{", r"\{"), ("}", r"\}")):
        s = s.replace(plain, escaped)
    for c in "_#%&$":
        s = s.replace(c, "\\" + c)
    return s.replace("^", r"\^{}").replace("~", r"\~{}")


def _joined(parts: list[str], nodes: Sequence[Tree], between_numbers: str, thin: str) -> str:
    """A product: a visible sign between numbers, a thin space elsewhere."""
    text = parts[0]
    for node, part in zip(nodes[1:], parts[1:], strict=True):
        text += (between_numbers if node[0] == "num" else thin) + part
    return text


# ---- MathML -----------------------------------------------------------------------------------------


def mathml(node: Tree, names: Names, digits: int = 6) -> str:
    """Presentation MathML without the <math> around it."""

    def go(n: Tree) -> str:
        kind = n[0]
        if kind == "num":
            return ml_number(n[1], digits)
        if kind == "sym":
            return ml_symbol(*names.parts(n[1]))
        if kind == "name":
            head, _, tail = str(n[1]).partition("_")
            return f"<msub><mi>{head}</mi><mn>{tail}</mn></msub>" if tail else f"<mi>{escape(head)}</mi>"
        if kind == "sum":
            parts = []
            for k, (sign, m) in enumerate(n[1]):
                if k or sign < 0:
                    parts.append(
                        f"<mo>{MINUS if sign < 0 else '+'}</mo>" if k else f'<mo form="prefix">{MINUS}</mo>'
                    )
                parts.append(bracketed(m) if m[0] == "sum" else go(m))
            return row(parts)
        if kind == "prod":
            parts = [go(n[1][0]) if n[1][0][0] != "sum" else bracketed(n[1][0])]
            for m in n[1][1:]:
                parts.append("<mo>\u22c5</mo>" if m[0] == "num" else '<mspace width=".17em"/>')
                parts.append(bracketed(m) if m[0] == "sum" else go(m))
            return row(parts)
        if kind == "frac":
            return f"<mfrac>{one(n[1])}{one(n[2])}</mfrac>"
        if kind == "pow" and n[1][0] == "sym" and (raised := ml_symbol(*names.parts(n[1][1]), one(n[2]))):
            return raised
        if kind == "pow":
            low = one(n[1]) if n[1][0] in ("sym", "name") else row([bracketed(n[1])])
            return f"<msup>{low}{one(n[2])}</msup>"
        if kind == "call" and n[1] == "sqrt":
            return f"<msqrt>{go(n[2][0])}</msqrt>"
        if kind == "call":
            inside = "<mo>,</mo>".join(map(go, n[2]))
            simple = len(n[2]) == 1 and n[2][0][0] in ("sym", "name") and spelled(n[1]).startswith("\\")
            tail = '<mspace width=".1em"/>' + inside if simple else f"<mo>(</mo>{inside}<mo>)</mo>"
            return f"<mrow><mi>{spelled(n[1]).removeprefix(chr(92))}</mi>{tail}</mrow>"
        if kind == "abs":
            return f"<mrow><mo>|</mo>{go(n[1])}<mo>|</mo></mrow>"
        if kind == "more":
            return f"<mo>\u2026</mo><mtext> ({n[1]} more)</mtext>"
        if kind == "cases":
            when, a, b = map(go, n[1:])
            rows = (
                f"<mtr><mtd>{a}</mtd><mtd><mtext>if&#160;</mtext>{when}</mtd></mtr>"
                f"<mtr><mtd>{b}</mtd><mtd><mtext>otherwise</mtext></mtd></mtr>"
            )
            return f'<mtable class="cases">{rows}</mtable>'
        inside = go(n[1]) if n[1][0] in ("sym", "name") else f"<mo>[</mo>{go(n[1])}<mo>]</mo>"
        return f"<mrow><mfrac><mi>d</mi><mrow><mi>d</mi><mi>t</mi></mrow></mfrac>{inside}</mrow>"

    def one(n: Tree) -> str:
        return f"<mrow>{go(n)}</mrow>"

    def bracketed(n: Tree) -> str:
        return f"<mo>(</mo>{go(n)}<mo>)</mo>"

    def row(parts: list[str]) -> str:
        return f"<mrow>{''.join(parts)}</mrow>"

    return go(node)


def ml_number(value: float, digits: int = 6) -> str:
    head, _, exponent = number(value, digits).partition("e")
    if not exponent:
        return f"<mn>{head}</mn>"
    raised = exponent.replace("-", MINUS).lstrip("+")
    power = f"<msup><mn>10</mn><mn>{raised}</mn></msup>"
    return power if head == "1" else f"<mrow><mn>{head}</mn><mo>\u22c5</mo>{power}</mrow>"


def ml_symbol(letter: str, index: str, dotted: bool, power: str = "") -> str:
    """A symbol; with a power beside its index, "" where that has no place."""
    if index == "(t)":
        symbol = f'<mrow><mi mathvariant="normal">{escape(letter)}</mi><mo>(</mo><mi>t</mi><mo>)</mo></mrow>'
        return "" if power else symbol
    head = f"<mi>{escape(GREEK.get(letter, letter))}</mi>"
    head = f"<mover>{head}<mo>\u02d9</mo></mover>" if dotted else head
    if power:
        return (
            f"<msubsup>{head}<mtext>{escape(index)}</mtext>{power}</msubsup>"
            if index
            else f"<msup>{head}{power}</msup>"
        )
    return f"<msub>{head}<mtext>{escape(index)}</mtext></msub>" if index else head
