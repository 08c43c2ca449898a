"""How sure values are that least squares have found.

With J = d residuals/d values at the solution and s^2 the variance of what is left, values are normally distributed about the true
ones with the covariance s^2 (J^T J)^-1, where errors of the data are independent and small (Bates and Watts, Nonlinear regression
analysis, 1988). Values count in parts of their sizes. By the singular values of J, J = U diag(w) V^T, the values along V_k
are known to
s/w_k: where that is as large as the values themselves, or w_k is nothing beside the largest, the data do not tell, and V_k
names what is mixed up: changed together in these proportions, the quantities leave the curves as they are.
"""

from __future__ import annotations

from typing import NamedTuple

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

LEVEL = 0.95
NOTHING = 1e-5  # of the largest singular value of columns of equal length: derivatives are known to so much
WHOLE = 1.0  # of its size: a value that is known to so much is not known
PART = 0.1  # of the largest in a mixture; less is left out


class Mixture(NamedTuple):
    """Quantities that the data cannot tell apart: relative changes that go together, the largest 1."""

    changes: dict[str, float]

    def sentence(self) -> str:
        names = list(self.changes)
        if len(names) == 1:
            return f"the data do not tell what `{names[0]}` is: it has no effect on them that could be seen"
        listed = ", ".join(f"`{name}`" for name in names[:-1]) + f" and `{names[-1]}`"
        ways = ", ".join(f"{name} {100 * 0.01 * change:+.2g} %" for name, change in self.changes.items())
        return f"the data cannot tell {listed} apart: {ways} leave the curves as they are"


class Certainty:
    """`deviations` of values in parts of their sizes (inf where nothing is known), `correlation`, `mixtures`."""

    def __init__(
        self,
        names: Sequence[str],
        jacobian: np.ndarray,
        left: np.ndarray,
        freedom: int,
        variance: float | None = None,
    ) -> None:
        """`left`: the residuals; `variance`: theirs, where it is known; else it follows from them."""
        import numpy as np

        self.names, self.freedom = list(names), freedom
        self.variance = float(left @ left) / max(freedom, 1) if variance is None else variance
        n = len(self.names)
        lengths = np.linalg.norm(jacobian, axis=0)
        self.mixtures: list[Mixture] = []
        lost = np.zeros(n, bool)
        largest = lengths.max(initial=0.0)
        deviation = float(np.sqrt(self.variance))
        blind = (lengths <= NOTHING**2 * largest) | (deviation > WHOLE * lengths) | (lengths == 0.0)
        for k in np.flatnonzero(blind):
            self.mixtures.append(Mixture({self.names[k]: 1.0}))
        seen = np.flatnonzero(~blind)
        lost[blind] = True
        inverse = np.zeros((n, n))
        if len(seen):
            scaled = jacobian[:, seen] / lengths[seen]
            _, w, v = np.linalg.svd(scaled, full_matrices=False)
            for value, direction in zip(w, v, strict=True):
                way = direction / lengths[seen]  # as a change of values
                length = float(np.abs(way).max())
                unknown = deviation * length > WHOLE * max(value, 1e-300)
                if value < NOTHING * w[0] or unknown:
                    parts = (
                        way / way[np.flatnonzero(np.abs(way) > (1 - 1e-6) * length)[0]]
                    )  # of equals the first
                    mixed = {self.names[seen[k]]: float(p) for k, p in enumerate(parts) if abs(p) >= PART}
                    self.mixtures.append(Mixture(mixed))
                    lost[seen[np.abs(parts) >= PART]] = True
                    value = max(value, 1e-300)
                    if value < NOTHING * w[0]:
                        continue
                inverse[np.ix_(seen, seen)] += np.outer(way, way) / value**2
        self.covariance = self.variance * inverse
        self.lost = lost
        spread = np.sqrt(np.diag(self.covariance))
        safe = np.where(spread > 0.0, spread, 1.0)
        self.correlation = self.covariance / np.outer(safe, safe)
        np.fill_diagonal(self.correlation, 1.0)
        self.deviations = np.where(lost, np.inf, spread)

    def reach(self, level: float = LEVEL) -> np.ndarray:
        """Half the width of each interval of that probability, in parts of the sizes; by Student's distribution."""
        from scipy.stats import t

        return self.deviations * float(t.ppf(0.5 + 0.5 * level, max(self.freedom, 1)))
