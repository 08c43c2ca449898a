"""Reading the machine by name: angle(j) x(P) fx(j) torque(c) pe() ... as expressions.

A function is mechanical only when its argument names something mechanical; else `probe` answers None and the
circuit may know the name. Time derivatives (alpha acc ax ay az, the current of a C-like TRANSDUCER) are
unknowns of their own: Q is what is differentiated, F = -unknown.
"""

from __future__ import annotations

from ..cards import along
from ..cards.base import PROBES as CARD_PROBES
from ..cards.domains import ACROSS
from ..cards.joints import WORDS
from ..cards.kinematics import WORLD_AXES, dot
from ..diagnostics import Fix, instead, suggest
from ..expr import Call, Name, Num, Unary
from . import reactions
from .scene import FREE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from ..cards.kinematics import PointState, Scalar
    from ..diagnostics import Span
    from ..expr import Node
    from .mechanism import Mechanism
    from .scene import JointState

# function -> order of the time derivative
MOTIONS = {"angle": 0, "omega": 1, "alpha": 2, "pos": 0, "vel": 1, "acc": 2}
ACCELERATIONS = {"alpha": "omega", "acc": "vel"}
TWINS = {"angle": "pos", "omega": "vel", "alpha": "acc", "pos": "angle", "vel": "omega", "acc": "alpha"}
PLACES = {"x": (0, 0), "y": (1, 0), "z": (2, 0), "vx": (0, 1), "vy": (1, 1), "vz": (2, 1),
          "ax": (0, 2), "ay": (1, 2), "az": (2, 2)}  # fmt: skip
COUPLING = tuple(CARD_PROBES)
WHOLE = ("pe", "ke", "power")
UNITS = {"alpha": "rad/s^2", "acc": "m/s^2", "ax": "m/s^2", "ay": "m/s^2", "az": "m/s^2"}
# functions that no circuit has: an unknown name in them is an error here
OF_TOUCH = ("gap", "slip", "friction", "rolling", "drilling", "mode", "hits", "impulse", "tension")
ONLY_MECHANICAL = (*MOTIONS, *PLACES, *reactions.REACTIONS, "force", "torque", *OF_TOUCH, "ke")


def probe(m: Mechanism, fn: str, args: list[Node], span: Span | None) -> Expr | None:
    """The expression of fn(args), or None where it is not mechanical."""
    if not args and fn in WHOLE:
        return m.own_aware(_whole(m, fn))
    names = [_name(a) for a in args]
    if fn in ACROSS and len(args) == 1 and names[0]:
        return m.domains.read(ACROSS[fn], names[0], span)
    if fn in PLACES and len(args) == 1:
        return _place(m, fn, args[0], span)
    if (
        fn in WORDS
        and len(args) == 1
        and fn not in MOTIONS
        and (names[0] in m.joints or _free(m, names[0], fn) is not None)
    ):
        return _motion(m, fn, names[0] or "", span)
    if fn in MOTIONS and 1 <= len(args) <= 2 and all(names):
        if len(args) == 2:
            return _between(m, fn, names[0] or "", names[1] or "", span)
        return _motion(m, fn, names[0] or "", span)
    if (
        len(args) == 2
        and fn in COUPLING
        and names[0] in m.couplings
        and (part := _number(args[1])) is not None
    ):
        return _coupling(m, fn, names[0] or "", span, f",{part:g}")
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


def _error(
    m: Mechanism,
    code: str,
    message: str,
    span: Span | None,
    hint: str | None = None,
    fixes: Sequence[Fix] = (),
) -> Expr:
    m.sink.error(code, message, span, hint, fixes=fixes)
    return m.b.const(0.0)


def _unknown(m: Mechanism, fn: str, name: str, span: Span | None) -> Expr | None:
    """None lets the circuit try; a function that only the machine has is an error at once."""
    if fn not in ONLY_MECHANICAL:
        return None
    kind = _kind_of(m, name)
    if kind is not None:
        fits = "a joint" if fn in reactions.REACTIONS or fn in MOTIONS else "a coupling or element"
        fits = "a body" if fn == "ke" else "a point" if fn in PLACES else fits
        hint, fixes = _other_way(m, fn, name, span)
        return _error(m, "E249", f"{fn}() reads {fits}; {name} is a {kind}", span, hint, fixes)
    close = suggest(name, [*m.joints, *m.bodies, *m.couplings, *m.points])
    head, dot, _ = name.partition(".")
    body = head if head in m.bodies else suggest(head, m.bodies) if dot else None
    if close:
        hint = f"did you mean {fn}({close})?"
    elif body is not None:
        hint = f"body {body} has points by POINT {body}.name x y, and {fn}({body}(x,y)) without one"
    else:
        hint = f"the machine has: {', '.join(m.all_names()) or 'nothing'}"
    fixes = instead(span, name, close) if close else []
    return _error(m, "E250", f"nothing mechanical is named {name}", span, hint, fixes)


