"""URDF: links and joints of a robot description (ROS; the format as wiki.ros.org/urdf/XML describes it).

A link's frame is that of the joint above it. `rpy` are turns about the fixed axes x, y, z, so R = Rz Ry Rx. The root link is
fixed to the ground unless the robot is to be free. A planar joint is two slides and a pin.
"""

from __future__ import annotations

from math import inf
from os.path import dirname

import numpy as np

from ..diagnostics import suggest
from . import geometry, meshes
from .geometry import Mass, Pose, about
from .model import Actuator, Joint, Link, Robot, Solid, Tie
from .xml import Words

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..diagnostics import Sink
    from .geometry import Array
    from .xml import Element

X, Y, Z = np.eye(3)
WORDS = {
    "robot": Words("name", "version", "link joint transmission material gazebo ros2_control sensor"),
    "link": Words("name", "type", "inertial visual collision sensor"),
    "inertial": Words("", "", "origin mass inertia"),
    "origin": Words("xyz rpy"),
    "mass": Words("value"),
    "inertia": Words("ixx ixy ixz iyy iyz izz"),
    "visual": Words("", "name", "origin geometry material"),
    "collision": Words("", "name", "origin geometry verbose contact_coefficients"),
    "geometry": Words("", "", "box cylinder sphere capsule mesh"),
    "box": Words("size"),
    "cylinder": Words("radius length"),
    "capsule": Words("radius length"),
    "sphere": Words("radius"),
    "mesh": Words("filename scale"),
    "joint": Words(
        "name type", "", "origin parent child axis limit dynamics mimic calibration safety_controller"
    ),
    "parent": Words("link"),
    "child": Words("link"),
    "axis": Words("xyz"),
    "limit": Words("lower upper effort", "velocity acceleration deceleration jerk"),
    "dynamics": Words("damping friction"),
    "mimic": Words("joint multiplier offset"),
}
KINDS = {
    "revolute": "pin", "continuous": "pin", "prismatic": "slide", "floating": "free", "planar": "planar", "fixed": "",
}  # fmt: skip


class Options:
    """`free`: the root link is on no joint. `density` [kg/m^3]: of links without <inertial>, by their collision shapes.
    `key`: the keyframe to start at. `looks`: with shapes, for pictures. `contacts`: geoms touch."""

    __slots__ = ("contacts", "density", "free", "key", "looks")

    def __init__(
        self,
        free: bool = False,
        density: float | None = None,
        key: str | None = None,
        looks: bool = False,
        contacts: bool = False,
    ) -> None:
        self.free, self.density, self.key, self.looks, self.contacts = free, density, key, looks, contacts


def read(root: Element, options: Options, sink: Sink) -> Robot:
    """The robot of a file's root element; mistakes go to the sink."""
    return _Reader(root, options, sink).robot()


