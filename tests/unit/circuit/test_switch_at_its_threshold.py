"""S and W whose control comes to rest exactly at the threshold turn when it arrives there, as in ngspice 39: with vt=0 on
PULSE(0 1) the switch was on for ever after the first pulse, with vt=5 on PULSE(0 5) it never came on."""

from __future__ import annotations

import pytest
from circuit_decks import deck

import emsim

S = "S1 o 0 d 0 sm"
W = "W1 o 0 vd sm"
OFF, ON = 5 * 1e6 / (1e6 + 1e3), 5 / 1001


@pytest.mark.parametrize("card", [S, W])
@pytest.mark.parametrize("method", ["auto", "trap", "gear", "radau"])
@pytest.mark.parametrize(("top", "threshold"), [(1, 0), (5, 5)])
def test_it_turns_where_the_control_arrives(card: str, method: str, top: float, threshold: float) -> None:
    pulse = f"PULSE(0 {top} 2m 1u 1u 2m 5m)"
    control = [f"Vd d 0 {pulse}"] if card == S else [f"Id 0 d {pulse}", "Vd d 0 0"]
    model = f".model sm {'sw(vt' if card == S else 'csw(it'}={threshold} ron=1 roff=1meg)"
    r = emsim.run(deck(*control, "V1 a 0 5", "R1 a o 1k", card, model, ".tran 50u 20m"), method=method)
    for t in (4.5e-3, 6e-3, 9.5e-3, 16e-3, 19.5e-3):
        assert r.at("v(o)", t) == pytest.approx(OFF, rel=1e-3)
    for t in (3e-3, 8e-3, 13e-3, 18e-3):
        assert r.at("v(o)", t) == pytest.approx(ON, rel=1e-3)
