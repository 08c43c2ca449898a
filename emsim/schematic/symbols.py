"""What parts look like: strokes in grid units about a part's first pin, y downwards, as they stand upright.

A symbol is its pins (place and the direction in which a wire leaves), the box that all else keeps out of, and strokes:

    ("line", [points])  ("fill", [points])  ("dot", point, radius)  ("ring", point, radius)  ("text", point, words)

Everything is straight or a circle, so that a page, a film and a file draw the same with the same few rules. `iec` and `ansi`
differ in resistors, diodes and independent sources (IEC 60617, IEEE 315).
"""

from __future__ import annotations

from math import ceil, cos, pi, sin

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    Point = tuple[float, float]
    Stroke = tuple[Any, ...]

UP, DOWN, LEFT, RIGHT = (0, -1), (0, 1), (-1, 0), (1, 0)
UNIT = 10  # pixels of a grid unit
LONG = 6  # from pin to pin of what has two
COIL = 9  # from a coil to the next one on the same side of a core
LETTER = 0.66  # width of a letter of writing [grid units]


class Symbol:
    """`box` is [x0, y0, x1, y1] in whole grid units."""

    __slots__ = ("box", "pins", "strokes")

    def __init__(
        self, pins: list[tuple[Point, Point]], box: tuple[int, int, int, int], strokes: list[Stroke]
    ) -> None:
        self.pins, self.box, self.strokes = pins, box, strokes


def line(*points: Point) -> Stroke:
    return ("line", list(points))


def fill(*points: Point) -> Stroke:
    return ("fill", list(points))


def arc(x: float, y: float, r: float, start: float, end: float, n: int = 10) -> Stroke:
    """From angle to angle in parts of a turn, counted from x towards y."""
    turns = (2 * pi * (start + (end - start) * k / n) for k in range(n + 1))
    return ("line", [(round(x + r * cos(t), 3), round(y + r * sin(t), 3)) for t in turns])


def arrow(a: Point, b: Point, size: float = 0.7) -> list[Stroke]:
    """A line with a head at its end."""
    (x0, y0), (x1, y1) = a, b
    far = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
    u, v = (x1 - x0) / far * size, (y1 - y0) / far * size
    return [
        line(a, b),
        fill(b, (x1 - u - 0.42 * v, y1 - v + 0.42 * u), (x1 - u + 0.42 * v, y1 - v - 0.42 * u)),
    ]


def upright(strokes: list[Stroke], top: float, bottom: float, half: int = 1) -> Symbol:
    """A part with a pin above and one below; its body reaches from `top` to `bottom`."""
    leads = [line((0, 0), (0, top)), line((0, bottom), (0, LONG))]
    return Symbol([((0, 0), UP), ((0, LONG), DOWN)], (-half, 1, half, LONG - 1), [*leads, *strokes])


# ---- two pins ----


def resistor(look: str) -> Symbol:
    if look == "iec":
        box = line((-0.6, 1.4), (0.6, 1.4), (0.6, 4.6), (-0.6, 4.6), (-0.6, 1.4))
        return upright([box], 1.4, 4.6)
    zigzag = [
        (0, 1.4),
        *(((0.6 if k % 2 == 0 else -0.6), 1.4 + 3.2 * (k + 0.5) / 6) for k in range(6)),
        (0, 4.6),
    ]
    return upright([("line", zigzag)], 1.4, 4.6)


def capacitor(look: str) -> Symbol:
    plates = [line((-1.1, 2.7), (1.1, 2.7)), line((-1.1, 3.3), (1.1, 3.3))]
    return upright(plates, 2.7, 3.3)


def coil(x: float, top: float, side: float, turns: int = 4, size: float = 0.425) -> Stroke:
    points: list[Point] = []
    for k in range(turns):
        y = top + size * (2 * k + 1)
        points += [
            (
                round(x + side * 1.15 * size * cos(pi * (j / 8 - 0.5)), 3),
                round(y + size * sin(pi * (j / 8 - 0.5)), 3),
            )
            for j in range(9)
        ]
    return ("line", points)


def inductor(look: str) -> Symbol:
    return upright([coil(0, 1.3, 1)], 1.3, 4.7)


def source(look: str, inside: list[Stroke]) -> Symbol:
    return upright([("ring", (0, 3), 1.6), *inside], 1.4, 4.6, 2)


