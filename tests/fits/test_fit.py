"""`emsim.fit`: values and their certainty from measured curves."""

from __future__ import annotations

import json

import numpy as np
import pytest

import emsim
from emsim.cli import main

MOTOR = """a motor starts
.param r=1 l=0.5m k=0.05 j=1e-5 b=2e-5 tc=2m
V1    a 0 12
BODY  rotor m=1 j={j}
JOINT shaft 0 rotor pin damp={b}
MOTOR m1 a 0 shaft kt={k} r={r} l={l} tc={tc}
.tran 0.1m 0.15 UIC
.print tran omega(shaft) i(m1)
.end
"""
CONSTANTS = {"r": 1.3, "l": 0.8e-3, "k": 0.043, "j": 1.6e-5, "b": 6e-5, "tc": 6e-3}

NO_LOAD = """a motor without load
.param r=1 k=0.05 j=1e-5
V1    a 0 12
BODY  rotor m=1 j={j}
JOINT shaft 0 rotor pin
MOTOR m1 a 0 shaft kt={k} r={r}
.tran 0.1m 0.1 UIC
.print tran omega(shaft)
.end
"""

CHARGING = """charging
.param r=1k
V1 in 0 1
R1 in out {r}
C1 out 0 1u IC=0
.tran 50u 5m uic
.print tran v(out)
.end
"""


def curve(
    deck: str, constants: dict[str, float], names: list[str], times: np.ndarray
) -> dict[str, np.ndarray]:
    table = emsim.run(deck, constants, reltol=1e-9).main
    return {"time": times, **{name: table.at(name, times) for name in names}}


def with_noise(data: dict[str, np.ndarray], sigmas: dict[str, float], seed: int) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    return {
        name: v + random.normal(0.0, sigmas[name], len(v)) if name in sigmas else v
        for name, v in data.items()
    }


def test_six_constants_of_a_motor_from_its_noisy_start():
    times = np.linspace(0.0, 0.15, 600)
    data = curve(MOTOR, CONSTANTS, ["omega(shaft)", "i(m1)"], times)
    noise = {"omega(shaft)": 0.2, "i(m1)": 0.02}
    found = emsim.fit(MOTOR, with_noise(data, noise, 7), list(CONSTANTS))
    assert found.converged and not found.mixtures and not found.at_bounds
    for name, true in CONSTANTS.items():
        low, high = found.intervals[name]
        assert low < true < high, name
        assert high - low < 1.2 * true, name
    for name, sigma in noise.items():
        assert found.left[name] == pytest.approx(sigma, rel=0.1)


def test_intervals_hold_the_true_value_as_often_as_they_say():
    times = np.linspace(0.0, 5e-3, 40)
    data = curve(CHARGING, {"r": 2.2e3}, ["v(out)"], times)
    held = 0
    for seed in range(60):
        low, high = emsim.fit(CHARGING, with_noise(data, {"v(out)": 0.02}, seed), "r").intervals["r"]
        held += low < 2.2e3 < high
    # binomial: 57 +- 1.7
    assert 51 <= held <= 60


def test_what_a_no_load_curve_cannot_tell_apart_is_named():
    times = np.linspace(0.0, 0.1, 300)
    data = curve(NO_LOAD, {"r": 1.3, "k": 0.043, "j": 1.6e-5}, ["omega(shaft)"], times)
    for noise in (0.5, 0.0):
        found = emsim.fit(NO_LOAD, with_noise(data, {"omega(shaft)": noise}, 3), ["r", "k", "j"])
        (mixture,) = found.mixtures
        assert set(mixture.changes) == {"r", "j"}
        assert mixture.changes["r"] == pytest.approx(-mixture.changes["j"], rel=1e-2)
        assert found.values["r"] * found.values["j"] == pytest.approx(1.3 * 1.6e-5, rel=1e-2)
        assert found.values["k"] == pytest.approx(0.043, rel=1e-3)
        assert np.isfinite(found.intervals["k"][1]) and found.intervals["r"][1] == np.inf


def test_without_noise_values_are_found_to_the_accuracy_of_the_runs():
    data = curve(CHARGING, {"r": 4.7e3}, ["v(out)"], np.linspace(0.0, 5e-3, 50))
    assert emsim.fit(CHARGING, data, "r").values["r"] == pytest.approx(4.7e3, rel=1e-5)


