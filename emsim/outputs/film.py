"""The moving machine as a GIF, one frame of it as PNG: the cards' glyphs, as in the page, by Pillow.

Lines are drawn in twice or three times the size and made small again, writing at its own size. A frame lasts whole
hundredths of a second, which is what GIF knows, and shows the time that it stands for: `speed` is simulated seconds a
second. All frames share one palette, so that only what moves costs bytes.
"""

from __future__ import annotations

import math
from itertools import pairwise
from os.path import join

import numpy as np

from ..assemble.drawing import traced
from ..diagnostics import deck_error
from . import missing_package
from .beside import replacing
from .glyphs import drawn
from .glyphs.paper import called, named, paper
from .numbers import written
from .solid import Solids
from .stage import Stage, instants
from .vector import SvgPen

try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    raise missing_package("a film needs", "Pillow", "plot") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from typing import Any

    from ..table import Table
    from .glyphs.contract import Point

COLOURS = {
    "back": "#ffffff", "panel": "#f6f7f9", "ink": "#1c2430", "soft": "#667080", "accent": "#0b62c4", "body": "#c9d4e2",
    "edge": "#3d4b5e", "ground": "#66707f", "force": "#c8341f", "coil": "#8a4fb8", "motor": "#0b62c4", "wiper": "#0f7d46",
}  # fmt: skip
WIDTH = 480  # [px]
FPS = 20
SHORTEST, LONGEST = 4.0, 10.0  # seconds that a film lasts where nobody says
MOST = 3000  # frames
REST = 80  # hundredths of a second that the last frame stands longer
TRACED = 1500  # points of a trace
THROUGH = 127  # number of the colour that is none


