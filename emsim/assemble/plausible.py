"""What stands in a machine's cards and is hardly meant, one warning each: what is read is told, with what to write."""

from __future__ import annotations

from math import pi, sqrt

TYPE_CHECKING = False
if TYPE_CHECKING:
    from ..cards.body import Body
    from .mechanism import Mechanism

WATER = 1000.0  # kg/m^3
LONG = 1.0  # m: of shorter things nobody means so many millimetres
THIN = 1e4  # times as long as it were thick if it were of water: no rod, plate or disc is
# torque by the square root of heat and by mass, kt/sqrt(r)/kg [N m/sqrt(W)/kg]: of small to large motors some 0.05 to 1
GOODNESS = 1.0
ALIKE, FLAT = 1e-3, 1.5  # moments of a disc: two alike, the third twice as large; 1 of a ball
HEAVY = 10.0  # times as heavy as all that it moves


def remarks(m: Mechanism) -> None:
    """To the deck's sink."""
    for body in m.bodies.values():
        _thin(m, body)
    _twice(m)
    _shorted(m)
    _strong(m)
    if m.in_space:
        _balls(m)


def _thin(m: Mechanism, body: Body) -> None:
    """A shape so large that nothing of its mass could be: sizes in millimetres."""
    name = getattr(body.shape, "fn", "")
    if name not in ("rod", "box", "disc", "polygon"):
        return
    sizes = [float(getattr(a, "value", a)) for a in getattr(body.shape, "args", ())]
    if not sizes or body.m <= 0.0 or max(sizes) < LONG:
        return
    length = max(sizes)
    if name == "rod":
        thick = sqrt(4.0 * body.m / (pi * WATER * length))
    else:
        area = pi * length * length if name == "disc" else max(sizes[0] * sizes[1], 1e-300)
        thick = body.m / (WATER * area)
    if length > THIN * thick:
        said = f"BODY {body.name} is {length:g} m large and weighs {body.m:g} kg: of water it were {thick:.1g} m thick"
        given = ",".join(f"{size:g}m" for size in sizes)
        m.sink.warning(
            "W244", said, body.place("shape"), f"sizes are in metres; in millimetres: {name}({given})"
        )


def _twice(m: Mechanism) -> None:
    """Two joints of one kind at one place between the same bodies: the second holds nothing more."""
    seen: dict[tuple[object, ...], str] = {}
    for joint in m.joints.values():
        card = joint.card
        key = (card.kind.name, joint.a, joint.b, *joint.pa, *joint.pb, *card.direction)
        first = seen.setdefault(key, joint.name)
        if first != joint.name and card.kind.name in ("pin", "slide", "weld", "ball"):
            said = (
                f"JOINT {joint.name} joins what JOINT {first} joins, at the same place: it holds nothing more"
            )
            hint = "leave one of them out; of two names for one joint the coordinate has the first"
            m.sink.warning("W245", said, card.span, hint)


def _shorted(m: Mechanism) -> None:
    """A winding with all its terminals on one node."""
    for card in m.couplings.values():
        nodes = [ref.name for _, kind, ref in card.terminals if kind == "node"]
        if card.spec.word == "MOTOR" and len(nodes) > 1 and len(set(nodes)) == 1:
            count = "both" if len(nodes) == 2 else "all"
            said = f"{count} terminals of MOTOR {card.name} are on node `{nodes[0]}`: it is shorted, "
            said += "which brakes, and nothing drives it"
            other = "0" if nodes[0] != "0" else "supply"
            hint = f"two nodes: MOTOR {card.name} {nodes[0]} {other} ..; a brake that is meant: a resistor of 1u across it"
            m.sink.warning("W246", said, card.span, hint)


def _strong(m: Mechanism) -> None:
    """A torque constant that a motor many times as heavy as the scene would have: one in mN m/A."""
    mass = sum(body.m for body in m.bodies.values())
    for card in m.couplings.values():
        kt, r = getattr(card, "kt", None), getattr(card, "r", None)
        if card.spec.word != "MOTOR" or not (isinstance(kt, float) and isinstance(r, float)):
            continue
        joint = getattr(card, "joint", None)
        if not (kt >= 1.0 and r > 0.0 and mass > 0.0) or joint is None or not joint.rotary:
            continue
        least = kt / sqrt(r) / GOODNESS
        if least > HEAVY * mass:
            said = f"kt= of MOTOR {card.name} is {kt:g} N m/A: with r= that is a motor of {least:.2g} kg at least, "
            said += f"beside {mass:.3g} kg that it moves"
            m.sink.warning("W247", said, card.place("kt"), f"in mN m/A it is {kt:g}m")


def _balls(m: Mechanism) -> None:
    """Round parts of bodies that turn about one axis as discs and wheels do: in space r= is a ball."""
    for card in m.couplings.values():
        if (
            card.spec.word != "CONTACT"
            or getattr(card, "axis", None) is not None
            or getattr(card, "r", 0.0) <= 0.0
        ):
            continue
        ref = next(ref for label, _, ref in card.terminals if label == "p")
        body = m.bodies.get(ref.name)
        axis = None if body is None else _disc(body)
        if axis is not None:
            said = f"r= of CONTACT {card.name} is a ball in space, and BODY {ref.name} has the inertia of a disc "
            said += f"about its {'xyz'[axis]} axis"
            given = ",".join("1" if k == axis else "0" for k in range(3))
            hint = f"axis=({given}) makes it a thin disc; axis=(0,0,0) says that a ball is meant"
            m.sink.warning("W248", said, card.place("r"), hint)


def _disc(body: Body) -> int | None:
    """The axis about which it is flat and round, by its inertia."""
    j, off = body.inertia[:3], body.inertia[3:]
    if not body.spatial_inertia or any(off):
        return None
    for axis in range(3):
        one, other = (j[k] for k in range(3) if k != axis)
        if one > 0.0 and abs(one - other) < ALIKE * one and j[axis] > FLAT * one:
            return axis
    return None
