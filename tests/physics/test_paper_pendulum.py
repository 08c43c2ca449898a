"""The paper's pendulum: let go, and under P control, which adds no damping of its own (netlists/paper/README.md)."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import argrelmax
from scipy.special import ellipj, ellipk
from support import NETLISTS

import emsim


@pytest.mark.parametrize(("reltol", "off"), [(1e-3, 2e-3), (1e-6, 2e-6), (1e-9, 2e-9)])
def test_the_free_swing_is_an_elliptic_function(reltol: float, off: float) -> None:
    r = emsim.run(str(NETLISTS / "paper/pendulum_free.cir"), reltol=reltol)
    # a hangs from the vertical: sin(a/2) = k sn(K - w t, k), k = sin(a0/2), w^2 = m g l/2 / (m l^2/3)
    k, w = np.sin(np.pi / 8), np.sqrt(1.5 * 9.80665)
    sn = ellipj(ellipk(k * k) - w * r.time, k * k)[0]
    expected = 2.0 * np.arcsin(k * sn) - np.pi / 2
    assert np.max(abs(r["angle(hinge)"] - expected)) < off


def test_proportional_control_hardly_damps() -> None:
    r = emsim.run(str(NETLISTS / "paper/motor_pendulum_kp30.cir"), reltol=1e-7)
    x = abs(r.at("x(arm.com)", np.linspace(0, 10, 20_001)))
    crests = x[argrelmax(x)[0]]
    # a dozen crests in 10 s, each half a percent below the one before
    assert len(crests) > 10
    assert crests[1:] / crests[:-1] == pytest.approx(np.full(len(crests) - 1, 0.9945), abs=2e-3)
    assert crests[-1] == pytest.approx(0.3325, abs=2e-4)
