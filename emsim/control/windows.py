"""Windows of spectra, as `set specwindow` names them."""

from __future__ import annotations

import numpy as np

from ..diagnostics import did_you_mean
from .errors import CommandError

TYPE_CHECKING = False
if TYPE_CHECKING:
    from .session import Session

COSINES = {
    "none": (1.0,), "rectangular": (1.0,),
    "hann": (1.0, -1.0), "hanning": (1.0, -1.0), "cosine": (1.0, -1.0),
    "hamming": (1.0, -0.46 / 0.54), "blackman": (1.0, -0.50 / 0.42, 0.08 / 0.42),
    "flattop": (1.0, -1.93, 1.29, -0.388, 0.032),
}  # fmt: skip
WINDOWS = (*COSINES, "bartlet", "bartlett", "triangle", "gaussian")


def window(s: Session, x: np.ndarray, usual: str = "hanning") -> np.ndarray:
    """`set specwindow`, the usual one where it is not set, with a mean of 1."""
    name = str(s.variables.get("specwindow", usual)).lower()
    n = len(x)
    u = (x - x[0]) / (x[-1] - x[0]) if n > 1 else np.zeros(n)
    if name in COSINES:
        return sum((a * np.cos(2 * np.pi * k * u) for k, a in enumerate(COSINES[name])), np.zeros(n))
    if name in ("bartlet", "bartlett", "triangle"):
        return 2.0 - np.abs(2.0 + 4.0 * (u - 1.0))
    if name == "gaussian":
        sigma = 1.0 / max(2, s.integer("specwindoworder", 2))
        return 0.83 / sigma * np.exp(-0.5 * ((u - 0.5) / (sigma / 2.0)) ** 2)
    raise CommandError(
        "E162",
        f"there is no window `{name}`",
        did_you_mean(name, WINDOWS, "there are " + ", ".join(WINDOWS)),
    )