class _Reader:
    def __init__(self, root: Element, options: Options, sink: Sink) -> None:
        self.root, self.options, self.sink = root, options, sink
        self.found = Robot(root.get("name") or "robot", root.file.name, "URDF")
        self.beside = dirname(root.file.path or "")
        self.links = self._named("link")
        self.joints = self._named("joint")
        self.by_name: dict[str, Joint] = {}

    def robot(self) -> Robot:
        if any(child.tag.startswith("xacro:") for child in self.root.children):
            said = f"{self.root.file.name} is a macro file (xacro), not yet a robot"
            hint = "expand it first: xacro robot.urdf.xacro > robot.urdf"
            self.sink.error("E530", said, self.root.span, hint)
            return self.found
        WORDS["robot"].check(self.root, self.sink)
        below, base = self._tree()
        if base is None:
            return self.found
        order: list[tuple[Element, Element | None, Link | None]] = [(base, None, None)]
        for element, joint, parent in order:
            link = self._link(element, joint, parent)
            order += [(self.links[c], j, link) for j, c in below.get(element.get("name"), ())]
        self._mimics()
        self._transmissions()
        for tag in ("gazebo", "sensor"):
            if count := len([*self.root.all(tag)]):
                self.found.notes.append(f"{count} <{tag}>: not read")
        return self.found

    # the tree -----------------------------------------------------------------------------------------

    def _named(self, tag: str) -> dict[str, Element]:
        found: dict[str, Element] = {}
        for element in self.root.all(tag):
            WORDS[tag].check(element, self.sink)
            name = element.required("name", self.sink)
            if name in found:
                before = [(found[name].span, "the first one")]
                said = f"there are two <{tag}> named {name!r}"
                self.sink.error("E534", said, element.place("name"), labels=before)
            found[name] = element
        return found

    def _tree(self) -> tuple[dict[str, list[tuple[Element, str]]], Element | None]:
        """(joints and children by parent, root link); None where there is no tree."""
        below: dict[str, list[tuple[Element, str]]] = {}
        above: dict[str, tuple[Element, str]] = {}
        for joint in self.joints.values():
            ends = [self._end(joint, tag) for tag in ("parent", "child")]
            if not all(ends):
                continue
            parent, child = ends
            if child in above:
                first = above[child][0]
                said = (
                    f"link {child!r} is the child of two joints, {first.get('name')} and {joint.get('name')}"
                )
                hint = "URDF describes trees; close a loop in the deck with one more JOINT"
                self.sink.error("E535", said, joint.span, hint, labels=[(first.span, "the first one")])
                continue
            above[child] = (joint, parent)
            below.setdefault(parent, []).append((joint, child))
        if self.sink.has_errors:
            return below, None
        if not self.links:
            self.sink.error("E535", f"{self.root.file.name} has no <link>", self.root.span)
            return below, None
        roots = [name for name in self.links if name not in above]
        if len(roots) > 1:
            said = f"{len(roots)} links are nobody's child: {', '.join(roots[:5])}"
            hint = "one root is the robot's base; join the others to it, or delete what hangs on nothing"
            self.sink.error("E535", said, self.links[roots[1]].place("name"), hint)
            return below, None
        # in a cycle every link has a parent; a root may stand beside one
        reached = [*roots]
        for name in reached:
            reached += [child for _, child in below.get(name, ())]
        left = next((name for name in self.links if name not in reached), None)
        if left is not None:
            ring = _ring(left, above)
            said = f"links and joints go in a circle: {' -> '.join([*ring, ring[0]])}"
            hint = "URDF describes trees; close a loop in the deck with one more JOINT"
            self.sink.error("E535", said, above[ring[0]][0].span, hint)
            return below, None
        return below, self.links[roots[0]]

    def _end(self, joint: Element, tag: str) -> str:
        """The link at one end of a joint; "" after an error."""
        end = joint.one(tag)
        if end is None:
            self.sink.error("E533", f"joint {joint.get('name')!r} needs <{tag} link=>", joint.span)
            return ""
        name = end.required("link", self.sink)
        if name and name not in self.links:
            near = suggest(name, self.links)
            said = f"joint {joint.get('name')!r} names link {name!r}, and there is none"
            self.sink.error("E534", said, end.place("link"), f"did you mean {near}?" if near else None)
            return ""
        return name

    # links --------------------------------------------------------------------------------------------

    def _link(self, element: Element, joint: Element | None, parent: Link | None) -> Link:
        link = Link(
            element.get("name"), element.span, parent, Pose() if joint is None else self._origin(joint)
        )
        self.found.links.append(link)
        if joint is not None:
            self._joint(joint, link)
        elif not self.options.free:
            self.found.remarks.append(
                f"The base, {link.name}, is fixed to the ground; emsim import --free lets it go."
            )
        else:
            link.joints = [Joint(f"{link.name}_free", "free", element.span)]
        inertial = element.one("inertial")
        if inertial is not None:
            link.masses = [self._inertial(inertial)]
        for kind in ("visual", "collision"):
            for shape in element.all(kind):
                WORDS[kind].check(shape, self.sink)
                self._shape(shape, kind, link, weigh=kind == "collision" and inertial is None)
        if element.one("sensor") is not None:
            self.found.notes.append(f"<sensor> of {link.name}: not read")
        return link

    def _origin(self, element: Element) -> Pose:
        origin = element.one("origin")
        if origin is None:
            return Pose()
        WORDS["origin"].check(origin, self.sink)
        roll, pitch, yaw = origin.numbers("rpy", self.sink, (0.0, 0.0, 0.0), 3)
        turned = about(Z, yaw) @ about(Y, pitch) @ about(X, roll)
        return Pose(origin.numbers("xyz", self.sink, (0.0, 0.0, 0.0), 3), turned)

    def _inertial(self, element: Element) -> Mass:
        WORDS["inertial"].check(element, self.sink)
        mass, inertia = element.one("mass"), element.one("inertia")
        if mass is None:
            self.sink.error("E533", "<inertial> needs <mass value=>", element.span)
            return Mass()
        WORDS["mass"].check(mass, self.sink)
        mass.required("value", self.sink)
        m = mass.number("value", self.sink)
        if m < 0.0:
            self.sink.error("E536", f"a mass is {m:g} kg; it cannot be below 0", mass.place("value"))
        tensor = np.zeros((3, 3))
        if inertia is not None:
            WORDS["inertia"].check(inertia, self.sink)
            for i, a in enumerate("xyz"):
                inertia.required(f"i{a}{a}", self.sink)
                for k, b in enumerate("xyz"):
                    key = f"i{a}{b}" if i <= k else f"i{b}{a}"
                    tensor[i, k] = inertia.number(key, self.sink)
            check_tensor(tensor, inertia, self.sink)
        return Mass(m, (0.0, 0.0, 0.0), tensor).placed(self._origin(element))

    def _shape(self, element: Element, kind: str, link: Link, weigh: bool) -> None:
        """In words, and its mass where the link has no other and a density is given."""
        geometry_ = element.one("geometry")
        solid = geometry_.children[0] if geometry_ is not None and geometry_.children else None
        if geometry_ is None or solid is None:
            self.sink.error(
                "E533", f"<{kind}> of link {link.name!r} has no <geometry> with a shape", element.span
            )
            return
        WORDS["geometry"].check(geometry_, self.sink)
        if solid.tag not in WORDS or solid.tag not in WORDS["geometry"].inside:
            return
        WORDS[solid.tag].check(solid, self.sink)
        at = self._origin(element)
        sizes = " ".join(solid.attributes.values())
        link.shapes.append(f"{kind}: {solid.tag} {sizes}")
        if kind == "visual" and self.options.looks and (drawn := self._drawn(solid, at)) is not None:
            link.solids.append(drawn)
        if weigh and self.options.density is not None and (one := self._solid(solid)) is not None:
            link.masses.append(one.times(self.options.density).placed(at))

    def _drawn(self, solid: Element, at: Pose) -> Solid | None:
        """None of a mesh."""
        if solid.tag == "box":
            return Solid("box", [0.5 * v for v in solid.numbers("size", self.sink, (), 3)], at)
        r, h = solid.number("radius", self.sink), 0.5 * solid.number("length", self.sink)
        if solid.tag == "sphere":
            return Solid("ball", [r], at)
        return None if solid.tag == "mesh" else Solid("rod", [r, h], at)

    def _solid(self, solid: Element) -> Mass | None:
        """Of density 1."""
        if solid.tag == "mesh":
            name, place = solid.required("filename", self.sink), solid.place("filename")
            scale = solid.numbers("scale", self.sink, (1.0, 1.0, 1.0), 3)
            found = meshes.triangles(name, self.beside, scale, place, self.sink)
            return None if found is None else meshes.mass(found, name, place, self.sink)
        if solid.tag == "box":
            solid.required("size", self.sink)
            return geometry.box(*(0.5 * v for v in solid.numbers("size", self.sink, (), 3)))
        solid.required("radius", self.sink)
        r, h = solid.number("radius", self.sink), 0.5 * solid.number("length", self.sink)
        if solid.tag == "sphere":
            return geometry.ellipsoid(r, r, r)
        solid.required("length", self.sink)
        return geometry.cylinder(r, h) if solid.tag == "cylinder" else geometry.capsule(r, h)

    # joints -------------------------------------------------------------------------------------------

    def _joint(self, element: Element, link: Link) -> None:
        for child in element.children:
            if child.tag in WORDS and child.tag in ("parent", "child", "axis", "limit", "dynamics", "mimic"):
                WORDS[child.tag].check(child, self.sink)
        word, name = element.required("type", self.sink), element.get("name")
        if word and word not in KINDS:
            near = suggest(word, KINDS)
            said = f"joint {name!r} is of type {word!r}; there is {', '.join(KINDS)}"
            self.sink.error("E533", said, element.place("type"), f"did you mean {near}?" if near else None)
        kind = KINDS.get(word, "")
        if not kind:
            return
        axis = self._axis(element)
        if kind == "planar":
            link.joints = _planar(name, axis, element)
        else:
            link.joints = [Joint(name, kind, element.span)]
            link.joints[0].axis = axis
            self.by_name[name] = link.joints[0]
        dynamics, limit = element.one("dynamics"), element.one("limit")
        for joint in link.joints:
            if dynamics is not None:
                joint.damping = self._not_below_0(dynamics, "damping")
                joint.friction = self._not_below_0(dynamics, "friction")
            if limit is not None and joint.is_scalar and kind != "planar":
                self._limit(joint, limit, word)
        if limit is None and word in ("revolute", "prismatic"):
            said = f"{word} joint {name!r} needs <limit lower= upper= effort= velocity=>"
            self.sink.error("E533", said, element.span, "a joint without ends is of type continuous")
        for tag in ("calibration", "safety_controller"):
            if element.one(tag) is not None:
                self.found.notes.append(f"<{tag}> of {name}: not read")

    def _axis(self, element: Element) -> Array:
        axis = element.one("axis")
        found = X if axis is None else np.array(axis.numbers("xyz", self.sink, X, 3))
        length = float(np.linalg.norm(found))
        if not length:
            self.sink.error(
                "E533", f"the axis of joint {element.get('name')!r} has no direction", (axis or element).span
            )
            return X
        return np.asarray(found / length)

    def _not_below_0(self, element: Element, key: str) -> float:
        value = element.number(key, self.sink)
        if value < 0.0:
            said = f"{key} of <{element.tag}> is {value:g}; it cannot be below 0"
            self.sink.error("E533", said, element.place(key))
        return value

    def _limit(self, joint: Joint, limit: Element, word: str) -> None:
        effort = self._not_below_0(limit, "effort") if limit.has("effort") else 0.0
        joint.effort = effort or inf
        if word == "continuous":
            return
        joint.low, joint.high = limit.number("lower", self.sink), limit.number("upper", self.sink)
        if joint.low > joint.high:
            said = f"lower end {joint.low:g} of joint {joint.name!r} lies above its upper end {joint.high:g}"
            self.sink.error("E533", said, limit.place("lower"))
        elif joint.low == joint.high:
            said = f"joint {joint.name!r} has no way to go: both its ends are {joint.low:g}"
            hint = "give lower= and upper=; a joint that does not move is of type fixed"
            self.sink.error("E533", said, limit.span, hint)
        elif not joint.low <= 0.0 <= joint.high:
            joint.start = [0.5 * (joint.low + joint.high)]
            joint.note = "0 lies outside of its ends: it starts amid them"

    def _mimics(self) -> None:
        for name, element in self.joints.items():
            mimic = element.one("mimic")
            if mimic is None or name not in self.by_name:
                continue
            leader = mimic.required("joint", self.sink)
            if leader not in self.by_name or leader == name:
                near = suggest(leader, [n for n in self.by_name if n != name])
                said = f"joint {name!r} is to move as {leader!r}, which is no other joint that moves"
                self.sink.error("E534", said, mimic.place("joint"), f"did you mean {near}?" if near else None)
                continue
            ratio = mimic.number("multiplier", self.sink, 1.0)
            if ratio == 0.0:
                said = f"joint {name!r} is to move as 0 times {leader!r}"
                self.sink.error(
                    "E533", said, mimic.place("multiplier"), "a joint that does not move is of type fixed"
                )
                continue
            follower = self.by_name[name]
            follower.tied = True
            series = [mimic.number("offset", self.sink), ratio]
            self.found.ties.append(Tie(f"{name}_mimic", follower, self.by_name[leader], series, mimic.span))
        for tie in self.found.ties:
            if tie.leader.tied and self._goes_round(tie):
                said = f"joints mimic each other in a circle: {tie.follower.name}, {tie.leader.name}"
                self.sink.error("E535", said, tie.span)

    def _goes_round(self, tie: Tie) -> bool:
        leaders = {t.follower: t.leader for t in self.found.ties}
        joint: Joint | None = tie.leader
        for _ in leaders:
            if joint is tie.follower:
                return True
            joint = leaders.get(joint) if joint is not None else None
        return False

    # what drives --------------------------------------------------------------------------------------

    def _transmissions(self) -> None:
        """An input for every joint that a <transmission> or an effort command of <ros2_control> moves."""
        driven: dict[str, float] = {}
        for element in self.root.all("transmission"):
            driven.update(self._transmission(element))
        for control in self.root.all("ros2_control"):
            for joint in control.all("joint"):
                commands = [c.get("name") for c in joint.all("command_interface")]
                if "effort" in commands:
                    driven.setdefault(self._moving(joint.get("name"), joint), 1.0)
                elif commands:
                    self.found.notes.append(
                        f"<ros2_control> of {joint.get('name')}: commands {', '.join(commands)}, no effort"
                    )
        for name, ratio in driven.items():
            if not name:
                continue
            moved = self.by_name[name]
            actuator = Actuator(f"{name}_motor", [(moved, ratio)], moved.span)
            if moved.effort < inf:
                actuator.forces = (-moved.effort / abs(ratio), moved.effort / abs(ratio))
            actuator.note = "1 V is 1 N m" if moved.turns else "1 V is 1 N"
            self.found.actuators.append(actuator)

    def _transmission(self, element: Element) -> Iterator[tuple[str, float]]:
        type_ = element.one("type")
        word = (type_.text if type_ is not None else element.get("type")).strip().rpartition("/")[2]
        joints, actuators = [*element.all("joint")], [*element.all("actuator")]
        if len(joints) != 1 or len(actuators) > 1 or (word and word != "SimpleTransmission"):
            said = f"transmission {element.get('name')!r} ({word or 'without a type'}) is not read: only SimpleTransmission is"
            self.sink.error(
                "E532", said, element.span, "delete it, and write its gears as GEAR or RATIO in the deck"
            )
            return
        places = [
            p for e in (*joints, *actuators, element) if (p := e.one("mechanicalReduction")) is not None
        ]
        ratio = 1.0
        if places:
            words = places[0].text.split()
            value = float(words[0]) if len(words) == 1 and _is_number(words[0]) else 0.0
            if not value:
                said = f"<mechanicalReduction> is a number other than 0, not {places[0].text.strip()!r}"
                self.sink.error("E533", said, places[0].span)
            ratio = value or 1.0
        yield self._moving(joints[0].get("name"), joints[0]), ratio

    def _moving(self, name: str, element: Element) -> str:
        """A joint that moves along one coordinate; "" after an error."""
        joint = self.by_name.get(name)
        if joint is None or not joint.is_scalar:
            near = suggest(name, self.by_name)
            said = f"{name!r} is no joint that a motor could move"
            self.sink.error("E534", said, element.span, f"did you mean {near}?" if near else None)
            return ""
        return name


