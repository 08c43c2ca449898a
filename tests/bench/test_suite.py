"""The benchmark set: a small part of it end to end, its files, redrawing, the README, bad input."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise

import peers
import pytest
from suite import main
from suite_table import SECTIONS, marks
from support import NETLISTS

SHORT = ["--tolerances", "1e-3,1e-6", "--rounds", "1", "--methods", "trap,radau", "--alone", "-q"]


@pytest.fixture
def tree(scratch):
    """A source tree with what the suite needs, and a README with the marks."""
    sections = "".join(f"{start}\n{end}\n" for start, end in map(marks, SECTIONS))
    shutil.copytree(NETLISTS, scratch / "netlists", ignore=shutil.ignore_patterns("*.png"))
    (scratch / "README.md").write_text(f"# head\n{sections}tail\n")
    return scratch


def test_two_entries_end_to_end(capsys, tree):
    (tree / "work").mkdir()
    asked = [*SHORT, "--only", "lc_tank,double pendulum", "--readme", "-o", "out"]
    assert main([*asked]) == 0
    said = capsys.readouterr()
    assert "| [LC tank](netlists/bench/lc_tank.cir) | radau" in said.out
    made = {path.name for path in (tree / "out").iterdir()}
    assert made == {"suite.json", "suite.csv", "circuits.png", "machines.png", "summary.png"}
    charts = json.loads((tree / "out" / "suite.json").read_text())
    assert [c["name"] for c in charts] == ["LC tank", "double pendulum"]
    readme = (tree / "README.md").read_text()
    assert (
        readme.startswith("# head\n")
        and readme.endswith("\ntail\n")
        and "](netlists/bench/suite.png)" in readme
    )
    assert (tree / "netlists" / "bench" / "suite.png").stat().st_size < 150_000
    # drawn again from the file, nothing is run
    assert main(["--from", "out/suite.json", "-o", "again", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["charts"] == charts
    assert "again/summary.png" in document["files"]


def test_a_deck_without_a_reference_does_not_stop_the_others(capsys, tree, monkeypatch):
    from emsim.diagnostics import ConvergenceError, Diagnostic
    from emsim.reports import reference

    find = reference.find

    def some(problem, *args, **more):
        if not problem.plain:
            raise ConvergenceError([Diagnostic("error", "E421", "no converged reference: chaos")])
        return find(problem, *args, **more)

    monkeypatch.setattr(reference, "find", some)
    assert main([*SHORT, "--only", "lc_tank,double pendulum", "-o", "out"]) == 3
    said = capsys.readouterr()
    assert "double pendulum: no converged reference" in said.err and "[LC tank]" in said.out


@pytest.mark.parametrize(
    ("args", "code", "word"),
    [
        (["deck.cir"], 2, "takes no deck"),
        (["--signals", "v(a)"], 2, "unknown option"),
        (["--only", "lc_tnk"], 2, "did you mean 'lc_tank'"),
        (["--from", "missing.json"], 5, "missing.json"),
        (["--from", "README.md"], 2, "no suite.json"),
    ],
)
def test_bad_input(capsys, tree, args, code, word):
    assert main(args) == code
    assert word in capsys.readouterr().err


def test_a_readme_without_marks_is_told(capsys, tree):
    (tree / "README.md").write_text("# head\n")
    (tree / "suite.json").write_text("[]")
    assert main(["--from", "suite.json", "--readme", "-q"]) == 2
    assert "README.md: it has no" in capsys.readouterr().err


def test_engines_answer_or_say_why(tree):
    """MuJoCo's pendulum meets the reference; a machine that it does not know is a note, not a crash."""
    pytest.importorskip("mujoco")
    from emsim import pipeline
    from emsim.reports.ladder import Judge, Problem

    deck = NETLISTS / "mechanical" / "ref_simple_pendulum.cir"
    problem = Problem(lambda options: pipeline.prepare(pipeline.read(deck), options), times=20)
    table, _, _ = problem.run("radau", 1e-11)
    judge = Judge(problem, problem.values(table))
    series, notes = peers.measure(problem, judge, "ref_simple_pendulum", ["mujoco"], limit=0.05, rounds=1)
    assert not notes and {s.name for s in series} == {"MuJoCo RK4", "MuJoCo implicitfast"}
    rk4 = next(s for s in series if s.name == "MuJoCo RK4").good
    # order 4: ten times the steps, 1e4 times the accuracy
    assert rk4[3].error / rk4[5].error > 100 and rk4[-1].error < 1e-7
    assert all(a.evaluations < b.evaluations for a, b in pairwise(rk4))
    series, notes = peers.measure(problem, judge, "nobody", ["mujoco"])
    assert not series and "MuJoCo did not get through" in notes[0]


def test_an_engine_that_is_not_installed_is_a_note(monkeypatch):

    monkeypatch.setattr(peers, "find_spec", lambda name: None)
    series, notes = peers.measure(None, None, "ref_four_bar", ["drake"])
    assert not series and notes == ["no Drake: pip install 'emsim[peers]'"]
