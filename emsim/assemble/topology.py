"""Checks of the circuit's graph before anything is solved, with the element lines named.

 1. Loops of voltage-defined branches have no solution or too many: an error. A loop that an inductor
    closes has none at DC only: the inductor gets 1 pOhm, the dual of gmin, which a transient does not notice.
    Where a source or .ic is in the loop a run starts with the inductor's ic=, as under UIC.
 2. Nodes that elements only read: nothing determines them, an error.
 3. A motor or transducer with a node of its own carries no current: a warning.
 4. Parts without a DC path to ground. Capacitors to the rest determine them in a transient, so the operating
    point takes them as 0 V, with a warning (ngspice ends there too, after gmin and source stepping). Without
    capacitors they get 1 TOhm to ground with a warning, unless an independent current source drives them: an
    error.

With UIC in every transient there is no operating point and 4 stays silent where capacitors exist.
"""

from __future__ import annotations

from itertools import pairwise

from ..deck import MachineCard
from ..diagnostics import suggest
from ..elements import Element
from ..expr import Node, calls

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..diagnostics import Span
    from .context import Context

LOOP_RESISTANCE = 1e-12  # in an inductor that closes a loop of voltages [ohm]
GROUND = "0"


class Start:
    """A node's voltage of .ic."""

    __slots__ = ("name", "span", "value")

    def __init__(self, name: str, value: float, span: Span) -> None:
        self.name, self.value, self.span = name, value, span


class Edge:
    """A current path between two nodes. role: "conducts", "voltage", "inductor", "blocks", "drives"; `winding` is which of
    several, ",2"."""

    __slots__ = ("a", "b", "of", "role", "winding")

    def __init__(
        self, of: Element | MachineCard | Start, a: str, b: str, role: str, winding: str = ""
    ) -> None:
        self.of, self.role, self.winding = of, role, winding
        self.a, self.b = GROUND if a == "gnd" else a, GROUND if b == "gnd" else b

    @property
    def name(self) -> str:
        return self.of.name

    @property
    def span(self) -> Span:
        return self.of.span


class Parts:
    """Union-find over node names."""

    def __init__(self) -> None:
        self.parent: dict[str, str] = {}

    def root(self, x: str) -> str:
        parent = self.parent
        above = parent.setdefault(x, x)
        while above != x:
            parent[x] = x = parent[above]
            above = parent[x]
        return x

    def join(self, a: str, b: str) -> bool:
        """False when they were together already."""
        ra, rb = self.root(a), self.root(b)
        if ra == rb:
            return False
        # ground stays a root
        if rb == GROUND:
            ra, rb = rb, ra
        self.parent[rb] = ra
        return True


def check(ctx: Context) -> None:
    """All checks; reports to the sink and stamps what makes the harmless cases solvable."""
    edges = [*_circuit_edges(ctx), *_machine_edges(ctx)]
    _voltage_loops(ctx, edges)
    _undriven(ctx, edges)
    _unwired(ctx, edges)
    _dc_paths(ctx, edges)


# ---- the graph ---------------------------------------------------------------------------------


def _circuit_edges(ctx: Context) -> Iterator[Edge]:
    for e in ctx.elements.values():
        nodes = e.nodes
        for a, b, role in e.paths():
            yield Edge(e, nodes[a], nodes[b], role)


