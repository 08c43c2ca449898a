"""Joints as terminals of Verilog-A modules: a rotational or kinematic terminal of N names a joint.

    potential of the terminal = coordinate q or speed u of the joint      (its row's unknown: the effort)
    the effort acts on the joint with the power effort * u                 what flows into the terminal is -effort
So the module's contributions are torques or forces that it takes from the joint, and ddt() of a speed is inertia.
"""

from __future__ import annotations

from ..cards.base import Card, Spec
from ..elements.compiled import MECHANICAL, Compiled

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..cards.base import Powers, Scene
    from .mechanism import Mechanism
    from .scene import JointState


class Shaft(Card):
    """One terminal of one element on one joint."""

    spec = Spec("N", "", "joint:joint", (), "a terminal of a module on a joint")

    def __init__(self, element: Compiled, joint: JointState, reads: str, rows: tuple[int, int]) -> None:
        self.name, self.span, self.terminals, self.ok = element.name, element.span, [], True
        self.joint, self.reads = joint, reads
        self.node, self.row = rows

    def powers(self, s: Scene) -> Powers:
        return [(s.b.x(self.row), self.joint.u)]

    def stamp(self, s: Scene) -> None:
        s.b.g(self.node, self.row, 1.0)
        s.b.g(self.row, self.node, 1.0)
        s.add_f(self.row, -(self.joint.q if self.reads == "q" else self.joint.u))


def couple(m: Mechanism) -> list[Card]:
    """The joints that modules have as terminals; reports those that do not fit."""
    found: list[Card] = []
    for e in m.ctx.elements.values():
        if not isinstance(e, Compiled) or e.module is None:
            continue
        for k, name in e.shafts.items():
            discipline = e.module.disciplines[k]
            reads, turns, unit, effort = MECHANICAL[discipline]
            joint, terminal = m.joints.get(name), e.module.terminals[k]
            if joint is None:
                continue  # its card was refused
            if not joint.single or joint.rotary != turns:
                what = "a pin" if turns else "a slide"
                m.sink.error(
                    "E299",
                    f"`{e.name}`: terminal {terminal} of `{e.module.name}` is {discipline}, {name} is a {joint.kind.name}",
                    e.span,
                    f"it needs {what}",
                )
                continue
            node = m.b.unknown(f"{e.name}#{terminal}", "node", unit, 0.0)
            row = m.b.unknown(f"{e.name}#{terminal} effort", "branch", effort, 0.0)
            m.ctx.shafts[e.name, k] = (node, row)
            found.append(Shaft(e, joint, reads, (node, row)))
    return found
