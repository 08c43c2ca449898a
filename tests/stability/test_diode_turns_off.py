"""A freewheel diode that turns off within a step of radau.

The Jacobian of a step is taken at its middle as the last step's polynomial foresees it. Where the diode turns off, that
polynomial runs far up the exponential: with a conductance of 1e30 every update is nothing, and stages that miss
Kirchhoff's law by amperes counted as solved. An idle motor on a chopper reached 6391 rad/s where its supply allows 240.
"""

from __future__ import annotations

import pytest
from support import deck, run

import emsim

CHOPPER = """idle motor on a chopper with a freewheel diode: the current stops in every period
Vbat  vb 0 12
S1    vb a g 0 sw
D1    0 a df
.model df D(is=1n)
.model sw sw(vt=2.5 vh=0 ron=1m roff=1meg)
Vg    g 0 PULSE(0 5 0 10n 10n {0.25m-10n} 0.5m)
BODY  rotor m=0.1 j=100u
JOINT shaft 0 rotor pin ic=(0,80)
MOTOR m1 a 0 shaft kt=50m r=1 l=0.5m
.options reltol=1e-5
.tran 0.1m 0.2
.end
"""


@pytest.mark.parametrize("method", ["radau", "radau5", "auto"])
def test_an_idle_chopper_keeps_to_its_supply(method):
    result = emsim.run(CHOPPER, method=method, energy=True)
    # 167.258 by trap at 1e-7 and by radau9
    assert result["omega(shaft)"][-1] == pytest.approx(167.258, abs=0.01)
    assert max(abs(result["i(m1)"])) < 4.0


def test_a_multiplier_of_ten_stages_gets_through():
    result = run(deck("electrical/multiplier10"), "method=radau")
    assert result.status == "ok"


@pytest.mark.parametrize("reltol", [1e-3, 1e-4])
def test_a_flyback_conserves_its_flux_at_loose_tolerances(reltol):
    """While everything else settled in an iteration the contraction looked like 1e-6; the diode, which had turned off since
    the Jacobian was made, still missed 12 A. The output rose to 60 V."""
    result = run(deck("electrical/flyback"), f"method=radau reltol={reltol:g}")
    # 9.26976 by radau at 1e-8, by trap and esdirk at 1e-6
    assert result["v(out)"][-1] == pytest.approx(9.26976, rel=3 * reltol)


@pytest.mark.parametrize("method", ["radau", "radau9", "radau13", "auto"])
def test_stages_that_explode_do_not_count_as_solved(method):
    """Beside 1e36 V an update of 1e53 V is a small one: a bridge's diode turned off, and the run went on from there."""
    result = run(deck("coupled/slider_crank_hbridge"), f"method={method}", tran="20u 0.3")
    assert result.status == "ok"
    for node in "v(a)", "v(b)":
        assert max(abs(result[node])) < 16.0  # the supply and two drops
    assert max(abs(result["i(m1)"])) < 13.0  # 12 V over 1 ohm


@pytest.mark.parametrize("reltol", [1e-3, 1e-5])
def test_an_h_bridge_with_diodes_gets_through(reltol):
    """Four diodes without capacitance take over a winding's current in each of 2000 periods."""
    result = run(deck("coupled/slider_crank_hbridge"), f"method=radau reltol={reltol:g}")
    # -54.8847 by gear, esdirk and radau at 1e-5 and below
    assert result.status == "ok"
    assert result["omega(shaft)"][-1] == pytest.approx(-54.8847, rel=1e-4)
    assert result.energy.share < 1e-4
