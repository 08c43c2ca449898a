"""MJCF: the bodies, joints, geoms and sites of a model of MuJoCo's. Tendons, actuators and equalities: mjcf_drives.py.

Angles are degrees unless the compiler says otherwise, of keyframes always radians. A body without <inertial> weighs what its
geoms do. A hinge turns about its axis through its point by q - ref; several joints of a body follow each other.
"""

from __future__ import annotations

from math import inf, radians
from os.path import basename, dirname, join, realpath, splitext

import numpy as np

from ..source import load
from . import geometry
from .geometry import Mass, Pose, about, together
from .mjcf_drives import Drives
from .mjcf_geoms import Geom, Scale
from .mjcf_words import MAIN, UNUSED, WORDS, Classes
from .model import Joint, Link, Robot
from .touches import SHOULD, Toucher, Touches
from .urdf import check_tensor
from .xml import parse

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .mjcf_words import Filled
    from .urdf import Options
    from .xml import Element

KINDS = {"hinge": "pin", "slide": "slide", "ball": "ball", "free": "free"}
AXES = dict(zip("xyz", np.eye(3), strict=True))


def read(root: Element, options: Options, sink: Sink) -> Robot:
    """The robot of a file's root element; mistakes go to the sink."""
    _include(root, root, {realpath(root.file.path or root.file.name)}, sink)
    return _Reader(root, options, sink).robot()


def _include(element: Element, root: Element, seen: set[str], sink: Sink) -> None:
    """Puts the content of included files where <include> stands."""
    found: list[Element] = []
    for child in element.children:
        if child.tag != "include":
            _include(child, root, seen, sink)
            found.append(child)
            continue
        path = join(dirname(root.file.path or ""), child.required("file", sink))
        if realpath(path) in seen:
            sink.error("E535", f"{path} is included twice", child.place("file"))
            continue
        seen.add(realpath(path))
        try:
            inner = parse(load(path, child.span))
        except (OSError, ValueError) as error:
            sink.error("E537", f"{path}: {getattr(error, 'strerror', None) or error}", child.place("file"))
            continue
        _include(inner, root, seen, sink)
        found += inner.children
    element.children = found


