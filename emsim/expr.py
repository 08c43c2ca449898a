"""Expressions: the tree the parser builds, and its meaning on constants (`evaluate`, `fold`).

Ids and function names are lower-case. In calls such as v(a,b), i(v1), angle(hinge), x(pole(0.6,0)) an
argument that is a bare name is a Name, a node whose name is a number is Name("2"), a point is a Call.
"""

from __future__ import annotations

import math

from .diagnostics import Placed, did_you_mean, instead, suggest
from .draws import RANDOM, Draws, is_random
from .functions import BRANCHES, MATH, OF_COLUMNS, OF_TICKS, OF_TIME, power
from .traced import applied

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from .diagnostics import Fix, Place, Span


class Node(Placed):
    """Base of the expression tree. `span` is the place in the user's text, None for made-up nodes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return to_text(self)

    def __eq__(self, other: object) -> bool:
        """Equal as written: spans do not count."""
        return isinstance(other, type(self)) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash((type(self), self._key()))

    def _key(self) -> tuple[object, ...]:
        raise NotImplementedError


class Num(Node):
    __slots__ = ("value",)

    def __init__(self, value: float, at: Place = None) -> None:
        self.value = value
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.value,)


class Name(Node):
    __slots__ = ("id",)

    def __init__(self, id: str, at: Place = None) -> None:
        self.id = id
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.id,)


class Bare(Name):
    """A word without braces where a number belongs: the name of a .param, and nothing else. `what` it stands for."""

    __slots__ = ("what",)

    def __init__(self, id: str, what: str, at: Place = None) -> None:
        super().__init__(id, at)
        self.what = what


class Call(Node):
    __slots__ = ("args", "fn")

    def __init__(self, fn: str, args: Sequence[Node], at: Place = None) -> None:
        self.fn = fn
        self.args = list(args)
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.fn, *self.args)


class Unary(Node):
    """op: "-" "+" "!"."""

    __slots__ = ("a", "op")

    def __init__(self, op: str, a: Node, at: Place = None) -> None:
        self.op = op
        self.a = a
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.op, self.a)


class Binary(Node):
    """op: "+" "-" "*" "/" "**" "<" "<=" ">" ">=" "==" "!=" "&&" "||"."""

    __slots__ = ("a", "b", "op")

    def __init__(self, op: str, a: Node, b: Node, at: Place = None) -> None:
        self.op = op
        self.a = a
        self.b = b
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.op, self.a, self.b)


class Cond(Node):
    """c ? a : b"""

    __slots__ = ("a", "b", "c")

    def __init__(self, c: Node, a: Node, b: Node, at: Place = None) -> None:
        self.c = c
        self.a = a
        self.b = b
        self.at = at

    def _key(self) -> tuple[object, ...]:
        return (self.c, self.a, self.b)


class ExprError(Exception):
    """An expression cannot be evaluated; `code`, `message`, `span`, `hint`, `fixes` go into the diagnostic."""

    def __init__(
        self,
        code: str,
        message: str,
        span: Span | None = None,
        hint: str | None = None,
        fixes: Sequence[Fix] = (),
    ) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.span = span
        self.hint = hint
        self.fixes = fixes


def to_text(node: Node) -> str:
    """The expression as text, fully bracketed where precedence could be in doubt."""
    if isinstance(node, Num):
        return f"{node.value:g}" if float(f"{node.value:g}") == node.value else repr(node.value)
    if isinstance(node, Name):
        return node.id.removeprefix(SIGNAL)
    if isinstance(node, Call):
        if node.fn == PAST and len(node.args) == 2:
            return f"{to_text(node.args[0])}[-{to_text(node.args[1])}]"
        return f"{node.fn}({','.join(to_text(a) for a in node.args)})"
    if isinstance(node, Unary):
        return f"{node.op}{_bracketed(node.a)}"
    if isinstance(node, Binary):
        return f"{_bracketed(node.a)}{node.op}{_bracketed(node.b)}"
    if isinstance(node, Cond):
        return f"{_bracketed(node.c)}?{_bracketed(node.a)}:{_bracketed(node.b)}"
    raise TypeError(type(node).__name__)


def _bracketed(node: Node) -> str:
    text = to_text(node)
    plain = isinstance(node, (Name, Call)) or (isinstance(node, Num) and node.value >= 0)
    return text if plain else f"({text})"


def ticks_ago(brackets: str) -> int | None:
    """k of [-k], how many ticks ago; None for other text."""
    inside = brackets[1:-1].replace(" ", "")
    return int(inside[1:]) if inside[:1] == "-" and inside[1:].isdecimal() and inside.strip("-0") else None


# ---- meaning on constants ----

_LIMIT, _MOST_CALLS = 64, 100_000  # .func calls: how deep, and how many in one expression


class Scope:
    """What names mean while an expression is evaluated. Subclasses look further than a dict."""

    def __init__(self, values: dict[str, float] | None = None) -> None:
        self.values: dict[str, float] = {} if values is None else values

    @property
    def draws(self) -> Draws:
        """Where random values come from."""
        return Draws()

    def lookup(self, name: str) -> float | None:
        """The value of a parameter, or None when there is none of that name. May raise ExprError."""
        return self.values.get(name)

    def function(self, name: str) -> tuple[list[str], Node] | None:
        """Argument names and body of a .func."""
        return None

    def names(self) -> Iterable[str]:
        """Parameters in sight, for suggestions."""
        return self.values

    def unknown(self, node: Name) -> Node | None:
        """What a name that is no parameter stands for, where it may be something else."""
        return None

    def outside(self, node: Name) -> Node | None:
        """What stands for a parameter whose value comes from outside while the model runs."""
        return None

    def reads(self, function: str) -> bool:
        """Is this a function by which a kind of joint is read?"""
        return False

    def probe(self, call: Call) -> Node:
        """A call that reads the solution (v, i, angle ..), with names as the flat deck knows them."""
        return call


class _FuncScope(Scope):
    """A .func body sees its arguments first, then what is in sight where it is used."""

    def __init__(self, outer: Scope, values: dict[str, float]) -> None:
        super().__init__(values)
        self.outer = outer

    @property
    def draws(self) -> Draws:
        return self.outer.draws

    def lookup(self, name: str) -> float | None:
        value = self.values.get(name)
        return self.outer.lookup(name) if value is None else value

    def function(self, name: str) -> tuple[list[str], Node] | None:
        return self.outer.function(name)

    def names(self) -> Iterable[str]:
        return [*self.values, *self.outer.names()]

    def reads(self, function: str) -> bool:
        return self.outer.reads(function)


class _Calls:
    """The .func calls of one expression: how deep they stand in each other, and how many they have been."""

    depth = total = 0

    def enter(self, node: Call) -> None:
        self.depth, self.total = self.depth + 1, self.total + 1
        if self.depth > _LIMIT:
            raise ExprError("E121", f"the function `{node.fn}` calls itself without end", node.span)
        if self.total > _MOST_CALLS:
            said = f"an expression by way of `{node.fn}` makes more than {_MOST_CALLS} calls of functions"
            raise ExprError("E121", said, node.span, "a function that calls another twice doubles the calls")


# another measurement, where a .meas reads one: meas(name)
MEASURED = "meas"
# functions that read circuit and machine; kinds of joints have words of their own beside them (Scope.reads)
PARTS = frozenset("vm vp vr vi vdb vph im ip ir ii idb".split())  # of complex voltages and currents
MECHANICAL = frozenset(
    """
    v i angle omega alpha pos vel acc x y z vx vy vz ax ay az fx fy fz mx my mz force torque id iq p gap slip friction mode hits
    rolling drilling impulse tension length energy temp mmf pressure heat flux flow ke pe power loss supplied
    """.split()
)
PROBES = MECHANICAL | PARTS
# before the name of what comes from outside while the model runs (fmus/ports.py); no name of a deck begins so
OUTSIDE = "input "
# before the name of a clocked signal where no parameter can be meant
SIGNAL = "signal "
PAST = "past"  # past(x,k) is x[-k]
TRANSFORM = "s of a transform"  # the variable of a transfer function; no deck can write that name
OWN = "x of itself"  # the current of a coil in its flux=, the voltage of a capacitor in its Q=: LTspice's x
RUN_TIME_NAMES = frozenset(("time", "temper", "hertz"))
CONSTANTS = {"pi": math.pi, "e": math.e}

_COMPARE: dict[str, Callable[[float, float], float]] = {
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "==": lambda a, b: float(a == b),
    "!=": lambda a, b: float(a != b),
    "&&": lambda a, b: float(bool(a) and bool(b)),
    "||": lambda a, b: float(bool(a) or bool(b)),
}
_ARITHMETIC: dict[str, Callable[[float, float], float]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "**": power,
    **_COMPARE,
}


def evaluate(node: Node, scope: Scope) -> float:
    """The value of an expression of parameters, constants and .func calls. Raises ExprError with a span."""
    try:
        value = _evaluate(node, scope, _Calls())
        if not math.isfinite(value):
            raise ExprError("E124", f"`{_short(node)}` is {value:g}, not a finite number", node.span)
    except ExprError as error:
        error.span = error.span or node.span
        if error.code == "E124" and not error.hint:
            known = {name: scope.lookup(name) for name in names(node)}
            error.hint = ", ".join(f"{k} is {v:g}" for k, v in known.items() if v is not None) or None
        raise
    return value


def names(node: Node) -> Iterator[str]:
    """Names that stand in an expression."""
    if isinstance(node, Name):
        yield node.id
    for part in (*getattr(node, "args", ()), *(getattr(node, key, None) for key in "cab")):
        if isinstance(part, Node):
            yield from names(part)


def calls(ast: Node | float) -> Iterator[Call]:
    """All calls in an expression."""
    if isinstance(ast, Call):
        yield ast
        parts: Iterable[Node] = ast.args
    elif isinstance(ast, Binary):
        parts = (ast.a, ast.b)
    elif isinstance(ast, Unary):
        parts = (ast.a,)
    elif isinstance(ast, Cond):
        parts = (ast.c, ast.a, ast.b)
    else:
        parts = ()
    for part in parts:
        yield from calls(part)


def _evaluate(node: Node, scope: Scope, calls: _Calls) -> float:
    if isinstance(node, Num):
        return node.value
    if isinstance(node, Name):
        value = scope.lookup(node.id)
        if value is None and node.__class__ is Name:
            value = CONSTANTS.get(node.id)
        if value is None:
            raise undefined(node, scope)
        return value
    if isinstance(node, Binary):
        a = _evaluate(node.a, scope, calls)
        if node.op == "&&" and not a:
            return 0.0
        if node.op == "||" and a:
            return 1.0
        return _apply(_ARITHMETIC[node.op], (a, _evaluate(node.b, scope, calls)), node)
    if isinstance(node, Unary):
        a = _evaluate(node.a, scope, calls)
        return -a if node.op == "-" else a if node.op == "+" else float(not a)
    if isinstance(node, Cond):
        return _evaluate(node.a if _evaluate(node.c, scope, calls) else node.b, scope, calls)
    assert isinstance(node, Call)
    return _evaluate_call(node, scope, calls)


def _evaluate_call(node: Call, scope: Scope, calls: _Calls) -> float:
    defined = scope.function(node.fn)
    if defined is not None:
        names, body = defined
        _check_count(node, len(names), len(names))
        values = [_evaluate(a, scope, calls) for a in node.args]
        calls.enter(node)
        value = _evaluate(body, _FuncScope(scope, dict(zip(names, values, strict=True))), calls)
        calls.depth -= 1
        return value
    if node.fn in BRANCHES:
        _check_count(node, 3, 3)
        return _evaluate(node.args[1 if _evaluate(node.args[0], scope, calls) else 2], scope, calls)
    if is_random(node.fn, len(node.args)):
        least, most, _ = RANDOM[node.fn]
        _check_count(node, least, most)
        draw = scope.draws.of(node)
        return _apply(draw, tuple(_evaluate(a, scope, calls) for a in node.args), node)
    if (function := MATH.get(node.fn)) is not None:
        _check_count(node, function.least, function.most)
        return _apply(function.value, tuple(_evaluate(a, scope, calls) for a in node.args), node)
    if any(node.fn in known for known in (PROBES, OF_TIME, OF_TICKS, OF_COLUMNS)) or scope.reads(node.fn):
        raise ExprError(
            "E125",
            f"`{_short(node)}` is known only while the run goes on; a number is needed here",
            node.span,
            MAY_READ,
        )
    raise unknown_function(node)


def _apply(function: Callable[..., float], args: tuple[float, ...], node: Node) -> float:
    try:
        return applied(function, args)
    except ZeroDivisionError:
        raise ExprError("E124", f"division by zero in `{_short(node)}`", node.span) from None
    except (ValueError, OverflowError):
        shown = ", ".join(f"{a:g}" for a in args)
        raise ExprError("E124", f"`{_short(node)}` has no value at ({shown})", node.span) from None


def _check_count(node: Call, least: int, most: int) -> None:
    n = len(node.args)
    if not least <= n <= most:
        wanted = str(least) if least == most else f"{least} or more" if most > 20 else f"{least} to {most}"
        raise ExprError(
            "E123", f"`{node.fn}` takes {wanted} argument{'s' * (wanted != '1')}, not {n}", node.span
        )


MAY_READ = "B sources, E/G VALUE= and behavioural R, C, L may read the solution"
# what people call the readings of the machine
SYNONYMS = {
    "theta": "angle", "phi": "angle", "q": "angle", "w": "omega", "speed": "omega", "velocity": "vel", "position": "pos",
    "acceleration": "acc", "current": "i", "voltage": "v", "der": "ddt", "derivative": "ddt", "diff": "ddt", "integral": "idt",
    "integrate": "idt",
}  # fmt: skip


def undefined(node: Name, scope: Scope) -> ExprError:
    """The error for a name that is no parameter in sight."""
    if isinstance(node, Bare):
        hint = did_you_mean(node.id, scope.names(), "write a number, or the name of a .param")
        return ExprError("E110", f"{node.what} is no number: `{node.id}`", node.span, hint)
    if node.id in RUN_TIME_NAMES:
        return ExprError("E125", f"`{node.id}` is known only while the run goes on", node.span, MAY_READ)
    near = suggest(node.id, scope.names())
    fixes = instead(node.span, node.id, near) if near else []
    if near:
        hint = f"did you mean `{near}`?"
    elif node.id == "t":
        hint, fixes = "the time of the run is called `time`", instead(node.span, "t", "time")
    elif node.id in PROBES and len(node.id) > 2:
        hint = f"it reads the machine, and has to be told what: {node.id}(name)"
    else:
        hint = f"define it: .param {node.id}=... (the voltage of a node is v({node.id}))"
    return ExprError("E120", f"no parameter is called `{node.id}`", node.span, hint, fixes)


# currents into terminals, as LTspice and PSpice write what ngspice calls @q1[ic]
AT_TERMINALS = ("ib", "ic", "ie", "ig", "is")  # and `id`, which is a machine's too: behaviour.py

# functions of LTspice and PSpice, and what to write
FOREIGN = {
    "uplim": "write min(x, limit), or say --dialect ltspice", "dnlim": "write max(x, limit), or say --dialect ltspice",
    "buf": "write x > 0.5 ? 1 : 0", "inv": "write x > 0.5 ? 0 : 1",
    "arcsin": "write asin(x)", "arccos": "write acos(x)", "cbrt": "write sgn(x)*abs(x)^(1/3)",
    "square": "write x*x", "rand": "random numbers are not supported", "random": "random numbers are not supported",
    "white": "random numbers are not supported", "mc": "random numbers are not supported",
    "flat": "random numbers are not supported",
}  # fmt: skip


def unknown_function(node: Call) -> ExprError:
    near = SYNONYMS.get(node.fn) or suggest(
        node.fn, [*MATH, *RANDOM, *BRANCHES, *PROBES, *OF_TIME, *OF_TICKS]
    )
    foreign = FOREIGN.get(node.fn)
    fixes = instead(node.span, node.fn, near) if near and foreign is None else []
    if near in PROBES:
        near = to_text(Call(near, node.args))
    return ExprError(
        "E122", f"there is no function `{node.fn}`", node.span,
        foreign or (f"did you mean `{near}`?" if near else None), fixes,
    )  # fmt: skip


def fold(node: Node, scope: Scope) -> Node:
    """The expression with parameters and .func calls substituted and constants folded; parts that stay as they are are
    shared with it.

    What only the run knows stays: v() i() time temper ddt() and the machine's calls. Raises ExprError.
    """
    return _fold(node, scope, {}, _Calls())


def _fold(node: Node, scope: Scope, bound: dict[str, Node], calls: _Calls) -> Node:
    if isinstance(node, Num):
        return node
    if isinstance(node, Name):
        if node.id in bound:
            value_or_place = bound[node.id]
            if isinstance(value_or_place, Name) and not _is_run_time(value_or_place):
                raise undefined(value_or_place, scope)
            return value_or_place
        if (open_ := scope.outside(node)) is not None:
            return open_
        value = scope.lookup(node.id)
        if value is None:
            if _is_run_time(node):
                return node
            value = CONSTANTS.get(node.id)
        if value is None:
            if (other := scope.unknown(node)) is not None:
                return other
            raise undefined(node, scope)
        return Num(value, node.at)
    if isinstance(node, Binary):
        a, b = _fold(node.a, scope, bound, calls), _fold(node.b, scope, bound, calls)
        whole = node if a is node.a and b is node.b else Binary(node.op, a, b, node.at)
        if isinstance(a, Num) and isinstance(b, Num):
            return _constant(_ARITHMETIC[node.op], [a.value, b.value], whole)
        return whole
    if isinstance(node, Unary):
        a = _fold(node.a, scope, bound, calls)
        if isinstance(a, Num):
            value = -a.value if node.op == "-" else a.value if node.op == "+" else float(not a.value)
            return Num(value, node.at)
        return a if node.op == "+" else Unary(node.op, a, node.at)
    if isinstance(node, Cond):
        c = _fold(node.c, scope, bound, calls)
        if isinstance(c, Num):
            return _fold(node.a if c.value else node.b, scope, bound, calls)
        return Cond(c, _fold(node.a, scope, bound, calls), _fold(node.b, scope, bound, calls), node.at)
    assert isinstance(node, Call)
    return _fold_call(node, scope, bound, calls)


def _fold_call(node: Call, scope: Scope, bound: dict[str, Node], calls: _Calls) -> Node:
    defined = scope.function(node.fn)
    if defined is not None:
        names, body = defined
        _check_count(node, len(names), len(names))
        args = [_fold_argument(a, scope, bound, calls) for a in node.args]
        calls.enter(node)
        folded = _fold(body, scope, dict(zip(names, args, strict=True)), calls)
        calls.depth -= 1
        return folded
    if node.fn == MEASURED:
        return node
    if node.fn in OF_COLUMNS and not all(isinstance(a, (Name, Num)) for a in node.args):
        return Call(node.fn, [_fold(a, scope, bound, calls) for a in node.args], node.at)
    probes = node.fn in PROBES or node.fn in OF_COLUMNS
    if probes or (node.fn not in MATH and scope.reads(node.fn)):
        args = [_fold_place(a, scope, bound, calls) for a in node.args]
        changed = any(a is not b for a, b in zip(args, node.args, strict=True))
        return scope.probe(Call(node.fn, args, node.at) if changed else node)
    if node.fn in AT_TERMINALS and len(node.args) == 1 and isinstance(node.args[0], Name):
        return _fold(Name(f"@{node.args[0].id}[{node.fn}]", node.at), scope, bound, calls)
    if not any(node.fn in known for known in (MATH, BRANCHES, OF_TIME, OF_TICKS, RANDOM)):
        raise unknown_function(node)  # before its arguments: they may be what a probe that was meant takes
    args = [_fold(a, scope, bound, calls) for a in node.args]
    if node.fn in BRANCHES:
        _check_count(node, 3, 3)
        if isinstance(args[0], Num):
            return args[1 if args[0].value else 2]
        return Cond(args[0], args[1], args[2], node.at)
    if (random := is_random(node.fn, len(args))) or node.fn in MATH:
        least, most = RANDOM[node.fn][:2] if random else (MATH[node.fn].least, MATH[node.fn].most)
        _check_count(node, least, most)
        function = scope.draws.of(node) if random else MATH[node.fn].source
        call = Call(node.fn, args, node.at)
        numbers = [a.value for a in args if isinstance(a, Num)]
        return _constant(function, numbers, call) if len(numbers) == len(args) else call
    return Call(node.fn, args, node.at)


def rewritten(node: Node, change: Callable[[Node], Node | None]) -> Node:
    """The expression with every part that `change` has something else for in its place; it is not asked about the new parts."""
    if (other := change(node)) is not None:
        return other
    if isinstance(node, Call):
        return Call(node.fn, [rewritten(a, change) for a in node.args], node.at)
    if isinstance(node, Unary):
        return Unary(node.op, rewritten(node.a, change), node.at)
    if isinstance(node, Binary):
        return Binary(node.op, rewritten(node.a, change), rewritten(node.b, change), node.at)
    if isinstance(node, Cond):
        c, a, b = (rewritten(part, change) for part in (node.c, node.a, node.b))
        return Cond(c, a, b, node.at)
    return node


def _is_run_time(node: Name) -> bool:
    return node.__class__ is Name and (
        node.id in RUN_TIME_NAMES
        or node.id in (TRANSFORM, OWN)
        or node.id[0] == "@"
        or node.id.startswith((OUTSIDE, SIGNAL))
    )


def _fold_argument(node: Node, scope: Scope, bound: dict[str, Node], calls: _Calls) -> Node:
    """An argument of a .func: a name that is no parameter may be a node, as in .func twice(n) {2*v(n)}."""
    if isinstance(node, Name) and node.id not in bound and node.id not in CONSTANTS:
        if (open_ := scope.outside(node)) is not None:
            return open_
        if scope.lookup(node.id) is None:
            return node
    elif isinstance(node, Name) and node.id in bound:
        return bound[node.id]
    return _fold(node, scope, bound, calls)


def _fold_place(node: Node, scope: Scope, bound: dict[str, Node], calls: _Calls) -> Node:
    """An argument of a probe: a name stays a name, the numbers of a point are folded."""
    if isinstance(node, Name):
        # in .func f(p) {v(p)+p} the node p stays one where p is a value, as in ngspice
        value = bound.get(node.id, node)
        return value if isinstance(value, (Name, Call)) else node
    if isinstance(node, Call):
        return Call(node.fn, [_fold(a, scope, bound, calls) for a in node.args], node.at)
    return _fold(node, scope, bound, calls)


def _constant(function: Callable[..., float], args: list[float], otherwise: Node) -> Node:
    """The folded constant; where it has no finite value, the expression stays for the run to judge."""
    try:
        value = applied(function, args)
    except (ValueError, OverflowError, ZeroDivisionError):
        return otherwise
    return Num(value, otherwise.at) if math.isfinite(value) else otherwise


def is_constant(node: Node) -> bool:
    """True when nothing in the expression reads the solution or the time."""
    if isinstance(node, Num):
        return True
    if isinstance(node, Name):
        return not _is_run_time(node)
    if isinstance(node, Binary):
        return is_constant(node.a) and is_constant(node.b)
    if isinstance(node, Unary):
        return is_constant(node.a)
    if isinstance(node, Cond):
        return is_constant(node.c) and is_constant(node.a) and is_constant(node.b)
    assert isinstance(node, Call)
    known_late = node.fn in PROBES or node.fn in OF_TIME or node.fn in OF_TICKS
    return not known_late and all(is_constant(a) for a in node.args)


def _short(node: Node) -> str:
    text = node.span.text if node.span else to_text(node)
    return text if len(text) <= 60 else text[:57] + "..."
