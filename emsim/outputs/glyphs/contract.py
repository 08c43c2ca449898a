"""What a glyph may ask of the scene and of the pen; the film's are in stage.py and film.py, the page's in web/machine.js.

A glyph is a function of (scene, pen, shape) in a file of its own. It is run by Python for films and frames, and translated to
JavaScript for the page (translate.py says which Python that takes): so every shape is drawn by one text. Points are pixels, y
downwards; widths, lengths with `pen.unit` and offsets of labels are those of a picture of ordinary size, which the unit scales.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

Point = Sequence[float]  # [px]
Place = Sequence[float]  # [body, x, y, z] in the axes of that body [m]
Shape = dict[str, Any]  # see assemble/drawing.py
Ref = str | float  # a channel "#k", or a number


class Pose(Protocol):
    @property
    def angle(self) -> float: ...  # about z in a planar scene [rad], else 0


class Scene(Protocol):
    """width, height    of the picture [px]; scale [px/m]
    arrows           are forces and torques shown?
    gravity          [m/s^2]
    """

    @property
    def planar(self) -> bool: ...
    @property
    def solid(self) -> bool: ...  # what can be is drawn as a solid
    @property
    def follow(self) -> bool: ...  # the camera goes with the machine
    @property
    def middle(self) -> Sequence[float]: ...  # of the picture, on its plane [m]
    @property
    def arrows(self) -> bool: ...
    @property
    def scale(self) -> float: ...
    @property
    def width(self) -> float: ...
    @property
    def height(self) -> float: ...
    @property
    def poses(self) -> Sequence[Pose]: ...
    @property
    def shapes(self) -> Sequence[Shape]: ...
    @property
    def gravity(self) -> Sequence[float]: ...
    def value(self, ref: Ref) -> float: ...
    def share(self, ref: Ref) -> float: ...  # of its largest size over the run, -1 .. 1
    def top(self, ref: Ref) -> float: ...  # its largest size over the run
    def place(self, place: Place) -> Point: ...
    def flat(self, vector: Sequence[float]) -> Point: ...  # world metres on the picture's plane, y upwards
    def axis_angle(self, shape: Shape) -> float: ...  # of a joint's axis on the picture [rad]


class Pen(Protocol):
    """Colours by name. Angles count from x towards the picture's bottom [rad]."""

    @property
    def unit(self) -> float: ...  # [px]
    def line(
        self, points: Sequence[Point], colour: str, width: float, dash: float = 0.0, alpha: float = 1.0
    ) -> None: ...
    def polygon(self, points: Sequence[Point], fill: str, edge: str, width: float) -> None: ...
    def area(
        self, loops: Sequence[Sequence[Point]], fill: str, edge: str, width: float
    ) -> None: ...  # what closed loops wind about, and the loops
    def circle(
        self, at: Point, r: float, fill: str | None, edge: str, width: float, alpha: float = 1.0
    ) -> None: ...
    def arc(self, at: Point, r: float, start: float, end: float, colour: str, width: float) -> None: ...
    def head(self, tip: Point, angle: float, colour: str, size: float) -> None: ...  # of an arrow
    def label(self, at: Point, dx: float, dy: float, text: str, colour: str) -> None: ...
    def write(self, x: float, y: float, text: str, colour: str, anchor: str) -> None: ...
    def keep_off(self, at: Point, r: float) -> None: ...  # labels keep off
