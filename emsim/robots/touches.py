"""What touches in an MJCF file: pairs of geoms, with the friction that MuJoCo gives them (XMLreference, contact; Computation,
contact parameters).

Two geoms touch where contype of one meets conaffinity of the other, of bodies that move against each other, but for a body and
what it hangs on. The geom of the higher priority says how it rubs, else the larger of both numbers counts. condim: 1
smooth, 3 rubs, 4 resists drilling too, 6 rolling too. What gives way there is rigid here, and nothing bounces.
"""

from __future__ import annotations

from math import pi

from ..cards import hulls
from . import geometry
from .geometry import Pose
from .mjcf_words import MAIN, WORDS
from .model import Contact, Touch

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from .mjcf_geoms import Geom, Scale
    from .mjcf_words import Classes
    from .model import Link
    from .xml import Element

FRICTION = (1.0, 0.005, 0.0001)  # sliding, drilling, rolling (XMLreference, geom/friction)
SHOULD = (
    "emsim import --contacts writes a SHAPE for each and a CONTACT for each pair; or write a STOP in the deck"
)


class Toucher:
    """A geom that may touch."""

    __slots__ = ("geom", "link", "name")

    def __init__(self, name: str, link: Link, geom: Geom) -> None:
        self.name, self.link, self.geom = name, link, geom

    def meets(self, other: Toucher, scale: Scale) -> bool:
        def bits(t: Toucher, key: str) -> int:
            return int(t.geom.element.number(key, scale.sink, 1.0))

        return bool(
            bits(self, "contype") & bits(other, "conaffinity")
            or bits(other, "contype") & bits(self, "conaffinity")
        )


