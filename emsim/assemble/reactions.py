"""Reactions: what a joint, a gear or a drive transmits.

Where a joint is cut, its multipliers are the forces: R = sum lambda dh/ds for a virtual motion s of B. Along
the tree the virtual motion is part of the kinematics and its own equation of motion gives
    R = d/dt(dL/ds') - dL/ds - powers - loops        at s = 0,
one more unknown with Q = dL/ds' (in F as a derivative where it is an expression of time alone), made only for
what a deck reads. Forces in N, moments about the joint's point in N m, on B from A, in world axes; along a free
direction of the joint R is 0 (see torque(c) for what acts there). Where a DRIVE or a GEAR acts on the joint's
coordinate without an equation of its own, its effort is in R and is projected out.
"""

from __future__ import annotations

from ..cards.kinematics import is_zero, settle, times
from .asked import FORCES, REACTIONS
from .coordinates import single
from .scene import Virtual, displaced
from .start import RANK

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from .loops import Row
    from .mechanism import Mechanism
    from .scene import JointState


LOADED = ("pin", "slide")  # kinds whose parts press on each other in one place
NOTHING = 1e-18  # [N^2] keeps the slope of a force that is 0


def prepare(m: Mechanism) -> None:
    """Virtual motions at the tree joints whose reactions are read; before frames are placed."""
    for fn, name in sorted(m.wanted):
        key = REACTIONS.get(fn)
        joint = m.joints.get(name)
        if key is None or joint is None or joint.cut:
            continue
        for needed in [key, *_companions(m, joint, key)]:
            if needed not in joint.virtuals:
                virtual = joint.virtuals[needed] = Virtual(m.b, *needed)
                m.virtuals.append(virtual)


def _companions(m: Mechanism, joint: JointState, key: tuple[str, int]) -> list[tuple[str, int]]:
    """The other components that the projection of a reaction across the free axis reads."""
    kind = key[0]
    if not _moved_by_others(m, joint, kind):
        return []
    axes: tuple[int, ...] = (0, 1, 2) if in_space(m) else (0, 1) if kind == "shift" else ()
    return [(kind, k) for k in axes]


def in_space(m: Mechanism) -> bool:
    return m.gravity[2] != 0.0 or any(j.kind.leaves_plane() for j in m.joints.values())


def _moved_by_others(m: Mechanism, joint: JointState, kind: str) -> bool:
    """Does a DRIVE or a GEAR act on the joint's coordinate, a motion of this kind, without a row of its own?"""
    c = single(joint)
    if c is None or (kind == "turn") != c.rotary:
        return False
    return c.drive is not None or any(c is tie.follower or c is tie.leader for tie in m.ties.values())


def of_joint(m: Mechanism, fn: str, joint: JointState) -> Expr:
    """fx fy fz mx my mz of a joint."""
    key, unit = REACTIONS[fn], "N" if fn in FORCES else "N m"
    if joint.cut:
        if any(row.row < 0 for row in m.rows if row.owner == joint.name):
            # read by a card before there are multipliers: an unknown, its row filled in later
            name = f"{fn}({joint.name})"
            if name not in m.derivatives:
                index = m.derivatives[name] = m.b.unknown(name, "derivative", unit, 0.0)
                m.b.g(index, index, -1.0)
                m.at_cuts.append((index, joint, key))
            return m.b.x(m.derivatives[name])
        return _from_multipliers(m, joint, *key)
    if key not in joint.virtuals:
        raise KeyError(f"{fn}({joint.name}) was not announced before the scene was built")
    if not _moved_by_others(m, joint, key[0]):
        return motion(m, f"{fn}({joint.name})", unit, joint.virtuals[key])
    # R - (R axis) axis
    axis = [settle(m.public(e)) for e in times(m.frames[joint.a].rot.matrix(), joint.kind.axis_of("axis"))]
    result = m.b.const(0.0)
    for (kind, k), virtual in joint.virtuals.items():
        if kind != key[0]:
            continue
        weight = settle((1.0 if k == key[1] else 0.0) - axis[key[1]] * axis[k])
        if not is_zero(weight):
            name = f"{fn[0]}{'xyz'[k]}({joint.name})"
            result = result + weight * motion(m, name, unit, virtual)
    return result