class Rules:
    """What <compiler> and <option> say."""

    def __init__(self, root: Element, sink: Sink) -> None:
        self.sink = sink
        self.degrees, self.autolimits, self.sequence = True, True, "xyz"
        self.meshes, self.from_geoms, self.total = "", "auto", -1.0
        self.balance, self.least_mass, self.least_inertia, self.groups = False, 0.0, 0.0, (0.0, 5.0)
        self.gravity, self.step, self.off = [0.0, 0.0, -9.81], 0.002, set()  # type: list[float], float, set[str]
        for element in root.all("compiler"):
            self._compiler(element)
        for element in root.all("option"):
            self._option(element)
        if "gravity" in self.off:
            self.gravity = [0.0, 0.0, 0.0]

    def _compiler(self, e: Element) -> None:
        WORDS["compiler"].check(e, self.sink)
        self._one_of(e, "angle", "degree", "radian")
        self._one_of(e, "coordinate", "local")
        self._one_of(e, "inertiafromgeom", "auto", "true", "false")
        self.degrees = e.get("angle", "degree") == "degree" if e.has("angle") else self.degrees
        self.autolimits = e.flag("autolimits", self.sink, self.autolimits)
        self.sequence = e.get("eulerseq", self.sequence)
        if len(self.sequence) != 3 or set(self.sequence.lower()) - set("xyz"):
            self.sink.error(
                "E533", f"eulerseq is three of x y z X Y Z, not {self.sequence!r}", e.place("eulerseq")
            )
            self.sequence = "xyz"
        self.meshes = e.get("meshdir") or e.get("assetdir") or self.meshes
        self.from_geoms = e.get("inertiafromgeom", self.from_geoms)
        self.total = e.number("settotalmass", self.sink, self.total)
        self.balance = e.flag("balanceinertia", self.sink, self.balance)
        self.least_mass = e.number("boundmass", self.sink, self.least_mass)
        self.least_inertia = e.number("boundinertia", self.sink, self.least_inertia)
        low, high = e.numbers("inertiagrouprange", self.sink, self.groups, 2)
        self.groups = (low, high)

    def _one_of(self, e: Element, key: str, *words: str) -> None:
        if e.has(key) and e.get(key) not in words:
            said = f"{key} of <{e.tag}> is {' or '.join(words)}, not {e.get(key)!r}"
            self.sink.error("E532", said, e.place(key))

    def _option(self, e: Element) -> None:
        WORDS["option"].check(e, self.sink)
        self.gravity = e.numbers("gravity", self.sink, self.gravity, 3)
        self.step = e.number("timestep", self.sink, self.step)
        for key in ("density", "viscosity"):
            if e.number(key, self.sink):
                said = f"{key} of the medium: what flows round bodies is not imported"
                self.sink.error(
                    "E532", said, e.place(key), "delete it, and write DAMPER or FORCE in the deck"
                )
        for flag in e.all("flag"):
            WORDS["flag"].check(flag, self.sink)
            self.off |= {key for key in flag.attributes if flag.get(key) == "disable"}

    def angle(self, value: float) -> float:
        return radians(value) if self.degrees else value

    def turned(self, e: Element) -> geometry.Array:
        """The rotation that one of quat, axisangle, xyaxes, zaxis, euler says."""
        sink = self.sink
        given = [key for key in ("quat", "axisangle", "xyaxes", "zaxis", "euler") if e.has(key)]
        if len(given) > 1:
            said = f"<{e.tag}> has {given[0]} and {given[1]}: each says how it stands"
            sink.error("E533", said, e.place(given[1]))
        if not given:
            return geometry.UNIT
        if given[0] == "euler":
            return self._euler(e.numbers("euler", sink, (0.0,) * 3, 3))
        count = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3}[given[0]]
        values = np.array(e.numbers(given[0], sink, (), count))
        if len(values) != count or not _has_direction(given[0], values):
            sink.error("E533", f"{given[0]} of <{e.tag}> has no direction", e.place(given[0]))
            return geometry.UNIT
        if given[0] == "quat":
            return geometry.by_quaternion(values)
        if given[0] == "axisangle":
            return about(values[:3] / np.linalg.norm(values[:3]), self.angle(values[3]))
        if given[0] == "xyaxes":
            x = values[:3] / np.linalg.norm(values[:3])
            y = values[3:] - (values[3:] @ x) * x
            y /= np.linalg.norm(y)
            return np.column_stack([x, y, np.cross(x, y)])
        # the least turn that takes z there
        z = values / np.linalg.norm(values)
        axis = np.cross(AXES["z"], z)
        size = float(np.linalg.norm(axis))
        return about(axis / size if size else AXES["x"], float(np.arctan2(size, z[2])))

    def _euler(self, angles: list[float]) -> geometry.Array:
        """Turns one after the other: of lower case about the moved axes, of upper case about the fixed ones."""
        found = geometry.UNIT
        for letter, angle in zip(self.sequence, angles, strict=True):
            turn = about(AXES[letter.lower()], self.angle(angle))
            found = found @ turn if letter.islower() else turn @ found
        return found

    def pose(self, e: Element) -> Pose:
        return Pose(e.numbers("pos", self.sink, (0.0,) * 3, 3), self.turned(e))

    def limited(self, e: Element, word: str, range_: str) -> bool:
        said = e.get(word, "auto")
        if said not in ("true", "false", "auto"):
            self.sink.error(
                "E533", f"{word} of <{e.tag}> is true, false or auto, not {said!r}", e.place(word)
            )
        if said == "true" and not e.has(range_):
            self.sink.error("E533", f"<{e.tag}> is limited and has no {range_}=", e.place(word))
        if said == "auto" and e.has(range_) and not self.autolimits:
            said = f"{range_} of <{e.tag}> without {word}=, where autolimits is false, says nothing certain"
            self.sink.error("E533", said, e.place(range_), f'write {word}="true" or {word}="false"')
        return e.has(range_) and said != "false"


def _has_direction(word: str, v: geometry.Array) -> bool:
    if word == "xyaxes":
        return bool(np.linalg.norm(np.cross(v[:3], v[3:])))
    return bool(np.linalg.norm(v[:3] if word == "axisangle" else v))


