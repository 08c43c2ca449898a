"""Reading the machine by name: angle(j) x(P) fx(j) torque(c) energy() ... as expressions.

A function is mechanical only when its argument names something mechanical; else `probe` answers None and the
circuit may know the name. Time derivatives (alpha acc ax ay az, the current of a C-like TRANSDUCER) are
unknowns of their own: Q is what is differentiated, F = -unknown.
"""

from __future__ import annotations

from ..cards.joint import KINDS
from ..diagnostics import suggest
from ..expr import Call, Name, Num, Unary
from . import reactions
from .kinematics import WORLD_AXES, dot

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .._engine import Expr
    from ..diagnostics import Span
    from ..expr import Node
    from .kinematics import PointState, Scalar
    from .machine import Machine
    from .scene import JointState

# function -> (turn or slide, order of the time derivative)
MOTIONS = {
    "angle": ("turn", 0),
    "omega": ("turn", 1),
    "alpha": ("turn", 2),
    "pos": ("slide", 0),
    "vel": ("slide", 1),
    "acc": ("slide", 2),
}
TWINS = {"angle": "pos", "omega": "vel", "alpha": "acc", "pos": "angle", "vel": "omega", "acc": "alpha"}
PLACES = {"x": (0, 0), "y": (1, 0), "z": (2, 0), "vx": (0, 1), "vy": (1, 1), "vz": (2, 1),
          "ax": (0, 2), "ay": (1, 2), "az": (2, 2)}  # fmt: skip
COUPLING = ("force", "torque", "i", "v", "p", "gap", "power")
WHOLE = ("energy", "pe", "loss", "ke", "power")
UNITS = {"alpha": "rad/s^2", "acc": "m/s^2", "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2"}
# functions that no circuit has: an unknown name in them is an error here
ONLY_MECHANICAL = (*MOTIONS, *PLACES, *reactions.REACTIONS, "force", "torque", "gap", "ke")


def probe(m: Machine, fn: str, args: list[Node], span: Span | None) -> Expr | None:
    """The expression of fn(args), or None where it is not mechanical."""
    if not args and fn in WHOLE:
        return m.own_aware(_whole(m, fn))
    names = [_name(a) for a in args]
    if fn in PLACES and len(args) == 1:
        return _place(m, fn, args[0], span)
    if fn in MOTIONS and 1 <= len(args) <= 2 and all(names):
        if len(args) == 2:
            return _between(m, fn, names[0] or "", names[1] or "", span)
        return _motion(m, fn, names[0] or "", span)
    if len(args) == 1 and names[0]:
        name = names[0]
        if fn in reactions.REACTIONS:
            joint = m.joints.get(name)
            return _unknown(m, fn, name, span) if joint is None else reactions.of_joint(m, fn, joint)
        if fn in COUPLING:
            return _coupling(m, fn, name, span)
        if fn == "ke":
            return _kinetic(m, name, span)
    return None


def _name(node: Node) -> str | None:
    if isinstance(node, Name):
        return node.id
    return f"{node.value:g}" if isinstance(node, Num) else None


def _error(m: Machine, code: str, message: str, span: Span | None, hint: str | None = None) -> Expr:
    m.sink.error(code, message, span, hint)
    return m.b.const(0.0)


def _unknown(m: Machine, fn: str, name: str, span: Span | None) -> Expr | None:
    """None lets the circuit try; a function that only the machine has is an error at once."""
    if fn not in ONLY_MECHANICAL:
        return None
    kind = _kind_of(m, name)
    if kind is not None:
        fits = "a joint" if fn in reactions.REACTIONS or fn in MOTIONS else "a coupling or element"
        fits = "a body" if fn == "ke" else "a point" if fn in PLACES else fits
        return _error(m, "E249", f"{fn}() reads {fits}; {name} is a {kind}", span, _other_way(m, fn, name))
    close = suggest(name, [*m.joints, *m.bodies, *m.couplings, *m.points])
    head, dot, _ = name.partition(".")
    body = head if head in m.bodies else suggest(head, m.bodies) if dot else None
    if close:
        hint = f"did you mean {fn}({close})?"
    elif body is not None:
        hint = f"body {body} has points by POINT {body}.name x y, and {fn}({body}(x,y)) without one"
    else:
        hint = f"the machine has: {', '.join(m.all_names()) or 'nothing'}"
    return _error(m, "E250", f"nothing mechanical is named {name}", span, hint)


