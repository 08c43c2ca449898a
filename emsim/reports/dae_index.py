"""The index of a DAE, by Griepentrog and Maerz's chain of matrices on the linearisation at a point.

    A_0 = C, B_0 = G;   Q_i a projector onto ker A_i;   A_{i+1} = A_i + B_i Q_i,   B_{i+1} = B_i (1 - Q_i)

The index is the first i with A_i regular (Differential-Algebraic Equations and Their Numerical Treatment, 1986). 0: an
ordinary differential equation; 1: algebraic equations that can be solved for what they determine; 2: some of them must be
differentiated first.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    import numpy as np

    from .._engine import System

MOST = 250  # unknowns; the chain costs a few times n^3
HIGHEST = 3
RANK = 1e-10  # singular values below this share of the largest are zero


def index_of(system: System, x: list[float], t: float = 0.0) -> int | None:
    """The index at (x, t); None for a system that is too large, or where it is above HIGHEST."""
    import numpy as np

    if system.n > MOST:
        return None
    indptr, indices = system.pattern()
    columns = np.repeat(np.arange(system.n), np.diff(indptr))
    a, b = np.zeros((2, system.n, system.n))
    a[indices, columns], b[indices, columns] = system.jac(x, t)
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return None
    for index in range(HIGHEST + 1):
        kernel = _kernel(a)
        if not kernel.shape[1]:
            return index
        projector = kernel @ np.linalg.pinv(kernel)
        b_kernel = b @ projector
        # any multiple will do: of the size of A, so that neither drowns the other
        size = max(abs(b_kernel).max(), 1e-300)
        a = a + b_kernel * (max(abs(a).max(), 1e-300) / size)
        b = b - b_kernel
    return None


def _kernel(a: np.ndarray) -> np.ndarray:
    """A basis of the null space, shape (n, k); rows and columns are brought to one size first."""
    import numpy as np

    rows, columns = np.ones(len(a)), np.ones(len(a))
    for _ in range(4):
        scaled = abs(a * rows[:, None] * columns)
        rows /= np.sqrt(np.where((m := scaled.max(axis=1)) > 0, m, 1.0))
        columns /= np.sqrt(np.where((m := scaled.max(axis=0)) > 0, m, 1.0))
    _, sizes, right = np.linalg.svd(a * rows[:, None] * columns)
    kernel = right[sizes <= RANK * max(sizes[0], 1e-300)].T
    kernel = columns[:, None] * kernel
    return kernel / np.maximum(abs(kernel).max(axis=0), 1e-300) if kernel.shape[1] else kernel
