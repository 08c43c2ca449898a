"""The finite s at which det(G + s C) = 0, and the vectors that G + s C makes 0.

C has many rows of zeros (resistive nodes, constraints), and QZ gives for the eigenvalues at infinity that follow from these
numbers as large as true ones may be. So they are taken out first, as far as there are any: rows of C that depend on others are
made 0 by elimination, and each row of G without C is solved for one unknown. An entry is 0 when it is rounding of the terms it
is made of, which no choice of units changes. Eigenvalues at 0 go the same way, with G and C changed for each other: a free
motion is exactly one.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    import numpy as np

    from .._engine import SmallSignal

ROUNDING = 2e-13  # of the terms of a sum: as much is nothing
ROUNDS = 8  # of scaling, and of the refinement of an eigenvalue
CLUSTER = 1e-6  # eigenvalues that are so near each other are one, of several vectors


class SingularPencil(ValueError):
    """det(G + s C) = 0 whatever s is."""


def dense(linear: SmallSignal) -> tuple[np.ndarray, np.ndarray]:
    """G and C of linearised equations."""
    import numpy as np

    indptr, rows, g, c = linear.pencil()
    n = len(indptr) - 1
    columns = np.repeat(np.arange(n), np.diff(indptr))
    whole = np.zeros((2, n, n))
    whole[0, rows, columns], whole[1, rows, columns] = g, c
    return whole[0], whole[1]


def eigenvalues(g: np.ndarray, c: np.ndarray) -> np.ndarray:
    """All finite s, by magnitude, as often as they are. Raises SingularPencil."""
    import numpy as np

    g, c = _scaled(g, c)
    g, c = deflated(g, c)
    nonzero, order = deflated(c, g)[::-1], len(g)
    g, c = nonzero
    zeros = np.zeros(order - len(g), dtype=complex)
    if not len(g):
        return zeros
    found = np.linalg.eigvals(np.linalg.solve(c, -g)).astype(complex)
    found = np.array([_refined(g, c, s) for s in found])
    for part in (found.real, found.imag):
        part[np.abs(part) <= ROUNDING * np.abs(found)] = 0.0
    return np.concatenate([zeros, found[in_order(found)]])


def in_order(s: Any) -> list[int]:
    """Places of numbers by magnitude, of equal ones by real part, the conjugate of each pair first."""
    import numpy as np

    s = np.asarray(s, dtype=complex)
    size = np.round(np.log(np.maximum(np.abs(s), 1e-300)), 6)
    return [int(k) for k in np.lexsort((s.imag, np.round(s.real / np.maximum(np.abs(s), 1e-300), 6), size))]


def _scaled(g: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns times powers of two, so that entries of both are about as large as one another can be."""
    import numpy as np

    g, c = g.copy(), c.copy()
    for _ in range(ROUNDS):
        sizes = [np.abs(m)[m != 0.0] for m in (g, c)]
        ratio = np.exp(np.mean(np.log(sizes[0])) - np.mean(np.log(sizes[1]))) if all(map(len, sizes)) else 1.0
        both = np.abs(g) + ratio * np.abs(c)
        for axis in (1, 0):
            largest = np.sqrt(both.max(axis=axis, initial=0.0))
            factor = np.exp2(-np.round(np.log2(np.where(largest > 0.0, largest, 1.0))))
            shape = factor[:, None] if axis == 1 else factor[None, :]
            g, c, both = g * shape, c * shape, both * shape
    return g, c


