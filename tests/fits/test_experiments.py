"""`emsim.fit` of several experiments, with weights of single values, and with what is known before."""

from __future__ import annotations

import json

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.diagnostics import DeckError

# v(out) = vin (1 - exp(-t/(r c))): one curve knows r c, and the current at t = 0 knows r
CHARGING = """charging
.param r=1k vin=1
V1 in 0 {vin}
R1 in out {r}
C1 out 0 1u IC=0
.tran 50u 5m uic
.end
"""
TIMES = np.linspace(0.0, 5e-3, 51)


def charged(r: float, vin: float = 1.0) -> np.ndarray:
    return vin * (1.0 - np.exp(-TIMES / (r * 1e-6)))


def test_experiments_under_conditions_of_their_own():
    data = [({"time": TIMES, "v(out)": charged(2200.0, vin)}, {"vin": vin}) for vin in (1.0, 5.0, 12.0)]
    found = emsim.fit(CHARGING, data, ["r"])
    assert found.values["r"] == pytest.approx(2200.0, rel=1e-5)
    assert len(found.experiments) == 3 and found.left["v(out)"] < 1e-4
    # under wrong conditions no value fits
    wrong = emsim.fit(CHARGING, [(table, {"vin": 1.0}) for table, _ in data], ["r"])
    assert wrong.left["v(out)"] > 1.0


def test_what_one_experiment_does_not_tell_two_do():
    deck = CHARGING.replace("C1 out 0 1u", "C1 out 0 {c}").replace("vin=1", "vin=1 c=1u")
    one = {"time": TIMES, "v(out)": 1.0 - np.exp(-TIMES / 2.2e-3)}
    two = {"time": TIMES, "i(v1)": -np.exp(-TIMES / 2.2e-3) / 2200.0}
    alone, both = emsim.fit(deck, one, ["r", "c"]), emsim.fit(deck, [one, two], ["r", "c"])
    assert alone.mixtures and not both.mixtures
    assert both.values["r"] == pytest.approx(2200.0, rel=1e-4)
    assert both.values["c"] == pytest.approx(1e-6, rel=1e-4)


def test_values_weigh_by_the_deviations_that_are_stated():
    """The mean of two values of one constant, weighed by 1/sigma^2 (here 0.9 and 0.1), and its deviation."""
    deck = "a constant\n.param v=1\nV1 a 0 {v}\nR1 a 0 1\n.tran 1m 2m\n.end\n"
    data = {"time": [0.5e-3, 1e-3], "v(a)": [1.0, 2.0], "sigma(v(a))": [0.1, 0.3]}
    found = emsim.fit(deck, data, ["v"])
    # (the search holds every place a little, to (0.1/J)^2 of its way, J = 11 here: fits/fitted.py, PRIOR)
    assert found.values["v"] == pytest.approx(0.9 * 1.0 + 0.1 * 2.0, rel=2e-5)
    # one degree of freedom is left: Student's 12.706; (below, the interval ends at 0)
    assert found.intervals["v"][1] - found.values["v"] == pytest.approx(
        12.7062 / np.sqrt(1.0 / 0.1**2 + 1.0 / 0.3**2), rel=1e-3
    )


def test_a_prior_is_one_measurement_more():
    """Of a constant measured once as 2 with deviation 0.3 and known before as 1 with 0.1: the same mean."""
    deck = "a constant\n.param v=1\nV1 a 0 {v}\nR1 a 0 1\n.tran 1m 2m\n.end\n"
    data = {"time": [1e-3], "v(a)": [2.0]}
    for prior in ((1.0, 0.1), "1+-0.1", "1 +- 10%"):
        found = emsim.fit(deck, data, ["v"], sigma=0.3, priors={"V": prior})
        assert found.values["v"] == pytest.approx(1.1, rel=2e-5)
    free = emsim.fit(deck, data, ["v"], sigma=0.3)
    assert free.values["v"] == pytest.approx(2.0, rel=1e-3)


def test_a_prior_tells_what_the_data_do_not():
    deck = CHARGING.replace("C1 out 0 1u", "C1 out 0 {c}").replace("vin=1", "vin=1 c=1u")
    data = {"time": TIMES, "v(out)": charged(2200.0)}
    found = emsim.fit(deck, data, ["r", "c"], sigma=1e-3, priors={"c": (1.1e-6, 1e-8)})
    assert not found.mixtures
    assert found.values["c"] == pytest.approx(1.1e-6, rel=1e-3)
    assert found.values["r"] * found.values["c"] == pytest.approx(2.2e-3, rel=1e-4)


@pytest.mark.parametrize(
    ("data", "more", "said"),
    [
        ([], {}, "there are no data"),
        ({"time": [0, 1e-3], "v(out)": [0, 1], "sigma(v(out))": [0.1, 0]}, {}, "above zero wherever"),
        ({"time": [0, 1e-3], "v(out)": [0, 1], "sigma(v(b))": [0.1, 1]}, {}, "no column `v\\(b\\)`"),
        ([({"time": [1e-3], "v(out)": [1]}, {"r": 5})], {}, "`r` is to be found, and is a condition"),
        ([({"time": [1e-3], "v(out)": [1]}, {"vin": float("nan")})], {}, "a condition is a number"),
        ({"time": [1e-3], "v(out)": [1]}, {"priors": {"q": (1, 1)}}, "`q` has a prior"),
        ({"time": [1e-3], "v(out)": [1]}, {"priors": {"r": (1, 0)}}, "standard deviation above zero"),
        ({"time": [1e-3], "v(out)": [1]}, {"priors": {"r": "1k"}}, "write a prior as"),
        ([{"time": [1e-3], "v(out)": [1]}], {"columns": {"speed": "v(in)"}}, "no data have a column `speed`"),
    ],
)
def test_what_is_wrong_is_said(data, more, said):
    with pytest.raises(ValueError, match=said):
        emsim.fit(CHARGING, data, ["r"], **more)


def test_a_condition_that_nothing_has_is_refused():
    with pytest.raises(DeckError) as told:
        emsim.fit(CHARGING, [({"time": [1e-3], "v(out)": [1]}, {"vinn": 5})], ["r"])
    assert told.value.diagnostics[0].code == "E346"


def test_the_verb(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deck.cir").write_text(CHARGING)
    for vin in (1, 5):
        rows = zip(TIMES, charged(2200.0, vin), strict=True)
        text = "time,v(out),sigma(v(out))\n" + "".join(f"{t},{v},0.001\n" for t, v in rows)
        (tmp_path / f"at{vin}.csv").write_text(text)
    words = [
        "fit",
        "deck.cir",
        "at1.csv",
        "at5.csv:vin=5,temp=27",
        "-p",
        "r",
        "--prior",
        "r=2.2k+-10%",
        "-o",
        "out.csv",
    ]
    assert main([*words, "--plot", "out.png", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["values"]["r"] == pytest.approx(2200.0, rel=1e-4)
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == "experiment,time,v(out),fit:v(out),left:v(out)" and len(lines) == 1 + 2 * len(TIMES)
    assert lines[-1].startswith("2,0.005,") and (tmp_path / "out.png").stat().st_size > 1000
    assert main(["fit", "deck.cir", "at1.csv", "at5.csv:vin=5", "-p", "r"]) == 0
    assert "102 times of 1 signal in 2 experiments" in capsys.readouterr().out
