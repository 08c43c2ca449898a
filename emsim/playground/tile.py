"""A deck's moving picture for the gallery: its machine, else its circuit, over the curves that it shows: a film of SECONDS, and a
still of it some way into the run, both WebP. Frames are those of outputs/film.py; what is over no time stands still, and the
cursor runs along its axis.
"""

from __future__ import annotations

import math

import numpy as np

from ..outputs import film, missing_package, schematic
from ..outputs.beside import replacing
from ..outputs.html import shown
from ..outputs.schematic import above

try:
    from PIL import Image, ImageDraw
except ImportError:
    raise missing_package("a gallery needs", "Pillow", "plot") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from typing import Any

    from ..result import Result
    from ..table import Table

WIDTH, HEIGHT = 320, 240  # [px]
STRIP, FINE = 56, 2  # of which the curves take [px]; pixels drawn for one that is left
SECONDS, FPS = 4, 10
INK = ("accent", "force", "wiper")  # of the curves


def write(result: Result, moving: str, still: str) -> None:
    """Both pictures of a run, by the names of their files. OSError; ValueError where there is nothing to draw."""
    table = result.main.courses()[-1]  # of a deck with .step the last run
    curves = Curves(table, shown(result, table)[: len(INK)])
    picture = _picture(table, HEIGHT - STRIP * bool(curves))
    if picture is None and not curves:
        raise ValueError("nothing to draw")
    count = SECONDS * FPS if curves else 1

    def frame(share: float) -> Image.Image:
        if picture is None:
            whole = curves.frame(share, HEIGHT)
        elif curves:
            whole = above(picture(share), curves.frame(share, STRIP))
        else:
            whole = picture(share)
        return whole.quantize(64, dither=Image.Dither.NONE)  # as many colours as lines on paper have

    frames: Iterator[Image.Image] = (frame(k / max(count - 1, 1)) for k in range(count))
    with replacing(still) as beside:
        frame(0.3).save(beside, format="WEBP", lossless=True)
    with replacing(moving) as beside:
        next(frames).save(
            beside, format="WEBP", save_all=True, append_images=frames, duration=1000 // FPS, loop=0, lossless=True, method=2
        )  # fmt: skip


class Curves:
    """Signals of a table over its axis, each in its own range: what has passed strong, what comes pale. False: there are none."""

    def __init__(self, table: Table, names: list[str]) -> None:
        self.courses: list[Any] = []
        if table.axis is None or len(table) < 2:
            return
        axis = table.axis_values()
        self.along = _shares(np.log(axis) if table.axis.log and axis.min() > 0 else axis)
        for name in names:
            values = np.asarray(table[name])
            if np.iscomplexobj(values):
                values = 20 * np.log10(np.maximum(np.abs(values), 1e-300))
            if np.isfinite(values).all():
                self.courses.append(_shares(values))

    def __bool__(self) -> bool:
        return bool(self.courses)

    def frame(self, share: float, height: int) -> Image.Image:
        image = Image.new("RGB", (WIDTH * FINE, height * FINE), film.COLOURS["panel"])
        draw = ImageDraw.Draw(image)
        x = 8 * FINE + self.along * (WIDTH - 16) * FINE
        now = 8 * FINE + share * (WIDTH - 16) * FINE
        for course, colour in zip(self.courses, INK, strict=False):
            y = (height - 8 - course * (height - 16)) * FINE
            # as many points as can be seen, the extremes among them
            points = _thin(x, y)
            draw.line(points, film.mixed(colour, 0.35, "panel"), FINE)
            passed = [p for p in points if p[0] <= now]
            if len(passed) > 1:
                draw.line(passed, film.COLOURS[colour], 2 * FINE, joint="curve")
        draw.line([(now, 0), (now, height * FINE)], film.COLOURS["soft"], 1)
        return image.reduce(FINE)


def _shares(values: Any) -> Any:
    """0 for the least, 1 for the largest; what stands still lies in the middle."""
    least, most = float(values.min()), float(values.max())
    return (values - least) / (most - least) if most > least else np.full(len(values), 0.5)


def _thin(x: Any, y: Any) -> list[tuple[float, float]]:
    """Of each pixel the first, the least, the largest and the last point."""
    if len(x) <= 4 * WIDTH:
        return list(zip(x.tolist(), y.tolist(), strict=True))
    column = np.floor(x).astype(int)
    kept: set[int] = set()
    for part in np.split(np.arange(len(x)), np.flatnonzero(np.diff(column)) + 1):
        kept.update((int(part[0]), int(part[y[part].argmin()]), int(part[y[part].argmax()]), int(part[-1])))
    return [(float(x[k]), float(y[k])) for k in sorted(kept)]


def _picture(table: Table, height: int) -> Callable[[float], Image.Image] | None:
    """Machine or circuit in the tile's width and so much height; None where neither is drawn."""
    moves = table.kind == "tran" or film.swings(table)
    along = film.instants(table) if moves else (0.0, 0.0)
    first, last = float(along[0]), float(along[-1])
    drawn = (
        None
        if table.circuit is None or "refused" in table.circuit.data
        else table.circuit.data["pictures"][""]
    )
    rests = table.axis is None and len(table) == 1
    if table.scene is not None and (rests or (moves and len(along) > 1)):
        whole = film.Stage(table, WIDTH)
        width = min(WIDTH, math.floor(WIDTH * height / whole.height))
        # signs of motors and sensors have a least size: a plane machine is drawn as large as in films
        size = round(width * film.WIDTH / WIDTH) if whole.planar else width
        camera = film.Camera(table, size, FINE, None, first)

        def machine(share: float) -> Image.Image:
            frame = camera.frame(first + share * (last - first))
            small = (width, min(height, round(frame.height * width / size)))
            return _centred(frame if size == width else frame.resize(small, Image.Resampling.LANCZOS), height)

        return machine
    if drawn is None:
        return None
    width = max(1, min(WIDTH, math.floor(height * drawn["width"] / drawn["height"])))
    if table.kind != "tran" or len(table) < 2:
        still = _centred(schematic.image(drawn, min(width / drawn["width"], 1.6)), height)
        return lambda share: still
    moving = schematic.Moving(table, width)
    return lambda share: _centred(moving.image(first + share * (last - first), 1 / FPS), height)


def _centred(image: Image.Image, height: int) -> Image.Image:
    whole = Image.new("RGB", (WIDTH, height), film.COLOURS["back"])
    whole.paste(image, ((WIDTH - image.width) // 2, (height - image.height) // 2))
    return whole
