"""LTspice's coil by its flux and capacitor by its charge, of `x`, its own current and voltage, beside closed forms."""

from __future__ import annotations

import numpy as np
import pytest

import emsim
from emsim import pipeline

METHODS = ("auto", "trap", "radau", "esdirk")
W = 2e3 * np.pi


def run(cards: str, method: str = "auto", dialect: str = "ltspice") -> emsim.Result:
    return emsim.run(
        f"deck\n{cards}\n.options method={method} reltol=1e-6 dialect={dialect}\n.tran 1u 2m 0 1u\n.end\n"
    )


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("m", [1, 4])
def test_the_voltage_of_a_coil_is_the_change_of_its_flux(method: str, m: int) -> None:
    # i = m sin(w t) divides among m coils: v = d/dt 1m tanh(5 sin(w t))
    r = run(f"I1 0 a SIN(0 {m} 1k)\nL1 a 0 flux=1m*tanh(5*x) m={m}", method)
    t = r["time"][5:]
    x = np.sin(W * t)
    right = 1e-3 * 5 * W * np.cos(W * t) / np.cosh(5 * x) ** 2
    assert np.max(np.abs(r["v(a)"][5:] - right)) < 1e-3 * 5 * W * 1e-3


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("m", [1, 3])
def test_the_current_of_a_capacitor_is_the_change_of_its_charge(method: str, m: int) -> None:
    r = run(f"V1 a 0 SIN(0 2 1k)\nC1 a 0 Q=1u*x+0.2u*x**3 m={m}", method)
    t = np.linspace(0.1e-3, 1.9e-3, 50)
    x, dx = 2 * np.sin(W * t), 2 * W * np.cos(W * t)
    right = -m * (1e-6 + 0.6e-6 * x**2) * dx
    assert np.max(np.abs(r.at("i(v1)", t) - right)) < 1e-3 * np.max(np.abs(right))


def test_x_is_of_the_capacitor_behind_its_series_resistance() -> None:
    # Q = C x: an RC, v = 1 - exp(-t/RC)
    r = run("V1 a 0 PWL(0 0 1n 1)\nC1 a 0 Q=1u*x Rser=500\n.param x=7")
    t = np.linspace(0.1e-3, 1.9e-3, 20)
    assert r.at("i(v1)", t) == pytest.approx(-np.exp(-t / 0.5e-3) / 500, rel=1e-3)


def test_x_of_a_coil_within_a_subcircuit_is_its_own_current() -> None:
    r = run("I1 0 a SIN(0 1 1k)\nX1 a coil\n.subckt coil p\nL1 p 0 flux=1m*x\n.ends", dialect="ngspice")
    t = np.linspace(0.1e-3, 1.9e-3, 20)
    assert r.at("v(a)", t) == pytest.approx(1e-3 * W * np.cos(W * t), abs=1e-3 * W * 1e-3)


def test_a_param_called_x_keeps_its_meaning_for_ngspice() -> None:
    r = run(".param x=2\nV1 a 0 SIN(0 1 1k)\nC1 a 0 q='x*1u*v(a)'", dialect="ngspice")
    t = np.linspace(0.1e-3, 1.9e-3, 20)
    assert r.at("i(v1)", t) == pytest.approx(-2e-6 * W * np.cos(W * t), abs=1e-3 * 2e-6 * W)


def test_the_ledger_counts_the_current_of_coils_in_parallel_once() -> None:
    text = "deck\nV1 a 0 SIN(0 1 1k)\nL1 a b L={1m+0*i(L1)} m=2\nR1 b 0 10\n.tran 1u 1.3m\n.end\n"
    assert pipeline.run(text, energy=True).energy.share < 1e-6
