"""The picture of a machine: what every card draws of itself, and the columns that move it.

A drawing is a list of shapes in body frames. A place is [body, x, y, z] in the axes of that body; a body's pose is
a set of channels: x, y, angle in a planar scene, x, y, z and the rotation matrix by rows in space. Shapes may
name further channels (a current, a force) that change them. Nothing here is drawn: a page or a film does that
(outputs/glyphs/, outputs/film.py, outputs/web/machine.js) from plain data:

    {"planar": bool, "meshes": [readers/surface.py], "bodies": [{"name", "at": ["#channel" or number, ...], "aside": m}],
     "shapes": [{"kind", ...}], "view": {...}}
"""

from __future__ import annotations

from ..diagnostics import deck_error
from ..opened import as_read
from .arranged import arrange
from .outputs import Output
from .tree import GROUND

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import Any

    from ..cards.base import Card, Scalar
    from ..readers.surface import Surface
    from .mechanism import Mechanism
    from .scene import JointState

    Place = list[float]

WHEEL = 0.1  # distance of shafts that are drawn beside one another [m]


def traced(name: str, points: Iterable[str]) -> None:
    """Raises DeckError where the point to trace is none of those that there are."""
    there = list(points)
    if name not in there:
        hint = f"there are {', '.join(there)}" if there else None
        deck_error("E356", f"no point to trace is called `{name}`", hint=hint)


class Drawing:
    """Collects shapes; cards draw on it in `glyph(draw)`. Lengths in m, angles in rad."""

    def __init__(self, m: Mechanism) -> None:
        self.m = m
        self.channels: list[Output] = []
        self.shapes: list[dict[str, Any]] = []
        self.meshes: list[Surface] = []
        self.planar = not _spatial(m)
        self._index: dict[str, int] = {}
        self.beside = _side_by_side(m)
        self.names = [GROUND, *m.bodies]
        self.bodies = [
            {"name": name, "at": self._pose(name), "aside": self.beside.get(name, 0.0)} for name in self.names
        ]
        self._attached: dict[str, list[tuple[float, ...]]] = {name: [] for name in self.names}
        for joint in m.joints.values():
            self._attached[joint.a].append(joint.pa)
            self._attached[joint.b].append(joint.pb)
        for body, local in m.points.values():
            self._attached[body].append(local)

    # what cards ask for -----------------------------------------------------------------------------------

    def channel(self, name: str, unit: str, value: Scalar) -> str | float:
        """`#k` for the k-th channel, which carries a value, or the value itself where it does not change."""
        if name in self._index:
            return f"#{self._index[name]}"
        moving = self.m.public(value)
        if moving.value is not None:
            return moving.value
        self._index[name] = len(self.channels)
        self.channels.append(Output(name, unit, moving))
        return f"#{self._index[name]}"

    def on(self, body: str, local: Sequence[float] = (0.0, 0.0, 0.0)) -> Place:
        """A place on a body."""
        return [self.names.index(body), *(*local, 0.0, 0.0, 0.0)[:3]]

    def terminal(self, card: Card, label: str) -> Place:
        """The place that a point terminal of a card names."""
        ref = next(ref for name, _, ref in card.terminals if name == label)
        local = None if ref.point is None else tuple(float(v) for v in ref.point)
        found = self.m.locate(ref.name, local)
        assert found is not None
        body, at = found
        if body in self._attached:
            self._attached[body].append(tuple(at))
        return self.on(body, at)

    def ends(self, joint: str) -> tuple[Place, Place]:
        """Where a joint sits on its two bodies."""
        j = self.m.joints[joint]
        return self.on(j.a, j.pa), self.on(j.b, j.pb)

    def joint(self, name: str) -> dict[str, Any]:
        """What a shape on a joint needs: places, kind, axis in A, coordinate."""
        j = self.m.joints[name]
        a, b = self.ends(name)
        a[1] += self.beside.get(j.b, 0.0) if j.a == GROUND else 0.0
        found: dict[str, Any] = {
            "a": a,
            "b": b,
            "joint": j.kind.drawn,
            "sort": j.kind.name,
            "axis": list(j.card.direction),
        }
        if lead := getattr(j.kind, "lead", None):
            found["lead"] = as_read(lead)
        if j.qs:
            found["q"] = self._coordinate(j)
            found["zero"] = j.card.zeros[0] if j.card.zeros else 0.0
        return found

    def attached(self, body: str) -> list[Place]:
        """Places where something is fastened to a body, each once."""
        places: list[Place] = []
        for local in self._attached[body]:
            if (place := self.on(body, local)) not in places:
                places.append(place)
        return places

    def wheel(self, body: str) -> float:
        """The room of a body that is an inertia on a shaft and nothing more [m], else 0."""
        return WHEEL if body in self.beside else 0.0

    def mesh(self, file: str, metres: float = 1.0) -> tuple[int, list[list[float]]]:
        """The number of a file's surface in the drawing, and its lowest and highest coordinates [m]."""
        self.meshes.append(self.m.ctx.flat.meshes[file].scaled(metres))
        return len(self.meshes) - 1, self.meshes[-1].box()

    def add(self, kind: str, card: Card, **what: Any) -> None:
        """One shape; `card` names it on the page and in its line of the deck."""
        self.shapes.append({"kind": kind, "card": card.spec.word, "name": card.name, **what})

    def arrange(self) -> None:
        """What shapes must know of each other."""
        for s in self.shapes:
            if s["kind"] == "bones":
                s["to"] = self.attached(self.names[int(s["at"][0])])
        arrange(self.shapes)

    # the whole --------------------------------------------------------------------------------------------

    def data(self) -> dict[str, Any]:
        view: dict[str, Any] = {}
        for items in self.m.ctx.flat.views:
            view.update(items)
        points = [{"name": name, "at": self.on(*where)} for name, where in self.m.points.items()]
        points += [{"name": f"{n}.com", "at": self.on(n, b.centre)} for n, b in self.m.bodies.items() if b.m]
        if view.get("trace"):
            traced(view["trace"], [str(p["name"]) for p in points])
        return {
            "planar": self.planar, "bodies": self.bodies, "shapes": self.shapes, "points": points, "view": view,
            "gravity": list(self.m.gravity), "meshes": self.meshes,
            "channels": [{"name": c.name, "unit": c.unit} for c in self.channels],
        }  # fmt: skip

    def _pose(self, name: str) -> list[str | float]:
        frame = self.m.frames[name]
        origin = frame.point((0.0, 0.0, 0.0)).pos
        if self.planar:
            angle = frame.rot.about_z()
            x = origin[0] + self.beside.get(name, 0.0)
            parts = [("x", "m", x), ("y", "m", origin[1]), ("angle", "rad", 0.0 if angle is None else angle)]
        else:
            matrix = frame.rot.matrix()
            parts = [(axis, "m", e) for axis, e in zip("xyz", origin, strict=True)]
            parts += [(f"r{i}{j}", "", matrix[i][j]) for i in range(3) for j in range(3)]
        return [self.channel(f"{word}({name})", unit, value) for word, unit, value in parts]

    def _coordinate(self, j: JointState) -> str | float:
        c = j.kind.coordinates[0]
        return self.channel(f"{c.word}({j.name})", c.unit, j.q)


