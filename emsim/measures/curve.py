"""A signal between its points: polynomials, one a segment, through values at Chebyshev's points (engine/src/curve.rs).
Here are the matrices of these points, for whole arrays of curves.
"""

from __future__ import annotations

import numpy as np

from .._engine import chebyshev

DEGREE = 4  # between two points of a table


def nodes(n: int) -> np.ndarray:
    """The points on 0 .. 1."""
    return np.array(chebyshev("nodes", n)[0])


def slopes(n: int) -> np.ndarray:
    """The matrix that takes values there to derivatives there."""
    return np.array(chebyshev("slopes", n))


def areas(n: int) -> np.ndarray:
    """Weights of the integral over 0 .. 1."""
    return np.array(chebyshev("areas", n)[0])


def integrals(n: int) -> np.ndarray:
    """The matrix that takes values there to integrals from 0 to each point."""
    return np.array(chebyshev("integrals", n))


def resampling(n: int, at: np.ndarray) -> np.ndarray:
    """The matrix (m, n+1) that takes values there to those at other places (m,)."""
    return np.array(chebyshev("resampling", n, at.tolist()))
