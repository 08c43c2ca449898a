"""Behavioural expressions: syntax tree -> engine graph, with ngspice's meaning of every function.

Checked against ngspice 39 (tests/unit/circuit/test_behaviour.py has the figures). Where it surprises:

- `x^y`, `x**y`, `pow(x,y)` are |x|^y, so v^3 is |v|^3; `pwr(x,y)` keeps the sign of x. An expression that
  reads the machine is no SPICE expression: there an odd power keeps its sign as in mathematics.
- sqrt, ln, log10 of a negative number stop ngspice; here they take the magnitude, so that a Newton iterate on
  the wrong side does no harm. x/0 is x/1e-32 in ngspice; here a divisor gets 1e-32 added: 0/0 is 0 in both.
- `pwl(x, ...)` goes on along its last segments; the TABLE of E and G stays at its end values and rounds its
  corners over a tenth of a segment.
- `limit(x, lo, hi)` is nonsense in ngspice B sources (it reads numbers off the text); here it clamps, with a
  warning. `limit(nominal, deviation)` and the other random functions are drawn once.

Conditions, kinks and the jumps of floor and its like are flags, held between events that the engine locates; so a
comparator switches at its threshold and Newton never sees a jump.
"""

from __future__ import annotations

import math

from ..diagnostics import Fix, instead, suggest
from ..draws import RANDOM
from ..elements.base import CURRENT_NAMES
from ..expr import MECHANICAL, OUTSIDE, SIGNAL, Binary, Call, Cond, Name, Num, Unary, unknown_function
from ..functions import ALIASES, BRANCHES, IN_SOURCES, OF_TICKS, OF_TIME
from ..functions import FUNCTIONS as OF_SOURCES
from .terminals import device_value, element_current

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .._engine import Expr
    from ..diagnostics import Span
    from ..expr import Node
    from ..functions import Function
    from .context import Context

TINY = 1e-32  # ngspice's fudge under a division
SMOOTH = 1e-64  # under even roots, so that the derivative at 0 is finite

CONSTANTS = {"pi": math.pi, "e": math.e, "hertz": 0.0, "yes": 1.0, "no": 0.0, "true": 1.0, "false": 0.0}