def test_gaps_in_the_data_and_columns_of_other_names():
    data = curve(CHARGING, {"r": 4.7e3}, ["v(out)"], np.linspace(0.0, 5e-3, 50))
    data["scope"] = np.where(np.arange(50) % 7 == 0, np.nan, data.pop("v(out)"))
    data["note"] = np.arange(50.0)
    found = emsim.fit(CHARGING, data, "r", columns={"scope": "v(out)", "note": ""})
    assert found.values["r"] == pytest.approx(4.7e3, rel=1e-5)


def test_a_value_at_its_bound_is_said_to_be_there():
    data = curve(CHARGING, {"r": 4.7e3}, ["v(out)"], np.linspace(0.0, 5e-3, 50))
    found = emsim.fit(CHARGING, data, "r=100..2k")
    assert found.values["r"] == pytest.approx(2e3) and found.at_bounds == ["r"]


def test_a_search_everywhere_finds_what_a_start_far_away_does_not_and_is_the_same_on_two_processes():
    deck = "ringing\n.param f=1k\nV1 a 0 SIN(0 1 {f})\nR1 a b 1k\nR2 b 0 1k\n.tran 10u 5m\n.end\n"
    data = curve(deck, {"f": 3217.0}, ["v(b)"], np.linspace(0.0, 5e-3, 100))
    one = emsim.fit(deck, data, "f=200..5k", everywhere=True)
    assert one.values["f"] == pytest.approx(3217.0, rel=1e-4)
    two = emsim.fit(deck, data, "f=200..5k", everywhere=True, jobs=2)
    assert two.values == one.values


@pytest.mark.parametrize(
    ("vary", "data", "said"),
    [
        ([], {"time": [0, 1e-3], "v(out)": [0, 1]}, "nothing is to be found"),
        (["r", "r"], {"time": [0, 1e-3], "v(out)": [0, 1]}, "twice"),
        (["r=2..1"], {"time": [0, 1e-3], "v(out)": [0, 1]}, "not below"),
        (["r"], {"t0": [0, 1e-3], "v(out)": [0, 1]}, "no column `time`"),
        (["r"], {"time": [0, 1e-3]}, "no column but the time"),
    ],
)
def test_what_cannot_be_fitted_is_said(vary, data, said):
    with pytest.raises(ValueError, match=said):
        emsim.fit(CHARGING, data, vary)


def test_data_beyond_the_run_are_refused():
    with pytest.raises(emsim.DeckError, match="data go from"):
        emsim.fit(CHARGING, {"time": [0.0, 1.0], "v(out)": [0.0, 1.0]}, "r")


def test_a_signal_that_the_deck_does_not_have_is_refused():
    with pytest.raises(emsim.DeckError):
        emsim.fit(CHARGING, {"time": [0.0, 1e-3], "v(q)": [0.0, 1.0]}, "r")


def test_the_verb(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rc.cir").write_text(CHARGING)
    data = curve(CHARGING, {"r": 2.2e3}, ["v(out)"], np.linspace(0.0, 5e-3, 20))
    rows = zip(data["time"].tolist(), data["v(out)"].tolist(), strict=True)
    (tmp_path / "d.csv").write_text("time,v(out)\n" + "".join(f"{t!r},{v!r}\n" for t, v in rows))
    assert main(["fit", "rc.cir", "d.csv", "-p", "r=100..10k:1k", "-o", "out.csv", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["values"]["r"] == pytest.approx(2.2e3, rel=1e-5)
    assert (tmp_path / "out.csv").read_text().startswith("time,v(out),fit:v(out),left:v(out)\n")
    assert main(["fit", "rc.cir", "d.csv", "-p", "r", "-p", "c1"]) == 0
    said = capsys.readouterr()
    assert "W431" in said.err and "`r` and `c1` apart" in said.err and "not known from these data" in said.out


def test_infinite_data_are_refused_by_their_row(tmp_path):
    from emsim.fits import data

    path = tmp_path / "d.csv"
    path.write_text("time,v(a)\n0,0\n1e-3,inf\n")
    with pytest.raises(ValueError, match="row 3: `inf` is no measurement"):
        data.read(path)
    with pytest.raises(ValueError, match="infinite"):
        data.read({"time": [0.0, 1.0], "v(a)": [0.0, float("inf")]})
