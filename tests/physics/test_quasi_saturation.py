"""A transistor whose collector saturates: its charges are one law on both sides of u = 0; every method goes through an edge."""

from __future__ import annotations

import pytest

import emsim

DECK = """a transistor with charges of quasi-saturation, driven hard
Vcc vcc 0 10
Vin in 0 pulse(0 8 100n 5n 5n 400n 1u)
Rb in b 500
Rc vcc c 300
Q1 c b 0 m
.model m NPN(Is=1e-14 Bf=100 Vaf=80 Cjc=5p Cje=10p Tf=1n Tr=100n rco=40 vo=2 gamma=1e-8 qco=1e-12 rc=1)
.options method={method} reltol={reltol}
.tran 1n 1u
.save v(c) v(b)
.end
"""
METHODS = ("auto", "radau", "esdirk", "gear", "trap", "trbdf2")


@pytest.fixture(scope="module")
def exact() -> emsim.Result:
    return emsim.run(DECK.format(method="radau", reltol=1e-9))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("reltol", [1e-3, 1e-6])
def test_a_saturated_transistor_is_switched(method: str, reltol: float, exact: emsim.Result) -> None:
    found = emsim.run(DECK.format(method=method, reltol=reltol))
    for t in (90e-9, 108e-9, 150e-9, 400e-9, 480e-9, 700e-9, 1e-6):
        # within five tolerances of a range of 10 V
        assert abs(found.at("v(c)", t) - exact.at("v(c)", t)) < 5 * reltol * 10.0, t