class Compiler:
    """Compiles into one Context's builder. `_probes` counts what was read from the machine so far."""

    def __init__(self, ctx: Context) -> None:
        self.ctx = ctx
        self._probes = 0
        self._where: Span | None = None
        self._truths: set[int] = set()
        self._holds: Callable[[], frozenset[str]] | None = None
        self._count = 0
        self._divisors: list[
            tuple[Expr, Span | None]
        ] = []  # of the expression at hand, those that read the machine

    def compile(
        self, ast: Node, where: Span | None, holds: Callable[[], frozenset[str]] | None = None
    ) -> Expr:
        before, self._where = self._where, where
        outer, self._divisors = self._divisors, []
        held, self._holds = self._holds, holds
        try:
            whole = self._node(ast)
            if self._divisors:
                self.ctx.divided_by_motion(whole, self._divisors)
            return whole
        finally:
            self._where, self._divisors, self._holds = before, outer, held

    @property
    def where(self) -> Span | None:
        """Place of the expression at hand."""
        return self._where

    # tree ----------------------------------------------------------------------------------------

    def _node(self, node: Node | float) -> Expr:
        if isinstance(node, Num):
            return self.ctx.b.const(node.value)
        if isinstance(node, Binary):
            return self._binary(node)
        if isinstance(node, Call):
            return self._call(node)
        if isinstance(node, Name):
            return self._name(node)
        if isinstance(node, Unary):
            a = self._node(node.a)
            return -a if node.op == "-" else self._mark(1.0 - self._truth(a)) if node.op == "!" else a
        if isinstance(node, Cond):
            return self._choose(self._truth(self._node(node.c)), node.a, node.b)
        if isinstance(node, (int, float)):
            return self.ctx.b.const(float(node))
        self.ctx.sink.error("E286", f"`{node}` is no number and no expression", self._where)
        return self.ctx.b.const(0.0)

    def _error(
        self, code: str, message: str, node: Node, hint: str | None = None, fixes: Sequence[Fix] = ()
    ) -> Expr:
        self.ctx.sink.error(code, message, node.span or self._where, hint=hint, fixes=fixes)
        return self.ctx.b.const(0.0)

    def _name(self, node: Name) -> Expr:
        b = self.ctx.b
        if node.id.startswith(OUTSIDE):
            return b.wave_expr(self.ctx.input(node.id))
        if (signal := node.id.removeprefix(SIGNAL)) in self.ctx.signals:
            return self.ctx.signals[signal]
        if node.id.startswith(SIGNAL):
            return self._no_signal(node, signal)
        if node.id == "time":
            return b.time()
        if node.id == "temper":
            return b.const(self.ctx.temp)
        if node.id == "hertz" and any(a.kind == "ac" for a in self.ctx.flat.analyses):
            return self._error(
                "E282", "`hertz` in an expression has no value under .ac yet", node,
                "an element whose value depends on the frequency is written as R, L, C",
            )  # fmt: skip
        if node.id in CONSTANTS:
            return b.const(CONSTANTS[node.id])
        if node.id.startswith("@"):
            return self._device(node)
        if self._is_node(node):
            return self._error("E282", f"`{node.id}` is a node, its voltage is `v({node.id})`", node)
        from .probes import readings

        near = suggest(node.id, ("time", "temper", "hertz", "pi", "e"))
        hint, fixes = (f"did you mean `{near}`?", instead(node.span, node.id, near)) if near else (None, [])
        if offered := readings(self.ctx.machine, node.id):
            hint = f"{node.id} is mechanical, and {', '.join(offered)} are numbers of it"
            fixes = [Fix(node.span, text) for text in offered] if node.span else []
        return self._error("E282", f"`{node.id}` is no parameter and no quantity", node, hint, fixes)

    def _no_signal(self, node: Name, name: str) -> Expr:
        block, _, word = name.rpartition(".")
        own = [
            s.rpartition(".")[2] for s in self.ctx.signals if s.rpartition(".")[0] == block and "#" not in s
        ]
        near = suggest(word, own)
        hint = f"did you mean `{block}.{near}`?" if near else f"it has {', '.join(own)}"
        return self._error("E390", f"`{block}` has no signal `{word}`", node, hint)

    def _binary(self, node: Binary) -> Expr:
        op = node.op
        if op == "**":
            return self._power(node.a, node.b)
        a = self._node(node.a)
        probes = self._probes
        b = self._node(node.b)
        if op == "+":
            return a + b
        if op == "-":
            return a - b
        if op == "*":
            return a * b
        if op == "/":
            return self._divide(a, b, self._probes > probes, node)
        if op == "&&":
            return self._mark(self._truth(a) * self._truth(b))
        if op == "||":
            p, q = self._truth(a), self._truth(b)
            return self._mark(p + q - p * q)
        return self.compare(op, a, b)

    def _divide(self, a: Expr, b: Expr, mechanical: bool, node: Binary) -> Expr:
        if b.value is not None:
            if b.value == 0.0:
                return self._error(
                    "E283", "division by zero", node, "the divisor is 0 whatever the circuit does"
                )
            return a / b
        if mechanical:
            self._divisors.append((b, node.b.span or node.span or self._where))
            return a / b
        quotient = a / (b + TINY)
        self.ctx.divided(quotient, b, node.b.span or node.span or self._where)
        return quotient

    # conditions ----------------------------------------------------------------------------------

    def _mark(self, e: Expr) -> Expr:
        """Remembers that e is 0 or 1 and nothing else."""
        self._truths.add(e.id)
        return e

    def _truth(self, e: Expr) -> Expr:
        """e as 0 or 1: true is anything but zero."""
        if e.value is not None:
            return self.ctx.b.const(1.0 if e.value != 0.0 else 0.0)
        return e if e.id in self._truths else self._mark(self.ctx.flag(e) + self.ctx.flag(-e))

    def compare(self, op: str, a: Expr, b: Expr) -> Expr:
        if op == "!=":
            return self._mark(1.0 - self.compare("==", a, b))
        over, under = self.ctx.flag, self.ctx.flag
        if op == ">":
            value = over(a - b)
        elif op == "<":
            value = under(b - a)
        elif op == ">=":
            value = 1.0 - under(b - a)
        elif op == "<=":
            value = 1.0 - over(a - b)
        else:
            value = 1.0 - over(a - b) - under(b - a)
        return self._mark(value)

    def _choose(self, condition: Expr, a: Node, b: Node) -> Expr:
        if condition.value is not None:
            return self._node(a if condition.value != 0.0 else b)
        return self.ctx.b.select(condition, self._choice(a), self._choice(b))

    def _choice(self, node: Node) -> Expr:
        """A branch of a condition; a latch's own output is what it was."""
        if self._holds and isinstance(node, Call) and node.fn == "v" and len(node.args) == 1:
            name = _word(node.args[0])
            if name is not None and name in self._holds():
                return self.ctx.memory(name)
        return self._node(node)

    # powers and roots ----------------------------------------------------------------------------

    def _power(self, base: Node, exponent: Node) -> Expr:
        """|a|^b; with machine quantities in a, a^b for whole b."""
        probes = self._probes
        a = self._node(base)
        mechanical = self._probes > probes
        b = self._node(exponent)
        n = b.value
        if n is None:
            self._watch_base(a, base)
            return self.ctx.b.call("pow", self.root(a * a), b)
        if a.value is not None:
            return self._constant(lambda: math.pow(abs(a.value or 0.0), n), base)
        if n == 0.0:
            return self.ctx.b.const(1.0)
        if mechanical and n == round(n):
            return a**n
        if n < 0.0:
            return self._reciprocal(self._positive_power(a, -n, base), base)
        return self._positive_power(a, n, base)

    def _reciprocal(self, power: Expr, base: Node) -> Expr:
        """x^-n by the rule of a division, so that Newton's method may begin at 0 V."""
        quotient = 1.0 / (power + TINY)
        self.ctx.divided(quotient, power, base.span or self._where)
        return quotient

    def _positive_power(self, a: Expr, n: float, base: Node) -> Expr:
        """|a|^n for a number n > 0."""
        if n % 2 == 0:
            return a**n
        self._watch_base(a, base)
        if n == 1.0:
            return self.ctx.abs_(a)
        if n == round(n):
            return self.root(a * a) * a ** (n - 1.0)
        return self.ctx.b.call("pow", a * a + SMOOTH, self.ctx.b.const(n / 2))

    def _watch_base(self, a: Expr, base: Node) -> None:
        if not _never_negative(base):
            text = "`^` of a negative value: as in ngspice it is |x|^y; pwr(x,y) keeps the sign"
            self.ctx.watch(a, text, base.span or self._where)

    def _signed_power(self, base: Node, exponent: Node) -> Expr:
        """pwr(x, y) = sgn(x) |x|^y"""
        a, b = self._node(base), self._node(exponent)
        if a.value is not None and b.value is not None:
            x, y = a.value, b.value
            return self._constant(lambda: math.copysign(math.pow(abs(x), y), x), base)
        size = self.root(a * a)
        if b.value is not None and b.value >= 1.0:
            # x |x|^(y-1) is smooth through 0 where sgn(x) |x|^y would be a flag
            return a * (self.ctx.b.call("pow", size, b - 1.0) if b.value != 2.0 else size)
        negative = b.value is not None and b.value < 0.0
        power = (
            self._reciprocal(self.ctx.b.call("pow", size, -b), base)
            if negative
            else self.ctx.b.call("pow", size, b)
        )
        return self.ctx.b.select(self.ctx.flag(-a), -power, power)

    def root(self, square: Expr) -> Expr:
        return (
            self.ctx.b.call("sqrt", square + SMOOTH)
            if square.value is None
            else self.ctx.b.call("sqrt", square)
        )

    def _constant(self, value: Callable[[], float], node: Node) -> Expr:
        try:
            return self.ctx.b.const(float(value()))
        except (ValueError, OverflowError, ZeroDivisionError):
            return self._error("E283", "this has no finite value", node)

    # calls ---------------------------------------------------------------------------------------

    def _call(self, node: Call) -> Expr:
        fn, args = ALIASES.get(node.fn, node.fn), node.args
        ctx = self.ctx
        if fn == "v" and args and self._is_node(args[0]):
            return self._voltage(node)
        if fn == "i" and len(args) == 1 and (found := self._current(args[0])) is not None:
            return found
        if not args and fn in ("energy", "loss", "supplied"):
            from .accounts import whole

            self._probes += 1
            return whole(ctx, fn, node.span or self._where)
        if ctx.machine is not None and _reads_machine(fn):
            probe: Expr | None = ctx.machine.probe(fn, args, node.span or self._where)
            if probe is not None:
                self._probes += 1
                return probe
        if fn in ("v", "i"):
            return self._voltage(node) if fn == "v" else self._no_current(node)
        if fn == "id" and len(args) == 1 and self._current(args[0]) is not None:
            return self._device(
                Name(f"@{_word(args[0])}[id]", node.at)
            )  # of a transistor, as LTspice writes it
        if fn in OF_TICKS:
            said = f"`{fn}` counts ticks: it belongs into the equations of a BLOCK"
            return self._error("E392", said, node, "BLOCK name clock= x={..}, and read name.x here")
        handler: Callable[[Call], Expr] | None = getattr(self, f"_fn_{fn}", None)
        if handler is not None:
            return handler(node)
        if (function := IN_SOURCES.get(fn)) is not None:
            return self._of_table(function, node)
        if fn in RANDOM:
            return self._error("E286", f"`{fn}` draws from constants", node)
        if _reads_machine(fn):
            return self._not_mechanical(node)
        error = unknown_function(node)
        return self._error(error.code, error.message, node, error.hint, error.fixes)

    def call(self, function: str, *arguments: Expr) -> Expr:
        """A function that the engine has by this name."""
        return self.ctx.b.call(function, *arguments)

    def _of_table(self, function: Function, node: Call) -> Expr:
        if not self._expects(node, *range(function.least, min(function.most, len(node.args)) + 1)):
            return self.ctx.b.const(0.0)
        arguments = [self._node(a) for a in node.args]
        values = [a.value for a in arguments]
        if None not in values:
            return self._constant(lambda: function.source(*values), node)
        if isinstance(function.graph, str):
            return self.call(function.graph, *arguments)
        assert function.graph is not None
        found: Expr = function.graph(self, *arguments)
        return found

    def _expects(self, node: Call, *counts: int) -> bool:
        if len(node.args) in counts:
            return True
        wanted = " or ".join(map(str, counts))
        self._error(
            "E123",
            f"`{node.fn}` takes {wanted} argument{'s' if counts[-1] != 1 else ''}, not {len(node.args)}",
            node,
        )
        return False

    # v(), i() ------------------------------------------------------------------------------------

    def _is_node(self, arg: Node) -> bool:
        name = _word(arg)
        known = self.ctx.nodes, self.ctx.digital
        return name is not None and (name in ("0", "gnd") or any(name in table for table in known))

    def _voltage(self, node: Call) -> Expr:
        names: list[str] = []
        for arg in node.args:
            name = _word(arg)
            if name is None or not self._is_node(arg):
                shown = name if name is not None else repr(arg)
                self.ctx.unknown(
                    "E289",
                    f"no node is called `{shown}`",
                    shown,
                    [*self.ctx.nodes, *self.ctx.digital],
                    arg.span or node.span or self._where,
                )
                return self.ctx.b.const(0.0)
            names.append(name)
        if not self._expects(node, 1, 2):
            return self.ctx.b.const(0.0)
        return self.ctx.v(*names)

    def _current(self, arg: Node) -> Expr | None:
        name = _word(arg)
        return None if name is None else element_current(self.ctx, name)

    def _no_current(self, node: Call) -> Expr:
        name = _word(node.args[0]) if node.args else None
        shown = name if name is not None else ", ".join(map(repr, node.args))
        self.ctx.unknown(
            "E290", f"no element is called `{shown}`", shown, dict.fromkeys([*self.ctx.elements, *self.ctx.branches]),
            (node.args[0].span if node.args else None) or node.span or self._where,
        )  # fmt: skip
        return self.ctx.b.const(0.0)

    def _device(self, node: Name) -> Expr:
        """@r1[i], and what else an element tells of itself."""
        device, _, parameter = node.id[1:].rstrip("]").partition("[")
        if element_current(self.ctx, device) is None:
            return self._no_current(Call("i", [Name(device, node.span)], node.span))
        found = device_value(self.ctx, device, parameter)
        if found is None:
            element = self.ctx.elements.get(self.ctx.element_name(device))
            words = [] if element is None else [*element.probes(self.ctx)]
            near = suggest(parameter, words)
            hint = (
                f"the current is @{device}[i]"
                if len(words) <= len(CURRENT_NAMES)
                else f"there are {', '.join(words)}"
            )
            return self._error(
                "E282", f"`{node.id}` is not computed", node, f"did you mean {near}?" if near else hint
            )
        return found

    def _not_mechanical(self, node: Call) -> Expr:
        what = ", ".join(map(repr, node.args)) or "nothing"
        hint, fixes = ("this deck has no machine cards" if self.ctx.machine is None else None), []
        said = f"`{node.fn}` reads the machine, and `{what}` is nothing mechanical"
        from .probes import readings

        if node.fn == "energy" and (offered := readings(self.ctx.machine, what)):
            said = f"energy() reads what one element holds, and {what} is none"
            hint = (
                f"of {what} there are {', '.join(offered)}; pe() and ke() are energies of the whole machine"
            )
            fixes = [Fix(node.span, offered[-1])] if node.span and offered[-1].startswith("ke") else []
        if hint is None and len(node.args) > 2 and isinstance(node.args[0], Name):
            first, *at = map(repr, node.args)
            hint = f"a point of a body: {node.fn}({first}({', '.join(at)}))"
        return self._error("E291", said, node, hint, fixes)

    # functions of ngspice, one method each -------------------------------------------------------

    def _fn_sqrt(self, node: Call) -> Expr:
        if not self._expects(node, 1):
            return self.ctx.b.const(0.0)
        a = self._node(node.args[0])
        if a.value is not None:
            return self.ctx.b.const(math.sqrt(abs(a.value)))
        self._watch(a, "sqrt", node)
        return self.root(self.root(a * a))

    def _fn_ln(self, node: Call) -> Expr:
        if not self._expects(node, 1):
            return self.ctx.b.const(0.0)
        a = self._node(node.args[0])
        if a.value is not None:
            x = a.value
            return self._constant(lambda: math.log(abs(x)), node)
        self._watch(a, node.fn, node)
        return 0.5 * self.ctx.b.call("log", a * a + SMOOTH)

    _fn_log = _fn_ln

    def _watch(self, a: Expr, fn: str, node: Node) -> None:
        text = f"{fn} of a negative value: its magnitude is taken, where ngspice stops"
        self.ctx.watch(a, text, node.span or self._where)

    def _fn_log10(self, node: Call) -> Expr:
        return (1.0 / math.log(10.0)) * self._fn_ln(node)

    def _fn_pow(self, node: Call) -> Expr:
        return self._power(*node.args) if self._expects(node, 2) else self.ctx.b.const(0.0)

    def _fn_pwr(self, node: Call) -> Expr:
        return self._signed_power(*node.args) if self._expects(node, 2) else self.ctx.b.const(0.0)

    _fn_pwrs = _fn_pwr

    def _fn_mod(self, node: Call) -> Expr:
        """x % y, with the sign of x: x - y int(x / y)."""
        if not self._expects(node, 2):
            return self.ctx.b.const(0.0)
        x, y = node.args
        whole = Call("int", [Binary("/", x, y, node.at)], node.at)
        return self._node(Binary("-", x, Binary("*", y, whole, node.at), node.at))

    def _fn_min(self, node: Call) -> Expr:
        return self._extreme(node, self.ctx.min_)

    def _fn_max(self, node: Call) -> Expr:
        return self._extreme(node, self.ctx.max_)

    def _extreme(self, node: Call, pick: Callable[[Expr, Expr], Expr]) -> Expr:
        if len(node.args) < 2:
            self._expects(node, 2)
            return self.ctx.b.const(0.0)
        value = self._node(node.args[0])
        for arg in node.args[1:]:
            value = pick(value, self._node(arg))
        return value

    def _fn_if(self, node: Call) -> Expr:
        if not self._expects(node, 3):
            return self.ctx.b.const(0.0)
        return self._choose(self._truth(self._node(node.args[0])), node.args[1], node.args[2])

    _fn_ternary_fcn = _fn_if

    def _fn_limit(self, node: Call) -> Expr:
        if len(node.args) == 2:
            return self._error("E286", "`limit` draws from constants", node)
        if not self._expects(node, 3):
            return self.ctx.b.const(0.0)
        self.ctx.sink.warning(
            "W282", "limit(x, lo, hi) clamps here; ngspice makes a constant of it", node.span or self._where,
            hint="min(max(x, lo), hi) means the same in both",
        )  # fmt: skip
        x, lo, hi = (self._node(a) for a in node.args)
        return self.ctx.clamp(x, lo, hi)

    def _fn_pwl(self, node: Call) -> Expr:
        return self._table(node, clamped=False)

    def _fn_table(self, node: Call) -> Expr:
        return self._table(node, clamped=True)

    def _table(self, node: Call, clamped: bool) -> Expr:
        values = [self._node(a).value for a in node.args[1:]]
        if len(values) < 4 or len(values) % 2 or None in values:
            return self._error(
                "E286",
                f"`{node.fn}` needs an expression and then pairs of constants x0, y0, x1, y1, ...",
                node,
            )
        numbers = [v for v in values if v is not None]
        points = list(zip(numbers[::2], numbers[1::2], strict=True))
        return self.ctx.table(self._node(node.args[0]), points, clamped, node.span or self._where)

    def _fn_ddt(self, node: Call) -> Expr:
        if not self._expects(node, 1):
            return self.ctx.b.const(0.0)
        self._count += 1
        return self.ctx.ddt(self._node(node.args[0]), f"ddt#{self._count}")

    def _fn_idt(self, node: Call) -> Expr:
        if not self._expects(node, 1, 2):
            return self.ctx.b.const(0.0)
        start = self._node(node.args[1]).value if len(node.args) == 2 else 0.0
        if start is None:
            return self._error("E286", "idt starts from a constant", node)
        self._count += 1
        return self.ctx.idt(self._node(node.args[0]), start, f"idt#{self._count}")

    _fn_sdt = _fn_idt

    def _fn_idtmod(self, node: Call) -> Expr:
        """idtmod(x, start, m, low): the integral, less so many m that it lies between low and low + m."""
        if not self._expects(node, 1, 2, 3, 4):
            return self.ctx.b.const(0.0)
        whole = Call("idt", node.args[:2], node.at)
        if len(node.args) < 3:
            return self._node(whole)
        m, low = (self._node(a).value for a in [*node.args[2:], Num(0.0)][:2])
        if m is None or low is None or not m > 0.0:
            return self._error("E286", "idtmod takes constants, and a modulus above 0", node)
        total = self._node(whole)
        return total - m * self.ctx.floor_((total - low) * (1.0 / m))

    def _fn_delay(self, node: Call) -> Expr:
        """delay(x, td): what x was a time td [s] ago; a third argument is the longest td."""
        if not self._expects(node, 2, 3):
            return self.ctx.b.const(0.0)
        by = self._node(node.args[1]).value
        if by is None or by < 0.0:
            return self._error("E286", f"`{node.fn}` delays by a constant time that is not negative", node)
        x = self._node(node.args[0])
        if by == 0.0 or x.value is not None:
            return x
        self._count += 1
        return self.ctx.delay(x, by, f"delay#{self._count}")

    _fn_absdelay = _fn_delay


