"""Random values are drawn, once each, from a seed: what agauss, unif and the like mean to a run of ngspice or LTspice."""

from __future__ import annotations

import math

import numpy as np
import pytest

import emsim

MANY = 4000


def deck(call: str, count: int = MANY, more: str = "") -> str:
    """A divider each; i(V) reads the conductances, v the value of a behavioural source."""
    lines = [f"V{k} a{k} 0 {{{call}}}\nR{k} a{k} 0 1" for k in range(count)]
    return "\n".join(["random values", *lines, more, ".op", ".end"])


def values(text: str, **more: object) -> np.ndarray:
    r = emsim.run(text, **more)  # type: ignore[arg-type]
    return np.array([float(r[name][0]) for name in r.names if name.startswith("v(a")])


@pytest.mark.parametrize(
    ("call", "mean", "deviation", "extremes"),
    [
        ("agauss(5,0.6,3)", 5.0, 0.2, None),
        ("gauss(5,0.12,3)", 5.0, 0.2, None),
        ("gauss(0.2)", 0.0, 0.2, None),
        ("aunif(5,0.3)", 5.0, 0.3 / math.sqrt(3.0), (4.7, 5.3)),
        ("unif(5,0.1)", 5.0, 0.5 / math.sqrt(3.0), (4.5, 5.5)),
        ("mc(5,0.1)", 5.0, 0.5 / math.sqrt(3.0), (4.5, 5.5)),
        ("flat(0.5)", 0.0, 0.5 / math.sqrt(3.0), (-0.5, 0.5)),
        ("limit(5,0.5)", 5.0, 0.5, (4.5, 5.5)),
    ],
)
def test_mean_and_deviation(call, mean, deviation, extremes):
    found = values(deck(call))
    assert len(found) == MANY
    assert abs(found.mean() - mean) < 4.0 * deviation / math.sqrt(MANY)
    assert found.std() == pytest.approx(deviation, rel=0.05)
    if extremes:
        assert extremes[0] <= found.min() and found.max() <= extremes[1]
        assert found.max() - found.min() > 0.99 * (extremes[1] - extremes[0])


def test_the_seed_decides():
    text = deck("agauss(1k,100,3)", 3)
    once = values(text)
    assert len(set(once)) == 3
    assert np.array_equal(once, values(text))
    other = values(text, options={"seed": 2})
    assert not np.any(other == once)
    assert np.array_equal(other, values(text.replace(".op", ".options seed=2\n.op")))
    assert np.array_equal(other, values(text.replace(".op", ".options seed=7\n.op"), options={"seed": 2}))


def test_a_parameter_is_drawn_once_and_each_subcircuit_draws_its_own():
    r = emsim.run(
        "t\n.param r={agauss(1k,100,1)}\nV1 a 0 {r}\nV2 b 0 {r}\n.subckt s p\n.param q={aunif(1,1)}\nV1 p 0 {q}\nR1 p 0 1k\n"
        ".ends\nX1 c s\nX2 d s\nR1 a 0 1\nR2 b 0 1\n.op\n.end\n"
    )
    assert float(r["v(a)"][0]) == float(r["v(b)"][0]) != 1000.0
    assert float(r["v(c)"][0]) != float(r["v(d)"][0])


def test_it_is_told(capsys, tmp_path, monkeypatch):
    from emsim.cli import main

    monkeypatch.chdir(tmp_path)
    (tmp_path / "d.cir").write_text(deck("mc(1,0.1)", 2) + "\n")
    assert main(["d.cir", "--no-files", "--seed", "5"]) == 0
    said = capsys.readouterr().err
    assert "note[N285]: 2 random values were drawn, with seed 5" in said
    assert main(["d.cir", "--no-files", "--seed", "5.5"]) == 1
    assert "E293" in capsys.readouterr().err


def test_nothing_is_told_where_nothing_is_drawn():
    r = emsim.run("t\nV1 a 0 1\nR1 a 0 {limit(5,1,3)}\n.op\n.end\n")
    assert not [d for d in r.diagnostics if d.code == "N285"]
    assert float(r["i(v1)"][0]) == pytest.approx(-1 / 3)


@pytest.mark.parametrize(
    ("call", "code"), [("agauss(1,2)", "E123"), ("agauss(1,2,0)", "E124"), ("mc(1)", "E123")]
)
def test_what_cannot_be_drawn(call, code):
    with pytest.raises(emsim.DeckError) as caught:
        emsim.run(f"t\nR1 a 0 {{{call}}}\n.op\n.end\n")
    assert code in [d.code for d in caught.value.diagnostics]
