"""A frame of the machine as SVG: a pen (glyphs/contract.py) that writes what it is to draw. Solids are a picture within it."""

from __future__ import annotations

import math
from base64 import b64encode
from io import BytesIO
from xml.sax.saxutils import escape

import numpy as np
from PIL import Image

from .glyphs.paper import named

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

    from .glyphs.contract import Point

FINE = 3  # pixels of solids for one
HEIGHT = 11  # px, of writing
ANCHORS = {
    "mm": ("middle", 0.36),
    "ms": ("middle", 0.0),
    "ls": ("start", 0.0),
}  # and how far down, of its height


class SvgPen:
    """`wide` measures a text [px]."""

    fine = FINE

    def __init__(
        self, size: tuple[float, float], unit: float, colours: dict[str, str], wide: Callable[[str], float]
    ) -> None:
        self.size, self.unit, self.colours, self.wide = size, unit, colours, wide
        self.parts: list[str] = []
        self.labels: list[list[Any]] = []
        self.taken: list[list[float]] = []

    def rgb(self, colour: str) -> tuple[int, int, int]:
        r, g, b = (int(self.colours[colour][k : k + 2], 16) for k in (1, 3, 5))
        return r, g, b

    def _add(self, shape: str, fill: str | None, edge: str | None, width: float, alpha: float = 1.0) -> None:
        style = f'fill="{self.colours[fill] if fill else "none"}"'
        if edge:
            style += f' stroke="{self.colours[edge]}" stroke-width="{width * self.unit:.4g}"'
        if alpha < 1:
            style += f' stroke-opacity="{alpha:.3g}"'
        self.parts.append(f"<{shape} {style}/>")

    def line(
        self, points: Sequence[Point], colour: str, width: float, dash: float = 0.0, alpha: float = 1.0
    ) -> None:
        dashes = f' stroke-dasharray="{dash * self.unit:g}"' if dash else ""
        self._add(f'path d="{_path(points)}"{dashes}', None, colour, width, alpha)

    def polygon(self, points: Sequence[Point], fill: str, edge: str, width: float) -> None:
        self._add(f'path d="{_path(points)}Z"', fill, edge, width)

    def area(self, loops: Sequence[Sequence[Point]], fill: str, edge: str, width: float) -> None:
        self._add(f'path d="{"".join(_path(loop) + "Z" for loop in loops)}"', fill, edge, width)

    def circle(
        self, at: Point, r: float, fill: str | None, edge: str, width: float, alpha: float = 1.0
    ) -> None:
        self._add(f'circle cx="{at[0]:.2f}" cy="{at[1]:.2f}" r="{r:.2f}"', fill, edge, width, alpha)

    def arc(self, at: Point, r: float, start: float, end: float, colour: str, width: float) -> None:
        count = max(2, math.ceil(abs(end - start) / 0.1))
        turns = [start + (end - start) * k / count for k in range(count + 1)]
        self.line([(at[0] + r * math.cos(a), at[1] + r * math.sin(a)) for a in turns], colour, width)

    def head(self, tip: Point, angle: float, colour: str, size: float) -> None:
        far = size * self.unit
        wings = [
            (tip[0] + far * math.cos(angle + s), tip[1] + far * math.sin(angle + s)) for s in (2.7, -2.7)
        ]
        self._add(f'path d="{_path([tip, *wings])}Z"', colour, None, 0)

    def label(self, at: Point, dx: float, dy: float, text: str, colour: str) -> None:
        self.labels.append([at[0] + dx * self.unit, at[1] + dy * self.unit, text, colour])

    def keep_off(self, at: Point, r: float) -> None:
        self.taken.append([at[0] - r, at[1] - r, at[0] + r, at[1] + r])

    def write(self, x: float, y: float, text: str, colour: str, anchor: str) -> None:
        side, down = ANCHORS[anchor]
        self.parts.append(
            f'<text x="{x:.2f}" y="{y + down * HEIGHT * self.unit:.2f}" text-anchor="{side}" fill="{self.colours[colour]}" '
            f'stroke="{self.colours["back"]}" stroke-width="{3 * self.unit:g}" paint-order="stroke">{escape(text)}</text>'
        )

    def paste(self, pixels: Any, where: Any) -> None:
        data, both = BytesIO(), np.dstack([pixels, (255 * where).astype(np.uint8)])
        Image.fromarray(both, "RGBA").save(data, format="PNG")
        w, h = self.size
        picture = b64encode(data.getvalue()).decode("ascii")
        self.parts.append(f'<image width="{w:g}" height="{h:g}" href="data:image/png;base64,{picture}"/>')

    def text(self, title: str, above: str = "", room: float = 0.0) -> str:
        """The file, below a drawing that takes `room` px."""
        for x, y, words, colour in named(self.labels, self.taken, list(self.size), self.unit, self.wide):
            self.write(x, y, words, colour, "ls")
        self.labels = []
        w, h = self.size
        tall = h + room
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {w:g} {tall:g}" width="{w:g}" height="{tall:g}" '
                'role="img">',
                f"<title>{escape(title)}</title>",
                f'<rect width="100%" height="100%" fill="{self.colours["back"]}"/>',
                above,
                f'<g transform="translate(0 {room:g})" font-family="Helvetica, Arial, \'DejaVu Sans\', sans-serif" '
                f'font-size="{HEIGHT * self.unit:g}" stroke-linecap="round" stroke-linejoin="round">',
                *self.parts,
                "</g>",
                "</svg>",
                "",
            ]
        )


def _path(points: Sequence[Point]) -> str:
    return "M" + "L".join(f"{p[0]:.2f},{p[1]:.2f}" for p in points)
