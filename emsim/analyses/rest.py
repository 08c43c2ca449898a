"""What holds a machine at rest, and whether it would stay there: the stiffness of the whole where `.op static` has found it."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from .._engine import Expr
    from ..assemble import Assembly

FALLS = 1e-6  # of the largest stiffness: so negative a one is none of rounding
NONE = 1e-12  # of the largest entry: rounding where nothing pulls along the motions that are free
HELD = 1e-6  # friction that has so much of its bound left holds; an effort of less than so much of the largest is none
SAID = 6  # frictions that a message names


def unstable(assembly: Assembly, x: Sequence[float], most: Sequence[float]) -> str | None:
    """The coordinate that moves most where a small push is not answered by a force back; None where all are.

    K = dF/dq of the momentum rows, electrical unknowns eliminated, on the motions that loops leave free, is the second
    derivative of the potential energy: at a stable rest no eigenvalue of its symmetric part is negative. What friction that
    has some of its bound left, or a closed stop, holds is not free."""
    import numpy as np

    system, m = assembly.system, assembly.machine
    if m.groups or len(m.places) != len(m.motions):
        return None
    columns, rows = system.pattern()
    whole = np.zeros((system.n, system.n))
    values = system.jac(list(x), 0.0)[1]
    for c in range(system.n):
        for k in range(columns[c], columns[c + 1]):
            whole[rows[k], c] += values[k]
    q = [c.row for c in m.places]
    p = [c.speed_row for c in m.places]
    circuit = [k for k, kind in enumerate(system.kinds) if kind in ("node", "branch")]
    stiffness = whole[np.ix_(p, q)]
    if circuit:
        inner = whole[np.ix_(circuit, circuit)]
        answer = np.linalg.lstsq(inner, whole[np.ix_(circuit, q)], rcond=None)[0]
        stiffness = stiffness - whole[np.ix_(p, circuit)] @ answer
    free = np.eye(len(q))
    gradient = whole[np.ix_([row.mu_row for row in m.rows if not row.of_speeds], q)]
    # an effort enters the momentum rows by the slope of its flow
    efforts = [row.row for row in m.rows if row.of_speeds] + _locked(assembly, x, most)
    gradient = np.vstack([gradient, whole[np.ix_(p, efforts)].T])
    if len(gradient):
        _, sizes, directions = np.linalg.svd(gradient)
        free = directions[int((sizes > 1e-9 * sizes.max(initial=0.0)).sum()) :].T
    if not free.size or not np.isfinite(stiffness).all():
        return None
    reduced = free.T @ (0.5 * (stiffness + stiffness.T)) @ free
    found, shapes = np.linalg.eigh(reduced)
    if not found[0] < -max(FALLS * np.abs(found).max(), NONE * np.abs(stiffness).max()):
        return None
    return m.places[int(np.abs(free @ shapes[:, 0]).argmax())].q_name


def bounds(assembly: Assembly) -> list[Expr]:
    """The most that each law can hold [N or N m], in the order of the laws: of friction; of others it is 0."""
    m = assembly.machine
    return [m.maximum(m.public(law.bound), m.public(law.stick)) for _, law in m.laws]


def _locked(assembly: Assembly, x: Sequence[float], most: Sequence[float]) -> list[int]:
    """Efforts of laws that hold whichever way they are pushed a little."""
    laws = [law for _, law in assembly.machine.laws]
    largest = max((abs(x[law.row]) for law in laws), default=0.0)
    found = []
    for law, bound in zip(laws, most, strict=True):
        effort = abs(x[law.row])
        if effort < (1.0 - HELD) * bound if law.form == "relay" else effort > HELD * largest:
            found.append(law.row)
    return found


def holding(assembly: Assembly, x: Sequence[float], most: Sequence[float]) -> str:
    """Frictions that keep the machine where it is, each with its force and the most that it can hold; "" without any."""
    laws = zip(assembly.machine.laws, most, strict=True)
    frictions = [(card, law, abs(x[law.row]), bound) for (card, law), bound in laws if law.form == "relay"]
    largest = max((effort for _, _, effort, _ in frictions), default=0.0)
    said = [
        f"{card.spec.word} {card.name} with {effort:.4g} of {bound:.4g} {law.unit}"
        for card, law, effort, bound in frictions
        if effort > HELD * max(largest, bound)
    ]
    more = f" and {len(said) - SAID} more" if len(said) > SAID else ""
    return ", ".join(said[:SAID]) + more
