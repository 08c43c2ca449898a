"""What measures of a deck are to be: `rise=1m`, `vmax<1.2`, `gain>=10`."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..units import spice_number

OPERATORS = ("<=", ">=", "<", ">", "=")
MET = 1e-6  # of its bound: a goal that is missed by less is met


class Goal(NamedTuple):
    measure: str
    operator: str  # "=", "<" or ">"
    bound: float

    def __str__(self) -> str:
        return f"{self.measure}{self.operator}{self.bound:.6g}"

    @property
    def size(self) -> float:
        return abs(self.bound) or 1.0

    def missed(self, value: float) -> float:
        """By how much, in parts of the bound: 0 where it is met, with a sign where it is an equation."""
        off = (value - self.bound) / self.size
        return off if self.operator == "=" else max(off, 0.0) if self.operator == "<" else min(off, 0.0)

    def met(self, value: float) -> bool:
        return math.isfinite(value) and abs(self.missed(value)) <= (1e-3 if self.operator == "=" else MET)


def read(text: str) -> Goal:
    """Raises ValueError with a sentence."""
    whole = "".join(text.split()).lower()
    operator = next((op for op in OPERATORS if op in whole), "")
    measure, _, given = whole.partition(operator) if operator else ("", "", "")
    bound = spice_number(given)
    if not measure or bound is None:
        raise ValueError(
            f"{text}: a goal is measure=number, measure<number or measure>number, as in vmax<1.2"
        )
    return Goal(measure, operator[0], float(bound))
