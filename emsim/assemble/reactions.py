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
from .asked import FORCES, LOAD, REACTIONS
from .coordinates import single
from .scene import FREE, Virtual, displaced

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .._engine import Expr
    from ..cards.kinematics import Scalar
    from .mechanism import Mechanism
    from .scene import Coordinate, JointState


OUT_OF_PLANE = ("fz", "mx", "my")
EFFORT = "effort"  # of a coupling, be it a force or a moment; "effort,1": of its second row
LOADED = ("pin", "slide")  # kinds whose parts press on each other in one place
NOTHING = 1e-18  # [N^2] keeps the slope of a force that is 0


def prepare(m: Mechanism) -> None:
    """Virtual motions at the tree joints whose reactions are read, at all of them where loads are shared; before frames are
    placed."""
    if any(fn == LOAD for fn, _ in m.wanted):
        forces = [fn for fn in FORCES if in_space(m) or fn != "fz"]
        m.wanted = {(fn, name) for word, name in m.wanted for fn in (forces if word == LOAD else (word,))}
    asked = sorted(m.wanted)
    if m.shares:
        asked += [(fn, name) for name in m.joints if name[:1] != FREE for fn in words(m)]
    for fn, name in asked:
        key = REACTIONS.get(fn)
        joint = m.joints.get(name)
        if key is None or joint is None or joint.cut:
            continue
        for needed in [key, *_companions(m, joint, key)]:
            if needed not in joint.virtuals:
                virtual = joint.virtuals[needed] = Virtual(m.b, *needed)
                m.virtuals.append(virtual)


def words(m: Mechanism) -> list[str]:
    """The components that a reaction has: out of the plane only in space, or where the deck reads them."""
    space = in_space(m) or any(fn in OUT_OF_PLANE and name in m.joints for fn, name in m.wanted)
    return [fn for fn in REACTIONS if space or fn not in OUT_OF_PLANE]


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
    early = any(row.row < 0 for row in m.rows if row.owner == joint.name) if joint.cut else False
    if early or (m.shares and not m.has_multipliers):
        # read by a card before there are multipliers: an unknown, its row filled in later
        name = f"{fn}({joint.name})" if not m.shares else f"{fn}({joint.name},shared)"
        if name not in m.derivatives:
            unit = "N" if fn in FORCES else "N m"
            index = m.derivatives[name] = m.b.unknown(name, "derivative", unit, 0.0)
            m.b.g(index, index, -1.0)
            m.early.append((index, joint, fn))
        return m.b.x(m.derivatives[name])
    return _shared(m, fn, joint.name)


def _shared(m: Mechanism, fn: str, name: str) -> Expr:
    """With the part of it that equilibrium does not determine."""
    share = m.sharing.share(fn, name) if m.sharing is not None else None
    return bare(m, fn, name) if share is None else bare(m, fn, name) + share


def bare(m: Mechanism, fn: str, name: str) -> Expr:
    """A reaction or an effort, with nothing at rows that were left out."""
    joint = m.joints.get(name)
    if joint is None or fn not in REACTIONS:
        return _of_coupling(m, name, int(fn.partition(",")[2]))
    key, unit = REACTIONS[fn], "N" if fn in FORCES else "N m"
    if joint.cut:
        return _from_multipliers(m, joint, *key)
    if key not in joint.virtuals:
        raise KeyError(f"{fn}({name}) was not announced before the scene was built")
    if not _moved_by_others(m, joint, key[0]):
        return motion(m, f"{fn}({name})", unit, joint.virtuals[key])
    result = m.b.const(0.0)
    for weight, (kind, k) in across(m, joint, key):
        result = result + weight * motion(m, f"{fn[0]}{'xyz'[k]}({name})", unit, joint.virtuals[kind, k])
    return result


def across(m: Mechanism, joint: JointState, key: tuple[str, int]) -> list[tuple[Scalar, tuple[str, int]]]:
    """The virtual motions whose forces make up a component, with their weights: R - (R axis) axis where others act on the
    coordinate."""
    if not _moved_by_others(m, joint, key[0]):
        return [(1.0, key)]
    axis = [settle(m.public(e)) for e in times(m.frames[joint.a].rot.matrix(), joint.kind.axis_of("axis"))]
    found: list[tuple[Scalar, tuple[str, int]]] = []
    for kind, k in joint.virtuals:
        if kind == key[0]:
            weight = settle((1.0 if k == key[1] else 0.0) - axis[key[1]] * axis[k])
            if not is_zero(weight):
                found.append((weight, (kind, k)))
    return found


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
    for index, joint, fn in m.early:
        m.b.add_f(index, _shared(m, fn, joint.name))
    m.early.clear()


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
    slopes = own_slopes(m, joint, (kind, axis))
    result = m.b.const(0.0)
    for row in m.rows:
        if row.owner == joint.name:
            result = result + m.b.x(row.row) * slopes[row.place]
    return m.public(result)


def own_slopes(m: Mechanism, joint: JointState, key: tuple[str, int]) -> list[Expr]:
    """dh/ds of all closure rows of a cut joint, also of those that fold, s moving B there; before symbols are replaced."""
    virtual = Virtual(m.b, *key)
    rows = joint.closure(m.b, m.frames[joint.a], displaced(m.frames[joint.b], joint.pb, virtual))
    here = [(virtual.s, m.b.const(0.0)), (virtual.rate, m.b.const(0.0))]
    return [m.b.substitute(m.b.grad(m.b.const(0.0) + h, [virtual.s]), here)[0] for _, h, _ in rows]


def of_coupling(m: Mechanism, name: str, place: int = 0) -> Expr:
    """What a GEAR applies on its first joint, or a DRIVE on its joint; what a row of a card does."""
    return _shared(m, f"{EFFORT},{place}", name)


def _of_coupling(m: Mechanism, name: str, place: int) -> Expr:
    for row in m.rows:
        if row.owner == name and row.place == place:
            return m.b.x(row.row)
    what = keeper(m, name)
    if what is None:
        return m.b.const(0.0)
    kept, factor = what
    if isinstance(kept, Virtual):
        tie = next(tie for tie in m.ties.values() if tie.virtual is kept)
        effort = motion(m, f"effort({name})", "N m" if tie.follower.rotary else "N", kept)
    else:
        effort = motion(
            m, f"{'torque' if kept.rotary else 'force'}({name})", "N m" if kept.rotary else "N", kept
        )
    return effort if factor == 1.0 else factor * effort


def keeper(m: Mechanism, name: str) -> tuple[Coordinate | Virtual, float] | None:
    """The motion that a DRIVE or a GEAR without a row of its own keeps, and its effort over the force that this takes."""
    for c in m.given:
        if c.drive is not None and c.drive.name == name:
            return c, 1.0
    for tie in m.ties.values():
        if tie.gear.name == name and tie.virtual is not None:
            # the two efforts do no work together
            return tie.virtual, 1.0 if tie.follower.of == tie.gear.terminals[0][2].name else -tie.factor
    return None
