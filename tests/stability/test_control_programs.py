"""Sections of .control made at random by their grammar (control_programs.py): a small part of what that script runs."""

from __future__ import annotations

import warnings

import pytest
from control_programs import Runner, programs, wrong

import emsim


@pytest.mark.parametrize("seed", range(3))
def test_no_program_ends_in_an_internal_error(seed, tmp_path, monkeypatch):
    inner = tmp_path / "inner"
    inner.mkdir()
    monkeypatch.chdir(inner)
    runner = Runner()
    for _, (name, commands) in zip(range(150), programs(1000 + seed), strict=False):
        assert wrong(runner, name, commands) == "", f"deck {name}\n{commands}"


# what random programs have found
@pytest.mark.parametrize(
    ("commands", "codes"),
    [
        ("tran 10u 1m\nspec 0 10k $500 v(out)", ["E161"]),
        ("tran 10u 1m\nspec 0 inf 1k v(out)", ["E161"]),
        ("tran 10u 1m\npsd inf v(out)", ["E161"]),
        ("tran 10u 1m\nfourier inf v(out)", ["E161"]),
        ("op\nlet a = poisson(asin(1e6))", []),
        ("op\ncompose b start=0 step=0.1", ["E161"]),
        ("op\ncompose b start=0 step=0.1 lin=3", []),
        ("ac dec 3 10 1k\nplot v(out) xlimit 0 100", []),
        ('op\nset width = "a "a b"', []),
        ("op\nset list = ( 1 2 )\necho $list[inf]", ["E161"]),
    ],
)
def test_a_word_that_does_not_fit_is_an_error_of_the_section(commands, codes, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    deck = "t\nV1 in 0 AC 1 SIN(0 1 1k)\nR1 in out 1k\nC1 out 0 1u\n.control\nlet inf = 1e308*10\n{}\n.endc\n.end\n"
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # that the user would see
        found = emsim.run(deck.format(commands))
    assert [d.code for d in found.diagnostics if d.severity == "error"] == codes
