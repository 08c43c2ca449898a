"""TRANSDUCER: plates or turns above its joint, thick with the voltage; the arrow of its force."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import effort

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .contract import Pen, Scene, Shape


def transducer(m: Scene, pen: Pen, s: Shape) -> None:
    at, u = m.place(s["b"]), pen.unit
    x, y, width = at[0], at[1], 2 + 3 * abs(m.share(s["volts"]))
    if s["form"] == "c":
        for side in [-4 * u, 4 * u]:
            pen.line([[x + side, y - 22 * u], [x + side, y - 8 * u]], "coil", width)
    else:
        for k in [-8, 0, 8]:
            pen.arc([x + k * u, y - 14 * u], 4 * u, math.pi, 2 * math.pi, "coil", width)
    effort(m, pen, s, [x, y - 14 * u], 20, "coil")
    pen.label(at, 12, -20, f"{s['name']} {written(m.value(s['volts']), s.get('of', 'V'), 3)}", "coil")