# what can be meant
FUNCTIONS = (*(f.name for f in OF_SOURCES), *BRANCHES, *OF_TIME, *RANDOM, *MECHANICAL)


def _reads_machine(fn: str) -> bool:
    """Is this a function of the machine? Kinds of joints have words of their own."""
    from ..cards.joints import WORDS

    return fn in MECHANICAL or fn in WORDS


def _never_negative(node: Node) -> bool:
    """Is it plain from the expression's form that its value is zero or more?"""
    if isinstance(node, Num):
        return node.value >= 0
    if isinstance(node, Name):
        return node.id in ("time", "pi", "e")
    if isinstance(node, Call):
        if node.fn in ("min", "max"):
            return (any if node.fn == "max" else all)(map(_never_negative, node.args))
        return node.fn in IN_SOURCES and IN_SOURCES[node.fn].positive
    if isinstance(node, Cond):
        return _never_negative(node.a) and _never_negative(node.b)
    if isinstance(node, Binary):
        if node.op == "**":
            # an odd power of a machine's quantity keeps its sign
            odd = isinstance(node.b, Num) and node.b.value % 2 == 1
            return not odd or _never_negative(node.a)
        if node.op in ("<", ">", "<=", ">=", "==", "!=", "&&", "||"):
            return True
        square = node.op == "*" and repr(node.a) == repr(node.b)
        return square or (node.op in "+*/" and _never_negative(node.a) and _never_negative(node.b))
    return isinstance(node, Unary) and node.op in "+!" and (node.op == "!" or _never_negative(node.a))


def _word(arg: Node) -> str | None:
    """The name an argument spells: a node or an element; numbers are names too."""
    if isinstance(arg, Name):
        return arg.id
    if isinstance(arg, Num) and arg.value == int(arg.value):
        return str(int(arg.value))
    return None
