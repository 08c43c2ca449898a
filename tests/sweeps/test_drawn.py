"""What a sweep drew is in its result: columns, names of corners, what moves a measure, and decks that repeat a run."""

from __future__ import annotations

import csv

import numpy as np
import pytest

import emsim
from emsim.cli import main
from emsim.diagnostics import DeckError

# vout = 10 gain/(1 + r1/r2): r1 in words, r2 by its tolerance, a part in a subcircuit that draws nothing from it
DECK = """a divider and an amplifier of parts that are off
.param gain={unif(2,0.1)}
V1 in 0 10
R1 in out {agauss(1k,50,3)}
R2 out 0 1k tol=5%
E1 o2 0 out 0 {gain}
X1 o2 load
.subckt load a
R1 a 0 {unif(1k,
+ 0.2)}
.ends
.model dd D(is={unif(1f,0.5)})
D1 0 o2 dd
.op
.meas op vout FIND v(o2)
.end
"""
# y = a + b c of even values of deviation 1 about 0: a has 3/4 of the variance by itself, b and c only together
PRODUCT = """a sum and a product
.param a={aunif(0,1)} b={aunif(0,1)} c={aunif(0,1)}
V1 x 0 {a + b*c}
R1 x 0 1
.op
.meas op y FIND v(x)
.end
"""


def vout(gain, r1, scale):
    return 10.0 * gain / (1.0 + r1 / (1e3 * scale))


@pytest.mark.parametrize("scheme", ["mc", "lhs", "sobol"])
def test_every_run_says_what_it_drew(scheme):
    s = emsim.sweep(DECK, scheme=scheme, runs=16, seed=3)
    assert s.random == ["gain", "r1", "r2(scale)", "r1:2", "dd(is)"]
    drawn = [s.drawn(name) for name in s.random]
    np.testing.assert_allclose(s.measure("vout"), vout(*drawn[:3]), rtol=1e-9)
    assert all(len(set(values)) == 16 for values in drawn)
    with pytest.raises(KeyError, match="no random value 'r9'"):
        s.drawn("r9")


def test_failed_runs_say_it_too():
    deck = ".param x={unif(1,0.9)}\nV1 a 0 1\nR1 a 0 {x < 1 ? 1k : 1/0}\n.op\n.meas op v FIND v(a)\n.end\n"
    s = emsim.sweep("t\n" + deck, scheme="mc", runs=20)
    assert 0 < len(s.failed) < 20
    assert {k for k, x in enumerate(s.drawn("x")) if x >= 1.0} == set(s.failed)


