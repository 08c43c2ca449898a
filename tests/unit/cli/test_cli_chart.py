"""`emsim chart`: what it measures on a small deck, its files, its exit codes."""

from __future__ import annotations

import csv
import json
from itertools import pairwise

import pytest
from support import NETLISTS

from emsim.cli import main

PENDULUM = str(NETLISTS / "mechanical" / "ref_double_pendulum.cir")
TANK = """tank
C1 a 0 1u IC=1
L1 a 0 1m
.tran 10u 1m UIC
.end
"""
QUICK = ["--methods", "trap,radau", "--tolerances", "1e-3,1e-5,1e-7", "--rounds", "1", "-q"]


@pytest.fixture
def tank(scratch):
    (scratch / "tank.cir").write_text(TANK)
    return "tank.cir"


def test_a_machine(capsys, scratch):
    assert main(["chart", PENDULUM, *QUICK, "--json", "-o", "p.png", "--csv", "p.csv"]) == 0
    document = json.loads(capsys.readouterr().out)
    chart = document["chart"]
    assert chart["signals"] == ["angle(p1)", "omega(p1)", "angle(p2)", "omega(p2)"]
    assert "radau 1e-13" in chart["reference"] and chart["distance"] < 1e-8
    errors = {s["name"]: [p["error"] for p in s["points"]] for s in chart["series"] if s["group"] == "emsim"}
    # error falls with the tolerance; radau is good to ten tolerances, trap is not asked to be
    assert all(a > b for e in errors.values() for a, b in pairwise(e))
    assert errors["radau"][-1] < 1e-6 and errors["trap"][-1] > errors["radau"][-1]
    assert all(p["seconds"] > 0 and p["evaluations"] > 10 for s in chart["series"] for p in s["points"])
    assert document["files"] == ["p.png", "p.csv"]
    assert (scratch / "p.png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader((scratch / "p.csv").open()))
    assert {row["tool"] for row in rows} >= {"trap", "radau"} and len(rows) >= 6


def test_errors_against_the_closed_form(capsys, tank):
    """The charted error of a loose run is its distance from cos(t/sqrt(LC)), whose range is 2."""
    import numpy as np

    import emsim

    assert main(["chart", tank, *QUICK, "--signals", "v(a)", "--json"]) == 0
    chart = json.loads(capsys.readouterr().out)["chart"]
    trap = next(s for s in chart["series"] if s["name"] == "trap")
    run = emsim.run(TANK, method="trap", reltol=1e-3)
    true = np.abs(run["v(a)"] - np.cos(run.time / np.sqrt(1e-9))).max() / 2
    assert trap["points"][0]["error"] == pytest.approx(true, rel=0.2)


def test_a_run_over_its_limit_is_a_point_with_its_reason(capsys, scratch):
    # 20 million periods: no method gets through in 50 ms, the reference is asked for a thousandth of them
    text = TANK.replace(".tran 10u 1m", ".tran 1 4")
    (scratch / "long.cir").write_text(text)
    from emsim import pipeline
    from emsim.reports.ladder import Problem

    problem = Problem(lambda options: pipeline.prepare(pipeline.read("long.cir"), options))
    table, stats, reason = problem.run("radau", 1e-9, 0.05)
    assert table is None and reason == "over 0.05 s"
    assert 0.05 <= stats["solve_time"] < 1.0


def test_a_method_over_its_limit_is_not_tried_at_tighter_tolerances(capsys, scratch):
    (scratch / "tank.cir").write_text(TANK.replace(" 1m ", " 40m "))
    asked = ["--methods", "trap,radau", "--tolerances", "1e-3,1e-12,1e-13", "--limit", "0.1", "--rounds", "1"]
    assert main(["chart", "tank.cir", *asked, "--json", "-q"]) == 0
    chart = json.loads(capsys.readouterr().out)["chart"]
    trap = next(s for s in chart["series"] if s["name"] == "trap")
    assert [p["reason"] for p in trap["points"]] == ["", "over 0.1 s", "not tried: over 0.1 s at 1e-12"]


@pytest.mark.parametrize(
    ("args", "code", "word"),
    [
        (["--methods", "radu"], 2, "did you mean radau"),
        (["--tolerances", "2"], 2, "from 1e-14"),
        (["--tolerances", "1e-3,x"], 2, "'x'"),
        (["--times", "1.5"], 2, "whole number"),
        (["--signals", ","], 2, "names of columns"),
        (["--signals", "v(b)"], 1, "no column v(b)"),
        (["-o", "nowhere/p.png"], 5, "no folder nowhere"),
        (["--rounds"], 2, "needs a value"),
    ],
)
def test_bad_input(capsys, tank, args, code, word):
    assert main(["chart", tank, *QUICK, *args]) == code
    assert word in capsys.readouterr().err


def test_an_unknown_format_is_a_usage_error(capsys, tank):
    assert main(["chart", tank, *QUICK, "-o", "p.xyz"]) == 2
    assert "p.xyz" in capsys.readouterr().err


def test_decks_that_cannot_be_charted(capsys, scratch):
    (scratch / "op.cir").write_text("op\nV1 a 0 1\nR1 a 0 1\n.op\n.end\n")
    assert main(["chart", "op.cir", *QUICK]) == 1
    assert "no transient analysis" in capsys.readouterr().err
    # a stiff escape: no method gets through, so there is no reference
    (scratch / "escape.cir").write_text(
        "x' = x^2\nC1 a 0 1 IC=1\nB1 a 0 I={-v(a)*v(a)}\n.tran 0.01 2 UIC\n.end\n"
    )
    assert main(["chart", "escape.cir", *QUICK]) == 3
    assert "no reference" in capsys.readouterr().err
    assert main(["chart"]) == 2
    assert main(["chart", "missing.cir"]) == 5


def test_help_lists_its_options(capsys):
    assert main(["help", "chart"]) == 0
    out = capsys.readouterr().out
    assert "--tolerances" in out and "CPU time" in out