def mixed(colour: str, share: float, on: str = "back") -> str:
    """A colour, so much of it, on another."""
    parts = [(int(COLOURS[colour][k : k + 2], 16), int(COLOURS[on][k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(share * a + (1 - share) * b):02x}" for a, b in parts)


def swings(table: Table) -> bool:
    """Is its machine drawn in its modes, one after the other?"""
    return table.scene is not None and table.scene.axis is not None


def called_mode(table: Table, at: float) -> str:
    """The mode that the film is in: its frequency, or the rate of what does not swing."""
    k = min(max(math.floor(at + 0.5), 1), len(table)) - 1
    frequency, damping, rate = (float(table.column(word)[k]) for word in ("frequency", "damping", "rate"))
    if frequency > 0:
        return f"mode {k + 1}: {written(frequency, 'Hz', 4)}, damping {written(damping, '', 3)}"
    return f"mode {k + 1}: rate {written(rate, '1/s', 4)}"


class Timing:
    """The instants of the frames [s], and how long each of them stands [1/100 s]."""

    __slots__ = ("delays", "speed", "times")

    def __init__(
        self, table: Table, start: float | None = None, stop: float | None = None, fps: float | None = None,
        speed: float | None = None, duration: float | None = None,
    ) -> None:  # fmt: skip
        """`duration` in seconds of the film or `speed`; else .view speed=, else 4 to 10 s. `fps`, else .view fps=. Raises
        DeckError for an empty stretch and for more than MOST frames."""
        along = instants(table)
        first, last = float(along[0]), float(along[-1])
        begin = first if start is None else max(first, start)
        end = last if stop is None else min(last, stop)
        if not begin < end:
            said = f"there is nothing to draw from {begin:g} to {end:g} s: time goes from {first:g} s to {last:g} s"
            if swings(table):
                said = f"there is no such mode: there are {len(table)}"
            deck_error("E349", said)
        view = table.scene.data["view"] if table.scene is not None else {}
        # hundredths of a second, of which a GIF has 16 bits
        span, delay = end - begin, max(2, round(min(100 / (fps or view.get("fps") or FPS), 0xFFFF - REST)))
        if speed is None:
            viewed = view.get("speed")
            # a mode swings twice
            wished = duration or (2 * math.ceil(span) if swings(table) else min(max(span, SHORTEST), LONGEST))
            speed = viewed if viewed and not duration else span / wished
        self.speed = float(speed)
        step = self.speed * delay / 100
        count = math.floor(span / step * (1 + 1e-9)) + 1
        if count > MOST:
            hint = "choose a higher --speed, a shorter --duration, or fewer frames a second with --fps"
            deck_error("E355", f"that film has {count} frames, and {MOST} is the most", hint=hint)
        self.times = [begin + k * step for k in range(count)]
        if end - self.times[-1] > 0.01 * step:
            self.times.append(end)
        self.delays = [delay] * (len(self.times) - 1) + [delay + REST]


def gif(
    path: str,
    table: Table,
    timing: Timing,
    width: int = WIDTH,
    trace: str | None = None,
    circuit: bool = False,
) -> None:
    """Writes the film, with the `circuit` above the machine. OSError; DeckError for a trace of no point."""
    camera = _camera(table, width, 2, trace, timing.times[0], circuit)
    palette = _palette()

    def frames() -> Iterator[Image.Image]:
        """The first whole, of the others what is new; the rest shines through."""
        before = None
        for t in timing.times:
            frame = camera.frame(t).quantize(palette=palette, dither=Image.Dither.NONE)
            now = np.asarray(frame)
            if before is None:
                yield frame
            else:
                new = Image.fromarray(np.where(now == before, THROUGH, now), "P")
                new.putpalette(palette.getpalette() or [])
                yield new
            before = now

    film = frames()
    with replacing(path) as beside:
        next(film).save(
            beside, format="GIF", save_all=True, append_images=film, duration=[10 * d for d in timing.delays], loop=0,
            optimize=False, disposal=1, transparency=THROUGH, palette=bytes(palette.getpalette() or []),
        )  # fmt: skip


def _palette() -> Image.Image:
    """The glyphs' colours, and what lies between them and what they are drawn on."""
    found = list(COLOURS.values())
    for colour in list(COLOURS)[2:]:
        found += [mixed(colour, share / 6) for share in (1, 2, 3, 4, 5)]
        found += [mixed(colour, share / 4, "body") for share in (1, 2, 3)]
    values = [int(c[k : k + 2], 16) for c in dict.fromkeys(found) for k in (1, 3, 5)]
    # filled up with colours that nothing has, all different: Pillow tells numbers by their colours
    values += [v for k in range(len(values) // 3, THROUGH + 1) for v in (0, 255, k)]
    image = Image.new("P", (1, 1))
    image.putpalette(values)
    return image


def png(
    path: str, table: Table, t: float, width: int = 2 * WIDTH, trace: str | None = None, circuit: bool = False
) -> None:
    """Writes the machine at one instant [s], the `circuit` above it; PNG or SVG by the file's name. OSError; DeckError: no such
    point or time."""
    along = instants(table)
    first, last = float(along[0]), float(along[-1])
    if not first <= t <= last:
        deck_error("E349", f"there is nothing to draw at {t:g} s: time goes from {first:g} s to {last:g} s")
    with replacing(path) as beside:
        if path.lower().endswith(".svg"):
            with open(beside, "w", encoding="utf-8") as file:
                file.write(_svg(table, t, width, trace, circuit))
        else:
            _camera(table, width, 3, trace, first, circuit).frame(t).save(beside, format="PNG")


def _svg(table: Table, t: float, width: int, trace: str | None, circuit: bool) -> str:
    """The same as a drawing, wires in the colours of their voltages."""
    above, room = "", 0.0
    if circuit:
        from .schematic import Moving

        moving = Moving(table, width)
        above, room = moving.svg(t, width)
    if table.scene is None:
        return SvgPen((width, 0), 1.0, COLOURS, len).text(table.title, above, room)
    camera = Camera(table, width, 1, trace, float(instants(table)[0]))
    pen = SvgPen((camera.stage.width, camera.stage.height), camera.unit, COLOURS, camera.font.getlength)
    camera.draw(pen, t)
    return pen.text(table.title, above, room)


def _camera(
    table: Table, width: int, fine: int, trace: str | None, begin: float, circuit: bool
) -> Camera | Both:
    return Both(table, width, fine, trace, begin) if circuit else Camera(table, width, fine, trace, begin)


class Both:
    """Draws frames of the circuit, above the machine where there is one."""

    def __init__(self, table: Table, width: int, fine: int, trace: str | None, begin: float) -> None:
        from .schematic import Moving

        self.circuit = Moving(table, width)
        self.machine = Camera(table, width, fine, trace, begin) if table.scene is not None else None
        self.seconds = 1 / FPS

    def frame(self, t: float) -> Image.Image:
        from .schematic import above

        drawn = self.circuit.image(t, self.seconds)
        return drawn if self.machine is None else above(drawn, self.machine.frame(t))


class Camera:
    """Draws frames. Widths are for a picture of WIDTH pixels and grow with it."""

    def __init__(self, table: Table, width: int, fine: int, trace: str | None, begin: float) -> None:
        from matplotlib import get_data_path

        self.stage = Stage(table, width)
        self.fine, self.unit = fine, max(width / WIDTH, 0.6)
        trace = trace or str(self.stage.view.get("trace") or "")
        if trace:
            traced(trace, self.stage.points)
        self.traced = self.stage.points.get(trace)
        self.solids = Solids(self.stage) if self.stage.solid else None
        self.begin = begin
        self.rests = table.axis is None
        self.modes = table if swings(table) else None
        face = join(get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
        self.font = ImageFont.truetype(face, round(11 * self.unit))

    def frame(self, t: float) -> Image.Image:
        """RGB, the machine at t [s]."""
        pen = Pen(self)
        self.draw(pen, t)
        return pen.picture()

    def draw(self, pen: Pen | SvgPen, t: float) -> None:
        stage = self.stage
        stage.at(t)
        stage.seen()
        paper(stage, pen)
        if self.traced is not None and t > self.begin:
            count = min(TRACED, 2 + sum(1 for v in stage.time if self.begin <= v <= t))
            times = [self.begin + (t - self.begin) * k / (count - 1) for k in range(count)]
            pen.line(stage.course(self.traced, times), "accent", 1.2)
        if self.solids is not None:
            pen.paste(*self.solids.draw(pen.fine, pen.rgb))
        drawn(stage, pen)
        if self.solids is not None:
            called(stage, pen)
        said = f"t = {written(t, 's', 4)}" if self.modes is None else called_mode(self.modes, t)
        said = "at rest" if self.rests else said
        pen.write(stage.width / 2, stage.height - 8 * self.unit, said, "ink", anchor="ms")


class Pen:
    """Draws on one frame; lengths in its pixels, widths and heads in those of a picture of WIDTH."""

    def __init__(self, camera: Camera) -> None:
        self.unit, self._fine, self._font = camera.unit, camera.fine, camera.font
        self._size = camera.stage.width, camera.stage.height
        whole = self._size[0] * self._fine, self._size[1] * self._fine
        self._image = Image.new("RGB", whole, COLOURS["back"])
        self._draw = ImageDraw.Draw(self._image)
        self._texts: list[tuple[float, float, str, str, str]] = []
        self._labels: list[list[Any]] = []
        self._taken: list[list[float]] = []

    @property
    def fine(self) -> int:
        return self._fine

    def rgb(self, colour: str) -> tuple[int, int, int]:
        r, g, b = (int(COLOURS[colour][k : k + 2], 16) for k in (1, 3, 5))
        return r, g, b

    def paste(self, pixels: Any, where: Any) -> None:
        """RGB of the whole frame in its fine pixels, where it is to be seen."""
        self._image.paste(
            Image.fromarray(pixels, "RGB"), (0, 0), Image.fromarray((255 * where).astype(np.uint8), "L")
        )

    def _up(self, points: Sequence[Point]) -> list[Point]:
        return [(x * self._fine, y * self._fine) for x, y in points]

    def line(
        self, points: Sequence[Point], colour: str, width: float, dash: float = 0.0, alpha: float = 1.0
    ) -> None:
        """Through the points, with round ends and corners; `dash` long pieces and gaps."""
        colour = mixed(colour, alpha) if alpha < 1 else colour
        if dash:
            for a, b in _dashes(points, dash * self.unit):
                self.line([a, b], colour, width)
            return
        fill, thick = COLOURS.get(colour, colour), max(1, round(width * self.unit * self._fine))
        points = self._up(points)
        self._draw.line(points, fill, thick, joint="curve")
        r = (thick - 1) / 2
        for x, y in (points[0], points[-1]) if r >= 1 else ():
            self._draw.ellipse((x - r, y - r, x + r, y + r), fill)

    def polygon(self, points: Sequence[Point], fill: str, edge: str, width: float) -> None:
        """A filled shape with its outline."""
        self._draw.polygon(self._up(points), COLOURS[fill])
        self.line([*points, points[0]], edge, width)

    def area(self, loops: Sequence[Sequence[Point]], fill: str, edge: str, width: float) -> None:
        """What closed loops wind about, filled, with the loops."""
        wide, tall = self._image.size
        wound = np.zeros((tall, wide), np.int16)
        for corners in map(self._up, loops):
            xs, ys = zip(*corners, strict=True)
            left, top = max(0, math.floor(min(xs))), max(0, math.floor(min(ys)))
            right, bottom = min(wide, math.ceil(max(xs)) + 1), min(tall, math.ceil(max(ys)) + 1)
            if left >= right or top >= bottom:
                continue
            inside = Image.new("1", (right - left, bottom - top))
            ImageDraw.Draw(inside).polygon([(x - left, y - top) for x, y in corners], 1)
            turn = sum(p[0] * q[1] - p[1] * q[0] for p, q in pairwise([*corners, corners[0]]))
            wound[top:bottom, left:right] += np.int16(np.sign(turn)) * np.asarray(inside)
        self._image.paste(COLOURS[fill], (0, 0), Image.fromarray((255 * (wound != 0)).astype(np.uint8), "L"))
        for loop in loops:
            self.line([*loop, loop[0]], edge, width)

    def circle(
        self, at: Point, r: float, fill: str | None, edge: str, width: float, alpha: float = 1.0
    ) -> None:
        edge = mixed(edge, alpha) if alpha < 1 else edge
        x, y, r = at[0] * self._fine, at[1] * self._fine, r * self._fine
        thick = max(1, round(width * self.unit * self._fine))
        box = (x - r - thick / 2, y - r - thick / 2, x + r + thick / 2, y + r + thick / 2)
        self._draw.ellipse(box, COLOURS[fill] if fill else None, COLOURS.get(edge, edge), thick)

    def arc(self, at: Point, r: float, start: float, end: float, colour: str, width: float) -> None:
        """From angle to angle [rad], counted from x towards the picture's bottom."""
        n = max(2, math.ceil(abs(end - start) / 0.08))
        angles = [start + (end - start) * k / n for k in range(n + 1)]
        self.line([(at[0] + r * math.cos(a), at[1] + r * math.sin(a)) for a in angles], colour, width)

    def head(self, tip: Point, angle: float, colour: str, size: float) -> None:
        """The point of an arrow that flies at this angle."""
        size *= self.unit
        wings = [
            (tip[0] + size * math.cos(angle + side), tip[1] + size * math.sin(angle + side))
            for side in (2.7, -2.7)
        ]
        self._draw.polygon(self._up([tip, *wings]), COLOURS[colour])

    def label(self, at: Point, dx: float, dy: float, text: str, colour: str) -> None:
        """A name beside what it names, written when all is drawn, where there is room."""
        self._labels.append([at[0] + dx * self.unit, at[1] + dy * self.unit, text, colour])

    def keep_off(self, at: Point, r: float) -> None:
        """A round thing that labels keep off."""
        self._taken.append([at[0] - r, at[1] - r, at[0] + r, at[1] + r])

    def write(self, x: float, y: float, text: str, colour: str, anchor: str) -> None:
        self._texts.append((x, y, text, colour, anchor))

    def picture(self) -> Image.Image:
        """The frame in its own size, with its writing."""
        for x, y, text, colour in named(
            self._labels, self._taken, list(self._size), self.unit, self._font.getlength
        ):
            self.write(x, y, text, colour, "ls")
        small = self._image.reduce(self._fine)
        draw = ImageDraw.Draw(small)
        for x, y, text, colour, anchor in self._texts:
            at, around = (round(x), round(y)), COLOURS["back"]
            draw.text(at, text, COLOURS[colour], self._font, anchor, stroke_width=2, stroke_fill=around)
        return small


def _dashes(points: Sequence[Point], length: float) -> Iterator[tuple[Point, Point]]:
    for (x0, y0), (x1, y1) in pairwise(points):
        whole = math.hypot(x1 - x0, y1 - y0)
        at = 0.0
        while at < whole:
            f, g = at / whole, min(at + length, whole) / whole
            yield (x0 + f * (x1 - x0), y0 + f * (y1 - y0)), (x0 + g * (x1 - x0), y0 + g * (y1 - y0))
            at += 2 * length
