"""What E, F, G, H and B have in common: a value in one of six forms, given as a voltage or as a current.

linear   gain times what controls           poly    POLY(n): p0, then the products of degree 1, 2, ...
expr     an expression                      table   straight lines between points
laplace  a transfer function of an input    freq    a gain by a table over frequency
"""

from __future__ import annotations

from ..build_expr import expression, extent, node_name, transform
from ..diagnostics import Fix, Span, deck_error
from ..expr import Name, Node, calls, fold
from ..traced import number
from ..units import spice_number
from .base import CONDUCTS, DRIVES, TC, VOLTAGE, Element, Param, named, number_at

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from typing import Any

    from ..source import Line
    from .base import Path
    from .contract import Accounts, Cards, Circuit, Expr, Level
    from .net import Net

    Terms = list[tuple[int, float]]  # a sum of (unknown, factor)

RESPONSE_WORDS = ("mag", "db", "deg", "rad", "r_i")  # what the numbers of a FREQ are
TABLE_ROUNDING = 0.1  # ngspice hands TABLE to its XSPICE model `pwl` with input_domain=0.1
GROUND = ("0", "gnd")
# how LTspice takes a transfer function back into time: nothing hangs on it here
CONVOLUTION = ("window", "nfft", "mtol")


class Controlled(Element):
    __slots__ = ()
    accounted = "supplied"
    instance = named(
        m=Param("factor on the value", default=1.0), temp=Param("its temperature", "C"),
        dtemp=Param("degrees above that of the circuit", "K", 0.0), **TC,
        reciproctc=Param("1: divided by what tc1 and tc2 make"), reciprocm=Param("1: divided by m"),
    )  # fmt: skip

    # ---- reading ----

    def read(self, cards: Cards, rule: str, ch: list[Any], line: Line) -> None:
        getattr(self, "read_" + rule.removeprefix("current_"))(cards, ch, line)

    def take_controls(self, ch: list[Any]) -> list[Any]:
        """What controls a linear source, into `nodes` or `extra`; returns what follows."""
        raise NotImplementedError

    def read_linear(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.extra["form"] = "linear"
        rest = cards.params(self.take_transform(self.take_controls(ch), line), line, self)
        if self.how == "laplace" and not rest:
            return
        if not rest:
            if "gain" in self.params:
                self.value = self.params.pop("gain")
                return
            from ..marks import missing_mark

            hint = missing_mark("gear") if ch[0].lower() == "gear" else self.hint
            raise cards.fail("E109", f"{ch[0]} has no gain", line, ch[0], hint)
        self.value = cards.number(rest[0], line, "the gain")
        self.value_span = line.span_at(*extent(rest[0]))
        if len(rest) > 1:
            raise cards.fail("E102", f"`{rest[1]}` does not fit here", line, rest[1], self.hint)

    def take_transform(self, items: list[Any], line: Line) -> list[Any]:
        """Laplace= among the items behind a linear source or an expression; returns the others."""
        rest: list[Any] = []
        for item in items:
            named = item.__class__ is tuple and item[0] == "named" and item[1][0].lower() == "laplace"
            if named or (item.__class__ is tuple and item[0] == "own_laplace"):
                self._transfer(item[1][-1], line)
            else:
                rest.append(item)
        if "h" in self.extra:
            rest = [i for i in rest if i.__class__ is not tuple or str(i[1][0]).lower() not in CONVOLUTION]
        return rest

    def _transfer(self, tree: Any, line: Line) -> None:
        self.extra.update(form="laplace", h=transform(tree, line), h_span=line.span_at(*extent(tree)))

    def read_poly(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.take_nodes(ch, 2)
        dims, rest = spice_number(ch[4]), ch[5:]
        if dims is None or dims < 1 or dims != int(dims) or dims > 100:
            raise cards.fail("E110", "POLY(n) needs a whole number n", line, ch[4], self.hint)
        count = self.control_words(int(dims))
        if len(rest) < count or any(r.__class__ is tuple for r in rest[:count]):
            said = f"POLY({int(dims)}) needs {count} {self.controlled_by}"
            raise cards.fail("E109", said, line, ch[3], self.hint)
        self.extra.update(form="poly", dims=int(dims), controls=self.control_names(rest[:count]))
        self.extra["coeffs"] = [cards.number(v, line, "a coefficient") for v in rest[count:]]

    def bind(self, level: Level) -> None:
        extra = self.extra
        if "controls" in extra:
            extra["controls"] = [self.control_at(control, level) for control in extra["controls"]]
        if "coeffs" in extra:
            extra["coeffs"] = [number_at(v, level) for v in extra["coeffs"]]
        if "h" in extra:
            extra["h"] = fold(extra["h"], level.scope)
        if "response" in extra:
            extra["response"] = [number_at(v, level) for v in extra["response"]]
            extra["delay"] = number_at(extra["delay"], level)
        if "table" in extra:
            extra["table"] = [(number_at(x, level), number_at(y, level)) for x, y in extra["table"]]

    # ---- what controls: of E and G node pairs, of F, H and W currents ----

    controlled_by: str

    def control_words(self, dims: int) -> int:
        raise NotImplementedError

    def control_names(self, words: list[Any]) -> list[Any]:
        raise NotImplementedError

    def control_at(self, control: Any, level: Level) -> Any:
        raise NotImplementedError

    def controls(self, ctx: Circuit) -> list[Terms]:
        raise NotImplementedError

    # ---- the value ----

    @property
    def how(self) -> str:
        return str(self.extra.get("form", "linear"))

    @property
    def is_behaviour(self) -> bool:
        return self.how in ("expr", "table", "laplace", "freq")

    @property
    def may_behave(self) -> bool:
        return self.is_behaviour

    @property
    def gives_voltage(self) -> bool:
        raise NotImplementedError

    def known(self) -> Iterable[str]:
        if self.how == "expr":
            return self.instance
        if self.how == "laplace":
            return ("m",)
        return () if self.gives_voltage else ("m",)  # a gain, a polynomial and a table know no temperature

    @property
    def is_multiplied(self) -> bool:
        return not self.gives_voltage

    def multiplier(self) -> float:
        """m of a source of expressions, 1/m with reciprocm=1."""
        m = self.number("m", 1.0)
        return 1.0 / m if m and self.number("reciprocm") else m

    def delivers(self, ctx: Circuit) -> Expr:
        """What it delivers, as an expression [V or A]."""
        if self.how == "expr":
            return self.expression(ctx, (lambda: follows(ctx, self)) if self.gives_voltage else None)
        if self.how == "table":
            at = ctx.compile(self.value, self.value_span or self.span)
            return ctx.table(at, self.extra["table"], True, self.span, TABLE_ROUNDING)
        if self.how in ("laplace", "freq"):
            found = ctx.transferred.get(self.name)
            if found is None:
                found = ctx.transferred[self.name] = self._transferred(ctx)
            return found
        xs = [sum_of(ctx, terms) for terms in self.controls(ctx)]
        if self.how == "poly":
            return polynomial(ctx, [float(c) for c in self.extra["coeffs"]], xs)
        return float(self.value) * xs[0]

    def _transferred(self, ctx: Circuit) -> Expr:
        from .transfer import laplace, table

        by = self.value_span or self.span
        u = sum_of(ctx, self.controls(ctx)[0]) if self.value is None else ctx.compile(self.value, by)
        if self.how == "laplace":
            return laplace(ctx, self.name, u, self.extra["h"], self.extra["h_span"])
        x = self.extra
        return table(ctx, self.name, u, x["response"], x["kinds"], float(x["delay"]), self.span)

    def linear_terms(self, ctx: Circuit) -> Terms | None:
        """(unknown, gain) pairs when the source is a homogeneous linear one, else None."""
        if self.how == "linear":
            gains = [number(self.value)]
        elif self.how == "poly":
            coeffs = [float(c) for c in self.extra["coeffs"]]
            if not coeffs or coeffs[0] or any(coeffs[1 + int(self.extra["dims"]) :]):
                return None
            gains = coeffs[1:]
        else:
            return None
        pairs = zip(self.controls(ctx), gains, strict=False)
        return [(index, gain * factor) for terms, gain in pairs for index, factor in terms]

    # ---- equation (1) ----

    def branches(self, is_read: bool) -> Sequence[tuple[str, float]]:
        return ((self.name, 0.0),) if self.gives_voltage else ()

    def paths(self) -> tuple[Path, ...]:
        if self.gives_voltage:
            # a voltage that follows a current makes the currents of its loops definite, as a resistor does
            return CONDUCTS if self.reads_currents() else VOLTAGE
        # a current that depends on its own voltage may be a conductance
        own = {n for n in self.nodes[:2] if n not in GROUND}
        read = set(self.reads())
        for call in calls(self.value) if isinstance(self.value, Node) else ():
            if call.fn == "v":
                read |= {a.id if isinstance(a, Name) else repr(a) for a in call.args}
        return CONDUCTS if own & read else DRIVES

    def reads_currents(self) -> bool:
        return isinstance(self.value, Node) and any(c.fn == "i" for c in calls(self.value))

    def imposes(self, ctx: Circuit) -> bool:
        return self.gives_voltage

    def contribute(self, ctx: Circuit) -> None:
        """Row v+ - v- - value, or the value from n+ through the source to n-, times m."""
        terms = self.linear_terms(ctx)
        if self.gives_voltage:
            br = self.join_voltage(ctx)
            if terms is None:
                # m= multiplies the voltage of an expression, as in ngspice
                m = self.multiplier() if self.how in ("expr", "laplace") else 1.0
                ctx.b.add_f(br, -m * self.delivers(ctx))
            for index, gain in terms or ():
                ctx.b.g(br, index, -gain)
            return
        if terms is None:
            self.inject(ctx, self.flow(ctx))
            return
        p, n, m = ctx.node(self.nodes[0]), ctx.node(self.nodes[1]), self.number("m", 1.0)
        for index, gain in terms:
            ctx.b.g(p, index, m * gain)
            ctx.b.g(n, index, -m * gain)

    def flow(self, ctx: Circuit) -> Expr:
        return super().flow(ctx) if self.gives_voltage else self.multiplier() * self.delivers(ctx)

    def account(self, ctx: Circuit, book: Accounts) -> None:
        book.supplies(self, -(self.between(ctx) * self.flow(ctx)))

    # ---- its line for ngspice ----

    def controls_text(self, net: Net) -> str:
        raise NotImplementedError

    def analogue(self, net: Net) -> str:
        x, head = self.extra, net.head(self)
        if self.how in ("laplace", "freq"):
            said = f"`{self.name}` is a transfer function, which no source of ngspice has"
            raise deck_error("E311", said, self.span, "there it is an A device by its coefficients: s_xfer")
        if self.how == "expr":
            return f"{head} {'vol' if self.gives_voltage else 'cur'}='{net.expression(self.value)}'"
        controls = self.controls_text(net)
        if self.how == "poly":
            return f"{head} poly({x['dims']}) {controls} {' '.join(map(repr, x['coeffs']))}"
        if self.how == "table":
            points = " ".join(f"({a!r},{b!r})" for a, b in x["table"])
            return f"{head} table {{{net.expression(self.value)}}} = {points}"
        return f"{head} {controls} {float(self.value)!r}".replace("  ", " ")


class ByVoltage(Controlled):
    """E and G."""

    __slots__ = ()
    terminals = ("n+", "n-", "nc+", "nc-")
    plain = ("linear", 6, True)
    has_word = True
    controlled_by = "control nodes"

    def take_words_alone(self) -> None:
        self.extra = {"form": "linear"}

    def take_controls(self, ch: list[Any]) -> list[Any]:
        return self.take_nodes(ch, 4)

    def meant(self, ctx: Circuit, name: str) -> tuple[str | None, list[Fix]]:
        """A delay is a function of expressions: delay(x, td)."""
        if name not in ("td", "delay"):
            return None, []
        import re

        span = self.span
        line = span.file.text_line(span.line)[span.col - 1 :]
        word = r"([^\s={}();,]+)"
        found = re.match(
            rf"{word}\s+{word}\s+{word}\s+{word}\s+{word}\s+{word}\s+{name}\s*=\s*{word}\s*$", line, re.I
        )
        if found is None:
            return "write the value as an expression: VALUE={gain*delay(v(nc+,nc-),td)}", []
        of, plus, minus, first, second, gain, td = found.groups()
        text = f"{of} {plus} {minus} VALUE={{{gain}*delay(v({first},{second}),{td})}}"
        fix = Fix(Span(span.file, span.line, span.col, span.col + found.end()), text)
        return fix.label, [fix]

    def control_words(self, dims: int) -> int:
        return 2 * dims

    def control_names(self, words: list[Any]) -> list[Any]:
        nodes = [node_name(word) for word in words]
        return list(zip(nodes[0::2], nodes[1::2], strict=True))

    def control_at(self, control: Any, level: Level) -> Any:
        return level.node(control[0], None), level.node(control[1], None)

    def read_formula(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.take_nodes(ch, 2)
        key, mine = ch[3].lower(), "V=" if self.gives_voltage else "I="
        if key in (("i", "cur") if self.gives_voltage else ("v", "vol")):
            other = "a G source gives a current" if self.gives_voltage else "an E source gives a voltage"
            raise cards.fail("E115", f"{self.letter.upper()} sources take {mine}", line, ch[3], other)
        self.extra["form"] = "expr"
        self.value, self.value_span = expression(ch[4], line), line.span_at(*extent(ch[4]))
        cards.params(ch[5:], line, self)

    def read_table(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.take_nodes(ch, 2)
        start = 5 if ch[4].__class__ is tuple else 4
        self.value, self.value_span = expression(ch[4], line), line.span_at(*extent(ch[4]))
        numbers = [cards.number(v, line, "a table value") for v in ch[5:]]
        if len(numbers) < 2 or len(numbers) % 2:
            raise cards.fail("E114", "TABLE needs pairs (x,y)", line, ch[start - 1], self.hint)
        self.extra.update(form="table", table=list(zip(numbers[0::2], numbers[1::2], strict=True)))

    def read_laplace(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.take_nodes(ch, 2)
        self.value, self.value_span = expression(ch[4], line), line.span_at(*extent(ch[4]))
        self._transfer(ch[5], line)
        cards.params(ch[6:], line, self)

    def read_freq(self, cards: Cards, ch: list[Any], line: Line) -> None:
        self.take_nodes(ch, 2)
        self.value, self.value_span = expression(ch[4], line), line.span_at(*extent(ch[4]))
        numbers: list[Any] = []
        words: list[str] = []
        for item in cards.params(ch[5:], line, self):
            if item.__class__ is not tuple and item.lower() in RESPONSE_WORDS:
                words.append(item.lower())
            else:
                numbers.append(cards.number(item, line, "a value of the table"))
        if len(numbers) < 6 or len(numbers) % 3:
            said = "FREQ needs two triples at least: (frequency, magnitude, phase)"
            raise cards.fail("E114", said, line, ch[3], self.hint)
        self.extra.update(form="freq", response=numbers, kinds=words, delay=self.params.pop("delay", 0.0))

    def pairs(self) -> list[Any]:
        return self.extra.get("controls") or ([tuple(self.nodes[2:4])] if len(self.nodes) > 2 else [])

    def controls(self, ctx: Circuit) -> list[Terms]:
        return [[(ctx.node(p), 1.0), (ctx.node(n), -1.0)] for p, n in self.pairs()]

    def reads(self) -> list[str]:
        return [node for pair in self.pairs() for node in pair]

    def controls_text(self, net: Net) -> str:
        # the four nodes of a plain gain stand at its head already
        return " ".join(net.plain(node) for pair in self.extra.get("controls") or () for node in pair)


class ByCurrent(Controlled):
    """F and H."""

    __slots__ = ()
    behind = ("element",)
    controlled_by = "controlling sources"

    def take_controls(self, ch: list[Any]) -> list[Any]:
        rest = self.take_nodes(ch, 2)
        self.extra["controls"] = [rest[0].lower()]
        return rest[1:]

    def control_words(self, dims: int) -> int:
        return dims

    def control_names(self, words: list[Any]) -> list[Any]:
        return [str(word.lower()) for word in words]

    def control_at(self, control: Any, level: Level) -> Any:
        return level.prefix + control

    def controls(self, ctx: Circuit) -> list[Terms]:
        return [[(current_of(ctx, self, name), 1.0)] for name in self.extra["controls"]]

    def controls_text(self, net: Net) -> str:
        return " ".join(map(net.name_of, self.extra["controls"]))


def current_of(ctx: Circuit, e: Element, name: str) -> int:
    """The unknown that is the current of a named source; -1 with an error where there is none."""
    branch = ctx.branch(ctx.element_name(name))
    if branch is not None:
        return branch
    known = ctx.elements.get(ctx.element_name(name))
    if known is None:
        ctx.unknown(
            "E285", f"`{e.name}` reads the current of `{name}`, which this deck does not have",
            name, ctx.branches, e.span, "a current is measured with a voltage source of 0 V in its path",
        )  # fmt: skip
    else:
        ctx.sink.error(
            "E285", f"`{e.name}` reads the current of `{name}`, and only voltage sources and inductors tell theirs",
            e.span, hint=f"put a voltage source of 0 V in series with `{known.name}` and name that one",
        )  # fmt: skip
    return -1


def sum_of(ctx: Circuit, terms: Terms) -> Expr:
    return sum((factor * ctx.b.x(index) for index, factor in terms if index >= 0), ctx.b.const(0.0))


def polynomial(ctx: Circuit, coeffs: list[float], xs: list[Expr]) -> Expr:
    """POLY: p0, then the products of degree 1, 2, ... in the order x1, x2, .., x1 x1, x1 x2, .., x2 x2, .."""
    from itertools import combinations_with_replacement

    total, at, degree = ctx.b.const(coeffs[0] if coeffs else 0.0), 1, 0
    while at < len(coeffs) and xs:
        degree += 1
        for factors in combinations_with_replacement(xs, degree):
            if at == len(coeffs):
                break
            if coeffs[at]:
                term = factors[0]
                for x in factors[1:]:
                    term = term * x
                total = total + coeffs[at] * term
            at += 1
    return total


def follows(ctx: Circuit, source: Element) -> frozenset[str]:
    """Nodes that have the voltage of a source to ground whatever it is: its own, and what hangs on it by resistors alone.
    A source that chooses such a voltage holds it."""
    out, other = source.nodes[:2]
    if other not in GROUND or out in GROUND:
        return frozenset()
    found, new = {out}, [out]
    while new:
        node = new.pop()
        for e in ctx.elements.values():
            for a, b, kind in e.paths():
                ends = {e.nodes[k] for k in (a, b) if k < len(e.nodes)}
                if node not in ends or e is source or kind == "blocks":
                    continue
                if kind != "conducts" or e.letter != "r" or ends & set(GROUND):
                    return frozenset({out})
                new += ends - found
                found |= ends
    return frozenset(found)
