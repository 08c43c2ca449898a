"""The deck of a robot: a card a line, with what the file says and the deck cannot use as comments.

A joint of a deck is at 0 where the frames of its two bodies are parallel (cards/joint.py). So every body gets a frame at the
origin of its link that is parallel to the ground's in the configuration of the file; axes, centres and inertias are turned into
it. What is fixed to a body is one with it and leaves its origin as a POINT.
"""

from __future__ import annotations

import re
from math import floor, inf, log10, pi
from sys import float_info

import numpy as np

from . import geometry
from .geometry import Mass, Pose, together

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ..diagnostics import Sink
    from .geometry import Array
    from .model import Actuator, Joint, Link, Loop, Robot, Solid, Tie, Touch

GROUND = "0"
# what rotations leave of numbers that are 0: products of three cosines and sines in sums of three, each rounded
ROUNDING = 32 * float_info.epsilon
DIGITS = float_info.dig  # which a sum of products of the file's numbers is hardly known to


def number(value: float) -> str:
    return f"{value + 0.0:.{DIGITS}g}"


def vector(values: Iterable[float]) -> str:
    """In parentheses, each with as many decimals as the largest has digits."""
    found = [float(v) for v in values]
    largest = max(map(abs, found))
    decimals = DIGITS - 1 - floor(log10(largest)) if largest else 0
    return "(" + ",".join(number(round(v, decimals)) for v in found) + ")"


class Names:
    """Names of the deck: letters, digits and _, no two alike without regard to case."""

    def __init__(self, *taken: str) -> None:
        self.taken = {*taken}

    def give(self, wanted: str, ending: str) -> str:
        base = re.sub(r"\W", "_", wanted, flags=re.ASCII) or ending
        if not base[0].isalpha():
            base = f"{ending}_{base.lstrip('_')}"
        name, count = base, 1
        while name.lower() in self.taken:
            name = f"{base}_{ending}" if count == 1 else f"{base}_{ending}{count}"
            count += 1
        self.taken.add(name.lower())
        return name


def write(robot: Robot, sink: Sink) -> str:
    """The deck's text; E536 for what moves and has no mass."""
    return _Writer(robot, sink).text()


