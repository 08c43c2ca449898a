"""What stands beside a machine: a scale, the direction of gravity, those of x, y and z; where names may stand."""

from __future__ import annotations

import math

from ..numbers import written
from .marks import arrow, middle

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable

    from .contract import Pen, Scene

Label = list  # [x, y, text, colour]
MANY = 24  # names of bodies: more would be a heap, and none is written
FAR = [26, -26, 39, 52]  # px that the name of what acts may be off; that of a body tells nothing there


def paper(m: Scene, pen: Pen) -> None:
    u = pen.unit
    if m.follow:
        standing(m, pen)
    metres = 90 * u / m.scale
    ten = 10.0 ** math.floor(math.log10(metres))
    step = 5 * ten if 5 * ten <= metres else 2 * ten if 2 * ten <= metres else ten
    x, y = 12 * u, m.height - 12 * u
    end = x + step * m.scale
    pen.line([[x, y], [end, y]], "ground", 1.5)
    for at in [x, end]:
        pen.line([[at, y - 4 * u], [at, y + 4 * u]], "ground", 1.5)
    pen.write(x + 4 * u, y - 4 * u, written(step, "m", 3), "ground", "ls")
    pull = m.flat(m.gravity)
    size = math.hypot(*pull)
    right, top = m.width - 18 * u, 12 * u
    if size > 0:
        dx, dy = 22 * u * pull[0] / size, -22 * u * pull[1] / size
        start = [right + min(0.0, -dx), top + max(0.0, -dy)]
        arrow(pen, start, [start[0] + dx, start[1] + dy], "ground", 1.5, 6)
        pen.write(start[0] - 12 * u, top + 18 * u, "g", "ground", "ls")
    if not m.planar:
        origin = [m.width - 46 * u, m.height - 40 * u]
        for k in range(3):
            dx, dy = m.flat([1.0 if k == i else 0.0 for i in range(3)])
            tip = [origin[0] + 24 * u * dx, origin[1] - 24 * u * dy]
            pen.line([origin, tip], "ground", 1.2)
            pen.write(tip[0] + 6 * u * dx, tip[1] - 6 * u * dy, ["x", "y", "z"][k], "ground", "mm")


def standing(m: Scene, pen: Pen) -> None:
    """Lines that stand still behind a camera that moves."""
    ten = 10.0 ** math.floor(math.log10(80 / m.scale))
    step = 10 * ten
    for k in [5, 2]:
        if k * ten * m.scale >= 40:
            step = k * ten
    x, y = m.middle
    w, h = m.width / m.scale / 2, m.height / m.scale / 2
    for k in range(math.ceil((x - w) / step), math.floor((x + w) / step) + 1):
        px = m.width / 2 + (k * step - x) * m.scale
        pen.line([[px, 0], [px, m.height]], "ground", 0.6, 0.0, 0.35)
    for k in range(math.ceil((y - h) / step), math.floor((y + h) / step) + 1):
        py = m.height / 2 - (k * step - y) * m.scale
        pen.line([[0, py], [m.width, py]], "ground", 0.6, 0.0, 0.35)


def called(m: Scene, pen: Pen) -> None:
    """Names of what is drawn as a solid."""
    for s in m.shapes:
        if s["kind"] in [
            "rod",
            "box",
            "disc",
            "polygon",
            "bones",
            "ball",
            "wheel",
            "toothed",
            "wagon",
            "mesh",
        ]:
            at = m.place(s["at"])
            if s["kind"] == "rod":
                end = m.place([s["at"][0], s["at"][1] + s["sizes"][0], s["at"][2], s["at"][3]])
                at = middle(at, end)
            pen.label(at, 12, -12, s["name"], "soft")
        elif s["kind"] == "spring" and "p" in s:
            pen.label(middle(m.place(s["p"]), m.place(s["q_"])), 10, 0, s["name"], "coil")


def named(
    labels: list[Label], taken: list[list[float]], size: list[float], u: float, wide: Callable[[str], float]
) -> list[Label]:
    """Labels where there is room: what acts first, then the names of bodies, of which those without room are left out. `taken`:
    boxes [left, top, right, bottom] that they keep off; `wide` measures a text [px]."""
    found = []
    bodies = [one for one in labels if one[3] == "soft"]
    for turn in [False] if len(bodies) > MANY else [False, True]:
        for x0, y0, text, colour in labels:
            if (colour == "soft") == turn:
                at = room(x0, y0, wide(text), turn, taken, size, u)
                if at is not None:
                    taken.append(boxed(at[0], at[1], wide(text), u))
                    found.append([at[0], at[1], text, colour])
    return found


def boxed(x: float, y: float, wide: float, u: float) -> list[float]:
    return [x - u, y - 11 * u, x + wide + u, y + 2 * u]


def room(
    x0: float, y0: float, wide: float, soft: bool, taken: list[list[float]], size: list[float], u: float
) -> list[float] | None:
    places = []
    for dy in [0, 13, -13, *([] if soft else FAR)]:
        for x in [x0, x0 - wide - 22 * u, x0 + 24 * u]:
            places.append([max(4.0, min(x, size[0] - wide - 4)), y0 + dy * u])
    for x, y in places:
        mine = boxed(x, y, wide, u)
        if 11 * u < y and y < size[1] - 2 * u and apart(mine, taken):
            return [x, y]
    return None if soft else places[0]


def apart(mine: list[float], taken: list[list[float]]) -> bool:
    return all(b[2] <= mine[0] or mine[2] <= b[0] or b[3] <= mine[1] or mine[3] <= b[1] for b in taken)
