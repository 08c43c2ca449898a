"""A deck as a function of JAX and of PyTorch."""

from __future__ import annotations

import numpy as np
import pytest

from emsim.differentiable import Function

CHARGING = """charging
.param r=1k c=1u
V1 in 0 1
R1 in out {r}
C1 out 0 {c} IC=0
.tran 50u 5m uic
.meas tran t63 when v(out)=0.632120558828558
.meas tran half find v(out) at=1m
.end
"""
NUMBERS = [2e3, 0.5e-6]


def exact(r: float, c: float) -> tuple[np.ndarray, np.ndarray]:
    x = 1e-3 / (r * c)
    slope = -x * np.exp(-x)
    return np.array([r * c, 1.0 - np.exp(-x)]), np.array([[c, r], [slope / r, slope / c]])


def test_values_and_derivatives_are_those_of_the_closed_form():
    f = Function(CHARGING, ["t63", "half"], ["r", "c"])
    assert f.start == [1e3, 1e-6] and f.names == ["t63", "half"]
    y, matrix = f.both(NUMBERS)
    values, slopes = exact(*NUMBERS)
    assert np.allclose(y, values, rtol=1e-6) and np.allclose(matrix, slopes, rtol=1e-5)
    assert np.array_equal(f.values(NUMBERS), y)
    with pytest.raises(ValueError, match="2 quantities"):
        f.values([1.0])


def test_complex_signals_are_refused():
    deck = "low pass\n.param r=1k\nV1 in 0 dc 0 ac 1\nR1 in out {r}\nC1 out 0 1u\n.ac dec 10 1 1k\n.end\n"
    with pytest.raises(TypeError, match="complex"):
        Function(deck, "v(out)", "r", at=[100.0])


def test_jax_differentiates_it_forwards_and_backwards():
    jax = pytest.importorskip("jax")
    import emsim.jax as bridge

    jax.config.update("jax_enable_x64", True)
    f = bridge.function(CHARGING, ["t63", "half"], ["r", "c"])
    x = jax.numpy.array(NUMBERS)
    values, slopes = exact(*NUMBERS)
    assert np.allclose(f(x), values, rtol=1e-6)
    for jacobian in (jax.jacrev(f), jax.jacfwd(f), jax.jit(jax.jacrev(f))):
        assert np.allclose(jacobian(x), slopes, rtol=1e-5)
    weights = jax.numpy.array([1e3, -2.0])
    assert np.allclose(
        jax.jit(jax.grad(lambda x: (f(x) ** 2) @ weights))(x), 2.0 * weights * values @ slopes, rtol=1e-5
    )
    assert np.allclose(jax.vmap(f)(jax.numpy.stack([x, 1.1 * x]))[0], values, rtol=1e-6)


def test_torch_differentiates_it():
    torch = pytest.importorskip("torch")
    import emsim.torch as bridge

    f = bridge.function(CHARGING, ["t63", "half"], ["r", "c"])
    x = torch.tensor(NUMBERS, dtype=torch.float64, requires_grad=True)
    values, slopes = exact(*NUMBERS)
    y = f(x)
    (1e3 * y[0] - 2.0 * y[1]).backward()
    assert np.allclose(y.detach().numpy(), values, rtol=1e-6)
    assert np.allclose(x.grad.numpy(), np.array([1e3, -2.0]) @ slopes, rtol=1e-5)
    assert not f(x.detach()).requires_grad


def test_the_extras_are_loaded_when_they_are_asked_for():
    import subprocess
    import sys

    code = "import sys, emsim; emsim.jax, emsim.torch; print('jax' in sys.modules or 'torch' in sys.modules)"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "False"
    )