PLUS = [line((-0.4, 2.15), (0.4, 2.15)), line((0, 1.75), (0, 2.55))]
MINUS = [line((-0.4, 3.95), (0.4, 3.95))]
SINE: Stroke = (
    "line",
    [(round(-0.9 + 0.09 * k, 3), round(3 - 0.6 * sin(pi * k / 10), 3)) for k in range(21)],
)
PULSE = line((-0.95, 3.5), (-0.5, 3.5), (-0.5, 2.5), (0.3, 2.5), (0.3, 3.5), (0.95, 3.5))
# straight lines between points
LINES = line((-0.95, 3.4), (-0.45, 3.4), (0.15, 2.5), (0.55, 2.9), (0.95, 2.9))
SIGNS = {"sin": SINE, "pulse": PULSE, "pwl": LINES}


def voltage(look: str, wave: str = "") -> Symbol:
    if look == "iec":
        # the bar of the ideal source lies in the wire; plus outside of the ring
        mark = [line((0, 1.4), (0, 4.6)), line((-1.75, 0.9), (-0.95, 0.9)), line((-1.35, 0.5), (-1.35, 1.3))]
        return source(look, mark)
    if wave:
        outside = [line((-1.75, 0.9), (-0.95, 0.9)), line((-1.35, 0.5), (-1.35, 1.3))]
        return source(look, [SIGNS[wave], *outside])
    return source(look, [*PLUS, *MINUS])


def current(look: str, wave: str = "") -> Symbol:
    if look == "iec":
        return source(look, [line((-1.6, 3), (1.6, 3)), *arrow((0, 4.9), (0, 5.9), 0.8)])
    return source(look, arrow((0, 1.9), (0, 4.2), 0.9))


def diamond(look: str, gives: str) -> Symbol:
    edge = line((0, 1.1), (1.7, 3), (0, 4.9), (-1.7, 3), (0, 1.1))
    inside = [*PLUS, *MINUS] if gives == "v" else arrow((0, 1.9), (0, 4.3), 0.9)
    return upright([edge, *inside], 1.1, 4.9, 2)


def diode(look: str, kind: str = "") -> Symbol:
    body = [("line", [(-0.9, 2.2), (0.9, 2.2), (0, 3.8), (-0.9, 2.2)])]
    if look == "ansi":
        body = [fill((-0.9, 2.2), (0.9, 2.2), (0, 3.8))]
    bar = line((-0.9, 3.8), (0.9, 3.8))
    if kind == "zener":
        bar = line((-0.9, 4.2), (-0.9, 3.8), (0.9, 3.8), (0.9, 3.4))
    return upright([*body, bar], 2.2, 3.8)


def switch(look: str) -> Symbol:
    ends: list[Stroke] = [("ring", (0, 1.9), 0.22), ("ring", (0, 4.1), 0.22)]
    return upright([*ends, line((0.0, 4.1 - 0.22), (-1.05, 2.0))], 1.68, 4.32)


def motor(look: str) -> Symbol:
    brushes = [
        fill((-0.45, 1.0), (0.45, 1.0), (0.45, 1.4), (-0.45, 1.4)),
        fill((-0.45, 4.6), (0.45, 4.6), (0.45, 5.0), (-0.45, 5.0)),
    ]
    return upright([("ring", (0, 3), 1.6), ("text", (0, 3), "M"), *brushes], 1.0, 5.0, 2)


def transducer(look: str, form: str) -> Symbol:
    if form == "c":
        body = capacitor(look)
    elif form == "l":
        body = inductor(look)
    else:
        ring: list[Stroke] = [("ring", (0, 3), 1.6), ("text", (0, 3), "B" if form == "k" else "W")]
        return upright(ring, 1.4, 4.6, 2)
    return Symbol(body.pins, (-2, 1, 2, 5), [*body.strokes, *arrow((-1.5, 4.6), (1.5, 1.4))])


# ---- three and four pins ----


