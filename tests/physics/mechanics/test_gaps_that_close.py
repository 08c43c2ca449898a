"""A TRANSDUCER whose gap closes is named, with the coordinate and where the gap is gone: not a capacitor, not a negative coil."""

from __future__ import annotations

import pytest

import emsim

PLATE = """plate creeps onto its electrode in oil
BODY p m=1n
JOINT g 0 p slide axis=(1,0)
SPRING k1 g k=1
DAMPER oil g c=1m
TRANSDUCER t1 a 0 g C={8.854e-12*4e-8/(2u-pos(g))}
Vs a 0 4
.tran 1u 20m
.end
"""
MAGNET = """magnet pulls an armature onto its pole, nothing stops it
BODY arm m=10m
JOINT x 0 arm slide axis=(1,0)
SPRING s x k=500
TRANSDUCER coil a 0 x L={1u/(1m-pos(x))}
R1 s a 1
Vs s 0 6
.tran 10u 20m uic
.end
"""


@pytest.mark.parametrize(
    ("deck", "said"),
    [
        (PLATE, "pos(g) reached 2e-06 m"),
        (MAGNET, "pos(x) reached 0.001 m"),
        (MAGNET.replace("10u 20m", "10u 3m"), "pos(x) reached 0.001 m"),  # the run itself got to its end
    ],
)
def test_a_closed_gap_is_a_matter_of_capacitors_or_goes_on_with_a_negative_inductance(deck, said):
    with pytest.raises(emsim.ConvergenceError) as trouble:
        emsim.run(deck)
    (found,) = trouble.value.diagnostics
    assert found.code == "E415" and said in found.message and "STOP" in (found.hint or "")


def test_a_gap_that_stays_open_is_not_spoken_of():
    assert emsim.run(PLATE.replace("Vs a 0 4", "Vs a 0 1"))["pos(g)"][-1] < 0.7e-6