def _spatial(m: Mechanism) -> bool:
    return bool(m.gravity[2]) or any(j.kind.leaves_plane() for j in m.joints.values())


def _side_by_side(m: Mechanism) -> dict[str, float]:
    """Shafts of a drive train all turn about one point: bodies without a shape that are pinned there, to ground or
    to one another, are drawn beside one another, this far to the right [m]."""
    found: dict[str, float] = {}
    placed = set(_meshing(m))
    for j in m.joints.values():
        body = m.bodies.get(j.b)
        if (
            body is None
            or body.shape is not None
            or j.b in placed
            or j.kind.carries != "turn"
            or any((*body.centre, *j.pa, *j.pb))
        ):
            continue
        if j.a == GROUND or j.a in found:
            found[j.b] = len(found) * WHEEL
    return found


def _meshing(m: Mechanism) -> Iterator[str]:
    """Bodies that mesh where they are: on gears whose shafts stand apart on one carrier."""
    for card in m.active:
        if card.spec.word == "GEAR":
            a, b = (m.joints[ref.name] for _, _, ref in card.terminals)
            if a.a == b.a and a.pa != b.pa and a.kind.carries == b.kind.carries == "turn":
                yield from (a.b, b.b)


def draw(m: Mechanism) -> Drawing:
    """Every card's glyph, bodies first so that joints and couplings lie above them."""
    drawing = Drawing(m)
    for card in m.active:
        if card.drawn:
            card.glyph(drawing)
    drawing.arrange()
    return drawing
