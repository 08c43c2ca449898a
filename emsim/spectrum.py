"""The spectrum of samples: amplitudes of the sines that add up to them, by the fast Fourier transform.

    y_k w_k,  k = 0 .. n-1       z_m = 2/(n W) sum_k y_k w_k e^(-2 pi j m k/n),   W the mean of the window w             (1)

so that a sine in the middle of a line has its own amplitude there, whatever the window; the mean, at frequency 0, has half of the
factor, and so has the last line of an even n. Windows are periodic (Harris, Proc. IEEE 66, 1978, 51).
"""

from __future__ import annotations

import numpy as np

# coefficients of the cosines, with alternating signs
WINDOWS: dict[str, tuple[float, ...]] = {
    "none": (1.0,),
    "hann": (0.5, 0.5),
    "hamming": (0.54, 0.46),
    "blackman": (0.42, 0.5, 0.08),
    "flattop": (0.21557895, 0.41663158, 0.277263158, 0.083578947, 0.006947368),
}


def window(name: str, n: int) -> np.ndarray:
    """KeyError for one that is not there."""
    k = 2 * np.pi * np.arange(n) / n
    values: np.ndarray = np.add.reduce([(-1) ** m * a * np.cos(m * k) for m, a in enumerate(WINDOWS[name])])
    return values


def amplitudes(y: np.ndarray, step: float, shape: str = "hann") -> tuple[np.ndarray, np.ndarray]:
    """(frequencies, complex amplitudes) of (1), of samples so far apart: arrays of n//2 + 1."""
    n, w = len(y), window(shape, len(y))
    z = np.fft.rfft(y * w) * (2.0 / (n * w.mean()))
    z[0] /= 2
    if n % 2 == 0:
        z[-1] /= 2
    return np.arange(len(z)) / (n * step), z