def _kind_of(m: Machine, name: str) -> str | None:
    if name in m.joints:
        return f"{m.joints[name].kind} joint"
    if name in m.bodies or name == "0":
        return "body"
    if name in m.points:
        return "point"
    card = m.couplings.get(name)
    return card.spec.word if card is not None else None


def _other_way(m: Machine, fn: str, name: str) -> str | None:
    if fn in ("force", "torque") and name in m.joints:
        return f"fx({name}) fy({name}) mz({name}) are its reactions"
    if name in m.bodies and fn in MOTIONS:
        return f"x({name}) y({name}) angle({name}) say where it is"
    return None


# joints and bodies ------------------------------------------------------------------------------------


def _motion(m: Machine, fn: str, name: str, span: Span | None) -> Expr | None:
    """angle omega alpha pos vel acc."""
    wanted, order = MOTIONS[fn]
    joint = m.joints.get(name)
    if joint is None:
        if wanted == "turn" and (name in m.bodies or name == "0"):
            return _orientation(m, fn, name, order)
        return _unknown(m, fn, name, span)
    k = _index(joint, wanted)
    if k is None:
        twin = TWINS[fn]
        other = _index(joint, "slide" if wanted == "turn" else "turn")
        return _error(
            m,
            "E249",
            f"joint {name} is a {joint.kind}: it has no {fn}()",
            span,
            f"did you mean {twin}({name})?" if other is not None else None,
        )
    if m.own_symbols is not None and m.own_symbols.joint == name and order == 0:
        return m.own_symbols.coordinate
    value = joint.qs[k] if order == 0 else joint.us[k]
    return _derived(m, fn, name, value, order)


def _index(joint: JointState, wanted: str) -> int | None:
    """Which coordinate of a joint turns, or slides."""
    for k, (motion, axis) in enumerate(KINDS[joint.kind]):
        if motion == wanted and axis in ("axis", "z"):
            return k
    return None


def _derived(m: Machine, fn: str, name: str, value: Expr, order: int) -> Expr:
    if order < 2:
        return m.own_aware(value)
    return m.derivative(f"{fn}({name})", UNITS[fn], m.public(value))


def _orientation(m: Machine, fn: str, name: str, order: int) -> Expr:
    """Angle of a body from world x to its x about z; full turns are counted where only z turns."""
    frame = m.frames[name]
    if order > 0:
        return _derived(m, fn, name, m.b.const(0.0) + dot(frame.omega, WORLD_AXES[2]), order)
    angle: Scalar | None = frame.rot.about_z()
    if angle is None:
        r = frame.rot.matrix()
        angle = m.b.call("atan2", r[1][0], r[0][0])
    return m.own_aware(m.b.const(0.0) + angle)


def _between(m: Machine, fn: str, first: str, second: str, span: Span | None) -> Expr | None:
    """angle(a, b) = angle(a) - angle(b), as v(a, b) is a difference."""
    a, b = _motion(m, fn, first, span), _motion(m, fn, second, span)
    return None if a is None or b is None else a - b


