"""Reactions: what a joint, a gear or a drive transmits.

Where a joint is cut, its multipliers are the forces: R = sum lambda dh/ds for a virtual motion s of B. Along
the tree the virtual motion is part of the kinematics and its own equation of motion gives
    R = d/dt(dL/ds') - dL/ds - powers - loops        at s = 0,
one more unknown with Q = dL/ds', made only for what a deck reads. Forces in N, moments about the joint's
point in N m, on B from A, in world axes; along a free direction of the joint R is 0 (see torque(c) for what
acts there).
"""

from __future__ import annotations

from ..expr import Name
from .scene import Virtual, displaced

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from typing import Any

    from .._engine import Expr
    from .machine import Machine
    from .scene import JointState

FORCES = {"fx": ("shift", 0), "fy": ("shift", 1), "fz": ("shift", 2)}
MOMENTS = {"mx": ("turn", 0), "my": ("turn", 1), "mz": ("turn", 2)}
REACTIONS = {**FORCES, **MOMENTS}
EFFORTS = ("force", "torque", "power", "p")


def wanted(flat: Any) -> set[tuple[str, str]]:
    """(function, name) of every call in the deck that may need a reaction."""
    found: set[tuple[str, str]] = set()
    for call in _calls(_expressions(flat)):
        if (
            (call.fn in REACTIONS or call.fn in EFFORTS)
            and len(call.args) == 1
            and isinstance(call.args[0], Name)
        ):
            found.add((call.fn, call.args[0].id))
    return found


def _expressions(flat: Any) -> Iterator[Any]:
    for e in flat.elements:
        yield e.value
        if e.params:
            yield from e.params.values()
        if e.extra:
            yield from e.extra.values()
    for card in flat.machine:
        yield from card.params.values()
    for request in flat.prints:
        yield from (ast for _, ast in request.items)
    for probe in (*flat.saves, *flat.probes):
        yield probe.ast
    for analysis in flat.analyses:
        yield from analysis.args


def _calls(nodes: Iterable[Any]) -> Iterator[Any]:
    stack = list(nodes)
    while stack:
        node = stack.pop()
        if node is None or isinstance(node, (int, float, str)):
            continue
        if isinstance(node, (list, tuple)):
            stack.extend(node)
            continue
        if hasattr(node, "fn"):
            yield node
            stack.extend(node.args)
        else:
            stack.extend(getattr(node, part, None) for part in ("a", "b", "c"))


def prepare(m: Machine) -> None:
    """Virtual motions at the tree joints whose reactions are read; before frames are placed."""
    for fn, name in sorted(m.wanted):
        key = REACTIONS.get(fn)
        joint = m.joints.get(name)
        if key is None or joint is None or joint.cut:
            continue
        virtual = Virtual(m.b, *key)
        joint.virtuals[key] = virtual
        m.virtuals.append(virtual)


def of_joint(m: Machine, fn: str, joint: JointState) -> Expr:
    """fx fy fz mx my mz of a joint."""
    key, unit = REACTIONS[fn], "N" if fn in FORCES else "N m"
    if joint.cut:
        return _from_multipliers(m, joint, *key)
    virtual = joint.virtuals.get(key)
    if virtual is None:
        raise KeyError(f"{fn}({joint.name}) was not announced before the scene was built")
    return motion(m, f"{fn}({joint.name})", unit, virtual)


def motion(m: Machine, name: str, unit: str, what: Any) -> Expr:
    """The force that keeps a virtual or prescribed motion: an unknown, its row filled in when L is known."""
    index = m.derivatives.get(name)
    if index is None:
        index = m.derivatives[name] = m.b.unknown(name, "derivative", unit, 0.0)
        m.b.g(index, index, -1.0)
        if m.momentum:
            _fill(m, index, what)
        else:
            m.waiting.append((index, what))
    return m.b.x(index)


def fill_waiting(m: Machine) -> None:
    """Rows of reactions that were read before the equations stood."""
    for index, what in m.waiting:
        _fill(m, index, what)
    m.waiting.clear()


def _fill(m: Machine, index: int, what: Any) -> None:
    p, force = m.momentum[id(what)]
    m.b.add_q(index, p)
    m.b.add_f(index, -force)


def _from_multipliers(m: Machine, joint: JointState, kind: str, axis: int) -> Expr:
    """sum of lambda dh/ds, s moving B at the cut joint."""
    from .loops import closure

    virtual = Virtual(m.b, kind, axis)
    frame = displaced(m.frames[joint.b], joint.pb, virtual)
    rows = closure(m.b, joint, m.frames[joint.a], frame)
    result = m.b.const(0.0)
    here = [(virtual.s, m.b.const(0.0)), (virtual.rate, m.b.const(0.0))]
    for row in m.rows:
        if row.owner == joint.name:
            h = m.b.const(0.0) + rows[row.place][1]
            weight = m.b.substitute(m.b.grad(h, [virtual.s]), here)[0]
            result = result + m.b.x(row.row) * weight
    return m.public(result)


def of_coupling(m: Machine, name: str) -> Expr:
    """What a GEAR applies on its first joint, or a DRIVE on its joint."""
    for row in m.rows:
        if row.owner == name:
            return m.b.x(row.row)
    for c in m.given:
        if c.drive is not None and c.drive.name == name:
            return motion(m, f"{'torque' if c.rotary else 'force'}({name})", "N m" if c.rotary else "N", c)
    for tie in m.ties.values():
        if tie.gear.name == name and tie.virtual is not None:
            on_follower = motion(m, f"effort({name})", "N m" if tie.follower.rotary else "N", tie.virtual)
            if tie.follower.of == tie.gear.terminals[0][2].name:
                return on_follower
            return -tie.factor * on_follower  # the two efforts do no work together
    return m.b.const(0.0)
