"""A coil that closes a loop with a source, or with a node that .ic holds, has no current at rest that anything limits.

i(l1) was 1e13 A where the source is not 0 at t = 0 by phase, delay or modulation, and 50 mA where .ic says 0 V: a run starts
with the coil's ic=, 0 A without, as under UIC; ngspice 39 gives the same where it gives anything (tank_ic: 1e10 A there).
"""

from __future__ import annotations

from math import cos, exp, pi, sqrt

import pytest
from circuit_decks import deck, remarks

import emsim

# lines of the source, its voltage at t = 0
SOURCES = [
    ("SIN(0 10 50 0 0 90)", 10.0),
    ("SIN(0 10 50 5m 0 90)", 10.0),
    ("SIN(3 10 50)", 3.0),
    ("SFFM(0 10 50 5 20 90 0)", 10.0),
    ("PULSE(2 10 1m)", 2.0),
    ("PWL(0 4 1m 8)", 4.0),
    ("EXP(5 1 1m 1m)", 5.0),
    ("5", 5.0),
    ("DC 0 SIN(0 10 50 0 0 90)", 10.0),
]


@pytest.mark.parametrize(("wave", "at_start"), SOURCES)
def test_a_coil_across_a_source_starts_without_current(wave: str, at_start: float) -> None:
    lines = (f"V1 a 0 {wave}", "L1 a 0 75m", "R1 a 0 100", ".tran 10u 2m")
    r = emsim.run(deck(*lines))
    assert r["i(l1)"][0] == 0.0
    assert r["v(a)"][0] == pytest.approx(at_start, rel=1e-6)
    # L di/dt = v: the flux is the integral of the voltage
    t, v, i = r["time"], r["v(a)"], r["i(l1)"]
    flux = sum(0.5 * (v[k] + v[k + 1]) * (t[k + 1] - t[k]) for k in range(len(t) - 1))
    assert 75e-3 * (i[-1] - i[0]) == pytest.approx(flux, rel=2e-3)
    assert [d.code for d in remarks(*lines)] == ["W301"]


@pytest.mark.parametrize(
    "wave", ["SIN(0 10 50)", "SIN(0 10 50 0 0 180)", "PULSE(0 10 1m)", "PWL(0 0 1m 8)", "DC 3 SIN(0 1 50)"]
)
def test_a_source_that_starts_at_zero_says_nothing(wave: str) -> None:
    assert remarks(f"V1 a 0 {wave}", "L1 a 0 75m", ".tran 10u 2m") == []


def test_a_cosine_across_a_coil_is_a_sine() -> None:
    r = emsim.run(
        deck("V1 a 0 SIN(0 10 50 0 0 90)", "L1 a 0 75m", "R1 a 0 100", ".tran 10u 100m"), reltol=1e-6
    )
    assert max(r["i(l1)"]) == pytest.approx(10 / (2 * pi * 50 * 75e-3), rel=1e-4)
    assert min(r["i(l1)"]) == pytest.approx(-10 / (2 * pi * 50 * 75e-3), rel=1e-4)


def test_a_tank_that_starts_with_a_volt_rings() -> None:
    lines = ("L1 a 0 1m", "C1 a 0 1u", "R1 a 0 1k", ".ic v(a)=1", ".tran 1u 2m")
    r = emsim.run(deck(*lines), reltol=1e-6)
    w, d = sqrt(1e9 - 500.0**2), 500.0

    def exact(t: float) -> float:
        # v' (0) = -v/(R C), no current in the coil
        a = (d - 1000.0) / w
        from math import sin

        return exp(-d * t) * (cos(w * t) + a * sin(w * t))

    assert r["i(l1)"][0] == 0.0
    for t in (0.1e-3, 0.7e-3, 1.9e-3):
        assert r.at("v(a)", t) == pytest.approx(exact(t), abs=1e-3)
    found = remarks(*lines)
    assert [d.code for d in found] == ["W301"]
    assert ".ic v(a)" in found[0].message


def test_ic_of_a_node_that_a_coil_shorts() -> None:
    lines = ("vb b 0 5", "rs b n 100", "l1 n 0 500m", "c1 n 0 10u", ".ic v(n)=0", ".tran 10u 50m")
    r = emsim.run(deck(*lines))
    assert r["i(l1)"][0] == 0.0
    assert r.at("v(n)", 1e-3) == pytest.approx(3.06, rel=2e-3)  # ngspice 39
    assert r.at("i(l1)", 50e-3) == pytest.approx(50e-3, rel=1e-3)
    assert remarks(*lines) == []


def test_the_current_of_ic_on_the_line_is_where_it_starts() -> None:
    r = emsim.run(deck("V1 a 0 5", "L1 a 0 1 ic=2", ".tran 1m 10m"))
    assert r["i(l1)"][0] == pytest.approx(2.0)
    assert r.at("i(l1)", 10e-3) == pytest.approx(2.05, rel=1e-4)


def test_a_transformer_across_a_cosine() -> None:
    lines = (
        "V1 a 0 SIN(0 10 50 0 0 90)", "L1 a 0 75m", "L2 b 0 75m", "K1 L1 L2 0.5", "R2 b 0 1meg", ".tran 10u 40m",
    )  # fmt: skip
    r = emsim.run(deck(*lines), reltol=1e-5)
    assert r["i(l1)"][0] == 0.0
    assert max(r["i(l1)"]) == pytest.approx(10 / (2 * pi * 50 * 75e-3), rel=1e-3)
    assert r.at("v(b)", 20e-3) == pytest.approx(5.0, rel=1e-3)


def test_coils_in_series_across_a_source_share_its_voltage() -> None:
    r = emsim.run(deck("V1 a 0 6", "L1 a b 1m", "L2 b 0 2m", ".tran 1u 1m"))
    for name in ("i(l1)", "i(l2)"):
        assert r[name][0] == 0.0
        assert r.at(name, 1e-3) == pytest.approx(2.0, rel=1e-4)


def test_an_operating_point_alone_still_says_that_there_is_none() -> None:
    assert [d.code for d in remarks("V1 a 0 SIN(0 1 50 0 0 90)", "L1 a 0 1m", ".op")] == ["W301"]