def transistor(look: str, pnp: bool, substrate: bool) -> Symbol:
    """Collector, base, emitter (and substrate): the pin that the current enters by is above."""
    up, down = [line((2, -0.6), (3, -1.5), (3, -3))], [line((3, 1.5), (3, 3))]
    if pnp:
        up = [line((3, -3), (3, -1.5)), *arrow((3, -1.5), (2.1, -0.7))]
        down = [line((2, 0.6), (3, 1.5), (3, 3))]
    else:
        down += arrow((2, 0.6), (2.95, 1.45))
    body: list[Stroke] = [
        line((0, 0), (2, 0)),
        line((2, -1.2), (2, 1.2)),
        *up,
        *down,
        ("ring", (2.5, 0), 1.9),
    ]
    above, below = ((3, -3), UP), ((3, 3), DOWN)
    pins: list[tuple[Point, Point]] = [below if pnp else above, ((0, 0), LEFT), above if pnp else below]
    if substrate:
        pins.append(((5, 0), RIGHT))
        body.append(line((2, 0), (5, 0)))
    return Symbol(pins, (1, -2, 4, 2), body)


def mosfet(look: str, p: bool, bulk: str, depletion: bool = False) -> Symbol:
    """Drain, gate, source (and bulk); of a p-channel the source is above. `bulk`: "source", where it is tied, "pin", or "" where
    it is told elsewhere, and the source has the arrow."""
    body = [line((0, 0), (1.5, 0)), line((1.5, -1.1), (1.5, 1.1))]
    if depletion:
        body.append(line((2, -1.5), (2, 1.5)))
    else:
        body += [line((2, -1.6), (2, -0.75)), line((2, -0.4), (2, 0.4)), line((2, 0.75), (2, 1.6))]
    body += [line((2, -1.2), (3, -1.2), (3, -3)), line((2, 1.2), (3, 1.2), (3, 3))]
    above, below = ((3, -3), UP), ((3, 3), DOWN)
    pins: list[tuple[Point, Point]] = [below if p else above, ((0, 0), LEFT), above if p else below]
    if not bulk:
        body += arrow((3, -1.2), (2.1, -1.2)) if p else arrow((2.1, 1.2), (3, 1.2))
        return Symbol(pins, (1, -2, 4, 2), body)
    # the arrow of the bulk: towards an n-channel
    body += arrow((2.1, 0), (3, 0)) if p else arrow((3, 0), (2.1, 0))
    if bulk == "pin":
        body.append(line((3, 0), (5, 0)))
        pins.append(((5, 0), RIGHT))
    else:
        body.append(line((3, 0), (3, -1.2 if p else 1.2)))
    return Symbol(pins, (1, -2, 4, 2), body)


def jfet(look: str, p: bool) -> Symbol:
    body = [line((2, -1.5), (2, 1.5)), line((2, -1.1), (3, -1.1), (3, -3)), line((2, 1.1), (3, 1.1), (3, 3))]
    body += [
        line((0, 0), (2, 0)),
        *(arrow((1.9, 0), (1.0, 0)) if p else arrow((0.9, 0), (1.9, 0))),
        ("ring", (2.5, 0), 1.9),
    ]
    above, below = ((3, -3), UP), ((3, 3), DOWN)
    return Symbol([below if p else above, ((0, 0), LEFT), above if p else below], (1, -2, 4, 2), body)


def pot(look: str) -> Symbol:
    """Top, wiper, bottom."""
    body = resistor(look)
    pins = [body.pins[0], ((3, 3), RIGHT), body.pins[1]]
    return Symbol(pins, (-1, 1, 2, 5), [*body.strokes, *arrow((3, 3), (0.65, 3))])


def transformer(look: str, over: Sequence[bool] = (False, False), left: int = 1) -> Symbol:
    """Coils on one core, the first `left` of them on its left side, a dot at the first pin of each; `over`: those that stand on
    their heads. Two are drawn with their pins above and below, more with theirs to the side."""
    sides = ((0, -1, over[:left]), (5, 1, over[left:]))
    tall = COIL * max(len(column) for _, _, column in sides) - (COIL - LONG)
    strokes: list[Stroke] = [line((x, 1.3), (x, tall - 1.3)) for x in (2.2, 2.8)]
    pins: list[tuple[Point, Point]] = []
    for x, out, column in sides:
        first = (tall - COIL * len(column) + COIL - LONG) // 2
        for k, turned in enumerate(column):
            y = first + COIL * k
            top, bottom = (x, y), (x, y + LONG)
            ends: list[tuple[Point, Point]] = [(top, UP), (bottom, DOWN)]
            strokes += [line(top, (x, y + 1.3)), coil(x, y + 1.3, -out), line((x, y + 4.7), bottom)]
            if len(over) > 2:
                ends = [((x + 2 * out, py), (out, 0)) for _, py in (top, bottom)]
                strokes += [line(at, (x, at[1])) for at, _ in ends]
            pins += ends[::-1] if turned else ends
            strokes.append(("dot", (x + 0.6 * out, y + (4.8 if turned else 1.2)), 0.2))
    return Symbol(pins, (-1, 1, 6, 5) if len(over) == 2 else (-1, 0, 6, tall), strokes)