def _ring(name: str, above: dict[str, tuple[Element, str]]) -> list[str]:
    """The circle that the way up from a link ends in."""
    way = [name]
    while (name := above[name][1]) not in way:
        way.append(name)
    return way[way.index(name) :][::-1]


def _planar(name: str, axis: Array, element: Element) -> list[Joint]:
    """Two slides across an axis and a pin about it."""
    # the coordinate axis of which it has least is surely not along it
    across = np.cross(np.eye(3)[int(np.argmin(np.abs(axis)))], axis)
    across /= np.linalg.norm(across)
    if abs(axis[2]) == 1.0:
        across = X
    ways = [("x", "slide", across), ("y", "slide", np.cross(axis, across)), ("turn", "pin", axis)]
    found = []
    for word, kind, direction in ways:
        joint = Joint(f"{name}_{word}", kind, element.span)
        joint.axis = direction
        found.append(joint)
    return found


def _is_number(word: str) -> bool:
    from .xml import number_of

    return number_of(word) is not None


def check_tensor(tensor: Array, element: Element, sink: Sink) -> None:
    """E536 where kinetic energy could be negative, W536 where no body has such an inertia."""
    positive, possible = geometry.is_possible(tensor)
    if not positive:
        sink.error("E536", "with this inertia kinetic energy could be negative", element.span)
    elif not possible:
        said = "no rigid body has this inertia: one principal moment is larger than the sum of the others"
        sink.warning("W536", said, element.span, "it is taken as it stands")
