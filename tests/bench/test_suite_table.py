"""The benchmark set: its decks are there and say what they compare; its table says what was measured and no more."""

from __future__ import annotations

import re

import pytest
import suite_table as suite
from peers import PROGRAMS
from suite_table import SUITE
from support import NETLISTS, ROOT

from emsim import pipeline
from emsim.reports.ladder import Problem
from emsim.reports.work_precision import Chart, Point, Series


def test_it_is_large_enough():
    sizes = {group: sum(e.group == group for e in SUITE) for group in suite.GROUPS}
    assert sizes["circuits"] >= 8 and sizes["machines"] >= 8 and sizes["coupled"] >= 6
    assert sum(sizes.values()) == len(SUITE)
    assert len({e.name for e in SUITE}) == len({e.deck for e in SUITE}) == len(SUITE)
    assert set(suite.QUICK) <= {e.name for e in SUITE}
    assert all(set(e.engines) <= set(PROGRAMS) for e in SUITE)


@pytest.mark.parametrize("entry", SUITE, ids=lambda e: e.name)
def test_every_deck_compiles_and_has_its_signals(entry):
    path = NETLISTS / f"{entry.deck}.cir"
    problem = Problem(
        lambda options: pipeline.prepare(pipeline.read(path), options), entry.signals or None, stop=entry.stop
    )
    assert problem.signals and problem.grid[-1] == problem.transient.tstop
    assert problem.plain == (entry.group in ("circuits", "transistors"))
    assert entry.why


def test_every_bench_deck_is_in_it():
    here = {f"bench/{path.stem}" for path in (NETLISTS / "bench").glob("*.cir")}
    assert here <= {e.deck for e in SUITE}


def test_the_readme_shows_its_rows():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    inner = ""
    for section, (_, picture) in suite.SECTIONS.items():
        start, end = suite.marks(section)
        inner += (own := text.partition(start)[2].partition(end)[0])
        assert f"]({picture})" in own and (ROOT / picture).stat().st_size < 250_000
    rows = re.findall(r"^\| \[([^\]]+)\]\(netlists/(\S+)\.cir\) \|(.*)\|$", inner, re.M)
    assert [(name, deck) for name, deck, _ in rows] == [(e.name, e.deck) for e in SUITE]
    assert all(cells.count("|") == 3 * len(suite.ERRORS) - 1 for _, _, cells in rows)


def tool(name: str, group: str, *pairs: tuple[float, float]) -> Series:
    return Series(name, group, [Point(f"{e:g}", e, e, s) for e, s in pairs])


@pytest.fixture
def charts() -> list[Chart]:
    made = Chart("LC tank", "tank", ["v(a)"], 50)
    made.group = "circuits"
    made.series = [
        tool("trap", "emsim", (1e-2, 1e-3), (1e-4, 1e-2)),
        tool("radau", "emsim", (1e-3, 2e-3), (1e-9, 2e-2)),
        tool("auto", "emsim", (1e-3, 3e-3), (1e-9, 3e-2)),
        tool("ngspice", "ngspice", (1e-2, 1e-2), (1e-4, 1.0)),
    ]
    other = Chart("double pendulum", "p", ["angle(p1)"], 20)
    other.group = "machines"
    other.series = [
        tool("dop853", "emsim", (1e-3, 1e-4), (1e-9, 4e-4)),
        tool("MuJoCo RK4", "engine", (1e-3, 1e-3), (1e-7, 1e-2)),
        tool("Exudyn RK67", "engine", (1e-3, 4e-3), (1e-9, 1e-2)),
    ]
    return [made, other]


def test_the_table_compares_at_equal_error(charts):
    rows = {re.search(r"\[(.*?)\]", row)[1]: row for row in list(suite.table(charts))[2:]}
    assert len(rows) == len(SUITE)
    cells = [c.strip() for c in rows["LC tank"].split("|")[2:-1]]
    # at 1e-3: radau 2 ms, auto 3 ms, ngspice half way between 10 ms and 1 s; at 1e-6 ngspice is not there
    assert cells[:3] == ["radau 2 ms", "3 ms", "33x ngspice"]
    assert cells[3] == "radau 6.3 ms" and cells[5] == "> 105x ngspice at 1e-04"
    cells = [c.strip() for c in rows["double pendulum"].split("|")[2:-1]]
    # without auto, the peers are measured against the best method
    assert cells[1] == "-" and cells[2] == "10x MuJoCo RK4" and cells[0] == "dop853 0.1 ms"
    assert [c.strip() for c in rows["Bricard"].split("|")[2:-1]] == ["-"] * 6


def test_engines_have_a_table_of_their_own(charts):
    lines = list(suite.engines(charts))
    assert lines[0] == "| machine | error | emsim | MuJoCo | Exudyn |"
    at_1e8 = [c.strip() for c in lines[3].split("|")]
    assert at_1e8[2] == "1e-8" and at_1e8[5].startswith("RK67")
    assert at_1e8[4].startswith("not reached (> ") and "RK4 at " in at_1e8[4]
    assert list(suite.engines(charts[:1])) == []


def test_slow_auto_is_found(charts):
    found = list(suite.slow_auto(charts))
    assert found and all(line.startswith("LC tank") for line in found)
    assert "auto takes 3x, trap" in found[0]
    assert list(suite.slow_auto(charts, allowed=4.0)) == []


def test_it_goes_between_the_marks_and_nowhere_else(charts):
    start, end = suite.marks("suite")
    before = f"# head\n{start}\nold\n{end}\ntail\n"
    text = suite.into(before, suite.section(charts, "p.png"))
    assert text.startswith("# head\n") and text.endswith("\ntail\n") and "old" not in text
    assert "](p.png)" in text and "| machine |" in text
    assert suite.into(text, "x") == suite.into(before, "x")
    with pytest.raises(ValueError, match="suite"):
        suite.into("# head\n", "x")
