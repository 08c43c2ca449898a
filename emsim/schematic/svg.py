"""A picture as SVG."""

from __future__ import annotations

from xml.sax.saxutils import escape

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

FONT = "Helvetica, Arial, 'DejaVu Sans', sans-serif"
SIZE = 11  # of writing [px]
# ink, paper, wires, soft writing
LIGHT = {"ink": "#1c2430", "paper": "#ffffff", "wire": "#1c2430", "soft": "#57606e"}
DARK = {"ink": "#e6eaf0", "paper": "#14181e", "wire": "#e6eaf0", "soft": "#a3adbb"}


def svg(
    data: dict[str, Any], dark: bool = False, title: str = "", colour: Callable[[str], str] | None = None
) -> str:
    """The text of an SVG file; `colour` gives nets theirs."""
    c = DARK if dark else LIGHT
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {data["width"]} {data["height"]}" width="{data["width"]}" '
        f'height="{data["height"]}" role="img" font-family="{FONT}" font-size="{SIZE}">',
        f"<title>{escape(title or 'circuit')}</title>",
        f'<rect width="100%" height="100%" fill="{c["paper"]}"/>',
        f'<g fill="none" stroke="{c["wire"]}" stroke-width="1.4" stroke-linecap="round" stroke-linejoin="round">',
    ]
    for wire in data["wires"]:
        own = f' stroke="{colour(wire["net"])}"' if colour else ""
        out.append(f'<path d="{path(wire["points"])}" data-net="{escape(wire["net"])}"{own}/>')
    for x, y, net in data["dots"]:
        own = colour(net) if colour else c["wire"]
        out.append(f'<circle cx="{x:g}" cy="{y:g}" r="2.6" fill="{own}" stroke="none"/>')
    for part in data["parts"]:
        out.append(f'<g data-part="{escape(part["name"])}">')
        out += [_stroke(s, c) for s in part["strokes"]]
        out += [_text(x, y, anchor, words, c["ink"]) for x, y, anchor, words in part["texts"]]
        out.append("</g>")
    out += [_text(x, y, anchor, words, c["soft"]) for x, y, anchor, words, _ in data["names"]]
    out += ["</g>", "</svg>", ""]
    return "\n".join(out)


def path(points: list[list[float]]) -> str:
    return "M" + "L".join(f"{x:g},{y:g}" for x, y in points)


def _stroke(s: list[Any], c: dict[str, str]) -> str:
    if s[0] == "line":
        return f'<path d="{path(s[1])}"/>'
    if s[0] == "fill":
        return f'<path d="{path(s[1])}Z" fill="{c["ink"]}" stroke-width="0.6"/>'
    solid = f' fill="{c["ink"]}"' if s[0] == "dot" else ""
    return f'<circle cx="{s[1]:g}" cy="{s[2]:g}" r="{s[3]:g}"{solid}/>'


def _text(x: float, y: float, anchor: str, words: str, colour: str) -> str:
    return f'<text x="{x:g}" y="{y + 0.36 * SIZE:g}" text-anchor="{anchor}" fill="{colour}" stroke="none">{escape(words)}</text>'
