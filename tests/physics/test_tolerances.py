"""Absolute tolerances by kind of quantity: sensible for micrometres and for tens of metres, shown, and in force."""

from __future__ import annotations

import numpy as np
import pytest
from support import run

import emsim

MEMS = """A proof mass rings by a nanometre
* Teaches: tolerances of lengths and speeds follow the size of what the deck describes.
* Checked against: x = 1 nm cos(w t), w^2 = k/m.
BODY   mass m=2n shape=box(200u,100u)
JOINT  beam 0 mass slide axis=(1,0) ic=1n
SPRING fold beam k=32
.tran 5u 1m
.print tran pos(beam) vel(beam)
.end
"""
FEMTOFARAD = """Ten femtofarad follow a sine through ten gigaohm
V1     in 0 SIN(0 1 2k)
R1     in gate 10g
C1     gate 0 10f
.tran 20u 20m
.end
"""
CRANE = """Ten tonnes hang on thirty metres of rope that gives; a trolley runs out along its boom
.gravity 9.81
BODY   trolley m=2000
JOINT  rail 0 trolley slide axis=(1,0)
BODY   rope m=10
JOINT  hook trolley rope pin ic=0
BODY   load m=10000
JOINT  hoist rope load slide axis=(0,-1) ic=30
SPRING rope1 hoist k=400k q0={30-10000*9.81/400k}
DAMPER rope2 hoist c=2k
DAMPER wheels rail c=500
FORCE  push trolley PULSE(0 8k 1 2 2 6 100) dir=(1,0)
.tran 0.1 40
.print tran pos(rail) angle(hook) pos(hoist)
.end
"""
OF_A_CRANE = "lentol=3e-7 veltol=1.7e-7"
OF_A_MEMS = "lentol=1e-16 veltol=1e-16"
METHODS = ("radau", "radau5", "dop853", "esdirk")


def mems_error(options: str) -> float:
    """Of position and speed, as shares of their ranges."""
    result = run(MEMS, options)
    t, w = np.asarray(result.time), np.sqrt(32 / 2e-9)
    x = np.abs(result["pos(beam)"] - 1e-9 * np.cos(w * t)).max() / 2e-9
    v = np.abs(result["vel(beam)"] + 1e-9 * w * np.sin(w * t)).max() / (2e-9 * w)
    return max(float(x), float(v))


@pytest.mark.parametrize("method", METHODS)
def test_a_nanometre_is_resolved_and_the_tolerance_of_a_crane_would_lose_it(method):
    ok = mems_error(f"method={method} reltol=1e-5")
    lost = mems_error(f"method={method} reltol=1e-5 {OF_A_CRANE}")
    assert ok <= 1e-4, ok
    assert lost > 30 * ok, (ok, lost)
    assert lost > 1e-4 or method == "radau", lost


def crane_error(result: emsim.Result, ref: emsim.Result) -> float:
    _, a, b = np.intersect1d(result.time, ref.time, return_indices=True)
    names = ("pos(rail)", "angle(hook)", "pos(hoist)")
    return max(
        float(np.abs(np.asarray(result[n])[a] - np.asarray(ref[n])[b]).max() / np.ptp(ref[n])) for n in names
    )


@pytest.mark.parametrize("method", ["radau", "radau5", "esdirk"])
def test_a_crane_pays_for_what_it_asks_and_not_for_micrometres(method):
    ref = run(CRANE, "method=radau reltol=1e-11")
    plain = run(CRANE, f"method={method} reltol=1e-3")
    tiny = run(CRANE, f"method={method} reltol=1e-3 {OF_A_MEMS}")
    assert crane_error(plain, ref) <= 1e-2
    assert crane_error(run(CRANE, f"method={method} reltol=1e-5"), ref) <= 1e-4
    assert tiny.stats["evaluations"] > 1.05 * plain.stats["evaluations"]


def test_ten_femtofarad_count_unless_chgtol_lets_them_pass():
    """1e-14 C, SPICE's custom, is a volt on ten femtofarad."""

    def error(options: str) -> float:
        runs = [
            run(FEMTOFARAD, o) for o in (f"method=gear reltol=1e-5 {options}", "method=radau reltol=1e-10")
        ]
        _, a, b = np.intersect1d(runs[0].time, runs[1].time, return_indices=True)
        return float(np.abs(np.asarray(runs[0]["v(gate)"])[a] - np.asarray(runs[1]["v(gate)"])[b]).max())

    assert error("") <= 1e-4
    assert error("chgtol=1e-14") > 1e-3


def table(deck: str, **options: float) -> dict[str, dict]:
    return {row["option"]: row for row in emsim.check(deck, options=options)["tolerances"]}


def test_check_shows_every_kind_with_unit_value_and_source():
    found = table(MEMS)
    assert found["lentol"]["unit"] == "m"
    assert found["lentol"]["value"] == pytest.approx(2e-12)
    assert "BODY mass" in found["lentol"]["source"]
    assert "vntol" not in found  # nor a node
    assert table(FEMTOFARAD)["vntol"]["value"] == pytest.approx(1e-6)
    assert "forcetol" not in found  # no multiplier here
    assert "angtol" not in found
    crane = table(CRANE)
    assert crane["lentol"]["value"] == pytest.approx(3e-7)
    assert "JOINT hoist" in crane["lentol"]["source"]
    assert crane["veltol"]["value"] == pytest.approx(1e-8 * np.sqrt(9.81 * 30))


def test_what_is_given_is_taken_as_it_is_and_the_rest_follows_reltol():
    found = table(MEMS, reltol=1e-5, veltol=1e-7, chgtol=1e-17)
    assert found["veltol"]["value"] == 1e-7
    assert found["veltol"]["source"] == ".options veltol"
    assert found["chgtol"]["value"] == 1e-17
    assert found["lentol"]["value"] == pytest.approx(2e-14)
    assert "follows reltol" in found["lentol"]["source"]
