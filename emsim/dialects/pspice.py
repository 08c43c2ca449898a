"""PSpice, as the PSpice A/D Reference Guide has it: "Expressions", ".MODEL", ".TRAN", "Independent sources"."""

from __future__ import annotations

from .base import BREAKDOWN, Dialect, clamped, magnitude_power

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, ClassVar

    from ..diagnostics import Place
    from ..expr import Node
    from .base import Function

# types of RES, CAP, IND and the parameter that multiplies the value on the line
MULTIPLIERS = {"res": "r", "cap": "c", "ind": "l"}


class PSpice(Dialect):
    name = "pspice"
    differences: ClassVar[tuple[tuple[str, str], ...]] = (
        (".tran 0 5m", "a step of 0 is left to the program"),
        ("PWL(0 0 +1m 5)", "the time counts from the point before"),
        ("a ^ b", "either, not both; with brackets about both sides. The power is a ** b: |a|^b"),
        ("pwr(x,y), pwrs(x,y)", "|x|^y, sgn(x)|x|^y, in .param as in sources"),
        ("limit(x,a,b)", "between a and b"),
        ("temp in expressions", "the temperature, ngspice's `temper`"),
        (
            ".model r RES(R=2)",
            "R, C, L of a model multiply the value on the line, where ngspice takes them in its place",
        ),
        (".model d D(BV=5)", "IBV is 1e-10 A where it is not given"),
        (".model q PNP(..)", "the substrate lies at the collector; ngspice's at the base, PSpice's LPNP too"),
    )
    relative_times = True
    short_tran = True
    excludes = True
    sections = False
    names: ClassVar[dict[str, str]] = {"temp": "temper"}
    functions: ClassVar[dict[str, tuple[int, int, Function]]] = {
        "pwr": (2, 2, magnitude_power),
        "limit": (3, 3, clamped),
    }

    def operation(self, op: str, a: Node, b: Node, at: Place) -> Node:
        return magnitude_power([a, b], at) if op == "**" else super().operation(op, a, b, at)

    def model(self, kind: str, params: dict[str, Any]) -> str:
        factor = MULTIPLIERS.get(kind)
        if factor is not None and factor in params:
            params["scale"] = params.pop(factor)
        elif kind == "d" and "bv" in params:
            params.setdefault("ibv", BREAKDOWN)
        elif kind in ("pnp", "lpnp"):
            params.setdefault("subs", 1.0 if kind == "pnp" else -1.0)
        return kind
