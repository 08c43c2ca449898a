"""`.tran .. startup`: at rest independent sources are 0, in the first 20 us they rise to what they are."""

from __future__ import annotations

import numpy as np
import pytest

import emsim

V, R, C, RISE = 5.0, 1e3, 10e-9, 20e-6
DECK = f"""a supply that is turned on
V1 a 0 {V}
R1 a b {R:g}
C1 b 0 {C:g}
I1 0 d SIN(1m 1m 20k)
R2 d 0 1k
L1 a e 1m
R3 e 0 100
.tran 1u 100u startup
.end
"""


def turned_on(t: np.ndarray) -> np.ndarray:
    """Of an RC on V t/T up to T, V from then on: V/T (t - tau (1 - e^(-t/tau))), then the rest falls as e^(-(t - T)/tau)."""
    tau = R * C
    rising = V / RISE * (t - tau * -np.expm1(-t / tau))
    at_end = V / RISE * (RISE - tau * -np.expm1(-RISE / tau))
    return np.where(t < RISE, rising, V - (V - at_end) * np.exp(-(t - RISE) / tau))


@pytest.mark.parametrize("method", ["auto", "trap", "gear", "radau"])
def test_sources_rise_from_rest(method):
    result = emsim.run(DECK, method=method, reltol=1e-6)
    t = result.time
    assert np.abs(result["v(a)"] - V * np.minimum(t / RISE, 1.0)).max() < 1e-9
    assert np.abs(result["v(b)"] - turned_on(t)).max() < 1e-4 * V
    sine = (1.0 + np.sin(2 * np.pi * 20e3 * t)) * np.minimum(t / RISE, 1.0)
    assert np.abs(result["v(d)"] - sine).max() < 1e-5  # between the steps of gear
    # at rest nothing flows, though the coil alone would carry 50 mA
    assert result["i(l1)"][0] == 0.0
    # the kink at 20 us is a point of the run
    assert np.abs(t - RISE).min() < 1e-12


def test_start_and_current_are_those_of_the_source():
    result = emsim.run(DECK.replace(".tran", ".options trtol=1\n.save @i1[current] v(d)\n.tran"))
    assert np.allclose(result["@i1[current]"], result["v(d)"] / 1e3, atol=1e-12)


def test_no_other_analysis_beside_it():
    with pytest.raises(emsim.DeckError, match=r"which \.op of the same deck cannot have"):
        emsim.run(DECK.replace(".end", ".op\n.end"))
    assert emsim.run(DECK.replace(" startup", " ").replace(".end", ".op\n.end")).status == "ok"
