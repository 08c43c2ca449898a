"""FRICTION: Coulomb friction with stiction on a joint, a clutch or a brake where fc= is an expression.

    effort = -F(u) sgn(u),  F(u) = fc + (fs - fc) exp(-(u/vs)^2);  at rest anything up to fs
    and -b u
On a ball joint, or p.slide of a planar one (along.py), u is a vector and sgn(u) is u/|u|: at rest |effort| is up to fs.
With mu= the joint's own load N does it: fc = mu N, fs = mus N, on a pin times radius=. N is the force between the joint's parts
across its free direction, moments left out.
`model=smooth` writes fc tanh(u/vs) in its place: what should stick creeps then.
"""

from __future__ import annotations

from .along import drawn, length, rubbing, size
from .base import Card, Default, Spec, is_number
from .kinematics import dot

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Any

    from .._engine import Expr
    from ..diagnostics import Sink
    from .base import JointView, Net, Pen, Powers, Probes, Resistances, Scalar, Scene
    from .laws import Law, Relay


class Friction(Card):
    spec = Spec(
        "FRICTION",
        "FRICTION name joint fc=value/{expr} [fs=value/{expr}] or mu= [mus=] [radius=] [vs=] [b=] [model=smooth]",
        terminals="joint:joint",
        mark=("fc", "mu"),
        meaning="Coulomb friction with stiction; a clutch or a brake where fc= is an expression",
        meant={"": "fc={}", "f": "fc={}", "c": "fc={}", "tau": "fc={}"},
        laws={"P": "F |u| + b u^2, F = fc + (fs - fc) exp(-(u/vs)^2); with mu= fc = mu N, fs = mus N, N the load of the joint"},
        fc=Default(None, "N or N m", "friction while sliding: number, {expression} or waveform", "value"),
        fs=Default(None, "N or N m", "friction that must be overcome to start, as fc=; fc unless given", "value"),
        vs=Default(
            None, "m/s or rad/s", "speed over which fs falls to fc, at once unless given; of model=smooth", above=0.0
        ),
        mu=Default(None, "", "coefficient of friction by the joint's own load, in place of fc=", least=0.0),
        mus=Default(None, "", "coefficient that must be overcome to start; mu unless given", least=0.0),
        radius=Default(None, "m", "radius of the pin that rubs, with mu=", above=0.0),
        b=Default(0.0, "N s/m or N m s/rad", "viscous part", least=0.0),
        model=Default("exact", "", "smooth: fc tanh(u/vs), which sticks nowhere", "word", words=("exact", "smooth")),
    )  # fmt: skip
    fc: Any
    fs: Any
    vs: float | None
    mu: float | None
    mus: float | None
    radius: float | None
    b: float
    model: str
    joint: JointView
    acts_on = "several"
    rubs: Sequence[Relay] = ()

    def check(self, sink: Sink) -> None:
        what = f"FRICTION {self.name}"
        self._check_load(what, sink)
        below = [key for key in ("fc", "fs") if is_number(value := getattr(self, key)) and value < 0.0]
        if below:
            said = f"{below[0]}= of {what} is {getattr(self, below[0]):g}; friction cannot be below 0"
            sink.error("E238", said, self.place(below[0]))
        elif is_number(self.fc) and is_number(self.fs) and self.fs < self.fc:
            said = f"fs= of {what} is {self.fs:g}, less than fc= {self.fc:g}: what slides would be held more than what rests"
            hint = "fs= is the friction that must be overcome, the larger one"
            sink.error("E238", said, self.place("fs"), hint)
        if self.model == "smooth":
            if self.vs is None:
                said = f"{what} needs vs= for model=smooth: the speed over which the force is smoothed"
                sink.error("E230", said, self.place("model"))
            if key := next((k for k in ("fs", "mus") if self.given(k)), ""):
                said = f"{key}= of {what} does not fit model=smooth, which sticks nowhere"
                sink.error("E240", said, self.place(key), "leave one of them out")
        elif self.vs is not None and self.fs is None and self.mus is None:
            more, less = ("fs", "fc") if self.mu is None else ("mus", "mu")
            said = f"vs= of {what} has no effect: it says over which speed {more}= falls to {less}=, and there is no {more}="
            hint = "friction sticks and slides exactly, nothing is smoothed; model=smooth would"
            sink.note("N232", said, self.place("vs"), hint)

    def _check_load(self, what: str, sink: Sink) -> None:
        if self.mu is None:
            if self.fc is None:
                sink.error("E230", f"{what} needs fc= or mu=", self.span, self.spec.form)
            for key in ("mus", "radius"):
                if self.given(key):
                    said = f"{key}= of {what} belongs to mu="
                    sink.error("E240", said, self.place(key), "give mu=, or leave it out")
            return
        for key in ("fc", "fs"):
            if self.given(key):
                said = f"{what} has both mu= and {key}=: each says how much it rubs"
                sink.error("E240", said, self.place(key), "leave one of them out")
        if self.mus is not None and self.mus < self.mu:
            said = f"mus= of {what} is {self.mus:g}, less than mu= {self.mu:g}: what slides would be held more than what rests"
            sink.error("E238", said, self.place("mus"))

    def _load(self, s: Scene) -> Expr | None:
        """N, on a pin times its radius; None where the joint has no such thing."""
        what = f"FRICTION {self.name}"
        load = s.load(self.joint)
        if load is None:
            said = f"mu= of {what}: nothing says where the parts of {self.joint.name} press on each other"
            s.sink.error("E240", said, self.place("mu"), "mu= is for a pin or a slide; elsewhere fc=")
        elif self.joint.rotary and self.radius is None:
            said = f"{what} needs radius=: friction acts on {self.joint.name} at the radius of its pin"
            s.sink.error("E230", said, self.place("mu"))
        elif not self.joint.rotary and self.radius is not None:
            said = f"radius= of {what} is for a pin; {self.joint.name} slides"
            s.sink.error("E240", said, self.place("radius"))
        return load if load is None or self.radius is None else self.radius * load

    def prepare(self, s: Scene) -> None:
        if self.mu is not None:
            load = self._load(s)
            sliding = s.b.const(0.0) if load is None else self.mu * load
            stick = sliding if self.mus is None or load is None else self.mus * load
        else:
            sliding = s.compile(self.fc, self.place("fc"))
            if sliding.value is None:
                sliding = s.maximum(sliding, 0.0)  # a clutch presses or does not
            # what holds is never less than what slides
            stick = sliding if self.fs is None else s.maximum(s.compile(self.fs, self.place("fs")), sliding)
        self.sliding = sliding
        if self.model == "smooth":
            return
        bound: Scalar = sliding
        if self.vs is not None:
            share = [u / self.vs for u in self.joint.us]
            bound = sliding + (stick - sliding) * s.b.call("exp", s.b.const(0.0) - dot(share, share))
        self.rubs = rubbing(self.joint.us, bound, stick, "N m" if self.joint.rotary else "N")

    def laws(self, s: Scene) -> list[Law]:
        return [*self.rubs]

    def powers(self, s: Scene) -> Powers:
        us = self.joint.us
        result: Powers = [(-self.b * u, u) for u in us] if self.b else []
        return result if self.rubs else [*result, *zip(self._smooth(s), us, strict=True)]

    def _smooth(self, s: Scene) -> list[Expr]:
        """Against the speed, or the direction of the vector."""
        assert self.vs is not None
        us, speed = self.joint.us, size(s.b, self.joint.us)
        share = -self.sliding * s.b.call("tanh", speed / self.vs)
        return [share] if len(us) == 1 else [share / speed * u for u in us]

    def _efforts(self, s: Scene) -> list[Expr]:
        dry = [law.effort for law in self.rubs] or self._smooth(s)
        return [e - self.b * u for e, u in zip(dry, self.joint.us, strict=True)] if self.b else dry

    def probes(self, s: Scene) -> Probes:
        """torque(card) and slip(card); of a vector their lengths, and torque(card,k) its components."""
        efforts, us = self._efforts(s), self.joint.us
        word = "torque" if self.joint.rotary else "force"
        found: Probes = {
            word: length(s.b, efforts),
            "slip": length(s.b, us),
            "power": s.b.const(0.0) + dot(efforts, us),
        }
        if len(us) > 1:
            found.update({f"{word},{k}": e for k, e in enumerate(efforts, 1)})
        if self.rubs:
            found["mode"] = self.rubs[0].mode
        return found

    def losses(self, s: Scene) -> Scalar | None:
        return s.b.const(0.0) - dot(self._efforts(s), self.joint.us)

    def thermal(self, s: Scene) -> Resistances:
        return [("", self.b, u) for u in self.joint.us] if self.b else []

    def glyph(self, draw: Pen) -> None:
        word, unit = ("torque", "N m") if self.joint.rotary else ("force", "N")
        effort = draw.channel(f"{word}({self.name})", unit, length(draw.m.b, self._efforts(draw.m)))
        draw.add("friction", self, **drawn(draw, self.joint), effort=effort, unit=unit)

    def analogue(self, net: Net) -> None:
        net.refuse(self, "has modes, and no element of a circuit has")