def _machine_edges(ctx: Context) -> Iterator[Edge]:
    """What the coupling cards connect electrically."""
    for card in ctx.flat.machine:
        nodes = [ref.name for ref in card.args]
        if card.kind == "MOTOR" and len(nodes) >= 2:
            yield from _windings(ctx, card, nodes)
        elif card.kind == "POT" and len(nodes) >= 3:
            yield Edge(card, nodes[0], nodes[1], "conducts")
            yield Edge(card, nodes[1], nodes[2], "conducts")
        elif card.kind == "MAGNETIC" and len(nodes) >= 4:
            yield Edge(card, nodes[2], nodes[3], "inductor")
        elif card.kind == "TRANSDUCER" and card.groups:
            for k in range(card.groups[0] // 2):
                yield Edge(card, nodes[2 * k], nodes[2 * k + 1], "inductor", f",{k + 1}")
        elif card.kind == "TRANSDUCER" and len(nodes) >= 2:
            params = card.params
            role = (
                "blocks"
                if "c" in params
                else "inductor"
                if "l" in params
                else "voltage"
                if "k" in params
                else None
            )
            if role is None:  # W=: of its own voltage like a capacitor, of its own current like an inductor
                w = params.get("w")
                reads_v = isinstance(w, Node) and any(c.fn == "v" for c in calls(w))
                role = "blocks" if reads_v else "inductor"
            yield Edge(card, nodes[0], nodes[1], role)


def _windings(ctx: Context, card: MachineCard, nodes: list[str]) -> Iterator[Edge]:
    """What a motor connects: two ends of a winding, or the phases of a star."""
    model = ctx.flat.models.get(str(getattr(card.params.get("model"), "id", card.params.get("model"))))
    params = {**(model.params if model else {}), **card.params}

    def role(*resistances: str) -> str:
        return "conducts" if any(params.get(key) for key in resistances) else "inductor"

    kind = model.type if model is not None else ""
    if kind in ("dcwound", "stepper") and len(nodes) >= 4:
        first, second = (("ra", "rs"), ("rf",)) if kind == "dcwound" else (("r",), ("r",))
        yield Edge(card, nodes[0], nodes[1], role(*first), ",1")
        yield Edge(card, nodes[2], nodes[3], role(*second), ",2")
    elif kind in ("pmsm", "bldc", "induction") and len(nodes) >= 4:
        ends = nodes[:-1]
        pairs = [(node, ends[3]) for node in ends[:3]] if len(ends) == 4 else [*pairwise(ends)]
        for k, (a, b) in enumerate(pairs):
            yield Edge(card, a, b, role("r", "rs", "rtt"), f",{k + 1}")
    else:
        yield Edge(card, nodes[0], nodes[1], role("r", "istall"))


def _imposes(ctx: Context, edge: Edge) -> bool:
    """Is it a source of its own, or a voltage set by .ic, that is not zero at the start?"""
    if isinstance(edge.of, Start):
        return edge.of.value != 0.0
    return edge.role in ("voltage", "drives") and isinstance(edge.of, Element) and edge.of.imposes(ctx)


def _forced(ctx: Context) -> Iterator[Edge]:
    """Nodes that .ic holds while the start of a run is sought."""
    if _needs_point(ctx) and any(a.kind == "tran" for a in ctx.flat.analyses):
        for name, value, span in ctx.flat.ics:
            if name in ctx.nodes:
                yield Edge(Start(f".ic v({name})", float(value), span), name, GROUND, "voltage")


# ---- 1. loops of voltages ----------------------------------------------------------------------


def _voltage_loops(ctx: Context, edges: list[Edge]) -> None:
    parts = Parts()
    tree: dict[str, list[Edge]] = {}
    voltages = [e for e in edges if e.role == "voltage"]
    inductors = [e for e in edges if e.role == "inductor"]
    for edge in [*voltages, *_forced(ctx), *inductors]:
        if parts.join(edge.a, edge.b):
            tree.setdefault(edge.a, []).append(edge)
            tree.setdefault(edge.b, []).append(edge)
            continue
        loop = [edge] if edge.a == edge.b else [*_path(tree, edge.a, edge.b), edge]
        if edge.role == "voltage" and isinstance(edge.of, Start):
            continue  # the node of a source: what the source says holds
        names = " ".join(f"`{e.name}`" for e in loop)
        labels = [(e.span, "in the loop") for e in loop[:-1]]
        if edge.role == "voltage":
            what = "has both ends at one node" if len(loop) == 1 else f"closes a loop of voltages: {names}"
            ctx.sink.error(
                "E301", f"`{edge.name}` {what}", edge.span, labels=labels,
                hint="a small resistor in series with one of them makes the currents definite",
            )  # fmt: skip
            continue
        row = ctx.branch(edge.name + edge.winding)
        if row is None:
            continue
        ctx.b.g(row, row, LOOP_RESISTANCE)
        if all(e.role != "voltage" for e in loop):
            continue  # coils alone: they share the current
        if _keeps_its_current(edge):
            # nothing limits its current at rest: a run starts with what its card says, as under UIC
            ctx.starting.add(edge.name + edge.winding)
            ctx.b.start_current(row, edge.of.number("ic") if isinstance(edge.of, Element) else 0.0)
        if any(_imposes(ctx, e) for e in loop) and _needs_point(ctx):
            motor = any(e.name in ctx.machine.couplings for e in loop) if ctx.machine is not None else False
            what, cure = (
                ("a motor winding", "give the MOTOR its r=")
                if motor
                else ("inductors", "put a resistor in series, or start with UIC")
            )
            ctx.sink.warning(
                "W301", f"a DC voltage stands across {what} without resistance: {names}",
                edge.span, labels=labels,
                hint=f"at DC the current is as good as infinite; a run starts with ic=, or 0 A; {cure}",
            )  # fmt: skip


def _keeps_its_current(edge: Edge) -> bool:
    """Does an inductance hold the current, so that a run can start with any?"""
    return (
        edge.of.kind != "MOTOR" or bool(edge.winding) or bool(edge.of.params.get("l"))
        if isinstance(edge.of, MachineCard)
        else True
    )


def _path(tree: dict[str, list[Edge]], start: str, goal: str) -> list[Edge]:
    """Edges from start to goal in the forest built so far."""
    came: dict[str, Edge | None] = {start: None}
    queue = [start]
    for node in queue:
        if node == goal:
            break
        for edge in tree.get(node, ()):
            other = edge.b if edge.a == node else edge.a
            if other not in came:
                came[other] = edge
                queue.append(other)
    path: list[Edge] = []
    node = goal
    while (edge := came[node]) is not None:  # type: ignore[assignment]
        path.append(edge)
        node = edge.a if edge.b == node else edge.b
    return path


# ---- 2. to 4. nodes without a path ------------------------------------------------------------


def _undriven(ctx: Context, edges: list[Edge]) -> None:
    """Nodes that stand only where elements read."""
    carrying = {node: None for e in edges for node in (e.a, e.b)}
    for e in ctx.elements.values():
        for node in e.reads():
            if node not in carrying and node not in ("0", "gnd"):
                ctx.unknown(
                    "E302", f"`{e.name}` reads node `{node}`, which nothing drives", node, carrying, e.span
                )


def _unwired(ctx: Context, edges: list[Edge]) -> None:
    """Motors and transducers with a node to which nothing else is connected: no current can flow."""
    ends: dict[str, int] = {}
    for e in edges:
        for node in (e.a, e.b):
            ends[node] = ends.get(node, 0) + 1
    for e in edges:
        kind = getattr(e.of, "kind", "")
        if kind not in ("MOTOR", "TRANSDUCER"):
            continue
        for node in (e.a, e.b):
            if ends[node] == 1 and node != GROUND:
                # the other half of a misspelt name stands alone as well
                alone = [n for n, count in ends.items() if count == 1 and n not in (node, GROUND)]
                near = suggest(node, [n for n in ends if n != node])
                likely = " or ".join(f"`{n}`" for n in ([near] if near else alone[:3]))
                ctx.sink.warning(
                    "W304", f"nothing but {kind} {e.name} is connected to node `{node}`: no current can flow", e.span,
                    f"did you mean {likely}?" if likely else "a source or a load belongs there",
                )  # fmt: skip


def _needs_point(ctx: Context) -> bool:
    """Does any analysis look for an operating point?"""
    return not ctx.flat.analyses or any(a.kind != "tran" or "uic" not in a.flags for a in ctx.flat.analyses)


def _dc_paths(ctx: Context, edges: list[Edge]) -> None:
    direct, any_path = Parts(), Parts()
    for e in edges:
        if e.role in ("conducts", "voltage", "inductor"):
            direct.join(e.a, e.b)
        if e.role != "drives":
            any_path.join(e.a, e.b)
    carrying = {GROUND: None} | {node: None for e in edges for node in (e.a, e.b)}
    floating: dict[str, list[str]] = {}
    ground = direct.root(GROUND)
    for node in carrying:
        root = direct.root(node)
        if root != ground:
            floating.setdefault(root, []).append(node)
    # by floating part: what ties it to the rest, and the first lines that name it
    ties: dict[str, list[Edge]] = {}
    lines: dict[str, list[Edge]] = {}
    for e in edges if floating else ():
        for root in {direct.root(e.a), direct.root(e.b)}:
            if root != ground:
                if e.role in ("drives", "blocks"):
                    ties.setdefault(root, []).append(e)
                if len(known := lines.setdefault(root, [])) < 3:
                    known.append(e)

    shunted: set[str] = set()
    for root, members in floating.items():
        near = ties.get(root, [])
        labels = [(e.span, "connected here") for e in lines.get(root, ())]
        shown = ", ".join(f"`{n}`" for n in members[:4]) + (" ..." if len(members) > 4 else "")
        shown = f"node {shown} has" if len(members) == 1 else f"nodes {shown} have"
        whole = any_path.root(root)
        if whole != any_path.root(GROUND) and whole not in shunted:
            # not even a capacitor ties it to the rest
            shunted.add(whole)
            source = next((e for e in near if e.role == "drives" and _imposes(ctx, e)), None)
            if source is not None and not any(e.role == "blocks" or not _imposes(ctx, e) for e in near):
                ctx.sink.error(
                    "E303", f"the current of `{source.name}` has nowhere to go: {shown} no path to ground",
                    source.span, labels=labels,
                    hint=f"a resistor or a capacitor from node `{members[0]}` to ground gives it a way",
                )  # fmt: skip
                continue
            row = ctx.node(members[0])
            ctx.b.g(row, row, ctx.gmin or 1e-12)
            ctx.sink.warning(
                "W302",
                f"{shown} no path to ground, so 1 TOhm to ground is assumed",
                _first(labels),
                "connect one of them to node 0, unless a name is misspelt",
                labels=labels[1:],
            )
            continue
        if any(n in ctx.ics for n in members) or not _needs_point(ctx):
            continue
        ctx.b.force(ctx.node(members[0]), 0.0, "ic")
        ctx.sink.warning(
            "W303", f"{shown} no DC path to ground, and start{'s' if len(members) == 1 else ''} at 0 V",
            _first(labels), labels=labels[1:],
            hint=f"a large resistor to ground, or .ic v({members[0]})=..., or UIC decides otherwise",
        )  # fmt: skip


def _first(labels: list[tuple[Span, str]]) -> Span | None:
    return labels[0][0] if labels else None
