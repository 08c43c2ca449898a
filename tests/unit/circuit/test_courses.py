"""PWL from files, with factors, with parts that repeat; random waveforms by their statistics."""

from __future__ import annotations

import math

import numpy as np
import pytest
from circuit_decks import codes, deck

import emsim


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data.txt").write_text("* time value\n0 0\n1m, 1\n+1m 3\n")
    return tmp_path


def course(source: str, t: list[float], head: str = "", stop: str = "10m") -> np.ndarray:
    result = emsim.run(f"t\n{head}\nV1 a 0 {source}\nR1 a 0 1k\n.tran 0.1m {stop}\n.end\n")
    return np.interp(t, result["time"], result["v(a)"])


AT = [0.5e-3, 1.5e-3, 2.5e-3, 9e-3]
FROM_FILES = {
    "PWL file=data.txt": [0.5, 2.0, 3.0, 3.0],
    'PWL(file="data.txt")': [0.5, 2.0, 3.0, 3.0],
    "PWL file data.txt": [0.5, 2.0, 3.0, 3.0],
    "PWL time_scale_factor=0.5 value_scale_factor={k} file=data.txt": [2.0, 6.0, 6.0, 6.0],
    "PWL(0 1 1m 1 value_scale_factor=3)": [3.0, 3.0, 3.0, 3.0],
    "PWL repeat for 2 (0 0 1m {k} 2m 0) endrepeat": [1.0, 1.0, 1.0, 0.0],
    "PWL(0 0 1m 1 REPEAT FOREVER (1m 5 2m 0) ENDREPEAT)": [0.5, 3.0, 2.5, 0.0],
    "PWL REPEAT FOREVER FILE data.txt ENDREPEAT": [0.5, 2.0, 0.5, 1.0],
    "PWL repeat for 2 (repeat for 2 (1m 1) endrepeat 2m 4) endrepeat": [1.0, 1.0, 2.5, 4.0],
}


@pytest.mark.parametrize("source", FROM_FILES)
def test_points_from_files_and_repetitions(source, here):
    assert course(source, AT, ".param k=2") == pytest.approx(FROM_FILES[source], abs=1e-9)


def test_an_endless_part_is_the_same_as_many(here):
    t = np.linspace(0.05e-3, 9.95e-3, 67).tolist()
    some = "PWL(0 2 0.5m 1 repeat {} (0.3m 5 1m 0 1.5m 2) endrepeat)"
    assert course(some.format("forever"), t) == pytest.approx(course(some.format("for 9"), t), abs=1e-9)


@pytest.mark.parametrize(
    ("source", "code"),
    [
        ("PWL file=none.txt", "E292"), ("PWL repeat for 2 (0 0 1m 1)", "E114"), ("PWL repeat 2 (0 0) endrepeat", "E114"),
        ("PWL file=data.txt 3", "E114"), ("PWL repeat for 1.5 (0 0 1m 1) endrepeat", "E292"),
        ("PWL repeat forever (0 0 1m 1) endrepeat 5m 0", "E292"), ("PWL repeat forever (0 0) endrepeat", "E292"),
        ("PWL repeat for 1e9 (0 0 1m 1) endrepeat", "E292"),
    ],
)  # fmt: skip
def test_what_is_no_course(source, code, here):
    assert codes(f"V1 a 0 {source}", "R1 a 0 1k", ".tran 0.1m 10m") == [code]


def test_a_file_lies_beside_the_deck_that_names_it(here):
    inner = here / "inner"
    inner.mkdir()
    (inner / "own.txt").write_text("0 7\n1 7\n")
    (inner / "part.inc").write_text("V1 a 0 PWL file=own.txt\n")
    result = emsim.run(deck(".include inner/part.inc", "R1 a 0 1k", ".tran 1m 10m"))
    assert float(result["v(a)"][-1]) == pytest.approx(7.0)


# ---- noise ----

STEP, STOP = 1e-6, 50e-3
GRID = STEP * np.arange(50_000)


def sampled(source: str, **options) -> np.ndarray:
    text = deck(f"V1 a 0 {source}", "R1 a 0 1", f".tran {STEP} {STOP}")
    result = emsim.run(text, options=options)
    return np.interp(GRID, result["time"], result["v(a)"])


