"""Whether a machine at rest would stay there: the stiffness of the whole at the point that `.op static` has found."""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..assemble import Assembly

FALLS = 1e-6  # of the largest stiffness: so negative a one is none of rounding


def unstable(assembly: Assembly, x: Sequence[float]) -> str | None:
    """The coordinate that moves most where a small push is not answered by a force back; None where all are.

    K = dF/dq of the momentum rows, electrical unknowns eliminated, on the motions that loops leave free, is the second
    derivative of the potential energy: at a stable rest no eigenvalue of its symmetric part is negative."""
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
    if m.rows:
        gradient = whole[np.ix_([row.mu_row for row in m.rows], q)]
        _, sizes, directions = np.linalg.svd(gradient)
        free = directions[int((sizes > 1e-9 * sizes.max(initial=0.0)).sum()) :].T
    if not free.size or not np.isfinite(stiffness).all():
        return None
    reduced = free.T @ (0.5 * (stiffness + stiffness.T)) @ free
    found, shapes = np.linalg.eigh(reduced)
    if not found[0] < -FALLS * np.abs(found).max():
        return None
    return m.places[int(np.abs(free @ shapes[:, 0]).argmax())].q_name
