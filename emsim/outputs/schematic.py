"""A circuit's picture (schematic/picture.py) by Pillow: as PNG, and beside the machine in films."""

from __future__ import annotations

from os.path import join

from . import missing_package
from .beside import replacing

try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    raise missing_package("a picture of a circuit needs", "Pillow", "plot") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import Any

FINE = 3  # pixels drawn for one that is left
STROKE, DOT = 1.4, 2.6  # [px]
SIZE = 11  # of writing [px]
LIGHT, DARK = ("#ffffff", "#1c2430", "#57606e"), ("#14181e", "#e6eaf0", "#a3adbb")  # paper, ink, soft writing


def png(path: str, data: dict[str, Any], dark: bool = False, scale: float = 2.0) -> None:
    """Writes the picture, `scale` times its own size. OSError."""
    with replacing(path) as beside:
        image(data, scale, dark).save(beside, format="PNG")


def image(
    data: dict[str, Any], scale: float, dark: bool = False, colour: Callable[[str], str] | None = None,
    dots: Sequence[tuple[float, float]] = (), dotted: str = "#d08a00",
) -> Image.Image:  # fmt: skip
    """RGB. `colour` gives nets their colours; `dots` are places of what flows [px of the picture]."""
    from matplotlib import get_data_path

    paper, ink, soft = DARK if dark else LIGHT
    whole = (round(data["width"] * scale * FINE), round(data["height"] * scale * FINE))
    picture = Image.new("RGB", whole, paper)
    draw, k = ImageDraw.Draw(picture), scale * FINE
    width = max(1, round(STROKE * k))

    def line(points: Sequence[Sequence[float]], fill: str) -> None:
        draw.line([(x * k, y * k) for x, y in points], fill, width, joint="curve")

    def disc(x: float, y: float, r: float, fill: str | None, edge: str | None = None) -> None:
        at = ((x - r) * k, (y - r) * k, (x + r) * k, (y + r) * k)
        draw.ellipse(at, fill, edge, width if edge else 0)

    of = colour or (lambda net: ink)
    for wire in data["wires"]:
        line(wire["points"], of(wire["net"]))
    for x, y, net in data["dots"]:
        disc(x, y, DOT, of(net))
    for part in data["parts"]:
        for stroke in part["strokes"]:
            if stroke[0] == "line":
                line(stroke[1], ink)
            elif stroke[0] == "fill":
                draw.polygon([(x * k, y * k) for x, y in stroke[1]], ink)
            else:
                x, y, r = stroke[1:]
                disc(
                    x,
                    y,
                    r + (STROKE / 2 if stroke[0] == "ring" else 0),
                    ink if stroke[0] == "dot" else None,
                    ink,
                )
    for x, y in dots:
        disc(x, y, 2.4, dotted)
    small = picture.reduce(FINE)
    draw = ImageDraw.Draw(small)
    face = join(get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")
    font = ImageFont.truetype(face, max(6, round(0.9 * SIZE * scale)))
    texts = [(*text, ink) for part in data["parts"] for text in part["texts"]]
    texts += [(x, y, anchor, words, soft) for x, y, anchor, words, _ in data["names"]]
    anchors = {"start": "lm", "end": "rm", "middle": "mm"}
    for x, y, anchor, words, fill in texts:
        draw.text((round(x * scale), round(y * scale)), words, fill, font, anchors[anchor])
    return small
