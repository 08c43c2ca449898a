"""Which coordinates a scene needs: the tree joints' own, less those that a DRIVE prescribes or a GEAR ties.

Replacing a coordinate is preferred to adding an equation: "model no more than the scene needs".
"""

from __future__ import annotations

from math import pi

from ..cards.joints.planar import Planar
from .scene import Coordinate, Group, Tie, Virtual

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..cards.body import Body
    from ..cards.drive import Drive
    from ..cards.gear import Gear
    from .mechanism import Mechanism
    from .scene import JointState

AGREE = 1e-9  # two start values that differ by less say the same


def of_joint(joint: JointState) -> list[Coordinate]:
    """The coordinates of a tree joint with their start values."""
    kind, card = joint.kind, joint.card
    places: list[Coordinate] = []
    speeds: list[Coordinate] = []
    if kind.quasi:
        places = [Coordinate(joint.name, c, None) for c in kind.coordinates]
        speeds = [Coordinate(joint.name, None, c) for c in kind.speeds]
    else:
        pairs = zip(kind.coordinates, kind.speeds, strict=True)
        places = speeds = [Coordinate(joint.name, place, speed) for place, speed in pairs]
    for c, start, search in zip(places, card.start, card.search, strict=True):
        c.start, c.held = (search, False) if start is None else (start, True)
    for c, speed in zip(speeds, card.speed, strict=True):
        if speed is not None:
            c.start_speed, c.held_speed = speed, True
    return [*places, *speeds] if kind.quasi else places


def of_free_body(body: Body) -> list[Coordinate]:
    """x, y and angle of a body that no joint ties to ground."""
    result = []
    words = (("x", "vx"), ("y", "vy"), ("angle", "omega"))
    for place, speed, (q, u) in zip(Planar.coordinates, Planar.speeds, words, strict=True):
        c = Coordinate(body.name, place, speed)
        c.start, c.held = getattr(body, q), body.given(q)
        c.start_speed, c.held_speed = getattr(body, u), body.given(u)
        result.append(c)
    return result


def single(joint: JointState) -> Coordinate | None:
    """The coordinate of a tree joint that has exactly one."""
    return joint.coordinates[0] if joint.single and joint.coordinates else None


def drives_and_gears(m: Mechanism) -> tuple[list[Drive], list[tuple[Gear, float]]]:
    """Replace coordinates where possible; returns the drives and gears that need a constraint row."""
    rows_drive: list[Drive] = []
    for drive in m.drives:
        joint = m.joints[drive.terminals[0][2].name]
        c = single(joint)
        if c is None:
            rows_drive.append(drive)
        elif c.drive is not None:
            m.sink.error(
                "E245",
                f"joint {joint.name} is driven twice, by {c.drive.name} and {drive.name}",
                drive.span,
                "leave one out; what pushes beside a DRIVE is a TORQUE or a FORCE",
            )
        else:
            c.drive = drive

    rows_gear: list[tuple[Gear, float]] = []
    for gear in m.gears:
        j1, j2 = (m.joints[ref.name] for _, _, ref in gear.terminals)
        factor = _factor(m, gear, j1, j2)
        if factor is None:
            continue
        c1, c2 = single(j1), single(j2)
        if c1 is None or c2 is None or gear.rubs:
            rows_gear.append((gear, factor))
        elif _free(m, c1) and _leader(m, c2) is not c1:
            m.ties[id(c1)] = Tie(gear, c1, c2, factor)
        elif _free(m, c2) and _leader(m, c1) is not c2:
            m.ties[id(c2)] = Tie(gear, c2, c1, 1.0 / factor)
        elif _leader(m, c1).drive is not None and _leader(m, c2).drive is not None:
            m.sink.error(
                "E245",
                f"GEAR {gear.name} ties {j1.name} and {j2.name}, and both are driven already",
                gear.span,
                "leave out one DRIVE, or the gear",
            )
        else:
            _contradiction(m, gear, factor, c1, c2)
            rows_gear.append((gear, factor))
    return rows_drive, rows_gear