class _Writer:
    def __init__(self, robot: Robot, sink: Sink) -> None:
        self.robot, self.sink = robot, sink
        self.lines: list[str] = []
        names, nodes = Names(GROUND), Names(GROUND, "gnd")
        self.joint_names = {joint: names.give(joint.name, "joint") for joint in robot.joints()}
        self.bodies = {link: names.give(link.name, "body") for link in robot.links if link.joints}
        self.names, self.nodes = names, nodes
        self.poses = {link: link.world() for link in robot.links}

    def text(self) -> str:
        robot = self.robot
        self._check_masses()
        self._head()
        for link in robot.links:
            if link.joints:
                self._body(link)
        self._points()
        self._looks()
        for tie in robot.ties:
            self._tie(tie)
        for loop in robot.loops:
            self._loop(loop)
        for spring in robot.springs:
            ends = [
                self._at(link, self.poses[link].p + self.poses[link].r @ p)
                for link, p in (spring.first, spring.second)
            ]
            name = self.names.give(spring.name, "tendon")
            if spring.k:
                self.add(f"SPRING {name} {' '.join(ends)} k={number(spring.k)} l0={number(spring.length)}")
            if spring.c:
                self.add(f"DAMPER {self.names.give(name, 'damper')} {' '.join(ends)} c={number(spring.c)}")
        self._contacts()
        for actuator in robot.actuators:
            self._actuator(actuator)
        if robot.notes:
            self.add("*", "* What the file says and this deck does not use:")
            self.add(*(f"*   {line}" for note in robot.notes for line in note.splitlines()))
        self.add("*", ".tran 1m 1", ".end")
        return "\n".join(self.lines) + "\n"

    def add(self, *lines: str) -> None:
        self.lines += lines

    def comment(self, text: str) -> None:
        self.add(f"* {' '.join(text.split())}")

    def _head(self) -> None:
        robot = self.robot
        title = " ".join(robot.name.split())
        # a title that begins as a dot card or a comment would be one for whoever reads it alone
        self.add(f"Robot {title}, from {' '.join(robot.source.split())} ({robot.kind})", "*")
        self.comment(
            "Every body's frame lies at its link's origin, parallel to the ground's where the file's joints are at 0."
        )
        for remark in robot.remarks:
            self.comment(remark)
        self.add("*", f".gravity {' '.join(map(number, robot.gravity))}")

    # bodies and joints --------------------------------------------------------------------------------

    def mass_of(self, link: Link) -> Mass:
        """All that it carries, in axes parallel to the ground's, about its own origin."""
        origin = self.poses[link].p
        parts = []
        for other in self.robot.links:
            if other.carrier is link:
                for mass in other.masses:
                    placed = Mass(mass.m, mass.centre, mass.tensor).placed(self.poses[other])
                    placed.centre = self.poses[other].r @ mass.centre + (self.poses[other].p - origin)
                    parts.append(placed)
        return together(parts)

    def _at(self, link: Link | None, world: Array) -> str:
        """A point, given in the ground's frame, as a place of the body that carries a link."""
        carrier = None if link is None else link.carrier
        name = GROUND if carrier is None else self.bodies[carrier]
        local = world if carrier is None else world - self.poses[carrier].p
        size = max(1.0, float(np.abs(world).max()))
        return name if np.abs(local).max() <= ROUNDING * size else name + vector(local)

    def _body(self, link: Link) -> None:
        pose, name = self.poses[link], self.bodies[link]
        fixed = [other.name for other in self.robot.links if other.carrier is link and other is not link]
        self.add("*")
        self.comment(
            f"{link.name}{', with ' + ', '.join(fixed) if fixed else ''}{': ' + link.note if link.note else ''}"
        )
        for other in (o for o in self.robot.links if o.carrier is link):
            for shape in other.shapes:
                self.comment(f"  {shape}")
        mass = self.mass_of(link)
        self.add(f"BODY {name}{self._inertia(mass)}")
        # massless parts between several joints
        chain = [self.names.give(f"{name}_{self.joint_names[j]}", "part") for j in link.joints[:-1]] + [name]
        for part in chain[:-1]:
            self.add(f"BODY {part} m=0 j=(0,0,0)")
        before: str | None = None
        for joint, part in zip(link.joints, chain, strict=True):
            point = pose.p + pose.r @ joint.point
            local = pose.r @ joint.point
            here = part + vector(local) if np.abs(local).any() else part
            there = self._at(link.parent, point) if before is None else before + vector(local)
            if before is not None and not np.abs(local).any():
                there = before
            self._joint(joint, there, here, link)
            before = part
        for other in (o for o in self.robot.links if o.carrier is link and o.lifted):
            self._lift(other)

    def _lift(self, link: Link) -> None:
        """What carries a share of a link's weight, at its centre of mass."""
        mass, pose = together(link.masses), self.poses[link]
        force = -link.lifted * mass.m * np.array(self.robot.gravity)
        parts = " ".join(f"f{a}={number(f)}" for a, f in zip("xyz", force, strict=True) if f)
        if parts:
            name = self.names.give(f"{link.name}_lift", "force")
            self.add(f"FORCE {name} {self._at(link, pose.p + pose.r @ mass.centre)} {parts}")

    def _inertia(self, mass: Mass) -> str:
        found = f" m={number(mass.m)}"
        if mass.centre.any():
            found += f" com={vector(mass.centre)}"
        t = mass.tensor
        six = [t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]]
        flat = max(map(abs, six[3:])) <= ROUNDING * max(map(abs, six))
        return f"{found} j={vector(six[:3] if flat else six)}"

    def _joint(self, joint: Joint, there: str, here: str, link: Link) -> None:
        name, pose = self.joint_names[joint], self.poses[link]
        axis = pose.r @ joint.axis
        if joint.note or joint.name != name:
            self.comment(f"joint {joint.name}{': ' + joint.note if joint.note else ''}")
        card = f"JOINT {name} {self._below(link) if joint.kind == 'free' else there} {here} {joint.kind}"
        if joint.is_scalar:
            card += f" axis={vector(axis)}"
            if joint.ref:
                card += f" zero={number(-joint.ref)}"
        card += self._start(joint, link)
        if joint.damping:
            card += f" damp={number(joint.damping)}"
        self.add(card)
        if joint.low > -inf or joint.high < inf:
            ends = [f"{k}={number(v)}" for k, v in (("min", joint.low), ("max", joint.high)) if abs(v) < inf]
            self.add(f"STOP {self.names.give(name + '_ends', 'stop')} {name} {' '.join(ends)} e=0")
        if joint.friction:
            self.add(
                f"FRICTION {self.names.give(name + '_friction', 'dry')} {name} fc={number(joint.friction)}"
            )
        if joint.stiffness:
            k, rest = number(joint.stiffness), number(joint.rest)
            self.add(f"SPRING {self.names.give(name + '_spring', 'spring')} {name} k={k} q0={rest}")
        if joint.armature:
            self._armature(joint, axis if joint.turns else np.array([0.0, 0.0, 1.0]))

    def _below(self, link: Link) -> str:
        """The body that a link hangs on."""
        carrier = None if link.parent is None else link.parent.carrier
        return GROUND if carrier is None else self.bodies[carrier]

    def _origin_below(self, link: Link) -> Array:
        carrier = None if link.parent is None else link.parent.carrier
        return np.zeros(3) if carrier is None else self.poses[carrier].p

    def _armature(self, joint: Joint, axis: Array) -> None:
        """A rotor on the ground, one to one with the joint (of a slide at a lever of 1 m): its energy is j qd^2/2, no more."""
        name = self.joint_names[joint]
        rotor, shaft, gear = (
            self.names.give(f"{name}_{w}", "armature") for w in ("rotor", "shaft", "armature")
        )
        j = number(joint.armature)
        self.add(f"BODY {rotor} m=0 j=({j},{j},{j})")
        self.add(f"JOINT {shaft} 0 {rotor} pin axis={vector(axis)}")
        self.add(f"GEAR {gear} {shaft} {name} ratio=1")

    def _start(self, joint: Joint, link: Link) -> str:
        """ic= where the joint does not start at 0; guess= where a loop or another joint has a say."""
        pose = self.poses[link]
        values = joint.start
        if joint.kind == "free":
            position, turned = pose.p - self._origin_below(link), geometry.UNIT
            if values is not None:
                position, turned = np.array(values[:3]), geometry.by_quaternion(values[3:]) @ pose.r.T
            start = [*position, *geometry.rotation_vector(turned)]
        elif joint.kind == "ball":
            start = [0.0] * 3
            if values is not None:
                start = [*(pose.r @ geometry.rotation_vector(geometry.by_quaternion(values)))]
        else:
            start = [joint.ref if values is None else values[0]]
        speed = joint.speed or []
        if len(speed) in (3, 6):
            speed = [*speed[:-3], *(pose.r @ np.array(speed[-3:]))]
        if not any(start) and not any(speed):
            return ""
        word = "guess" if joint.tied or self.robot.loops else "ic"
        if any(speed) and self.robot.loops:
            said = f"joint {joint.name!r} starts with a speed in a model with loops, which all of its speeds would have to keep"
            self.sink.error(
                "E532", said, joint.span, "start at rest, or write the speed as ic= of one joint in the deck"
            )
        numbers = [*start, *speed] if any(speed) and word == "ic" else start
        return f" {word}={number(numbers[0]) if len(numbers) == 1 else '(' + ','.join(map(number, numbers)) + ')'}"

    def _points(self) -> None:
        """Origins of what is fixed to something, and named points."""
        taken: dict[str, Names] = {}
        lines = []
        for link in self.robot.links:
            places = (
                [(link.name, np.zeros(3))] if link.carrier is not link and link.parent is not None else []
            )
            for name, local in [*places, *link.points]:
                world = self.poses[link].p + self.poses[link].r @ local
                carrier = link.carrier
                body = GROUND if carrier is None else self.bodies[carrier]
                if body == GROUND:
                    continue
                assert carrier is not None
                own = taken.setdefault(body, Names("com")).give(name, "point")
                at = vector(world - self.poses[carrier].p)[1:-1].replace(",", " ")
                lines.append(f"POINT {body}.{own} {at}")
        if lines:
            self.add("*", *lines)

    def _looks(self) -> None:
        """Shapes for pictures: massless bodies, welded on."""
        for link in self.robot.links:
            for k, solid in enumerate(link.solids, 1):
                self._draw(link, solid, self.names.give(f"{link.name}_look{k}", "look"))

    def _draw(self, link: Link, solid: Solid, name: str) -> None:
        pose, sizes = self.poses[link].then(solid.pose), [2.0 * v for v in solid.sizes]
        if solid.kind == "rod":  # which begins at its body's origin, along x
            pose = pose.then(Pose((0.0, 0.0, -solid.sizes[1]), geometry.about((0.0, 1.0, 0.0), -0.5 * pi)))
            self.add("*", f"BODY {name} m=0 shape=rod({number(sizes[1])},{number(sizes[0])})")
        else:
            what = f"plate{_list(sizes)}" if solid.kind == "box" else f"ball({number(solid.sizes[0])})"
            self.add("*", f"BODY {name} m=0 j=(0,0,0) look={what}")
        turn = geometry.rotation_vector(pose.r)
        angle = float(np.linalg.norm(turn))
        way = f" axis={vector(turn / angle)} zero={number(angle)}" if angle > ROUNDING else ""
        self.add(f"JOINT {self.names.give(name, 'weld')} {self._at(link, pose.p)} {name} weld{way}")

    # what ties and drives -----------------------------------------------------------------------------

    def coordinate(self, joint: Joint, speed: bool = False) -> str:
        word = ("omega" if speed else "angle") if joint.turns else ("vel" if speed else "pos")
        return f"{word}({self.joint_names[joint]})"

    def _contacts(self) -> None:
        """Shapes that touch, each on its body, whose frame is parallel to the ground's; then the pairs."""
        names: dict[Touch, str] = {}
        for shape in (s for contact in self.robot.contacts for s in (contact.first, contact.second)):
            if shape in names:
                continue
            self.add(*["*"] * (not names))
            names[shape] = self.names.give(shape.name, "shape")
            carrier, pose = shape.link.carrier, self.poses[shape.link].then(shape.pose)
            body, origin = (
                (GROUND, np.zeros(3)) if carrier is None else (self.bodies[carrier], self.poses[carrier].p)
            )
            turn = geometry.rotation_vector(pose.r)
            rot = f" rot={vector(turn)}" if np.linalg.norm(turn) > ROUNDING else ""
            what = f"{shape.kind}({','.join(map(number, shape.numbers))})"
            self.add(f"SHAPE {names[shape]} {body} {what} at={vector(pose.p - origin)}{rot}")
        for contact in self.robot.contacts:
            words = zip(("mu", "drilling", "rolling"), contact.resists, strict=True)
            rubs = "".join(f" {word}={number(value)}" for word, value in words if value)
            ends = f"{names[contact.first]} {names[contact.second]}"
            self.add(f"CONTACT {self.names.give(contact.name, 'contact')} {ends} e=0{rubs}")

    def _tie(self, tie: Tie) -> None:
        follower, leader = self.joint_names[tie.follower], self.joint_names[tie.leader]
        name = self.names.give(tie.name, "tie")
        self.add("*")
        if not tie.series[0] and not any(tie.series[2:]):
            self.add(f"GEAR {name} {follower} {leader} ratio={number(tie.series[1])}")
            return
        q = self.coordinate(tie.leader)
        terms = [number(c) + "".join(f"*{q}" for _ in range(k)) for k, c in enumerate(tie.series) if c]
        self.add(f"CAM {name} {follower} {leader} lift={{{_sum(terms)}}}")

    def _loop(self, loop: Loop) -> None:
        places = [self._at(link, loop.point) for link in (loop.first, loop.second)]
        self.add("*", f"JOINT {self.names.give(loop.name, 'loop')} {' '.join(places)} {loop.kind} cut=yes")

    def _actuator(self, actuator: Actuator) -> None:
        name = self.names.give(actuator.name, "motor")
        self.add("*")
        if actuator.note:
            self.comment(f"{actuator.name}: {actuator.note}")
        drive = ""
        if actuator.input:
            node = self.nodes.give(actuator.name, "in")
            self.add(f"V{node} {node} 0 {number(actuator.start)}")
            drive = _clamped(f"v({node})", actuator.inputs)
        force = self._force(actuator, drive)
        for k, (joint, coefficient) in enumerate(actuator.parts):
            card = name if k == 0 else self.names.give(f"{name}_{self.joint_names[joint]}", "motor")
            tau = force if coefficient == 1.0 else f"{number(coefficient)}*({force})"
            self.add(f"TORQUE {card} {self.joint_names[joint]} tau={{{tau}}}")

    def _force(self, actuator: Actuator, drive: str) -> str:
        """f of an actuator as an expression."""
        length = _linear([(c, self.coordinate(j)) for j, c in actuator.parts])
        speed = _linear([(c, self.coordinate(j, True)) for j, c in actuator.parts])
        gain, bias = (_affine(k, length, speed) for k in (actuator.gain, actuator.bias))
        if not drive:
            force = bias or "0"
        else:
            driven = drive if gain == "1" else f"({gain or '0'})*{drive}"
            force = f"{driven}+{bias}".replace("+-", "-") if bias else driven
        return _clamped(force, actuator.forces)

    # masses -------------------------------------------------------------------------------------------

    def _check_masses(self) -> None:
        """What a joint moves has inertia along it: the joint's link and all that hangs on it."""
        above: dict[Link, Mass] = {}
        for link in reversed(self.robot.links):
            own = [m.placed(self.poses[link]) for m in link.masses]
            below = [above[o] for o in self.robot.links if o.parent is link]
            above[link] = together([*own, *below])
            for joint in link.joints:
                if not joint.tied and not joint.armature and not self._moves(joint, above[link], link):
                    said = f"joint {joint.name!r} moves {link.name!r} and what hangs on it, and they have no mass that resists"
                    hint = "give a link beyond it a mass and an inertia about the axis"
                    self.sink.error("E536", said, link.span, hint)

    def _moves(self, joint: Joint, mass: Mass, link: Link) -> bool:
        pose = self.poses[link]
        if joint.kind == "slide":
            return mass.m > 0.0
        moment = mass.moment(pose.p + pose.r @ joint.point)
        if joint.kind == "pin":
            axis = pose.r @ joint.axis
            return bool(axis @ moment @ axis > ROUNDING * np.trace(moment))
        about = mass.tensor if joint.kind == "free" else moment
        values = np.linalg.eigvalsh(about)
        return bool(values[0] > ROUNDING * values[2]) and (joint.kind == "ball" or mass.m > 0.0)


def _list(values: Sequence[float]) -> str:
    return "(" + ",".join(map(number, values)) + ")"


def _sum(terms: Sequence[str]) -> str:
    return "+".join(terms).replace("+-", "-")


def _linear(parts: Sequence[tuple[float, str]]) -> str:
    return _sum([q if c == 1.0 else f"-{q}" if c == -1.0 else f"{number(c)}*{q}" for c, q in parts])


def _affine(k: Sequence[float], length: str, speed: str) -> str:
    """k0 + k1 l + k2 v; "" where it is 0."""
    terms = [number(k[0])] if k[0] else []
    for factor, word in ((k[1], length), (k[2], speed)):
        if factor:
            terms.append(f"{number(factor)}*({word})")
    return _sum(terms)


def _clamped(text: str, ends: tuple[float, float]) -> str:
    low, high = ends
    if low > -inf:
        text = f"max({text},{number(low)})"
    return f"min({text},{number(high)})" if high < inf else text
