"""The mechanical graph: a spanning tree from ground, and the joints that close loops.

Bodies are nodes, joints are branches, "0" is ground. Joints are taken in deck order; one that connects two
parts not yet connected becomes a branch of the tree, the last joint of a loop is the cut one. `cut=yes` and
rods are always cut. Parts that no joint ties to ground hang on their first body, which is free.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable

GROUND = "0"


class Edge:
    """A joint as the graph sees it."""

    __slots__ = ("a", "b", "name", "never_tree")

    def __init__(self, name: str, a: str, b: str, never_tree: bool) -> None:
        self.name = name
        self.a = a
        self.b = b
        self.never_tree = never_tree


class Step:
    """One branch of the tree, from `parent` outwards; `backward` when the joint's A is the child."""

    __slots__ = ("backward", "child", "joint", "parent")

    def __init__(self, joint: str, parent: str, child: str, backward: bool) -> None:
        self.joint = joint
        self.parent = parent
        self.child = child
        self.backward = backward


DEEP = 30  # joints between a body and ground, root mean square: beyond it joint coordinates cost more and lose digits


class Plan:
    """`roots` are the free bodies, `steps` lead outwards from ground and roots, `cut` closes the loops."""

    __slots__ = ("above", "cut", "roots", "steps")

    def __init__(self, roots: list[str], steps: list[Step], cut: list[str]) -> None:
        self.roots = roots
        self.steps = steps
        self.cut = cut
        self.above = {step.child: step for step in steps}

    @property
    def is_deep(self) -> bool:
        """Does a body hang on so many joints that its own coordinates are cheaper?

        Every joint on the way to a body has its part in the body's inertia: the work of joint coordinates grows with the square
        of the depth, that of maximal coordinates with the number of bodies alone. And speeds follow from momenta by a matrix
        whose condition grows with the fourth power of the depth: what is lost there is taken for an error of the step.
        """
        depth: dict[str, int] = {}
        for step in self.steps:
            depth[step.child] = 1 + depth.get(step.parent, 0)
        return sum(d * d for d in depth.values()) > DEEP * DEEP * len(depth)

    def path(self, body: str) -> list[str]:
        """Joints from a body up to its root."""
        joints = []
        while (step := self.above.get(body)) is not None:
            joints.append(step.joint)
            body = step.parent
        return joints

    def loop(self, a: str, b: str) -> list[str]:
        """Tree joints of the loop that a joint from a to b closes."""
        up, down = self.path(a), self.path(b)
        while up and down and up[-1] == down[-1]:
            up.pop()
            down.pop()
        return up + down[::-1]


class Parts:
    """Union-find."""

    __slots__ = ("parent",)

    def __init__(self, names: Iterable[str]) -> None:
        self.parent = {name: name for name in names}

    def find(self, name: str) -> str:
        root = name
        while self.parent[root] != root:
            root = self.parent[root]
        while self.parent[name] != root:
            self.parent[name], name = root, self.parent[name]
        return root

    def join(self, a: str, b: str) -> bool:
        """False when the two were one part already."""
        a, b = self.find(a), self.find(b)
        if a == b:
            return False
        self.parent[a] = b
        return True


def plan(bodies: list[str], fixed: set[str], edges: list[Edge]) -> Plan:
    """Tree and loops of the graph; `bodies` in deck order without ground."""
    parts = Parts([GROUND, *bodies])
    for body in bodies:
        if body in fixed:
            parts.join(GROUND, body)
    around: dict[str, list[Edge]] = {name: [] for name in (GROUND, *bodies)}
    cut = []
    for edge in edges:
        if edge.never_tree or not parts.join(edge.a, edge.b):
            cut.append(edge.name)
        else:
            around[edge.a].append(edge)
            around[edge.b].append(edge)

    # walk outwards: ground and fixed bodies first, then each part that is left from its first body
    steps: list[Step] = []
    placed: set[str] = set()
    roots: list[str] = []

    def walk(queue: list[str]) -> None:
        placed.update(queue)
        for body in queue:
            for edge in around[body]:
                backward = edge.b == body
                child = edge.a if backward else edge.b
                if child not in placed:
                    placed.add(child)
                    steps.append(Step(edge.name, body, child, backward))
                    queue.append(child)

    walk([GROUND, *(body for body in bodies if body in fixed)])
    for body in bodies:
        if body not in placed:
            roots.append(body)
            walk([body])
    return Plan(roots, steps, cut)