def load(m: Mechanism, name: str) -> Expr | None:
    """With how much force the parts of a joint press on each other across its free direction [N]; moments are left out. None for
    kinds without such a place."""
    joint = m.joints[name]
    if joint.kind.name not in LOADED:
        return None
    if not in_space(m):
        fx, fy = (of_joint(m, fn, joint) for fn in ("fx", "fy"))
        if joint.rotary:
            return m.b.call("sqrt", fx * fx + fy * fy + NOTHING)
        # along the slide there is none
        x, y, _ = (m.public(e) for e in times(m.frames[joint.a].rot.matrix(), joint.kind.axis_of("axis")))
        return m.abs(x * fy - y * fx)
    square = m.b.const(NOTHING)
    for fn in FORCES:
        part = of_joint(m, fn, joint)
        square = square + part * part
    return m.b.call("sqrt", square)


def motion(m: Mechanism, name: str, unit: str, what: Any) -> Expr:
    """The force that keeps a virtual or prescribed motion: an unknown, its row filled in when L is known; a
    mere expression where L is known already and the momentum is one of time alone."""
    if m.momentum:
        p, force = m.momentum[id(what)]
        known = m.time_derivative(p)
        if known is not None:
            return known - force
    index = m.derivatives.get(name)
    if index is None:
        index = m.derivatives[name] = m.b.unknown(name, "derivative", unit, 0.0)
        m.b.g(index, index, -1.0)
        if m.momentum:
            _fill(m, index, what)
        else:
            m.waiting.append((index, what))
    return m.b.x(index)


def fill_waiting(m: Mechanism) -> None:
    """Rows of reactions that were read before the equations stood."""
    for index, what in m.waiting:
        _fill(m, index, what)
    m.waiting.clear()
    for index, joint, key in m.at_cuts:
        m.b.add_f(index, _from_multipliers(m, joint, *key))
    m.at_cuts.clear()


def _fill(m: Mechanism, index: int, what: Any) -> None:
    p, force = m.momentum[id(what)]
    known = m.time_derivative(p)
    if known is None:
        m.b.add_q(index, p)
        m.b.add_f(index, -force)
    else:
        m.b.add_f(index, known - force)


def _from_multipliers(m: Mechanism, joint: JointState, kind: str, axis: int) -> Expr:
    """sum of lambda dh/ds, s moving B at the cut joint."""
    virtual = Virtual(m.b, kind, axis)
    frame = displaced(m.frames[joint.b], joint.pb, virtual)
    rows = joint.closure(m.b, m.frames[joint.a], frame)
    result = m.b.const(0.0)
    here = [(virtual.s, m.b.const(0.0)), (virtual.rate, m.b.const(0.0))]
    for row in m.rows:
        if row.owner == joint.name:
            h = m.b.const(0.0) + rows[row.place][1]
            weight = m.b.substitute(m.b.grad(h, [virtual.s]), here)[0]
            result = result + m.b.x(row.row) * weight
    return m.public(result)


def not_unique(m: Mechanism) -> list[str]:
    """Reactions that the deck reads and that equilibrium does not determine, where rows are redundant. Multipliers are known up
    to z with z^T H = 0; a reaction sum lambda dh/ds is unique where dh/ds is in the range of H."""
    rows, jacobian, x = m.found.all_rows, m.found.jacobian, m.found.x
    whole = m.b.rank(jacobian, RANK)[0]
    found = []
    for fn, name in sorted(m.wanted, key=lambda one: (one[1], one[0])):
        key, joint = REACTIONS.get(fn), m.joints.get(name)
        if key is not None and joint is not None:
            slopes = _slopes(m, joint, key, rows)
        elif name in m.couplings:
            slopes = [m.b.const(float(row.owner == name)) for row in rows]
        else:
            continue
        column = m.b.eval(m.public_all(slopes), x, 0.0)
        wider = [[*row, v] for row, v in zip(jacobian, column, strict=True)]
        if any(column) and m.b.rank(wider, RANK)[0] > whole:
            found.append(f"{fn}({name})")
    return found


def _slopes(m: Mechanism, joint: JointState, key: tuple[str, int], rows: list[Row]) -> list[Expr]:
    """dh/ds of all rows, s the virtual motion of B."""
    if not joint.cut:
        s = joint.virtuals[key].s
        return [m.b.grad(row.h, [s])[0] for row in rows]
    virtual = Virtual(m.b, *key)
    own = joint.closure(m.b, m.frames[joint.a], displaced(m.frames[joint.b], joint.pb, virtual))
    here = [(virtual.s, m.b.const(0.0)), (virtual.rate, m.b.const(0.0))]
    zero = m.b.const(0.0)
    return [
        m.b.substitute(m.b.grad(zero + own[row.place][1], [virtual.s]), here)[0]
        if row.owner == joint.name
        else zero
        for row in rows
    ]


def of_coupling(m: Mechanism, name: str) -> Expr:
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
