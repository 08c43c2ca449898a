"""RATIO: a linear relation among the coordinates of n joints, c1 q1 + c2 q2 + .. = what it is at the start.

Differentials, planetary gears whose carrier is a joint too, rope blocks. A row: h = q1 + c2/c1 q2 + .., so its multiplier is what
it applies on j1, and on jk ck/c1 of it; the sum of their powers is 0.
"""

from __future__ import annotations

from .base import Card, Required, Spec

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..deck import MachineCard
    from ..diagnostics import Sink
    from .base import JointView, Pen, Probes, Scalar, Scene


class Ratio(Card):
    spec = Spec(
        "RATIO",
        "RATIO name j1 j2 [j3 ..] coef=(c1,c2,..)",
        terminals="j1:joint j2:joint | j1:joint j2:joint j3:joint",
        mark=("coef",),
        meaning="a linear relation among the coordinates of joints: differential, planetary gear, rope over pulleys",
        meant={"c": "coef={}", "k": "coef={}", "ratio": "coef={}", "": "coef={}"},
        laws={"q": "c1 q1 + c2 q2 + .. stays what it is at the start"},
        coef=Required("", "a coefficient for each joint, in their order", "vector"),
    )
    coef: tuple[float, ...]
    from_start = True

    @classmethod
    def forms(cls, raw: MachineCard) -> list[list[tuple[str, str]]]:
        """As many joints as there are, two at least."""
        return [[(f"j{k + 1}", "joint") for k in range(max(2, len(raw.args)))]]

    def check(self, sink: Sink) -> None:
        names = [ref.name for _, _, ref in self.terminals]
        what = f"coef= of RATIO {self.name}"
        if len(self.coef) != len(names):
            said = f"{what} has {len(self.coef)} number(s) for {len(names)} joints"
            sink.error("E232", said, self.place("coef"), "one for each joint, in their order: coef=(1,1,-2)")
        elif 0.0 in self.coef:
            said = f"{what} is 0 for {names[self.coef.index(0.0)]}, which the relation then does not touch"
            sink.error("E238", said, self.place("coef"), "leave that joint out")
        twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
        if twice is not None:
            said = f"RATIO {self.name} names {twice} twice"
            sink.error("E237", said, self.span, "each joint once, with the sum of its coefficients")

    def prepare(self, s: Scene) -> None:
        self.joints: list[JointView] = [getattr(self, label) for label, _, _ in self.terminals]
        self.shares = [c / self.coef[0] for c in self.coef]

    def constraints(self, s: Scene) -> list[tuple[str, Scalar, str]]:
        total: Scalar = s.b.const(0.0)
        for share, joint in zip(self.shares, self.joints, strict=True):
            total = total + share * joint.q
        return [("relation", total, "N m" if self.joints[0].rotary else "N")]

    def glyph(self, draw: Pen) -> None:
        draw.add("ratio", self, joints=[draw.joint(joint.name) for joint in self.joints])

    def probes(self, s: Scene) -> Probes:
        """torque(ratio) or force(ratio): on the first joint; torque(ratio,k) or force(ratio,k): on the k-th."""
        words = ["torque" if joint.rotary else "force" for joint in self.joints]
        found: Probes = {words[0]: lambda: s.reaction(self.name)}
        for k, (word, share) in enumerate(zip(words, self.shares, strict=True)):
            found[f"{word},{k + 1}"] = lambda share=share: share * s.reaction(self.name)  # type: ignore[misc]
        return found