def _place(m: Machine, fn: str, arg: Node, span: Span | None) -> Expr | None:
    """x y z of a point and their derivatives."""
    axis, order = PLACES[fn]
    name = arg.fn if isinstance(arg, Call) else _name(arg)
    if name is None:
        return None
    joint = m.joints.get(name)
    if joint is not None and not isinstance(arg, Call) and order < 2:
        if joint.kind in ("planar", "free") and axis < 2:
            return m.own_aware((joint.qs if order == 0 else joint.us)[axis])
        state = m.frames[joint.b].point(joint.pb)  # where the joint is
    else:
        found = _point(m, arg, name)
        if found is None:
            return _unknown(m, fn, name, span)
        state = found
    value = m.b.const(0.0) + (state.pos if order == 0 else state.vel)[axis]
    return _derived(m, fn, repr(arg), value, order)


def _point(m: Machine, arg: Node, name: str) -> PointState | None:
    local = None
    if isinstance(arg, Call):
        numbers = [_number(a) for a in arg.args]
        if len(numbers) not in (2, 3) or any(v is None for v in numbers):
            m.sink.error("E246", f"{arg!r} is no point: {name}(x,y) with two or three numbers", arg.span)
            return m.frames["0"].point((0.0, 0.0, 0.0))
        local = tuple(v for v in numbers if v is not None)
    where = m.locate(name, local)
    return None if where is None else m.frames[where[0]].point(where[1])


def _number(node: Node) -> float | None:
    if isinstance(node, Num):
        return node.value
    if isinstance(node, Unary) and node.op in "+-":
        inner = _number(node.a)
        return None if inner is None else (-inner if node.op == "-" else inner)
    return None


# couplings and energies ---------------------------------------------------------------------------------


def _coupling(m: Machine, fn: str, name: str, span: Span | None) -> Expr | None:
    own = m.own_symbols
    if own is not None and own.card == name and fn in ("v", "i"):
        return own.voltage if fn == "v" else own.current
    card = m.couplings.get(name)
    if card is None:
        joint = m.joints.get(name)
        if joint is not None and fn == "power":
            heat = joint.card.losses(m)
            return m.b.const(0.0) if heat is None else m.public(-heat)
        return _unknown(m, fn, name, span)
    if not card.supported:
        return m.b.const(0.0)
    if name in m.busy:
        return _error(
            m, "E255", f"{fn}({name}) is part of what decides it", span, "break the circle of expressions"
        )
    m.busy.add(name)
    try:
        answers = card.probes(m)
        answer = answers.get(fn)
        if answer is None and fn == "power":
            answer = _power(m, card)
        if answer is not None:
            return m.public(answer() if callable(answer) else answer)
    finally:
        m.busy.discard(name)
    twin = {"force": "torque", "torque": "force"}.get(fn)
    hint = f"did you mean {twin}({name})?" if twin in answers else f"it has: {', '.join(answers)}"
    return _error(m, "E249", f"{card.spec.word} {name} has no {fn}()", span, hint)


def _power(m: Machine, card: object) -> Expr:
    """What a card brings into the machine [W]."""
    result = m.b.const(0.0)
    for effort, flow in card.powers(m):  # type: ignore[attr-defined]
        result = result + effort * flow
    return result


def _kinetic(m: Machine, name: str, span: Span | None) -> Expr | None:
    body = m.bodies.get(name)
    if body is None:
        return _unknown(m, "ke", name, span)
    value = body.kinetic(m)
    return m.b.const(0.0) if value is None else m.public(value)


def _whole(m: Machine, fn: str) -> Expr:
    """energy() = kinetic + potential + stored in couplings; pe() ke() loss(); power() of all applied."""
    from .equations import total

    if fn == "power":
        terms = [e * f for card in m.active for e, f in card.powers(m)]
        return total(m, [m.public(t) for t in terms])
    if fn == "loss":
        return m.public(total(m, [card.losses(m) for card in m.active]))
    kinetic, potential = m.kinetic, total(m, [card.potential(m) for card in m.active])
    if fn == "ke":
        return m.public(kinetic)
    if fn == "pe":
        return m.public(potential)
    return m.public(kinetic + potential + total(m, [card.stored(m) for card in m.active]))