def density(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One-sided power density by the mean of 50 pieces."""
    pieces = x.reshape(50, -1) * np.hanning(len(x) // 50)
    power = np.mean(np.abs(np.fft.rfft(pieces)) ** 2, axis=0)
    return np.fft.rfftfreq(pieces.shape[1], STEP), 2 * STEP * power / np.sum(np.hanning(pieces.shape[1]) ** 2)


def test_white_noise_has_its_deviation_and_is_white():
    x = sampled("DC 2 TRNOISE(0.5 1u 0 0)")
    assert (
        x[0] == 2.0 and x.mean() == pytest.approx(2.0, abs=0.01) and x.std() == pytest.approx(0.5, rel=0.01)
    )
    assert abs(np.corrcoef(x[1:], x[:-1])[0, 1]) < 0.015
    assert np.mean((x - 2.0) ** 4) == pytest.approx(3 * 0.5**4, rel=0.05)  # normal


@pytest.mark.parametrize("alpha", [0.5, 1.0, 1.5])
def test_the_density_of_coloured_noise_is_its_closed_form(alpha):
    f, found = density(sampled(f"TRNOISE(0 1u {alpha} 0.1)"))
    for low, high in ((5e3, 2e4), (2e4, 1e5), (1e5, 4.5e5)):
        of = (f >= low) & (f < high)
        wanted = 2 * 0.1**2 * STEP * np.abs(1 - np.exp(-2j * np.pi * f[of] * STEP)) ** -alpha
        assert np.mean(found[of] / wanted) == pytest.approx(1.0, abs=0.06)


def test_a_telegraph_signal_has_its_two_values_for_its_times():
    x = sampled("TRNOISE(0 0 0 0 2 30u 10u)")
    assert set(np.unique(np.round(x[(x < 0.01) | (x > 1.99)]))) == {0.0, 2.0}
    assert x.mean() == pytest.approx(0.5, rel=0.1) and x.var() == pytest.approx(0.75, rel=0.1)
    lag = 10
    found = np.mean((x[lag:] - x.mean()) * (x[:-lag] - x.mean())) / x.var()
    assert found == pytest.approx(math.exp(-lag * STEP * (1 / 30e-6 + 1 / 10e-6)), abs=0.04)


def test_all_three_together_are_their_sum():
    x = sampled("TRNOISE(0.5 1u 1 0.1 2 30u 10u)")
    one = sampled("TRNOISE(0.5 1u 1 0.1)")
    assert x.var() - one.var() == pytest.approx(0.75, rel=0.15)


# mean and variance
DISTRIBUTIONS = {
    "TRRANDOM(1 10u 0 3 1)": (1.0, 3.0), "TRRANDOM(2 10u 0 0.5 2)": (2.0, 0.25), "TRRANDOM(3 10u 0 2 1)": (3.0, 4.0),
    "TRRANDOM(4 10u 0 3 1)": (4.0, 3.0),
}  # fmt: skip


@pytest.mark.parametrize("source", DISTRIBUTIONS)
def test_random_values_hold_for_their_time_and_have_their_distribution(source):
    mean, variance = DISTRIBUTIONS[source]
    x = sampled(source)[5::10]
    assert x.mean() == pytest.approx(mean, abs=0.05 * math.sqrt(variance) + 0.01)
    assert x.var() == pytest.approx(variance, rel=0.08)
    held = sampled(source)[1:].reshape(-1)[: 10 * (len(x) - 1)].reshape(-1, 10)[:, 1:8]
    assert np.abs(held - held[:, :1]).max() < 1e-9


def test_random_values_begin_after_their_delay():
    x = sampled("DC 1 TRRANDOM(1 10u 1m 3 5)")
    assert np.all(x[:1000] == 1.0) and np.all(x[1002:] >= 3.0 - 1e-9)


def test_noise_is_the_same_for_the_same_seed_and_its_own_for_each_source():
    text = "TRNOISE(0.5 1u 1 0.1 2 30u 10u)"
    assert np.array_equal(sampled(text), sampled(text))
    assert not np.array_equal(sampled(text), sampled(text, seed=7))
    two = emsim.run(deck("V1 a 0 TRNOISE(1 1u 0 0)", "V2 b 0 TRNOISE(1 1u 0 0)", "R1 a b 1", ".tran 1u 1m"))
    assert not np.allclose(two["v(a)"][5:], two["v(b)"][5:])


def test_no_other_analysis_sees_noise():
    table = emsim.run(
        deck("V1 a 0 DC 2 AC 1 TRNOISE(0.5 1n 0 0)", "R1 a 0 1", ".ac dec 1 1 10", ".op")
    ).table("op")
    assert float(table["v(a)"][0]) == 2.0


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("TRNOISE(1 0 0 0)", "time step"), ("TRNOISE(1 1p 0 0)", "are the most"), ("TRNOISE(0 1u 3 1)", "exponent of 1/f"),
        ("TRNOISE(0 0 0 0 1 0 1u)", "mean times"), ("TRRANDOM(5 1u 0 1)", "its type is 5"), ("TRRANDOM(1 0)", "time step"),
        ("TRRANDOM(4 1u 0 -1)", "its mean"), ("TRRANDOM(1)", "2 arguments"),
    ],
)  # fmt: skip
def test_noise_that_cannot_be(source, words):
    with pytest.raises(emsim.DeckError) as error:
        emsim.run(deck(f"V1 a 0 {source}", "R1 a 0 1", ".tran 1u 1"))
    assert any(d.code == "E292" and words in d.message for d in error.value.diagnostics)


def test_a_file_that_may_be_read_in_two_ways_is_refused(tmp_path):
    """A decimal comma made 1 V of 0.5 .. 1.5 V; a time without its value was left out."""
    deck = 't\nV1 a 0 PWL file="d.txt"\nR1 a 0 1k\n.tran 10u 1m\n.end\n'
    (tmp_path / "d.cir").write_text(deck)
    for text, said in (
        ("0,0 0,5\n0,001 1,5\n", "decimal comma"),
        ("0 0 1m\n", "no value"),
        ("0 0.5x3\n", "no number"),
    ):
        (tmp_path / "d.txt").write_text(text)
        with pytest.raises(emsim.DeckError, match=said):
            emsim.run(tmp_path / "d.cir")
    for text in ("0,0.5\n1m,1.5\n", "0 0.5 1m 1.5\n"):
        (tmp_path / "d.txt").write_text(text)
        assert emsim.run(tmp_path / "d.cir")["v(a)"][-1] == pytest.approx(1.5)
