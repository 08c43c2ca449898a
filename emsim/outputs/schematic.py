"""A circuit's picture (schematic/picture.py) by Pillow: as PNG, and beside the machine in films."""

from __future__ import annotations

from itertools import pairwise
from os.path import join

import numpy as np

from . import missing_package
from .beside import replacing

try:
    from PIL import Image, ImageDraw, ImageFont
except ImportError:
    raise missing_package("a picture of a circuit needs", "Pillow", "plot") from None

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from typing import Any

    from ..table import Table

SPACING, FASTEST, FAINT = (
    14.0,
    90.0,
    1e-6,
)  # of dots [px, px/s, share of the largest current], as in web/circuit.js
OVER, UNDER, DOTTED = "#c8341f", "#0b62c4", "#0f7d46"  # voltages above and below ground, what flows
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
    dots: Sequence[tuple[float, float]] = (), dotted: str = DOTTED,
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


class Moving:
    """A circuit at the instants of a film, as the page shows it: `image(t, seconds)`, `seconds` after the instant before."""

    def __init__(self, table: Table, width: int) -> None:
        circuit = table.circuit
        assert circuit is not None
        self.data: dict[str, Any] = circuit.data["pictures"][""]
        self.volts, self.currents, self.uses = (circuit.data[key] for key in ("volts", "currents", "uses"))
        self.time = table.time
        names = [c["name"] for c in circuit.data["channels"]]
        self.columns = {name: np.frombuffer(circuit.waves.column(k)) for k, name in enumerate(names)}
        self.scale = min(width / self.data["width"], 1.6)
        self.width = width
        volts = [_largest(self.columns[name]) for name in self.volts.values()]
        self.top = max([*volts, 1e-12])
        parts = self.data["parts"]
        self.pins: dict[str, list[tuple[int, int]]] = {}
        for k, part in enumerate(parts):
            for j, (_, _, net) in enumerate(part["pins"]):
                self.pins.setdefault(net, []).append((k, j))
        instants = np.linspace(self.time[0], self.time[-1], 60)
        sizes = [
            abs(self.current(k, 0, t)) for k, p in enumerate(parts) if len(p["pins"]) == 2 for t in instants
        ]
        self.most = max((s for s in sizes if np.isfinite(s)), default=0.0)
        # what dots run along, and how far they are
        self.ways: list[tuple[Any, list[list[float]]]] = [(w, w["points"]) for w in self.data["wires"]]
        self.ways += [
            ((k, 0), [p["pins"][0][:2], p["pins"][1][:2]]) for k, p in enumerate(parts) if len(p["pins"]) == 2
        ]
        self.ways += [
            ((k, pin), lead) for k, p in enumerate(parts) if len(p["pins"]) > 2 for pin, lead in leads(p)
        ]
        self.phases = [0.0] * len(self.ways)

    def value(self, name: str, t: float, rate: int = 0) -> float:
        column = self.columns[name]
        if not rate:
            return float(np.interp(t, self.time, column))
        k = int(np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.time) - 2))
        span = self.time[k + 1] - self.time[k]
        return float((column[k + 1] - column[k]) / span) if span > 0 else 0.0

    def volt(self, net: str, t: float) -> float:
        return 0.0 if net == "0" else self.value(self.volts[net], t) if net in self.volts else float("nan")

    def current(self, part: int, pin: int, t: float) -> float:
        """Into a pin of a part [A]; NaN where nobody knows it."""
        p = self.data["parts"][part]
        name, terminal = p["sources"][pin]
        if p["name"] in self.uses and p["kind"] != "transformer":
            nets = [net for *_, net in p["pins"]]
            if pin != max(k for k, net in enumerate(nets) if net == nets[pin]):
                return 0.0
            terms = self.uses[p["name"]].get(nets[pin], [])
        else:
            own = self.currents.get(name, [])
            terms = own[terminal] if terminal < len(own) else []
            if not terms:
                return float("nan")
        return sum(factor * self.value(column, t, rate) for factor, column, rate in terms)

    def along(self, wire: dict[str, Any], t: float) -> float:
        """From the first point of a wire to its last [A]."""
        beyond = [(k, j) for k, j, _ in wire["flow"]]
        there = sum(self.current(k, j, t) for k, j in beyond)
        if np.isfinite(there):
            return there
        return -sum(self.current(k, j, t) for k, j in self.pins[wire["net"]] if (k, j) not in beyond)

    def colour(self, net: str, t: float) -> str:
        v = self.volt(net, t)
        share = min(1.0, (abs(v) / self.top) ** 0.5) if np.isfinite(v) else 0.0
        return LIGHT[1] if share < 0.02 else _mixed(OVER if v > 0 else UNDER, LIGHT[1], share)

    def svg(self, t: float, width: int) -> tuple[str, float]:
        """The drawing as an SVG within another, in the middle of its width, and how tall it is [px]."""
        from ..schematic.svg import svg

        w, h = (round(self.data[key] * self.scale) for key in ("width", "height"))
        text = svg(self.data, False, "circuit", lambda net: self.colour(net, t))
        head, rest = text.split(">", 1)
        view = f'viewBox="0 0 {self.data["width"]} {self.data["height"]}"'
        font = head[head.index("font-family") :]
        return f'<svg x="{(width - w) / 2:g}" width="{w}" height="{h}" {view} {font}>{rest}', float(h)

    def image(self, t: float, seconds: float = 0.0) -> Image.Image:
        """As wide as the film."""
        dots: list[tuple[float, float]] = []
        for k, (what, points) in enumerate(self.ways):
            i = self.current(what[0], what[1], t) if isinstance(what, tuple) else self.along(what, t)
            share = i / self.most if self.most and np.isfinite(i) else 0.0
            if abs(share) < FAINT:
                continue
            speed = float(np.sign(share)) * min(1.0, abs(share) ** 0.5) * FASTEST
            self.phases[k] = (self.phases[k] + speed * seconds) % SPACING
            dots += _spaced(points, self.phases[k])

        drawn = image(self.data, self.scale, False, lambda net: self.colour(net, t), dots)
        if drawn.width == self.width:
            return drawn
        whole = Image.new("RGB", (self.width, drawn.height), LIGHT[0])
        whole.paste(drawn, ((self.width - drawn.width) // 2, 0))
        return whole


def leads(part: dict[str, Any]) -> list[tuple[int, list[list[float]]]]:
    """Of a part with several pins the lines of its symbol that begin at one: (pin, points from there on)."""

    def at(p: Sequence[float], q: Sequence[float]) -> bool:
        return abs(p[0] - q[0]) < 0.6 and abs(p[1] - q[1]) < 0.6

    found = []
    for k, pin in enumerate(part["pins"]):
        lines = (s[1] for s in part["strokes"] if s[0] == "line" and len(s[1]) < 4)
        own = next((line for line in lines if at(line[0], pin) or at(line[-1], pin)), None)
        if own is not None:
            found.append((k, list(own) if at(own[0], pin) else list(own)[::-1]))
    return found


def above(first: Image.Image, second: Image.Image) -> Image.Image:
    """One picture on top of another of the same width."""
    both = Image.new("RGB", (second.width, first.height + second.height), LIGHT[0])
    both.paste(first, (0, 0))
    both.paste(second, (0, first.height))
    return both


def _largest(column: Any) -> float:
    sizes = np.sort(np.abs(column[np.isfinite(column)]))
    return float(sizes[int(0.995 * (len(sizes) - 1))]) if len(sizes) else 0.0


def _mixed(a: str, b: str, share: float) -> str:
    parts = [(int(a[k : k + 2], 16), int(b[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(share * x + (1 - share) * y):02x}" for x, y in parts)


def _spaced(points: Sequence[Sequence[float]], phase: float) -> Iterable[tuple[float, float]]:
    """Points along a line, SPACING apart, the first `phase` behind its beginning."""
    at = phase
    for (x0, y0), (x1, y1) in pairwise(points):
        far = ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5
        while at < far:
            yield x0 + (x1 - x0) * at / far, y0 + (y1 - y0) * at / far
            at += SPACING
        at -= far