def readings(m: Mechanism | None, name: str) -> list[str]:
    """What can be read of a joint or a body by its name, the speed first."""
    if m is None:
        return []
    if (joint := m.joints.get(name)) is not None:
        return [f"{c.word}({name})" for c in (*joint.kind.speeds, *joint.kind.coordinates)]
    return [f"{fn}({name})" for fn in ("omega", "angle", "ke")] if name in m.bodies else []


def _kind_of(m: Mechanism, name: str) -> str | None:
    if name in m.joints:
        return f"{m.joints[name].kind.name} joint"
    if name in m.bodies or name == "0":
        return "body"
    if name in m.points:
        return "point"
    card = m.couplings.get(name)
    return card.spec.word if card is not None else None


def _other_way(m: Mechanism, fn: str, name: str, span: Span | None) -> tuple[str | None, list[Fix]]:
    """The readings of a thing in place of one that it has not."""
    if fn in ("force", "torque") and name in m.joints:
        return f"fx({name}) fy({name}) mz({name}) are its reactions", []
    if name not in m.bodies or fn not in MOTIONS:
        return None, []
    words, said = (
        (("x", "y", "angle"), "say where it is")
        if MOTIONS[fn] == 0
        else (("vx", "vy", "omega"), "say how it moves")
    )
    if MOTIONS[fn] == 2:
        words, said = ("ax", "ay", "alpha"), "are its accelerations"
    offered = [f"{word}({name})" for word in words]
    # its own coordinate is the joint's on which it hangs
    hung = [j for j in m.joints.values() if j.b == name and _of_joint(j, fn) is not None]
    own = [f"{fn}({j.card.name})" for j in hung]
    hint = f"{' '.join(offered)} {said}" + (f"; its joint does by {own[0]}" if own else "")
    return hint, [Fix(span, text) for text in (*own, *offered)] if span else []


# joints and bodies ------------------------------------------------------------------------------------


def _motion(m: Mechanism, fn: str, name: str, span: Span | None) -> Expr | None:
    """angle omega alpha pos vel acc, and what else a kind of joint calls its coordinates and speeds."""
    joint = m.joints.get(name) or _free(m, name, fn)
    if joint is None:
        if fn in ("angle", "omega", "alpha") and (name in m.bodies or name == "0"):
            return _orientation(m, fn, name, MOTIONS[fn])
        return _unknown(m, fn, name, span)
    kind, own = joint.kind, m.own_symbols
    if own is not None and name in own.coordinates and any(c.word == fn for c in kind.coordinates):
        return own.coordinates[name]
    if any(c.word == fn for c in kind.measures):
        return m.own_aware(along.view(m, joint, fn).q)
    found = _of_joint(joint, fn)
    if found is None:
        words = " ".join(c.word for c in (*kind.coordinates, *kind.speeds, *kind.measures))
        twin = TWINS.get(fn, "")
        hint: str | None
        fixes: list[Fix] = []
        if _of_joint(joint, twin) is not None:
            hint, fixes = f"did you mean {twin}({name})?", instead(span, fn, twin)
        else:
            hint = f"it has: {words}" if words and kind.in_tree else None
        if joint.cut and any(c.word == fn for c in kind.coordinates):
            return _error(
                m,
                "E249",
                f"the {kind.name} joint {name} closes a loop: it has no {fn}() there",
                span,
                f"cut another joint of the loop (cut=yes), so that {name} supplies coordinates",
            )
        return _error(
            m,
            "E249",
            f"joint {name} is a {kind.name}: it has no {fn}()",
            span,
            hint,
            fixes,
        )
    value, order = found
    return _derived(m, fn, name, value, order)


def _free(m: Mechanism, name: str | None, fn: str) -> JointState | None:
    """What stands for a free body in space, where a function reads it."""
    joint = m.joints.get(f"{FREE}{name}")
    words = () if joint is None else (c.word for c in (*joint.kind.coordinates, *joint.kind.speeds))
    return joint if fn in words else None


def _of_joint(joint: JointState, fn: str) -> tuple[Expr, int] | None:
    """What a function reads of a joint, and the order of its derivative; where that is 2, of the speed."""
    kind = joint.kind
    speed = ACCELERATIONS.get(fn, fn)
    for words, values, order in (
        (kind.coordinates, joint.qs, 0),
        (kind.speeds, joint.us, 1 if speed == fn else 2),
    ):
        for c, value in zip(words, values, strict=False):
            if c.word == (fn if order == 0 else speed):
                return value, order
    return None


def _derived(m: Mechanism, fn: str, name: str, value: Expr, order: int) -> Expr:
    if order < 2:
        return m.own_aware(value)
    return m.derivative(f"{fn}({name})", UNITS[fn], m.public(value))


