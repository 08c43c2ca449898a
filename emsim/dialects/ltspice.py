"""LTspice, as its help has it: "B. Arbitrary behavioral sources", ".PARAM", "L. Inductor", "S. Voltage controlled switch",
"V. Voltage source", "D. Diode"."""

from __future__ import annotations

from ..expr import Binary, Call, Cond, Node, Num, Unary
from .base import BREAKDOWN, Dialect, clamped, is_truth, magnitude_power

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from ..diagnostics import Place
    from .base import Function

TRUE = 0.5  # a value above it is true


def _node(value: Any) -> Node:
    return value if isinstance(value, Node) else Num(float(value))


def real_power(args: list[Node], at: Place) -> Node:
    """The real part of x^y: |x|^y, for x < 0 cos(pi y) |x|^y."""
    x, y = args
    if isinstance(y, Num) and y.value == round(y.value):
        return magnitude_power(args, at) if y.value % 2 == 0 else Call("pwrs", [x, y], at)
    size = magnitude_power(args, at)
    turned = Call("cos", [Binary("*", Num(3.141592653589793), y, at)], at)
    return Cond(Binary("<", x, Num(0.0), at), Binary("*", turned, size, at), size, at)


def _cut(args: list[Node], at: Place) -> Node:
    """x, not below -1 nor above 1."""
    return clamped([args[0], Num(-1.0), Num(1.0)], at)


def _uplim(args: list[Node], at: Place) -> Node:
    """uplim(x, y, z): x, not above y. Between y - z and y + z a parabola, min(x, y - z) + z (1 - (1 - s)^2) with
    s = (x - y + z)/(2 z) within 0 and 1."""
    x, y, z = args
    low = Binary("-", y, z, at)
    above = Binary("/", Binary("-", x, low, at), Binary("*", Num(2.0), z, at), at)
    left = Binary("-", Num(1.0), clamped([above, Num(0.0), Num(1.0)], at), at)
    bend = Binary("*", z, Binary("-", Num(1.0), Binary("*", left, left, at), at), at)
    return Binary("+", Call("min", [x, low], at), bend, at)


def _dnlim(args: list[Node], at: Place) -> Node:
    """dnlim(x, y, z): x, not below y, in the same way."""
    x, y, z = args
    return Unary("-", _uplim([Unary("-", x, at), Unary("-", y, at), z], at), at)


def _is_true(args: list[Node], at: Place) -> Node:
    return Binary(">", args[0], Num(TRUE), at)


FUNCTIONS: dict[str, tuple[int, int, Function]] = {
    "pow": (2, 2, real_power),
    "pwr": (2, 2, magnitude_power),
    "limit": (3, 3, clamped),
    "uplim": (3, 3, _uplim),
    "dnlim": (3, 3, _dnlim),
    "buf": (1, 1, _is_true),
    "inv": (1, 1, lambda args, at: Binary("<=", args[0], Num(TRUE), at)),
    "square": (1, 1, lambda args, at: Binary("*", args[0], args[0], at)),
    "cbrt": (1, 1, lambda args, at: Call("pwrs", [args[0], Num(1.0 / 3.0)], at)),
    "sqrt": (1, 1, lambda args, at: Call("sqrt", [Call("max", [args[0], Num(0.0)], at)], at)),
    "asin": (1, 1, lambda args, at: Call("asin", [_cut(args, at)], at)),
    "acos": (1, 1, lambda args, at: Call("acos", [_cut(args, at)], at)),
    "arcsin": (1, 1, lambda args, at: Call("asin", [_cut(args, at)], at)),
    "arccos": (1, 1, lambda args, at: Call("acos", [_cut(args, at)], at)),
}


class LTspice(Dialect):
    name = "ltspice"
    differences: ClassVar[tuple[tuple[str, str], ...]] = (
        (".tran 5m", "the stop time alone; a step of 0 is one too"),
        (".tran .. startup", "sources rise from 0 at rest within 20 us; in every dialect"),
        ("R1 a b 4k7", "4.7k"),
        ("PWL(0 0 +1m 5)", "the time counts from the point before"),
        (
            "a ^ b",
            "either, not both; with brackets about both sides. The power is a ** b, pow(a,b): its real part",
        ),
        ("pwr(x,y), pwrs(x,y)", "|x|^y, sgn(x)|x|^y, in .param as in sources"),
        ("if(x,y,z), !x, a & b, a | b", "a value above 0.5 is true"),
        ("L1 a b 1m", "with 1 mOhm in series, where the line has no Rser= and no K names the coil"),
        ("C1 a b Q=1n*x+2n*x**3", "x is its own voltage; in L1 a b flux= x is the current, in every dialect"),
        (".model s SW(vh=-0.1 ..)", "smooth between vt - |vh| and vt + |vh|, without memory"),
        ("temp in expressions", "the temperature, ngspice's `temper`"),
        ("buf inv square cbrt arcsin arccos", "LTspice's functions; sqrt, asin, acos give the real part"),
        ("limit(x,a,b)", "between a and b"),
        ("uplim(x,y,z), dnlim(x,y,z)", "not above, not below y; a parabola from y - z to y + z"),
        (".model d D(bv=5)", "ibv is 1e-10 A where it is not given"),
    )
    relative_times = True
    letter_as_dot = True
    short_tran = True
    excludes = True
    sections = False
    own_quantity = True
    coil_resistance = 1e-3
    names: ClassVar[dict[str, str]] = {"temp": "temper"}
    functions: ClassVar[dict[str, tuple[int, int, Function]]] = FUNCTIONS

    def truth(self, value: Node) -> Node:
        return value if is_truth(value) else Binary(">", value, Num(TRUE), value.at)

    def operation(self, op: str, a: Node, b: Node, at: Place) -> Node:
        return real_power([a, b], at) if op == "**" else super().operation(op, a, b, at)

    def model(self, kind: str, params: dict[str, Any]) -> str:
        half = params.get("vh")
        if kind == "sw" and isinstance(half, float) and half < 0.0:
            middle = params.pop("vt", 0.0)
            del params["vh"]
            on, off = (Binary(op, _node(middle), Num(-half)) for op in "+-")
            params["von"], params["voff"] = on, off
            params.setdefault("roff", 1e12)  # PSpice's law has 1e6
            return "vswitch"
        if kind == "d" and "bv" in params:
            params.setdefault("ibv", BREAKDOWN)
        return kind
