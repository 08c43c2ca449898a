"""What may differ between dialects of SPICE. The base reads as ngspice does.

A dialect says the meaning of words and signs while trees become cards; what stands in the cards afterwards means the same for
all, so nothing behind build_*.py knows of it.
"""

from __future__ import annotations

from ..expr import Binary, Call, Cond, Node, Num, Unary

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, ClassVar

    from ..diagnostics import Place

    Function = Callable[[list[Node], Place], Node]

# operators and functions whose value is true or false
TRUTHS = frozenset(("<", "<=", ">", ">=", "==", "!=", "&&", "||"))
TESTS = frozenset(("eq0", "ne0", "gt0", "lt0", "ge0", "le0"))

BREAKDOWN = 1e-10  # ibv of a diode that states none [A]


class Dialect:
    name: ClassVar[str]
    # (what is written, what it means here), for the page and for `emsim help`
    differences: ClassVar[tuple[tuple[str, str], ...]] = ()
    relative_times: ClassVar[bool] = False  # PWL(0 0 +1m 5): counted from the point before
    short_tran: ClassVar[bool] = (
        False  # .tran 5m is the stop time alone, and a step of 0 is left to the program
    )
    letter_as_dot: ClassVar[bool] = False  # 4k7 is 4.7k
    excludes: ClassVar[bool] = False  # a ^ b: either, not both
    coil_resistance: ClassVar[float] = (
        0.0  # in series with a coil that states no Rser= and stands in no K [Ohm]
    )
    sections: ClassVar[bool] = True  # .lib file section
    own_quantity: ClassVar[bool] = False  # C1 a b Q=1n*x: x is its own voltage
    names: ClassVar[dict[str, str]] = {}  # of quantities in expressions
    functions: ClassVar[dict[str, tuple[int, int, Function]]] = {}  # least and most arguments, meaning

    def truth(self, value: Node) -> Node:
        """A value where a condition stands."""
        return value

    def operation(self, op: str, a: Node, b: Node, at: Place) -> Node:
        if op in ("&&", "||"):
            a, b = self.truth(a), self.truth(b)
        return Binary(op, a, b, at)

    def either(self, a: Node, b: Node, at: Place) -> Node:
        """One of both, where `excludes`."""
        a, b = whether(self.truth(a)), whether(self.truth(b))
        return Cond(a, Unary("!", b, at), b, at)

    def call(self, function: str, args: list[Node], at: Place) -> Node:
        if function in ("if", "ternary_fcn") and len(args) == 3:
            args = [self.truth(args[0]), *args[1:]]
        least, most, meaning = self.functions.get(function, (1, 0, None))
        if meaning is not None and least <= len(args) <= most:
            return meaning(args, at)
        return Call(function, args, at)

    def model(self, kind: str, params: dict[str, Any]) -> str:
        """The type of a .model; `params` as its card states them, changed to what they mean."""
        return kind


def is_truth(value: Node) -> bool:
    return (
        (isinstance(value, Binary) and value.op in TRUTHS)
        or (isinstance(value, Unary) and value.op == "!")
        or (isinstance(value, Call) and value.fn in TESTS)
    )


def whether(value: Node) -> Node:
    """1 where the value is not 0."""
    return value if is_truth(value) else Binary("!=", value, Num(0.0), value.at)


def clamped(args: list[Node], at: Place) -> Node:
    """limit(x, a, b): between a and b, whichever is the larger."""
    x, a, b = args
    low, high = Call("min", [a, b], at), Call("max", [a, b], at)
    return Call("min", [Call("max", [x, low], at), high], at)


def magnitude_power(args: list[Node], at: Place) -> Node:
    """|x|^y"""
    x, y = args
    is_even = isinstance(y, Num) and y.value % 2 == 0
    return Binary("**", x if is_even else Call("abs", [x], at), y, at)