def deflated(g: np.ndarray, c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A pencil with the same finite eigenvalues whose C is regular. Raises SingularPencil."""
    import numpy as np

    g, c = g.copy(), c.copy()
    size_g, size_c = np.abs(g), np.abs(c)
    while True:
        rest = _dependent(g, c, size_g, size_c)
        if not len(rest):
            return g, c
        keep_rows, keep_columns = np.ones(len(g), bool), np.ones(len(g), bool)
        for _ in range(len(rest)):
            block = np.abs(g[np.ix_(rest, np.flatnonzero(keep_columns))])
            at, column = np.unravel_index(int(block.argmax()), block.shape)
            p, j = rest[at], np.flatnonzero(keep_columns)[column]
            if g[p, j] == 0.0:
                raise SingularPencil
            for m, size in ((g, size_g), (c, size_c)):
                factor = m[:, j] / g[p, j]
                factor[p] = 0.0
                m -= np.outer(factor, g[p])
                size += np.outer(np.abs(factor), size_g[p])
                m[np.abs(m) <= ROUNDING * size] = 0.0
                m[keep_rows & (np.arange(len(g)) != p), j] = 0.0
            keep_rows[p] = keep_columns[j] = False
            rest = np.delete(rest, at)
        both = np.ix_(keep_rows, keep_columns)
        g, c, size_g, size_c = g[both], c[both], size_g[both], size_c[both]


def _dependent(g: np.ndarray, c: np.ndarray, size_g: np.ndarray, size_c: np.ndarray) -> np.ndarray:
    """Makes rows of C that depend on others 0, and gives their numbers."""
    import numpy as np

    rest, columns = np.arange(len(c)), np.arange(len(c))
    while len(rest):
        block = np.abs(c[np.ix_(rest, columns)])
        at, k = np.unravel_index(int(block.argmax()), block.shape)
        if block[at, k] == 0.0:
            break
        p, j = rest[at], columns[k]
        rest, columns = np.delete(rest, at), np.delete(columns, k)
        factor = c[rest, j] / c[p, j]
        for m, size in ((g, size_g), (c, size_c)):
            m[rest] -= np.outer(factor, m[p])
            size[rest] += np.outer(np.abs(factor), size[p])
        c[rest, j] = 0.0
        for m, size in ((g, size_g), (c, size_c)):
            own = m[rest]
            own[np.abs(own) <= ROUNDING * size[rest]] = 0.0
            m[rest] = own
    return rest


def _refined(g: np.ndarray, c: np.ndarray, s: complex) -> complex:
    """An eigenvalue to the last digits, whatever larger ones there are: by the quotient of Rayleigh with both vectors."""
    import numpy as np

    start, near = s, abs(s) or 1.0
    right = np.random.default_rng(7).standard_normal(len(g)) + 0j
    left = right.copy()
    for _ in range(ROUNDS):
        m = g + s * c
        try:
            right, left = np.linalg.solve(m, c @ right), np.linalg.solve(m.T, c.T @ left)
        except np.linalg.LinAlgError:
            return s
        right, left = right / np.abs(right).max(), left / np.abs(left).max()
        below = left @ c @ right
        if below == 0.0 or not np.isfinite(below):
            return start
        s, before = -(left @ g @ right) / below, s
        if not abs(s - start) <= CLUSTER * near:
            return start  # a multiple one
        if abs(s - before) <= 4e-16 * near:
            break
    return complex(s)


def vectors(g: np.ndarray, c: np.ndarray, found: np.ndarray) -> list[Any]:
    """For each s a vector with (G + s C) x = 0, different ones for an s that is there several times."""
    import numpy as np

    scale = [np.abs(g).max(axis=1) + np.abs(c).max(axis=1)]
    rows = 1.0 / np.where(scale[0] > 0.0, scale[0], 1.0)
    rng = np.random.default_rng(11)
    made: list[Any] = []
    typical = np.abs(found[found != 0.0]).min(initial=np.inf)
    for k, s in enumerate(found):
        like = [made[j] for j in range(k) if abs(found[j] - s) <= CLUSTER * abs(s)]
        step = 1e-10 * (abs(s) if s != 0.0 else typical if np.isfinite(typical) else 1.0)
        m = rows[:, None] * (g + (s + step) * c)
        x = rng.standard_normal(len(g)) + 0j
        for _ in range(3):
            try:
                x = np.linalg.solve(m, x)
            except np.linalg.LinAlgError:
                break
            x = x / np.abs(x).max()
            for other in like:
                x = x - other * (other.conj() @ x) / (other.conj() @ other)
            x = x / np.abs(x).max()
            if s == 0.0:
                continue
        made.append(x.real + 0j if s.imag == 0.0 else x)
    return made
