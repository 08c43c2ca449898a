"""Where a run starts: operating point, .ic, .nodeset, UIC and element initial values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from circuit_decks import deck, remarks

import emsim


def test_tran_starts_from_the_operating_point() -> None:
    r = emsim.run(deck("V1 a 0 5", "R1 a b 1k", "C1 b 0 1u", ".tran 0.1m 1m"))
    np.testing.assert_allclose(r["v(b)"], 5.0, atol=1e-6)


def test_ic_holds_until_the_start() -> None:
    r = emsim.run(deck("V1 a 0 5", "R1 a b 1k", "C1 b 0 1u", ".ic v(b)=1", ".tran 10u 1m"), reltol=1e-6)
    assert r["v(b)"][0] == pytest.approx(1.0, abs=1e-6)
    assert r["v(b)"][-1] == pytest.approx(5 - 4 * math.exp(-1), rel=1e-4)


def test_uic_starts_from_ic_cards() -> None:
    r = emsim.run(deck("R1 b 0 1k", "C1 b 0 1u", ".ic v(b)=2", ".tran 10u 1m uic"), reltol=1e-6)
    assert r.at("v(b)", 1e-3) == pytest.approx(2 * math.exp(-1), rel=1e-4)


def test_uic_with_initial_values_of_elements() -> None:
    # a lossless tank: i(0) = 10 mA, v(0) = 1 V
    r = emsim.run(deck("L1 a 0 1m ic=10m", "C1 a 0 1u ic=1", "Rx a 0 1g", ".tran 1u 0.3m uic"), reltol=1e-7,
                  method="radau")  # fmt: skip
    w, z = 1 / math.sqrt(1e-9), math.sqrt(1e3)
    t = 0.25e-3
    assert r.at("v(a)", t) == pytest.approx(math.cos(w * t) - z * 0.01 * math.sin(w * t), abs=2e-4)


def test_a_floating_capacitor_charge_is_kept_under_uic() -> None:
    r = emsim.run(deck("C1 a b 1u ic=3", "R1 a 0 1k", "R2 b 0 1k", ".tran 10u 2m uic"), reltol=1e-6)
    assert r.at("v(a)", 2e-3) - r.at("v(b)", 2e-3) == pytest.approx(3 * math.exp(-1), rel=1e-4)


def test_nodeset_picks_the_state_of_a_latch() -> None:
    latch = (
        "B1 p 0 V={5/(1+exp(10*(v(q)-2.5)))}",
        "B2 q0 0 V={5/(1+exp(10*(v(p)-2.5)))}",
        "R1 q0 q 1k",
        "C1 q 0 1n",
    )
    for node, other in (("p", "q"), ("q", "p")):
        r = emsim.run(deck(*latch, f".nodeset v({node})=5 v({other})=0", ".op"))
        assert r.table("op")[f"v({node})"][0] > 4.9


def test_a_node_behind_capacitors_starts_at_zero_with_a_warning() -> None:
    lines = ("V1 a 0 4", "C1 a b 1u", "C2 b 0 1u")
    assert [d.code for d in remarks(*lines, ".tran 1m 10m")] == ["W303"]
    assert remarks(*lines, ".tran 1m 10m uic") == []
    assert emsim.run(deck(*lines, ".tran 1m 10m"))["v(b)"][-1] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("word", ["", "OFF", "ON"])
@pytest.mark.parametrize(("threshold", "level"), [(0.5, 0.6), (-5.0, -4.9), (0.0, 0.0), (0.5, 0.1)])
@pytest.mark.parametrize("analysis", [".op", ".tran 1u 10u"])
def test_a_switch_between_its_thresholds_starts_as_its_card_says(word, threshold, level, analysis) -> None:
    """0 V, where Newton's method begins, lies outside the band; the operating point does not."""
    lines = ("V1 1 0 1", "R1 1 a 1k", f"Vc c 0 {level}", f"S1 a 0 c 0 sw {word}")
    r = emsim.run(deck(*lines, f".model sw sw(vt={threshold} vh=0.2 ron=1 roff=1meg)", analysis))
    assert (r["v(a)"] < 0.5).all() == (word == "ON" and abs(level - threshold) < 0.2)


def test_an_operating_point_knows_nothing_of_ic() -> None:
    """.ic is about the start of .tran, as in ngspice; .nodeset helps both."""
    lines = ("V1 a 0 5", "R1 a b 1k", "R2 b 0 1k", "C1 b 0 1u", ".ic v(b)=1", ".nodeset v(a)=5")
    assert emsim.run(deck(*lines, ".op"))["v(b)"][-1] == pytest.approx(2.5)
    assert emsim.run(deck(*lines, ".tran 10u 1m"))["v(b)"][0] == pytest.approx(1.0)


@pytest.mark.parametrize("method", ["trap", "radau", "auto"])
def test_the_first_row_of_a_follower_whose_input_has_short_edges(method: str) -> None:
    """A charge that rounding moves, over a hundred-thousandth of the edge, is a current: the amplifier's output was 1.6 % off."""
    lines = ("V1 a 0 PULSE(1 2 0 1p 1p 1m 2m)", "E1 x 0 a b 1e6", "R1 x y 1k", "C1 y 0 1u", "E2 b 0 y 0 1")
    r = emsim.run(deck(*lines, f".options method={method}", ".tran 10u 1m"))
    assert r["v(x)"][0] == pytest.approx(1e6 / (1e6 + 1), rel=1e-9)
    assert abs(r["i(e1)"][0]) < 1e-12


def test_a_transistor_of_expressions_finds_its_point() -> None:
    """From no voltage Newton's method goes to and fro between 2 V at the base, where `min` holds the exponential, and a
    megavolt below; where it was made to stop, a point was taken for found that the next iteration left."""
    vt = 0.02585
    e = f"exp(min((v(b)-v(e))/{vt},40))-1"
    r = emsim.run(
        deck("Vcc c 0 12", "R1 c b 47k", "R2 b 0 10k", f"B1 k e I={{1e-14*({e})}}", f"B2 b e I={{1e-16*({e})}}",
             "Rc c k 4.7k", "Re e 0 1k", ".op")
    )  # fmt: skip
    diode = math.exp((r["v(b)"][0] - r["v(e)"][0]) / vt) - 1
    assert r["v(e)"][0] / 1e3 == pytest.approx(1.01e-14 * diode, rel=1e-3)
    assert (12 - r["v(k)"][0]) / 4.7e3 == pytest.approx(1e-14 * diode, rel=1e-3)
    assert (12 - r["v(b)"][0]) / 47e3 - r["v(b)"][0] / 10e3 == pytest.approx(1e-16 * diode, rel=1e-2)
    assert 0.6 < r["v(b)"][0] - r["v(e)"][0] < 0.75
