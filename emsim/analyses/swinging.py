"""How a machine swings in its modes, for its drawing: the channels at x0 + Re(a v exp(i f)), v a mode's vector, f its phase.

The positions are those of the equations, not only their slopes: what turns keeps its shape. The amplitude is chosen by the eye.
"""

from __future__ import annotations

import cmath
import math
from array import array

from .base import Computed
from .modes import NOTHING

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import SmallSignal
    from ..assemble import Assembly


def swinging(assembly: Assembly, linear: SmallSignal, vectors: list[Any]) -> tuple[Any, Computed] | None:
    """(the number of the mode, with the part of it that has passed; the drawing's channels)."""
    drawing, system = assembly.drawn, assembly.system
    if drawing is None or not drawing.channels:
        return None
    exprs = [c.expr for c in drawing.channels if c.expr is not None]
    units = [c.unit for c in drawing.channels]

    def values(x: list[float]) -> list[float]:
        return system.values(exprs, x, 0.0)

    rest = linear.x
    still = values(rest)
    size = _size(drawing.data(), still)
    # as far as the largest turn and the largest travel go: 20 degrees, a tenth of the machine
    farthest = {"rad": 0.35, "m": 0.1 * size}
    # pictures of a swing, of which two pass while the page's clock goes from half before a mode's number to half behind
    count = 24
    axis, columns = array("d"), [array("d") for _ in exprs]
    for number, v in enumerate(vectors, 1):
        far = max(map(abs, v), default=0.0)
        if not far:
            continue
        # a small step says how far what is drawn goes for so much of the vector
        small = 1e-4 / far
        starts, quarters = (values(_at(rest, v, small, turns)) for turns in (0.0, 0.25))
        goes = max(
            (
                complex(start - then, then - quarter) / most
                for start, quarter, then, unit in zip(starts, quarters, still, units, strict=True)
                if (most := farthest.get(unit))
            ),
            key=abs,
            default=0j,
        )
        # what goes farthest stands at its largest where the clock is at the mode's number
        amplitude = small / goes if abs(goes) > NOTHING else 0j
        swing = [values(_at(rest, v, amplitude, k / count)) for k in range(count)]
        for k in range(2 * count):
            axis.append(number - 0.5 + k / (2 * count))
            for column, value in zip(columns, swing[k % count], strict=True):
                column.append(value)
    return (axis, Computed(columns)) if axis else None


def _at(rest: list[float], v: Any, amplitude: complex, turns: float) -> list[float]:
    """The unknowns at a phase, largest at 0."""
    phase = amplitude * cmath.exp(2j * math.pi * turns)
    return [x + (phase * complex(e)).real for x, e in zip(rest, v, strict=True)]


def _size(data: dict[str, Any], still: list[float]) -> float:
    """Of the machine at rest [m]: the farthest of its bodies and of the places on them."""
    values = [
        abs(still[int(ref[1:])]) if isinstance(ref, str) else abs(ref)
        for body in data["bodies"]
        for ref in body["at"][:2]
    ]
    for s in data["shapes"]:
        places = [s[key] for key in ("at", "a", "b", "p", "q_") if isinstance(s.get(key), list)] + s.get(
            "to", []
        )
        values += [abs(c) for place in places for c in place[1:4]] + [
            s.get("spin") or 0.0,
            *s.get("sizes", []),
        ]
    return max(values, default=0.0) or 0.1