def _factor(m: Mechanism, gear: Gear, j1: JointState, j2: JointState) -> float | None:
    """q(j1) / q(j2)"""
    for joint in (j1, j2):
        if not joint.single:
            m.sink.error(
                "E241",
                f"GEAR {gear.name} needs pins or slides; {joint.name} is a {joint.kind.name}",
                gear.span,
            )
            return None
    if gear.lead is None:
        assert gear.ratio is not None
        return gear.ratio
    if j1.rotary == j2.rotary:
        m.sink.error("E240", f"lead= of GEAR {gear.name} couples a slide and a pin", gear.place("lead"))
        return None
    per_radian = gear.lead / (2.0 * pi)
    return 1.0 / per_radian if j1.rotary else per_radian


def _free(m: Mechanism, c: Coordinate) -> bool:
    return c.drive is None and id(c) not in m.ties


def _leader(m: Mechanism, c: Coordinate) -> Coordinate:
    """The coordinate at the end of a chain of gears."""
    while (tie := m.ties.get(id(c))) is not None:
        c = tie.leader
    return c


def _chain(m: Mechanism, c: Coordinate) -> tuple[float, list[Gear]]:
    """q(c) / q(leader), and the gears between."""
    factor, gears = 1.0, []
    while (tie := m.ties.get(id(c))) is not None:
        factor *= tie.factor
        gears.append(tie.gear)
        c = tie.leader
    return factor, gears


def _contradiction(m: Mechanism, gear: Gear, factor: float, c1: Coordinate, c2: Coordinate) -> None:
    """A gear between coordinates that others tie already, by another ratio, leaves only rest."""
    if _leader(m, c1) is not _leader(m, c2):
        return
    (f1, gears1), (f2, gears2) = _chain(m, c1), _chain(m, c2)
    if abs(f1 - factor * f2) > AGREE * (abs(f1) + abs(factor * f2)):
        others = list(dict.fromkeys(g.name for g in gears1 + gears2))
        m.sink.warning(
            "W236",
            f"GEAR {gear.name} contradicts GEAR {', '.join(others)}: "
            f"{c1.of} = {f1 / f2:g} {c2.of} already, so both can only stand still",
            gear.span,
            "leave one of them out, or give them the same ratio",
        )


def allocate(m: Mechanism, coordinates: list[Coordinate]) -> None:
    """Unknowns, symbols and ties, in deck order; start values move to the leaders."""
    for c in coordinates:
        _hand_on_start(m, c)
    for c in coordinates:
        if _free(m, c):
            c.allocate(m.b)
            m.own.append(c)
        elif c.drive is not None:
            c.q = m.b.symbol()
            c.u = c.rate = m.b.symbol()
            m.given.append(c)
            if c.drive.qd is not None:
                c.row = m.b.unknown(c.q_name, "coordinate", c.unit, c.start)
    for c in coordinates:
        _follow(m, c)
    m.groups = [Group(m.b, joint) for joint in m.joints.values() if joint.kind.quasi and joint.coordinates]


def _hand_on_start(m: Mechanism, c: Coordinate) -> None:
    """ic= of a geared joint is one of its leader, and so is guess=."""
    tie = m.ties.get(id(c))
    if tie is None:
        return
    leader, factor = c, 1.0
    while (tie := m.ties.get(id(leader))) is not None:
        leader, factor = tie.leader, factor * tie.factor
    guessed = m.joints[c.of].card.given("guess")
    if guessed and not (c.held or leader.held or m.joints[leader.of].card.given("guess")):
        leader.start = c.start / factor
    for value, held in (("start", "held"), ("start_speed", "held_speed")):
        if not getattr(c, held):
            continue
        wanted = getattr(c, value) / factor
        if getattr(leader, held) and abs(getattr(leader, value) - wanted) > AGREE * (1.0 + abs(wanted)):
            joint = m.joints[c.of]
            m.sink.error(
                "E244",
                f"ic= of {c.of} and ic= of {leader.of} disagree: the gear ties them",
                joint.card.place("ic"),
                f"give only one of them; {leader.of} would start at {wanted:g}",
            )
        setattr(leader, value, wanted)
        setattr(leader, held, True)


def _follow(m: Mechanism, c: Coordinate) -> None:
    """q = factor * q(leader), after the leader."""
    tie = m.ties.get(id(c))
    if tie is None or hasattr(c, "q"):
        return
    _follow(m, tie.leader)
    c.q, c.u = tie.factor * tie.leader.q, tie.factor * tie.leader.u
    if m.shares or m.reads(tie.gear.name):
        tie.virtual = Virtual(m.b, "gear")
        m.virtuals.append(tie.virtual)
        c.q, c.u = c.q + tie.virtual.s, c.u + tie.virtual.rate
