"""What is known of quantities before they are fitted: normal distributions, each one more residual (value - mean)/deviation.

With it the least squares are the likeliest values after the data (maximum a posteriori), and the intervals those of both.
"""

from __future__ import annotations

import math

from ..units import spice_number

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    import numpy as np

    from .quantities import Quantity


class Priors:
    """Of some of the quantities that are asked for, by their place: mean and standard deviation. Raises ValueError."""

    def __init__(self, given: Mapping[str, object], asked: Sequence[Quantity]) -> None:
        names = [q.name for q in asked]
        self.known: list[tuple[int, float, float]] = []
        for name, what in given.items():
            if name.lower() not in names:
                raise ValueError(f"`{name}` has a prior and is not to be found: there is {', '.join(names)}")
            mean, deviation = _parsed(name, what) if isinstance(what, str) else _pair(name, what)
            if not (math.isfinite(mean) and 0.0 < deviation < math.inf):
                raise ValueError(f"{name}: a prior is a number and a standard deviation above zero")
            self.known.append((names.index(name.lower()), mean, deviation))

    def __len__(self) -> int:
        return len(self.known)

    def residual(self, values: Sequence[float]) -> np.ndarray:
        import numpy as np

        return np.array([(values[k] - mean) / deviation for k, mean, deviation in self.known], float)

    def slopes(self, asked: Sequence[Quantity], values: Sequence[float]) -> np.ndarray:
        """By the places of the quantities."""
        import numpy as np

        found = np.zeros((len(self.known), len(asked)))
        for row, (k, _, deviation) in enumerate(self.known):
            found[row, k] = asked[k].slope(values[k]) / deviation
        return found


def _pair(name: str, what: object) -> tuple[float, float]:
    pair: Any = what
    try:
        mean, deviation = pair
        return float(mean), float(deviation)
    except (TypeError, ValueError):
        raise ValueError(f"{name}: a prior is (mean, standard deviation)") from None


def _parsed(name: str, text: str) -> tuple[float, float]:
    """1k+-50 or 1k+-5%"""
    first, _, second = text.replace(" ", "").partition("+-")
    part = second.endswith("%")
    mean, deviation = spice_number(first), spice_number(second.removesuffix("%"))
    if mean is None or deviation is None:
        raise ValueError(f"{name}={text}: write a prior as 1k+-50 or 1k+-5%")
    return float(mean), float(deviation) * (0.01 * abs(float(mean)) if part else 1.0)
