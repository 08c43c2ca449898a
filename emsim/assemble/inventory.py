"""What a machine consists of: facts for `emsim check`, and the columns recorded when nothing is asked for."""

from __future__ import annotations

from .scene import FREE

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from .mechanism import Mechanism
    from .scene import Coordinate


def default_outputs(m: Mechanism) -> list[str]:
    """What is recorded when nothing is asked for: coordinates, speeds, coupling forces."""
    names = [n for c in m.all_coordinates() for n in (c.q_name, c.u_name) if n]
    for joint in m.joints.values():
        if joint.cut and joint.single:
            words = (joint.kind.coordinates[0].word, joint.kind.speeds[0].word)
            names += [f"{word}({joint.name})" for word in words]
    for card in m.active:
        for word, value in card.probes(m).items():
            kind, comma, part = word.partition(",")
            if kind in ("force", "torque") and not callable(value):
                names.append(f"{kind}({card.name}{comma}{part})")
    return names + m.domains.outputs()


def report(m: Mechanism) -> dict[str, Any]:
    """Facts for `emsim check`; empty after errors."""
    return {
        "formulation": m.ctx.options["formulation"],
        "bodies": [{"name": n, "m": b.m, "inertia": b.inertia, "com": b.centre} for n, b in m.bodies.items()],
        "joints": [
            {
                "name": j.name,
                "kind": j.kind.name,
                "a": j.a,
                "b": j.b,
                "role": "cut" if j.cut else "tree",
                "coordinates": [_coordinate_facts(m, c) for c in j.coordinates],
            }
            for key, j in m.joints.items()
            if key[:1] != FREE
        ],
        "free_bodies": [
            {"name": n, "coordinates": [_coordinate_facts(m, c) for c in cs]}
            for n, cs in (
                *m.roots.items(),
                *((j.name, j.coordinates) for key, j in m.joints.items() if key[:1] == FREE),
            )
        ],
        "couplings": [{"name": n, "card": c.spec.word} for n, c in m.couplings.items()],
        "unknowns": len(m.places)
        + len(m.motions)
        + len(m.norms)
        + len(m.turned)
        + sum(c.row >= 0 for c in m.given)
        + sum(1 if row.of_speeds else 2 for row in m.rows)
        + len(m.derivatives),
        "degrees_of_freedom": m.found.dof,
        "loops": [m.loop_of(name) for name in m.plan.cut],
        "constraint_rows": [f"{row.owner} {row.label}" for row in m.rows],
        "redundant_rows": [f"{row.owner} {row.label}" for row in m.found.redundant],
        "singular_start": m.found.singular,
        "folded_rows": m.folded,
        "planar": not any(j.kind.leaves_plane() for j in m.joints.values()),
        "moved": m.found.moved,
        "operations": m.operations,
    }


def _coordinate_facts(m: Mechanism, c: Coordinate) -> dict[str, Any]:
    tie = m.ties.get(id(c))
    role = "driven" if c.drive is not None else f"follows {tie.leader.q_name}" if tie is not None else "own"
    return {"name": c.q_name, "speed": c.u_name, "unit": c.unit, "role": role}