@pytest.mark.parametrize("ending", ["csv", "parquet", "nc"])
def test_files_have_columns_for_them(scratch, ending):
    s = emsim.sweep(DECK, {"v1": [5.0, 10.0]}, scheme="corners")
    path = str(scratch / f"s.{ending}")
    s.save(path)
    if ending == "nc":
        import xarray

        with xarray.open_dataset(path, engine="h5netcdf") as data:
            assert data["drawn:gain"].dims == data["vout"].dims == ("v1", "run")
            np.testing.assert_array_equal(data["drawn:gain"].values, s.drawn("gain"))
        return
    if ending == "csv":
        with open(path, encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
    else:
        import pandas

        rows = pandas.read_parquet(path).reset_index().to_dict("records")
    assert list(rows[0]) == ["run", "v1", "which", *s.random, "vout", "error"]
    assert rows[33]["which"] == "gain- r1- r2(scale)- r1:2- dd(is)+" and float(rows[33]["v1"]) == 10.0
    for row in rows:
        at = [float(row[name]) for name in ("gain", "r1", "r2(scale)")]
        assert float(row["vout"]) == pytest.approx(float(row["v1"]) / 10.0 * vout(*at), rel=1e-9)


def test_runs_one_at_a_time_and_random_ones_have_a_name_or_a_seed(scratch):
    one = [row["which"] for row in emsim.sweep(PRODUCT, scheme="sensitivity").rows()]
    assert one == ["nominal", "a-", "a+", "b-", "b+", "c-", "c+"]
    rows = list(emsim.sweep(PRODUCT, scheme="mc", runs=2, seed=7).rows())
    assert [row["seed"] for row in rows] == [7, 7] and "which" not in rows[0]


def test_what_a_measure_and_a_random_value_are_both_called(scratch):
    deck = "t\n.param a={unif(1,0.1)}\nV1 x 0 {a}\nR1 x 0 1\n.op\n.meas op a FIND v(x)\n.end\n"
    rows = list(emsim.sweep(deck, scheme="mc", runs=3).rows())
    assert [row["drawn:a"] for row in rows] == [pytest.approx(row["a"]) for row in rows]


def test_an_interrupted_sweep_keeps_what_was_drawn(scratch):
    journal = str(scratch / "j")
    emsim.sweep(DECK, scheme="mc", runs=10, journal=journal, progress=lambda done, _: done >= 1)
    again = emsim.sweep(DECK, scheme="mc", runs=10, journal=journal)
    assert again.resumed >= 1
    whole = emsim.sweep(DECK, scheme="mc", runs=10)
    assert list(again.rows()) == list(whole.rows())


def test_shares_of_the_variance_along_lines():
    """Var(gain) 5^2 = (2 0.1)^2/3 5^2, of r1 by its slope at the centre; the rest of the divider is nearly a line."""
    s = emsim.sweep(DECK, scheme="sobol", runs=512)
    found, explained = s.contributions("vout")
    shares = dict(found)
    each = {
        "gain": (5.0 * 0.2) ** 2 / 3.0,
        "r2(scale)": (5.0 * 0.05) ** 2 / 3.0,
        "r1": (5.0 * 0.05 / 3.0) ** 2,
    }
    total = sum(each.values())
    assert [name for name, _ in found[:3]] == list(each)
    for name, variance in each.items():
        assert shares[name] == pytest.approx(variance / total, abs=0.01)
    assert shares["dd(is)"] < 1e-3 and 0.99 < explained <= 1.0


def test_lines_do_not_explain_a_product_and_indices_do():
    s = emsim.sweep(PRODUCT, scheme="indices", runs=1024)
    assert s.size == 5 * 1024
    rows = {name: (first, total) for name, first, total in s.indices("y")}
    # Var a = 1/3, Var bc = 1/9
    assert rows["a"] == pytest.approx((0.75, 0.75), abs=0.02)
    assert rows["b"] == pytest.approx((0.0, 0.25), abs=0.02) and rows["c"] == pytest.approx(
        (0.0, 0.25), abs=0.02
    )
    found, explained = s.contributions("y")
    assert found[0][0] == "a" and explained == pytest.approx(0.75, abs=0.03)


def test_sweeps_that_cannot_tell_say_so():
    s = emsim.sweep(PRODUCT, scheme="mc", runs=4)
    with pytest.raises(ValueError, match="4 runs are too few to tell 3"):
        s.contributions("y")
    with pytest.raises(ValueError, match="scheme indices"):
        s.indices("y")
    with pytest.raises(ValueError, match="random sweep without other axes"):
        emsim.sweep(PRODUCT, scheme="corners").contributions("y")
    with pytest.raises(DeckError) as caught:
        emsim.sweep(PRODUCT, scheme="indices", runs=12)
    assert [d.code for d in caught.value.diagnostics] == ["E348"] and "powers of 2" in str(caught.value)


@pytest.mark.parametrize("scheme", ["mc", "corners", "sensitivity"])
def test_a_deck_repeats_the_worst_run_to_the_bit(scheme):
    s = emsim.sweep(DECK, scheme=scheme, runs=20)
    least, greatest = (emsim.run(s.repeat(point)).measures["vout"] for point in s.extremes("vout"))
    if scheme == "sensitivity":
        assert (least, greatest) == s.worst("vout")
    else:
        assert least == s.measure("vout").min() and greatest == s.measure("vout").max()


def test_it_repeats_what_was_varied_by_hand_too():
    s = emsim.sweep(DECK, {"v1": [5.0, 12.0], "temp": 60.0, "gain": [2.0, 3.0]}, scheme="mc", runs=3)
    text = s.repeat(s.extremes("vout")[1])
    assert (
        ".step v1 list 12.0" in text
        and ".step temp list 60.0" in text
        and ".step param gain list 3.0" in text
    )
    assert emsim.run(text).measures["vout"] == s.measure("vout").max()


@pytest.mark.parametrize(
    ("added", "said"),
    [
        ("X2 o2 load\n", "drew several values, and stands once"),
        (".include other.lib\n", "stands in another file"),
    ],
)
def test_a_run_that_the_text_cannot_repeat(scratch, added, said):
    (scratch / "other.lib").write_text("R9 o2 0 {unif(1k,0.1)}\n")
    (scratch / "deck.cir").write_text(DECK.replace(".op\n", added + ".op\n"))
    s = emsim.sweep(str(scratch / "deck.cir"), scheme="mc", runs=3)
    with pytest.raises(DeckError) as caught:
        s.repeat(s.points[0])
    assert [d.code for d in caught.value.diagnostics] == ["E348"] and said in str(caught.value)


@pytest.mark.parametrize(
    ("given", "value"), [({"r1": "2k"}, 10.0 / 3.0), ({"temp": "77"}, 5.0), ({"v1": 20.0}, 10.0)]
)
def test_one_value_of_an_element_or_of_temp_counts(given, value):
    """It was taken for a parameter that the deck does not have, with a warning."""
    deck = "t\nV1 a 0 10\nR1 a b 1k\nR2 b 0 1k tc1=0\n.op\n.meas op v FIND v(b)\n.end\n"
    s = emsim.sweep(deck, given)
    assert s.measure("v")[0] == pytest.approx(value, rel=1e-9) and not s.warnings


def test_a_random_value_of_a_random_value(scratch):
    deck = DECK.replace("agauss(1k,50,3)", "agauss(unif(1k,0.1), 50 + 10, 3)*1")
    s = emsim.sweep(deck, scheme="mc", runs=10)
    assert s.random[1:3] == ["r1", "r1:2"]
    assert emsim.run(s.repeat(s.extremes("vout")[1])).measures["vout"] == s.measure("vout").max()


@pytest.mark.parametrize("own", ["", ".options seed=5 reltol=1e-2 method=gear\n"])
def test_a_repeated_run_has_its_noise_and_its_options(own):
    deck = DECK.replace(".op\n.meas op vout FIND v(o2)", own + "V2 n 0 TRNOISE(1 1u)\nR3 n m {unif(1k,0.2)}\nC3 m 0 1n\n"
                        ".tran 1u 200u\n.meas tran vout MAX v(m)")  # fmt: skip
    s = emsim.sweep(deck, scheme="mc", runs=4, seed=3, options={"reltol": 1e-5, "method": "trap"})
    for point, value in zip(s.points, s.measure("vout"), strict=True):
        assert emsim.run(s.repeat(point)).measures["vout"] == value


def test_words_given_from_outside_are_no_part_of_a_deck(scratch):
    (scratch / "d.cir").write_text(DECK.replace("V1 in 0 10", "V1 in 0 {v}").replace(".param", ".param v=10"))
    s = emsim.sweep(str(scratch / "d.cir"), ["v={2*5}"], scheme="mc", runs=2)
    with pytest.raises(DeckError, match="given as words"):
        s.repeat(s.points[0])


@pytest.mark.parametrize("scheme", ["mc", "indices"])
def test_measures_that_tell_nothing_are_passed_over(scheme, scratch, capsys, monkeypatch):
    """One that is the same in every run, one that is found in hardly any."""
    monkeypatch.chdir(scratch)
    rare = ".meas op rare PARAM='vout > 11.2 ? vout : 1/0'\n.meas op same PARAM='1+1'\n.end"
    (scratch / "d.cir").write_text(DECK.replace(".end\n", rare + "\n").replace(".ends\n", ".ends\n", 1))
    assert main(["sweep", "d.cir", f"--{scheme}", "16", "--plot", "p.png", "--html", "p.html"]) == 0
    said = capsys.readouterr().out
    assert "what moves vout" in said and "what moves same" not in said and "what moves rare" not in said


def test_on_the_command_line(scratch, capsys, monkeypatch):
    monkeypatch.chdir(scratch)
    (scratch / "d.cir").write_text(DECK)
    assert (
        main(["sweep", "d.cir", "--mc", "60", "--worst", "vout", "--plot", "p.png", "--html", "p.html"]) == 0
    )
    said = capsys.readouterr().out
    assert "what moves vout, in shares of its variance" in said and " %  gain" in said
    s = emsim.sweep(DECK, scheme="mc", runs=60)
    for end, value in (("least", s.measure("vout").min()), ("greatest", s.measure("vout").max())):
        assert emsim.run(str(scratch / f"d.vout.{end}.cir")).measures["vout"] == value
    assert (
        "what moves vout" in (scratch / "p.html").read_text() and (scratch / "p.png").stat().st_size > 10_000
    )
    assert main(["sweep", "d.cir", "--indices", "8", "--worst", "nix"]) == 2
    assert "nix was found in no run; there is vout" in capsys.readouterr().err
