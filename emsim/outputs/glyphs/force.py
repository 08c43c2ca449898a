"""FORCE: an arrow that ends where it acts, as long as its share of the largest."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import arrow

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def force(m: Scene, pen: Pen, s: Shape) -> None:
    vector = [m.value(ref) for ref in s["vector"]]
    size, largest = math.hypot(*vector), math.hypot(*[m.top(ref) for ref in s["vector"]])
    if not m.arrows or not size > 1e-6 * largest:
        return
    at, far = m.place(s["at"]), 60 * pen.unit / largest
    dx, dy = m.flat(vector)
    tail = [at[0] - far * dx, at[1] + far * dy]
    arrow(pen, tail, at, "force", 2.5, 9)
    pen.label(tail, 6, -6, f"{s['name']} {written(size, 'N', 3)}", "force")