class _Reader:
    def __init__(self, root: Element, options: Options, sink: Sink) -> None:
        self.root, self.options, self.sink = root, options, sink
        WORDS["mujoco"].check(root, sink)
        self.rules = Rules(root, sink)
        self.classes = Classes(root, sink)
        self.found = Robot(root.get("model") or "MuJoCo model", root.file.name, "MJCF")
        self.found.gravity = self.rules.gravity
        self.by_name: dict[str, dict[str, object]] = {"body": {}, "joint": {}, "geom": {}, "site": {}}
        self.meshes = {
            _mesh_name(e): self.classes.fill(e, MAIN) for a in root.all("asset") for e in a.all("mesh")
        }
        self.inertial: dict[Link, Mass] = {}
        self.geoms: dict[Link, list[Geom]] = {}
        self.touching: list[Toucher] = []

    def robot(self) -> Robot:
        world = Link("world", self.root.span)
        self.found.links.append(world)
        self.by_name["body"]["world"] = world
        for element in self.root.all("worldbody"):
            WORDS["worldbody"].check(element, self.sink)
            self._contents(element, world, Pose(), MAIN)
        self._masses()
        self._switched_off()
        Drives(self.root, self.found, self.rules, self.classes, self.by_name, self.sink).read()
        if not self.sink.has_errors:
            self._keyframe()
        self._touches()
        self._unused()
        return self.found

    def _name(self, kind: str, element: Element, thing: object, otherwise: str) -> str:
        """A name that is kept: E534 where it is taken."""
        name = element.get("name")
        if name in self.by_name[kind]:
            self.sink.error("E534", f"there are two of <{kind}> named {name!r}", element.place("name"))
        if name:
            self.by_name[kind][name] = thing
        return name or otherwise

    # bodies -------------------------------------------------------------------------------------------

    def _contents(self, element: Element, link: Link, at: Pose, around: str) -> None:
        """What stands in a body or in a frame of it, which is at `at` in the body."""
        for child in element.children:
            if child.tag == "body":
                self._body(child, link, at, around)
            elif child.tag == "frame":
                WORDS["frame"].check(child, self.sink)
                self._contents(
                    child, link, at.then(self.rules.pose(child)), child.get("childclass") or around
                )
            elif child.tag == "joint":
                self._joint(self.classes.fill(child, around), link, at)
            elif child.tag == "freejoint":
                WORDS["freejoint"].check(child, self.sink)
                self._free(child, link)
            elif child.tag == "geom":
                self._geom(self.classes.fill(child, around), link, at)
            elif child.tag == "site":
                site = self.classes.fill(child, around)
                name = self._name("site", child, (link, at.then(self.rules.pose(site)).p), "")
                if name:
                    link.points.append((name, at.then(self.rules.pose(site)).p))
            elif child.tag == "inertial":
                self.inertial[link] = self._inertial(child).placed(at)

    def _body(self, element: Element, parent: Link, at: Pose, around: str) -> None:
        WORDS["body"].check(element, self.sink)
        link = Link("", element.span, parent, at.then(self.rules.pose(element)))
        link.name = self._name("body", element, link, f"body{len(self.found.links)}")
        link.lifted = element.number("gravcomp", self.sink)
        if element.flag("mocap", self.sink):
            link.note = "moved by hand in MuJoCo (mocap), fixed here"
            self.found.notes.append(f"body {link.name}: {link.note}")
        self.found.links.append(link)
        self._contents(element, link, Pose(), element.get("childclass") or around)

    def _inertial(self, e: Element) -> Mass:
        WORDS["inertial"].check(e, self.sink)
        e.required("mass", self.sink)
        e.required("pos", self.sink)
        m = e.number("mass", self.sink)
        if m < 0.0:
            self.sink.error("E536", f"a mass is {m:g} kg; it cannot be below 0", e.place("mass"))
        tensor = np.zeros((3, 3))
        if e.has("fullinertia"):
            xx, yy, zz, xy, xz, yz = e.numbers("fullinertia", self.sink, (0.0,) * 6, 6)
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        elif e.has("diaginertia"):
            tensor = np.diag(e.numbers("diaginertia", self.sink, (0.0,) * 3, 3))
        check_tensor(tensor, e, self.sink)
        return Mass(m, (0.0, 0.0, 0.0), tensor).placed(self.rules.pose(e))

    def _scale(self) -> Scale:
        rules = self.rules
        return Scale(self.root, rules.meshes, rules.groups, self.meshes, self.sink)

    def _masses(self) -> None:
        """Which of <inertial> and geoms counts, and what the compiler does to it."""
        rules = self.rules
        scale = self._scale()
        for link in self.found.links[1:]:
            mass = self.inertial.get(link)
            if rules.from_geoms == "true" or (rules.from_geoms == "auto" and mass is None):
                mass = together(
                    [m for geom in self.geoms.get(link, []) if (m := scale.weigh(geom)) is not None]
                )
            link.masses = [self._bounded(mass or Mass())]
            if self.options.looks:
                drawn = [scale.drawn(geom) for geom in self.geoms.get(link, [])]
                link.solids = [solid for solid in drawn if solid is not None]
        if rules.total > 0.0:
            moving = [link for link in self.found.links[1:] if link.masses]
            total = sum(link.masses[0].m for link in moving)
            for link in moving:
                link.masses = [link.masses[0].times(rules.total / total)] if total else link.masses

    def _bounded(self, mass: Mass) -> Mass:
        rules = self.rules
        values, axes = np.linalg.eigh(mass.tensor)
        if rules.balance and values[2] > values[0] + values[1]:
            values = np.full(3, values.mean())
        elif not (rules.least_inertia and values[0] < rules.least_inertia):
            return Mass(max(mass.m, rules.least_mass), mass.centre, mass.tensor)
        values = np.maximum(values, rules.least_inertia)
        return Mass(max(mass.m, rules.least_mass), mass.centre, axes @ np.diag(values) @ axes.T)

    # joints -------------------------------------------------------------------------------------------

    def _free(self, element: Element, link: Link) -> None:
        joint = Joint("", "free", element.span)
        joint.name = self._name("joint", element, joint, f"{link.name}_free")
        self._add_joint(joint, link)

    def _add_joint(self, joint: Joint, link: Link) -> None:
        if link.parent is None:
            self.sink.error("E535", "the world has a joint: it does not move", joint.span)
            return
        if joint.kind == "free" and link.parent.parent is not None:
            said = f"body {link.name!r} is free and hangs on another one"
            self.sink.error("E535", said, joint.span, "only bodies of the world may be free")
        if link.joints and "free" in (joint.kind, link.joints[0].kind):
            self.sink.error("E535", f"body {link.name!r} is free and has one more joint", joint.span)
        link.joints.append(joint)

    def _joint(self, e: Filled, link: Link, at: Pose) -> None:
        word = e.get("type", "hinge")
        if word not in KINDS:
            said = f"a joint is of type {', '.join(KINDS)}, not {word!r}"
            self.sink.error("E533", said, e.place("type"))
            return
        joint = Joint("", KINDS[word], e.span)
        joint.name = self._name("joint", e, joint, f"{link.name}_joint{len(link.joints) + 1}")
        if joint.kind == "free":
            self._add_joint(joint, link)
            for key in ("damping", "armature", "frictionloss", "stiffness"):
                self._refuse(e, key, f"{key} of a free joint")
            return
        joint.point = at.then(Pose(e.numbers("pos", self.sink, (0.0,) * 3, 3))).p
        axis = np.array(e.numbers("axis", self.sink, (0.0, 0.0, 1.0), 3))
        if not np.linalg.norm(axis):
            self.sink.error("E533", f"the axis of joint {joint.name!r} has no direction", e.place("axis"))
            axis = AXES["z"]
        joint.axis = at.r @ (axis / np.linalg.norm(axis))
        for key in ("damping", "stiffness", "armature", "frictionloss"):
            if e.number(key, self.sink) < 0.0:
                self.sink.error("E533", f"{key} of <joint> cannot be below 0", e.place(key))
        joint.damping, joint.stiffness = e.number("damping", self.sink), e.number("stiffness", self.sink)
        joint.armature, joint.friction = e.number("armature", self.sink), e.number("frictionloss", self.sink)
        if joint.kind == "ball":
            for key in ("armature", "frictionloss", "stiffness"):
                self._refuse(e, key, f"{key} of a ball joint")
            if self.rules.limited(e, "limited", "range"):
                self.sink.error("E532", "the range of a ball joint is not imported", e.place("range"))
        else:
            self._along(e, joint)
        if any(e.numbers("springdamper", self.sink, (0.0, 0.0), 2)):
            hint = "write stiffness= and damping= in its place"
            self.sink.error("E532", "springdamper of <joint> is not imported", e.place("springdamper"), hint)
        if e.flag("actuatorgravcomp", self.sink) and link.lifted:
            self.sink.error("E532", "actuatorgravcomp is not imported", e.place("actuatorgravcomp"))
        self._add_joint(joint, link)

    def _refuse(self, e: Element, key: str, what: str) -> None:
        if e.number(key, self.sink):
            self.sink.error("E532", f"{what} is not imported", e.place(key))

    def _along(self, e: Filled, joint: Joint) -> None:
        """Reference, rest, ends and largest effort of a joint with one coordinate."""
        unit = self.rules.angle if joint.turns else float
        joint.ref, joint.rest = unit(e.number("ref", self.sink)), unit(e.number("springref", self.sink))
        if self.rules.limited(e, "limited", "range"):
            low, high = (unit(v) for v in e.numbers("range", self.sink, (0.0, 0.0), 2))
            if not low < high:
                self.sink.error(
                    "E533", f"range of joint {joint.name!r}: the lower end comes first", e.place("range")
                )
            joint.low, joint.high = low, high
            if not low <= joint.ref <= high:
                joint.start = [min(max(joint.ref, low), high)]
                joint.note = "its reference lies outside of its ends: it starts at the nearer one"
        if self.rules.limited(e, "actuatorfrclimited", "actuatorfrcrange"):
            low, high = e.numbers("actuatorfrcrange", self.sink, (-inf, inf), 2)
            if low != -high:
                said = "actuatorfrcrange of which one end is not minus the other is not imported"
                self.sink.error(
                    "E532", said, e.place("actuatorfrcrange"), "write forcerange= on the actuator"
                )
            joint.effort = high

    def _switched_off(self) -> None:
        """What <flag> disables."""
        off = self.rules.off
        for joint in self.found.joints():
            if off & {"limit", "constraint"}:
                joint.low, joint.high = -inf, inf
            if off & {"frictionloss", "constraint"}:
                joint.friction = 0.0
            if off & {"passive", "spring"}:
                joint.stiffness = 0.0
            if off & {"passive", "damper"}:
                joint.damping = 0.0

    def _geom(self, e: Filled, link: Link, at: Pose) -> None:
        kind = e.get("type") or ("mesh" if e.has("mesh") else "sphere")
        name = self._name("geom", e, e, f"a {kind} of {link.name}")
        geom = Geom(e, kind, at, at.then(self.rules.pose(e)))
        self.touching.append(Toucher(name, link, geom))
        size = " ".join(e.get(key) for key in ("mesh", "size", "fromto") if e.has(key))
        link.shapes.append(" ".join(f"geom {e.get('name')} {kind} {size}".split()))
        if link.parent is not None and kind not in ("plane", "hfield"):
            self.geoms.setdefault(link, []).append(geom)

    # the rest -----------------------------------------------------------------------------------------

    def _keyframe(self) -> None:
        """Where and how fast everything starts: --key."""
        wanted = self.options.key
        keys = [key for group in self.root.all("keyframe") for key in group.all("key")]
        if wanted is None:
            if keys:
                names = ", ".join(key.get("name") or str(k) for k, key in enumerate(keys))
                self.found.notes.append(f"<keyframe>: {names}; emsim import --key NAME starts there")
            return
        chosen = [key for k, key in enumerate(keys) if wanted in (key.get("name"), str(k))]
        if not chosen:
            names = ", ".join(key.get("name") or str(k) for k, key in enumerate(keys)) or "none"
            self.sink.error(
                "E534", f"there is no <key> {wanted!r} in <keyframe>; there is {names}", self.root.span
            )
            return
        key = chosen[0]
        WORDS["key"].check(key, self.sink)
        for word, sizes in (("qpos", {"free": 7, "ball": 4}), ("qvel", {"free": 6, "ball": 3})):
            joints = [*self.found.joints()]
            counts = [sizes.get(joint.kind, 1) for joint in joints]
            values = key.numbers(word, self.sink, (), sum(counts) if key.has(word) else None)
            at = 0
            for joint, count in zip(joints, counts, strict=True):
                mine = values[at : at + count]
                at += count
                if len(mine) == count and word == "qpos":
                    joint.start, joint.note = mine, ""
                elif len(mine) == count:
                    joint.speed = mine
        controls = key.numbers("ctrl", self.sink, ())
        inputs = [a for a in self.found.actuators if a.input]
        for actuator, value in zip(inputs, controls, strict=False):
            actuator.start = value

    def _touches(self) -> None:
        """What touches; W530 where it is not asked for."""
        if self.rules.off & {"contact", "constraint"}:
            return
        touches = Touches(self.root, self.touching, self._scale(), self.classes, self.rules.off)
        if self.options.contacts:
            self.found.contacts += () if self.sink.has_errors else touches.contacts()
        elif pair := next(touches.pairs(), None):
            said = (
                f"{pair[0].name} and {pair[1].name} could touch in MuJoCo; here they pass through each other"
            )
            self.sink.warning("W530", said, pair[1].geom.element.span, SHOULD)

    def _unused(self) -> None:
        for tag in UNUSED:
            if tag != "size" and any(True for _ in self.root.all(tag)):
                self.found.notes.append(f"<{tag}>")
        idle = [f"{n} <{tag}>" for tag in ("camera", "light") if (n := _count(self.root, tag))]
        self.found.notes += [", ".join(idle)] if idle else []
        self.found.notes.append(f"the time step, {self.rules.step:g} s: here steps follow from the tolerance")


def _mesh_name(e: Element) -> str:
    return e.get("name") or splitext(basename(e.get("file")))[0]


def _count(element: Element, tag: str) -> int:
    return sum((child.tag == tag) + _count(child, tag) for child in element.children)