def box(
    left: list[str], right: list[str], width: int, above: tuple[str, ...] = (), below: tuple[str, ...] = ()
) -> Symbol:
    """A box at least so wide with its terminals' names inside; pins of the left side first, then right, above, below."""
    rows = max(len(left), len(right), 1)
    more = (1 if above else 0) + (1 if below else 0)
    pitch = max(4, *(ceil(LETTER * len(name)) + 1 for name in (*above, *below, "")))
    abreast = sum(ceil(LETTER * max(map(len, names), default=0)) for names in (left, right))
    width = max(width, abreast + 2, pitch * len(above), pitch * len(below))
    tall = 2 * rows + 2 + more
    pins: list[tuple[Point, Point]] = []
    strokes: list[Stroke] = [line((1, 0), (1 + width, 0), (1 + width, tall), (1, tall), (1, 0))]
    for names, x, inner, out, anchor in (
        (left, 0, 1, LEFT, "start"),
        (right, width + 2, width + 1, RIGHT, "end"),
    ):
        first = 2 + (rows - len(names)) + (1 if above else 0)
        for k, name in enumerate(names):
            y = first + 2 * k
            pins.append(((x, y), out))
            strokes += [line((x, y), (inner, y)), ("text", (inner - 0.4 * out[0], y), name, anchor)]
    for words, y, inner, out in ((above, -1, 0, UP), (below, tall + 1, tall, DOWN)):
        first = 1 + (width - pitch * (len(words) - 1)) // 2
        for k, name in enumerate(words):
            x = first + pitch * k
            pins.append(((x, y), out))
            strokes += [line((x, y), (x, inner)), ("text", (x, inner - 0.8 * out[1]), name)]
    return Symbol(pins, (1, 0, 1 + width, tall), strokes)


def machine(names: list[str], letter: str) -> Symbol:
    """A machine of several windings: a ring in a box, all terminals on the left."""
    body = box(names, [], 8)
    middle = (body.box[1] + body.box[3]) / 2
    return Symbol(
        body.pins, body.box, [*body.strokes, ("ring", (6.2, middle), 1.6), ("text", (6.2, middle), letter)]
    )


def amplifier(look: str, supplies: bool) -> Symbol:
    """An operational amplifier: +, -, out (and the supplies above and below)."""
    strokes: list[Stroke] = [
        line((1, -3), (1, 3), (6.5, 0), (1, -3)), line((0, -1), (1, -1)), line((0, 1), (1, 1)), line((6.5, 0), (7, 0)),
        line((1.4, 1), (2.2, 1)), line((1.8, 0.6), (1.8, 1.4)), line((1.4, -1), (2.2, -1)),
    ]  # fmt: skip
    pins: list[tuple[Point, Point]] = [((0, 1), LEFT), ((0, -1), LEFT), ((7, 0), RIGHT)]
    if supplies:
        pins += [((4, -3), UP), ((4, 3), DOWN)]
        strokes += [line((4, -3), (4, -1.36)), line((4, 3), (4, 1.36))]
    return Symbol(pins, (1, -2 if supplies else -3, 6, 2 if supplies else 3), strokes)


def port(look: str) -> Symbol:
    """A terminal of the circuit that is drawn; its name stands beside it."""
    return Symbol([((0, 0), RIGHT)], (-1, 0, -1, 0), [("ring", (-0.35, 0), 0.3)])


# ---- single pins, as seen from the pin ----


def ground() -> list[Stroke]:
    return [
        line((0, 0), (0, 1)),
        line((-1, 1), (1, 1)),
        line((-0.6, 1.4), (0.6, 1.4)),
        line((-0.2, 1.8), (0.2, 1.8)),
    ]