def _orientation(m: Mechanism, fn: str, name: str, order: int) -> Expr:
    """Angle of a body from world x to its x about z; full turns are counted where only z turns."""
    frame = m.frames[name]
    if order > 0:
        return _derived(m, fn, name, m.b.const(0.0) + dot(frame.omega, WORLD_AXES[2]), order)
    angle: Scalar | None = frame.rot.about_z()
    if angle is None:
        r = frame.rot.matrix()
        angle = m.b.call("atan2", r[1][0], r[0][0])
    return m.own_aware(m.b.const(0.0) + angle)


def _between(m: Mechanism, fn: str, first: str, second: str, span: Span | None) -> Expr | None:
    """angle(a, b) = angle(a) - angle(b), as v(a, b) is a difference."""
    a, b = _motion(m, fn, first, span), _motion(m, fn, second, span)
    return None if a is None or b is None else a - b


def _place(m: Mechanism, fn: str, arg: Node, span: Span | None) -> Expr | None:
    """x y z of a point and their derivatives."""
    axis, order = PLACES[fn]
    name = arg.fn if isinstance(arg, Call) else _name(arg)
    if name is None:
        return None
    joint = m.joints.get(name)
    if joint is not None and not isinstance(arg, Call) and order < 2:
        if (own := _of_joint(joint, fn)) is not None:
            return m.own_aware(own[0])
        state = m.frames[joint.b].point(joint.pb)  # where the joint is
    else:
        found = _point(m, arg, name)
        if found is None:
            return _unknown(m, fn, name, span)
        state = found
    value = m.b.const(0.0) + (state.pos if order == 0 else state.vel)[axis]
    return _derived(m, fn, repr(arg), value, order)


def _point(m: Mechanism, arg: Node, name: str) -> PointState | None:
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


def _coupling(m: Mechanism, fn: str, name: str, span: Span | None, part: str = "") -> Expr | None:
    """What a card answers; `part` is the number of one of its windings, `,2`."""
    own = m.own_symbols
    if own is not None and own.card == name and fn in ("v", "i"):
        if fn == "v" and own.voltage is not None:
            return own.voltage
        k = int(part[1:]) if part else len(own.currents) and (1 if len(own.currents) == 1 else 0)
        if fn == "i" and 0 < k <= len(own.currents):
            return own.currents[k - 1]
        calls = ", ".join(f"i({name},{k + 1})" for k in range(len(own.currents)))
        return _error(m, "E249", f"the energy of {name} has no {fn}({name}{part})", span, f"it has: {calls}")
    if own is not None and own.card == name:
        said = f"{fn}({name}) is part of what decides it"
        return _error(m, "E255", said, span, "break the circle of expressions")
    card = m.couplings.get(name)
    if card is None:
        joint = m.joints.get(name)
        if joint is not None and fn == "power":
            heat = joint.card.losses(m)
            return m.b.const(0.0) if heat is None else m.public(-heat)
        return _unknown(m, fn, name, span)
    if name in m.busy:
        return _error(
            m, "E255", f"{fn}({name}) is part of what decides it", span, "break the circle of expressions"
        )
    m.busy.add(name)
    try:
        answers = card.probes(m)
        answer = answers.get(fn + part)
        if answer is None and fn == "power":
            answer = _power(m, card)
        if answer is not None:
            return m.public(answer() if callable(answer) else answer)
    finally:
        m.busy.discard(name)
    twin = {"force": "torque", "torque": "force"}.get(fn)
    offered = [f"{w}({name}{comma}{k})" for w, comma, k in (word.partition(",") for word in answers)]
    hint = f"did you mean {twin}({name})?" if twin in answers else f"it has: {', '.join(offered)}"
    return _error(m, "E249", f"{card.spec.word} {name} has no {fn}({name}{part})", span, hint)


def _power(m: Mechanism, card: object) -> Expr:
    """What a card brings into the machine [W]."""
    return sum((effort * flow for effort, flow in card.powers(m)), m.b.const(0.0))  # type: ignore[attr-defined]


def _kinetic(m: Mechanism, name: str, span: Span | None) -> Expr | None:
    body = m.bodies.get(name)
    if body is None:
        return _unknown(m, "ke", name, span)
    value = body.kinetic(m)
    return m.b.const(0.0) if value is None else m.public(value)


def _whole(m: Mechanism, fn: str) -> Expr:
    """pe() ke(); power(): what all cards bring into the machine."""
    from .equations import total

    if fn == "power":
        terms = [e * f for card in m.active for e, f in card.powers(m)]
        terms += [law.effort * law.flow for _, law in m.laws if law.flow is not None]
        return total(m, [m.public(t) for t in terms])
    if fn == "ke":
        return m.public(m.kinetic)
    return m.public(total(m, [card.potential(m) for card in m.active]))