class Touches:
    """The pairs of a file."""

    def __init__(
        self, root: Element, geoms: Sequence[Toucher], scale: Scale, classes: Classes, off: set[str]
    ) -> None:
        self.geoms, self.scale, self.sink = geoms, scale, scale.sink
        self.parents_touch = "filterparent" in off
        children = [e for group in root.all("contact") for e in group.children]
        self.named = [classes.fill(e, MAIN) for e in children if e.tag == "pair"]
        self.apart = {frozenset((e.get("body1"), e.get("body2"))) for e in children if e.tag == "exclude"}
        for element in children:
            if element.tag != "pair":
                WORDS[element.tag].check(element, self.sink)
        self.shapes: dict[Toucher, Touch | None] = {}

    def pairs(self) -> Iterator[tuple[Toucher, Toucher]]:
        """Those that find each other."""
        said = {frozenset((e.get("geom1"), e.get("geom2"))) for e in self.named}
        for k, one in enumerate(self.geoms):
            for other in self.geoms[:k]:
                near, far = one.link.carrier, other.link.carrier
                # a body does not touch what it hangs on, the ground excepted
                hangs = near is not None and far is not None and (_below(near) is far or _below(far) is near)
                kept = frozenset((one.link.name, other.link.name)) in self.apart
                named = frozenset((one.name, other.name)) in said
                if (
                    near is not far
                    and not (hangs and not self.parents_touch)
                    and not kept
                    and not named
                    and one.meets(other, self.scale)
                ):
                    yield other, one

    def contacts(self) -> Iterator[Contact]:
        """Each with its shapes; errors go to the sink."""
        for other, one in self.pairs():
            yield from self._contact("", other, one, self._friction(other, one))
        known = {t.name: t for t in self.geoms}
        for element in self.named:
            ends = [known.get(element.get(key)) for key in ("geom1", "geom2")]
            numbers = element.numbers("friction", self.sink, (1.0, 1.0, 0.005, 0.0001, 0.0001))
            condim = int(element.number("condim", self.sink, 3.0))
            for key, end in zip(("geom1", "geom2"), ends, strict=True):
                if end is None:
                    said = f"there is no <geom> named {element.get(key)!r}"
                    self.sink.error("E534", said, element.place(key) if element.has(key) else element.span)
            if numbers[0] != numbers[1 % len(numbers)] or numbers[-1] != numbers[-2 % len(numbers)]:
                said = "friction of <pair> that differs by direction is not imported"
                self.sink.error("E532", said, element.place("friction"))
            elif ends[0] is not None and ends[1] is not None:
                three = (numbers[0], *numbers[2:4], *FRICTION[1:])[:3]
                yield from self._contact(element.get("name"), ends[0], ends[1], _resists(condim, three))

    def _contact(
        self, name: str, one: Toucher, other: Toucher, resists: Sequence[float]
    ) -> Iterator[Contact]:
        shapes = [self._shape(t) for t in (one, other)]
        if shapes[0] is not None and shapes[1] is not None:
            yield Contact(name or f"{shapes[0].name}_{shapes[1].name}", shapes[0], shapes[1], resists)

    def _friction(self, one: Toucher, other: Toucher) -> Sequence[float]:
        sink = self.sink
        elements = [t.geom.element for t in (one, other)]
        first, second = (int(e.number("priority", sink)) for e in elements)
        if first != second:
            elements = [elements[first < second]]
        condim = max(int(e.number("condim", sink, 3.0)) for e in elements)
        given = [(*e.numbers("friction", sink, FRICTION), *FRICTION)[:3] for e in elements]
        return _resists(condim, [max(values) for values in zip(*given, strict=True)])

    def _shape(self, t: Toucher) -> Touch | None:
        if t not in self.shapes:
            found = self._written(t.geom)
            name = t.geom.element.get("name") or f"{t.link.name}_{t.geom.kind}"
            self.shapes[t] = None if found is None else Touch(name, t.link, *found)
        return self.shapes[t]

    def _written(self, geom: Geom) -> tuple[str, Sequence[float], Pose] | None:
        """As the fourth word of SHAPE, and where it is in its body; None after an error."""
        e = geom.element
        if geom.kind == "plane":
            return "plane", (0.0, 0.0, 1.0), geom.place
        if geom.kind == "mesh":
            corners = self._corners(geom)
            return None if corners is None else ("hull", corners, geom.place)
        if geom.kind == "hfield" or e.has("mesh"):
            said = f"contacts of a <geom> of type {geom.kind!r}{' fitted to a mesh' * e.has('mesh')} are not imported"
            self.sink.error("E532", said, e.place("type"), 'give it contype="0" conaffinity="0"')
            return None
        found = self.scale.sizes(geom)
        if found is None:
            return None
        size, place = found
        if geom.kind == "capsule":  # which begins at the origin, along x
            along = Pose((0.0, 0.0, -size[1]), geometry.about((0.0, 1.0, 0.0), -0.5 * pi))
            return "capsule", (2.0 * size[1], size[0]), place.then(along)
        words = {"sphere": "ball", "box": "box", "cylinder": "cylinder", "ellipsoid": "ellipsoid"}
        numbers = {"box": [2.0 * v for v in size], "cylinder": [size[0], 2.0 * size[-1]]}
        return words[geom.kind], numbers.get(geom.kind, size), place

    def _corners(self, geom: Geom) -> Sequence[float] | None:
        """Of the hull of its mesh."""
        from scipy.spatial import ConvexHull, QhullError

        read = self.scale.triangles(geom)
        if read is None:
            return None
        points, file, at = read[0].reshape(-1, 3), *read[1:]
        try:
            corners = points[ConvexHull(points).vertices]
        except QhullError:
            self.sink.error("E537", f"{file} has no volume: nothing touches it", at)
            return None
        if len(corners) > hulls.MOST:
            said = (
                f"the hull of {file} has {len(corners)} corners: contacts of up to {hulls.MOST} are imported"
            )
            hint = "give the geom a mesh of fewer, a box or a capsule, for what touches"
            self.sink.error("E532", said, at, hint)
            return None
        return [float(v) for v in corners.ravel()]


def _resists(condim: int, friction: Sequence[float]) -> Sequence[float]:
    """Sliding, drilling, rolling."""
    counts = {1: 0, 3: 1, 4: 2, 6: 3}.get(condim, 1)
    return [v if k < counts else 0.0 for k, v in enumerate(friction)]


def _below(link: Link) -> Link | None:
    """What it hangs on."""
    return None if link.parent is None else link.parent.carrier
