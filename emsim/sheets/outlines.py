"""Lines of symbols as strokes, in the coordinates of the sheet: ["line", points], ["ring", x, y, r], ["dot", x, y, r]."""

from __future__ import annotations

from math import atan2, cos, hypot, pi, sin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    Spot = tuple[float, float]


def ellipse(a: Spot, b: Spot) -> list[Any]:
    """Within a box."""
    (x0, y0), (x1, y1) = a, b
    x, y, rx, ry = (x0 + x1) / 2, (y0 + y1) / 2, abs(x1 - x0) / 2, abs(y1 - y0) / 2
    if abs(rx - ry) < 1e-9:
        return ["ring", x, y, rx]
    return ["line", [(x + rx * cos(k * pi / 16), y + ry * sin(k * pi / 16)) for k in range(33)]]


def box(a: Spot, b: Spot) -> list[Any]:
    (x0, y0), (x1, y1) = a, b
    return ["line", [(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]]


def arc(centre: Spot, radii: Spot, start: float, sweep: float) -> list[Any]:
    """From an angle [rad], counted from x towards y, over `sweep`."""
    n = max(2, round(abs(sweep) * 16 / pi))
    turns = (start + sweep * k / n for k in range(n + 1))
    return ["line", [(centre[0] + radii[0] * cos(t), centre[1] + radii[1] * sin(t)) for t in turns]]


def arc_in_box(a: Spot, b: Spot, start: Spot, end: Spot) -> list[Any]:
    """On the ellipse within a box, from the direction of one point to that of another, against the clock as seen."""
    (x0, y0), (x1, y1) = a, b
    x, y, rx, ry = (x0 + x1) / 2, (y0 + y1) / 2, abs(x1 - x0) / 2 or 1, abs(y1 - y0) / 2 or 1
    t0, t1 = (atan2((p[1] - y) / ry, (p[0] - x) / rx) for p in (start, end))
    return arc((x, y), (rx, ry), t0, -((t0 - t1) % (2 * pi) or 2 * pi))


def arc_through(a: Spot, middle: Spot, b: Spot) -> list[Any]:
    """The arc from a to b on which `middle` lies; a line where the three do."""
    (ax, ay), (mx, my), (bx, by) = a, middle, b
    d = 2 * (ax * (my - by) + mx * (by - ay) + bx * (ay - my))
    if abs(d) < 1e-9:
        return ["line", [a, middle, b]]
    sa, sm, sb = ax * ax + ay * ay, mx * mx + my * my, bx * bx + by * by
    x = (sa * (my - by) + sm * (by - ay) + sb * (ay - my)) / d
    y = (sa * (bx - mx) + sm * (ax - bx) + sb * (mx - ax)) / d
    t0, tm, t1 = (atan2(py - y, px - x) for px, py in (a, middle, b))
    sweep = (t1 - t0) % (2 * pi)
    if (tm - t0) % (2 * pi) > sweep:
        sweep -= 2 * pi
    r = hypot(ax - x, ay - y)
    return arc((x, y), (r, r), t0, sweep)
