"""MJCF: what ties bodies and drives them: equalities, tendons, actuators.

An actuator acts on l = gear * q of a joint, or gear * length of a tendon, with the force

    (g0 + g1 l + g2 v) u + b0 + b1 l + b2 v          motor: g = 1
                                                    position: g = kp, b = 0 -kp -kv; velocity: g = kv, b = 0 0 -kv
A fixed tendon is a sum of coordinates, its spring at rest where those of its joints are; a spatial one of two sites a spring
and a damper between them.
"""

from __future__ import annotations

from math import inf

import numpy as np

from ..diagnostics import suggest
from .mjcf_words import MAIN
from .model import Actuator, Between, Joint, Link, Loop, Tie

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..diagnostics import Sink
    from .geometry import Array
    from .mjcf import Rules
    from .mjcf_words import Classes, Filled
    from .model import Robot
    from .xml import Element

    Names = dict[str, dict[str, object]]

DRIVES = ("motor", "position", "velocity", "damper", "general")


class Drives:
    """`names`: bodies, joints, sites by name."""

    def __init__(
        self, root: Element, found: Robot, rules: Rules, classes: Classes, names: Names, sink: Sink
    ) -> None:
        self.root, self.found, self.rules, self.classes = root, found, rules, classes
        self.names, self.sink = names, sink
        self.tendons: dict[str, list[tuple[Joint, float]]] = {}

    def read(self) -> None:
        for section, one in (
            ("equality", self._equality),
            ("tendon", self._tendon),
            ("actuator", self._actuator),
        ):
            for group in self.root.all(section):
                for element in group.children:
                    one(element)

    def _named(self, kind: str, e: Element, key: str) -> object | None:
        """What an attribute names; None after an error."""
        name = e.required(key, self.sink)
        found = self.names[kind].get(name)
        if found is None and name:
            near = suggest(name, self.names[kind])
            said = f"{key} of <{e.tag}> names {name!r}, and there is no such {kind}"
            self.sink.error("E534", said, e.place(key), f"did you mean {near}?" if near else None)
        return found

    def _coordinate(self, e: Element, key: str) -> Joint | None:
        """A hinge or slide that an attribute names; None after an error."""
        joint = self._named("joint", e, key)
        if isinstance(joint, Joint) and not joint.is_scalar:
            said = f"<{e.tag}> on a joint of type {joint.kind} is not imported: {joint.name}"
            self.sink.error("E532", said, e.place(key), "write TORQUE or FORCE on its body in the deck")
            return None
        return joint if isinstance(joint, Joint) else None

    def _unread(self, e: Element, where: str) -> None:
        said = f"<{e.tag}> in <{where}> is not read here"
        self.sink.error("E532", said, e.span)

    # equalities ---------------------------------------------------------------------------------------

    def _equality(self, element: Element) -> None:
        if element.tag not in ("connect", "weld", "joint"):
            return self._unread(element, "equality")
        e = self.classes.fill(element, MAIN, "equality_joint" if element.tag == "joint" else "")
        name = e.get("name") or f"{e.tag}{len(self.found.loops) + len(self.found.ties) + 1}"
        if not e.flag("active", self.sink, True) or self.rules.off & {"equality", "constraint"}:
            self.found.notes.append(f"<{e.tag}> {name}: not active")
            return None
        if e.tag == "joint":
            return self._tied(e, name)
        first = self._named("body", e, "body1")
        second = self._named("body", e, "body2") if e.has("body2") else self.names["body"]["world"]
        if not isinstance(first, Link) or not isinstance(second, Link):
            return None
        if any(e.numbers("relpose", self.sink, (0.0,) * 7, 7)[3:]):
            said = "relpose of <weld>: bodies are welded as they stand at first"
            self.sink.error("E532", said, e.place("relpose"), "leave it out, and give the bodies their poses")
            return None
        anchor = np.array(e.numbers("anchor", self.sink, (0.0,) * 3, 3))
        if e.tag == "connect":
            e.required("anchor", self.sink)
            at = first.world()
        else:
            at = second.world()
        kind = "ball" if e.tag == "connect" else "weld"
        self.found.loops.append(Loop(name, kind, first, second, at.p + at.r @ anchor, e.span))

    def _tied(self, e: Filled, name: str) -> None:
        """q1 - ref1 = polynomial of q2 - ref2."""
        if not e.has("joint2"):
            said = "<joint> in <equality> without joint2= holds a joint still"
            self.sink.error("E532", said, e.span, "leave the joint out, or write a DRIVE in the deck")
            return
        follower, leader = self._coordinate(e, "joint1"), self._coordinate(e, "joint2")
        if follower is None or leader is None:
            return
        given = e.numbers("polycoef", self.sink, (0.0, 1.0, 0.0, 0.0, 0.0))
        shifted = np.polynomial.Polynomial([-leader.ref, 1.0])
        course = follower.ref + np.polynomial.Polynomial(given or [0.0])(shifted)
        series = [float(c) for c in course.coef]
        if not any(series[1:]) or follower is leader or follower.tied:
            said = f"<{e.tag}> {name} ties {follower.name} to nothing, to itself or twice"
            self.sink.error("E533", said, e.span)
            return
        follower.tied = True
        self.found.ties.append(Tie(name, follower, leader, series, e.span))

    # tendons ------------------------------------------------------------------------------------------

    def _tendon(self, element: Element) -> None:
        if element.tag not in ("fixed", "spatial"):
            return self._unread(element, "tendon")
        e = self.classes.fill(element, MAIN)
        name = e.get("name") or f"tendon{len(self.tendons) + 1}"
        if name in self.tendons:
            self.sink.error("E534", f"there are two tendons named {name!r}", e.place("name"))
        for key in ("frictionloss", "armature"):
            if e.number(key, self.sink):
                self.sink.error("E532", f"{key} of <{e.tag}> is not imported", e.place(key))
        for word, key in (("limited", "range"), ("actuatorfrclimited", "actuatorfrcrange")):
            if self.rules.limited(e, word, key) and not self.rules.off & {"limit", "constraint"}:
                hint = "write a ROPE in the deck, or STOP on its joints"
                self.sink.error("E532", f"{key} of <{e.tag}> is not imported", e.place(key), hint)
        k = 0.0 if self.rules.off & {"passive", "spring"} else e.number("stiffness", self.sink)
        c = 0.0 if self.rules.off & {"passive", "damper"} else e.number("damping", self.sink)
        rest = e.numbers("springlength", self.sink, (-1.0,))
        if len(set(rest)) > 1:
            said = "springlength of two numbers, a spring with play, is not imported"
            self.sink.error("E532", said, e.place("springlength"))
        if e.tag == "fixed":
            self._fixed(e, name, k, c, rest[0])
        else:
            self._spatial(e, name, k, c, rest[0])

    def _fixed(self, e: Filled, name: str, k: float, c: float, rest: float) -> None:
        parts = []
        for child in e.all("joint"):
            joint = self._coordinate(child, "joint")
            child.required("coef", self.sink)
            if joint is not None:
                parts.append((joint, child.number("coef", self.sink)))
        self.tendons[name] = parts
        if k or c:
            spring = Actuator(name, parts, e.span)
            length = sum(coef * joint.rest for joint, coef in parts) if rest == -1.0 else rest
            spring.input, spring.bias = False, [k * length, -k, -c]
            spring.note = "spring and damper of a tendon, a sum of coordinates"
            self.found.actuators.append(spring)

    def _spatial(self, e: Filled, name: str, k: float, c: float, rest: float) -> None:
        self.tendons[name] = []
        if not k and not c:
            self.found.notes.append(f"<spatial> {name}: no stiffness, no damping")
            return
        if [child.tag for child in e.children] != ["site", "site"]:
            said = f"<spatial> {name} with a spring runs over more than two sites, a pulley or a geom"
            self.sink.error("E532", said, e.span, "write a ROPE with k= in the deck")
            return
        ends: list[tuple[Link, Array]] = []
        for child in e.children:
            site = self._named("site", child, "site")
            if isinstance(site, tuple):
                ends.append(site)
        if rest == -1.0 and any(joint.is_scalar and joint.rest != joint.ref for joint in self.found.joints()):
            said = "springlength of <spatial> is to be that at the springref of all joints, which is not their ref"
            self.sink.error("E532", said, e.span, "give springlength= as a number")
        if len(ends) == 2:
            places = [link.world().p + link.world().r @ local for link, local in ends]
            length = float(np.linalg.norm(places[1] - places[0])) if rest == -1.0 else rest
            self.found.springs.append(Between(name, ends, k, c, length, e.span))

    # actuators ----------------------------------------------------------------------------------------

    def _actuator(self, element: Element) -> None:
        if element.tag not in DRIVES:
            return self._unread(element, "actuator")
        e = self.classes.fill(element, MAIN)
        parts = self._parts(e)
        name = e.get("name") or f"{e.tag}{len(self.found.actuators) + 1}"
        if not parts:
            return
        if self.rules.off & {"actuation"}:
            self.found.notes.append(f"<{e.tag}> {name}: actuators are disabled")
            return
        gear = e.numbers("gear", self.sink, (1.0,))
        if any(gear[1:]):
            self.sink.error("E532", "gear of several axes is not imported", e.place("gear"))
        actuator = Actuator(name, [(joint, coef * gear[0]) for joint, coef in parts], e.span)
        self._law(e, actuator)
        for word, key, field in (
            ("ctrllimited", "ctrlrange", "inputs"),
            ("forcelimited", "forcerange", "forces"),
        ):
            if self.rules.limited(e, word, key):
                low, high = e.numbers(key, self.sink, (0.0, 0.0), 2)
                if not low < high:
                    self.sink.error("E533", f"{key} of <{e.tag}>: the lower end comes first", e.place(key))
                if field == "forces" or "clampctrl" not in self.rules.off:
                    setattr(actuator, field, (low, high))
        self._joint_limit(e, actuator)
        self.found.actuators.append(actuator)

    def _parts(self, e: Filled) -> list[tuple[Joint, float]]:
        """The joints that it acts on, each with its share in the length."""
        if e.has("joint"):
            joint = self._coordinate(e, "joint")
            return [] if joint is None else [(joint, 1.0)]
        if not e.has("tendon"):
            self.sink.error("E533", f"<{e.tag}> needs joint= or tendon=", e.span)
            return []
        name = e.get("tendon")
        if name not in self.tendons:
            near = suggest(name, self.tendons)
            said = f"tendon of <{e.tag}> names {name!r}, and there is no such tendon"
            self.sink.error("E534", said, e.place("tendon"), f"did you mean {near}?" if near else None)
        elif not self.tendons[name]:
            said = "an actuator on a spatial tendon is not imported"
            self.sink.error("E532", said, e.place("tendon"), "write a ROPE and its winch in the deck")
        return self.tendons.get(name, [])

    def _joint_limit(self, e: Filled, actuator: Actuator) -> None:
        """actuatorfrcrange of the joint, as one of the actuator: where it is the only one."""
        joint, coef = actuator.parts[0]
        if len(actuator.parts) == 1 and joint.effort < inf and coef:
            if any(joint is other for a in self.found.actuators for other, _ in a.parts):
                said = f"actuatorfrcrange of joint {joint.name!r}, on which several actuators act, is not imported"
                self.sink.error("E532", said, e.span, "write forcerange= on each of them")
            least, most = actuator.forces
            end = joint.effort / abs(coef)
            actuator.forces = (max(least, -end), min(most, end))
        elif any(joint.effort < inf for joint, _ in actuator.parts):
            said = "actuatorfrcrange of a joint on which a tendon acts is not imported"
            self.sink.error("E532", said, e.span)

    def _law(self, e: Filled, actuator: Actuator) -> None:
        sink = self.sink
        if e.tag == "position":
            kp, kv = e.number("kp", sink, 1.0), e.number("kv", sink)
            for key in ("dampratio", "timeconst", "inheritrange"):
                if e.number(key, sink):
                    hint = "give kv= and ctrlrange= as numbers" if key != "timeconst" else None
                    sink.error("E532", f"{key} of <position> is not imported", e.place(key), hint)
            actuator.gain, actuator.bias = [kp, 0.0, 0.0], [0.0, -kp, -kv]
        elif e.tag == "velocity":
            kv = e.number("kv", sink, 1.0)
            actuator.gain, actuator.bias = [kv, 0.0, 0.0], [0.0, 0.0, -kv]
        elif e.tag == "damper":
            actuator.gain = [0.0, 0.0, -e.number("kv", sink, 1.0)]
        elif e.tag == "general":
            self._general(e, actuator)

    def _general(self, e: Filled, actuator: Actuator) -> None:
        for key, allowed in (
            ("dyntype", ("none",)),
            ("gaintype", ("fixed", "affine")),
            ("biastype", ("none", "affine")),
        ):
            if e.get(key, allowed[0]) not in allowed:
                said = f"{key} {e.get(key)!r} of <general> is not imported; {' and '.join(allowed)} is"
                self.sink.error("E532", said, e.place(key), "write its law as a B source in the deck")
        gain = [*e.numbers("gainprm", self.sink, (1.0,)), 0.0, 0.0, 0.0][:3]
        bias = [*e.numbers("biasprm", self.sink, (0.0,)), 0.0, 0.0, 0.0][:3]
        actuator.gain = gain if e.get("gaintype") == "affine" else [gain[0], 0.0, 0.0]
        actuator.bias = bias if e.get("biastype") == "affine" else [0.0, 0.0, 0.0]
